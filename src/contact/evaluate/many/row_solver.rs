//! Solves rows, each as a case of its own.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use crate::contact::error::SolveError;
use crate::contact::evaluate::many::task::{ManyTask, RowSolver};
use crate::contact::evaluate::many_answer::{ManyAnswer, ManyStatus, RowFailure};
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

    /// Solves rows. The first row of the task is not checked again if its checked case is given.
    ///
    /// # Errors
    /// [`SolveError::Cancelled`]: the monitor stopped the work.
    pub(crate) fn solve(
        mut self,
        rows: &[usize],
        first: Option<&CheckedCase>,
    ) -> Result<(), SolveError> {
        self.all = rows.len();
        for row in rows {
            if self.watch().tick(0.0).is_break() {
                return Err(SolveError::Cancelled);
            }
            let known = first.filter(|_| *row == 0);
            let checked = match known {
                Some(checked) => Ok(self.task.as_row(checked.clone())),
                None => self.task.checked(*row),
            };
            match checked {
                Ok(checked) => self.alone(*row, &checked)?,
                Err(error) => self.end(*row, RowFailure::refused(&error)),
            }
        }
        Ok(())
    }

    fn alone(&mut self, row: usize, checked: &CheckedCase) -> Result<(), SolveError> {
        match self.solved(checked) {
            Ok(solution) => {
                self.answer.set_solution(row, &solution);
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

    fn solved(&self, checked: &CheckedCase) -> Result<Solution, RowEnd> {
        let watch = self.watch();
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

    /// The monitor of the next row.
    fn watch(&self) -> RowMonitor<'a> {
        RowMonitor {
            inner: self.monitor,
            begun: self.monitor.elapsed(),
            before: self.done as f64 / self.all as f64,
            own: 1.0 / self.all as f64,
        }
    }
}

/// The monitor of one row.
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
