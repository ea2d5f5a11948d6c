//! Clearance between wheel and rail on lines along x, cached with their geometry.

/// A line along x on which the wheel lies above the rail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LocusPoint {
    /// y in track axes in mm.
    pub(crate) y: f64,
    /// Clearance at first touch in mm.
    pub(crate) clearance: f64,
    /// Parameter of the rail's curve.
    pub(crate) rail: f64,
    /// Parameter of the wheel's curve.
    pub(crate) wheel: f64,
}

/// All such lines, and the height of the wheel's centre in mm at first touch.
#[derive(Debug)]
pub(crate) struct LocusLines {
    pub(crate) lines: Vec<LocusPoint>,
    pub(crate) touch: f64,
}
