//! The physics of a checked case ([`Problem`]), how it is solved ([`Run`]), and whether pressure and traction of unlike bodies are coupled.
//!
//! Only the checks in `case/` create a [`Problem`]; others derive from it.

use std::sync::Arc;
use std::time::Duration;

use crate::case::words::material::Thermal;
use crate::case::words::solver::{MethodName, Output};
use crate::friction::law::FrictionLaw;
use crate::friction::path_dependent::Interface;
use crate::geometry::wheelset_pose::WheelsetMotion;
use crate::half_space::unlike_bodies::Elasticity;
use crate::method::{Method, TractionBound};
use crate::normal::footprint::NormalTask;
use crate::normal::hertz::Ellipse;
use crate::normal::wheel::{ReferenceSurface, WheelTask};
use crate::post::damage::DamageTask;
use crate::post::subsurface::states::SubsurfaceTask;
use crate::remark::list::Remark;
use crate::rolling::answer::MotionAnswer;
use crate::rolling::history::plan::HistoryTask;
use crate::rolling::methods::table::solve::{outside, unlike};
use crate::rolling::task::{
    Motion, NEGLIGIBLE_OF_TARGET, PrescribedForces, RelativeTo, Resolution, TARGET_LEAST,
};

/// The physics of a case.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Problem {
    /// Combined elastic constants.
    pub elasticity: Elasticity,
    /// The friction law.
    pub friction: FrictionLaw,
    /// The layer between the bodies and the reduction factor.
    pub interface: Interface,
    /// The normal problem.
    pub task: NormalTask,
    /// The motions, in the order of the case; never empty.
    pub motions: Vec<Motion>,
    /// Position of the motions in the case.
    pub part: MotionPart,
    /// The motion of the wheelset, from which the creepages of the patches follow. The only motion in `motions` is then 0.
    pub wheelset: Option<WheelsetMotion>,
    /// Torque about the axle in N mm that the rails balance. The angular velocity of the wheelset is then unknown.
    pub drive_torque: Option<f64>,
    /// Forces in N that the rail carries under the wheel of a wheelset. Its angular and its lateral velocity are then unknown.
    pub wheelset_forces: PrescribedForces,
    /// The forces of each motion that are prescribed instead of creepages.
    pub forces: Vec<PrescribedForces>,
    /// The rolling speed of each motion in mm/s, if it is given.
    pub speeds: Vec<Option<f64>>,
    /// Distances and shifts, if the motions are one history.
    pub history: Option<HistoryTask>,
}

/// Position of the motions of a slice in their case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MotionPart {
    /// Number of motions of the case before the first of these.
    pub before: usize,
    /// Number of motions of the whole case.
    pub all: usize,
}

/// An elliptic contact with a constant friction coefficient, whose forces follow from its load, the elastic constants and the motion alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlainContact {
    pub(crate) ellipse: Ellipse,
    /// Coefficient of friction.
    pub(crate) coefficient: f64,
    /// Kalker's reduction factor of the shear modulus.
    pub(crate) reduction: f64,
}

impl Problem {
    /// Returns this problem with some of its motions, by their indices.
    #[must_use]
    pub fn with_motions(&self, chosen: &[usize]) -> Problem {
        Problem {
            motions: chosen.iter().map(|k| self.motions[*k]).collect(),
            forces: chosen.iter().map(|k| self.forces[*k]).collect(),
            speeds: chosen.iter().map(|k| self.speeds[*k]).collect(),
            ..self.clone()
        }
    }

    /// Returns this problem with another wheel.
    pub(crate) fn with_wheel(&self, wheel: Arc<WheelTask>) -> Problem {
        Problem {
            task: NormalTask::Wheel(wheel),
            ..self.clone()
        }
    }

    /// Returns the problem as a plain contact, if it is one, for any motions, forces and history. The pattern lists all members, so that a new
    /// member does not compile before it is considered here.
    pub(crate) fn plain(&self) -> Option<PlainContact> {
        let Problem {
            elasticity: _,
            friction: FrictionLaw::Constant(coefficient),
            interface:
                Interface {
                    reduction,
                    layer,
                    yielding: None,
                },
            task: NormalTask::Hertz(ellipse),
            motions: _,
            part: _,
            wheelset: None,
            drive_torque: None,
            wheelset_forces: [None, None],
            forces: _,
            speeds: _,
            history: _,
        } = self
        else {
            return None;
        };
        (*layer == 0.0).then_some(PlainContact {
            ellipse: *ellipse,
            coefficient: *coefficient,
            reduction: *reduction,
        })
    }

    /// Whether the table of creep forces covers the patch.
    pub(crate) fn is_in_table(&self) -> bool {
        let inside = |plain: PlainContact| outside(plain.ellipse.a / plain.ellipse.b).is_none();
        self.plain().is_some_and(inside) && unlike(&self.elasticity).is_none()
    }

    /// Returns the longitudinal and the lateral force in N that the rail carries under one wheel, if any is prescribed. The lateral one includes
    /// normal forces.
    pub(crate) fn pull(&self) -> Option<PrescribedForces> {
        let NormalTask::Wheel(_) = self.task else {
            return None;
        };
        let given = *self.forces.first()?;
        let forces = [0, 1].map(|k| self.wheelset_forces[k].or(given[k]));
        (forces != [None; 2]).then_some(forces)
    }

    /// Returns the problem of one gap of a wheel, with friction in the axes of the gap and motions about its origin.
    pub(crate) fn of_gap(&self, friction: FrictionLaw, motions: Vec<Motion>) -> Problem {
        Problem {
            friction,
            motions,
            wheelset: None,
            ..self.clone()
        }
    }
}

/// How a case is solved.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// The method.
    pub method: Method,
    /// The method as the case names it.
    pub method_asked: MethodName,
    /// Traction bound at which `fastsim` slips.
    pub traction_bound: TractionBound,
    /// Target or mesh.
    pub resolution: Resolution,
    /// The quantity to which the target is relative.
    pub relative_to: RelativeTo,
    /// Time limit of the whole case.
    pub time_limit: Option<Duration>,
    /// Maximum memory of the solve in bytes.
    pub memory_bytes: u64,
    /// Capacity of the operator store that the process shares, in bytes.
    pub operator_store_bytes: u64,
    /// Maximum number of steps of a history.
    pub steps_max: usize,
    /// The requested outputs, sorted and without repetition.
    pub outputs: Vec<Output>,
    /// The outputs that are computed from the solved motions.
    pub after: AfterTasks,
}

impl Run {
    /// Returns this run for resultants alone, with at least this target.
    #[must_use]
    pub fn for_resultants(&self, target: f64) -> Run {
        Run {
            resolution: match self.resolution {
                Resolution::Target(asked) => Resolution::Target(asked.max(target)),
                mesh @ Resolution::Mesh(_) => mesh,
            },
            // A coarser solve is not refined for a small force.
            relative_to: match self.resolution {
                Resolution::Target(asked) if target > asked => RelativeTo::FrictionLimit,
                _ => self.relative_to,
            },
            outputs: vec![Output::Resultants],
            after: AfterTasks::default(),
            ..self.clone()
        }
    }

    /// Returns the target of the resultants' error relative to μN; infinite for an explicit mesh.
    pub fn target(&self) -> f64 {
        self.resolution.target().unwrap_or(f64::INFINITY)
    }

    /// Returns the allowed error of an answer relative to μN, if there is a target; `limit` is μN of all patches in N.
    pub fn allowed_error(&self, answer: &MotionAnswer, limit: f64) -> Option<f64> {
        let target = self.resolution.target()?;
        Some(match self.relative_to {
            RelativeTo::FrictionLimit => target,
            RelativeTo::Force => target * answer.force_share(limit),
        })
    }

    /// Returns the finest resolution that the case may need. For a target relative to the force, it is that of a force close to 0.
    pub fn least_resolution(&self) -> Resolution {
        match (self.resolution, self.relative_to) {
            (Resolution::Target(_), RelativeTo::Force) => Resolution::Target(TARGET_LEAST),
            (resolution, _) => resolution,
        }
    }

    /// Whether an output needs the cells of a mesh.
    pub fn needs_cells(&self) -> bool {
        self.outputs.iter().any(|output| output.needs_fields())
            || self.after.needs_power(&self.outputs)
    }

    /// Whether this output is requested.
    pub fn wants(&self, output: Output) -> bool {
        self.outputs.contains(&output)
    }
}

/// The requested outputs that are computed from the solved motions.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AfterTasks {
    /// Stresses below the surface.
    pub subsurface: Option<SubsurfaceTask>,
    /// Damage.
    pub damage: Option<DamageTask>,
    /// Temperatures.
    pub thermal: Option<Thermal>,
}

impl AfterTasks {
    /// Whether an output needs the power of each cell.
    pub fn needs_power(&self, outputs: &[Output]) -> bool {
        let across = self.damage.as_ref().is_some_and(|task| task.across);
        across || self.thermal.is_some() || outputs.contains(&Output::Slip)
    }
}

/// Error of forces relative to μN, divided by |K| μ, if the effect of tractions on the pressure is neglected. It was 0.09 to 0.55 in nine
/// contacts with |K| from 0.05 to 0.25 and μ of 0.3 and 0.6, on 10 × 20 cells compared with CONTACT.
const FIRST_ORDER: f64 = 0.6;

impl Problem {
    /// Returns the error of forces relative to μN if the effect of tractions on the pressure is neglected. It is 0 for equal bodies, without
    /// friction, and for a given pressure, which includes that effect.
    pub fn first_order_error(&self, method: Method) -> f64 {
        let coupled = method == Method::BoundaryElement
            && !self.friction.is_frictionless()
            && !matches!(self.task, NormalTask::Given(_));
        let difference = match coupled {
            true => self.elasticity.difference.abs(),
            false => 0.0,
        };
        FIRST_ORDER * difference * self.friction.largest()
    }

    /// Whether the pressures include the effect of the tractions. On the curve of a rail they always do; in a history they then have the
    /// tractions of its last point. Otherwise they do for known gaps, in single motions and in a history that only presses the bodies together,
    /// if the effect is not negligible. The points of other histories share their patches.
    pub fn is_coupled(&self, run: &Run) -> bool {
        let on_curve = |wheel: &WheelTask| matches!(wheel.surface, ReferenceSurface::Curve { .. });
        match &self.task {
            NormalTask::Wheel(wheel) if on_curve(wheel) => return true,
            NormalTask::Wheelset(wheelset) if on_curve(&wheelset.sides[0]) => return true,
            _ => {}
        }
        let solved = match (&self.task, &self.history) {
            (NormalTask::Hertz(_) | NormalTask::Gap(_), None) => true,
            (NormalTask::Hertz(_) | NormalTask::Gap(_), Some(history)) => {
                history.only_presses() && self.forces == [[None; 2]]
            }
            (NormalTask::Given(_) | NormalTask::Wheel(_) | NormalTask::Wheelset(_), _) => false,
        };
        solved && self.first_order_error(run.method) > negligible(run)
    }

    /// Returns the remark on a neglected effect of tractions on the pressure that is not negligible.
    pub(crate) fn first_order(&self, run: &Run) -> Option<Remark> {
        let needed = self.first_order_error(run.method) > negligible(run) && !self.is_coupled(run);
        needed.then(|| self.first_order_remark(run.method))
    }

    /// Returns the remark on motions whose pressure does not include the effect of the tractions.
    pub(crate) fn first_order_remark(&self, method: Method) -> Remark {
        Remark::CouplingFirstOrder {
            difference_parameter: self.elasticity.difference,
            error: self.first_order_error(method),
        }
    }
}

/// Returns the error of forces below which the effect of tractions on the pressure is negligible.
pub(crate) fn negligible(run: &Run) -> f64 {
    NEGLIGIBLE_OF_TARGET * run.resolution.target_or_usual()
}
