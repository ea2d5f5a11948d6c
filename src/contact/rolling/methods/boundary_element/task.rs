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

/// How an iteration for the tractions ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NewtonExit {
    /// The residual reached the tolerance.
    Converged,
    /// The steps were used up before.
    StepsUsedUp,
}

impl NewtonExit {
    /// Was the tolerance met?
    #[must_use]
    pub fn converged(self) -> bool {
        self == NewtonExit::Converged
    }
}

/// How a solve went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// How it ended.
    pub exit: NewtonExit,
    /// Newton steps.
    pub iterations: u32,
    /// Products of the influence with a vector.
    pub products: u32,
    /// Area-weighted root mean square of `T − Π(T + r s)`, relative to the scale of the case.
    pub residual: f64,
    /// Steps whose linear system was not solved to its tolerance; harmless if the residual still came down.
    pub inexact_steps: u32,
}

impl Default for Convergence {
    /// Before the first step.
    fn default() -> Self {
        Convergence {
            exit: NewtonExit::StepsUsedUp,
            iterations: 0,
            products: 0,
            residual: f64::INFINITY,
            inexact_steps: 0,
        }
    }
}
