//! From the members `contact` and `load` of a case to the normal problem. Cross-sections are placed in `wheel_task.rs`; the position of the back
//! of a flange and the check of unusual lengths are here.

use std::ops::RangeInclusive;

use crate::case::words::contact::{Contact, FLANGE_BACKS, GAUGE, Load, OnRails};
use crate::error::Fault;
use crate::geometry::profile::{LengthUnit, Profile};
use crate::geometry::wheel_rail::RailPlace;
use crate::normal::footprint::NormalTask;
use crate::normal::gap::surface::GapSurface;
use crate::normal::gap::task::GapTask;
use crate::normal::hertz::{Ellipse, NormalLoad, Patch};
use crate::normal::pressure_field::field::PressureField;
use crate::remark::entry::RemarkEntry;
use crate::remark::kind::short;
use crate::remark::list::Remark;

/// Plausible largest pressures of a patch in MPa.
const PRESSURES: RangeInclusive<f64> = 1e-20..=1e12;
/// Plausible semi-axes of a patch in mm.
const SEMI_AXES: RangeInclusive<f64> = 1e-9..=1e6;
/// Largest plausible ratio of the semi-axes.
const SLENDERNESS_MAX: f64 = 1e4;

/// Returns the normal problem of a contact without cross-sections with its remarks; `None` if it is not such a contact, or if its load or the
/// contact modulus in MPa is unknown.
///
/// # Errors
/// A fault at `/load` or `/contact`, if patches are absurdly large, small, slender or heavily loaded, or if samples are unsuitable.
pub(crate) fn task(
    contact: &Contact,
    load: Option<&Load>,
    contact_modulus: Option<f64>,
    samples_max: usize,
) -> Option<Result<(NormalTask, Vec<RemarkEntry>), Fault>> {
    let loaded = || Some((loading(load?), contact_modulus?));
    Some(match contact {
        Contact::Radii {
            rolling_mm,
            lateral_mm,
        } => {
            let (loading, modulus) = loaded()?;
            hertz(Ellipse::of_radii(
                *rolling_mm,
                *lateral_mm,
                loading,
                modulus,
            ))
        }
        Contact::Ellipse { a_mm, b_mm } => {
            let (loading, modulus) = loaded()?;
            hertz(Ellipse::of_semi_axes(*a_mm, *b_mm, loading, modulus))
        }
        Contact::GapProfile {
            rolling_mm,
            y_mm,
            gap_mm,
        } => {
            let surface = || GapSurface::profile(*rolling_mm, y_mm, gap_mm);
            gap(surface, y_mm.len(), samples_max, loaded()?)
        }
        Contact::GapGrid { x_mm, y_mm, gap_mm } => {
            let samples = x_mm.len().saturating_mul(y_mm.len());
            let surface = || GapSurface::grid(x_mm, y_mm, gap_mm);
            gap(surface, samples, samples_max, loaded()?)
        }
        Contact::PressureGrid {
            x_mm,
            y_mm,
            pressure_mpa,
        } => given(x_mm, y_mm, pressure_mpa, samples_max),
        Contact::Profiles { .. } | Contact::Wheelset { .. } => return None,
    })
}

fn hertz(ellipse: Ellipse) -> Result<(NormalTask, Vec<RemarkEntry>), Fault> {
    plausible(&ellipse.patch(), "/load")?;
    Ok((NormalTask::Hertz(ellipse), Vec::new()))
}

/// Returns the normal problem of a pressure on a grid; `pressure[j][i]` in MPa belongs to `(x[i], y[j])` in mm.
fn given(
    x: &[f64],
    y: &[f64],
    pressure: &[Vec<f64>],
    samples_max: usize,
) -> Result<(NormalTask, Vec<RemarkEntry>), Fault> {
    let pointer = "/contact/pressure_mpa";
    require_few(x.len().saturating_mul(y.len()), samples_max, pointer)?;
    let (field, remarks) =
        PressureField::new(x, y, pressure).map_err(|detail| Fault::new(pointer, detail))?;
    for patch in field.patches() {
        plausible(&patch, pointer)?;
    }
    Ok((NormalTask::Given(field), remarks))
}

/// Returns the normal problem of a gap.
fn gap(
    surface: impl FnOnce() -> GapSurface,
    samples: usize,
    samples_max: usize,
    (loading, contact_modulus): (NormalLoad, f64),
) -> Result<(NormalTask, Vec<RemarkEntry>), Fault> {
    require_few(samples, samples_max, "/contact/gap_mm")?;
    let contact = GapTask {
        gap: surface(),
        loading,
        contact_modulus,
    };
    contact
        .check()
        .map_err(|(pointer, reason)| Fault::new(pointer, reason))?;
    Ok((NormalTask::Gap(Box::new(contact)), Vec::new()))
}

fn require_few(samples: usize, most: usize, pointer: &str) -> Result<(), Fault> {
    if samples <= most {
        return Ok(());
    }
    let detail = format!("{samples} samples given; at most {most} are allowed");
    Err(Fault::new(pointer, detail))
}

/// Refuses a patch that is absurdly large, small, slender or heavily loaded; `load_pointer` points to the load.
pub(crate) fn plausible(patch: &Patch, load_pointer: &str) -> Result<(), Fault> {
    let [x_min, x_max, y_min, y_max] = patch.extent;
    let (a, b) = (0.5 * (x_max - x_min), 0.5 * (y_max - y_min));
    let refused = |pointer: &str, detail: String| Err(Fault::new(pointer, detail));
    if ![a, b].iter().all(|axis| SEMI_AXES.contains(axis)) {
        let (least, most) = (SEMI_AXES.start(), SEMI_AXES.end());
        let (a, b) = (short(a), short(b));
        let detail = format!(
            "a patch with semi-axes of {a} mm by {b} mm results; {least:e} to {most:e} mm are allowed"
        );
        return refused("/contact", detail);
    }
    if patch.area.is_nan() || patch.area <= 0.0 {
        let detail = "the edge of a patch cannot be determined from these samples; a finer or more even grid is needed";
        return refused(load_pointer, detail.to_owned());
    }
    if a.max(b) > SLENDERNESS_MAX * a.min(b) {
        let (a, b) = (short(a), short(b));
        let detail = format!(
            "a patch with semi-axes of {a} mm by {b} mm results; a ratio of at most {SLENDERNESS_MAX:e} is allowed"
        );
        return refused("/contact", detail);
    }
    if !PRESSURES.contains(&patch.pressure_max) {
        let (least, most) = (PRESSURES.start(), PRESSURES.end());
        let largest = short(patch.pressure_max);
        let detail = format!(
            "the largest pressure of a patch is {largest} MPa; {least:e} to {most:e} MPa are allowed"
        );
        return refused(load_pointer, detail);
    }
    Ok(())
}

fn loading(load: &Load) -> NormalLoad {
    match (load.normal_force_n, load.approach_mm) {
        (Some(force), _) => NormalLoad::Force(force),
        (None, approach) => NormalLoad::Approach(approach.unwrap_or(f64::NAN)),
    }
}

/// y of the back of a flange in mm if the origin is the running circle, as in EN 13715.
const BACK_USUAL: f64 = -70.0;
/// Largest difference in mm at which the points agree with the usual position.
const AGREES_WITH_USUAL: f64 = 0.5;
/// Largest difference in mm at which the points agree with a stated position. Backs are measured at different heights.
const AGREES_WITH_STATED: f64 = 5.0;
/// Largest distance in mm from the last point of a flange to a back that was not measured. Flanges are up to 35 mm thick; invented wheels are
/// thicker.
const THICKNESS_MAX: f64 = 60.0;

/// Returns y of the back of the flange in mm, with a remark if it was found from the points or contradicts them.
///
/// # Errors
/// A stated position outside the points of the flange, or points that do not show a position that is not stated.
pub(crate) fn position(
    wheel: &Profile,
    stated: Option<f64>,
    flange_back_distance: f64,
) -> Result<(f64, Option<Remark>), Fault> {
    let found = match stated {
        // Without a distance of the backs, the wheel is placed by its origin.
        Some(given) if flange_back_distance == 0.0 => Ok((given, None)),
        Some(given) => check_stated(wheel, given).map(|remark| (given, remark)),
        None => find(wheel),
    };
    found.map_err(|detail| Fault::new("/contact/flange_back_position_mm", detail))
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
        Some(back) if (back - BACK_USUAL).abs() <= AGREES_WITH_USUAL => Ok((BACK_USUAL, None)),
        Some(back) => {
            // Coordinates in answers have four decimals.
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
            let fits = first < 0.0 && last > 0.0 && first >= BACK_USUAL - AGREES_WITH_USUAL;
            fits.then_some((BACK_USUAL, None)).ok_or_else(|| {
                format!(
                    "no value given, and the points of the wheel, from y = {first:.2} to {last:.2} mm, do not show the back of its flange; \
                     the usual {BACK_USUAL} mm holds only where y = 0 is the running circle: state the position"
                )
            })
        }
    }
}

/// Largest height in mm of a tread over z = 0 without a remark. Worn treads are hollow by less.
const TREAD_HEIGHT_MAX: f64 = 10.0;

/// Returns a remark if the tread is far from z = 0, where the rolling radius is measured.
pub(crate) fn unusual_height(wheel: &Profile, flange_back: f64) -> Option<Remark> {
    let y_mm = flange_back - BACK_USUAL;
    let z_mm = -wheel.lowest_at(y_mm)?;
    (z_mm.abs() > TREAD_HEIGHT_MAX).then_some(Remark::WheelHeightUnusual {
        profile: "wheel",
        y_mm,
        z_mm,
    })
}

/// Returns remarks on lengths of a contact with cross-sections that would be usual in another unit.
pub(crate) fn unusual(rails: &OnRails) -> Vec<RemarkEntry> {
    let placement = &rails.placement;
    // Usual values are those of standard gauge and of UIC wheels with a diameter of 920 mm.
    let place = match placement.rail {
        RailPlace::Gauge { gauge, .. } => ("gauge_mm", gauge, GAUGE),
        RailPlace::Origin(origin) => ("rail_origin_mm", origin, 752.5),
    };
    let backs = placement.flange_back_distance;
    let lengths = [
        place,
        ("flange_back_distance_mm", backs, FLANGE_BACKS),
        ("rolling_radius_mm", placement.rolling_radius, 460.0),
    ];
    let remark = |(name, length_mm, usual): (&str, f64, f64)| {
        let unit = LengthUnit::likely(length_mm, usual).filter(|unit| *unit != LengthUnit::Mm)?;
        let unit = unit.name();
        let pointer = format!("/contact/{name}");
        Some(Remark::LengthUnusual { length_mm, unit }.at_pointer(&pointer))
    };
    lengths.into_iter().filter_map(remark).collect()
}

/// Appends the remarks on unusual lengths to faults of the placement, which may be their reason.
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
