//! Answers to rows: columns of numbers, and for each row a status, the method, and the reason if it has no answer.

use std::collections::BTreeMap;

use railhead_macros::Named;

use crate::case::words::solver::{MethodName, Output};
use crate::error::{CaseError, SolveError};
use crate::problem::checked_case::CheckedCase;
use crate::problem::physics::Problem;
use crate::remark::entry::RemarkEntry;
use crate::rolling::methods::table::solve::RATIO_RANGE;
use crate::solution::words::answer::{PatchSolution, PointSolution, Solution};

/// The status of a row. Only rows with the first two have resultants.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Named)]
pub enum RowStatus {
    /// The resultants meet the target, or there is no target.
    Ok,
    /// The bound or the estimate of the error is above the target.
    TargetMissed,
    /// `auto` would solve the row on a mesh: the bound of the table is above the target, or the table does not represent the case.
    NeedsSolver,
    /// The method does not cover the patch.
    NotCovered,
    /// The case of the row has faults.
    Refused,
    /// A number of the table's answer is not finite.
    NotFinite,
    /// The iteration ended without meeting its tolerance.
    NotConverged,
    /// The method found no solution of the contact.
    Unsolvable,
    /// The time limit of a row was reached.
    OutOfTime,
    /// The solver stopped on an internal error.
    SolverFailed,
}

impl RowStatus {
    /// Whether the row has resultants.
    pub fn has_answer(self) -> bool {
        matches!(self, RowStatus::Ok | RowStatus::TargetMissed)
    }

    /// Returns the reason of a row that the solver did not answer; empty for a row with resultants.
    pub(crate) fn reason(self) -> String {
        match self {
            RowStatus::NotCovered => format!(
                "a/b of the ellipse is outside {} to {}, the range of \"method\": \"table\"; use boundary_element or fastsim",
                RATIO_RANGE.start(),
                RATIO_RANGE.end()
            ),
            RowStatus::NeedsSolver => "too many rows need the solver; submit a run".to_owned(),
            RowStatus::Refused => "the case has faults; a check of it alone lists them".to_owned(),
            RowStatus::NotFinite => "a number of the result is not finite".to_owned(),
            RowStatus::SolverFailed => {
                "the row was not solved; submit its case as a job".to_owned()
            }
            _ => String::new(),
        }
    }
}

/// Names of the first columns of numbers of rows that are evaluated at once.
pub const ROW_NAMES: [&str; 6] = of_rows(NUMBER_NAMES);

/// Chooses the columns of [`ROW_NAMES`] from those of [`NUMBER_NAMES`].
const fn of_rows<T: Copy>(all: [T; NUMBER_NAMES.len()]) -> [T; 6] {
    let [_, x, y, moment, error, _, power, stick, ..] = all;
    [x, y, moment, error, power, stick]
}

/// Answers to rows. A number is NaN for a row without it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RowsAnswer {
    /// The columns with their names: those of [`NumberColumns::names`]. If rows are evaluated at once, they begin with [`ROW_NAMES`] and the
    /// derivatives, and those of the solver are absent unless it was needed. The error estimate bounds the error of each force; in rows without
    /// a mesh, that of the moment is this bound times √(ab).
    pub numbers: Vec<(&'static str, Vec<f64>)>,
    /// The status of each row.
    pub status: Vec<RowStatus>,
    solved: NumberColumns,
    /// The notes on the rows that have one, by the index of the row.
    notes: BTreeMap<usize, RowNote>,
}

/// The facts about a row that are no numbers.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct RowNote {
    /// The method of a row with an answer.
    pub(crate) method: Option<MethodName>,
    /// The reason of a row without an answer.
    pub(crate) reason: String,
    /// Codes of the remarks of a row that the solver answered, each code once, separated by blanks.
    pub(crate) remarks: String,
}

/// The answer to one row without a mesh. A missing number is NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowAnswer {
    /// The numbers in the order of [`NUMBER_NAMES`].
    pub numbers: RowNumbers,
    /// The derivatives in the order of [`GRADIENT_NAMES`].
    pub gradients: [f64; GRADIENT_NAMES.len()],
    /// The status.
    pub status: RowStatus,
}

impl RowAnswer {
    /// Returns a row without an answer.
    pub(crate) fn without(status: RowStatus) -> RowAnswer {
        RowAnswer {
            numbers: [f64::NAN; NUMBER_NAMES.len()],
            gradients: [f64::NAN; GRADIENT_NAMES.len()],
            status,
        }
    }

    /// Returns the row without its answer if one of its numbers is not finite.
    pub(crate) fn finite(self, gradients: bool) -> RowAnswer {
        let derivatives = if gradients { GRADIENT_NAMES.len() } else { 0 };
        let mut numbers = self.of_columns().take(ROW_NAMES.len() + derivatives);
        match self.status.has_answer() && !numbers.all(f64::is_finite) {
            true => RowAnswer::without(RowStatus::NotFinite),
            false => self,
        }
    }

    /// Returns the numbers in the order of [`ROW_NAMES`] and [`GRADIENT_NAMES`].
    pub(crate) fn of_columns(&self) -> impl Iterator<Item = f64> + use<> {
        of_rows(self.numbers).into_iter().chain(self.gradients)
    }
}

impl RowsAnswer {
    /// Creates an answer without rows, with capacity for `rows`.
    pub(crate) fn with_capacity(rows: usize, gradients: bool) -> RowsAnswer {
        let more = GRADIENT_NAMES.into_iter().filter(|_| gradients);
        let names = ROW_NAMES.into_iter().chain(more);
        let found = [false; UNKNOWNS.len()];
        RowsAnswer {
            solved: NumberColumns { found, gradients },
            numbers: names.map(|name| (name, Vec::with_capacity(rows))).collect(),
            status: Vec::with_capacity(rows),
            ..RowsAnswer::default()
        }
    }

    /// Creates the answer to a number of rows before any of them is solved.
    pub(crate) fn unsolved(rows: usize, columns: NumberColumns) -> RowsAnswer {
        let names = columns.names().into_iter();
        RowsAnswer {
            numbers: names.map(|name| (name, vec![f64::NAN; rows])).collect(),
            status: vec![RowStatus::SolverFailed; rows],
            solved: columns,
            ..RowsAnswer::default()
        }
    }

    /// Adds a row.
    pub(crate) fn push(&mut self, row: RowAnswer) {
        for ((_, column), number) in self.numbers.iter_mut().zip(row.of_columns()) {
            column.push(number);
        }
        self.status.push(row.status);
    }

    /// Returns why a row has no resultants; empty for a row with resultants.
    pub fn reason(&self, row: usize) -> String {
        let noted = self.notes.get(&row);
        noted.map_or_else(|| self.status[row].reason(), |note| note.reason.clone())
    }

    /// Returns the codes of the remarks of a row, separated by blanks. Empty for rows by the table or FASTSIM.
    pub fn remarks(&self, row: usize) -> &str {
        self.notes.get(&row).map_or("", |note| &note.remarks)
    }

    /// Returns the method of a row with an answer; `None` if rows are evaluated at once without the solver.
    pub fn method(&self, row: usize) -> Option<MethodName> {
        self.notes.get(&row)?.method
    }

    /// The number of rows without an answer.
    pub fn without_answer(&self) -> usize {
        self.status.iter().filter(|row| !row.has_answer()).count()
    }

    /// The memory of the answer in bytes.
    pub fn bytes(&self) -> usize {
        (size_of::<f64>() * self.numbers.len() + 1) * self.status.len()
    }

    /// Returns the columns of numbers with their names.
    pub fn columns(&self) -> Vec<(&'static str, &[f64])> {
        let columns = self.numbers.iter();
        columns.map(|(name, column)| (*name, &column[..])).collect()
    }

    /// Returns the numbers of a column; an empty slice if there is no such column.
    pub fn column(&self, name: &str) -> &[f64] {
        let found = self.numbers.iter().find(|(own, _)| *own == name);
        found.map_or(&[], |(_, numbers)| numbers)
    }

    /// Puts the columns of [`ROW_NAMES`] and the derivatives first.
    pub(crate) fn for_rows(mut self) -> RowsAnswer {
        let place = |name: &str| {
            let mut first = ROW_NAMES.iter().chain(&GRADIENT_NAMES);
            first.position(|own| *own == name).unwrap_or(usize::MAX)
        };
        self.numbers.sort_by_key(|(name, _)| place(name));
        self
    }

    /// Writes the outcome of a row. An answer with a number that is not finite becomes a failure.
    pub(crate) fn set(&mut self, row: usize, mut outcome: RowOutcome) {
        let names = self.solved.names();
        if let Some(name) = not_finite(&names, &outcome.numbers) {
            let quantity = name.to_owned();
            let reason = SolveError::NotFinite { quantity }.to_string();
            outcome = RowOutcome::without(RowStatus::Unsolvable, reason);
        }
        for (name, column) in &mut self.numbers {
            let mut numbers = names.iter().zip(&outcome.numbers);
            let own = numbers.find(|(own, _)| *own == name);
            column[row] = own.map_or(f64::NAN, |(_, number)| *number);
        }
        self.status[row] = outcome.status;
        self.notes.insert(row, outcome.note);
    }

    /// Writes the answer to the one motion of a row.
    pub(crate) fn set_solution(&mut self, row: usize, solution: &Solution) {
        let Some(numbers) = numbers_of(solution, &self.solved) else {
            return;
        };
        let mut points = points_of(solution);
        let method = points_of(solution).next().map(|point| point.solver.method);
        let outcome = RowOutcome {
            status: match points.all(|point| point.target_met != Some(false)) {
                true => RowStatus::Ok,
                false => RowStatus::TargetMissed,
            },
            note: RowNote {
                method,
                remarks: RemarkEntry::codes(&solution.remarks),
                ..RowNote::default()
            },
            numbers,
        };
        self.set(row, outcome);
    }
}

/// Returns the name of the first number that is not finite, other than an optional one. Several patches have no derivatives.
fn not_finite(names: &[&'static str], numbers: &[f64]) -> Option<&'static str> {
    let is_optional =
        |name: &str| OPTIONAL_NUMBERS.contains(&name) || GRADIENT_NAMES.contains(&name);
    let is_wrong = |(name, number): &(&&str, &f64)| {
        !(number.is_finite() || number.is_nan() && is_optional(name))
    };
    let mut named = names.iter().zip(numbers);
    named.find(is_wrong).map(|(name, _)| *name)
}

/// Names of the columns of derivatives: of forces and moment, each with respect to both creepages and the spin.
pub const GRADIENT_NAMES: [&str; 9] = [
    "force_x_n_by_creepage_x",
    "force_x_n_by_creepage_y",
    "force_x_n_by_spin_per_mm",
    "force_y_n_by_creepage_x",
    "force_y_n_by_creepage_y",
    "force_y_n_by_spin_per_mm",
    "moment_z_n_mm_by_creepage_x",
    "moment_z_n_mm_by_creepage_y",
    "moment_z_n_mm_by_spin_per_mm",
];

/// The outcome of a row that was solved, or evaluated for a run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RowOutcome {
    pub(crate) status: RowStatus,
    pub(crate) note: RowNote,
    /// The numbers in the order of [`NumberColumns::names`]; empty without an answer.
    pub(crate) numbers: Vec<f64>,
}

impl RowOutcome {
    /// Returns the outcome of a row without an answer.
    pub(crate) fn without(status: RowStatus, reason: String) -> RowOutcome {
        let note = RowNote {
            reason,
            ..RowNote::default()
        };
        RowOutcome {
            status,
            note,
            numbers: Vec::new(),
        }
    }

    /// Returns the failure of a solve; `None` if the caller stopped the solve.
    pub(crate) fn of(error: &SolveError) -> Option<RowOutcome> {
        let status = match error {
            SolveError::Cancelled => return None,
            SolveError::OutOfTime { .. } => RowStatus::OutOfTime,
            SolveError::NotCovered { .. } => RowStatus::NotCovered,
            SolveError::NotConverged { .. } => RowStatus::NotConverged,
            SolveError::RoughProfile { .. }
            | SolveError::Unmeshable { .. }
            | SolveError::NormalProblem { .. }
            | SolveError::NotFinite { .. } => RowStatus::Unsolvable,
        };
        Some(RowOutcome::without(status, error.to_string()))
    }

    /// Returns the failure of a case with faults.
    pub(crate) fn refused(CaseError(faults): &CaseError) -> RowOutcome {
        let first = faults.first();
        let first = first.map(|fault| format!("{}: {}", fault.pointer, fault.detail));
        let mut reason = first.unwrap_or_default();
        if faults.len() > 1 {
            reason += &format!("; and {} more faults", faults.len() - 1);
        }
        RowOutcome::without(RowStatus::Refused, reason)
    }
}

/// Names of the columns of numbers in every answer of the solver, in the order of [`RowNumbers`].
pub const NUMBER_NAMES: [&str; 12] = [
    "normal_force_n",
    "force_x_n",
    "force_y_n",
    "moment_z_n_mm",
    "error_estimate",
    "moment_error_estimate",
    "friction_power_n",
    "stick_share",
    "area_mm2",
    "pressure_max_mpa",
    "patches",
    "iterations",
];

/// Columns that may be NaN in a row with an answer: estimates of explicit meshes, shares without zones, iterations of the table.
const OPTIONAL_NUMBERS: [&str; 4] = [
    "error_estimate",
    "moment_error_estimate",
    "stick_share",
    "iterations",
];

/// The numbers of one row in the order of [`NUMBER_NAMES`]: sums over the patches, and the largest of their pressures. `error_estimate` is the
/// larger of the errors of both forces. A missing number is NaN.
pub type RowNumbers = [f64; NUMBER_NAMES.len()];

/// An unknown that the solver determines for a prescribed force or torque: its name, whether a case of one motion has it, and its value.
type Unknown = (
    &'static str,
    fn(&Problem) -> bool,
    fn(&Solution) -> Option<f64>,
);

const UNKNOWNS: [Unknown; 4] = [
    (
        "creepage_x",
        |problem| problem.forces[0][0].is_some(),
        |solution| Some(points_of(solution).next()?.motion.creepage_x),
    ),
    (
        "creepage_y",
        |problem| problem.forces[0][1].is_some(),
        |solution| Some(points_of(solution).next()?.motion.creepage_y),
    ),
    (
        "angular_velocity_rad_per_s",
        |problem| problem.wheelset_forces[0].is_some() || problem.drive_torque.is_some(),
        |solution| {
            let position = || solution.wheelset.as_ref()?.positions.first();
            let of_wheelset = || Some(position()?.angular_velocity_rad_per_s);
            solution.angular_velocity_rad_per_s.or_else(of_wheelset)
        },
    ),
    (
        "lateral_velocity_mm_per_s",
        |problem| problem.wheelset_forces[1].is_some(),
        |solution| solution.lateral_velocity_mm_per_s,
    ),
];

/// The columns of numbers of an answer.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct NumberColumns {
    /// Whether there is a column for each of [`UNKNOWNS`].
    found: [bool; UNKNOWNS.len()],
    /// Whether there are derivatives.
    gradients: bool,
}

impl NumberColumns {
    /// Returns the columns for a case with one motion.
    pub fn of(case: &CheckedCase) -> NumberColumns {
        NumberColumns {
            found: UNKNOWNS.map(|(_, has, _)| has(&case.problem)),
            gradients: case.run.wants(Output::Gradients),
        }
    }

    /// Returns the columns that any case can have.
    pub fn all() -> NumberColumns {
        NumberColumns {
            found: [true; UNKNOWNS.len()],
            gradients: true,
        }
    }

    fn unknowns(&self) -> impl Iterator<Item = Unknown> {
        let all = UNKNOWNS.into_iter().zip(self.found);
        all.filter_map(|(unknown, found)| found.then_some(unknown))
    }

    /// Returns their names: those of every answer, the unknowns, the derivatives.
    pub fn names(&self) -> Vec<&'static str> {
        let found = self.unknowns().map(|(name, ..)| name);
        let gradients = GRADIENT_NAMES.into_iter().filter(|_| self.gradients);
        NUMBER_NAMES
            .into_iter()
            .chain(found)
            .chain(gradients)
            .collect()
    }
}

/// Returns the results of each patch under the only motion.
fn points_of(solution: &Solution) -> impl Iterator<Item = &PointSolution> {
    let patches = solution.patches.iter();
    patches.filter_map(|patch| patch.points.first())
}

/// Returns the numbers of the only motion, in the order of the columns.
fn numbers_of(solution: &Solution, columns: &NumberColumns) -> Option<Vec<f64>> {
    let total = solution.total.first()?;
    let points = || points_of(solution);
    let sum = |of: fn(&PatchSolution) -> f64| solution.patches.iter().map(of).sum::<f64>();
    let area = sum(|patch| patch.area_mm2);
    let stick: Option<f64> = points().map(|point| point.stick_area_mm2).sum();
    let error = total.error_estimate;
    let pressures = solution.patches.iter().map(|patch| patch.pressure_max_mpa);
    let has_mesh = points().any(|point| point.solver.mesh.is_some());
    let iterations: u32 = points().map(|point| point.solver.iterations).sum();
    let numbers: RowNumbers = [
        sum(|patch| patch.normal_force_n),
        total.force_x_n,
        total.force_y_n,
        total.moment_z_n_mm,
        error.map_or(f64::NAN, |error| error.force_x_n.max(error.force_y_n)),
        error.map_or(f64::NAN, |error| error.moment_z_n_mm),
        points().map(|point| point.friction_power_n).sum(),
        stick.map_or(f64::NAN, |stick| stick / area),
        area,
        pressures.fold(0.0, f64::max),
        solution.patches.len() as f64,
        if has_mesh {
            f64::from(iterations)
        } else {
            f64::NAN
        },
    ];
    let found = columns.unknowns();
    let found = found.map(|(.., number)| number(solution).unwrap_or(f64::NAN));
    let only = points().next().filter(|_| solution.patches.len() == 1);
    let slopes = only.and_then(|point| point.gradients.as_deref());
    let slopes = slopes.map_or([[f64::NAN; 3]; 3], |slopes| {
        [slopes.force_x_n, slopes.force_y_n, slopes.moment_z_n_mm]
    });
    let slopes = slopes.into_iter().flatten().filter(|_| columns.gradients);
    Some(numbers.into_iter().chain(found).chain(slopes).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_whose_numbers_are_not_all_finite_has_no_answer() {
        let ok = RowAnswer {
            numbers: std::array::from_fn(|k| k as f64),
            gradients: [f64::NAN; 9],
            status: RowStatus::Ok,
        };
        let mut answer = RowsAnswer::with_capacity(9, false);
        answer.push(ok.finite(false));
        for (k, place) in [1, 2, 3, 4, 6, 7].into_iter().enumerate() {
            let mut row = ok;
            row.numbers[place] = [f64::NAN, f64::INFINITY][k % 2];
            answer.push(row.finite(false));
        }
        assert_eq!(answer.status[0], RowStatus::Ok);
        assert_eq!(answer.status[1..], [RowStatus::NotFinite; 6]);
        for (name, column) in answer.columns() {
            assert!(column[0].is_finite(), "{name}");
            assert!(column[1..].iter().all(|number| number.is_nan()), "{name}");
        }
        assert_eq!(
            ok.finite(true).status,
            RowStatus::NotFinite,
            "its derivatives"
        );
    }
}

#[cfg(test)]
mod many_tests {
    use super::*;

    fn solved() -> RowOutcome {
        RowOutcome {
            status: RowStatus::Ok,
            note: RowNote {
                method: Some(MethodName::BoundaryElement),
                ..RowNote::default()
            },
            numbers: vec![1.0; NUMBER_NAMES.len()],
        }
    }

    #[test]
    fn an_answer_with_a_number_that_is_not_finite_is_a_failure_with_its_reason() {
        for (place, name) in NUMBER_NAMES.iter().enumerate() {
            for number in [f64::NAN, f64::INFINITY] {
                let mut answer = RowsAnswer::unsolved(1, NumberColumns::default());
                let mut row = solved();
                row.numbers[place] = number;
                answer.set(0, row);
                let kept = OPTIONAL_NUMBERS.contains(name) && number.is_nan();
                assert_eq!(answer.status[0] == RowStatus::Ok, kept, "{name} {number}");
                if !kept {
                    assert_eq!(answer.status[0], RowStatus::Unsolvable);
                    assert!(answer.reason(0).contains(name), "{answer:?}");
                    let mut numbers = answer.numbers.iter();
                    assert!(numbers.all(|(_, column)| column[0].is_nan()));
                    assert!(answer.method(0).is_none());
                }
            }
        }
    }

    #[test]
    fn a_failure_after_an_answer_leaves_no_number_of_it() {
        let mut answer = RowsAnswer::unsolved(1, NumberColumns::default());
        answer.set(0, solved());
        assert!(answer.reason(0).is_empty() && answer.without_answer() == 0);
        let error = SolveError::NotCovered {
            reason: "too slender".to_owned(),
        };
        answer.set(0, RowOutcome::of(&error).expect("a failure"));
        assert_eq!(answer.status, [RowStatus::NotCovered]);
        assert_eq!(answer.reason(0), "too slender");
        assert!(answer.numbers.iter().all(|(_, column)| column[0].is_nan()));
    }
}
