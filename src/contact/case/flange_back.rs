//! The position of a flange's back in the cross-section of a wheel: stated, or found from the points.

use crate::contact::error::Fault;
use crate::contact::geometry::profile::Profile;
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::remark::list::Remark;

/// y of the back in mm where the origin is the running circle, as in EN 13715.
const USUAL: f64 = -70.0;
/// Difference in mm up to which the points agree with the usual position.
const AGREES: f64 = 0.5;
/// Difference in mm up to which the points agree with a stated position: backs are measured at different heights.
const AGREES_WITH_STATED: f64 = 5.0;
/// Largest distance in mm from the last point of a flange to a back that was not measured. Flanges are up to 35 mm thick; made-up wheels are thicker.
const THICKNESS_MAX: f64 = 60.0;
const MEMBER: &str = "/contact/flange_back_position_mm";

/// y of the back of the flange in mm, with a remark at the pointer of the wheel.
///
/// # Errors
/// A stated position outside the points of a flange, or none although the points do not show it.
pub(crate) fn position(
    wheel: &Profile,
    pointer: &str,
    stated: Option<f64>,
    flange_back_distance: f64,
) -> Result<(f64, Option<RemarkEntry>), Fault> {
    let found = match stated {
        // A wheel without a distance of backs is placed by its origin.
        Some(given) if flange_back_distance == 0.0 => Ok((given, None)),
        Some(given) => check_stated(wheel, given).map(|remark| (given, remark)),
        None => find(wheel),
    };
    match found {
        Ok((back, remark)) => Ok((back, remark.map(|remark| remark.at_pointer(pointer)))),
        Err(detail) => Err(Fault::new(MEMBER, detail)),
    }
}

fn check_stated(wheel: &Profile, given: f64) -> Result<Option<Remark>, String> {
    let Some(flange) = wheel.flange() else {
        return Ok(None);
    };
    let [first, last] = wheel.width();
    let least = match flange.back {
        Some(back) => back.min(first) - AGREES_WITH_STATED,
        None => flange.end - THICKNESS_MAX,
    };
    if !(least..=last).contains(&given) {
        let back = flange.back.map_or_else(String::new, |back| {
            format!(", and the back of their flange lies at y = {back:.2} mm")
        });
        return Err(format!(
            "{given} given, which is outside the points of the wheel: they reach from y = {first:.2} to {last:.2} mm{back}; \
             {least:.1} to {last:.1} mm are allowed"
        ));
    }
    Ok(flange
        .back
        .filter(|back| (back - given).abs() > AGREES_WITH_STATED)
        .map(|found_mm| Remark::FlangeBackContradicted {
            profile: "wheel",
            given_mm: given,
            found_mm,
        }))
}

fn find(wheel: &Profile) -> Result<(f64, Option<Remark>), String> {
    match wheel.flange().and_then(|flange| flange.back) {
        Some(back) if (back - USUAL).abs() <= AGREES => Ok((USUAL, None)),
        Some(back) => {
            // Four decimals, as coordinates are answered.
            let back = (1e4 * back).round() / 1e4;
            let remark = Remark::FlangeBackFound {
                profile: "wheel",
                position_mm: back,
            };
            Ok((back, Some(remark)))
        }
        // The usual position belongs to points whose y is 0 at the running circle.
        None => {
            let [first, last] = wheel.width();
            let fits = first < 0.0 && last > 0.0 && first >= USUAL - AGREES;
            fits.then_some((USUAL, None)).ok_or_else(|| {
                format!(
                    "no value given, and the points of the wheel, from y = {first:.2} to {last:.2} mm, do not show the back of its flange; \
                     the usual {USUAL} mm holds only where y = 0 is the running circle: state the position"
                )
            })
        }
    }
}
