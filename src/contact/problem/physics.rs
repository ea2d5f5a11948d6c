//! What is asked, as checked numbers: no results, no options and no names.
//!
//! A [`Problem`] comes from the checks of `case/`, or from a checked one that asked for more: nothing else may put one together.

use std::sync::Arc;

use crate::contact::friction::law::FrictionLaw;
use crate::contact::friction::path_dependent::Interface;
use crate::contact::geometry::wheelset::WheelsetMotion;
use crate::contact::half_space::elasticity::Elasticity;
use crate::contact::normal::hertz::Ellipse;
use crate::contact::normal::normal_task::NormalTask;
use crate::contact::normal::wheel::task::WheelTask;
use crate::contact::rolling::history::task::HistoryTask;
use crate::contact::rolling::methods::table::solve::{outside, unlike};
use crate::contact::rolling::motion::{Motion, PrescribedForces};

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

/// Proof that a problem went through the checks. `tests/tidy` allows it, and literals of [`Problem`], in `case/` and here only.
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
    #[must_use]
    pub(crate) fn of_move(&self, motion: WheelsetMotion, drive_torque: Option<f64>) -> Problem {
        Problem {
            wheelset: Some(motion),
            drive_torque,
            speeds: vec![Some(motion.speed)],
            ..self.clone()
        }
    }

    /// This problem with its wheel replaced.
    #[must_use]
    pub(crate) fn with_wheel(&self, wheel: Arc<WheelTask>) -> Problem {
        Problem {
            task: NormalTask::Wheel(wheel),
            ..self.clone()
        }
    }

    /// The same question about one wheel of a wheelset that moves as a whole.
    #[must_use]
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
            let (_, ratio) = plain
                .ellipse
                .axes_of_rows(self.elasticity.contact_modulus());
            outside(ratio).is_none()
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
    #[must_use]
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
    #[must_use]
    pub(crate) fn of_gap(&self, friction: FrictionLaw, motions: Vec<Motion>) -> Problem {
        Problem {
            friction,
            motions,
            wheelset: None,
            ..self.clone()
        }
    }
}
