//! The lines along x at which a wheel and a rail are above each other, kept with their geometry.

use crate::contact::geometry::envelope::Envelope;
use crate::contact::lazy_field::LazyField;

/// One line along x: its y, the upper edge of the rail, and the clearance above first touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LocusPoint {
    pub(crate) y: f64,
    pub(crate) clearance: f64,
    pub(crate) rail: f64,
    pub(crate) wheel: f64,
    /// Number of the line among those of the rail's edge.
    pub(crate) of_rail: usize,
}

/// Turn about x that lays the track's y along the rail's surface, in rad, and its cosine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Inclination {
    pub(crate) angle: f64,
    pub(crate) cos: f64,
}

/// The rail's upper edge line by line, the same for every place of the wheelset over it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RailEdge {
    pub(crate) edge: Envelope,
    /// Its inclinations, each found when it is first asked for.
    pub(crate) inclinations: Vec<LazyField<Inclination>>,
}

/// The lines and the height of first touch in mm.
#[derive(Debug)]
pub(crate) struct LocusLines {
    pub(crate) lines: Vec<LocusPoint>,
    pub(crate) touch: f64,
}
