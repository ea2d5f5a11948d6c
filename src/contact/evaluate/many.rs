//! Solves many rows: one case with columns of values in place of some of its members.
//!
//! The answer to a row depends on its own case alone, to the last bit: not on other rows, their order or number, or the load of the machine.
//! Rows share the operators of patches of one shape and the profiles that were read, so that rows of one shape follow each other.
//!
//! What many rows are, and what one of them asks.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use serde_json::Value;

use crate::case::solve_time::TABLE_SECONDS;
use crate::case::solver::{KnownPair, Limits};
use crate::case::words::solver::{MethodName, Output};
use crate::error::{CaseError, Fault, SolveError};
use crate::evaluate::answer::{
    ManyAnswer, NumberColumns, RowFailure, RowNumbers, RowStatus, RowsAnswer, SolvedRow,
};
use crate::evaluate::rows::Rows;
use crate::evaluate::varied::{VariedColumn, case_of_row};
use crate::monitor::{Monitor, Stop};
use crate::problem::checked_case::CheckedCase;
use crate::rolling::methods::table::solve::RATIO_RANGE;
use crate::solution::words::answer::Solution;

/// Solves rows: numbers of Hertz contacts by `table` and `fastsim`, or by `auto` where the table's bound meets the target, are evaluated
/// without meshes; every other row is checked and solved as a case of its own.
///
/// # Errors
/// [`SolveError::Cancelled`]: the monitor stopped the work. What hinders one row is its status.
pub fn solve_many(
    task: &ManyTask,
    solve: &RowSolver,
    monitor: &dyn Monitor,
) -> Result<ManyAnswer, SolveError> {
    let checked = crate::check_with(task.known, task.case, task.limits).ok();
    let columns = checked.as_ref().map(NumberColumns::of).unwrap_or_default();
    let mut answer = ManyAnswer::new(task.rows(), columns);
    let mut open: Vec<usize> = (0..task.rows()).collect();
    if let Some((evaluable, method)) = checked.and_then(|checked| evaluable(task, &checked)) {
        let mut patches = Vec::with_capacity(task.rows());
        let Ok(evaluated) = evaluable.evaluate_to(|patch| {
            patches.push(patch);
            Ok::<_, Infallible>(())
        });
        open.retain(|row| !take(&mut answer, *row, method, &evaluated, patches[*row]));
    }
    open.sort_by(|a, b| near(task.columns, *a, *b));
    solve_each(task, &open, None, (solve, monitor), &mut answer)?;
    Ok(answer)
}

/// Solves every row as a case of its own. `checked` is the checked case of the task, and `first` that of its first row, if it is known.
fn solve_rows<E>(
    task: &ManyTask,
    checked: &CheckedCase,
    first: Option<&CheckedCase>,
    solve: &RowSolver,
    monitor: &dyn Monitor,
) -> Result<RowsAnswer, NotAtOnce<E>> {
    let mut answer = ManyAnswer::new(task.rows(), NumberColumns::of(checked));
    let mut rows: Vec<usize> = (0..task.rows()).collect();
    rows.sort_by(|a, b| near(task.columns, *a, *b));
    let solved = solve_each(task, &rows, first, (solve, monitor), &mut answer);
    solved.map_err(|_| NotAtOnce::Stopped)?;
    Ok(RowsAnswer::of_solver(answer))
}

/// Most rows of one evaluation that the solver answers; the table and FASTSIM answer any number.
pub const SOLVED_ROWS_MAX: usize = 200;

/// Why rows are not answered at once.
#[derive(Debug)]
pub enum NotAtOnce<E> {
    /// That many rows need the solver, more than [`SOLVED_ROWS_MAX`].
    TooManyRows(usize),
    /// The monitor stopped the solver.
    Stopped,
    /// The error of a step.
    Step(E),
}

/// Answers rows at once, by the table or FASTSIM where they apply, and else by the solver. The case of the task is that of its first row, and
/// `checked` is its checked form; `step` is called after each row of the former and may end the evaluation.
///
/// With `auto`, rows that the table leaves to the solver are solved too, if there are at most [`SOLVED_ROWS_MAX`]; otherwise their status is
/// [`RowStatus::NeedsSolver`].
///
/// # Errors
/// The rows exceed what one evaluation may take, or it was ended.
pub fn evaluate_at_once<E>(
    task: &ManyTask,
    checked: &CheckedCase,
    solve: &RowSolver,
    monitor: &dyn Monitor,
    mut step: impl FnMut() -> Result<(), E>,
) -> Result<RowsAnswer, NotAtOnce<E>> {
    let first = Some(checked).filter(|checked| several_answers(checked).is_none());
    let Some((rows, method)) = evaluable(task, checked) else {
        let rows = task.rows();
        if rows > SOLVED_ROWS_MAX {
            return Err(NotAtOnce::TooManyRows(rows));
        }
        return solve_rows(task, checked, first, solve, monitor);
    };
    let answered = rows.evaluate_to(|_| step());
    let mut answer = answered.map_err(NotAtOnce::Step)?;
    let open: Vec<usize> = (0..answer.status.len())
        .filter(|row| match answer.status[*row] {
            RowStatus::NeedsSolver => true,
            RowStatus::NotCovered => method == MethodName::Auto,
            _ => false,
        })
        .collect();
    if !open.is_empty() && open.len() <= SOLVED_ROWS_MAX {
        let columns = task.columns.iter();
        let columns: Vec<VariedColumn> = columns
            .map(|column| VariedColumn {
                pointer: column.pointer.clone(),
                values: column.values.pick(&open),
            })
            .collect();
        let task = ManyTask {
            columns: &columns,
            ..*task
        };
        let first = first.filter(|_| open[0] == 0);
        let solved = solve_rows(&task, checked, first, solve, monitor)?;
        answer.replace(&open, &solved);
    }
    Ok(answer)
}

/// How long the rows of a task take, in s on one core of the machine the figures were taken on; rough, and the same for the same rows.
pub fn expected_seconds(task: &ManyTask) -> f64 {
    let rows = task.rows() as f64;
    let Ok(checked) = crate::check_with(task.known, task.case, task.limits) else {
        return rows * TABLE_SECONDS;
    };
    let seconds = checked.cost().seconds;
    let Some((evaluable, method)) = evaluable(task, &checked) else {
        return rows * seconds;
    };
    let evaluated = evaluable.evaluate();
    let left = evaluated.status.iter();
    let left = left.filter(|status| to_solve(**status, method)).count();
    let each = match method {
        MethodName::Fastsim => seconds,
        _ => TABLE_SECONDS,
    };
    rows * each + left as f64 * seconds
}

/// The rows as [`Rows`], if they are of that kind, and the method that was asked for.
fn evaluable<'a>(task: &ManyTask<'a>, checked: &CheckedCase) -> Option<(Rows<'a>, MethodName)> {
    let rows = Rows::new(task.case, checked, task.columns)?;
    Some((rows, checked.run.method_asked))
}

/// Is a row that was evaluated so left to the solver? The solver gives the reason of a row without finite numbers.
fn to_solve(status: RowStatus, method: MethodName) -> bool {
    match status {
        RowStatus::Ok | RowStatus::TargetMissed => false,
        RowStatus::NotCovered => method == MethodName::Auto,
        _ => true,
    }
}

/// Takes over an evaluated row; `false` if it is to be solved.
fn take(
    answer: &mut ManyAnswer,
    row: usize,
    method: MethodName,
    evaluated: &RowsAnswer,
    [normal_force, c]: [f64; 2],
) -> bool {
    let status = evaluated.status[row];
    if to_solve(status, method) {
        return false;
    }
    if !status.has_answer() {
        let reason = format!(
            "a/b of the ellipse is outside {} to {}, the range of \"method\": \"table\"; use boundary_element or fastsim",
            RATIO_RANGE.start(),
            RATIO_RANGE.end()
        );
        answer.set(
            row,
            Err(RowFailure {
                status: RowStatus::NotCovered,
                reason,
            }),
        );
        return true;
    }
    let area = std::f64::consts::PI * c * c;
    let mut numbers = evaluated.numbers.iter().map(|(_, column)| column[row]);
    let mut next = || numbers.next().unwrap_or(f64::NAN);
    let [x, y, moment, error, power, stick] = std::array::from_fn(|_| next());
    let slopes: Vec<f64> = numbers.collect();
    let numbers: RowNumbers = [
        normal_force,
        x,
        y,
        moment,
        error,
        error * c,
        power,
        stick,
        area,
        1.5 * normal_force / area,
        1.0,
        f64::NAN,
    ];
    let solved = SolvedRow {
        target_met: status == RowStatus::Ok,
        method: Some(match method {
            MethodName::Auto => MethodName::Table,
            asked => asked,
        }),
        numbers: numbers.into_iter().chain(slopes).collect(),
    };
    answer.set(row, Ok(solved));
    true
}

/// Orders rows so that equal shapes, and then near motions, follow each other.
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

/// Solves rows one after the other. The first row of the task is not checked again if its checked case is given.
///
/// # Errors
/// [`SolveError::Cancelled`]: the monitor stopped the work.
fn solve_each(
    task: &ManyTask,
    rows: &[usize],
    first: Option<&CheckedCase>,
    (solve, monitor): (&RowSolver, &dyn Monitor),
    answer: &mut ManyAnswer,
) -> Result<(), SolveError> {
    let own = 1.0 / rows.len() as f64;
    for (done, row) in rows.iter().enumerate() {
        let before = done as f64 * own;
        if monitor.tick(before.min(1.0)).is_break() {
            return Err(SolveError::Cancelled);
        }
        let checked = match first.filter(|_| *row == 0) {
            Some(checked) => Ok(task.as_row(checked.clone())),
            None => task.checked(*row),
        };
        let checked = match checked {
            Ok(checked) => checked,
            Err(error) => {
                answer.set(*row, Err(RowFailure::refused(&error)));
                continue;
            }
        };
        let watch = RowMonitor {
            inner: monitor,
            begun: monitor.elapsed(),
            before,
            own,
        };
        match catch_unwind(AssertUnwindSafe(|| solve(&checked, &watch))) {
            Ok(Ok(solution)) => answer.set_solution(*row, &solution),
            Ok(Err(error)) => {
                let failure = RowFailure::of(&error).ok_or(SolveError::Cancelled)?;
                answer.set(*row, Err(failure));
            }
            Err(_) => {
                let failure = RowFailure {
                    status: RowStatus::SolverFailed,
                    reason: "the solver stopped on an internal error".to_owned(),
                };
                answer.set(*row, Err(failure));
            }
        }
    }
    Ok(())
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

/// Solves a checked case.
pub type RowSolver<'a> = dyn Fn(&CheckedCase, &dyn Monitor) -> Result<Solution, SolveError> + 'a;

/// Rows to solve.
#[derive(Debug, Clone, Copy)]
pub struct ManyTask<'a> {
    /// A good case of one motion, such as that of the first of all rows.
    pub case: &'a Value,
    /// What differs from it, at least one column; all of the same length.
    pub columns: &'a [VariedColumn],
    /// Cross-sections that rows name, by their names.
    pub profiles: &'a BTreeMap<String, Value>,
    /// Pairs of cross-sections that were read before.
    pub known: &'a KnownPair,
    /// What a row may use.
    pub limits: &'a Limits,
    /// Longest time for one row; a shorter one of the case counts.
    pub time_limit: Duration,
}

impl ManyTask<'_> {
    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.columns.first().map_or(1, |column| column.values.len())
    }

    /// The checked case of a row.
    ///
    /// # Errors
    /// Its faults.
    pub(crate) fn checked(&self, row: usize) -> Result<CheckedCase, CaseError> {
        let case = case_of_row(self.case, self.columns, self.profiles, row)
            .map_err(|(pointer, reason)| CaseError(vec![Fault::new(pointer, reason)]))?;
        let checked = crate::check_with(self.known, &case, self.limits)?;
        match several_answers(&checked) {
            Some(fault) => Err(CaseError(vec![fault])),
            None => Ok(self.as_row(checked)),
        }
    }

    /// A checked case with the outputs and the time limit of a row.
    pub(crate) fn as_row(&self, mut checked: CheckedCase) -> CheckedCase {
        // Rows are answered with numbers alone.
        let numbers = [Output::Resultants, Output::Zones, Output::Gradients];
        let outputs = &mut checked.run.outputs;
        outputs.retain(|output| numbers.contains(output));
        let own = checked.run.time_limit;
        checked.run.time_limit = Some(own.map_or(self.time_limit, |own| own.min(self.time_limit)));
        checked
    }
}

/// The fault of a case that has several answers, so that no row stands for it.
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
