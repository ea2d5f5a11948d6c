//! Solves rows on meshes, each by itself or as a motion of a case that it shares with rows like it.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use crate::contact::error::SolveError;
use crate::contact::evaluate::many::near_rows::{Group, OpenGroups};
use crate::contact::evaluate::many::task::{ManyTask, RowSolver, RowStarts};
use crate::contact::evaluate::many_answer::{ManyAnswer, ManyStatus, RowFailure};
use crate::contact::method::Method;
use crate::contact::monitor::{Monitor, Stop};
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::solution::words::answer::Solution;

/// Rows that are being solved.
pub(crate) struct RowsInWork<'a> {
    task: &'a ManyTask<'a>,
    solve: &'a RowSolver<'a>,
    monitor: &'a dyn Monitor,
    /// Where their answers go.
    answer: &'a mut ManyAnswer,
    /// Rows that are over, and all.
    done: usize,
    all: usize,
}

/// Why a case has no solution.
enum RowEnd {
    Stopped,
    Failed(RowFailure),
}

impl<'a> RowsInWork<'a> {
    /// Rows of a task, before the first.
    pub(crate) fn new(
        task: &'a ManyTask<'a>,
        solve: &'a RowSolver<'a>,
        monitor: &'a dyn Monitor,
        answer: &'a mut ManyAnswer,
    ) -> RowsInWork<'a> {
        RowsInWork {
            task,
            solve,
            monitor,
            answer,
            done: 0,
            all: 0,
        }
    }

    /// Solves rows.
    ///
    /// # Errors
    /// [`SolveError::Cancelled`]: the monitor stopped the work.
    pub(crate) fn solve(mut self, rows: &[usize]) -> Result<(), SolveError> {
        self.all = rows.len();
        let mut groups = OpenGroups::default();
        for row in rows {
            if self.watch(1).tick(0.0).is_break() {
                return Err(SolveError::Cancelled);
            }
            let checked = match self.task.checked(*row) {
                Ok(checked) => checked,
                Err(error) => {
                    self.end(*row, RowFailure::refused(&error));
                    continue;
                }
            };
            let motion = checked.problem.row_motion();
            let together = self.task.starts == RowStarts::Neighbours
                && checked.run.method == Method::BoundaryElement
                && !checked.problem.is_coupled(&checked.run);
            match motion.filter(|_| together) {
                None => self.alone(*row, &checked)?,
                Some(motion) => {
                    if let Some(group) = groups.add(*row, checked, motion) {
                        self.together(&group)?;
                    }
                }
            }
        }
        for group in groups.close() {
            self.together(&group)?;
        }
        Ok(())
    }

    /// Solves the rows of a group, each started from the one before. Those that miss the target are solved by themselves as well, and so are all
    /// where they have no answer as one case.
    fn together(&mut self, group: &Group) -> Result<(), SolveError> {
        if let [only] = &*group.members {
            return self.alone(only.row, &group.head);
        }
        for (case, members) in group.parts() {
            match self.solved(&case, members.len()) {
                Err(RowEnd::Stopped) => return Err(SolveError::Cancelled),
                Ok(solution) => {
                    for (motion, member) in members.iter().enumerate() {
                        let of_row = |columns: &_, numbers: &mut [f64]| {
                            member.likeness.numbers(columns, numbers);
                        };
                        let answered = (&solution, motion);
                        self.answer.set_solution(member.row, answered, of_row);
                        self.done += 1;
                        if self.answer.status[member.row] != ManyStatus::Ok {
                            self.again(member.row)?;
                        }
                    }
                }
                Err(RowEnd::Failed(_)) => {
                    for member in members {
                        // A row of a group has no faults.
                        if let Ok(checked) = self.task.checked(member.row) {
                            self.alone(member.row, &checked)?;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Solves a row by itself, where it chooses its own meshes, after it missed the target in its group.
    fn again(&mut self, row: usize) -> Result<(), SolveError> {
        let Ok(checked) = self.task.checked(row) else {
            return Ok(());
        };
        match self.solved(&checked, 1) {
            Ok(solution) => self.answer.set_solution(row, (&solution, 0), |_, _| ()),
            Err(RowEnd::Stopped) => return Err(SolveError::Cancelled),
            // It keeps the answer of its group.
            Err(RowEnd::Failed(_)) => {}
        }
        Ok(())
    }

    fn alone(&mut self, row: usize, checked: &CheckedCase) -> Result<(), SolveError> {
        match self.solved(checked, 1) {
            Ok(solution) => {
                self.answer.set_solution(row, (&solution, 0), |_, _| ());
                self.done += 1;
            }
            Err(RowEnd::Stopped) => return Err(SolveError::Cancelled),
            Err(RowEnd::Failed(failure)) => self.end(row, failure),
        }
        Ok(())
    }

    fn end(&mut self, row: usize, failure: RowFailure) {
        self.answer.set(row, Err(failure));
        self.done += 1;
    }

    fn solved(&self, checked: &CheckedCase, rows: usize) -> Result<Solution, RowEnd> {
        let watch = self.watch(rows);
        let solved = catch_unwind(AssertUnwindSafe(|| (self.solve)(checked, &watch)));
        match solved {
            Ok(Ok(solution)) => Ok(solution),
            Ok(Err(error)) => Err(RowFailure::of(&error).map_or(RowEnd::Stopped, RowEnd::Failed)),
            Err(_) => Err(RowEnd::Failed(RowFailure {
                status: ManyStatus::SolverFailed,
                reason: "the solver stopped on a defect of its own".to_owned(),
            })),
        }
    }

    /// The monitor of the next rows.
    fn watch(&self, rows: usize) -> RowMonitor<'a> {
        RowMonitor {
            inner: self.monitor,
            begun: self.monitor.elapsed(),
            before: self.done as f64 / self.all as f64,
            own: rows as f64 / self.all as f64,
        }
    }
}

/// The monitor of some of the rows.
struct RowMonitor<'a> {
    inner: &'a dyn Monitor,
    begun: Duration,
    before: f64,
    own: f64,
}

impl Monitor for RowMonitor<'_> {
    fn tick(&self, progress: f64) -> ControlFlow<Stop> {
        self.inner
            .tick((self.before + self.own * progress).min(1.0))
    }

    fn elapsed(&self) -> Duration {
        self.inner.elapsed().saturating_sub(self.begun)
    }
}
