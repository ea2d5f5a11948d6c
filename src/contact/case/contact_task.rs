//! What a case asks of the normal problem: from the words of contact and load to a checked task. Wheel on rail: see `wheel_task.rs`.
//!
//! The position of a flange's back in the cross-section of a wheel: stated, or found from the points.
//!
//! Lengths of track and wheelset that would be usual in another unit than mm.

use std::ops::RangeInclusive;

use crate::case::words::contact::{Contact, Load};
use crate::error::Fault;
use crate::geometry::profile::{LengthUnit, Profile};
use crate::normal::footprint::NormalTask;
use crate::normal::gap::surface::GapSurface;
use crate::normal::gap::task::{GapTask, PreviewCache};
use crate::normal::hertz::{Ellipse, NormalLoad, Patch};
use crate::normal::pressure_field::field::PressureField;
use crate::remark::entry::RemarkEntry;
use crate::remark::kind::short;
use crate::remark::list::Remark;

/// Largest pressures of a patch in MPa; others are a mistake rather than a contact.
const PRESSURES: RangeInclusive<f64> = 1e-20..=1e12;
/// Semi-axes in mm.
const SEMI_AXES: RangeInclusive<f64> = 1e-9..=1e6;
/// Largest ratio of the semi-axes.
const SLENDERNESS_MAX: f64 = 1e4;

/// Hertz's ellipse for `radii` or `ellipse`, with the contact modulus `E*` in MPa.
///
/// # Errors
/// A fault at `/load` or `/contact` if the patch is absurdly large, small, slender or heavily loaded.
pub(crate) fn hertz(
    contact: &Contact,
    load: &Load,
    contact_modulus: f64,
) -> Result<NormalTask, Fault> {
    let loading = loading(load);
    let ellipse = match *contact {
        Contact::Radii {
            rolling_mm,
            lateral_mm,
        } => Ellipse::of_radii(rolling_mm, lateral_mm, loading, contact_modulus),
        Contact::Ellipse { a_mm, b_mm } => {
            Ellipse::of_semi_axes(a_mm, b_mm, loading, contact_modulus)
        }
        _ => {
            return Err(Fault::new(
                "/contact/type",
                "neither gaps nor profiles nor pressures on a grid make an ellipse".to_owned(),
            ));
        }
    };
    plausible(&ellipse.patch(), "/load")?;
    Ok(NormalTask::Hertz(ellipse))
}

/// A pressure given on a grid, with remarks for the answer;
/// `pressure[j][i]` in MPa belongs to `(x[i], y[j])` in mm.
///
/// # Errors
/// A fault in `/contact` if the grid has too many samples, no contact or too many patches.
pub(crate) fn given(
    x: &[f64],
    y: &[f64],
    pressure: &[Vec<f64>],
    samples_max: usize,
) -> Result<(NormalTask, Vec<RemarkEntry>), Fault> {
    let samples = x.len().saturating_mul(y.len());
    if samples > samples_max {
        return Err(Fault::new(
            "/contact/pressure_mpa",
            format!("{samples} samples given; at most {samples_max} are allowed"),
        ));
    }
    let (field, remarks) = PressureField::new(x, y, pressure)
        .map_err(|detail| Fault::new("/contact/pressure_mpa", detail))?;
    for patch in field.patches() {
        plausible(&patch, "/contact/pressure_mpa")?;
    }
    Ok((NormalTask::Given(field), remarks))
}

/// The task of a gap, with the contact modulus `E*` in MPa.
///
/// # Errors
/// A fault if the gap has too many samples, no least value inside, or an approach that does not reach it; or if the
/// contact is no gap.
pub(crate) fn gap(
    contact: &Contact,
    load: &Load,
    contact_modulus: f64,
    samples_max: usize,
) -> Result<NormalTask, Fault> {
    let (gap, samples) = match contact {
        Contact::GapProfile {
            rolling_mm,
            y_mm,
            gap_mm,
        } => (GapSurface::profile(*rolling_mm, y_mm, gap_mm), y_mm.len()),
        Contact::GapGrid { x_mm, y_mm, gap_mm } => {
            let samples = x_mm.len().saturating_mul(y_mm.len());
            (GapSurface::grid(x_mm, y_mm, gap_mm), samples)
        }
        _ => return Err(Fault::new("/contact/type", "not a gap".to_owned())),
    };
    if samples > samples_max {
        return Err(Fault::new(
            "/contact/gap_mm",
            format!("{samples} samples given; at most {samples_max} are allowed"),
        ));
    }
    let contact = GapTask {
        gap,
        loading: loading(load),
        contact_modulus,
        seen: PreviewCache::default(),
    };
    contact
        .check()
        .map_err(|(pointer, reason)| Fault::new(pointer, reason))?;
    Ok(NormalTask::Gap(Box::new(contact)))
}

/// Refuses a patch that is absurdly large, small, slender or heavily loaded; `load_pointer` is what loads it.
pub(crate) fn plausible(patch: &Patch, load_pointer: &str) -> Result<(), Fault> {
    let [x_min, x_max, y_min, y_max] = patch.extent;
    let (a, b) = (0.5 * (x_max - x_min), 0.5 * (y_max - y_min));
    if ![a, b].iter().all(|axis| SEMI_AXES.contains(axis)) {
        return Err(Fault::new(
            "/contact",
            format!(
                "a patch with semi-axes of {} mm by {} mm results; {:e} to {:e} mm are allowed",
                short(a),
                short(b),
                SEMI_AXES.start(),
                SEMI_AXES.end()
            ),
        ));
    }
    if patch.area.is_nan() || patch.area <= 0.0 {
        return Err(Fault::new(
            load_pointer,
            "the edge of a patch cannot be determined from these samples; a finer or more even grid is needed".to_owned(),
        ));
    }
    if a.max(b) > SLENDERNESS_MAX * a.min(b) {
        return Err(Fault::new(
            "/contact",
            format!(
                "a patch with semi-axes of {} mm by {} mm results; a ratio of at most {SLENDERNESS_MAX:e} is allowed",
                short(a),
                short(b)
            ),
        ));
    }
    if !PRESSURES.contains(&patch.pressure_max) {
        return Err(Fault::new(
            load_pointer,
            format!(
                "the largest pressure of a patch is {} MPa; {:e} to {:e} MPa are allowed",
                short(patch.pressure_max),
                PRESSURES.start(),
                PRESSURES.end()
            ),
        ));
    }
    Ok(())
}

fn loading(load: &Load) -> NormalLoad {
    match (load.normal_force_n, load.approach_mm) {
        (Some(force), _) => NormalLoad::Force(force),
        (None, approach) => NormalLoad::Approach(approach.unwrap_or(f64::NAN)),
    }
}

/// y of the back in mm where the origin is the running circle, as in EN 13715.
const USUAL: f64 = -70.0;
/// Difference in mm up to which the points agree with the usual position.
const AGREES: f64 = 0.5;
/// Difference in mm up to which the points agree with a stated position: backs are measured at different heights.
const AGREES_WITH_STATED: f64 = 5.0;
/// Largest distance in mm from the last point of a flange to a back that was not measured. Flanges are up to 35 mm thick; made-up wheels are thicker.
const THICKNESS_MAX: f64 = 60.0;

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
    found
        .map(|(back, remark)| (back, remark.map(|remark| remark.at_pointer(pointer))))
        .map_err(|detail| Fault::new("/contact/flange_back_position_mm", detail))
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

/// Usual gauge in mm: standard gauge.
pub(crate) const GAUGE: f64 = 1435.0;
/// Usual distance of the backs of the flanges in mm, on standard gauge.
pub(crate) const FLANGE_BACKS: f64 = 1360.0;

/// Remarks on the lengths of a wheel or a wheelset on rails, each with the pointer to its member.
pub(crate) fn unusual(contact: &Contact) -> Vec<RemarkEntry> {
    let (Contact::Profiles {
        gauge_mm,
        rail_origin_mm,
        flange_back_distance_mm,
        rolling_radius_mm,
        ..
    }
    | Contact::Wheelset {
        gauge_mm,
        rail_origin_mm,
        flange_back_distance_mm,
        rolling_radius_mm,
        ..
    }) = contact
    else {
        return Vec::new();
    };
    // Usual values on standard gauge, for UIC wheels of 920 mm diameter.
    let lengths = [
        ("/contact/gauge_mm", *gauge_mm, GAUGE),
        ("/contact/rail_origin_mm", *rail_origin_mm, 752.5),
        (
            "/contact/flange_back_distance_mm",
            Some(*flange_back_distance_mm),
            FLANGE_BACKS,
        ),
        (
            "/contact/rolling_radius_mm",
            Some(*rolling_radius_mm),
            460.0,
        ),
    ];
    let remark = |(pointer, length_mm, usual): (&str, Option<f64>, f64)| {
        let length_mm = length_mm?;
        let unit = LengthUnit::likely(length_mm, usual).filter(|unit| *unit != LengthUnit::Mm)?;
        let unit = unit.name();
        Some(Remark::LengthUnusual { length_mm, unit }.at_pointer(pointer))
    };
    lengths.into_iter().filter_map(remark).collect()
}

/// Faults of the placement, with the lengths that may be the reason.
pub(crate) fn explained(faults: Vec<Fault>, unusual: &[RemarkEntry]) -> Vec<Fault> {
    let explain = |mut fault: Fault| {
        let about_place = ["/contact", "/contact/rolling_radius_mm"];
        if about_place.contains(&fault.pointer.as_str()) {
            for remark in unusual {
                let pointer = remark.pointer.as_deref().unwrap_or_default();
                fault.detail = format!("{}; {pointer}: {}", fault.detail, remark.detail);
            }
        }
        fault
    };
    faults.into_iter().map(explain).collect()
}
