//! The equations of one motion on one mesh, the problem of a Newton solve, and its report.

use crate::friction::path_dependent::PathDependentFriction;
use crate::friction::velocity_weakening::Softening;
use crate::rolling::answer::{LevelAnswer, Skip};
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::Motion;

/// One motion on one mesh.
#[derive(Debug, Clone, Copy)]
pub struct LevelTask<'a> {
    /// The mesh.
    pub level: &'a StripMesh,
    /// The motion, dimensionless, about the origin of the mesh.
    pub motion: &'a Motion,
    /// Weakening of the bounds with slip, if there is any.
    pub fall: Option<Softening>,
    /// Friction that changes along the path through the contact, if it does.
    pub passage: Option<PathDependentFriction<'a>>,
    /// Residual to reach.
    pub tolerance: f64,
}

impl LevelTask<'_> {
    /// The solution without an iteration if nothing moves.
    pub(crate) fn without_iteration(&self) -> Option<LevelAnswer> {
        let moves = self.level.surface_slip.is_some() || !self.motion.is_still();
        (!moves).then(|| LevelAnswer::without_traction(self.level, self.motion, Skip::NoMotion))
    }
}

/// Data of a Newton solve besides the equations. Values per cell are padded like the vectors of the equations.
#[derive(Debug, Clone, Copy)]
pub struct NewtonTask<'a> {
    /// Rigid slip, x then y.
    pub rigid: &'a [f64],
    /// Friction bound g = μp; without slip if it weakens with slip.
    pub bound: &'a [f64],
    /// Weakening of the bounds with slip, if there is any.
    pub fall: Option<Softening>,
    /// Area of every cell, which weights its residual.
    pub area: &'a [f64],
    /// Traction scale, to which residuals are relative.
    pub scale: f64,
    /// Residual to reach.
    pub tolerance: f64,
    /// Whether a start with a sufficiently small residual is accepted. Otherwise at least one Newton step is taken.
    pub accepts_start: bool,
}

/// Largest number of Newton steps of the trapezoid rule from the tractions of another mesh; the three-point rule then gives a better start. 60 steps take 1.7
/// times the time on meshes of 4 096 and more cells; 8 steps take 6 to 10 % more work on 25 random ellipses.
pub(super) const FEW_STEPS: u32 = 16;
/// Largest number of Newton steps otherwise. A case of the ellipses named in `newton.rs` takes 18 on average over all its meshes and rules.
pub const STEPS_MAX: u32 = 60;

/// Report of a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// Whether the residual reached the tolerance within the largest number of steps.
    pub converged: bool,
    /// Newton steps.
    pub iterations: u32,
    /// Products of the operator with a vector.
    pub products: u32,
    /// Area-weighted root mean square of `T − Π(T + r s)`, relative to the traction scale.
    pub residual: f64,
    /// Steps whose linear system was not solved to its tolerance. They do no harm if the residual still decreases.
    pub inexact_steps: u32,
}

impl Convergence {
    /// A clause with the likely reason of a failure and advice.
    pub(crate) fn advice(&self) -> String {
        let linear = match self.inexact_steps {
            0 => String::new(),
            steps => {
                format!(
                    "in {steps} steps the linear solver reached its largest number of iterations; "
                )
            }
        };
        format!("{linear}try another mesh, with cells and strips of similar width")
    }
}

impl Default for Convergence {
    /// Before the first step.
    fn default() -> Self {
        Convergence {
            converged: false,
            iterations: 0,
            products: 0,
            residual: f64::INFINITY,
            inexact_steps: 0,
        }
    }
}
