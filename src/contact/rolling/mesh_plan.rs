//! What a mesh is made from.

use crate::contact::mesh::size::MeshSize;

/// The size of a mesh and where it is graded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshPlan {
    /// Strips and cells.
    pub size: MeshSize,
    /// The point about which strips and cells gather, along the chords and across the patch, each from −1 to 1. Without one, strips are equal
    /// and cells are cosine-graded.
    pub pole: Option<[f64; 2]>,
}

impl From<MeshSize> for MeshPlan {
    fn from(size: MeshSize) -> Self {
        MeshPlan { size, pole: None }
    }
}
