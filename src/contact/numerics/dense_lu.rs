//! Dense LU factorisation with row exchanges, which a monitor can stop between blocks of columns.

use std::ops::ControlFlow;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor;
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{
    solve_unit_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::perm::{PermRef, permute_rows_in_place, permute_rows_in_place_scratch};
use faer::{Accum, Mat, MatMut, Par};

use crate::contact::monitor::{Monitor, Stop, Unmonitored};

/// Columns eliminated at once.
const PANEL: usize = 64;
/// Columns updated or solved between two calls of the monitor: at most 0.3 Gflop with 2000 unknowns.
const CHUNK: usize = 64;

/// A factored matrix, `P A = L U`.
#[derive(Debug)]
pub struct DenseLu {
    factors: Mat<f64>,
    order: Vec<usize>,
    order_inverse: Vec<usize>,
}

impl DenseLu {
    /// Factors a square matrix. With a singular matrix, solutions are not finite.
    ///
    /// # Errors
    /// Only if the monitor stops the work; it is called once per panel and per chunk of columns.
    pub fn new(mut matrix: Mat<f64>, monitor: &dyn Monitor) -> Result<DenseLu, Stop> {
        let n = matrix.nrows();
        let mut order: Vec<usize> = (0..n).collect();
        let (mut forward, mut backward) = (vec![0; n], vec![0; n]);
        let request = factor::lu_in_place_scratch::<usize, f64>(
            n,
            PANEL.min(n),
            Par::Seq,
            Default::default(),
        )
        .or(permute_rows_in_place_scratch::<usize, f64>(n, n));
        let mut buffer = MemBuffer::new(request);
        for start in (0..n).step_by(PANEL) {
            check(monitor)?;
            let rest = n - start;
            let width = PANEL.min(rest);
            let (done, _, mut left, active) = matrix.as_mut().split_at_mut(start, start);
            debug_assert_eq!(done.ncols(), left.ncols());
            let (mut panel, mut right) = active.split_at_col_mut(width);
            let (_, exchange) = factor::lu_in_place(
                panel.as_mut(),
                &mut forward[..rest],
                &mut backward[..rest],
                Par::Seq,
                MemStack::new(&mut buffer),
                Default::default(),
            );
            for side in [left.as_mut(), right.as_mut()] {
                permute_rows_in_place(side, exchange, MemStack::new(&mut buffer));
            }
            let before = order[start..].to_vec();
            for (to, from) in order[start..].iter_mut().zip(exchange.arrays().0) {
                *to = before[*from];
            }
            let columns = right.ncols();
            for first in (0..columns).step_by(CHUNK) {
                check(monitor)?;
                let chunk = right
                    .as_mut()
                    .subcols_mut(first, CHUNK.min(columns - first));
                let (mut top, bottom) = chunk.split_at_row_mut(width);
                let (diagonal, below) = panel.as_ref().split_at_row(width);
                solve_unit_lower_triangular_in_place(diagonal, top.as_mut(), Par::Seq);
                matmul(bottom, Accum::Add, below, top.as_ref(), -1.0, Par::Seq);
            }
        }
        let mut order_inverse = vec![0; n];
        for (i, k) in order.iter().enumerate() {
            order_inverse[*k] = i;
        }
        Ok(DenseLu {
            factors: matrix,
            order,
            order_inverse,
        })
    }

    /// `X ← A⁻¹ X`.
    ///
    /// # Errors
    /// Only if the monitor stops the work; it is called once per chunk of columns.
    pub fn solve(&self, mut rhs: MatMut<'_, f64>, monitor: &dyn Monitor) -> Result<(), Stop> {
        let (n, columns) = (self.factors.nrows(), rhs.ncols());
        let exchange = PermRef::new_checked(&self.order, &self.order_inverse, n);
        let request = permute_rows_in_place_scratch::<usize, f64>(n, CHUNK.min(columns));
        let mut buffer = MemBuffer::new(request);
        for first in (0..columns).step_by(CHUNK) {
            check(monitor)?;
            let mut chunk = rhs.as_mut().subcols_mut(first, CHUNK.min(columns - first));
            permute_rows_in_place(chunk.as_mut(), exchange, MemStack::new(&mut buffer));
            solve_unit_lower_triangular_in_place(self.factors.as_ref(), chunk.as_mut(), Par::Seq);
            check(monitor)?;
            solve_upper_triangular_in_place(self.factors.as_ref(), chunk, Par::Seq);
        }
        Ok(())
    }
}

/// `C ← C − A B`; the monitor is called once per chunk of columns.
///
/// # Errors
/// Only if the monitor stops the work.
pub fn subtract_product(
    mut c: MatMut<'_, f64>,
    a: faer::MatRef<'_, f64>,
    b: faer::MatRef<'_, f64>,
    monitor: &dyn Monitor,
) -> Result<(), Stop> {
    let columns = c.ncols();
    for first in (0..columns).step_by(CHUNK) {
        check(monitor)?;
        let count = CHUNK.min(columns - first);
        matmul(
            c.as_mut().subcols_mut(first, count),
            Accum::Add,
            a,
            b.subcols(first, count),
            -1.0,
            Par::Seq,
        );
    }
    Ok(())
}

/// The inverse of a small square matrix, both row by row; of a singular one it is not finite.
pub(crate) fn inverse(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = rows.len();
    let mut unit = Mat::<f64>::identity(n, n);
    let lu = DenseLu::new(Mat::from_fn(n, n, |i, j| rows[i][j]), &Unmonitored);
    let solved = lu.and_then(|lu| lu.solve(unit.as_mut(), &Unmonitored));
    debug_assert!(solved.is_ok(), "nobody stops it");
    (0..n)
        .map(|i| (0..n).map(|j| unit[(i, j)]).collect())
        .collect()
}

/// Calls the monitor.
///
/// # Errors
/// The reason to stop, if the monitor gives one.
pub fn check(monitor: &dyn Monitor) -> Result<(), Stop> {
    match monitor.tick(0.0) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(stop) => Err(stop),
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::time::Duration;

    use super::*;
    fn wavy(n: usize) -> Mat<f64> {
        // No large diagonal: rows must be exchanged, also across panels.
        Mat::from_fn(n, n, |i, j| ((7 * i * i + 13 * j + i * j) as f64).sin())
    }

    #[test]
    fn a_solve_gives_back_the_unknowns_whatever_the_number_of_panels() {
        for n in [0, 1, 5, PANEL, PANEL + 1, 3 * PANEL + 7, CHUNK + PANEL + 30] {
            let a = wavy(n);
            let x = Mat::from_fn(n, 3, |i, j| (i as f64 + 0.3 * j as f64).cos());
            let mut b = &a * &x;
            let lu = DenseLu::new(a, &Unmonitored).unwrap();
            lu.solve(b.as_mut(), &Unmonitored).unwrap();
            let error = (&b - &x).norm_max();
            assert!(error < 1e-8, "{n}: {error}");
        }
    }

    #[test]
    fn a_matrix_times_its_inverse_is_one() {
        let n = 25;
        let a = wavy(n);
        let rows: Vec<Vec<f64>> = (0..n)
            .map(|i| (0..n).map(|j| a[(i, j)]).collect())
            .collect();
        let found = inverse(&rows);
        let product = &a * Mat::from_fn(n, n, |i, j| found[i][j]);
        let error = (product - Mat::<f64>::identity(n, n)).norm_max();
        assert!(error < 1e-9, "{error}");
    }

    #[test]
    fn a_product_is_subtracted_chunk_by_chunk() {
        let (a, b) = (
            wavy(40),
            Mat::from_fn(40, 2 * CHUNK + 3, |i, j| (i * j) as f64),
        );
        let mut c = &a * &b;
        subtract_product(c.as_mut(), a.as_ref(), b.as_ref(), &Unmonitored).unwrap();
        assert!(c.norm_max() < 1e-7, "{}", c.norm_max());
    }

    #[test]
    fn the_monitor_can_stop_a_factorisation_in_the_middle() {
        struct After(Cell<u32>);
        impl Monitor for After {
            fn tick(&self, _progress: f64) -> ControlFlow<Stop> {
                self.0.set(self.0.get().saturating_sub(1));
                if self.0.get() == 0 {
                    ControlFlow::Break(Stop::Cancelled)
                } else {
                    ControlFlow::Continue(())
                }
            }
            fn elapsed(&self) -> Duration {
                Duration::ZERO
            }
        }
        let stopped = DenseLu::new(wavy(3 * PANEL), &After(Cell::new(3)));
        assert_eq!(stopped.unwrap_err(), Stop::Cancelled);
    }
}
