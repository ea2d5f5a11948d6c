//! What the iteration is asked, and how it ended.

/// What a solve needs besides the equations, all per cell, padded like the equations' vectors.
#[derive(Debug, Clone, Copy)]
pub struct NewtonTask<'a> {
    /// Rigid slip, x then y.
    pub rigid: &'a [f64],
    /// Friction bound g = μp.
    pub bound: &'a [f64],
    /// Area of every cell, the weight of its residual.
    pub area: &'a [f64],
    /// Traction scale of the case: residuals are relative to it.
    pub scale: f64,
    /// Residual to reach.
    pub tolerance: f64,
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// Did the residual reach the tolerance?
    pub converged: bool,
    /// Newton steps.
    pub iterations: u32,
    /// Products of the influence with a vector.
    pub products: u32,
    /// Area-weighted root mean square of `T − Π(T + r s)`, relative to the scale of the case.
    pub residual: f64,
    /// Steps whose linear system was not solved to its tolerance; harmless if the residual still came down.
    pub inexact_steps: u32,
}
