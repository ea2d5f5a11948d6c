//! The table at one Poisson's ratio: a third of the numbers, for many rows of one material.

use crate::contact::numerics::simd;
use crate::contact::rolling::methods::table::near_nodes::{NearNodes, SIZE_ROW, ValueOfMaterial};
use crate::contact::rolling::methods::table::shape_coefficients::{
    MaterialCoefficients, ShapeCoefficients, poisson_weights,
};
use crate::contact::rolling::methods::table::spline::OUTPUTS;

/// The table of a material: the sums over Poisson's ratios are taken once, at every coefficient.
///
/// Values differ from those of the whole table by the rounding of single precision, some 1e-7 of what they may be at most.
#[derive(Debug, Clone)]
pub struct MaterialTable {
    /// `[a/b][pole][direction][size][function]`.
    spline: Vec<[f32; OUTPUTS]>,
    pub(super) shapes: MaterialCoefficients,
    /// Weights of the values at Poisson's ratios of the nodes.
    pub(super) poisson: [f64; 3],
}

impl MaterialTable {
    /// The table at a Poisson's ratio from 0 to 0.5, from the numbers of all `[a/b][pole][direction][size][ν][function]`, their units and
    /// Kalker's coefficients: 1.6 MB, made in the time of some thousand values.
    #[must_use]
    pub fn new(
        spline: &[i16],
        unit: [f32; OUTPUTS],
        shapes: &ShapeCoefficients,
        poisson_ratio: f64,
    ) -> MaterialTable {
        let poisson = parabola(poisson_ratio);
        let (rows, _) = spline.as_chunks::<SIZE_ROW>();
        let weights: [[f64; OUTPUTS]; 3] =
            poisson.map(|weight| unit.map(|unit| weight * f64::from(unit)));
        let combined = |row: &[i16; SIZE_ROW]| -> [f32; OUTPUTS] {
            std::array::from_fn(|k| {
                let part = |n: usize| weights[n][k] * f64::from(row[n * OUTPUTS + k]);
                (part(0) + part(1) + part(2)) as f32
            })
        };
        MaterialTable {
            spline: rows.iter().map(combined).collect(),
            shapes: shapes.of_material(&poisson_weights(poisson_ratio)),
            poisson,
        }
    }

    /// The functions at a place, with the weights of its four sizes.
    #[inline(always)]
    pub(super) fn value(&self, near: &NearNodes, sizes: &[f64; 4]) -> [f64; OUTPUTS] {
        let rows = simd::dispatch(ValueOfMaterial(self.spline.as_flattened(), *near));
        let mut sums = [0.0; OUTPUTS];
        for (row, weight) in rows.chunks_exact(OUTPUTS).zip(sizes) {
            for (sum, value) in sums.iter_mut().zip(row) {
                *sum += weight * f64::from(*value);
            }
        }
        sums
    }
}

/// Weights of the values at `POISSON_RATIOS` in those of a Poisson's
/// ratio: a parabola.
#[inline(always)]
pub(super) fn parabola(poisson_ratio: f64) -> [f64; 3] {
    let nu = 4.0 * poisson_ratio;
    [
        0.5 * (1.0 - nu) * (2.0 - nu),
        nu * (2.0 - nu),
        0.5 * nu * (nu - 1.0),
    ]
}
