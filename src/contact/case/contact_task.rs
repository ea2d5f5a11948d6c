//! What a case asks of the normal problem: from the words of contact and load to a checked task. Wheel on rail: see `wheel_task.rs`.

use crate::contact::case::words::contact::{Contact, Load};
use crate::contact::error::Fault;
use crate::contact::normal::gap::preview::PreviewCache;
use crate::contact::normal::gap::surface::GapSurface;
use crate::contact::normal::gap::task::GapTask;
use crate::contact::normal::hertz::{Ellipse, NormalLoad};
use crate::contact::normal::normal_task::NormalTask;
use crate::contact::normal::patch::Patch;
use crate::contact::normal::pressure_field::field::PressureField;
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::remark::kind::short;

/// Largest pressure of a patch in MPa; a larger one is a mistake rather than a contact.
const PRESSURE_MAX: f64 = 1e12;
/// Smallest one.
const PRESSURE_MIN: f64 = 1e-20;
/// Largest semi-axis in mm.
const SEMI_AXIS_MAX: f64 = 1e6;
/// Smallest one.
const SEMI_AXIS_MIN: f64 = 1e-9;
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
        Contact::GapProfile { .. }
        | Contact::GapGrid { .. }
        | Contact::PressureGrid { .. }
        | Contact::Profiles { .. }
        | Contact::Wheelset { .. } => {
            return Err(fault(
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
        return Err(fault(
            "/contact/pressure_mpa",
            format!("{samples} samples given; at most {samples_max} are allowed"),
        ));
    }
    let (field, remarks) = PressureField::new(x, y, pressure)
        .map_err(|detail| fault("/contact/pressure_mpa", detail))?;
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
        _ => return Err(fault("/contact/type", "not a gap".to_owned())),
    };
    if samples > samples_max {
        return Err(fault(
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
        .map_err(|(pointer, reason)| fault(pointer, reason))?;
    Ok(NormalTask::Gap(Box::new(contact)))
}

/// Refuses a patch that is absurdly large, small, slender or heavily loaded; `load_pointer` is what loads it.
pub(crate) fn plausible(patch: &Patch, load_pointer: &str) -> Result<(), Fault> {
    let [x_min, x_max, y_min, y_max] = patch.extent;
    let (a, b) = (0.5 * (x_max - x_min), 0.5 * (y_max - y_min));
    let semi_axes = SEMI_AXIS_MIN..=SEMI_AXIS_MAX;
    if !semi_axes.contains(&a) || !semi_axes.contains(&b) {
        return Err(fault(
            "/contact",
            format!(
                "a patch of {} mm by {} mm (semi-axes) comes out; {SEMI_AXIS_MIN:e} to {SEMI_AXIS_MAX:e} mm are allowed",
                short(a),
                short(b)
            ),
        ));
    }
    if patch.area.is_nan() || patch.area <= 0.0 {
        return Err(fault(
            load_pointer,
            "the edge of a patch cannot be told from these samples; a finer or more even grid is needed".to_owned(),
        ));
    }
    if a.max(b) > SLENDERNESS_MAX * a.min(b) {
        return Err(fault(
            "/contact",
            format!(
                "a patch of {} mm by {} mm (semi-axes) comes out; a ratio of at most {SLENDERNESS_MAX:e} is allowed",
                short(a),
                short(b)
            ),
        ));
    }
    if !(PRESSURE_MIN..=PRESSURE_MAX).contains(&patch.pressure_max) {
        return Err(fault(
            load_pointer,
            format!(
                "the largest pressure of a patch comes out as {} MPa; {PRESSURE_MIN:e} to {PRESSURE_MAX:e} MPa are allowed",
                short(patch.pressure_max)
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

fn fault(pointer: &str, detail: String) -> Fault {
    Fault::new(pointer, detail)
}
