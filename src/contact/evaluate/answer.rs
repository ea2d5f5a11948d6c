//! What rows are answered with: columns of numbers, and a word for each row.

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
    #[must_use]
    pub fn bytes(&self) -> usize {
        (size_of::<f64>() * self.numbers.len() + 1) * self.status.len()
    }

    /// The columns of numbers with their names, in their order.
    #[must_use]
    pub fn columns(&self) -> Vec<(&'static str, &[f64])> {
        let columns = self.numbers.iter();
        columns.map(|(name, column)| (*name, &column[..])).collect()
    }

    /// The numbers of a column; none if there is no such column.
    #[must_use]
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
        let status = answer.status.into_iter().map(RowStatus::of_solver);
        RowsAnswer {
            numbers,
            status: status.collect(),
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
