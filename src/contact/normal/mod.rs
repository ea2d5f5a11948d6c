//! How hard is it pressed? Contact region and pressure, whatever they come from.

pub mod hertz;
pub mod prescribed;

use crate::contact::mesh::Chord;

/// A contact region with its pressure.
#[derive(Debug, Clone, PartialEq)]
pub enum Region {
    /// Hertz's ellipse, in closed form.
    Ellipse(hertz::Ellipse),
    /// A pressure given on a grid.
    Grid(prescribed::PressureField),
}

/// What is known of one patch before anything is meshed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Normal force in N.
    pub normal_force: f64,
    /// Approach in mm, where it is known.
    pub approach: Option<f64>,
    /// Area in mm².
    pub area: f64,
    /// Largest pressure in MPa.
    pub pressure_max: f64,
    /// Semi-axes along and across rolling in mm, for ellipses.
    pub semi_axes: Option<[f64; 2]>,
    /// `[x_min, x_max, y_min, y_max]` in mm.
    pub extent: [f64; 4],
}

impl Region {
    /// The patches, in order of their smallest y.
    #[must_use]
    pub fn patches(&self) -> Vec<Patch> {
        match self {
            Region::Ellipse(ellipse) => vec![ellipse.patch()],
            Region::Grid(field) => field.patches(),
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
        }
    }

    /// Mean pressure in MPa over `x0 < x < x1` on the line of a chord (not yet scaled to the patch's force).
    #[must_use]
    pub fn mean_pressure(&self, chord: &Chord, x0: f64, x1: f64) -> f64 {
        match self {
            Region::Ellipse(ellipse) => ellipse.mean_pressure(chord, x0, x1),
            Region::Grid(field) => field.mean_pressure(chord, x0, x1),
        }
    }
}
