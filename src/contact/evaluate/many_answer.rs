//! What many rows are answered with: columns of numbers, a word for each row, and the method that answered it.

use crate::contact::case::words::solver::{MethodName, Output};
use crate::contact::error::SolveError;
use crate::contact::evaluate::answer::GRADIENT_NAMES;
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::problem::physics::Problem;
use crate::contact::solution::words::answer::{PatchSolution, PointSolution, Solution};

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

/// What is found for a force or a torque that a row prescribes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Found {
    /// Longitudinal creepage.
    CreepageX,
    /// Lateral creepage.
    CreepageY,
    /// Angular velocity of the wheelset in rad/s.
    AngularVelocity,
    /// Velocity of the wheelset to the left in mm/s.
    LateralVelocity,
}

impl Found {
    /// What is found for a question of one motion.
    #[must_use]
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

    fn name(self) -> &'static str {
        match self {
            Found::CreepageX => "creepage_x",
            Found::CreepageY => "creepage_y",
            Found::AngularVelocity => "angular_velocity_rad_per_s",
            Found::LateralVelocity => "lateral_velocity_mm_per_s",
        }
    }

    fn number(self, solution: &Solution, motion: usize) -> Option<f64> {
        let creepages = || {
            let patch = solution.patches.first()?;
            Some(patch.points.get(motion)?.motion)
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
    /// What is found for prescribed forces.
    pub found: Vec<Found>,
    /// Are there derivatives?
    pub gradients: bool,
}

impl NumberColumns {
    /// The columns that a case of one motion asks for.
    #[must_use]
    pub fn of(case: &CheckedCase) -> NumberColumns {
        NumberColumns {
            found: Found::of(&case.problem),
            gradients: case.run.wants(Output::Gradients),
        }
    }

    /// The columns that some case asks for.
    #[must_use]
    pub fn all() -> NumberColumns {
        let found = vec![
            Found::CreepageX,
            Found::CreepageY,
            Found::AngularVelocity,
            Found::LateralVelocity,
        ];
        NumberColumns {
            found,
            gradients: true,
        }
    }

    /// Their names: those of every answer, what was found, derivatives.
    #[must_use]
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

/// The answers to rows in their order.
#[derive(Debug, Clone, PartialEq)]
pub struct ManyAnswer {
    /// What became of each row.
    pub status: Vec<ManyStatus>,
    /// The method that answered it.
    pub method: Vec<Option<MethodName>>,
    /// Which columns there are.
    pub columns: NumberColumns,
    /// A column for each of their names, a number for each row, NaN where there is none.
    pub numbers: Vec<Vec<f64>>,
}

impl ManyAnswer {
    /// Answers to so many rows, none of which is there yet.
    pub(crate) fn new(rows: usize, columns: NumberColumns) -> ManyAnswer {
        ManyAnswer {
            status: vec![ManyStatus::SolverFailed; rows],
            method: vec![None; rows],
            numbers: vec![vec![f64::NAN; rows]; columns.names().len()],
            columns,
        }
    }

    /// Rows without an answer.
    #[must_use]
    pub fn without_answer(&self) -> usize {
        let mut rows = self.status.iter();
        rows.by_ref().filter(|row| !row.has_answer()).count()
    }

    /// Notes the numbers of a row that prescribes no force, as far as it has any.
    pub(crate) fn set(&mut self, row: usize, numbers: impl IntoIterator<Item = f64>) {
        for (column, number) in self.numbers.iter_mut().zip(numbers) {
            column[row] = number;
        }
    }

    /// Notes the answer to one motion of a solution, with its numbers as `of_row` makes them those of the row.
    pub(crate) fn set_solution(
        &mut self,
        row: usize,
        (solution, motion): (&Solution, usize),
        of_row: impl FnOnce(&NumberColumns, &mut [f64]),
    ) {
        let Some(mut numbers) = numbers_of(solution, motion, &self.columns) else {
            return;
        };
        of_row(&self.columns, &mut numbers);
        let points = || points_of(solution, motion);
        let missed = points().any(|point| point.target_met == Some(false));
        self.status[row] = match missed {
            true => ManyStatus::TargetMissed,
            false => ManyStatus::Ok,
        };
        self.method[row] = points().next().map(|point| point.solver.method);
        self.set(row, numbers);
    }
}

/// The points of a motion, patch by patch.
fn points_of(solution: &Solution, motion: usize) -> impl Iterator<Item = &PointSolution> {
    let patches = solution.patches.iter();
    patches.filter_map(move |patch| patch.points.get(motion))
}

/// The numbers of a motion, in the order of the names of the columns.
fn numbers_of(solution: &Solution, motion: usize, columns: &NumberColumns) -> Option<Vec<f64>> {
    let total = solution.total.get(motion)?;
    let points = || points_of(solution, motion);
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
    let found = columns.found.iter();
    let found = found.map(|found| found.number(solution, motion).unwrap_or(f64::NAN));
    let only = points().next().filter(|_| solution.patches.len() == 1);
    let slopes = only.and_then(|point| point.gradients);
    let slopes = slopes.map_or([[f64::NAN; 3]; 3], |slopes| {
        [slopes.force_x_n, slopes.force_y_n, slopes.moment_z_n_mm]
    });
    let slopes = slopes.into_iter().flatten().filter(|_| columns.gradients);
    Some(numbers.into_iter().chain(found).chain(slopes).collect())
}
