//! What is asked, as checked numbers: no results, no options and no names.
//!
//! A [`Problem`] comes from the checks of `case/`, or from a checked one that asked for more: nothing else may put one together.
//!
//! How a case is to be solved: method, accuracy, limits and outputs.
//!
//! How far pressure and traction of bodies that differ are solved together.

use std::sync::Arc;
use std::time::Duration;

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
use crate::post::local_power::ThermalTask;
use crate::post::subsurface::states::SubsurfaceTask;
use crate::remark::list::Remark;
use crate::rolling::answer::MotionAnswer;
use crate::rolling::history::plan::HistoryTask;
use crate::rolling::methods::table::solve::{outside, unlike};
use crate::rolling::task::{
    Motion, NEGLIGIBLE_OF_TARGET, PrescribedForces, RelativeTo, Resolution, TARGET_LEAST,
};

/// What is asked: the physics.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// Combined elastic constants.
    pub elasticity: Elasticity,
    /// Bound of the tractions.
    pub friction: FrictionLaw,
    /// What lies between the bodies.
    pub interface: Interface,
    /// Where patches and pressures come from.
    pub task: NormalTask,
    /// The motions, in the order of the case; never empty.
    pub motions: Vec<Motion>,
    /// Which motions of the case these are: all of them, unless this is a slice.
    pub part: MotionPart,
    /// The motion of the wheelset that stands in place of the one motion above, which is then 0: the creepages of the patches
    /// follow from it.
    pub wheelset: Option<WheelsetMotion>,
    /// Torque about the axle in N mm that the rails are to balance; the angular velocity of the wheelset is then found.
    pub drive_torque: Option<f64>,
    /// Forces in N that the rail is to carry under the wheel of a wheelset; its angular velocity and its lateral velocity are then found.
    pub wheelset_forces: PrescribedForces,
    /// Forces prescribed instead of creepages, motion by motion.
    pub forces: Vec<PrescribedForces>,
    /// Rolling speeds in mm/s, motion by motion, where they are given.
    pub speeds: Vec<Option<f64>>,
    /// How the motions follow each other, where they are one history.
    pub history: Option<HistoryTask>,
    /// Proof of the checks.
    pub(crate) checked: Checked,
}

/// Which motions of a case a problem asks about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MotionPart {
    /// Motions of the case before the first of these.
    pub before: usize,
    /// Motions of the whole case.
    pub all: usize,
}

/// A contact whose forces follow from an ellipse, its load, one coefficient of friction, the elastic constants and the motion alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlainContact {
    pub(crate) ellipse: Ellipse,
    /// Coefficient of friction.
    pub(crate) coefficient: f64,
    /// Kalker's reduction factor: the part of the shear modulus that tractions meet.
    pub(crate) reduction: f64,
}

/// Proof that a problem went through the checks. Only `case/` and this file make it, and literals of [`Problem`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checked(());

impl Checked {
    /// The checks found no fault.
    pub(crate) fn without_faults() -> Checked {
        Checked(())
    }
}

impl Problem {
    /// The same question about some of the motions, by their places.
    #[must_use]
    pub fn with_motions(&self, chosen: &[usize]) -> Problem {
        Problem {
            motions: chosen.iter().map(|k| self.motions[*k]).collect(),
            forces: chosen.iter().map(|k| self.forces[*k]).collect(),
            speeds: chosen.iter().map(|k| self.speeds[*k]).collect(),
            ..self.clone()
        }
    }

    /// The same question about a wheelset that moves in this way.
    pub(crate) fn of_move(&self, motion: WheelsetMotion, drive_torque: Option<f64>) -> Problem {
        Problem {
            wheelset: Some(motion),
            drive_torque,
            speeds: vec![Some(motion.speed)],
            ..self.clone()
        }
    }

    /// This problem with its wheel replaced.
    pub(crate) fn with_wheel(&self, wheel: Arc<WheelTask>) -> Problem {
        Problem {
            task: NormalTask::Wheel(wheel),
            ..self.clone()
        }
    }

    /// The same question about one wheel of a wheelset that moves as a whole.
    pub(crate) fn of_wheel(&self, wheel: Arc<WheelTask>, wheelset: WheelsetMotion) -> Problem {
        Problem {
            task: NormalTask::Wheel(wheel),
            wheelset: Some(wheelset),
            drive_torque: None,
            ..self.clone()
        }
    }

    /// The question as a plain contact, if it is one, whatever its motions, forces and history are. The pattern names every member of a question,
    /// so a new member does not compile before it is judged here.
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
            checked: _,
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

    /// Does the table of creep forces cover the patch?
    pub(crate) fn is_in_table(&self) -> bool {
        let inside = |plain: PlainContact| {
            let Ellipse { a, b, .. } = plain.ellipse;
            outside(a / b).is_none()
        };
        self.plain().is_some_and(inside) && unlike(&self.elasticity).is_none()
    }

    /// The forces in N that the rail is to carry under one wheel, along and across the track, if any is prescribed. That across
    /// contains the lateral part of the normal forces.
    pub(crate) fn pull(&self) -> Option<PrescribedForces> {
        let NormalTask::Wheel(_) = self.task else {
            return None;
        };
        let given = *self.forces.first()?;
        let forces = [0, 1].map(|k| self.wheelset_forces[k].or(given[k]));
        (forces != [None; 2]).then_some(forces)
    }

    /// The same question about a wheel that moves as given.
    pub(crate) fn moving(&self, motion: Motion, wheelset: Option<WheelsetMotion>) -> Problem {
        Problem {
            motions: vec![motion],
            forces: vec![[None; 2]],
            wheelset,
            wheelset_forces: [None; 2],
            ..self.clone()
        }
    }

    /// The same question about one gap of a wheel, with friction in its axes and motions about its origin.
    pub(crate) fn of_gap(&self, friction: FrictionLaw, motions: Vec<Motion>) -> Problem {
        Problem {
            friction,
            motions,
            wheelset: None,
            ..self.clone()
        }
    }
}

/// How a case is to be solved: nothing of it changes what is asked.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// The method to solve with.
    pub method: Method,
    /// The word it was asked for with.
    pub method_asked: MethodName,
    /// Traction bound at which `fastsim` slips.
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
    pub fn target(&self) -> f64 {
        match self.resolution {
            Resolution::Target(target) => target,
            Resolution::Mesh(_) => f64::INFINITY,
        }
    }

    /// Allowed error of an answer relative to μN, where an error is asked for; `limit` is μN of all patches in N.
    pub fn allowed_error(&self, answer: &MotionAnswer, limit: f64) -> Option<f64> {
        let target = self.resolution.target()?;
        Some(match self.relative_to {
            RelativeTo::FrictionLimit => target,
            RelativeTo::Force => target * answer.force_share(limit),
        })
    }

    /// The finest resolution that the case may need: that of a force close to 0 where the target is relative to it.
    pub fn least_resolution(&self) -> Resolution {
        match (self.resolution, self.relative_to) {
            (Resolution::Target(_), RelativeTo::Force) => Resolution::Target(TARGET_LEAST),
            (resolution, _) => resolution,
        }
    }

    /// Is anything asked for that follows from the cells of a mesh?
    pub fn needs_cells(&self) -> bool {
        self.outputs.iter().any(|output| output.needs_fields())
            || self.after.needs_power(&self.outputs)
    }

    /// Is this output asked for?
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
    pub fn needs_power(&self, outputs: &[Output]) -> bool {
        let across = self.damage.as_ref().is_some_and(|task| task.across);
        across || self.thermal.is_some() || outputs.contains(&Output::Slip)
    }
}

/// Error of forces relative to μN over |K| μ, where tractions feel the pressure but the pressure does not feel them: 0.09 to 0.55 in nine
/// contacts with |K| from 0.05 to 0.25 and μ of 0.3 and 0.6, on 10 × 20 cells against CONTACT.
const FIRST_ORDER: f64 = 0.6;

impl Problem {
    /// Error of forces, relative to μN, that is left if only tractions feel the other: 0 where the bodies are alike or without friction, and
    /// where the pressure is given, since it is that of the contact whatever the tractions are.
    pub fn first_order_error(&self, method: Method) -> f64 {
        let coupled = method == Method::BoundaryElement
            && !self.friction.is_frictionless()
            && !matches!(self.task, NormalTask::Given(_));
        let difference = if coupled {
            self.elasticity.difference.abs()
        } else {
            0.0
        };
        FIRST_ORDER * difference * self.friction.largest()
    }

    /// Returns whether the pressures belong to the tractions of bodies that differ. On the curve of a rail they do, in a history to those of its last point.
    /// Elsewhere they do in motions and in one pressing alone, where the gap is known. Points of a history that goes on share their patches.
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

    /// The remark if the pressure should feel the tractions and does not.
    pub(crate) fn first_order(&self, run: &Run) -> Option<Remark> {
        let needed = self.first_order_error(run.method) > negligible(run) && !self.is_coupled(run);
        needed.then(|| self.first_order_remark(run.method))
    }

    /// What is said of motions whose pressure does not feel the tractions.
    pub(crate) fn first_order_remark(&self, method: Method) -> Remark {
        Remark::CouplingFirstOrder {
            difference_parameter: self.elasticity.difference,
            error: self.first_order_error(method),
        }
    }
}

/// The error of forces below which the pressure need not feel the tractions.
pub(crate) fn negligible(run: &Run) -> f64 {
    NEGLIGIBLE_OF_TARGET * run.resolution.target_or_usual()
}
