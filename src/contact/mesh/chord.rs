//! Lines across a patch.

/// The part of a strip's mid-line that lies in a patch, in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chord {
    /// The patch it belongs to, counted from 0.
    pub patch: usize,
    /// The strip of the patch, counted from 0 in the direction of y.
    pub strip: usize,
    /// y of the strip's mid-line.
    pub y: f64,
    /// Width of the strip.
    pub dy: f64,
    /// Trailing end.
    pub left: f64,
    /// Leading end.
    pub right: f64,
}

impl Chord {
    /// x in mm of the place `−half · cosine` from the middle.
    #[must_use]
    pub fn along(&self, cosine: f64) -> f64 {
        0.5 * (self.left + self.right) - 0.5 * (self.right - self.left) * cosine
    }
}
