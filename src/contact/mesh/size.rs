//! How many strips and cells a mesh has.

/// Equal strips across every patch, and cells along each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MeshSize {
    /// Strips across each patch.
    pub strips: u32,
    /// Cells along x in each strip.
    pub cells: u32,
}
