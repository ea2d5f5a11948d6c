//! What many rows are answered with: columns of numbers, a word for each row, and the method that answered it.

use crate::contact::case::words::solver::MethodName;
use crate::contact::error::SolveError;
use crate::contact::evaluate::answer::GRADIENT_NAMES;
use crate::contact::solution::words::answer::{PatchSolution, Solution};

/// What became of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ManyStatus {
    /// The resultants meet the target, or there is none.
    Ok,
    /// The resultants are there; their estimated error is above the target.
    TargetMissed,
    /// The case of the row has faults.
    Refused,
    /// The method does not cover the patch.
    NotCovered,
    /// The iteration ended without meeting its tolerance.
    NotConverged,
    /// The contact has no solution that the method could find.
    Unsolvable,
    /// The time limit of a row was reached.
    OutOfTime,
    /// The solver stopped on a defect of its own.
    SolverFailed,
}

impl ManyStatus {
    /// The word that clients read.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            ManyStatus::Ok => "ok",
            ManyStatus::TargetMissed => "target_missed",
            ManyStatus::Refused => "refused",
            ManyStatus::NotCovered => "not_covered",
            ManyStatus::NotConverged => "not_converged",
            ManyStatus::Unsolvable => "unsolvable",
            ManyStatus::OutOfTime => "out_of_time",
            ManyStatus::SolverFailed => "solver_failed",
        }
    }

    /// The row has resultants.
    #[must_use]
    pub fn has_answer(self) -> bool {
        matches!(self, ManyStatus::Ok | ManyStatus::TargetMissed)
    }

    /// What a failed solve means for its row; nothing for a solve that was stopped from outside.
    pub(crate) fn of(error: &SolveError) -> Option<ManyStatus> {
        Some(match error {
            SolveError::Cancelled => return None,
            SolveError::OutOfTime { .. } => ManyStatus::OutOfTime,
            SolveError::NotCovered { .. } => ManyStatus::NotCovered,
            SolveError::NotConverged { .. } => ManyStatus::NotConverged,
            SolveError::RoughProfile { .. }
            | SolveError::Unmeshable { .. }
            | SolveError::NormalProblem { .. }
            | SolveError::NotFinite { .. } => ManyStatus::Unsolvable,
        })
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

/// Numbers of one row, in the order of [`NUMBER_NAMES`]; NaN where there is none. Sums over the patches, the largest of their pressures;
/// `error_estimate` is that of the less certain of both forces.
pub type RowNumbers = [f64; NUMBER_NAMES.len()];

/// Names of all columns of numbers of an answer with or without derivatives.
#[must_use]
pub fn number_names(gradients: bool) -> Vec<&'static str> {
    let more: &[&str] = if gradients { &GRADIENT_NAMES } else { &[] };
    NUMBER_NAMES.iter().chain(more).copied().collect()
}

/// The answers to rows in their order.
#[derive(Debug, Clone, PartialEq)]
pub struct ManyAnswer {
    /// What became of each row.
    pub status: Vec<ManyStatus>,
    /// The method that answered it.
    pub method: Vec<Option<MethodName>>,
    /// A column for each of [`number_names`], a number for each row, NaN where there is none.
    pub numbers: Vec<Vec<f64>>,
}

impl ManyAnswer {
    /// Answers to so many rows, none of which is there yet.
    pub(crate) fn new(rows: usize, gradients: bool) -> ManyAnswer {
        ManyAnswer {
            status: vec![ManyStatus::SolverFailed; rows],
            method: vec![None; rows],
            numbers: vec![vec![f64::NAN; rows]; number_names(gradients).len()],
        }
    }

    /// Rows without an answer.
    #[must_use]
    pub fn without_answer(&self) -> usize {
        let mut rows = self.status.iter();
        rows.by_ref().filter(|row| !row.has_answer()).count()
    }

    /// Notes the numbers of a row, as far as it has any.
    pub(crate) fn set(&mut self, row: usize, numbers: impl IntoIterator<Item = f64>) {
        for (column, number) in self.numbers.iter_mut().zip(numbers) {
            column[row] = number;
        }
    }

    /// Notes the solution of a row with one motion.
    pub(crate) fn set_solution(&mut self, row: usize, solution: &Solution) {
        let Some(total) = solution.total.first() else {
            return;
        };
        let points = || {
            solution
                .patches
                .iter()
                .filter_map(|patch| patch.points.first())
        };
        let sum = |of: fn(&PatchSolution) -> f64| solution.patches.iter().map(of).sum::<f64>();
        let area = sum(|patch| patch.area_mm2);
        let stick: Option<f64> = points().map(|point| point.stick_area_mm2).sum();
        let error = total.error_estimate;
        let pressures = solution.patches.iter().map(|patch| patch.pressure_max_mpa);
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
            f64::from(iterations),
        ];
        let missed = points().any(|point| point.target_met == Some(false));
        self.status[row] = match missed {
            true => ManyStatus::TargetMissed,
            false => ManyStatus::Ok,
        };
        self.method[row] = points().next().map(|point| point.solver.method);
        let only = points().next().filter(|_| solution.patches.len() == 1);
        let slopes = only.and_then(|point| point.gradients);
        let slopes = slopes.into_iter().flat_map(|slopes| {
            [slopes.force_x_n, slopes.force_y_n, slopes.moment_z_n_mm]
                .into_iter()
                .flatten()
        });
        self.set(row, numbers.into_iter().chain(slopes));
    }
}
