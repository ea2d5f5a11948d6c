//! The number of strips and cells of a mesh.

/// The number of strips across every patch and of cells in each strip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MeshSize {
    /// Strips across each patch.
    pub strips: u32,
    /// Cells along x in each strip.
    pub cells: u32,
}
