//! The last step of a check: words without faults become a [`CheckedCase`].

use std::time::Duration;

use crate::contact::case::checks::{CheckedParts, PartialCase, missing_load, unusual_friction};
use crate::contact::case::digest::digest;
use crate::contact::case::known_pair::KnownPair;
use crate::contact::case::limits::Limits;
use crate::contact::case::motions::ExpandedMotions;
use crate::contact::case::resolution::resolution;
use crate::contact::case::words::question::Case;
use crate::contact::case::{units, wheel_task};
use crate::contact::error::CaseError;
use crate::contact::friction::law::FrictionLaw;
use crate::contact::problem::checked_case::{CheckedCase, Label};
use crate::contact::problem::physics::{Checked, MotionPart, Problem};
use crate::contact::problem::plausibility;
use crate::contact::problem::run::AfterTasks;
use crate::contact::problem::run::Run;
use crate::contact::remark::entry::merged;
use crate::contact::rolling::motion::{Motion, PrescribedForces};
use crate::contact::solution::words::answer::Asked;

impl CheckedCase {
    /// Checks a case against the limits and prepares its numbers; profiles that are known are not read again.
    ///
    /// # Errors
    /// Every fault found, each with its JSON pointer.
    pub fn new(case: &Case, limits: &Limits, known: &KnownPair) -> Result<CheckedCase, CaseError> {
        let given = PartialCase {
            material: Some(&case.material),
            friction: Some(&case.friction),
            contact: Some(&case.contact),
            load: case.load.as_ref(),
            motion: Some(&case.motion),
            solver: Some(&case.solver),
            outputs: &case.outputs,
            after: case.after_words(),
            known,
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
        let patches = task.known_patches().unwrap_or_default();
        let given = given_creepages(&motions, &forces);
        let remarks = merged(
            of_case
                .chain(remarks)
                .chain(plausibility::of_case(&case.contact, &patches, given))
                .chain(units::remarks(case, &patches)),
        );
        let digest = digest(case, &elasticity, &motions, &forces, &speeds);
        let problem = Problem {
            elasticity,
            friction: FrictionLaw::new(&case.friction, case.thermal.as_ref()),
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
            wheelset: wheel_task::wheelset(&case.motion),
            drive_torque: wheel_task::drive_torque(&case.motion),
            wheelset_forces: wheel_task::wheelset_forces(&case.motion),
            checked: Checked::without_faults(),
        };
        let run = run(case, limits);
        let first_order = problem.first_order(&run).map(|r| r.at_pointer("/material"));
        let remarks = merged(remarks.into_iter().chain(first_order));
        Ok(CheckedCase {
            problem,
            run,
            label: label(case, digest),
            remarks,
        })
    }
}

/// The motions, if all their creepages are given; creepages that are searched are assessed once they are found.
fn given_creepages<'a>(motions: &'a [Motion], forces: &[PrescribedForces]) -> &'a [Motion] {
    match forces.iter().all(|forces| *forces == [None; 2]) {
        true => motions,
        false => &[],
    }
}

/// What a case is called, with its digest.
fn label(case: &Case, digest: String) -> Label {
    Label {
        name: case.name.clone(),
        labels: case.labels.clone(),
        digest,
        asked: asked(case),
    }
}

/// The parts of a case that its answer repeats.
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
        relative_to: case.solver.relative_to.unwrap_or_default().into(),
        time_limit: case.solver.time_limit_s.map(Duration::from_secs_f64),
        memory_bytes: limits.memory_bytes,
        operator_store_bytes: limits.operator_store_bytes,
        steps_max: limits.motions_max,
        outputs: case.outputs.clone(),
        after: AfterTasks::new(case),
    }
}
