//! The friction law linearised at an iterate, cell by cell.

use std::ops::Range;

use crate::contact::rolling::methods::boundary_element::falling_rows::FallingRow;

/// The state of one Newton step: which cells slip, and in which direction.
#[derive(Debug, Default)]
pub struct Linearisation {
    /// `(1, 0)` where a cell sticks, the unit tangent where it slips.
    pub(crate) direction: Vec<(f64, f64)>,
    /// D where a cell slips, −1 where it sticks.
    pub(crate) stiffness: Vec<f64>,
    /// Cells that slip under a bound that falls with the slip, in order. They have two unknowns, like those that stick.
    pub(crate) falling: Vec<FallingRow>,
}

impl Linearisation {
    /// Begins another linearisation.
    pub(crate) fn clear(&mut self) {
        self.direction.clear();
        self.stiffness.clear();
        self.falling.clear();
    }

    /// The next cell has two unknowns.
    pub(crate) fn two_unknowns(&mut self) {
        self.direction.push((1.0, 0.0));
        self.stiffness.push(-1.0);
    }

    /// The rows among these cells whose bound falls with the slip.
    pub(crate) fn falling_in(&self, cells: Range<usize>) -> &[FallingRow] {
        let place = |cell| self.falling.partition_point(|row| row.cell < cell);
        &self.falling[place(cells.start)..place(cells.end)]
    }

    /// Does the cell slip with one unknown?
    #[must_use]
    pub fn slips(&self, cell: usize) -> bool {
        self.stiffness[cell] >= 0.0
    }

    /// Direction of the cell's first unknown.
    #[must_use]
    pub fn direction(&self, cell: usize) -> (f64, f64) {
        self.direction[cell]
    }

    /// D of a slipping cell, 0 of a sticking one.
    #[must_use]
    pub fn stiffness(&self, cell: usize) -> f64 {
        self.stiffness[cell].max(0.0)
    }

    /// Do these cells of a segment have nearly the same rows in another one: the same zones, and tangents and diagonals no farther apart than
    /// `change_max`? `xx` and `yy` are the segment's own blocks.
    pub(crate) fn is_like(
        &self,
        other: &Linearisation,
        cells: Range<usize>,
        (xx, yy): (&[f64], &[f64]),
        change_max: f64,
    ) -> bool {
        let n = cells.len();
        cells.enumerate().all(|(k, i)| {
            if self.slips(i) != other.slips(i) {
                return false;
            }
            let ((ax, ay), (bx, by)) = (self.direction(i), other.direction(i));
            let diagonal = xx[k * n + k].abs().max(yy[k * n + k].abs()) + self.stiffness(i);
            let stiffer = (other.stiffness(i) - self.stiffness(i)).abs();
            (ax * by - ay * bx).abs() <= change_max && stiffer <= change_max * diagonal
        })
    }

    /// Becomes another one, whose bounds do not fall.
    pub(crate) fn copy(&mut self, other: &Linearisation) {
        self.clear();
        self.direction.extend_from_slice(&other.direction);
        self.stiffness.extend_from_slice(&other.stiffness);
    }

    /// Takes over these cells of another one.
    pub(crate) fn take_over(&mut self, other: &Linearisation, cells: Range<usize>) {
        self.direction[cells.clone()].copy_from_slice(&other.direction[cells.clone()]);
        self.stiffness[cells.clone()].copy_from_slice(&other.stiffness[cells]);
    }
}
