//! Normal influence between equal rectangles on a regular grid, applied as a padded convolution.

use std::sync::Arc;

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

/// Rows that are moved to the columns together, so that whole cache lines are used.
const BLOCK: usize = 8;

/// Normal displacement at the centres of `nx` by `ny` equal rectangles caused by uniform pressures on them, both bodies
/// together.
///
/// With `E* = G/(1−ν)` the displacement is `1/(πE*) Σ p [[ q asinh(p/|q|) + p asinh(q/|p|) ]]` (Boussinesq; Love 1929),
/// the coefficient [`rectangle`](crate::contact::influence::coefficients::rectangle) calls `zz`. Values are stored at
/// `j * nx + i`, i along x. The grid is padded to twice its size, so that the product is that of the dense matrix to
/// about 1e-14 of the largest displacement.
pub struct Convolution {
    nx: usize,
    ny: usize,
    /// Padded length along x.
    width: usize,
    /// Padded length along y.
    height: usize,
    /// Coefficient of a cell's own pressure.
    own: f64,
    /// Transform of the coefficients (real, as they are even), divided by the size of the padded grid; column by column.
    spectrum: Vec<f64>,
    forward: Arc<dyn RealToComplex<f64>>,
    backward: Arc<dyn ComplexToReal<f64>>,
    columns_forward: Arc<dyn Fft<f64>>,
    columns_backward: Arc<dyn Fft<f64>>,
    row: Vec<f64>,
    /// Spectra of a block of rows.
    spectra: Vec<Complex<f64>>,
    columns: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
}

impl Convolution {
    /// Prepares the influence for rectangles of `dx` by `dy` mm and the contact modulus `E*` in MPa.
    #[must_use]
    pub fn new(nx: usize, ny: usize, dx: f64, dy: f64, contact_modulus: f64) -> Convolution {
        let (width, height) = (smooth_even(2 * nx), smooth_even(2 * ny));
        let mut real = RealFftPlanner::new();
        let mut complex = FftPlanner::new();
        let forward = real.plan_fft_forward(width);
        let backward = real.plan_fft_inverse(width);
        let columns_forward = complex.plan_fft_forward(height);
        let columns_backward = complex.plan_fft_inverse(height);
        let scratch = [
            forward.get_scratch_len(),
            backward.get_scratch_len(),
            columns_forward.get_inplace_scratch_len(),
            columns_backward.get_inplace_scratch_len(),
        ];
        let zero = Complex::new(0.0, 0.0);
        let half = width / 2 + 1;
        let mut convolution = Convolution {
            nx,
            ny,
            width,
            height,
            own: 0.0,
            spectrum: vec![0.0; half * height],
            forward,
            backward,
            columns_forward,
            columns_backward,
            row: vec![0.0; width],
            spectra: vec![zero; half * BLOCK],
            columns: vec![zero; half * height],
            scratch: vec![zero; scratch.into_iter().max().unwrap_or(0)],
        };
        let coefficients = coefficients(nx, ny, dx, dy, contact_modulus);
        convolution.own = coefficients[0];
        convolution.transform_coefficients(&coefficients);
        convolution
    }

    /// Displacement at the centre of a cell per unit of its own pressure, in mm/MPa.
    #[must_use]
    pub fn own(&self) -> f64 {
        self.own
    }

    /// Displacement in mm at every centre for pressures in MPa.
    pub fn apply(&mut self, pressure: &[f64], displacement: &mut [f64]) {
        let nx = self.nx;
        for (block, rows) in pressure.chunks(nx * BLOCK).enumerate() {
            for (k, values) in rows.chunks_exact(nx).enumerate() {
                self.row[..nx].copy_from_slice(values);
                self.row[nx..].fill(0.0);
                self.transform_row(k);
            }
            self.store_rows(block * BLOCK, rows.len() / nx);
        }
        self.clear_rows_from(self.ny);
        self.transform_columns(&self.columns_forward.clone());
        for (value, factor) in self.columns.iter_mut().zip(&self.spectrum) {
            *value *= *factor;
        }
        self.transform_columns(&self.columns_backward.clone());
        for (block, rows) in displacement.chunks_mut(nx * BLOCK).enumerate() {
            self.fetch_rows(block * BLOCK, rows.len() / nx);
            for (k, values) in rows.chunks_exact_mut(nx).enumerate() {
                self.transform_row_back(k);
                values.copy_from_slice(&self.row[..nx]);
            }
        }
    }

    /// Transforms the row in work into spectrum `k` of the block.
    fn transform_row(&mut self, k: usize) {
        let half = self.width / 2 + 1;
        let spectrum = &mut self.spectra[k * half..(k + 1) * half];
        let done = self
            .forward
            .process_with_scratch(&mut self.row, spectrum, &mut self.scratch);
        debug_assert!(done.is_ok());
    }

    /// Transforms spectrum `k` of the block into the row in work.
    fn transform_row_back(&mut self, k: usize) {
        let half = self.width / 2 + 1;
        let spectrum = &mut self.spectra[k * half..(k + 1) * half];
        // The transform of real values has no imaginary part there, except for rounding.
        (spectrum[0].im, spectrum[half - 1].im) = (0.0, 0.0);
        let done = self
            .backward
            .process_with_scratch(spectrum, &mut self.row, &mut self.scratch);
        debug_assert!(done.is_ok());
    }

    /// Stores `count` spectra of the block as lines of the columns from `first` on.
    fn store_rows(&mut self, first: usize, count: usize) {
        let half = self.width / 2 + 1;
        for (i, column) in self.columns.chunks_exact_mut(self.height).enumerate() {
            for k in 0..count {
                column[first + k] = self.spectra[k * half + i];
            }
        }
    }

    /// The reverse of [`Convolution::store_rows`].
    fn fetch_rows(&mut self, first: usize, count: usize) {
        let half = self.width / 2 + 1;
        for (i, column) in self.columns.chunks_exact(self.height).enumerate() {
            for k in 0..count {
                self.spectra[k * half + i] = column[first + k];
            }
        }
    }

    fn clear_rows_from(&mut self, first: usize) {
        for column in self.columns.chunks_exact_mut(self.height) {
            column[first..].fill(Complex::new(0.0, 0.0));
        }
    }

    fn transform_columns(&mut self, plan: &Arc<dyn Fft<f64>>) {
        plan.process_with_scratch(&mut self.columns, &mut self.scratch);
    }

    /// Fills the spectrum; `coefficients[j * (nx + 1) + i]` belongs to the distance of i and j cells.
    fn transform_coefficients(&mut self, coefficients: &[f64]) {
        let (nx, ny, height) = (self.nx, self.ny, self.height);
        self.clear_rows_from(0);
        for j in 0..ny {
            self.row.fill(0.0);
            for i in 0..nx {
                let value = coefficients[j * nx + i];
                self.row[i] = value;
                if i > 0 {
                    self.row[self.width - i] = value;
                }
            }
            self.transform_row(0);
            self.store_rows(j, 1);
        }
        for column in self.columns.chunks_exact_mut(height) {
            for j in 1..ny {
                column[height - j] = column[j];
            }
        }
        self.transform_columns(&self.columns_forward.clone());
        let scale = 1.0 / (self.width * height) as f64;
        for (factor, value) in self.spectrum.iter_mut().zip(&self.columns) {
            *factor = scale * value.re;
        }
    }
}

/// Displacement at the distance of (i, j) cells from a cell with unit pressure, stored at `j * nx + i`.
fn coefficients(nx: usize, ny: usize, dx: f64, dy: f64, contact_modulus: f64) -> Vec<f64> {
    let factor = 1.0 / (std::f64::consts::PI * contact_modulus);
    // The corners lie half a cell before and after the centres; neighbouring cells share them.
    let corner = |p: f64, q: f64| p * (q / p.abs()).asinh() + q * (p / q.abs()).asinh();
    let at = |i: usize, d: f64| (i as f64 - 0.5) * d;
    let line = |j: usize| -> Vec<f64> { (0..=nx).map(|i| corner(at(i, dx), at(j, dy))).collect() };
    let mut out = Vec::with_capacity(nx * ny);
    let mut below = line(0);
    for j in 0..ny {
        let above = line(j + 1);
        out.extend(
            (0..nx).map(|i| factor * ((above[i + 1] - above[i]) - (below[i + 1] - below[i]))),
        );
        below = above;
    }
    out
}

/// The least even number from `n` on without prime factors beyond 5, for which transforms are fast.
fn smooth_even(n: usize) -> usize {
    let smooth = |mut n: usize| {
        for factor in [2, 3, 5] {
            while n.is_multiple_of(factor) {
                n /= factor;
            }
        }
        n == 1
    };
    let mut n = n.next_multiple_of(2).max(2);
    while !smooth(n) {
        n += 2;
    }
    n
}

impl std::fmt::Debug for Convolution {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("Convolution")
            .field("nx", &self.nx)
            .field("ny", &self.ny)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::influence::coefficients::{Rectangle, rectangle};

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
            let mut found = vec![f64::NAN; nx * ny];
            let mut convolution = Convolution::new(nx, ny, dx, dy, 1.0 / (1.0 - nu));
            // The second product must not see anything of the first.
            for _ in 0..2 {
                convolution.apply(&pressure, &mut found);
                let largest = expected.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
                for (a, b) in found.iter().zip(&expected) {
                    assert!((a - b).abs() < 1e-12 * largest, "{nx} x {ny}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn a_cell_acts_on_itself_as_the_closed_form_says() {
        let own = Convolution::new(3, 2, 0.3, 0.2, 2.0).own();
        let cell = Rectangle {
            x0: -0.15,
            x1: 0.15,
            y0: -0.1,
            y1: 0.1,
        };
        assert!((own - 0.5 * rectangle(0.0, 0.0, cell, 0.0).zz).abs() < 1e-15);
    }

    #[test]
    fn padded_sizes_are_even_and_smooth() {
        let sizes = [1, 2, 14, 62, 97, 101, 128].map(smooth_even);
        assert_eq!(sizes, [2, 2, 16, 64, 100, 108, 128]);
    }
}
