//! Stresses of many rectangles at one point: sums over their corners, in the machine's lanes and in single precision.
//!
//! The stress is `Σ w F(p, q)` over corners, with the primitives `F` of a quarter plane under a uniform load and weights that are differences of loads where rectangles share a corner. Single precision leaves about 1e-5 of the largest load.

use std::f32::consts::FRAC_PI_2;

use pulp::{Arch, NullaryFnOnce};

use crate::contact::half_space::rectangle_stress::Stress;
use crate::contact::numerics::simd_ln::Float;

/// Corners that are summed side by side.
const WIDTH: usize = 16;
/// Far below every product of lengths that counts.
const TINY: f32 = 1e-30;
/// Of the polynomial of `atan t/t` in `t²`, smallest power first; error below 2e-8 for |t| ≤ 1 (Abramowitz and Stegun 1964, 4.4.49).
const ATAN: [f32; 9] = [
    1.0,
    -0.333_331_45,
    0.199_935_51,
    -0.142_089,
    0.106_562_64,
    -0.075_289_64,
    0.042_909_614,
    -0.016_165_737,
    0.002_866_225_7,
];

/// Corners of loaded rectangles as seen from one point, to be summed.
#[derive(Debug, Clone, Default)]
pub struct CornerSums {
    p: Vec<f32>,
    q: Vec<f32>,
    /// Of pressure, shear along x and along y.
    weights: [Vec<f32>; 3],
}

impl CornerSums {
    /// Forgets all corners.
    pub fn clear(&mut self) {
        self.p.clear();
        self.q.clear();
        self.weights.iter_mut().for_each(Vec::clear);
    }

    /// A corner at the distances `p`, `q` from the point, with its weights.
    #[inline]
    pub fn push(&mut self, p: f64, q: f64, weights: [f64; 3]) {
        self.p.push(p as f32);
        self.q.push(q as f32);
        for (list, weight) in self.weights.iter_mut().zip(weights) {
            list.push(weight as f32);
        }
    }

    /// The four corners of a rectangle `[x0, x1, y0, y1]` with these loads, seen from `(x, y)`.
    pub fn push_rectangle(&mut self, [x, y]: [f64; 2], sides: [f64; 4], loads: [f64; 3]) {
        let [x0, x1, y0, y1] = sides;
        let less = loads.map(|load| -load);
        self.push(x - x0, y - y0, loads);
        self.push(x - x0, y - y1, less);
        self.push(x - x1, y - y0, less);
        self.push(x - x1, y - y1, loads);
    }

    /// The stress at the depth `z`, for Poisson's ratio `nu`.
    #[must_use]
    pub fn stress(&mut self, z: f64, nu: f64) -> Stress {
        // Corners without weight fill the last lanes.
        while !self.p.len().is_multiple_of(WIDTH) {
            self.push(1.0, 1.0, [0.0; 3]);
        }
        let corners: &CornerSums = self;
        Arch::new().dispatch(Sum {
            corners,
            z: z as f32,
            nu: nu as f32,
        })
    }
}

struct Sum<'a> {
    corners: &'a CornerSums,
    z: f32,
    nu: f32,
}

impl NullaryFnOnce for Sum<'_> {
    type Output = Stress;

    #[inline(always)]
    fn call(self) -> Stress {
        let CornerSums { p, q, weights } = self.corners;
        let (ps, _) = p.as_chunks::<WIDTH>();
        let (qs, _) = q.as_chunks::<WIDTH>();
        let [pressure, along, across] = weights.each_ref().map(|list| list.as_chunks::<WIDTH>().0);
        let mut sums = [[0.0_f32; WIDTH]; 6];
        for k in 0..ps.len() {
            for lane in 0..WIDTH {
                let weights = [pressure[k][lane], along[k][lane], across[k][lane]];
                let values = corner(ps[k][lane], qs[k][lane], self.z, self.nu, weights);
                for (sum, value) in sums.iter_mut().zip(values) {
                    sum[lane] += value;
                }
            }
        }
        sums.map(|lanes| {
            let sum: f64 = lanes.iter().map(|value| f64::from(*value)).sum();
            sum * (0.5 * std::f64::consts::FRAC_1_PI)
        })
    }
}

/// The weighted primitives of one corner, without branches.
#[inline(always)]
fn corner(p: f32, q: f32, z: f32, nu: f32, weights: [f32; 3]) -> [f32; 6] {
    let (pp, qq, zz) = (p * p, q * q, z * z);
    let r = (pp + qq + zz).sqrt();
    let over_r = 1.0 / r;
    let r_z = 1.0 / (r + z);
    // Both forms of q + r and p + r are computed, so that a choice and no branch is left.
    let (q_far, p_far) = (q.abs() + r, p.abs() + r);
    let (q_near, p_near) = ((pp + zz) / q_far, (qq + zz) / p_far);
    let q_r = if q >= 0.0 { q_far } else { q_near };
    let p_r = if p >= 0.0 { p_far } else { p_near };
    let (ln_q, ln_p, ln_z) = (Float::ln(q_r), Float::ln(p_r), Float::ln(r + z));
    let theta = atan(p * q / (z * r));
    let ahead = p * q * (pp + qq) * r_z;
    let turn_p = atan(ahead / (pp * r + qq * z + TINY));
    let turn_q = atan(ahead / (qq * r + pp * z + TINY));
    let (along, across) = (z * over_r / q_r, z * over_r / p_r);
    let (rest, twice, flat) = (1.0 - 2.0 * nu, 2.0 * nu, z * over_r);
    let (p_z, q_z) = (p * r_z, q * r_z);
    let [w, x, y] = weights;
    // Pressure; then what shear along x and along y add, whose axes are exchanged.
    [
        w * (-twice * theta - p * along - rest * turn_p)
            + x * (2.0 * ln_q + (twice + flat) * q_z + z * along)
            + y * (twice * ln_p - (twice + flat) * p_z),
        w * (-twice * theta - q * across - rest * turn_q)
            + x * (twice * ln_q - (twice + flat) * q_z)
            + y * (2.0 * ln_p + (twice + flat) * p_z + z * across),
        w * (-theta + p * along + q * across) - x * z * along - y * z * across,
        w * (-rest * ln_z - flat)
            + x * (ln_p - (twice + flat) * p_z)
            + y * (ln_q - (twice + flat) * q_z),
        -w * z * along - x * (theta + p * along) - y * flat,
        -w * z * across - x * flat - y * (theta + q * across),
    ]
}

/// The arctangent, without branches.
#[inline(always)]
fn atan(x: f32) -> f32 {
    let size = x.abs();
    let (steep, inverse) = (size > 1.0, 1.0 / size);
    let t = if steep { inverse } else { size };
    let tt = t * t;
    let mut series = 0.0_f32;
    for coefficient in ATAN.into_iter().rev() {
        series = series.mul_add(tt, coefficient);
    }
    let small = t * series;
    let angle = if steep { FRAC_PI_2 - small } else { small };
    angle.copysign(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::half_space::rectangle_stress::add_rectangle;

    #[test]
    fn the_arctangent_is_that_of_the_library() {
        for k in -400..400 {
            let x = (0.05 * k as f32).sinh();
            assert!((atan(x) - x.atan()).abs() < 2e-7, "{x}");
        }
    }

    #[test]
    fn sums_over_corners_are_those_of_the_rectangles() {
        let mut corners = CornerSums::default();
        for at in [
            [0.3, -0.2, 0.01],
            [1.4, 0.0, 0.5],
            [-6.0, 3.0, 2.0],
            [0.0, 0.0, 4.0],
        ] {
            let mut known = [0.0; 6];
            corners.clear();
            for k in 0..40 {
                let seed = f64::from(k);
                let (x, y) = ((1.3 * seed).sin(), (2.1 * seed).cos());
                let sides = [x - 0.11, x + 0.07, y - 0.05, y + 0.2];
                let loads = [
                    0.4 + 0.6 * (0.7 * seed).sin(),
                    0.3 * (3.0 * seed).cos(),
                    -0.2,
                ];
                add_rectangle(at, sides, loads, 0.28, &mut known);
                corners.push_rectangle([at[0], at[1]], sides, loads);
            }
            let found = corners.stress(at[2], 0.28);
            for k in 0..6 {
                assert!(
                    (found[k] - known[k]).abs() < 3e-5,
                    "{at:?} {k}: {found:?} {known:?}"
                );
            }
        }
    }
}
