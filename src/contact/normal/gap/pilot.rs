//! What a coarse grid shows of the contact of a gap.

use std::sync::OnceLock;

/// A patch of the coarse grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PilotPatch {
    /// Half-length along rolling and half-width in mm.
    pub half: [f64; 2],
    /// Load in N.
    pub force: f64,
}

/// The contact as a coarse grid shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct GapPilot {
    /// Patches, from the heaviest on.
    pub patches: Vec<PilotPatch>,
    /// Cells along x and y of one grid that would resolve them at the usual target.
    pub cells_needed: [usize; 2],
}

/// A pilot, once it was made. It follows from the rest of its task, so that two of them never make tasks differ.
#[derive(Debug, Clone, Default)]
pub struct PilotOnce(OnceLock<Option<GapPilot>>);

impl PartialEq for PilotOnce {
    fn eq(&self, _: &PilotOnce) -> bool {
        true
    }
}

impl PilotOnce {
    /// The pilot; made at the first call.
    pub fn get_or_make(&self, make: impl FnOnce() -> Option<GapPilot>) -> Option<&GapPilot> {
        self.0.get_or_init(make).as_ref()
    }
}
