//! How a case is to be solved: method, accuracy, limits and outputs.

use std::time::Duration;

use crate::contact::case::words::solver::{MethodName, Output};
use crate::contact::method::{Method, TractionBound};
use crate::contact::post::damage::figures::DamageTask;
use crate::contact::post::heat::ThermalTask;
use crate::contact::post::subsurface::states::SubsurfaceTask;
use crate::contact::rolling::motion_answer::MotionAnswer;
use crate::contact::rolling::resolution::{RelativeTo, Resolution, TARGET_LEAST};

/// How a case is to be solved: nothing of it changes what is asked.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// The method to solve with.
    pub method: Method,
    /// The word it was asked for with.
    pub method_asked: MethodName,
    /// Where `fastsim` lets tractions slip.
    pub traction_bound: TractionBound,
    /// Target or mesh.
    pub resolution: Resolution,
    /// What the target is a share of.
    pub relative_to: RelativeTo,
    /// Time allowed for the whole case.
    pub time_limit: Option<Duration>,
    /// Memory the solve may use, in bytes.
    pub memory_bytes: u64,
    /// Bound of the store of operators that it shares with others, in bytes.
    pub operator_store_bytes: u64,
    /// Steps that a history may take.
    pub steps_max: usize,
    /// What to compute, sorted, without repetition.
    pub outputs: Vec<Output>,
    /// What is computed from the solved motions.
    pub after: AfterTasks,
}

impl Run {
    /// The same for resultants alone, with this target or a larger one.
    #[must_use]
    pub fn for_resultants(&self, target: f64) -> Run {
        Run {
            resolution: match self.resolution {
                Resolution::Target(asked) => Resolution::Target(asked.max(target)),
                mesh @ Resolution::Mesh(_) => mesh,
            },
            // A coarse look is not refined to a small force.
            relative_to: match self.resolution {
                Resolution::Target(asked) if target > asked => RelativeTo::FrictionLimit,
                _ => self.relative_to,
            },
            outputs: vec![Output::Resultants],
            after: AfterTasks::default(),
            ..self.clone()
        }
    }

    /// Target of the resultants' error relative to μN; infinite where a mesh is given.
    #[must_use]
    pub fn target(&self) -> f64 {
        match self.resolution {
            Resolution::Target(target) => target,
            Resolution::Mesh(_) => f64::INFINITY,
        }
    }

    /// Allowed error of an answer relative to μN, where an error is asked for; `limit` is μN of all patches in N.
    #[must_use]
    pub fn allowed_error(&self, answer: &MotionAnswer, limit: f64) -> Option<f64> {
        let target = self.resolution.target()?;
        Some(match self.relative_to {
            RelativeTo::FrictionLimit => target,
            RelativeTo::Force => target * answer.force_share(limit),
        })
    }

    /// The finest resolution that the case may need: that of a force close to 0 where the target is relative to it.
    #[must_use]
    pub fn least_resolution(&self) -> Resolution {
        match (self.resolution, self.relative_to) {
            (Resolution::Target(_), RelativeTo::Force) => Resolution::Target(TARGET_LEAST),
            (resolution, _) => resolution,
        }
    }

    /// Is anything asked for that follows from the cells of a mesh?
    #[must_use]
    pub fn needs_cells(&self) -> bool {
        self.outputs.iter().any(|output| output.needs_fields())
            || self.after.needs_power(&self.outputs)
    }

    /// Is this output asked for?
    #[must_use]
    pub fn wants(&self, output: Output) -> bool {
        self.outputs.contains(&output)
    }
}

/// What is computed from solved motions; nothing where a case does not ask for it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AfterTasks {
    /// Stresses below the surface.
    pub subsurface: Option<SubsurfaceTask>,
    /// Damage.
    pub damage: Option<DamageTask>,
    /// Temperatures.
    pub thermal: Option<ThermalTask>,
}

impl AfterTasks {
    /// Is the power of every cell needed?
    #[must_use]
    pub fn needs_power(&self, outputs: &[Output]) -> bool {
        let across = self.damage.as_ref().is_some_and(|task| task.across);
        across || self.thermal.is_some() || outputs.contains(&Output::Slip)
    }
}
