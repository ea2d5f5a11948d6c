//! The table at one Poisson's ratio: a third of the numbers, for many rows of one material.

use pulp::Arch;

use crate::contact::rolling::methods::table::evaluate::{CreepTable, EllipseTable, parabola};
use crate::contact::rolling::methods::table::near_nodes::{NearNodes, SIZE_ROW, ValueOfMaterial};
use crate::contact::rolling::methods::table::shape_coefficients::{
    MaterialCoefficients, poisson_weights,
};
use crate::contact::rolling::methods::table::spline::OUTPUTS;

/// The table of a material: the sums over Poisson's ratios are taken once, at every coefficient.
///
/// Values differ from those of [`CreepTable::ellipse`] by the rounding of single precision, some 1e-7 of what they may be at most.
#[derive(Debug, Clone)]
pub struct MaterialTable<'a> {
    table: &'a CreepTable,
    /// `[a/b][pole][direction][size][function]`.
    spline: Vec<[f32; OUTPUTS]>,
    shapes: MaterialCoefficients,
    poisson: [f64; 3],
}

impl<'a> MaterialTable<'a> {
    /// The table at a Poisson's ratio from 0 to 0.5: 1.4 MB, made in the time of some thousand values.
    #[must_use]
    pub fn new(table: &'a CreepTable, poisson_ratio: f64) -> MaterialTable<'a> {
        let poisson = parabola(poisson_ratio);
        let (rows, _) = table.spline.as_chunks::<SIZE_ROW>();
        let weights: [[f64; OUTPUTS]; 3] =
            poisson.map(|weight| table.unit.map(|unit| weight * f64::from(unit)));
        let combined = |row: &[i16; SIZE_ROW]| -> [f32; OUTPUTS] {
            std::array::from_fn(|k| {
                let part = |n: usize| weights[n][k] * f64::from(row[n * OUTPUTS + k]);
                (part(0) + part(1) + part(2)) as f32
            })
        };
        MaterialTable {
            table,
            spline: rows.iter().map(combined).collect(),
            shapes: table.shapes.of_material(&poisson_weights(poisson_ratio)),
            poisson,
        }
    }

    /// The table for semi-axes of the ratio a/b, as [`CreepTable::ellipse`].
    #[must_use]
    #[inline(always)]
    pub fn ellipse(&'a self, ratio: f64) -> EllipseTable<'a> {
        let ln_ratio = ratio.ln();
        let coefficients = self.shapes.at(ln_ratio);
        self.table
            .ellipse_with(ratio, ln_ratio, coefficients, self.poisson)
            .of_material(self)
    }

    /// The functions at a place, with the weights of its four sizes.
    #[inline(always)]
    pub(super) fn value(&self, near: &NearNodes, sizes: &[f64; 4]) -> [f64; OUTPUTS] {
        let rows = Arch::new().dispatch(ValueOfMaterial(self.spline.as_flattened(), *near));
        let mut sums = [0.0; OUTPUTS];
        for (row, weight) in rows.chunks_exact(OUTPUTS).zip(sizes) {
            for (sum, value) in sums.iter_mut().zip(row) {
                *sum += weight * f64::from(*value);
            }
        }
        sums
    }
}
