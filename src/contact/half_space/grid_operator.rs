//! Normal influence between equal rectangles on a regular grid, applied as a convolution by Fourier transforms along both axes. Single precision takes half the time
//! of double precision.

use std::sync::Arc;

use pulp::NullaryFnOnce;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use crate::numerics::simd;
use crate::numerics::simd::Float;

/// Normal displacement of both bodies together at the centres of `nx` by `ny` equal rectangles by uniform pressures on them.
///
/// With `E* = G/(1−ν)` the displacement is `1/(πE*) Σ p [[ q asinh(p/|q|) + p asinh(q/|p|) ]]` (Boussinesq; Love 1929), the coefficient `zz` of
/// [`rectangle`](crate::half_space::kernels::rectangle). Values are stored at `j * nx + i`, i along x. The product equals that of the dense matrix to about 1e-6 of the
/// largest displacement.
pub struct GridOperator {
    nx: usize,
    ny: usize,
    /// Displacement of a cell per unit of its own pressure.
    own: f64,
    /// Coefficients at a distance of i and j cells, i from `1 − nx` to `nx − 1` and j from 0, row by row.
    coefficients: Vec<f64>,
    /// Transform of the coefficients relative to `own`, divided by the padded sizes, wave by wave along x. It is real because the coefficients are even.
    factors: Vec<f32>,
    plans: GridPlans,
}

/// Transforms of a grid that is padded to twice its size: real along x, complex along y.
struct GridPlans {
    rows: [usize; 2],
    forward: Arc<dyn RealToComplex<f32>>,
    backward: Arc<dyn ComplexToReal<f32>>,
    across: [Arc<dyn Fft<f32>>; 2],
}

/// Plans and buffers for products with grids of any size. It carries no state from one product to the next.
pub struct GridWorkspace {
    along: RealFftPlanner<f32>,
    across: FftPlanner<f32>,
    row: Vec<f32>,
    /// Waves of one row.
    waves: Vec<Complex<f32>>,
    /// Waves of all rows, grouped by their wave along x.
    columns: Vec<Complex<f32>>,
    scratch: Vec<Complex<f32>>,
}

impl Default for GridWorkspace {
    fn default() -> Self {
        GridWorkspace {
            along: RealFftPlanner::new(),
            across: FftPlanner::new(),
            row: Vec::new(),
            waves: Vec::new(),
            columns: Vec::new(),
            scratch: Vec::new(),
        }
    }
}

impl GridWorkspace {
    fn plans(&mut self, nx: usize, ny: usize) -> GridPlans {
        let [width, height] = [nx, ny].map(|cells| smooth(2 * cells, true));
        GridPlans {
            rows: [width, height],
            forward: self.along.plan_fft_forward(width),
            backward: self.along.plan_fft_inverse(width),
            across: [
                self.across.plan_fft_forward(height),
                self.across.plan_fft_inverse(height),
            ],
        }
    }

    /// Transforms the rows that `fill` writes into a buffer of zeros; `fill` returns false for rows of zeros.
    fn forward(&mut self, plans: &GridPlans, mut fill: impl FnMut(usize, &mut [f32]) -> bool) {
        let [width, height] = plans.rows;
        let zero = Complex::default();
        self.row.resize(width, 0.0);
        self.waves.resize(width / 2 + 1, zero);
        self.columns.clear();
        self.columns.resize((width / 2 + 1) * height, zero);
        let scratch = [
            plans.forward.get_scratch_len(),
            plans.backward.get_scratch_len(),
            plans.across[0].get_inplace_scratch_len(),
            plans.across[1].get_inplace_scratch_len(),
        ];
        let most = scratch.into_iter().max().unwrap_or(0);
        self.scratch.resize(most.max(self.scratch.len()), zero);
        for j in 0..height {
            self.row.fill(0.0);
            if !fill(j, &mut self.row) {
                continue;
            }
            // The buffers have the lengths of the plans, so no transform can fail.
            let done = plans.forward.process_with_scratch(
                &mut self.row,
                &mut self.waves,
                &mut self.scratch[..plans.forward.get_scratch_len()],
            );
            debug_assert!(done.is_ok());
            for (column, wave) in self.columns.chunks_exact_mut(height).zip(&self.waves) {
                column[j] = *wave;
            }
        }
        plans.across[0].process_with_scratch(&mut self.columns, &mut self.scratch);
    }

    /// Transforms back and passes the first rows to `take`.
    fn backward(&mut self, plans: &GridPlans, rows: usize, mut take: impl FnMut(usize, &[f32])) {
        let [_, height] = plans.rows;
        plans.across[1].process_with_scratch(&mut self.columns, &mut self.scratch);
        for j in 0..rows {
            for (column, wave) in self.columns.chunks_exact(height).zip(&mut self.waves) {
                *wave = column[j];
            }
            // A real row has no imaginary parts here; rounding leaves some.
            self.waves[0].im = 0.0;
            let last = self.waves.len() - 1;
            self.waves[last].im = 0.0;
            let done = plans.backward.process_with_scratch(
                &mut self.waves,
                &mut self.row,
                &mut self.scratch[..plans.backward.get_scratch_len()],
            );
            debug_assert!(done.is_ok());
            take(j, &self.row);
        }
    }
}

impl GridOperator {
    /// Prepares the influence for rectangles of `dx` by `dy` mm and the contact modulus `E*` in MPa.
    pub fn new(
        [nx, ny]: [usize; 2],
        [dx, dy]: [f64; 2],
        contact_modulus: f64,
        workspace: &mut GridWorkspace,
    ) -> Self {
        let plans = workspace.plans(nx, ny);
        let coefficients = coefficients(nx, ny, dx, dy, contact_modulus);
        let [width, height] = plans.rows;
        let scale = 1.0 / (coefficients[0] * (width * height) as f64);
        workspace.forward(&plans, |j, row| {
            let distance = j.min(height - j);
            if distance >= ny {
                return false;
            }
            let own = &coefficients[distance * nx..(distance + 1) * nx];
            for (i, coefficient) in own.iter().enumerate() {
                row[i] = (scale * coefficient) as f32;
                row[(width - i) % width] = row[i];
            }
            true
        });
        GridOperator {
            nx,
            ny,
            own: coefficients[0],
            factors: workspace.columns.iter().map(|wave| wave.re).collect(),
            coefficients: lines(nx, &coefficients),
            plans,
        }
    }

    /// Displacement at the centre of a cell per unit of its own pressure, in mm/MPa.
    pub fn own(&self) -> f64 {
        self.own
    }

    /// Displacement in mm at every centre for pressures in MPa.
    pub fn apply(&self, pressure: &[f64], displacement: &mut [f64], workspace: &mut GridWorkspace) {
        let largest = pressure.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
        if largest == 0.0 {
            displacement.fill(0.0);
            return;
        }
        let (nx, up) = (self.nx, largest * self.own);
        workspace.forward(&self.plans, |j, row| {
            let Some(own) = pressure.get(j * nx..(j + 1) * nx) else {
                return false;
            };
            for (value, p) in row.iter_mut().zip(own) {
                *value = (p / largest) as f32;
            }
            own.iter().any(|p| *p != 0.0)
        });
        for (wave, factor) in workspace.columns.iter_mut().zip(&self.factors) {
            *wave *= *factor;
        }
        workspace.backward(&self.plans, self.ny, |j, row| {
            for (u, value) in displacement[j * nx..(j + 1) * nx].iter_mut().zip(row) {
                *u = up * f64::from(*value);
            }
        });
    }

    /// Adds the displacement in mm at every centre caused by additional pressures in MPa on some cells.
    pub fn add(&self, changes: &[(usize, f64)], displacement: &mut [f64]) {
        simd::dispatch(Addition {
            nx: self.nx,
            lines: &self.coefficients,
            changes,
            displacement,
        });
    }
}

/// See [`GridOperator::add`]; compiled for the instruction set of this machine.
struct Addition<'a> {
    nx: usize,
    lines: &'a [f64],
    changes: &'a [(usize, f64)],
    displacement: &'a mut [f64],
}

impl NullaryFnOnce for Addition<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let (nx, stride) = (self.nx, 2 * self.nx - 1);
        for (cell, pressure) in self.changes {
            let (i, j) = (cell % nx, cell / nx);
            for (row, values) in self.displacement.chunks_exact_mut(nx).enumerate() {
                let first = row.abs_diff(j) * stride + nx - 1 - i;
                for (u, coefficient) in values.iter_mut().zip(&self.lines[first..first + nx]) {
                    *u += pressure * coefficient;
                }
            }
        }
    }
}

/// The smallest number not below `n`, even if `even`, with no prime factor above 5, because transforms of such lengths are fast.
pub(crate) fn smooth(n: usize, even: bool) -> usize {
    let step = if even { 2 } else { 1 };
    let is_smooth = |n: &usize| {
        let mut n = *n;
        for factor in [2, 3, 5] {
            while n.is_multiple_of(factor) {
                n /= factor;
            }
        }
        n == 1
    };
    let mut lengths = (n.next_multiple_of(step).max(step)..).step_by(step);
    lengths.find(is_smooth).unwrap_or(n)
}

impl std::fmt::Debug for GridOperator {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("GridOperator")
            .field("nx", &self.nx)
            .field("ny", &self.ny)
            .finish_non_exhaustive()
    }
}

/// Displacement i cells along x and j cells along y away from a cell with unit pressure, stored at `j * nx + i`.
pub(crate) fn coefficients(
    nx: usize,
    ny: usize,
    dx: f64,
    dy: f64,
    contact_modulus: f64,
) -> Vec<f64> {
    let factor = 1.0 / (std::f64::consts::PI * contact_modulus);
    // Corners lie half a cell before and after the centres. Neighbouring cells share them, so each is evaluated once. The two corners of the first cell differ only in
    // sign.
    let places = |n: usize, d: f64| -> Vec<f64> { (0..n).map(|i| (i as f64 + 0.5) * d).collect() };
    let (x, y) = (places(nx, dx), places(ny, dy));
    let mut corners = vec![0.0; nx * ny];
    simd::dispatch(Corners {
        x: &x,
        y: &y,
        out: &mut corners,
    });
    let between = |line: &[f64], i: usize| {
        let before = if i == 0 { -line[0] } else { line[i - 1] };
        line[i] - before
    };
    let mut out = Vec::with_capacity(nx * ny);
    for j in 0..ny {
        let above = &corners[j * nx..(j + 1) * nx];
        let (below, sign) = if j == 0 {
            (above, -1.0)
        } else {
            (&corners[(j - 1) * nx..j * nx], 1.0)
        };
        out.extend((0..nx).map(|i| factor * (between(above, i) - sign * between(below, i))));
    }
    out
}

/// `p asinh(q/p) + q asinh(p/q)` at all pairs of two lists of positive lengths.
struct Corners<'a> {
    x: &'a [f64],
    y: &'a [f64],
    out: &'a mut [f64],
}

impl NullaryFnOnce for Corners<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (q, line) in self.y.iter().zip(self.out.chunks_exact_mut(self.x.len())) {
            for (p, corner) in self.x.iter().zip(line) {
                let r = (p * p + q * q).sqrt();
                *corner = p * Float::ln((q + r) / *p) + q * Float::ln((p + r) / *q);
            }
        }
    }
}

/// The coefficients and their mirror images for negative i, row by row.
pub(crate) fn lines(nx: usize, coefficients: &[f64]) -> Vec<f64> {
    let mut lines = Vec::with_capacity(coefficients.len() / nx * (2 * nx - 1));
    for row in coefficients.chunks_exact(nx) {
        lines.extend(row[1..].iter().rev());
        lines.extend_from_slice(row);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::half_space::kernels::{Rectangle, rectangle};

    /// Displacements by the closed form, cell by cell, for G = E*(1 − ν) = 1.
    fn dense(nx: usize, ny: usize, dx: f64, dy: f64, nu: f64, pressure: &[f64]) -> Vec<f64> {
        let cell = Rectangle {
            x0: -0.5 * dx,
            x1: 0.5 * dx,
            y0: -0.5 * dy,
            y1: 0.5 * dy,
        };
        let place = |k: usize| ((k % nx) as f64 * dx, (k / nx) as f64 * dy);
        (0..nx * ny)
            .map(|k| {
                let (x, y) = place(k);
                (0..nx * ny)
                    .map(|m| {
                        let (xm, ym) = place(m);
                        rectangle(x - xm, y - ym, cell, nu).zz * pressure[m]
                    })
                    .sum()
            })
            .collect()
    }

    #[test]
    fn the_product_is_that_of_the_dense_closed_form() {
        for (nx, ny, dx, dy) in [(1, 1, 0.3, 0.2), (7, 5, 0.3, 0.2), (16, 23, 0.11, 0.4)] {
            let nu = 0.28;
            let pressure: Vec<f64> = (0..nx * ny)
                .map(|k| ((k * 37 + 11) % 101) as f64 - 30.0)
                .collect();
            let expected = dense(nx, ny, dx, dy, nu, &pressure);
            let modulus = 1.0 / (1.0 - nu);
            let (cells, size) = ([nx, ny], [dx, dy]);
            // A workspace already used for products of another size.
            let mut workspace = GridWorkspace::default();
            let other = GridOperator::new([9, 40], [0.2, 0.1], modulus, &mut workspace);
            other.apply(&[1.0; 360], &mut [0.0; 360], &mut workspace);
            let operator = GridOperator::new(cells, size, modulus, &mut workspace);
            other.apply(&[1.0; 360], &mut [0.0; 360], &mut workspace);
            compare(&operator, &mut workspace, &pressure, &expected);
        }
    }

    fn compare(
        operator: &GridOperator,
        workspace: &mut GridWorkspace,
        pressure: &[f64],
        expected: &[f64],
    ) {
        let mut found = vec![f64::NAN; pressure.len()];
        let largest = expected.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
        // The first product must not affect the second.
        for _ in 0..2 {
            operator.apply(pressure, &mut found, workspace);
            for (a, b) in found.iter().zip(expected) {
                assert!((a - b).abs() < 2e-6 * largest, "{a} {b}");
            }
        }
        let mut summed = vec![0.0; pressure.len()];
        let changes: Vec<(usize, f64)> = pressure.iter().copied().enumerate().collect();
        operator.add(&changes, &mut summed);
        for (a, b) in summed.iter().zip(expected) {
            assert!((a - b).abs() < 1e-12 * largest, "{a} {b}");
        }
    }

    #[test]
    fn a_cell_acts_on_itself_as_the_closed_form_says() {
        let workspace = &mut GridWorkspace::default();
        let own = GridOperator::new([3, 2], [0.3, 0.2], 2.0, workspace).own();
        let cell = Rectangle {
            x0: -0.15,
            x1: 0.15,
            y0: -0.1,
            y1: 0.1,
        };
        assert!((own - 0.5 * rectangle(0.0, 0.0, cell, 0.0).zz).abs() < 1e-15);
    }

    #[test]
    fn any_size_of_pressures_is_multiplied_alike() {
        let pressure = [3.0, 0.0, 1.0, 2.0, 0.0, 5.0];
        let mut workspace = GridWorkspace::default();
        let operator = GridOperator::new([3, 2], [0.3, 0.2], 2.0, &mut workspace);
        let mut product = |size: f64| {
            let mut found = [f64::NAN; 6];
            let scaled = pressure.map(|p| size * p);
            operator.apply(&scaled, &mut found, &mut workspace);
            found.map(|u| u / size)
        };
        let plain = product(1.0);
        for size in [1e-200, 1e60, 1e200] {
            for (a, b) in product(size).iter().zip(plain) {
                assert!((a / b - 1.0).abs() < 1e-6, "{size}: {a} {b}");
            }
        }
        let mut none = [f64::NAN; 6];
        operator.apply(&[0.0; 6], &mut none, &mut workspace);
        assert_eq!(none, [0.0; 6]);
    }

    #[test]
    fn padded_sizes_are_even_and_smooth() {
        let sizes = [1, 2, 14, 62, 97, 101, 128].map(|n| smooth(n, true));
        assert_eq!(sizes, [2, 2, 16, 64, 100, 108, 128]);
    }
}
