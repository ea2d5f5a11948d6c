//! The lines along x at which a wheel and a rail are above each other, kept with their geometry.

/// One line along x: its y, the upper edge of the rail, and the clearance above first touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LocusPoint {
    pub(crate) y: f64,
    pub(crate) clearance: f64,
    pub(crate) rail: f64,
    pub(crate) wheel: f64,
}

/// The lines and the height of first touch in mm.
#[derive(Debug)]
pub(crate) struct LocusLines {
    pub(crate) lines: Vec<LocusPoint>,
    pub(crate) touch: f64,
}
