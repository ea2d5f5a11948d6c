//! Strips fitted to the patch, cells graded toward both ends. The order of all cell values is defined here.
//!
//! Cells are numbered segment by segment (segments sorted by patch, then y, then x), in each segment from the
//! trailing end (smaller x) to the leading end (larger x).

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
