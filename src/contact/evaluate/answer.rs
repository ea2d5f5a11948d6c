//! What rows are answered with: columns of numbers, and a word for each row.

use std::collections::BTreeMap;

use crate::contact::evaluate::many_answer::{GRADIENT_NAMES, ManyAnswer, ManyStatus};

/// What became of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowStatus {
    /// The resultants meet the target, or there is none.
    Ok,
    /// The resultants are there; the bound of their error is above the target.
    TargetMissed,
    /// No resultants: `auto` would solve the row on a mesh. The bound of the table is above the target, or the table does not represent the case.
    NeedsSolver,
    /// No resultants: the table does not cover the ellipse, whose ratio of semi-axes is beyond 0.1 to 10.
    NotCovered,
    /// No resultants: the case of the row has faults, such as an absurdly large patch.
    Refused,
    /// No resultants: some number of the answer is not finite.
    NotFinite,
    /// No resultants: the solver failed.
    Failed(ManyStatus),
}

impl RowStatus {
    fn of_solver(status: ManyStatus) -> RowStatus {
        match status {
            ManyStatus::Ok => RowStatus::Ok,
            ManyStatus::TargetMissed => RowStatus::TargetMissed,
            ManyStatus::Refused => RowStatus::Refused,
            ManyStatus::NotCovered => RowStatus::NotCovered,
            failed => RowStatus::Failed(failed),
        }
    }

    /// The word that clients read.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            RowStatus::Ok => "ok",
            RowStatus::TargetMissed => "target_missed",
            RowStatus::NeedsSolver => "needs_solver",
            RowStatus::NotCovered => "not_covered",
            RowStatus::Refused => "refused",
            RowStatus::NotFinite => "not_finite",
            RowStatus::Failed(status) => status.name(),
        }
    }

    /// The row has resultants.
    #[must_use]
    pub fn has_answer(self) -> bool {
        matches!(self, RowStatus::Ok | RowStatus::TargetMissed)
    }
}

/// The answers to rows, one number of each column for a row; not a number where a row has none.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RowsAnswer {
    /// Longitudinal force on the lower body in N.
    pub force_x_n: Vec<f64>,
    /// Lateral force in N.
    pub force_y_n: Vec<f64>,
    /// Moment about the centre of the ellipse in N·mm.
    pub moment_z_n_mm: Vec<f64>,
    /// Bound of the error of either force in N; that of the moment is this times √(ab).
    pub error_estimate: Vec<f64>,
    /// ν_x F_x + ν_y F_y + φ M_z in N.
    pub friction_power_n: Vec<f64>,
    /// Share of the patch that sticks.
    pub stick_share: Vec<f64>,
    /// Derivatives, if they were asked for, named by [`GRADIENT_NAMES`].
    pub gradients: Option<[Vec<f64>; 9]>,
    /// Further columns of rows that need the solver, with their names.
    pub more: Vec<(&'static str, Vec<f64>)>,
    /// What became of the rows.
    pub status: Vec<RowStatus>,
}

/// The numbers of a row, in the order of [`RowsAnswer::columns`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RowAnswer {
    pub(crate) numbers: [f64; 6],
    pub(crate) gradients: [f64; 9],
    pub(crate) status: RowStatus,
}

impl RowAnswer {
    /// A row without an answer.
    pub(crate) fn without(status: RowStatus) -> RowAnswer {
        RowAnswer {
            numbers: [f64::NAN; 6],
            gradients: [f64::NAN; 9],
            status,
        }
    }

    /// The row, without its answer if a number is not finite.
    fn finite(self, with_gradients: bool) -> RowAnswer {
        let gradients = self.gradients.iter().filter(|_| with_gradients);
        let mut answered = self.numbers.iter().chain(gradients);
        match self.status.has_answer() && !answered.all(|number| number.is_finite()) {
            true => RowAnswer::without(RowStatus::NotFinite),
            false => self,
        }
    }
}

impl RowsAnswer {
    /// Room for so many rows.
    pub(crate) fn with_capacity(rows: usize, gradients: bool) -> RowsAnswer {
        let column = || Vec::with_capacity(rows);
        RowsAnswer {
            force_x_n: column(),
            force_y_n: column(),
            moment_z_n_mm: column(),
            error_estimate: column(),
            friction_power_n: column(),
            stick_share: column(),
            gradients: gradients.then(|| std::array::from_fn(|_| column())),
            more: Vec::new(),
            status: Vec::with_capacity(rows),
        }
    }

    /// Adds a row. No other function writes rows, so all numbers of a row with an answer are finite.
    pub(crate) fn push(&mut self, row: RowAnswer) {
        let row = row.finite(self.gradients.is_some());
        let columns = [
            &mut self.force_x_n,
            &mut self.force_y_n,
            &mut self.moment_z_n_mm,
            &mut self.error_estimate,
            &mut self.friction_power_n,
            &mut self.stick_share,
        ];
        let gradients = self.gradients.iter_mut().flatten().zip(row.gradients);
        for (column, number) in columns.into_iter().zip(row.numbers).chain(gradients) {
            column.push(number);
        }
        self.status.push(row.status);
    }

    /// Bytes that it takes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let numbers: usize = self.columns().iter().map(|(_, column)| column.len()).sum();
        size_of::<f64>() * numbers + self.status.len()
    }

    /// The columns of numbers with their names, in their order.
    #[must_use]
    pub fn columns(&self) -> Vec<(&'static str, &[f64])> {
        let mut columns: Vec<(&'static str, &[f64])> = vec![
            ("force_x_n", &self.force_x_n),
            ("force_y_n", &self.force_y_n),
            ("moment_z_n_mm", &self.moment_z_n_mm),
            ("error_estimate", &self.error_estimate),
            ("friction_power_n", &self.friction_power_n),
            ("stick_share", &self.stick_share),
        ];
        if let Some(gradients) = &self.gradients {
            let named = GRADIENT_NAMES.iter().zip(gradients);
            columns.extend(named.map(|(name, column)| (*name, &column[..])));
        }
        let more = self.more.iter();
        columns.extend(more.map(|(name, column)| (*name, &column[..])));
        columns
    }

    /// All answers of the solver, with all of its columns.
    pub(crate) fn of_solver(answer: ManyAnswer) -> RowsAnswer {
        let rows = answer.status.len();
        let mut columns: BTreeMap<_, _> = answer
            .columns
            .names()
            .into_iter()
            .zip(answer.numbers)
            .collect();
        let mut take = |name| {
            let column = columns.remove(name);
            column.unwrap_or_else(|| vec![f64::NAN; rows])
        };
        let gradients = answer.columns.gradients;
        let solved = RowsAnswer {
            force_x_n: take("force_x_n"),
            force_y_n: take("force_y_n"),
            moment_z_n_mm: take("moment_z_n_mm"),
            error_estimate: take("error_estimate"),
            friction_power_n: take("friction_power_n"),
            stick_share: take("stick_share"),
            gradients: gradients.then(|| GRADIENT_NAMES.map(&mut take)),
            more: Vec::new(),
            status: answer
                .status
                .into_iter()
                .map(RowStatus::of_solver)
                .collect(),
        };
        let names = answer.columns.names().into_iter();
        RowsAnswer {
            more: names
                .filter_map(|name| Some((name, columns.remove(name)?)))
                .collect(),
            ..solved
        }
    }

    /// Replaces rows by answers of the solver, in the same order.
    pub(crate) fn replace(&mut self, rows: &[usize], solved: &RowsAnswer) {
        let columns = [
            (&mut self.force_x_n, &solved.force_x_n),
            (&mut self.force_y_n, &solved.force_y_n),
            (&mut self.moment_z_n_mm, &solved.moment_z_n_mm),
            (&mut self.error_estimate, &solved.error_estimate),
            (&mut self.friction_power_n, &solved.friction_power_n),
            (&mut self.stick_share, &solved.stick_share),
        ];
        let gradients = self.gradients.iter_mut().flatten();
        let gradients = gradients.zip(solved.gradients.iter().flatten());
        for (column, numbers) in columns.into_iter().chain(gradients) {
            for (row, number) in rows.iter().zip(numbers) {
                column[*row] = *number;
            }
        }
        for (row, status) in rows.iter().zip(&solved.status) {
            self.status[*row] = *status;
        }
    }
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
