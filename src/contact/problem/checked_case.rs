//! A checked case in three parts: what is asked ([`Problem`]), how it is to be solved ([`Run`]) and what it is called ([`Label`]).

use std::collections::BTreeMap;
use std::ops::Range;

use crate::contact::case::words::solver::MethodName;
use crate::contact::normal::footprint::Footprint;
use crate::contact::problem::physics::{MotionPart, Problem};
use crate::contact::problem::run::Run;
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::rolling::task::RollingTask;
use crate::contact::solution::words::answer::Asked;

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

    /// May `auto` take the resultants of a motion from the creep table? Creepages and a target must be given, and the table must cover the contact.
    #[must_use]
    pub(crate) fn may_take_table(&self, index: usize) -> bool {
        let CheckedCase { problem, run, .. } = self;
        run.method_asked == MethodName::Auto
            && run.resolution.target().is_some()
            && problem.history.is_none()
            && problem.forces[index] == [None; 2]
            && problem.is_in_table()
    }

    /// What is asked of the tangential problem on a footprint.
    #[must_use]
    pub fn rolling_task<'a>(&'a self, footprint: &'a Footprint) -> RollingTask<'a> {
        let CheckedCase { problem, run, .. } = self;
        RollingTask {
            footprint,
            elasticity: &problem.elasticity,
            friction: &problem.friction,
            interface: problem.interface,
            motions: &problem.motions,
            forces: &problem.forces,
            speeds: &problem.speeds,
            first_motion: problem.part.before,
            method: run.method,
            traction_bound: run.traction_bound,
            resolution: run.resolution,
            wants_slips: run.after.needs_power(&run.outputs),
            is_differenced: false,
        }
    }
}
