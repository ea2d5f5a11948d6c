//! Evaluation of the table: creep forces, the share that sticks, and derivatives, for an ellipse and any creepage.

use pulp::{Simd, WithSimd};

use crate::numerics::simd;
use crate::rolling::linear_theory::coefficients_with_spin;
use crate::rolling::methods::table::spline::{
    Axis, DIRECTION_COEFFICIENTS, DIRECTIONS, OUTPUTS, POISSON_RATIOS, POLE_COEFFICIENTS, POLES,
    RATIOS, SIZE_STEPS, SIZES, Shape, Weights, cell, ln_ratio_max, sigma, spin_factor,
};

/// The size at which everything slips without spin: f(r) = 1 from there on (Vermeulen and Johnson 1964).
const SIZE_FULL: f64 = 3.0;

/// The table, ready to be evaluated.
#[derive(Debug)]
pub struct CreepTable {
    /// `[a/b][pole][direction][size][ν][function]`, in units of `unit`.
    spline: Vec<i16>,
    unit: [f32; OUTPUTS],
    ratio: Axis,
    pole: Axis,
    direction: Axis,
    size: Axis,
    /// Error bounds of the cells between nodes.
    bounds: Vec<f32>,
}

/// Creep forces of an ellipse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Creep {
    /// F_x/(μN), F_y/(μN), M_z/(μN√(ab)).
    pub force: [f64; 3],
    /// Share of the patch that sticks, 0 to 1.
    pub stick: f64,
    /// Bound of the errors of the three forces, which holds for 99 of 100 held-out motions.
    pub bound: f64,
}

/// The table for one ellipse and material.
#[derive(Debug, Clone, Copy)]
pub struct EllipseTable<'a> {
    table: &'a CreepTable,
    shape: Shape,
    /// C11, C22, C23, C33.
    kalker: [f64; 4],
    /// C11, C22 and h. The creepage multiplied by these has the length r.
    scale: [f64; 3],
    ln_ratio: f64,
    ratio: Weights,
    poisson: [f64; 3],
}

/// Step by which a creepage is moved for its derivatives, relative to the size of all creepages. It is well above the rounding of values; steps of 0.01 are
/// longer than the range of directions in which forces of long ellipses change.
const STEP: f64 = 1e-3;

/// f(r), the growth of the forces with the size.
#[inline(always)]
pub fn growth(size: f64) -> f64 {
    let rest = (1.0 - size / SIZE_FULL).max(0.0);
    1.0 - rest * rest * rest
}

/// The factor of the part of linear theory that is not in the table.
#[inline(always)]
pub fn linear_part(sigma: f64) -> f64 {
    (1.0 - sigma) * (1.0 - sigma)
}

/// Forces of linear theory with `[C11, C22, C23, C33]` for a creepage.
#[inline(always)]
pub fn linear([c11, c22, c23, c33]: [f64; 4], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [c11 * x, c22 * y + c23 * z, c33 * z - c23 * y]
}

impl CreepTable {
    /// The table with the coefficients of a spline, the unit of each function, and the error bounds of the cells between nodes. The functions are `F/f(r)` without
    /// the part of linear theory for forces and moment, and the share that sticks.
    pub fn new(spline: Vec<i16>, unit: [f32; OUTPUTS], bounds: Vec<f32>) -> CreepTable {
        let ratios: [u8; RATIOS] = std::array::from_fn(|k| k as u8);
        let ratio_step = 2.0 * ln_ratio_max() / (RATIOS - 1) as f64;
        let quarter = std::f64::consts::FRAC_PI_2;
        CreepTable {
            spline,
            unit,
            ratio: Axis::free(-ln_ratio_max(), ratio_step, &ratios),
            pole: Axis::mirrored(0.0..quarter, POLES),
            direction: Axis::mirrored(-quarter..quarter, DIRECTIONS),
            size: Axis::free(0.0, 1.0 / SIZE_STEPS, &SIZES),
            bounds,
        }
    }

    /// The table for an ellipse with a/b from 0.1 to 10 and Poisson's ratio from 0 to 0.5.
    pub fn ellipse(&self, ratio: f64, poisson_ratio: f64) -> EllipseTable<'_> {
        let ln_ratio = ratio.ln();
        let kalker = coefficients_with_spin(ratio, poisson_ratio);
        let [c11, c22, ..] = coefficients_with_spin(ratio, 0.25);
        let root = ratio.sqrt();
        EllipseTable {
            table: self,
            shape: Shape::new(root, [c11, c22]),
            scale: [
                kalker[0],
                kalker[1],
                spin_factor(root, [kalker[0], kalker[1]]),
            ],
            kalker,
            ln_ratio,
            ratio: self.ratio.at(ln_ratio),
            poisson: parabola(poisson_ratio),
        }
    }
}

/// Weights of the values at `POISSON_RATIOS` for a Poisson's ratio: a parabola.
#[inline(always)]
fn parabola(poisson_ratio: f64) -> [f64; 3] {
    let nu = 4.0 * poisson_ratio;
    [
        0.5 * (1.0 - nu) * (2.0 - nu),
        nu * (2.0 - nu),
        0.5 * nu * (nu - 1.0),
    ]
}

impl EllipseTable<'_> {
    /// Creep forces of the dimensionless creepages `G c²/(μN) (ν_x, ν_y, c φ)` with c = √(ab), at most μN.
    #[inline(always)]
    pub fn creep(&self, creepage: [f64; 3]) -> Creep {
        let mut creep = self.interpolated(creepage);
        let [x, y, _] = creep.force;
        let square = x * x + y * y;
        if square > 1.0 {
            let force = square.sqrt();
            (creep.force[0], creep.force[1]) = (x / force, y / force);
        }
        creep
    }

    /// The interpolated values without the limit: the force may exceed μN by the error of the table.
    #[inline(always)]
    pub(crate) fn interpolated(&self, creepage: [f64; 3]) -> Creep {
        let Quarter { inside, signs } = Quarter::of(creepage);
        let size = self.size(inside);
        if size == 0.0 {
            return Creep {
                force: [0.0; 3],
                stick: 1.0,
                bound: 0.0,
            };
        }
        let [theta, chi] = self.shape.angles(inside);
        let sigma = sigma(size);
        let sums = self.sums(sigma, theta, chi);
        let linear = linear(self.kalker, inside);
        let growth = growth(size);
        let part = linear_part(sigma) / size;
        // Components that vanish by symmetry are exactly 0.
        let [x, y, z] = inside.map(|part| part != 0.0);
        let there = [x, y || z, y || z];
        let force = |k: usize| signs[k] * growth * (sums[k] + part * linear[k]);
        Creep {
            force: [0, 1, 2].map(|k| if there[k] { force(k) } else { 0.0 }),
            stick: sums[3].clamp(0.0, 1.0),
            bound: f64::from(self.table.bounds[cell(self.ln_ratio, sigma, theta, chi)]),
        }
    }

    /// The derivatives of the three creep forces by the creepages, `[force][creepage]`, from central differences.
    pub fn slopes(&self, creepage: [f64; 3]) -> [[f64; 3]; 3] {
        // Forces are linear up to much larger sizes than the second.
        let length = STEP * self.size(creepage).max(STEP);
        let mut slopes = [[0.0; 3]; 3];
        for j in 0..3 {
            let step = length / self.scale[j];
            let moved = |by: f64| {
                let mut moved = creepage;
                moved[j] += by;
                self.interpolated(moved).force
            };
            let (back, ahead) = (moved(-step), moved(step));
            for k in 0..3 {
                slopes[k][j] = (ahead[k] - back[k]) / (2.0 * step);
            }
        }
        slopes
    }

    #[inline(always)]
    fn size(&self, creepage: [f64; 3]) -> f64 {
        let u = [0, 1, 2].map(|k| (self.scale[k] * creepage[k]).abs());
        let largest = u[0].max(u[1]).max(u[2]);
        if largest == 0.0 {
            return 0.0;
        }
        let [x, y, z] = u.map(|u| u / largest);
        largest * (x * x + y * y + z * z).sqrt()
    }

    /// The functions at a place, as sums of the spline over all axes.
    #[inline(always)]
    fn sums(&self, sigma: f64, theta: f64, chi: f64) -> [f64; OUTPUTS] {
        let table = self.table;
        let size = table.size.at(sigma);
        let near = NearNodes {
            ratio: self.ratio,
            pole: table.pole.at(theta),
            direction: table.direction.at(chi),
            size: size.first,
        };
        let rows = simd::dispatch(NearSums(&table.spline, near));
        let mut sums = [0.0; OUTPUTS];
        for (rows, weight) in rows.chunks_exact(SIZE_ROW).zip(size.weights) {
            for (rows, poisson) in rows.chunks_exact(OUTPUTS).zip(self.poisson) {
                for (sum, value) in sums.iter_mut().zip(rows) {
                    *sum += weight * poisson * f64::from(*value);
                }
            }
        }
        for (sum, unit) in sums.iter_mut().zip(table.unit) {
            *sum *= f64::from(unit);
        }
        sums
    }
}

/// A creepage mirrored to x, z ≥ 0, and the signs of its forces.
struct Quarter {
    inside: [f64; 3],
    signs: [f64; 3],
}

impl Quarter {
    #[inline(always)]
    fn of([x, y, z]: [f64; 3]) -> Quarter {
        // Without spin both signs are equivalent; the choice maps reversed creepages to the same place.
        let spin = if z < 0.0 || (z == 0.0 && y < 0.0) {
            -1.0
        } else {
            1.0
        };
        let along = if x < 0.0 { -1.0 } else { 1.0 };
        Quarter {
            inside: [x.abs(), spin * y, z.abs()],
            signs: [along, spin, spin],
        }
    }
}

/// Number of values of one size: Poisson's ratios, functions.
pub const SIZE_ROW: usize = POISSON_RATIOS.len() * OUTPUTS;
/// Number of values of the four sizes around a creepage.
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
    /// The values of four sizes at one a/b, pole and direction, of a spline `[a/b][pole][direction][size][number]`.
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

    /// The sums over a/b, poles and directions.
    #[inline(always)]
    fn sums(&self, spline: &[i16]) -> [f32; NEAR] {
        let mut sums = [0.0_f32; NEAR];
        for i in 0..4 {
            for j in 0..4 {
                let outer = self.ratio.weights[i] * self.pole.weights[j];
                for k in 0..4 {
                    let weight = (outer * self.direction.weights[k]) as f32;
                    let row = self.row(spline, [i, j, k]);
                    for n in 0..NEAR {
                        sums[n] += weight * f32::from(row[n]);
                    }
                }
            }
        }
        sums
    }
}

/// The sums of the table, compiled for each level of SIMD. The compiler would not inline a closure of this length.
pub struct NearSums<'a>(pub &'a [i16], pub NearNodes);

impl WithSimd for NearSums<'_> {
    type Output = [f32; NEAR];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f32; NEAR] {
        self.1.sums(self.0)
    }
}
