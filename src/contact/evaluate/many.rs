//! Solves many rows: one case with columns of values that replace some of its members.
//!
//! The answer to a row depends on its own case alone, to the last bit: not on other rows, their order or number, or the load of the machine.
//! Rows share operators of patches of equal shape and the profiles that were read, so rows of equal shape are solved one after the other.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use serde_json::Value;

use crate::case::rail_pair::KnownPair;
use crate::case::solve_time::TABLE_SECONDS;
use crate::case::solver::Limits;
use crate::case::words::solver::{MethodName, Output};
use crate::error::{CaseError, Fault, SolveError};
use crate::evaluate::answer::{
    NumberColumns, RowAnswer, RowNote, RowOutcome, RowStatus, RowsAnswer,
};
use crate::evaluate::rows::Rows;
use crate::evaluate::varied::{VariedColumn, case_of_row, named_sections, put_sections};
use crate::monitor::{Monitor, Stop};
use crate::problem::checked_case::CheckedCase;
use crate::solution::words::answer::Solution;

/// Solves rows. Rows of Hertz contacts are evaluated without meshes by `table` and `fastsim`, or by `auto` if the bound of the table meets the
/// target. Every other row is checked and solved as a separate case.
///
/// # Errors
/// [`SolveError::Cancelled`]: the monitor stopped the work. The failure of a row is in its status.
pub fn solve_many(
    task: &ManyTask,
    solve: &RowSolver,
    monitor: &dyn Monitor,
) -> Result<RowsAnswer, SolveError> {
    let checked = task.checked_case().ok();
    let columns = checked.as_ref().map(NumberColumns::of).unwrap_or_default();
    let mut answer = RowsAnswer::unsolved(task.rows(), columns);
    let mut open: Vec<usize> = (0..task.rows()).collect();
    if let Some((rows, method)) = checked.and_then(|checked| evaluable(task, &checked)) {
        open.clear();
        for (row, found) in rows.answers().enumerate() {
            match to_solve(found.status, method) {
                true => open.push(row),
                false => answer.set(row, evaluated(found, method)),
            }
        }
    }
    solve_each(task, open, None, (solve, monitor), &mut answer)?;
    Ok(answer)
}

/// Maximum number of rows of one evaluation that the solver answers. The table and FASTSIM answer any number.
pub const SOLVED_ROWS_MAX: usize = 200;

/// Why rows are not evaluated immediately.
#[derive(Debug)]
pub enum NotAtOnce<E> {
    /// This number of rows needs the solver, more than [`SOLVED_ROWS_MAX`].
    TooManyRows(usize),
    /// The monitor stopped the solver.
    Stopped,
    /// The error that `step` returned.
    Step(E),
}

/// Evaluates rows immediately, by the table or FASTSIM if they apply, otherwise by the solver. The case of the task is that of its first row,
/// and `checked` is its checked form. `step` is called after each row of the table or FASTSIM and may end the evaluation.
///
/// At most [`SOLVED_ROWS_MAX`] rows without an answer of the table or FASTSIM are solved, as in [`solve_many`]. If there are more, their status
/// is that of their evaluation, such as [`RowStatus::NeedsSolver`].
///
/// # Errors
/// Too many rows need the solver, or the evaluation was stopped.
pub fn evaluate_at_once<E>(
    task: &ManyTask,
    checked: &CheckedCase,
    solve: &RowSolver,
    monitor: &dyn Monitor,
    mut step: impl FnMut() -> Result<(), E>,
) -> Result<RowsAnswer, NotAtOnce<E>> {
    let first = Some(checked).filter(|checked| several_answers(checked).is_none());
    let mut open: Vec<usize> = (0..task.rows()).collect();
    let mut answer = match evaluable(task, checked) {
        None if open.len() > SOLVED_ROWS_MAX => return Err(NotAtOnce::TooManyRows(open.len())),
        None => RowsAnswer::unsolved(open.len(), NumberColumns::of(checked)).for_rows(),
        Some((rows, method)) => {
            let answer = rows.evaluate_to(&mut step).map_err(NotAtOnce::Step)?;
            open.retain(|row| to_solve(answer.status[*row], method));
            answer
        }
    };
    if open.len() > SOLVED_ROWS_MAX {
        // The solver finds only the reason of these rows.
        let without = [RowStatus::Refused, RowStatus::NotFinite];
        open.retain(|row| !without.contains(&answer.status[*row]));
    }
    if open.len() <= SOLVED_ROWS_MAX {
        let solved = solve_each(task, open, first, (solve, monitor), &mut answer);
        solved.map_err(|_| NotAtOnce::Stopped)?;
    }
    Ok(answer)
}

/// Returns the rough time of the rows in s, on one core of the machine on which the constants were measured. Equal rows have equal times.
pub fn expected_seconds(task: &ManyTask) -> f64 {
    let rows = task.rows() as f64;
    let Ok(checked) = task.checked_case() else {
        return rows * TABLE_SECONDS;
    };
    let seconds = checked.cost().seconds;
    let Some((evaluable, method)) = evaluable(task, &checked) else {
        return rows * seconds;
    };
    let left = evaluable.answers();
    let left = left.filter(|row| to_solve(row.status, method)).count();
    let each = match method {
        MethodName::Fastsim => seconds,
        _ => TABLE_SECONDS,
    };
    rows * each + left as f64 * seconds
}

/// Returns the rows as [`Rows`] with the requested method, if they can be evaluated without the solver.
fn evaluable<'a>(task: &ManyTask<'a>, checked: &CheckedCase) -> Option<(Rows<'a>, MethodName)> {
    let rows = Rows::new(task.case, checked, task.columns)?;
    Some((rows, checked.run.method_asked))
}

/// Whether a row with this status after its evaluation is left to the solver, which finds the reason of numbers that are not finite.
fn to_solve(status: RowStatus, method: MethodName) -> bool {
    match status {
        RowStatus::Ok | RowStatus::TargetMissed => false,
        RowStatus::NotCovered => method == MethodName::Auto,
        _ => true,
    }
}

/// Returns the outcome of a row that was evaluated and is not left to the solver.
fn evaluated(row: RowAnswer, method: MethodName) -> RowOutcome {
    let status = row.status;
    if !status.has_answer() {
        return RowOutcome::without(status, status.reason());
    }
    RowOutcome {
        status,
        note: RowNote {
            method: Some(match method {
                MethodName::Auto => MethodName::Table,
                asked => asked,
            }),
            ..RowNote::default()
        },
        numbers: row.numbers.into_iter().chain(row.gradients).collect(),
    }
}

/// Orders rows by the columns of their shapes, then by those of their motions.
fn near(columns: &[VariedColumn], a: usize, b: usize) -> Ordering {
    let of_motion = |column: &VariedColumn| column.pointer.starts_with("/motion");
    let shapes = columns.iter().filter(|column| !of_motion(column));
    let motions = columns.iter().filter(|column| of_motion(column));
    shapes
        .chain(motions)
        .map(|column| column.values.compare(a, b))
        .find(|order| order.is_ne())
        .unwrap_or_else(|| a.cmp(&b))
}

/// Solves rows one after the other, in the order of [`near`]. The first row of the task is not checked again if its checked case is given.
///
/// # Errors
/// [`SolveError::Cancelled`]: the monitor stopped the work.
fn solve_each(
    task: &ManyTask,
    mut rows: Vec<usize>,
    first: Option<&CheckedCase>,
    (solve, monitor): (&RowSolver, &dyn Monitor),
    answer: &mut RowsAnswer,
) -> Result<(), SolveError> {
    rows.sort_by(|a, b| near(task.columns, *a, *b));
    let own = 1.0 / rows.len() as f64;
    for (done, row) in rows.into_iter().enumerate() {
        let before = done as f64 * own;
        if monitor.tick(before.min(1.0)).is_break() {
            return Err(SolveError::Cancelled);
        }
        let checked = match first.filter(|_| row == 0) {
            Some(checked) => Ok(task.as_row(checked.clone())),
            None => task.checked(row),
        };
        let checked = match checked {
            Ok(checked) => checked,
            Err(error) => {
                answer.set(row, RowOutcome::refused(&error));
                continue;
            }
        };
        let watch = RowMonitor {
            inner: monitor,
            begun: monitor.elapsed(),
            before,
            own,
        };
        let failure = match catch_unwind(AssertUnwindSafe(|| solve(&checked, &watch))) {
            Ok(Ok(solution)) => {
                answer.set_solution(row, &solution);
                continue;
            }
            Ok(Err(error)) => RowOutcome::of(&error).ok_or(SolveError::Cancelled)?,
            Err(_) => {
                let reason = "the solver stopped on an internal error";
                RowOutcome::without(RowStatus::SolverFailed, reason.to_owned())
            }
        };
        answer.set(row, failure);
    }
    Ok(())
}

/// The monitor of one row: its clock starts with the row, and its progress is that of all rows.
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

/// Solves a checked case.
pub type RowSolver<'a> = dyn Fn(&CheckedCase, &dyn Monitor) -> Result<Solution, SolveError> + 'a;

/// Rows to solve.
#[derive(Debug, Clone, Copy)]
pub struct ManyTask<'a> {
    /// A case of one motion without faults, such as that of the first row. It may name cross-sections.
    pub case: &'a Value,
    /// The columns that replace members of the case, at least one; all have the same length.
    pub columns: &'a [VariedColumn],
    /// Stored cross-sections by the names that rows give.
    pub profiles: &'a BTreeMap<String, Value>,
    /// Cache of the cross-sections that were read.
    pub known: &'a KnownPair,
    /// Limits of a row.
    pub limits: &'a Limits,
    /// Time limit of a row, unless the case has a shorter one.
    pub time_limit: Duration,
}

impl ManyTask<'_> {
    /// The number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.columns.first().map_or(1, |column| column.values.len())
    }

    fn checked_case(&self) -> Result<CheckedCase, CaseError> {
        let mut case = Cow::Borrowed(self.case);
        if !named_sections(&case).is_empty() {
            put_sections(case.to_mut(), self.profiles);
        }
        crate::check_with(self.known, &case, self.limits)
    }

    /// Returns the checked case of a row.
    ///
    /// # Errors
    /// All faults of the case.
    fn checked(&self, row: usize) -> Result<CheckedCase, CaseError> {
        let case = case_of_row(self.case, self.columns, self.profiles, row)
            .map_err(|(pointer, reason)| CaseError(vec![Fault::new(pointer, reason)]))?;
        let checked = crate::check_with(self.known, &case, self.limits)?;
        match several_answers(&checked) {
            Some(fault) => Err(CaseError(vec![fault])),
            None => Ok(self.as_row(checked)),
        }
    }

    /// Returns a checked case with the outputs and the time limit of a row.
    fn as_row(&self, mut checked: CheckedCase) -> CheckedCase {
        // The answer to a row consists of numbers only.
        let numbers = [Output::Resultants, Output::Zones, Output::Gradients];
        let outputs = &mut checked.run.outputs;
        outputs.retain(|output| numbers.contains(output));
        let own = checked.run.time_limit;
        checked.run.time_limit = Some(own.map_or(self.time_limit, |own| own.min(self.time_limit)));
        checked
    }
}

/// Returns the fault of a case with several answers, which a row cannot have.
pub fn several_answers(checked: &CheckedCase) -> Option<Fault> {
    let problem = &checked.problem;
    let (motions, positions) = (problem.motions.len(), problem.task.positions());
    if motions > 1 {
        let detail = format!("{motions} motions given; a row has one motion, and columns vary it");
        return Some(Fault::new("/motion", detail));
    }
    (positions > 1).then(|| {
        let detail = format!(
            "{positions} positions of the wheelset with their motions given; a row has one position with one motion, and columns vary them"
        );
        Fault::new("/contact", detail)
    })
}
