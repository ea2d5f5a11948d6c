//! The answer on a companion of a mesh.

use crate::contact::rolling::resultants::Resultants;

/// What is known from a companion.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum CompanionAnswer {
    /// It was not solved.
    #[default]
    Untried,
    /// There is none: the mesh is too small to be halved, or the iteration did not converge.
    Missing,
    /// Resultants of every patch on the companion, and by how much their change from the mesh would be larger on exactly half the
    /// strips or cells if errors are of second order.
    Found(Vec<Resultants>, f64),
}
