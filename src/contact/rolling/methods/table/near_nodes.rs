//! Sums of the table's spline over the coefficients around a place, compiled for the level of SIMD that the machine has.

use pulp::{Simd, WithSimd};

use crate::contact::rolling::methods::table::axis::Weights;
use crate::contact::rolling::methods::table::grid::{POISSON_RATIOS, SIZES};
use crate::contact::rolling::methods::table::spline::{
    DIRECTION_COEFFICIENTS, OUTPUTS, POLE_COEFFICIENTS,
};

/// Numbers of one size: Poisson's ratios, functions.
pub const SIZE_ROW: usize = POISSON_RATIOS.len() * OUTPUTS;
/// Numbers of the four sizes around a creepage.
pub const NEAR: usize = 4 * SIZE_ROW;

/// The coefficients around a place.
#[derive(Debug, Clone, Copy)]
pub struct NearNodes {
    /// Weights in a/b.
    pub ratio: Weights,
    /// Weights in the pole.
    pub pole: Weights,
    /// Weights in the direction.
    pub direction: Weights,
    /// The first of four sizes.
    pub size: usize,
}

impl NearNodes {
    /// The numbers of four sizes at one a/b, pole and direction, of a spline `[a/b][pole][direction][size][number]`.
    #[inline(always)]
    fn row<'a>(&self, spline: &'a [i16], [i, j, k]: [usize; 3]) -> &'a [i16; NEAR] {
        let pole = (self.ratio.first + i) * POLE_COEFFICIENTS + self.pole.first + j;
        let place = pole * DIRECTION_COEFFICIENTS + self.direction.first + k;
        let start = (place * SIZES.len() + self.size) * SIZE_ROW;
        match spline[start..start + NEAR].try_into() {
            Ok(row) => row,
            Err(_) => unreachable!("a slice of that length"),
        }
    }

    #[inline(always)]
    fn value(&self, spline: &[i16]) -> [f32; NEAR] {
        let mut sum = [0.0_f32; NEAR];
        for i in 0..4 {
            for j in 0..4 {
                let outer = self.ratio.value[i] * self.pole.value[j];
                for k in 0..4 {
                    let weight = (outer * self.direction.value[k]) as f32;
                    let row = self.row(spline, [i, j, k]);
                    for n in 0..NEAR {
                        sum[n] += weight * f32::from(row[n]);
                    }
                }
            }
        }
        sum
    }

    /// The value, and the derivatives by pole and direction.
    #[inline(always)]
    fn with_slopes(&self, spline: &[i16]) -> [[f32; NEAR]; 3] {
        let mut sums = [[0.0_f32; NEAR]; 3];
        for i in 0..4 {
            for j in 0..4 {
                let outer = self.ratio.value[i] * self.pole.value[j];
                let sloped = self.ratio.value[i] * self.pole.slope[j];
                for k in 0..4 {
                    let weights = [
                        (outer * self.direction.value[k]) as f32,
                        (sloped * self.direction.value[k]) as f32,
                        (outer * self.direction.slope[k]) as f32,
                    ];
                    let row = self.row(spline, [i, j, k]);
                    for (sum, weight) in sums.iter_mut().zip(weights) {
                        for n in 0..NEAR {
                            sum[n] += weight * f32::from(row[n]);
                        }
                    }
                }
            }
        }
        sums
    }
}

/// The sums of the table. What is compiled for each level of SIMD: a closure would not be, the compiler does not inline one of this length.
pub struct Value<'a>(pub &'a [i16], pub NearNodes);

impl WithSimd for Value<'_> {
    type Output = [f32; NEAR];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f32; NEAR] {
        self.1.value(self.0)
    }
}

/// The same with the derivatives.
pub struct ValueAndSlopes<'a>(pub &'a [i16], pub NearNodes);

impl WithSimd for ValueAndSlopes<'_> {
    type Output = [[f32; NEAR]; 3];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [[f32; NEAR]; 3] {
        self.1.with_slopes(self.0)
    }
}
