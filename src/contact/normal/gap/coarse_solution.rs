//! What a coarse grid shows of the contact of a gap.

/// A patch of the coarse grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoarsePatch {
    /// Half-length along rolling and half-width in mm.
    pub half: [f64; 2],
    /// Load in N.
    pub force: f64,
}

/// The contact as a coarse grid shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct CoarseGap {
    /// Patches, from the heaviest on.
    pub patches: Vec<CoarsePatch>,
    /// Cells along x and y of one grid that would resolve them at the usual target.
    pub cells_needed: [usize; 2],
}
