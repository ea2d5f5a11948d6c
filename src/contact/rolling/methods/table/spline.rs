//! The nodes of the table, the axes of its spline, and the coordinates in which creep forces are smooth: the size of the creepage, the place of the spin
//! pole, and the direction.
//!
//! Creepages are dimensionless: `x = G c² ν_x/(μN)`, `y = G c² ν_y/(μN)`, `z = G c³ φ/(μN)` with c = √(ab), for x, z ≥ 0. With Kalker's coefficients C11 and C22,
//! `u = (C11 x, C22 y, h z)` with `h = ½ √(C22² a/b + C11² b/a)` has the size `r = |u|`, about 3 at full slip without spin. The direction has two angles,
//!
//! `u ∝ (cos θ √(m² cos² θ + α² sin² θ) cos χ, cos θ √(m² cos² θ + β² sin² θ) sin χ, sin θ)`,
//!
//! with `α = C11/(h √(a/b))`, `β = C22 √(a/b)/h`, `m = (α + β)/2`, all for ν = 1/4, because full slip is kinematic and does not depend on ν at given angles. Lines
//! of constant θ are ellipses of the pole: of the shape of the patch near its centre (θ → π/2), and circles in u far away (θ → 0). At θ = π/4 the pole is near the
//! edge. The map continues smoothly to θ < 0, which reverses z, and beyond π/2.

use std::f64::consts::{FRAC_PI_2, LN_10, PI};
use std::ops::Range;

/// Number of functions in the table: F_x, F_y, M_z and the share that sticks.
pub const OUTPUTS: usize = 4;
/// Number of coefficients in the pole: one more beyond each end.
pub const POLE_COEFFICIENTS: usize = POLES + 2;
/// Number of coefficients in the direction: one more beyond each end.
pub const DIRECTION_COEFFICIENTS: usize = DIRECTIONS + 2;
/// Number of values of one a/b, pole and direction: sizes, Poisson's ratios, functions.
pub const ROW: usize = SIZES.len() * POISSON_RATIOS.len() * OUTPUTS;
/// Number of nodes in ln(a/b), uniform from 1/10 to 10.
pub const RATIOS: usize = 10;
/// Nodes in Poisson's ratio, between which values are parabolas.
pub const POISSON_RATIOS: [f64; 3] = [0.0, 0.25, 0.5];
/// Number of nodes in the place of the spin pole, uniform from no spin (θ = 0) to spin alone (θ = π/2).
pub const POLES: usize = 18;
/// Number of nodes in the direction, uniform from χ = −π/2 to π/2, where χ = 0 is creepage along rolling.
pub const DIRECTIONS: usize = 21;
/// Nodes in the size, in 48ths of σ. They are closest where the last of the patch begins to slip, with one near full slip, which is approached slowly while the
/// spin pole is within the patch.
pub const SIZES: [u8; 22] = [
    0, 5, 10, 15, 19, 21, 22, 23, 24, 25, 26, 27, 28, 30, 32, 34, 36, 38, 40, 44, 46, 48,
];
/// Unit of [`SIZES`] over σ.
pub const SIZE_STEPS: f64 = 48.0;
/// The size of the creepage at σ = 1/2.
pub const SIZE_HALF: f64 = 1.5;

/// The largest ln(a/b).
pub fn ln_ratio_max() -> f64 {
    LN_10
}

/// a/b of a node.
pub fn ratio(node: usize) -> f64 {
    (LN_10 * (2.0 * node as f64 / (RATIOS - 1) as f64 - 1.0)).exp()
}

/// θ of a node.
pub fn pole(node: usize) -> f64 {
    FRAC_PI_2 * node as f64 / (POLES - 1) as f64
}

/// χ of a node.
pub fn direction(node: usize) -> f64 {
    PI * node as f64 / (DIRECTIONS - 1) as f64 - FRAC_PI_2
}

/// σ = r/(r + 3/2) of a size r, 0 to 1.
pub fn sigma(size: f64) -> f64 {
    // This form is also correct for the sizes 0 and infinity.
    1.0 / (1.0 + SIZE_HALF / size)
}

/// The size r of a σ below 1.
pub fn size(sigma: f64) -> f64 {
    SIZE_HALF * sigma / (1.0 - sigma)
}

/// Number of cells between nodes in a/b, pole, direction and size.
pub const CELLS: usize = (RATIOS - 1) * (POLES - 1) * (DIRECTIONS - 1) * (SIZES.len() - 1);

/// The last node at or before each 48th of σ.
const SIZE_CELL: [u8; SIZE_STEPS as usize] = {
    let mut cells = [0; SIZE_STEPS as usize];
    let mut node = 0;
    let mut step = 0;
    while step < cells.len() {
        if SIZES[node + 1] as usize <= step {
            node += 1;
        }
        cells[step] = node as u8;
        step += 1;
    }
    cells
};

/// The number of the cell that contains a place, `[a/b][pole][direction][size]`, clamped to the ends.
#[inline(always)]
pub fn cell(ln_ratio: f64, sigma: f64, theta: f64, chi: f64) -> usize {
    let bin = |part: f64, bins: usize| ((part * bins as f64).max(0.0) as usize).min(bins - 1);
    let ratio = bin(0.5 * (ln_ratio / LN_10 + 1.0), RATIOS - 1);
    let pole = bin(theta / FRAC_PI_2, POLES - 1);
    let direction = bin(chi / PI + 0.5, DIRECTIONS - 1);
    let size = usize::from(SIZE_CELL[bin(sigma, SIZE_CELL.len())]);
    ((ratio * (POLES - 1) + pole) * (DIRECTIONS - 1) + direction) * (SIZES.len() - 1) + size
}

/// A cubic spline on an axis: polynomials of four coefficients in each bin.
#[derive(Debug, Clone)]
pub struct Axis {
    low: f64,
    bins_per_unit: f64,
    /// The first coefficient of each bin.
    first: Vec<usize>,
    /// The polynomials of the four coefficients in each bin, by powers of the place in the bin.
    pieces: Vec<[[f64; 4]; 4]>,
}

/// The coefficients at a place: the first of four, and their weights.
#[derive(Debug, Clone, Copy)]
pub struct Weights {
    /// The first of four coefficients.
    pub first: usize,
    /// Weights of the four.
    pub weights: [f64; 4],
}

impl Axis {
    /// An axis of uniform nodes with one more coefficient before the first node and one after the last.
    pub fn mirrored(ends: Range<f64>, nodes: usize) -> Axis {
        let piece = [
            [1.0, -3.0, 3.0, -1.0],
            [4.0, 0.0, -6.0, 3.0],
            [1.0, 3.0, 3.0, -3.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
        .map(|weights| weights.map(|w| w / 6.0));
        Axis {
            low: ends.start,
            bins_per_unit: (nodes - 1) as f64 / (ends.end - ends.start),
            first: (0..nodes - 1).collect(),
            pieces: vec![piece; nodes - 1],
        }
    }

    /// An axis with nodes at the multiples `places` of `step`, the first of which is 0. The second node and the last but one are no knots, so there are as many
    /// coefficients as nodes.
    pub fn free(low: f64, step: f64, places: &[u8]) -> Axis {
        let knots = knots(places);
        let bins = usize::from(places[places.len() - 1]);
        let mut axis = Axis {
            low,
            bins_per_unit: 1.0 / step,
            first: Vec::new(),
            pieces: Vec::new(),
        };
        for bin in 0..bins {
            let start = bin as f64;
            let first = knots[4..knots.len() - 4].partition_point(|knot| *knot <= start);
            let samples = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0];
            let piece = std::array::from_fn(|k| {
                cubic_through(samples.map(|s| basis(&knots, first + k, first + 3, start + s)))
            });
            axis.first.push(first);
            axis.pieces.push(piece);
        }
        axis
    }

    /// The weights at a place, clamped to the ends.
    #[inline(always)]
    pub fn at(&self, place: f64) -> Weights {
        let last = self.first.len() - 1;
        let along = ((place - self.low) * self.bins_per_unit).clamp(0.0, (last + 1) as f64);
        let bin = (along as usize).min(last);
        let t = along - bin as f64;
        let piece = &self.pieces[bin];
        let weight = |p: &[f64; 4]| p[0] + t * (p[1] + t * (p[2] + t * p[3]));
        Weights {
            first: self.first[bin],
            weights: [
                weight(&piece[0]),
                weight(&piece[1]),
                weight(&piece[2]),
                weight(&piece[3]),
            ],
        }
    }
}

/// Knots of a cubic spline through the places, without the second and the last but one.
fn knots(places: &[u8]) -> Vec<f64> {
    let at = |k: usize| f64::from(places[k]);
    let last = places.len() - 1;
    let inner = (2..last - 1).map(at);
    [at(0); 4]
        .into_iter()
        .chain(inner)
        .chain([at(last); 4])
        .collect()
}

/// The `k`-th cubic B-spline at `x`, by the piece between knots `interval` and the next (de Boor 1978).
fn basis(knots: &[f64], k: usize, interval: usize, x: f64) -> f64 {
    fn part(knots: &[f64], k: usize, degree: usize, interval: usize, x: f64) -> f64 {
        if degree == 0 {
            return if k == interval { 1.0 } else { 0.0 };
        }
        let share = |from: f64, to: f64, rise: f64, below: f64| {
            if to > from {
                rise / (to - from) * below
            } else {
                0.0
            }
        };
        let (left, right) = (knots[k], knots[k + degree + 1]);
        share(
            left,
            knots[k + degree],
            x - left,
            part(knots, k, degree - 1, interval, x),
        ) + share(
            knots[k + 1],
            right,
            right - x,
            part(knots, k + 1, degree - 1, interval, x),
        )
    }
    part(knots, k, 3, interval, x)
}

/// The powers of the cubic with these values at 0, 1/3, 2/3 and 1.
fn cubic_through(v: [f64; 4]) -> [f64; 4] {
    let [a, b, c, d] = v;
    [
        a,
        -5.5 * a + 9.0 * b - 4.5 * c + d,
        9.0 * a - 22.5 * b + 18.0 * c - 4.5 * d,
        -4.5 * a + 13.5 * b - 13.5 * c + 4.5 * d,
    ]
}

/// The properties of the shape of an ellipse that determine the coordinates.
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
pub fn spin_factor(root: f64, [c11, c22]: [f64; 2]) -> f64 {
    let (x, y) = (c22 * root, c11 / root);
    0.5 * (x * x + y * y).sqrt()
}

/// Number of steps of the search for θ, each of third order. With 3 angles are accurate to 3e-9, with 4 to rounding (`angles_of_a_creepage`). The number is fixed,
/// because the start is always close and rows are evaluated by the million.
const STEPS: usize = 4;
/// Squares of creepages relative to that of the spin up to which the pole is at the centre. θ then differs from a right angle by about the square root of this.
const SPIN_ALONE: f64 = 1e-20;

impl Shape {
    /// The shape with √(a/b) and `[C11, C22]` at ν = 1/4.
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

    /// A creepage (x, y, z) with the angles θ and χ, of arbitrary size.
    pub fn creepage(&self, theta: f64, chi: f64) -> [f64; 3] {
        let [alpha, beta, m] = self.squares;
        let (sin, cos) = theta.sin_cos();
        let [a, b] = [alpha, beta].map(|s| cos * (m * cos * cos + s * sin * sin).sqrt());
        let u = [a * chi.cos(), b * chi.sin(), sin];
        [0, 1, 2].map(|k| u[k] / self.scale[k])
    }

    /// A creepage with the size r and the angles θ and χ, for `[C11, C22]` of the material.
    pub fn creepage_of_size(&self, size: f64, theta: f64, chi: f64, c: [f64; 2]) -> [f64; 3] {
        let direction = self.creepage(theta, chi);
        let factor = size / self.size(direction, c);
        direction.map(|part| factor * part)
    }

    /// The size r of a creepage, for `[C11, C22]` of the material.
    pub fn size(&self, [x, y, z]: [f64; 3], c: [f64; 2]) -> f64 {
        let h = spin_factor(self.root, c);
        (c[0] * x).hypot(c[1] * y).hypot(h * z)
    }

    /// The angles `[θ, χ]` of a creepage other than 0 with x, z ≥ 0.
    #[inline(always)]
    pub fn angles(&self, creepage: [f64; 3]) -> [f64; 2] {
        let u = [0, 1, 2].map(|k| creepage[k] * self.scale[k]);
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
mod coordinates_tests {
    use super::*;
    use crate::rolling::linear_theory::coefficients;

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
