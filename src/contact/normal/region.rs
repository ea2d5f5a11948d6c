//! How hard is it pressed? Contact region and pressure, whatever they come from.

use std::sync::Arc;

use crate::contact::case::words::{Contact, Load};
use crate::contact::error::Fault;
use crate::contact::mesh::strips::Chord;
use crate::contact::normal::gap::surface::GapSurface;
use crate::contact::normal::gap::task::GapTask;
use crate::contact::normal::hertz::{Ellipse, Pressing};
use crate::contact::normal::patch::Patch;
use crate::contact::normal::pressure_field::field::PressureField;
use crate::contact::normal::wheel_height::task::WheelTask;
use crate::contact::remark::entry::RemarkEntry;

/// Pressures in MPa, lengths in mm and ratios of semi-axes beyond which a patch is a mistake rather than a contact.
const PRESSURE_MAX: f64 = 1e12;
const PRESSURE_MIN: f64 = 1e-20;
const SEMI_AXIS_MAX: f64 = 1e6;
const SEMI_AXIS_MIN: f64 = 1e-9;
const SLENDERNESS_MAX: f64 = 1e4;

/// A contact region with its pressure.
#[derive(Debug, Clone, PartialEq)]
pub enum Region {
    /// Hertz's ellipse, in closed form.
    Ellipse(Ellipse),
    /// A pressure on a grid.
    Grid(PressureField),
    /// A gap: region and pressure have to be found first, until then there are no patches.
    Gap(Box<GapTask>),
    /// A wheel on a rail: patches have to be found first, each in a frame of its own, until then there are none.
    Profiles(Arc<WheelTask>),
}

impl Region {
    /// Is it Hertz's ellipse, in closed form?
    #[must_use]
    pub fn is_ellipse(&self) -> bool {
        matches!(self, Region::Ellipse(_))
    }

    /// Hertz's ellipse for `radii` or `ellipse`, with the contact modulus `E*` in MPa.
    ///
    /// # Errors
    /// A fault at `/load` or `/contact` if the patch is absurdly large, small, slender or heavily loaded.
    pub fn hertz(contact: &Contact, load: &Load, contact_modulus: f64) -> Result<Region, Fault> {
        let pressing = pressing(load);
        let ellipse = match *contact {
            Contact::Radii {
                rolling_mm,
                lateral_mm,
            } => Ellipse::of_radii(rolling_mm, lateral_mm, pressing, contact_modulus),
            Contact::Ellipse { a_mm, b_mm } => {
                Ellipse::of_semi_axes(a_mm, b_mm, pressing, contact_modulus)
            }
            Contact::GapProfile { .. }
            | Contact::GapGrid { .. }
            | Contact::PressureGrid { .. }
            | Contact::Profiles { .. } => {
                return Err(fault(
                    "/contact/type",
                    "neither gaps nor profiles nor pressures on a grid make an ellipse".to_owned(),
                ));
            }
        };
        plausible(&ellipse.patch(), "/load")?;
        Ok(Region::Ellipse(ellipse))
    }

    /// The region where a pressure given on a grid is positive, with remarks for the answer;
    /// `pressure[j][i]` in MPa belongs to `(x[i], y[j])` in mm.
    ///
    /// # Errors
    /// A fault in `/contact` if the grid has too many samples, no contact or too many patches.
    pub fn prescribed(
        x: &[f64],
        y: &[f64],
        pressure: &[Vec<f64>],
        samples_max: usize,
    ) -> Result<(Region, Vec<RemarkEntry>), Fault> {
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
        Ok((Region::Grid(field), remarks))
    }

    /// The region of a gap, yet to be found, with the contact modulus `E*` in MPa.
    ///
    /// # Errors
    /// A fault if the gap has too many samples, no least value inside, or an approach that does not reach it; or if the
    /// contact is no gap.
    pub fn gap(
        contact: &Contact,
        load: &Load,
        contact_modulus: f64,
        samples_max: usize,
    ) -> Result<Region, Fault> {
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
            pressing: pressing(load),
            contact_modulus,
        };
        contact
            .check()
            .map_err(|(pointer, reason)| fault(pointer, reason))?;
        Ok(Region::Gap(Box::new(contact)))
    }

    /// Segments that a strip has on average, for each patch: more than 1 where patches are hollow or bent. A gap counts as
    /// one plain patch until its region is found.
    #[must_use]
    pub fn segments_per_strip(&self) -> Vec<f64> {
        match self {
            Region::Ellipse(_) => vec![1.0],
            Region::Grid(field) => field.segments_per_strip(),
            Region::Gap(_) | Region::Profiles(_) => vec![1.0],
        }
    }

    /// The patches, in order of their smallest y.
    #[must_use]
    pub fn patches(&self) -> Vec<Patch> {
        match self {
            Region::Ellipse(ellipse) => vec![ellipse.patch()],
            Region::Grid(field) => field.patches(),
            Region::Gap(_) | Region::Profiles(_) => Vec::new(),
        }
    }

    /// Chords of one patch along the lines `y`, each standing for a strip of width `dy`; strips that miss the
    /// patch have no chord, strips that cross it several times have several, from smaller to larger x.
    ///
    /// `strips` lists `(y, dy)` of the strips from smaller to larger y; all lengths in mm.
    #[must_use]
    pub fn chords(&self, patch: usize, strips: &[(f64, f64)]) -> Vec<Chord> {
        match self {
            Region::Ellipse(ellipse) => ellipse.chords(strips),
            Region::Grid(field) => field.chords(patch, strips),
            Region::Gap(_) | Region::Profiles(_) => Vec::new(),
        }
    }

    /// Mean pressure in MPa over `x0 < x < x1` on the line of a chord (not yet scaled to the patch's force).
    #[must_use]
    pub fn mean_pressure(&self, chord: &Chord, x0: f64, x1: f64) -> f64 {
        match self {
            Region::Ellipse(ellipse) => ellipse.mean_pressure(chord, x0, x1),
            Region::Grid(field) => field.mean_pressure(chord, x0, x1),
            Region::Gap(_) | Region::Profiles(_) => 0.0,
        }
    }
}

/// Refuses a patch that is absurdly large, small, slender or heavily loaded; `load_pointer` is what loads it.
fn plausible(patch: &Patch, load_pointer: &str) -> Result<(), Fault> {
    let [x_min, x_max, y_min, y_max] = patch.extent;
    let (a, b) = (0.5 * (x_max - x_min), 0.5 * (y_max - y_min));
    let semi_axes = SEMI_AXIS_MIN..=SEMI_AXIS_MAX;
    if !semi_axes.contains(&a) || !semi_axes.contains(&b) {
        return Err(fault(
            "/contact",
            format!(
                "a patch of {a:.3e} mm by {b:.3e} mm (semi-axes) comes out; {SEMI_AXIS_MIN:e} to {SEMI_AXIS_MAX:e} mm \
                 are allowed"
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
                "a patch of {a:.3e} mm by {b:.3e} mm (semi-axes) comes out; a ratio of at most {SLENDERNESS_MAX:e} is \
                 allowed"
            ),
        ));
    }
    if !(PRESSURE_MIN..=PRESSURE_MAX).contains(&patch.pressure_max) {
        return Err(fault(
            load_pointer,
            format!(
                "the largest pressure of a patch comes out as {:.3e} MPa; {PRESSURE_MIN:e} to {PRESSURE_MAX:e} MPa are \
                 allowed",
                patch.pressure_max
            ),
        ));
    }
    Ok(())
}

fn pressing(load: &Load) -> Pressing {
    match (load.normal_force_n, load.approach_mm) {
        (Some(force), _) => Pressing::Force(force),
        (None, approach) => Pressing::Approach(approach.unwrap_or(f64::NAN)),
    }
}

fn fault(pointer: &str, detail: String) -> Fault {
    Fault {
        pointer: pointer.to_owned(),
        detail,
    }
}
