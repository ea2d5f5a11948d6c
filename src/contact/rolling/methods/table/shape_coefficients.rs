//! Kalker's coefficients as splines in ln(a/b), which are faster for many ellipses.

use crate::numerics::interpolation;
use crate::rolling::linear_theory::{POISSON_RATIOS, coefficients, spin_coefficient};
use crate::rolling::methods::table::spline::{Axis, free_coefficients, ln_ratio_max};

/// Number of nodes in ln(a/b): enough to reproduce the interpolation of `linear_theory` to 1e-5.
const NODES: u8 = 57;

/// Logarithms of C11, C22, C23 and C33 at the Poisson's ratios of [`POISSON_RATIOS`], as splines.
#[derive(Debug, Clone)]
pub struct ShapeCoefficients {
    axis: Axis,
    /// Coefficients for each node and Poisson's ratio.
    spline: Vec<[[f64; 4]; 5]>,
}

impl ShapeCoefficients {
    /// The splines through [`coefficients`] and [`spin_coefficient`].
    pub fn new() -> ShapeCoefficients {
        let places: Vec<u8> = (0..NODES).collect();
        let low = -ln_ratio_max();
        let step = 2.0 * ln_ratio_max() / f64::from(NODES - 1);
        let values: Vec<[[f64; 4]; 5]> = places
            .iter()
            .map(|k| (low + step * f64::from(*k)).exp())
            .map(|ratio| {
                POISSON_RATIOS.map(|nu| {
                    let [c11, c22, c23] = coefficients(ratio, nu);
                    [c11, c22, c23, spin_coefficient(ratio, nu)].map(f64::ln)
                })
            })
            .collect();
        let combined = |row: &Vec<f64>| {
            let mut sum = [[0.0; 4]; 5];
            for (weight, value) in row.iter().zip(&values) {
                for (sum, value) in sum.as_flattened_mut().iter_mut().zip(value.as_flattened()) {
                    *sum += weight * value;
                }
            }
            sum
        };
        ShapeCoefficients {
            axis: Axis::free(low, step, &places),
            spline: free_coefficients(&places).iter().map(combined).collect(),
        }
    }

    /// `[C11, C22, C23, C33]` of a material with the weights of its Poisson's ratio (see [`poisson_weights`]), and `[C11, C22]` of
    /// ν = 1/4.
    #[inline(always)]
    pub fn at(&self, ln_ratio: f64, poisson: &[f64; 5]) -> ([f64; 4], [f64; 2]) {
        let weights = self.axis.at(ln_ratio);
        let mut sums = [[0.0; 4]; 5];
        for k in 0..4 {
            let node = &self.spline[weights.first + k];
            for (sum, value) in sums.as_flattened_mut().iter_mut().zip(node.as_flattened()) {
                *sum += weights.value[k] * value;
            }
        }
        let mut of_material = [0.0; 4];
        for (weight, sum) in poisson.iter().zip(&sums) {
            for (value, part) in of_material.iter_mut().zip(sum) {
                *value += weight * part;
            }
        }
        let quarter = [sums[2][0].exp(), sums[2][1].exp()];
        (of_material.map(f64::exp), quarter)
    }
}

impl Default for ShapeCoefficients {
    fn default() -> Self {
        ShapeCoefficients::new()
    }
}

/// Weights of the values at [`POISSON_RATIOS`]: a polynomial of fourth degree, as in `linear_theory`.
pub fn poisson_weights(poisson_ratio: f64) -> [f64; 5] {
    interpolation::polynomial_weights(&POISSON_RATIOS, poisson_ratio)
}
