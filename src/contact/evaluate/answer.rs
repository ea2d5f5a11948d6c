//! What rows are answered with: columns of numbers, a word for each row, the method that answered it, and why there is no answer.

use railhead_macros::{Named, Names};

use crate::case::words::solver::{MethodName, Output};
use crate::error::{CaseError, SolveError};
use crate::problem::checked_case::CheckedCase;
use crate::problem::physics::Problem;
use crate::solution::words::answer::{PatchSolution, PointSolution, Solution};

/// What became of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Named)]
pub enum RowStatus {
    /// The resultants meet the target, or there is none.
    Ok,
    /// The resultants are there; the bound or the estimate of their error is above the target.
    TargetMissed,
    /// No resultants: `auto` would solve the row on a mesh. The bound of the table is above the target, or the table does not represent the case.
    NeedsSolver,
    /// No resultants: the method does not cover the patch, such as the table an ellipse whose ratio of semi-axes is beyond 0.1 to 10.
    NotCovered,
    /// No resultants: the case of the row has faults, such as an absurdly large patch.
    Refused,
    /// No resultants: some number of the table's answer is not finite.
    NotFinite,
    /// No resultants: the iteration ended without meeting its tolerance.
    NotConverged,
    /// No resultants: the contact has no solution that the method could find.
    Unsolvable,
    /// No resultants: the time limit of a row was reached.
    OutOfTime,
    /// No resultants: the solver stopped on an internal error.
    SolverFailed,
}

impl RowStatus {
    /// The row has resultants.
    pub fn has_answer(self) -> bool {
        matches!(self, RowStatus::Ok | RowStatus::TargetMissed)
    }

    /// What a failed solve means for its row; nothing for a solve that was stopped from outside.
    pub(crate) fn of(error: &SolveError) -> Option<RowStatus> {
        Some(match error {
            SolveError::Cancelled => return None,
            SolveError::OutOfTime { .. } => RowStatus::OutOfTime,
            SolveError::NotCovered { .. } => RowStatus::NotCovered,
            SolveError::NotConverged { .. } => RowStatus::NotConverged,
            SolveError::RoughProfile { .. }
            | SolveError::Unmeshable { .. }
            | SolveError::NormalProblem { .. }
            | SolveError::NotFinite { .. } => RowStatus::Unsolvable,
        })
    }
}

/// Names of the columns of numbers that every answer has.
pub const ROW_NAMES: [&str; 6] = [
    "force_x_n",
    "force_y_n",
    "moment_z_n_mm",
    "error_estimate",
    "friction_power_n",
    "stick_share",
];

/// The answers to rows, one number of each column for a row; not a number where a row has none.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RowsAnswer {
    /// The columns with their names: [`ROW_NAMES`], derivatives ([`GRADIENT_NAMES`]) if they were asked for, further ones of rows that need
    /// the solver. The error estimate is the bound of that of either force; that of the moment is this times √(ab).
    pub numbers: Vec<(&'static str, Vec<f64>)>,
    /// What became of the rows.
    pub status: Vec<RowStatus>,
}

/// The numbers of a row, in the order of [`ROW_NAMES`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RowAnswer {
    pub(crate) numbers: [f64; ROW_NAMES.len()],
    pub(crate) gradients: [f64; GRADIENT_NAMES.len()],
    pub(crate) status: RowStatus,
}

impl RowAnswer {
    /// A row without an answer.
    pub(crate) fn without(status: RowStatus) -> RowAnswer {
        RowAnswer {
            numbers: [f64::NAN; ROW_NAMES.len()],
            gradients: [f64::NAN; GRADIENT_NAMES.len()],
            status,
        }
    }
}

impl RowsAnswer {
    /// Room for so many rows.
    pub(crate) fn with_capacity(rows: usize, gradients: bool) -> RowsAnswer {
        let more = GRADIENT_NAMES.into_iter().filter(|_| gradients);
        let names = ROW_NAMES.into_iter().chain(more);
        RowsAnswer {
            numbers: names.map(|name| (name, Vec::with_capacity(rows))).collect(),
            status: Vec::with_capacity(rows),
        }
    }

    /// Adds a row. No other function writes rows; a row with a number that is not finite has no answer.
    pub(crate) fn push(&mut self, row: RowAnswer) {
        let of = |row: RowAnswer| row.numbers.into_iter().chain(row.gradients);
        let is_finite = of(row).take(self.numbers.len()).all(f64::is_finite);
        let row = match row.status.has_answer() && !is_finite {
            true => RowAnswer::without(RowStatus::NotFinite),
            false => row,
        };
        for ((_, column), number) in self.numbers.iter_mut().zip(of(row)) {
            column.push(number);
        }
        self.status.push(row.status);
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        (size_of::<f64>() * self.numbers.len() + 1) * self.status.len()
    }

    /// The columns of numbers with their names, in their order.
    pub fn columns(&self) -> Vec<(&'static str, &[f64])> {
        let columns = self.numbers.iter();
        columns.map(|(name, column)| (*name, &column[..])).collect()
    }

    /// The numbers of a column; none if there is no such column.
    pub fn column(&self, name: &str) -> &[f64] {
        let found = self.numbers.iter().find(|(own, _)| *own == name);
        found.map_or(&[], |(_, numbers)| numbers)
    }

    /// All answers of the solver, with all of its columns.
    pub(crate) fn of_solver(answer: ManyAnswer) -> RowsAnswer {
        let names = answer.columns.names().into_iter();
        let mut numbers: Vec<_> = names.zip(answer.numbers).collect();
        let place = |name: &&'static str| {
            let first = ROW_NAMES.iter().chain(&GRADIENT_NAMES);
            first
                .clone()
                .position(|own| own == name)
                .unwrap_or(usize::MAX)
        };
        numbers.sort_by_key(|(name, _)| place(name));
        RowsAnswer {
            numbers,
            status: answer.status,
        }
    }

    /// Replaces rows by answers of the solver, in the same order.
    pub(crate) fn replace(&mut self, rows: &[usize], solved: &RowsAnswer) {
        for ((_, column), (_, numbers)) in self.numbers.iter_mut().zip(&solved.numbers) {
            for (row, number) in rows.iter().zip(numbers) {
                column[*row] = *number;
            }
        }
        for (row, status) in rows.iter().zip(&solved.status) {
            self.status[*row] = *status;
        }
    }
}

/// Names of the columns of derivatives, in the order of derivatives: forces and moment, each by both creepages and the spin.
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

/// Why a row has no answer: the word that clients read, and the reason in words.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RowFailure {
    pub(crate) status: RowStatus,
    pub(crate) reason: String,
}

impl RowFailure {
    /// The failure of a solve; nothing for a solve that was stopped from outside.
    pub(crate) fn of(error: &SolveError) -> Option<RowFailure> {
        Some(RowFailure {
            status: RowStatus::of(error)?,
            reason: error.to_string(),
        })
    }

    /// The failure of a case with faults.
    pub(crate) fn refused(CaseError(faults): &CaseError) -> RowFailure {
        let first = faults.first();
        let first = first.map(|fault| format!("{}: {}", fault.pointer, fault.detail));
        let more = match faults.len() {
            0 | 1 => String::new(),
            count => format!("; and {} more faults", count - 1),
        };
        RowFailure {
            status: RowStatus::Refused,
            reason: first.unwrap_or_default() + &more,
        }
    }
}

/// Names of the columns of numbers that every answer has, in the order of [`RowNumbers`].
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

/// Columns that may have no number in a row with an answer: estimates of given meshes, shares without zones, iterations of the table.
const NUMBERS_LEFT_OUT: [&str; 4] = [
    "error_estimate",
    "moment_error_estimate",
    "stick_share",
    "iterations",
];

/// Numbers of one row, in the order of [`NUMBER_NAMES`]; NaN where there is none. Sums over the patches, the largest of their pressures;
/// `error_estimate` is that of the less certain of both forces.
pub type RowNumbers = [f64; NUMBER_NAMES.len()];

/// An unknown that is solved for where a row prescribes a force or a torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Names)]
pub enum Found {
    /// Longitudinal creepage.
    CreepageX,
    /// Lateral creepage.
    CreepageY,
    /// Angular velocity of the wheelset in rad/s.
    #[serde(rename = "angular_velocity_rad_per_s")]
    AngularVelocity,
    /// Velocity of the wheelset to the left in mm/s.
    #[serde(rename = "lateral_velocity_mm_per_s")]
    LateralVelocity,
}

impl Found {
    /// The unknowns that a case of one motion leaves to the solver.
    pub fn of(problem: &Problem) -> Vec<Found> {
        let [creep_x, creep_y] = problem.forces.first().copied().unwrap_or_default();
        let [along, across] = problem.wheelset_forces;
        let angular = along.is_some() || problem.drive_torque.is_some();
        [
            (creep_x.is_some(), Found::CreepageX),
            (creep_y.is_some(), Found::CreepageY),
            (angular, Found::AngularVelocity),
            (across.is_some(), Found::LateralVelocity),
        ]
        .into_iter()
        .filter_map(|(sought, found)| sought.then_some(found))
        .collect()
    }

    fn number(self, solution: &Solution) -> Option<f64> {
        let creepages = || {
            let patch = solution.patches.first()?;
            Some(patch.points.first()?.motion)
        };
        match self {
            Found::CreepageX => creepages().map(|motion| motion.creepage_x),
            Found::CreepageY => creepages().map(|motion| motion.creepage_y),
            Found::AngularVelocity => solution.angular_velocity_rad_per_s.or_else(|| {
                let position = solution.wheelset.as_ref()?.positions.first()?;
                Some(position.angular_velocity_rad_per_s)
            }),
            Found::LateralVelocity => solution.lateral_velocity_mm_per_s,
        }
    }
}

/// The columns of numbers of an answer.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct NumberColumns {
    /// The unknowns solved for, one column each.
    pub found: Vec<Found>,
    /// Are there derivatives?
    pub gradients: bool,
}

impl NumberColumns {
    /// The columns that a case of one motion asks for.
    pub fn of(case: &CheckedCase) -> NumberColumns {
        NumberColumns {
            found: Found::of(&case.problem),
            gradients: case.run.wants(Output::Gradients),
        }
    }

    /// The columns that some case asks for.
    pub fn all() -> NumberColumns {
        NumberColumns {
            found: Found::ALL.to_vec(),
            gradients: true,
        }
    }

    /// Their names: those of every answer, what was found, derivatives.
    pub fn names(&self) -> Vec<&'static str> {
        let more: &[&str] = if self.gradients { &GRADIENT_NAMES } else { &[] };
        let found = self.found.iter().map(|found| found.name());
        NUMBER_NAMES
            .into_iter()
            .chain(found)
            .chain(more.iter().copied())
            .collect()
    }
}

/// The reason of a row before it is solved.
const NOT_SOLVED: &str = "the row was not solved; submit its case as a job";

/// The answer to a row.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SolvedRow {
    pub(crate) target_met: bool,
    pub(crate) method: Option<MethodName>,
    /// In the order of [`NumberColumns::names`].
    pub(crate) numbers: Vec<f64>,
}

impl SolvedRow {
    /// The row, or a failure if a number that it must have is not finite. Several patches have no derivatives.
    fn finite(self, columns: &NumberColumns) -> Result<SolvedRow, RowFailure> {
        let names = columns.names();
        let named = names.iter().zip(&self.numbers);
        let left_out = |name: &str, number: f64| {
            number.is_nan() && (NUMBERS_LEFT_OUT.contains(&name) || GRADIENT_NAMES.contains(&name))
        };
        let wrong = named
            .filter(|(name, number)| !number.is_finite() && !left_out(name, **number))
            .map(|(name, _)| (*name).to_owned())
            .next();
        match wrong {
            None => Ok(self),
            Some(quantity) => {
                let error = SolveError::NotFinite { quantity };
                Err(RowFailure {
                    status: RowStatus::Unsolvable,
                    reason: error.to_string(),
                })
            }
        }
    }
}

/// The answers to rows in their order.
#[derive(Debug, Clone, PartialEq)]
pub struct ManyAnswer {
    /// What became of each row.
    pub status: Vec<RowStatus>,
    /// The method that answered it.
    pub method: Vec<Option<MethodName>>,
    /// Why a row has no answer; empty where it has one.
    pub reason: Vec<String>,
    /// Which columns there are.
    pub columns: NumberColumns,
    /// A column for each of their names, a number for each row, NaN where there is none.
    pub numbers: Vec<Vec<f64>>,
}

impl ManyAnswer {
    /// The answer to this number of rows before any of them is solved.
    pub(crate) fn new(rows: usize, columns: NumberColumns) -> ManyAnswer {
        ManyAnswer {
            status: vec![RowStatus::SolverFailed; rows],
            method: vec![None; rows],
            reason: vec![NOT_SOLVED.to_owned(); rows],
            numbers: vec![vec![f64::NAN; rows]; columns.names().len()],
            columns,
        }
    }

    /// Rows without an answer.
    pub fn without_answer(&self) -> usize {
        let mut rows = self.status.iter();
        rows.by_ref().filter(|row| !row.has_answer()).count()
    }

    /// Writes the outcome of a row. No other function writes rows; an answer with a number that is not finite is a failure.
    pub(crate) fn set(&mut self, row: usize, outcome: Result<SolvedRow, RowFailure>) {
        let outcome = outcome.and_then(|solved| solved.finite(&self.columns));
        let (numbers, reason);
        (self.status[row], self.method[row], numbers, reason) = match outcome {
            Ok(SolvedRow {
                target_met,
                method,
                numbers,
            }) => {
                let status = match target_met {
                    true => RowStatus::Ok,
                    false => RowStatus::TargetMissed,
                };
                (status, method, numbers, String::new())
            }
            Err(RowFailure { status, reason }) => (status, None, Vec::new(), reason),
        };
        self.reason[row] = reason;
        let numbers = numbers.into_iter().chain(std::iter::repeat(f64::NAN));
        for (column, number) in self.numbers.iter_mut().zip(numbers) {
            column[row] = number;
        }
    }

    /// Notes the answer to the one motion of a row.
    pub(crate) fn set_solution(&mut self, row: usize, solution: &Solution) {
        let Some(numbers) = numbers_of(solution, &self.columns) else {
            return;
        };
        let points = || points_of(solution);
        let solved = SolvedRow {
            target_met: points().all(|point| point.target_met != Some(false)),
            method: points().next().map(|point| point.solver.method),
            numbers,
        };
        self.set(row, Ok(solved));
    }
}

/// The points of the only motion, patch by patch.
fn points_of(solution: &Solution) -> impl Iterator<Item = &PointSolution> {
    let patches = solution.patches.iter();
    patches.filter_map(|patch| patch.points.first())
}

/// The numbers of the only motion, in the order of the names of the columns.
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
    let found = columns.found.iter();
    let found = found.map(|found| found.number(solution).unwrap_or(f64::NAN));
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
            numbers: [1.0, 2.0, 3.0, 0.1, 0.2, 0.3],
            gradients: [f64::NAN; 9],
            status: RowStatus::Ok,
        };
        let mut answer = RowsAnswer::with_capacity(9, false);
        answer.push(ok);
        for place in 0..6 {
            let mut row = ok;
            row.numbers[place] = [f64::NAN, f64::INFINITY][place % 2];
            answer.push(row);
        }
        assert_eq!(answer.status[0], RowStatus::Ok);
        assert_eq!(answer.status[1..], [RowStatus::NotFinite; 6]);
        for (name, column) in answer.columns() {
            assert!(column[0].is_finite(), "{name}");
            assert!(column[1..].iter().all(|number| number.is_nan()), "{name}");
        }
        let mut answer = RowsAnswer::with_capacity(1, true);
        answer.push(ok);
        assert_eq!(answer.status, [RowStatus::NotFinite], "its derivatives");
    }
}

#[cfg(test)]
mod many_tests {
    use super::*;

    fn solved() -> SolvedRow {
        SolvedRow {
            target_met: true,
            method: Some(MethodName::BoundaryElement),
            numbers: vec![1.0; NUMBER_NAMES.len()],
        }
    }

    #[test]
    fn an_answer_with_a_number_that_is_not_finite_is_a_failure_with_its_reason() {
        for (place, name) in NUMBER_NAMES.iter().enumerate() {
            for number in [f64::NAN, f64::INFINITY] {
                let mut answer = ManyAnswer::new(1, NumberColumns::default());
                let mut row = solved();
                row.numbers[place] = number;
                answer.set(0, Ok(row));
                let kept = NUMBERS_LEFT_OUT.contains(name) && number.is_nan();
                assert_eq!(answer.status[0] == RowStatus::Ok, kept, "{name} {number}");
                if !kept {
                    assert_eq!(answer.status[0], RowStatus::Unsolvable);
                    assert!(answer.reason[0].contains(name), "{:?}", answer.reason);
                    let mut numbers = answer.numbers.iter();
                    assert!(numbers.all(|column| column[0].is_nan()) && answer.method[0].is_none());
                }
            }
        }
    }

    #[test]
    fn a_failure_after_an_answer_leaves_no_number_of_it() {
        let mut answer = ManyAnswer::new(1, NumberColumns::default());
        answer.set(0, Ok(solved()));
        assert!(answer.reason[0].is_empty() && answer.without_answer() == 0);
        let error = SolveError::NotCovered {
            reason: "too slender".to_owned(),
        };
        answer.set(0, Err(RowFailure::of(&error).expect("a failure")));
        assert_eq!(answer.status, [RowStatus::NotCovered]);
        assert_eq!(answer.reason, ["too slender"]);
        assert!(answer.numbers.iter().all(|column| column[0].is_nan()));
    }
}
