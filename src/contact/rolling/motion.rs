//! The relative motion of two rolling bodies.

/// Velocity of the upper body relative to the lower one, divided by the rolling speed; the rigid slip at `(x, y)` is
/// `(ξ − φ y, η + φ x)` (Kalker 1990, eq. 1.70).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motion {
    /// Longitudinal creepage ξ, dimensionless.
    pub creepage_x: f64,
    /// Lateral creepage η, dimensionless.
    pub creepage_y: f64,
    /// Spin φ in 1/mm, or dimensionless where lengths are.
    pub spin_per_mm: f64,
}

/// The forces prescribed along x and across instead of creepages, in N, where they are.
pub type PrescribedForces = [Option<f64>; 2];
