//! How fine a solution is to be, and the size and grading of a mesh.

use crate::contact::mesh::strips::MeshSize;

/// The target that stands for an explicit mesh where a search needs one. Chosen by judgement; how much it matters was not measured.
const TARGET_OF_MESH: f64 = 0.005;
/// Part of a target that another error may take up while the rest of it is still sought.
const ERROR_MAX: f64 = 0.95;

/// Least target of an error relative to μN: no mesh resolves less.
pub const TARGET_LEAST: f64 = 1e-4;

/// What the target of an error is a share of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RelativeTo {
    /// The friction limit μN.
    #[default]
    FrictionLimit,
    /// The tangential force.
    Force,
}

/// Mesh chosen by the solver for a target, or given by the client.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Resolution {
    /// Allowed error of the resultants relative to μN.
    Target(f64),
    /// An explicit mesh.
    Mesh(MeshSize),
}

impl Resolution {
    /// The target, if there is one.
    #[must_use]
    pub fn target(self) -> Option<f64> {
        match self {
            Resolution::Target(target) => Some(target),
            Resolution::Mesh(_) => None,
        }
    }

    /// The target, or what stands for it with an explicit mesh.
    #[must_use]
    pub fn target_or_usual(self) -> f64 {
        self.target().unwrap_or(TARGET_OF_MESH)
    }

    /// The target reduced so that its root sum of squares with another error equals the original; unchanged if that error is 0, or takes up
    /// the target so that the finest meshes would hardly meet the rest.
    #[must_use]
    pub fn beside(self, error: f64) -> Resolution {
        match self {
            Resolution::Target(target) if 0.0 < error && error < ERROR_MAX * target => {
                Resolution::Target((target * target - error * error).sqrt())
            }
            unchanged => unchanged,
        }
    }
}

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
