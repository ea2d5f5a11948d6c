//! Dense LU factorisation with row exchanges, and least-squares fits of few functions by their normal equations.
//!
//! The factorisation of the blocks of a preconditioner proceeds column by column in place, with contiguous updates. Up to 32 unknowns it takes less time than faer, which
//! eliminates many columns at once.

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Mat, MatMut};
use pulp::NullaryFnOnce;

use crate::monitor::{Monitor, Stop};
use crate::numerics::roots::ROUNDING;
use crate::numerics::simd;

/// Solves `X ← A⁻¹ X` for a square matrix. The solutions for a singular matrix are not finite.
///
/// # Errors
/// Only if the monitor, which is called before and after the factorisation, stops the work.
pub fn solve(matrix: &Mat<f64>, rhs: MatMut<'_, f64>, monitor: &dyn Monitor) -> Result<(), Stop> {
    monitor.go_on(0.0)?;
    let factors = PartialPivLu::new(matrix.as_ref());
    monitor.go_on(0.0)?;
    factors.solve_in_place(rhs);
    Ok(())
}

/// Factors a square matrix, stored column by column, into `P A = L U`. The part below the diagonal is L, whose diagonal is 1, the rest is U. `order[i]` becomes the row of
/// A that is row i of `P A`; its length is that of the sides. The factors of a singular matrix are not finite.
pub(crate) fn factor(matrix: &mut [f64], order: &mut [usize]) {
    debug_assert_eq!(matrix.len(), order.len() * order.len());
    // The loops are compiled for the instruction set of the machine.
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

/// Place of the first entry of largest magnitude.
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

/// First of the `N` coefficients of the least-squares fit of functions to samples. Each sample consists of the functions' values and the value to be fitted. `None` if the
/// functions, which are of order 1, are linearly dependent on the samples.
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
    // Elimination proceeds from the last coefficient, because only the first is needed.
    for k in (1..N).rev() {
        let (pivot, own) = (normal[k], right[k]);
        if pivot[k].abs() < ROUNDING {
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
    (normal[0][0].abs() >= ROUNDING && value.is_finite()).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::Unmonitored;

    fn wavy(n: usize) -> Mat<f64> {
        // No large diagonal: rows must be exchanged.
        Mat::from_fn(n, n, |i, j| ((7 * i * i + 13 * j + i * j) as f64).sin())
    }

    #[test]
    fn a_solve_gives_back_the_unknowns() {
        for n in [0, 1, 5, 64, 199] {
            let a = wavy(n);
            let x = Mat::from_fn(n, 3, |i, j| (i as f64 + 0.3 * j as f64).cos());
            let mut b = &a * &x;
            solve(&a, b.as_mut(), &Unmonitored).unwrap();
            let error = (&b - &x).norm_max();
            assert!(error < 1e-8, "{n}: {error}");
        }
    }
}

#[cfg(test)]
mod block_tests {
    use super::*;

    #[test]
    fn the_factors_multiply_to_the_matrix_with_its_rows_exchanged() {
        for n in [1, 2, 5, 17, 48] {
            // No large diagonal: rows must be exchanged.
            let entry = |i: usize, j: usize| ((7 * i * i + 13 * j + i * j) as f64).sin();
            let mut matrix: Vec<f64> = (0..n * n).map(|k| entry(k % n, k / n)).collect();
            let mut order = vec![0; n];
            factor(&mut matrix, &mut order);
            let lower = |i: usize, k: usize| if i == k { 1.0 } else { matrix[k * n + i] };
            for (i, row) in order.iter().enumerate() {
                for j in 0..n {
                    let product: f64 = (0..=i.min(j))
                        .map(|k| lower(i, k) * matrix[j * n + k])
                        .sum();
                    let known = entry(*row, j);
                    assert!((product - known).abs() < 1e-11, "{n}: {i}, {j}");
                }
                assert!((0..i).all(|k| lower(i, k).abs() <= 1.0), "{n}: {i}");
            }
        }
    }

    #[test]
    fn a_zero_on_the_diagonal_is_no_obstacle() {
        let mut matrix = [0.0, 2.0, 4.0, 1.0];
        let mut order = [0; 2];
        factor(&mut matrix, &mut order);
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
