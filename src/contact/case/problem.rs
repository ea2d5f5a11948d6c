//! The question as checked numbers: materials combined, limits enforced.
//!
//! A [`Problem`] cannot exist unchecked: [`Problem::new`] is the only way to make one.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Duration;

use crate::contact::case::checks::{CheckedParts, PartialCase, missing_load, unusual_friction};
use crate::contact::case::digest::digest;
use crate::contact::case::limits::Limits;
use crate::contact::case::motions::ExpandedMotions;
use crate::contact::case::resolution::resolution;
use crate::contact::case::words::question::Case;
use crate::contact::case::words::solver::{MethodName, Output};
use crate::contact::case::{plausibility, profiles};
use crate::contact::error::CaseError;
use crate::contact::geometry::wheelset::WheelsetMotion;
use crate::contact::half_space::elasticity::Elasticity;
use crate::contact::normal::normal_task::NormalTask;
use crate::contact::remark::entry::{RemarkEntry, merged};
use crate::contact::rolling::methods::method::{Method, TractionBound};
use crate::contact::rolling::motion::{Motion, PrescribedForces};
use crate::contact::rolling::refinement::resolution::Resolution;

/// Which motions of a case a problem asks about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MotionPart {
    /// Motions of the case before the first of these.
    pub before: usize,
    /// Motions of the whole case.
    pub all: usize,
}

/// A checked case, ready to solve.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// Free text of the client.
    pub name: Option<String>,
    /// Labels of the client.
    pub labels: BTreeMap<String, String>,
    /// Combined elastic constants.
    pub elasticity: Elasticity,
    /// Coulomb's friction coefficient μ.
    pub friction: f64,
    /// Where patches and pressures come from.
    pub task: NormalTask,
    /// The motions, in the order of the case; never empty.
    pub motions: Vec<Motion>,
    /// Which motions of the case these are: all of them, unless this is a slice.
    pub part: MotionPart,
    /// The motion of the wheelset that stands in place of the one motion above, which is then 0: the creepages of the patches
    /// follow from it.
    pub wheelset: Option<WheelsetMotion>,
    /// Forces prescribed instead of creepages, motion by motion.
    pub forces: Vec<PrescribedForces>,
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
    /// What to compute, sorted, without repetition.
    pub outputs: Vec<Output>,
    /// Remarks that go into the answer.
    pub remarks: Vec<RemarkEntry>,
    /// Memory the solve may use, in bytes.
    pub memory_bytes: u64,
    /// Hexadecimal digest of everything that determines the answer, the solver version included.
    pub digest: String,
}

impl Problem {
    /// Checks a case against the limits and prepares its numbers.
    ///
    /// # Errors
    /// Every fault found, each with its JSON pointer.
    pub fn new(case: &Case, limits: &Limits) -> Result<Problem, CaseError> {
        let given = PartialCase {
            material: Some(&case.material),
            friction: Some(case.friction.coefficient),
            contact: Some(&case.contact),
            load: case.load.as_ref(),
            motion: Some(&case.motion),
            solver: Some(&case.solver),
            outputs: &case.outputs,
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
        let of_material = elasticity.remark().map(|r| r.at_pointer("/material"));
        let of_friction = unusual_friction(case.friction.coefficient);
        let of_case = of_material.into_iter().chain(of_friction);
        let ExpandedMotions { motions, forces } = motions;
        // Creepages that are searched are looked at when they are found.
        let given: &[Motion] = match forces.iter().all(|forces| *forces == [None; 2]) {
            true => &motions,
            false => &[],
        };
        let implausible = plausibility::of_case(&case.contact, &task.patches(), given);
        let remarks = merged(of_case.chain(remarks).chain(implausible));
        let digest = digest(case, &elasticity, &motions, &forces);
        Ok(Problem {
            name: case.name.clone(),
            labels: case.labels.clone(),
            elasticity,
            friction: case.friction.coefficient,
            task,
            part: MotionPart {
                before: 0,
                all: motions.len(),
            },
            motions,
            forces,
            wheelset: profiles::wheelset(&case.motion),
            method: case.solver.method.into(),
            method_asked: case.solver.method,
            traction_bound: case.solver.traction_bound.unwrap_or_default().into(),
            resolution: resolution(&case.solver),
            time_limit: case.solver.time_limit_s.map(Duration::from_secs_f64),
            outputs: case.outputs.clone(),
            remarks,
            memory_bytes: limits.memory_bytes,
            digest,
        })
    }

    /// The same question about some of its motions.
    #[must_use]
    pub fn slice(&self, range: Range<usize>) -> Problem {
        Problem {
            part: MotionPart {
                before: self.part.before + range.start,
                ..self.part
            },
            motions: self.motions[range.clone()].to_vec(),
            forces: self.forces[range].to_vec(),
            ..self.clone()
        }
    }

    /// The same question about a part of the contact with motions of its own; without remarks.
    #[must_use]
    pub(crate) fn of_part(&self, motions: Vec<Motion>) -> Problem {
        Problem {
            motions,
            wheelset: None,
            remarks: Vec::new(),
            ..self.clone()
        }
    }

    /// Is this output asked for?
    #[must_use]
    pub fn wants(&self, output: Output) -> bool {
        self.outputs.contains(&output)
    }
}
