//! Hertz's elliptic contact in closed form.

use crate::contact::mesh::Chord;
use crate::contact::normal::Patch;

/// An elliptic patch with Hertz's pressure `p0 √(1 − x²/a² − y²/b²)`, centred at the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse {
    /// Semi-axis along rolling in mm.
    pub a: f64,
    /// Semi-axis across rolling in mm.
    pub b: f64,
    /// Largest pressure in MPa.
    pub pressure_max: f64,
    /// Approach in mm.
    pub approach: f64,
}

impl Ellipse {
    /// Force, area and extent.
    #[must_use]
    pub fn patch(&self) -> Patch {
        todo!()
    }

    /// Chords on the given strips.
    #[must_use]
    pub fn chords(&self, _strips: &[(f64, f64)]) -> Vec<Chord> {
        todo!()
    }

    /// Mean pressure over part of a chord, in closed form.
    #[must_use]
    pub fn mean_pressure(&self, _chord: &Chord, _x0: f64, _x1: f64) -> f64 {
        todo!()
    }
}
