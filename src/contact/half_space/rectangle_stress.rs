//! Stresses below a uniformly loaded rectangle on a half-space: closed forms.
//!
//! Tests compare the sums of [`point_loads`](crate::contact::half_space::point_loads) with it.
//!
//! Axes: x, y in the surface, z into the body. Tension is positive. Pressure acts into the body, shear tractions along +x and +y.
//! Sources: Love (1929) for pressure; Johnson 1985, §3.2 and 3.6, for the point loads that the forms for shear are the integrals of.

use crate::contact::half_space::point_loads::Stress;

/// The primitives of one corner at `p = x − x_edge`, `q = y − y_edge` and depth z: the stress of a quarter plane under pressure 1, under
/// shear 1 along x and under shear 1 along y, each times 2π. Four-corner differences of them are the stresses of a rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerStress(pub [Stress; 3]);

impl CornerStress {
    /// The primitives; `z` is more than 0.
    ///
    /// Sums of a distance and a negative coordinate are taken as a quotient, and differences of arctangents as one arctangent, so that
    /// nothing cancels near the surface.
    #[must_use]
    #[inline]
    pub fn at(p: f64, q: f64, z: f64, nu: f64) -> CornerStress {
        let (pp, qq, zz) = (p * p, q * q, z * z);
        let r = (pp + qq + zz).sqrt();
        let over_r = 1.0 / r;
        let r_z = 1.0 / (r + z);
        // q + r and p + r.
        let q_r = if q >= 0.0 { q + r } else { (pp + zz) / (r - q) };
        let p_r = if p >= 0.0 { p + r } else { (qq + zz) / (r - p) };
        let (ln_q, ln_p, ln_z) = (q_r.ln(), p_r.ln(), (r + z).ln());
        let theta = (p * q / (z * r)).atan();
        // atan(q/p) − atan(qz/(pr)), and with p and q exchanged; both 0 at p = q = 0.
        let ahead = p * q * (r - z);
        let tiny = f64::MIN_POSITIVE;
        let turn_p = (ahead / (pp * r + qq * z + tiny)).atan();
        let turn_q = (ahead / (qq * r + pp * z + tiny)).atan();
        let (along, across) = (z * over_r / q_r, z * over_r / p_r);
        let rest = 1.0 - 2.0 * nu;
        let pressure = [
            -2.0 * nu * theta - p * along - rest * turn_p,
            -2.0 * nu * theta - q * across - rest * turn_q,
            -theta + p * along + q * across,
            -rest * ln_z - z * over_r,
            -z * along,
            -z * across,
        ];
        let (p_z, q_z) = (p * r_z, q * r_z);
        let shear = |own: f64, other: f64, ln_own: f64, ln_other: f64, along: f64, own_p: f64| {
            // `own` = q/(r+z), `other` = p/(r+z) for shear along x; along = z/(r(q+r)).
            [
                2.0 * ln_own + 2.0 * nu * own + own * z * over_r + z * along,
                2.0 * nu * ln_own - 2.0 * nu * own - own * z * over_r,
                -z * along,
                ln_other - 2.0 * nu * other - other * z * over_r,
                -theta - own_p * along,
                -z * over_r,
            ]
        };
        let x = shear(q_z, p_z, ln_q, ln_p, along, p);
        let y = shear(p_z, q_z, ln_p, ln_q, across, q);
        // Of shear along y the axes are exchanged.
        let y = [y[1], y[0], y[2], y[3], y[5], y[4]];
        CornerStress([pressure, x, y])
    }

    /// The difference of two primitives.
    #[must_use]
    #[inline]
    pub fn less(&self, other: &CornerStress) -> CornerStress {
        let mut difference = *self;
        for (own, other) in difference.0.iter_mut().zip(&other.0) {
            for (own, other) in own.iter_mut().zip(other) {
                *own -= other;
            }
        }
        difference
    }

    /// The stress for loads: pressure, shear along x, shear along y; adds it to `sum`.
    #[inline]
    pub fn add_loaded(&self, loads: [f64; 3], sum: &mut Stress) {
        for (stress, load) in self.0.iter().zip(loads) {
            let load = load * (0.5 * std::f64::consts::FRAC_1_PI);
            for (sum, value) in sum.iter_mut().zip(stress) {
                *sum += load * value;
            }
        }
    }
}

/// Adds the stress at `(x, y, z)` of a rectangle `[x0, x1, y0, y1]` with these loads: pressure, shear along x and along y.
#[inline]
pub fn add_rectangle(at: [f64; 3], sides: [f64; 4], loads: [f64; 3], nu: f64, sum: &mut Stress) {
    let [x, y, z] = at;
    let [x0, x1, y0, y1] = sides;
    let corner = |x_edge: f64, y_edge: f64| CornerStress::at(x - x_edge, y - y_edge, z, nu);
    let left = corner(x0, y0).less(&corner(x0, y1));
    let right = corner(x1, y0).less(&corner(x1, y1));
    left.less(&right).add_loaded(loads, sum);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::half_space::point_loads::{LANES, LoadPack, stresses};

    fn rectangle(at: [f64; 3], sides: [f64; 4], loads: [f64; 3], nu: f64) -> Stress {
        let mut sum = [0.0; 6];
        add_rectangle(at, sides, loads, nu, &mut sum);
        sum
    }

    const UNIT: [f64; 4] = [-0.5, 0.5, -0.5, 0.5];

    /// Under the middle of a unit square, ν = 0.28: σ_zz and σ_xx of pressure, τ_xz of shear; 18-digit quadrature of Boussinesq's and
    /// Cerruti's point loads.
    #[test]
    fn stresses_under_a_unit_square_have_their_known_values() {
        for (z, zz, xx, xz) in [
            (0.1, -0.9942944919, -0.556116845, -0.7371466106),
            (0.3, -0.8915626810, -0.2273859413, -0.3430865679),
            (0.5, -0.7008859303, -0.0762237015, -0.1495570349),
            (1.0, -0.3361075807, 0.0039725952, -0.0242288602),
            (2.0, -0.1080828964, 0.0060800376, -0.0021633298),
        ] {
            let pressed = rectangle([0.0, 0.0, z], UNIT, [1.0, 0.0, 0.0], 0.28);
            let sheared = rectangle([0.0, 0.0, z], UNIT, [0.0, 1.0, 0.0], 0.28);
            for (found, known) in [
                (pressed[2], zz),
                (pressed[0], xx),
                (pressed[1], xx),
                (sheared[4], xz),
            ] {
                assert!((found - known).abs() < 2e-9, "{z}: {found} {known}");
            }
        }
    }

    #[test]
    fn a_point_beside_the_middle_has_its_known_stress() {
        let sides = [-0.5, 0.5, -0.3, 0.3];
        let found = rectangle([0.2, -0.1, 0.05], sides, [1.0, 0.3, -0.2], 0.28);
        let known = [
            -0.691934799168,
            -0.698995817994,
            -0.999956137318,
            0.0506464218995,
            -0.250203213825,
            0.166893606791,
        ];
        for k in 0..6 {
            assert!((found[k] - known[k]).abs() < 1e-11, "{k}: {found:?}");
        }
    }

    /// Inside, beside, beyond and near corners of the rectangle, the stresses are in equilibrium: ∂σ_ij/∂x_j = 0.
    #[test]
    fn stresses_are_in_equilibrium() {
        let sides = [-0.7, 0.4, -0.2, 0.5];
        let step = 1e-3;
        for at in [
            [0.1, 0.2, 0.3],
            [0.41, 0.52, 0.1],
            [-2.0, 0.7, 1.5],
            [0.3, -0.6, 0.05],
        ] {
            for loads in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
                let change = |axis: usize| -> [f64; 6] {
                    let moved = |by: f64| {
                        let mut at = at;
                        at[axis] += by * step;
                        rectangle(at, sides, loads, 0.3)
                    };
                    // Fourth-order difference.
                    let (near, far) = ([moved(1.0), moved(-1.0)], [moved(2.0), moved(-2.0)]);
                    std::array::from_fn(|k| {
                        (8.0 * (near[0][k] - near[1][k]) - (far[0][k] - far[1][k])) / (12.0 * step)
                    })
                };
                let [x, y, z] = [0, 1, 2].map(change);
                let size = x
                    .iter()
                    .chain(&y)
                    .chain(&z)
                    .map(|v| v.abs())
                    .fold(0.0, f64::max);
                for sum in [x[0] + y[3] + z[4], x[3] + y[1] + z[5], x[4] + y[5] + z[2]] {
                    assert!(
                        sum.abs() < 2e-6 * size,
                        "{at:?} {loads:?}: {sum:e} of {size}"
                    );
                }
            }
        }
    }

    #[test]
    fn turning_the_rectangle_exchanges_the_axes() {
        let found = rectangle(
            [0.3, -0.4, 0.2],
            [-0.7, 0.4, -0.2, 0.5],
            [0.7, 0.2, -0.5],
            0.3,
        );
        let turned = rectangle(
            [-0.4, 0.3, 0.2],
            [-0.2, 0.5, -0.7, 0.4],
            [0.7, -0.5, 0.2],
            0.3,
        );
        let [xx, yy, zz, xy, xz, yz] = turned;
        for (found, known) in found.iter().zip([yy, xx, zz, xy, yz, xz]) {
            assert!((found - known).abs() < 1e-14);
        }
    }

    /// A rectangle of a hundredth of the distance acts as its load in the middle.
    #[test]
    fn a_small_rectangle_is_a_point_load() {
        let places = [
            [0.3, -0.2, 0.4],
            [1.4, 0.0, 0.5],
            [-6.0, 3.0, 2.0],
            [0.1, -0.3, 4.0],
            [2.0, 2.0, 0.1],
        ];
        let mut points = [[1.0; LANES]; 3];
        for (lane, place) in places.iter().enumerate() {
            for k in 0..3 {
                points[k][lane] = place[k] as f32;
            }
        }
        for force in [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.3, -0.2, 0.9],
        ] {
            let side = 0.004;
            let mut pack = LoadPack::default();
            for (forces, force) in pack.force.iter_mut().zip(force) {
                forces[0] = force as f32;
            }
            let felt = std::array::from_fn(|_| std::iter::once(0..1).collect());
            let found = stresses(&[pack], &felt, &points, 0.28);
            for (place, found) in places.iter().zip(found) {
                let mut known = [0.0; 6];
                let [x, y, z] = force.map(|f| f / (side * side));
                let half = 0.5 * side;
                add_rectangle(
                    *place,
                    [-half, half, -half, half],
                    [z, x, y],
                    0.28,
                    &mut known,
                );
                let size = known.iter().fold(0.0_f64, |size, s| size.max(s.abs()));
                for k in 0..6 {
                    let error = (found[k] - known[k]).abs();
                    assert!(
                        error < 5e-4 * size,
                        "{place:?} {force:?} {k}: {found:?} {known:?}"
                    );
                }
            }
        }
    }
}
