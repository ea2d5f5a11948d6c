//! Surface displacement caused by a uniformly loaded rectangle: closed forms, one point at a time.
//!
//! This is the slow reference implementation; [`strips`](crate::contact::half_space::strip_operator::operator) evaluates the same forms in bulk.

use crate::contact::numerics::quadrature::FOUR_POINTS;

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

/// Relative displacement of the two surfaces (both bodies together) per unit uniform load, times G.
///
/// Lengths enter and leave in one unit; with lengths in mm, dividing by G in MPa gives mm per MPa.
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

/// Distance, in units of the rectangle's longer side, beyond which the four corner terms cancel so much that quadrature is
/// more accurate.
const FAR: f64 = 40.0;

/// Influence of a rectangle at the point `(x, y)` for Poisson's ratio `nu`.
///
/// With `p = x − x_edge`, `q = y − y_edge`, `r = √(p² + q²)` and the alternating sum over the four corners:
/// `∬X²/r³ = [[q asinh(p/|q|)]]`, `∬Y²/r³ = [[p asinh(q/|p|)]]`, `∬XY/r³ = −[[r]]`; then
/// `xx = (∬X²/r³ + (1−ν)∬Y²/r³ … )/π` as in Cerruti's and Boussinesq's solutions (Johnson 1985, §3.2 and 3.6; Kalker
/// 1990), with the factor 2 for two bodies. Terms are 0 where their leading factor is 0, so points on edges and
/// corners are allowed. The error is about 1e-14 of the largest coefficient near the rectangle; far away a 4×4 Gauss
/// rule keeps the relative error below 1e-12 where the closed form would lose digits.
#[must_use]
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
