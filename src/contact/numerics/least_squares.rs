//! Least-squares fits of a few functions, by their normal equations on the stack.

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
