//! What a level and the iteration on it are asked, and how the iteration ended.

use crate::friction::path_dependent::PathDependentFriction;
use crate::friction::velocity_weakening::Softening;
use crate::rolling::answer::{LevelAnswer, LevelOutcome};
use crate::rolling::methods::full_slip;
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::Motion;

/// One motion on one level.
#[derive(Debug, Clone, Copy)]
pub struct LevelTask<'a> {
    /// The level.
    pub level: &'a StripMesh,
    /// The motion, dimensionless, about the level's origin.
    pub motion: &'a Motion,
    /// How the bounds of the cells fall with their slip, where they do.
    pub fall: Option<Softening>,
    /// What changes the bounds on the way through the contact, if anything does.
    pub passage: Option<PathDependentFriction<'a>>,
    /// Residual to reach.
    pub tolerance: f64,
}

impl LevelTask<'_> {
    /// The answer where nothing moves, or where the rigid slip decides alone, as it does unless bounds depend on the slip.
    pub(crate) fn without_iteration(&self) -> Option<LevelAnswer> {
        if self.level.surface_slip.is_some() {
            return None;
        }
        let answer = full_slip::rigid_answer(self.level, self.motion)?;
        let still = answer.exit == LevelOutcome::NoMotion;
        let constant = self.fall.is_none() && self.passage.is_none();
        (still || constant).then_some(answer)
    }
}

/// What a solve needs besides the equations, all per cell, padded like the equations' vectors.
#[derive(Debug, Clone, Copy)]
pub struct NewtonTask<'a> {
    /// Rigid slip, x then y.
    pub rigid: &'a [f64],
    /// Friction bound g = μp; at rest where it falls with the slip.
    pub bound: &'a [f64],
    /// How the bounds fall with the slip, where they do.
    pub fall: Option<Softening>,
    /// Area of every cell, the weight of its residual.
    pub area: &'a [f64],
    /// Traction scale of the case: residuals are relative to it.
    pub scale: f64,
    /// Residual to reach.
    pub tolerance: f64,
    /// Most steps; [`STEPS_MAX`] unless there is another start to fall back on.
    pub steps_max: u32,
    /// Whether a start that meets the residual is the answer. Otherwise at least one Newton step follows, unless the residual of the
    /// start is far below the one to reach.
    pub accepts_start: bool,
}

/// Newton steps of the trapezoid rule from its start before the three-point rule is solved for a better one. 8 take 6 to 10 % more work
/// on 25 random ellipses, 40 are alike.
pub(super) const FEW_STEPS: u32 = 16;
/// Newton steps after which an iteration is given up. A case of the ellipses that `newton.rs` names takes 18 on average over all its
/// levels, rules and companions.
pub const STEPS_MAX: u32 = 60;

/// How a solve went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// Did the residual reach the tolerance, before the iteration limit was reached?
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

impl Convergence {
    /// A clause that says why there is no answer, as far as is known, and what to do.
    pub(crate) fn advice(&self) -> String {
        let linear = match self.inexact_steps {
            0 => String::new(),
            steps => {
                format!("in {steps} steps the restarts of the linear solver were used up; ")
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
