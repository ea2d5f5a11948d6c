//! Dense LU factorisation with row exchanges, which a monitor can stop between blocks of columns.
//!
//! LU factorisation of small dense matrices in place, with row exchanges.
//!
//! Column by column, each elimination one update of contiguous values: no blocks, no recursion, no buffers. For larger matrices faer,
//! which eliminates many columns at once, is faster.
//!
//! Least-squares fits of a few functions, by their normal equations on the stack.

use std::ops::ControlFlow;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor;
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{
    solve_unit_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::perm::{PermRef, permute_rows_in_place, permute_rows_in_place_scratch};
use faer::{Accum, Mat, MatMut, Par};
use pulp::NullaryFnOnce;

use crate::contact::monitor::{Monitor, Stop, Unmonitored};
use crate::contact::numerics::simd;

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

/// Largest number of unknowns that this factorisation is for. Timed beside faer's on matrices of 4 to 192 unknowns in a release build with
/// AVX-512: it takes 0.33 of the time with 4, 0.5 with 16, 0.7 with 24, 0.9 with 32 and 1.2 with 48.
pub(crate) const SMALL: usize = 32;

/// Factors a square matrix, stored column by column, into `P A = L U`: below the diagonal is L, whose own diagonal is 1, and U elsewhere.
/// `order[i]` becomes the row of A that is row i of `P A`; its length is that of the sides. Factors of a singular matrix are not finite.
pub(crate) fn factor_small(matrix: &mut [f64], order: &mut [usize]) {
    debug_assert_eq!(matrix.len(), order.len() * order.len());
    // The loops inside are compiled for the instruction set of this machine.
    simd::dispatch(Factorisation { matrix, order });
}

struct Factorisation<'a> {
    matrix: &'a mut [f64],
    order: &'a mut [usize],
}

impl NullaryFnOnce for Factorisation<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Factorisation { matrix, order } = self;
        let n = order.len();
        for (i, row) in order.iter_mut().enumerate() {
            *row = i;
        }
        for k in 0..n {
            let pivot = k + largest(&matrix[k * n + k..(k + 1) * n]);
            if pivot != k {
                order.swap(k, pivot);
                for column in matrix.chunks_exact_mut(n) {
                    column.swap(k, pivot);
                }
            }
            let (left, right) = matrix.split_at_mut((k + 1) * n);
            let (diagonal, below) = left[k * n + k..].split_at_mut(1);
            let inverse = 1.0 / diagonal[0];
            for value in &mut *below {
                *value *= inverse;
            }
            for column in right.chunks_exact_mut(n) {
                let (head, tail) = column[k..].split_at_mut(1);
                for (value, factor) in tail.iter_mut().zip(&*below) {
                    *value -= head[0] * factor;
                }
            }
        }
    }
}

/// Place of the largest magnitude, the first of several.
#[inline(always)]
fn largest(values: &[f64]) -> usize {
    let (mut place, mut most) = (0, 0.0);
    for (k, value) in values.iter().enumerate() {
        if value.abs() > most {
            (place, most) = (k, value.abs());
        }
    }
    place
}

/// Pivots below this are rounding: the functions are linearly dependent. Keeps the numbers safe; not tuned.
const DEPENDENT: f64 = 1e-12;

/// First of the `N` coefficients of the sum of functions that is nearest to the samples, each of which is the functions' values at a place and
/// the value there; none if the functions, which are of order 1, are linearly dependent on these places.
pub(crate) fn first_coefficient<const N: usize>(samples: &[([f64; N], f64)]) -> Option<f64> {
    let mut normal = [[0.0; N]; N];
    let mut right = [0.0; N];
    for (functions, value) in samples {
        for i in 0..N {
            right[i] += functions[i] * value;
            for j in 0..N {
                normal[i][j] += functions[i] * functions[j];
            }
        }
    }
    // Eliminated from the last coefficient to the first, because only the first is needed.
    for k in (1..N).rev() {
        let (pivot, own) = (normal[k], right[k]);
        if pivot[k].abs() < DEPENDENT {
            return None;
        }
        for i in 0..k {
            let factor = normal[i][k] / pivot[k];
            right[i] -= factor * own;
            for j in 0..=k {
                normal[i][j] -= factor * pivot[j];
            }
        }
    }
    let value = right[0] / normal[0][0];
    (normal[0][0].abs() >= DEPENDENT && value.is_finite()).then_some(value)
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

#[cfg(test)]
mod small_lu_tests {
    use super::*;

    #[test]
    fn the_factors_multiply_to_the_matrix_with_its_rows_exchanged() {
        for n in [1, 2, 5, 17, SMALL] {
            // No large diagonal: rows must be exchanged.
            let entry = |i: usize, j: usize| ((7 * i * i + 13 * j + i * j) as f64).sin();
            let mut matrix: Vec<f64> = (0..n * n).map(|k| entry(k % n, k / n)).collect();
            let mut order = vec![0; n];
            factor_small(&mut matrix, &mut order);
            let lower = |i: usize, k: usize| if i == k { 1.0 } else { matrix[k * n + i] };
            for (i, row) in order.iter().enumerate() {
                for j in 0..n {
                    let product: f64 = (0..=i.min(j))
                        .map(|k| lower(i, k) * matrix[j * n + k])
                        .sum();
                    let known = entry(*row, j);
                    assert!((product - known).abs() < 1e-12, "{n}: {i}, {j}");
                }
                assert!((0..i).all(|k| lower(i, k).abs() <= 1.0), "{n}: {i}");
            }
        }
    }

    #[test]
    fn a_zero_on_the_diagonal_is_no_obstacle() {
        let mut matrix = [0.0, 2.0, 4.0, 1.0];
        let mut order = [0; 2];
        factor_small(&mut matrix, &mut order);
        assert_eq!((matrix, order), ([2.0, 0.0, 1.0, 4.0], [1, 0]));
    }
}

#[cfg(test)]
mod least_squares_tests {
    use super::*;

    #[test]
    fn the_coefficient_of_a_sum_is_found_and_dependent_functions_have_none() {
        let sample = |x: f64| ([1.0, x, x * x], 3.0 - x + 0.5 * x * x);
        let samples = [-2.0, -1.0, 0.5, 1.0, 2.5].map(sample);
        let found = first_coefficient(&samples).unwrap();
        assert!((found - 3.0).abs() < 1e-12, "{found}");
        assert_eq!(first_coefficient(&samples[..2]), None);
    }

    #[test]
    fn errors_without_correlation_to_the_functions_drop_out() {
        let samples = [(-1.0, 0.1), (0.0, -0.2), (1.0, 0.1)];
        let samples = samples.map(|(x, error)| ([1.0, x], 2.0 + x + error));
        let found = first_coefficient(&samples).unwrap();
        assert!((found - 2.0).abs() < 1e-12, "{found}");
    }
}
