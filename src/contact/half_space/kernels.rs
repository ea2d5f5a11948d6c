//! Closed forms of the half-space: displacements by a uniformly loaded rectangle at a point, and stresses by many point loads at a point.
//!
//! The displacements are a slow reference implementation; [`operator`](crate::half_space::strip_operator::operator) evaluates the same forms in bulk. The stresses use
//! SIMD lanes in single precision. Axes: x, y in the surface, z into the body. Tension is positive. Sources: Boussinesq's and Cerruti's point loads (Johnson 1985, §3.2
//! and 3.6).

use std::f64::consts::FRAC_1_PI;
use std::ops::Range;

use pulp::NullaryFnOnce;

use crate::numerics::quadrature::FOUR_POINTS;
use crate::numerics::simd::{self, LANES};

/// A rectangle `x0 < x < x1`, `y0 < y < y1`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// Trailing side.
    pub x0: f64,
    /// Leading side.
    pub x1: f64,
    /// Right side (smaller y).
    pub y0: f64,
    /// Left side (larger y).
    pub y1: f64,
}

/// Relative displacement of the two surfaces (both bodies together) per unit uniform load, times G, in the unit of length of the rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Influence {
    /// u_x from T_x.
    pub xx: f64,
    /// u_x from T_y, which equals u_y from T_x.
    pub xy: f64,
    /// u_y from T_y.
    pub yy: f64,
    /// u_z from pressure.
    pub zz: f64,
}

/// Distance, in units of the longer side of the rectangle, beyond which quadrature is more accurate than the corner terms, which cancel.
const FAR: f64 = 40.0;

/// Influence of a rectangle at the point `(x, y)` for Poisson's ratio `nu`.
///
/// With `p = x − x_edge`, `q = y − y_edge`, `r = √(p² + q²)` and the alternating sum over the four corners: `∬X²/r³ = [[q asinh(p/|q|)]]`,
/// `∬Y²/r³ = [[p asinh(q/|p|)]]`, `∬XY/r³ = −[[r]]`; then `xx = (∬X²/r³ + (1−ν)∬Y²/r³ … )/π` as in Cerruti's and Boussinesq's solutions (Johnson 1985, §3.2 and 3.6;
/// Kalker 1990), with the factor 2 for two bodies. Terms are 0 where their leading factor is 0, so points on edges and corners are allowed. The error is about 1e-14 of
/// the largest coefficient near the rectangle; far away a 4×4 Gauss rule keeps the relative error below 1e-12.
pub fn rectangle(x: f64, y: f64, cell: Rectangle, nu: f64) -> Influence {
    let longer = (cell.x1 - cell.x0).max(cell.y1 - cell.y0);
    let dx = (cell.x0 - x).max(x - cell.x1).max(0.0);
    let dy = (cell.y0 - y).max(y - cell.y1).max(0.0);
    let [xx_over_r3, yy_over_r3, xy_over_r3] = if dx.hypot(dy) > FAR * longer {
        by_quadrature(x, y, cell)
    } else {
        by_corners(x, y, cell)
    };
    combine(xx_over_r3, yy_over_r3, xy_over_r3, nu)
}

/// Combines the three integrals `∬X²/r³`, `∬Y²/r³`, `∬XY/r³` into the four coefficients.
#[inline]
fn combine(ixx: f64, iyy: f64, ixy: f64, nu: f64) -> Influence {
    use std::f64::consts::FRAC_1_PI;
    Influence {
        xx: FRAC_1_PI * (ixx + (1.0 - nu) * iyy),
        xy: FRAC_1_PI * nu * ixy,
        yy: FRAC_1_PI * (iyy + (1.0 - nu) * ixx),
        zz: FRAC_1_PI * (1.0 - nu) * (ixx + iyy),
    }
}

fn by_corners(x: f64, y: f64, cell: Rectangle) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (p, sign_p) in [(x - cell.x0, 1.0), (x - cell.x1, -1.0)] {
        for (q, sign_q) in [(y - cell.y0, 1.0), (y - cell.y1, -1.0)] {
            let sign: f64 = sign_p * sign_q;
            let term = |u: f64, v: f64| {
                if u == 0.0 {
                    0.0
                } else {
                    u * (v / u.abs()).asinh()
                }
            };
            sum[0] += sign * term(q, p);
            sum[1] += sign * term(p, q);
            sum[2] -= sign * p.hypot(q);
        }
    }
    sum
}

fn by_quadrature(x: f64, y: f64, cell: Rectangle) -> [f64; 3] {
    let (half_x, half_y) = (0.5 * (cell.x1 - cell.x0), 0.5 * (cell.y1 - cell.y0));
    let (mid_x, mid_y) = (0.5 * (cell.x0 + cell.x1), 0.5 * (cell.y0 + cell.y1));
    let mut sum = [0.0; 3];
    for (u, wu) in FOUR_POINTS {
        for (v, wv) in FOUR_POINTS {
            let (dx, dy) = (x - mid_x - half_x * u, y - mid_y - half_y * v);
            let r = dx.hypot(dy);
            let weight = wu * wv * half_x * half_y / (r * r * r);
            sum[0] += weight * dx * dx;
            sum[1] += weight * dy * dy;
            sum[2] += weight * dx * dy;
        }
    }
    sum
}

#[cfg(test)]
pub mod rectangle_stress {
    //! Stresses below a uniformly loaded rectangle on a half-space: closed forms.
    //!
    //! Tests compare the sums of [`point_loads`](crate::half_space::kernels) with it.
    //!
    //! Axes: x, y in the surface, z into the body. Tension is positive. Pressure acts into the body, shear tractions along +x and +y.
    //! Sources: Love (1929) for pressure; Johnson 1985, §3.2 and 3.6, for the point loads that the forms for shear are the integrals of.

    use crate::half_space::kernels::Stress;

    /// The primitives of one corner at `p = x − x_edge`, `q = y − y_edge` and depth z: the stress of a quarter plane under pressure 1, under
    /// shear 1 along x and under shear 1 along y, each times 2π. Four-corner differences of them are the stresses of a rectangle.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct CornerStress(pub [Stress; 3]);

    impl CornerStress {
        /// The primitives; `z` is more than 0.
        ///
        /// Sums of a distance and a negative coordinate are taken as a quotient, and differences of arctangents as one arctangent, so that
        /// nothing cancels near the surface.
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
            let shear =
                |own: f64, other: f64, ln_own: f64, ln_other: f64, along: f64, own_p: f64| {
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
        #[inline]
        #[must_use]
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
    pub fn add_rectangle(
        at: [f64; 3],
        sides: [f64; 4],
        loads: [f64; 3],
        nu: f64,
        sum: &mut Stress,
    ) {
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
        use crate::half_space::kernels::{LoadPack, stress};

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
                            (8.0 * (near[0][k] - near[1][k]) - (far[0][k] - far[1][k]))
                                / (12.0 * step)
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
                for place in &places {
                    let found = stress(
                        &[pack],
                        std::slice::from_ref(&(0..1)),
                        place.map(|at| at as f32),
                        0.28,
                    );
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
}

/// Stresses `xx, yy, zz, xy, xz, yz`.
pub type Stress = [f64; 6];

/// One number per lane.
pub type Lanes = [f32; LANES];

/// Forces on the surface in [`LANES`] lanes; unused lanes are 0.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LoadPack {
    /// The points of action: x and y in mm.
    pub at: [Lanes; 2],
    /// Their components along x, along y and into the body, in N.
    pub force: [Lanes; 3],
}

/// The stress in MPa at a point `[x, y, z]` in mm with z > 0, by ranges of packs, for Poisson's ratio `nu`.
pub fn stress(packs: &[LoadPack], felt: &[Range<usize>], point: [f32; 3], nu: f64) -> Stress {
    simd::dispatch(FeltStress {
        packs,
        felt,
        point,
        rest: (1.0 - 2.0 * nu) as f32,
    })
}

struct FeltStress<'a> {
    packs: &'a [LoadPack],
    felt: &'a [Range<usize>],
    point: [f32; 3],
    /// 1 − 2ν.
    rest: f32,
}

impl NullaryFnOnce for FeltStress<'_> {
    type Output = Stress;

    #[inline(always)]
    fn call(self) -> Stress {
        let mut sums = StressSums::default();
        for packs in self.felt {
            for pack in &self.packs[packs.clone()] {
                add(pack, self.point, self.rest, &mut sums);
            }
        }
        sums.total()
    }
}

/// 2π times the sums of the stresses.
#[derive(Default)]
struct StressSums {
    /// The terms without `even`.
    terms: [Lanes; 6],
    /// The common part of xx and yy.
    even: Lanes,
}

impl StressSums {
    /// The sum over the lanes.
    #[inline(always)]
    fn total(&self) -> Stress {
        let sum = |lanes: &Lanes| {
            let mut halves = *lanes;
            for width in [8, 4, 2, 1] {
                for lane in 0..width {
                    halves[lane] += halves[lane + width];
                }
            }
            f64::from(halves[0]) * (0.5 * FRAC_1_PI)
        };
        let even = sum(&self.even);
        let [xx, yy, zz, xy, xz, yz] = &self.terms;
        [
            sum(xx) + even,
            sum(yy) + even,
            sum(zz),
            sum(xy),
            sum(xz),
            sum(yz),
        ]
    }
}

/// Adds 2π times the stresses of a pack.
///
/// With r from the load to the point, its length ρ and the force F: −3 (F·r) r_i r_j/ρ⁵, plus 1 − 2ν times terms that only have components in the surface. The form has few
/// dependent operations: one division, and fused products.
#[inline(always)]
fn add(pack: &LoadPack, [x_point, y_point, z]: [f32; 3], share: f32, sums: &mut StressSums) {
    let [xs, ys] = &pack.at;
    let [alongs, acrosses, downs] = &pack.force;
    let StressSums { terms, even } = sums;
    let [xx, yy, zz, xy, xz, yz] = terms;
    for lane in 0..LANES {
        let (x, y) = (x_point - xs[lane], y_point - ys[lane]);
        let (along, across, down) = (alongs[lane], acrosses[lane], downs[lane]);
        let distance = x.mul_add(x, y.mul_add(y, z * z)).sqrt();
        let deep = distance + z;
        let inverse = 1.0 / (distance * deep);
        // 1/ρ, 1/(ρ + z), 1/(ρ (ρ + z)).
        let (near, below) = (inverse * deep, inverse * distance);
        let square = near * near;
        let cube = square * near;
        let sheared = along.mul_add(x, across * y);
        let all = -3.0 * down.mul_add(z, sheared) * (cube * square);
        // 1/(ρ (ρ + z)²), and what multiplies the squares of the coordinates.
        let turned = inverse * below;
        let rest = share * turned;
        let twice = distance + deep;
        let squares = (sheared * below).mul_add(distance + twice, down * twice);
        let both = (rest * square).mul_add(squares, all);
        let flat = cube.mul_add(z, -inverse);
        even[lane] += share * sheared.mul_add(cube - turned, down * flat);
        let (along, across) = (rest * along, rest * across);
        xx[lane] = x.mul_add(both.mul_add(x, -2.0 * along), xx[lane]);
        yy[lane] = y.mul_add(both.mul_add(y, -2.0 * across), yy[lane]);
        xy[lane] = x.mul_add(both.mul_add(y, -across), y.mul_add(-along, xy[lane]));
        let all = all * z;
        zz[lane] = all.mul_add(z, zz[lane]);
        xz[lane] = all.mul_add(x, xz[lane]);
        yz[lane] = all.mul_add(y, yz[lane]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Rectangle = Rectangle {
        x0: -0.5,
        x1: 0.5,
        y0: -0.5,
        y1: 0.5,
    };

    /// Integrals over the unit square, 12 digits: closed forms confirmed by polar quadrature.
    #[test]
    fn integrals_over_the_unit_square_have_their_known_values() {
        let known = [
            (0.0, 0.0, [1.762_747_174_039, 1.762_747_174_039, 0.0]),
            (1.0, 0.0, [0.937_072_872_213, 0.100_976_863_692, 0.0]),
            (
                1.0,
                1.0,
                [0.362_348_719_067, 0.362_348_719_067, 0.333_850_535_422],
            ),
            (5.0, 0.0, [0.199_658_209_165, 0.000_673_952_362, 0.0]),
            (
                5.0,
                5.0,
                [0.070_770_017_596, 0.070_770_017_596, 0.070_534_779_821],
            ),
        ];
        for (x, y, expected) in known {
            let found = by_corners(x, y, UNIT);
            for k in 0..3 {
                assert!(
                    (found[k] - expected[k]).abs() < 1e-12,
                    "({x}, {y}) {k}: {} {}",
                    found[k],
                    expected[k]
                );
            }
        }
    }

    #[test]
    fn quadrature_and_closed_form_meet_where_they_take_over() {
        for k in 0..12 {
            let angle = 0.1 + f64::from(k) * std::f64::consts::TAU / 12.0;
            let (x, y) = (1.01 * FAR * angle.cos(), 1.01 * FAR * angle.sin());
            let (near, far) = (by_corners(x, y, UNIT), by_quadrature(x, y, UNIT));
            for i in 0..3 {
                assert!(
                    (near[i] - far[i]).abs() < 2e-12 * far[0].hypot(far[1]),
                    "{near:?} {far:?}"
                );
            }
        }
    }

    #[test]
    fn far_away_a_rectangle_acts_like_a_point() {
        let found = rectangle(3000.0, 4000.0, UNIT, 0.25);
        let r = 5000.0_f64;
        let (cos, sin) = (0.6, 0.8);
        let point = combine(cos * cos / r, sin * sin / r, cos * sin / r, 0.25);
        assert!((found.xx / point.xx - 1.0).abs() < 1e-7);
        assert!((found.xy / point.xy - 1.0).abs() < 1e-7);
        assert!((found.yy / point.yy - 1.0).abs() < 1e-7);
        assert!((found.zz / point.zz - 1.0).abs() < 1e-7);
    }

    #[test]
    fn turning_the_rectangle_by_a_right_angle_swaps_x_and_y() {
        let cell = Rectangle {
            x0: -0.3,
            x1: 0.9,
            y0: 0.1,
            y1: 0.4,
        };
        let turned = Rectangle {
            x0: 0.1,
            x1: 0.4,
            y0: -0.3,
            y1: 0.9,
        };
        for (x, y) in [(0.2, 0.3), (0.9, 0.4), (-2.0, 1.0), (0.0, 0.0)] {
            let (a, b) = (rectangle(x, y, cell, 0.3), rectangle(y, x, turned, 0.3));
            assert!((a.xx - b.yy).abs() < 1e-14 && (a.yy - b.xx).abs() < 1e-14);
            assert!((a.xy - b.xy).abs() < 1e-14 && (a.zz - b.zz).abs() < 1e-14);
        }
    }
}

#[cfg(test)]
mod point_loads_tests {
    use super::*;

    #[test]
    fn a_point_feels_its_own_loads_alone() {
        let pack = |x: f32| LoadPack {
            at: [[x; LANES], [0.2; LANES]],
            force: [[0.1; LANES], [0.2; LANES], [1.0; LANES]],
        };
        let packs = [pack(0.0), pack(0.7), pack(-0.4)];
        let felt = |felt: &[Range<usize>]| stress(&packs, felt, [1.0, 0.3, 0.5], 0.3);
        let parts = [0..1, 1..3].map(|part| felt(&[part]));
        let sum = [0, 1, 2, 3, 4, 5].map(|k| parts[0][k] + parts[1][k]);
        for (all, sum) in felt(&[0..1, 1..3]).iter().zip(sum) {
            assert!((all - sum).abs() < 1e-6 * (1.0 + sum.abs()), "{all} {sum}");
        }
        assert_eq!(felt(&[0..1, 1..3]), felt(std::slice::from_ref(&(0..3))));
        assert_eq!(felt(&[]), [0.0; 6]);
    }
}
