//! The lines along x at which a wheel and a rail are above each other, kept with their geometry.

use std::sync::{Arc, OnceLock};

use crate::contact::geometry::envelope::Envelope;

/// One line along x: its y, the upper edge of the rail, and the clearance above first touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LocusPoint {
    pub(crate) y: f64,
    pub(crate) clearance: f64,
    pub(crate) rail: f64,
    pub(crate) wheel: f64,
    /// The inclination there, where the clearance is small.
    pub(crate) inclination: Option<Inclination>,
}

/// Turn about x that lays the track's y along the rail's surface, in rad, and its cosine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Inclination {
    pub(crate) angle: f64,
    pub(crate) cos: f64,
}

/// The lines and the height of first touch in mm.
#[derive(Debug)]
pub(crate) struct LocusLines {
    pub(crate) lines: Vec<LocusPoint>,
    pub(crate) touch: f64,
}

/// The lines of a wheel on a rail and the height of first touch, once they were looked for; or why there are none. They follow from
/// the rest of their geometry, so that they never make two geometries differ.
#[derive(Debug, Clone, Default)]
pub(crate) struct LocusOnce(pub(crate) OnceLock<Arc<Result<LocusLines, String>>>);

impl PartialEq for LocusOnce {
    fn eq(&self, _: &LocusOnce) -> bool {
        true
    }
}

/// The upper edge of a rail in its place, once it was looked for: the same for every place of the wheelset over it. It follows from the rest of
/// the geometry as well.
#[derive(Debug, Clone, Default)]
pub(crate) struct RailEdgeOnce(Arc<OnceLock<Envelope>>);

impl PartialEq for RailEdgeOnce {
    fn eq(&self, _: &RailEdgeOnce) -> bool {
        true
    }
}

impl RailEdgeOnce {
    /// The edge; made at the first call.
    pub(crate) fn get_or_make(&self, make: impl FnOnce() -> Envelope) -> &Envelope {
        self.0.get_or_init(make)
    }
}
