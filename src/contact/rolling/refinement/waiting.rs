//! Motions of a stretch whose error is not known yet.

use crate::contact::rolling::refinement::level_solve::{JudgedAnswer, MotionTask};
use crate::contact::rolling::refinement::refine::ComparedAnswer;

/// A motion with one rule solved.
#[derive(Debug)]
pub(super) struct Waiting {
    pub(super) asked: MotionTask,
    /// On the line of its stretch.
    pub(super) place: f64,
    pub(super) solved: JudgedAnswer,
    /// Comparison with the companions, once it is made.
    pub(super) compared: Option<Compared>,
}

impl Waiting {
    /// Is nothing known of its error yet?
    pub(super) fn is_open(&self) -> bool {
        self.compared.is_none() && !self.solved.indicators.is_by_table()
    }
}

/// What came of the comparison of a motion with its companions.
#[derive(Debug)]
pub(super) enum Compared {
    /// It can lend.
    Lends(ComparedAnswer),
    /// It cannot.
    Alone(ComparedAnswer),
}
