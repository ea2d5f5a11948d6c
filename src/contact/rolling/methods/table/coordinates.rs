//! Coordinates in which creep forces are smooth: size of the creepage, place of the spin pole, direction.
//!
//! Creepages are dimensionless: `x = G c² ν_x/(μN)`, `y = G c² ν_y/(μN)`, `z = G c³ φ/(μN)` with c = √(ab), for x, z ≥ 0. With Kalker's
//! coefficients C11 and C22, `u = (C11 x, C22 y, h z)` with `h = ½ √(C22² a/b + C11² b/a)` has the size `r = |u|`, about 3 at full slip
//! without spin. The direction is given by two angles,
//!
//! `u ∝ (cos θ √(m² cos² θ + α² sin² θ) cos χ, cos θ √(m² cos² θ + β² sin² θ) sin χ, sin θ)`,
//!
//! with `α = C11/(h √(a/b))`, `β = C22 √(a/b)/h`, `m = (α + β)/2`, all of ν = 1/4: full slip is kinematics and does not depend on ν at
//! given angles. Lines of constant θ are ellipses of the pole: of the shape of the patch near its centre (θ → π/2), circles in u far
//! away (θ → 0); at θ = π/4 the pole is near the edge. The map continues smoothly to θ < 0, which turns z, and beyond π/2.

use std::f64::consts::FRAC_PI_2;

/// The shape of an ellipse as far as it decides on coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// √(a/b).
    root: f64,
    /// C11, C22 and h of ν = 1/4.
    scale: [f64; 3],
    /// α², β², m².
    squares: [f64; 3],
}

/// h of a shape: the factor of the spin in the size of a creepage.
#[must_use]
pub fn spin_factor(root: f64, [c11, c22]: [f64; 2]) -> f64 {
    let (x, y) = (c22 * root, c11 / root);
    0.5 * (x * x + y * y).sqrt()
}

/// Steps of the search for θ, each of third order. With 3 angles are right to 3e-9, with 4 to rounding (`angles_of_a_creepage`).
/// Always as many, without a test in between as the common root finders make: the start is never far off, and rows are evaluated by the million.
const STEPS: usize = 4;
/// Squares of creepages beside spin of this size, relative to its square, turn θ by less than 1e-9: θ differs
/// from a right angle by about the square root of this.
const SPIN_ALONE: f64 = 1e-20;
/// Where derivatives at spin alone are taken: creepages of this part of the spin, by size.
const BESIDE_SPIN: f64 = 1e-3;

impl Shape {
    /// The shape with √(a/b) and `[C11, C22]` at ν = 1/4.
    #[must_use]
    pub fn new(root: f64, [c11, c22]: [f64; 2]) -> Shape {
        let h = spin_factor(root, [c11, c22]);
        let (alpha, beta) = (c11 / (root * h), c22 * root / h);
        let m = 0.5 * (alpha + beta);
        Shape {
            root,
            scale: [c11, c22, h],
            squares: [alpha * alpha, beta * beta, m * m],
        }
    }

    /// A creepage (x, y, z) of the angles θ and χ, of any size.
    #[must_use]
    pub fn creepage(&self, theta: f64, chi: f64) -> [f64; 3] {
        let [alpha, beta, m] = self.squares;
        let (sin, cos) = theta.sin_cos();
        let [a, b] = [alpha, beta].map(|s| cos * (m * cos * cos + s * sin * sin).sqrt());
        let u = [a * chi.cos(), b * chi.sin(), sin];
        [0, 1, 2].map(|k| u[k] / self.scale[k])
    }

    /// The same of the size r with `[C11, C22]` of the material.
    #[must_use]
    pub fn creepage_of_size(&self, size: f64, theta: f64, chi: f64, c: [f64; 2]) -> [f64; 3] {
        let direction = self.creepage(theta, chi);
        let factor = size / self.size(direction, c);
        direction.map(|part| factor * part)
    }

    /// The size r of a creepage with `[C11, C22]` of the material.
    #[must_use]
    pub fn size(&self, [x, y, z]: [f64; 3], c: [f64; 2]) -> f64 {
        let h = spin_factor(self.root, c);
        (c[0] * x).hypot(c[1] * y).hypot(h * z)
    }

    /// The angles `[θ, χ]` of a creepage other than 0 with x, z ≥ 0.
    #[must_use]
    #[inline(always)]
    pub fn angles(&self, creepage: [f64; 3]) -> [f64; 2] {
        self.angles_of(self.stretched(creepage))
    }

    /// The angles with their derivatives by x, y and z. At spin alone, where the direction has no derivative, a creepage beside it stands
    /// for it.
    #[must_use]
    pub fn angles_with_slopes(&self, creepage: [f64; 3]) -> ([f64; 2], [[f64; 3]; 2]) {
        let whole = self.stretched(creepage);
        let share = 1.0 / whole[0].abs().max(whole[1].abs()).max(whole[2].abs());
        let mut u = whole.map(|u| share * u);
        let scale = self.scale.map(|scale| share * scale);
        let [alpha, beta, m] = self.squares;
        let least = BESIDE_SPIN * u[2];
        let flat = u[0].hypot(u[1]);
        if flat < least {
            let share = least / flat;
            [u[0], u[1]] = match flat > 0.0 {
                true => [share * u[0], share * u[1]],
                false => [least, 0.0],
            };
        }
        let [p, q] = [u[0] * u[0], u[1] * u[1]];
        let angles = self.angles_of(u);
        let root = angles[0].tan();
        let t = root * root;
        let (da, db) = (1.0 / (m + alpha * t), 1.0 / (m + beta * t));
        let sum = p * da + q * db;
        let slope =
            (1.0 + 2.0 * t) * sum - t * (1.0 + t) * (p * alpha * da * da + q * beta * db * db);
        // θ = atan √t; t by the squares of u, divided by 2 √t (1 + t).
        let theta = [
            -root * u[0] * da / slope,
            -root * u[1] * db / slope,
            sum.sqrt() / ((1.0 + t).sqrt() * slope),
        ];
        // tan χ = u_y √(m² + α² t)/(u_x √(m² + β² t)); dt = 2 √t (1 + t) dθ.
        let [cos, sin] = [u[0] * da.sqrt(), u[1] * db.sqrt()];
        let turn = cos * sin * (alpha * da - beta * db) / sum * root * (1.0 + t);
        let own = [-sin * da.sqrt() / sum, cos * db.sqrt() / sum, 0.0];
        let chi = [0, 1, 2].map(|k| (own[k] + turn * theta[k]) * scale[k]);
        (angles, [[0, 1, 2].map(|k| theta[k] * scale[k]), chi])
    }

    fn stretched(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        [x * self.scale[0], y * self.scale[1], z * self.scale[2]]
    }

    #[inline(always)]
    fn angles_of(&self, u: [f64; 3]) -> [f64; 2] {
        // Squares of creepages far from 1 would leave the range of numbers.
        let share = 1.0 / u[0].abs().max(u[1].abs()).max(u[2].abs());
        let u = u.map(|u| share * u);
        let [p, q, s] = u.map(|u| u * u);
        let [alpha, beta, m] = self.squares;
        if p + q <= SPIN_ALONE {
            return [FRAC_PI_2, (u[1] * alpha.sqrt()).atan2(u[0] * beta.sqrt())];
        }
        // t = tan² θ solves t (1 + t) (p/(m² + α² t) + q/(m² + β² t)) = s, linear for small and for large t: a quotient of a cubic and a
        // parabola.
        let (cubic, square) = (p * beta + q * alpha, alpha * beta);
        let (linear, middle) = ((p + q) * m, (alpha + beta) * m);
        let near = m * s / (p + q);
        let far = s * square / cubic;
        let mut t = (near + far * far) / (1.0 + far);
        for _ in 0..STEPS {
            // Halley's step for the quotient less s, without its divisions.
            let below = [
                (m + alpha * t) * (m + beta * t),
                middle + 2.0 * square * t,
                2.0 * square,
            ];
            let above = [
                t * (1.0 + t) * (linear + cubic * t) - s * below[0],
                linear + t * (2.0 * (linear + cubic) + 3.0 * cubic * t) - s * below[1],
                2.0 * (linear + cubic) + 6.0 * cubic * t - s * below[2],
            ];
            let slope = above[1] * below[0] - above[0] * below[1];
            let bend =
                (above[2] * below[0] - above[0] * below[2]) * below[0] - 2.0 * below[1] * slope;
            let step = 2.0 * above[0] * slope * below[0] / (2.0 * slope * slope - above[0] * bend);
            t = (t - step).max(0.0);
        }
        let theta = t.sqrt().atan();
        let chi = (u[1] * (m + alpha * t).sqrt()).atan2(u[0] * (m + beta * t).sqrt());
        [theta, chi]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::rolling::linear_theory::coefficients;

    #[test]
    fn angles_of_a_creepage_are_those_it_was_made_of() {
        let mut worst = 0.0_f64;
        for k in 0..=20 {
            let ratio = 10.0_f64.powf(f64::from(k) / 10.0 - 1.0);
            let [c11, c22, _] = coefficients(ratio, 0.25);
            let shape = Shape::new(ratio.sqrt(), [c11, c22]);
            for i in 0..=60 {
                for j in 0..=40 {
                    let theta = 0.9999 * FRAC_PI_2 * f64::from(i) / 60.0;
                    let chi = 2.0 * FRAC_PI_2 * (f64::from(j) / 40.0 - 0.5);
                    let found = shape.angles(shape.creepage(theta, chi));
                    worst = worst
                        .max((found[0] - theta).abs())
                        .max((found[1] - chi).abs());
                }
            }
        }
        assert!(worst < 1e-9, "{worst}");
    }

    #[test]
    fn a_creepage_beside_much_spin_turns_the_direction_and_not_the_pole() {
        let shape = Shape::new(1.2, [4.0, 3.5]);
        for beside in [1e-160, 1e-100, 1e-12, 1e-9] {
            // Direction as of a creepage that is a millionth of the spin, the pole at the centre.
            let [_, known] = shape.angles([1e-6, 2e-6, 1.0]);
            let [theta, chi] = shape.angles([beside, 2.0 * beside, 1.0]);
            assert!((theta - FRAC_PI_2).abs() < 1e-8, "{beside}: {theta}");
            assert!((chi - known).abs() < 1e-9, "{beside}: {chi} {known}");
        }
        assert_eq!(shape.angles([0.0, 0.0, 1.0]), [FRAC_PI_2, 0.0]);
    }
}
