//! A pressure given by the client on a grid, brought onto strips without losing load.

use crate::contact::mesh::Chord;
use crate::contact::normal::Patch;

/// Pressure samples on a rectangular grid and the patches they form.
#[derive(Debug, Clone, PartialEq)]
pub struct PressureField {}

impl PressureField {
    /// Finds the patches.
    pub fn new(
        _x: &[f64],
        _y: &[f64],
        _pressure: &[Vec<f64>],
    ) -> Result<(PressureField, Vec<String>), String> {
        todo!()
    }

    /// Segments per strip.
    #[must_use]
    pub fn segments_per_strip(&self) -> Vec<f64> {
        todo!()
    }

    /// The patches found, in order of their smallest y.
    #[must_use]
    pub fn patches(&self) -> Vec<Patch> {
        todo!()
    }

    /// Chords of one patch on the given strips.
    #[must_use]
    pub fn chords(&self, _patch: usize, _strips: &[(f64, f64)]) -> Vec<Chord> {
        todo!()
    }

    /// Mean pressure over part of a chord.
    #[must_use]
    pub fn mean_pressure(&self, _chord: &Chord, _x0: f64, _x1: f64) -> f64 {
        todo!()
    }
}
