//! A checked case in three parts: what is asked ([`Problem`]), how it is to be solved ([`Run`]) and what it is called ([`Label`]).
//!
//! A [`Problem`] comes from [`CheckedCase::new`] or from a checked one that asked for more: nothing outside this folder can put one
//! together. It holds no results, no options and no names, so that whoever changes accuracy or outputs leaves the question alone.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use crate::contact::case::after_tasks::AfterTasks;
use crate::contact::case::checks::{CheckedParts, PartialCase, missing_load, unusual_friction};
use crate::contact::case::digest::digest;
use crate::contact::case::limits::Limits;
use crate::contact::case::motions::ExpandedMotions;
use crate::contact::case::resolution::resolution;
use crate::contact::case::words::question::Case;
use crate::contact::case::words::solver::{MethodName, Output};
use crate::contact::case::{plausibility, profiles};
use crate::contact::error::CaseError;
use crate::contact::friction::interface::Interface;
use crate::contact::friction::law::FrictionLaw;
use crate::contact::geometry::wheelset::WheelsetMotion;
use crate::contact::half_space::elasticity::Elasticity;
use crate::contact::normal::normal_task::NormalTask;
use crate::contact::normal::wheel_height::task::WheelTask;
use crate::contact::remark::entry::{RemarkEntry, merged};
use crate::contact::rolling::history::task::HistoryTask;
use crate::contact::rolling::methods::method::{Method, TractionBound};
use crate::contact::rolling::motion::{Motion, PrescribedForces};
use crate::contact::rolling::refinement::resolution::Resolution;
use crate::contact::solution::words::Asked;

/// Which motions of a case a problem asks about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MotionPart {
    /// Motions of the case before the first of these.
    pub before: usize,
    /// Motions of the whole case.
    pub all: usize,
}

/// A case that can be solved.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckedCase {
    /// What is asked.
    pub problem: Problem,
    /// How to solve it.
    pub run: Run,
    /// What it is called.
    pub label: Label,
    /// Remarks of the checks; they go into the answer.
    pub remarks: Vec<RemarkEntry>,
}

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
    /// Forces prescribed instead of creepages, motion by motion.
    pub forces: Vec<PrescribedForces>,
    /// Rolling speeds in mm/s, motion by motion, where they are given.
    pub speeds: Vec<Option<f64>>,
    /// How the motions follow each other, where they are one history.
    pub history: Option<HistoryTask>,
    checked: Checked,
}

/// Proof that a problem went through the checks: without it no literal and no `..problem` compiles outside this file.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Checked;

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
    /// Time allowed for the whole case.
    pub time_limit: Option<Duration>,
    /// Memory the solve may use, in bytes.
    pub memory_bytes: u64,
    /// Steps that a history may take.
    pub steps_max: usize,
    /// What to compute, sorted, without repetition.
    pub outputs: Vec<Output>,
    /// What is computed from the solved motions.
    pub after: AfterTasks,
}

/// What a case is called; the answer does not depend on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// Free text of the client.
    pub name: Option<String>,
    /// Labels of the client.
    pub labels: BTreeMap<String, String>,
    /// Hexadecimal digest of everything that determines the answer, the solver version included.
    pub digest: String,
    /// What of the case stands in the answer.
    pub asked: Asked,
}

impl CheckedCase {
    /// Checks a case against the limits and prepares its numbers.
    ///
    /// # Errors
    /// Every fault found, each with its JSON pointer.
    pub fn new(case: &Case, limits: &Limits) -> Result<CheckedCase, CaseError> {
        let given = PartialCase {
            material: Some(&case.material),
            friction: Some(&case.friction),
            contact: Some(&case.contact),
            load: case.load.as_ref(),
            motion: Some(&case.motion),
            solver: Some(&case.solver),
            outputs: &case.outputs,
            after: case.after_words(),
        };
        let (parts, mut faults) = CheckedParts::check(given, limits);
        if faults.is_empty() && parts.task.is_none() {
            faults.push(missing_load());
        }
        let (true, Some(elasticity), Some((task, remarks)), Some(motions)) = (
            faults.is_empty(),
            parts.elasticity,
            parts.task,
            parts.motions,
        ) else {
            return Err(CaseError(faults));
        };
        let of_material = elasticity.remark(case.solver.method.into());
        let of_material = of_material.map(|r| r.at_pointer("/material"));
        let of_case = of_material
            .into_iter()
            .chain(unusual_friction(&case.friction));
        let ExpandedMotions {
            motions,
            forces,
            speeds,
            history,
        } = motions;
        let given = given_creepages(&motions, &forces);
        let implausible = plausibility::of_case(&case.contact, &task.patches(), given);
        let remarks = merged(of_case.chain(remarks).chain(implausible));
        let digest = digest(case, &elasticity, &motions, &forces, &speeds);
        let problem = Problem {
            elasticity,
            friction: (&case.friction).into(),
            interface: (&case.friction).into(),
            task,
            part: MotionPart {
                before: 0,
                all: motions.len(),
            },
            motions,
            forces,
            speeds,
            history,
            wheelset: profiles::wheelset(&case.motion),
            drive_torque: profiles::drive_torque(&case.motion),
            checked: Checked,
        };
        let run = run(case, limits);
        let first_order = problem.first_order(&run).map(|r| r.at_pointer("/material"));
        let remarks = merged(remarks.into_iter().chain(first_order));
        Ok(CheckedCase {
            problem,
            run,
            label: Label {
                name: case.name.clone(),
                labels: case.labels.clone(),
                digest,
                asked: asked(case),
            },
            remarks,
        })
    }

    /// The same case with some of its motions.
    #[must_use]
    pub fn slice(&self, range: Range<usize>) -> CheckedCase {
        let chosen: Vec<usize> = range.clone().collect();
        let part = MotionPart {
            before: self.problem.part.before + range.start,
            ..self.problem.part
        };
        let problem = Problem {
            part,
            ..self.problem.with_motions(&chosen)
        };
        CheckedCase {
            problem,
            ..self.clone()
        }
    }
}

/// The motions whose creepages are given; those that are searched are looked at when they are found.
fn given_creepages<'a>(motions: &'a [Motion], forces: &[PrescribedForces]) -> &'a [Motion] {
    match forces.iter().all(|forces| *forces == [None; 2]) {
        true => motions,
        false => &[],
    }
}

/// What of a case stands in its answer.
fn asked(case: &Case) -> Asked {
    Asked {
        contact: case.contact.name().to_owned(),
        friction_coefficient: case.friction.largest(),
        friction_varies: case.friction.coefficient.is_none(),
        load: case.load,
    }
}

/// How a case is to be solved, by its words.
fn run(case: &Case, limits: &Limits) -> Run {
    Run {
        method: case.solver.method.into(),
        method_asked: case.solver.method,
        traction_bound: case.solver.traction_bound.unwrap_or_default().into(),
        resolution: resolution(&case.solver),
        time_limit: case.solver.time_limit_s.map(Duration::from_secs_f64),
        memory_bytes: limits.memory_bytes,
        steps_max: limits.motions_max,
        outputs: case.outputs.clone(),
        after: AfterTasks::new(case),
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

impl Run {
    /// The same for resultants alone, with this target or a larger one.
    #[must_use]
    pub fn for_resultants(&self, target: f64) -> Run {
        Run {
            resolution: match self.resolution {
                Resolution::Target(asked) => Resolution::Target(asked.max(target)),
                mesh @ Resolution::Mesh(_) => mesh,
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

    /// Is this output asked for?
    #[must_use]
    pub fn wants(&self, output: Output) -> bool {
        self.outputs.contains(&output)
    }
}
