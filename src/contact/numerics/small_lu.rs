//! LU factorisation of small dense matrices in place, with row exchanges.
//!
//! Column by column, each elimination one update of contiguous values: no blocks, no recursion, no buffers. For larger matrices faer,
//! which eliminates many columns at once, is faster.

use pulp::NullaryFnOnce;

use crate::contact::numerics::simd;

/// Largest number of unknowns that this factorisation is for. Timed beside faer's on matrices of 4 to 192 unknowns in a release build with
/// AVX-512: it takes 0.33 of the time with 4, 0.5 with 16, 0.7 with 24, 0.9 with 32 and 1.2 with 48.
pub(crate) const SMALL: usize = 32;

/// Factors a square matrix, stored column by column, into `P A = L U`: below the diagonal is L, whose own diagonal is 1, and U elsewhere.
/// `order[i]` becomes the row of A that is row i of `P A`; its length is that of the sides. Factors of a singular matrix are not finite.
pub(crate) fn factor(matrix: &mut [f64], order: &mut [usize]) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factors_multiply_to_the_matrix_with_its_rows_exchanged() {
        for n in [1, 2, 5, 17, SMALL] {
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
        factor(&mut matrix, &mut order);
        assert_eq!((matrix, order), ([2.0, 0.0, 1.0, 4.0], [1, 0]));
    }
}
