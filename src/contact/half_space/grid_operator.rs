//! Normal influence between equal rectangles on a regular grid, applied as a padded convolution.

use pulp::{Arch, NullaryFnOnce};
use rustfft::Fft;
use rustfft::num_complex::Complex;

use crate::contact::half_space::grid_coefficients::{coefficients, lines};
use crate::contact::half_space::transforms::{FftFloat, FftPlanners, FftPlans};

/// Rows copied into the columns at a time, so that whole cache lines are written. Two rows are transformed as one: real and imaginary part.
const BLOCK: usize = 8;

/// Normal displacement at the centres of `nx` by `ny` equal rectangles caused by uniform pressures on them, both bodies
/// together.
///
/// With `E* = G/(1−ν)` the displacement is `1/(πE*) Σ p [[ q asinh(p/|q|) + p asinh(q/|p|) ]]` (Boussinesq; Love 1929),
/// the coefficient [`rectangle`](crate::contact::half_space::kernels::rectangle) calls `zz`. Values are stored at
/// `j * nx + i`, i along x. The grid is padded to twice its size, so that the product equals that of the dense matrix to about
/// 1e-14 (`f64`) or 1e-6 (`f32`) of the largest displacement.
pub struct GridOperator<T> {
    nx: usize,
    ny: usize,
    /// Padded length along x.
    width: usize,
    /// Padded length along y.
    height: usize,
    /// Displacement of a cell per unit of its own pressure.
    own: f64,
    /// Coefficients at a distance of i and j cells, i from `1 − nx` to `nx − 1` and j from 0, row by row.
    lines: Vec<f64>,
    /// Transform of the coefficients relative to `own`, divided by the size of the padded grid; column by column. It is real
    /// because the coefficients are even.
    spectrum: Vec<T>,
    plans: FftPlans<T>,
}

/// FftPlans and buffers for the products of one solve. It fits grids of any size and carries no state from one product to the next.
pub struct GridWorkspace<T: FftFloat> {
    planners: FftPlanners<T>,
    row: Vec<T>,
    /// The spectrum of a row.
    spectrum: Vec<Complex<T>>,
    /// Rows of a block, two and two.
    pairs: Vec<Complex<T>>,
    columns: Vec<Complex<T>>,
    scratch: Vec<Complex<T>>,
}

impl<T: FftFloat> Default for GridWorkspace<T> {
    fn default() -> Self {
        GridWorkspace {
            planners: FftPlanners::default(),
            row: Vec::new(),
            spectrum: Vec::new(),
            pairs: Vec::new(),
            columns: Vec::new(),
            scratch: Vec::new(),
        }
    }
}

impl<T: FftFloat> GridWorkspace<T> {
    /// Resizes the buffers for an operator.
    fn fit(&mut self, operator: &GridOperator<T>) {
        let (half, plans) = (operator.half(), &operator.plans);
        let scratch = [
            plans.forward.get_scratch_len(),
            plans.rows_forward.get_inplace_scratch_len(),
            plans.rows_backward.get_inplace_scratch_len(),
            plans.columns_forward.get_inplace_scratch_len(),
            plans.columns_backward.get_inplace_scratch_len(),
        ];
        let zero = Complex::new(T::zero(), T::zero());
        self.row.resize(operator.width, T::zero());
        self.spectrum.resize(half, zero);
        self.pairs.resize(operator.width * BLOCK / 2, zero);
        self.columns.resize(half * operator.height, zero);
        self.scratch
            .resize(scratch.into_iter().max().unwrap_or(0), zero);
    }
}

impl<T: FftFloat> GridOperator<T> {
    /// Prepares the influence for rectangles of `dx` by `dy` mm and the contact modulus `E*` in MPa.
    #[must_use]
    pub fn new(
        [nx, ny]: [usize; 2],
        [dx, dy]: [f64; 2],
        contact_modulus: f64,
        workspace: &mut GridWorkspace<T>,
    ) -> Self {
        let (width, height) = (smooth_even(2 * nx), smooth_even(2 * ny));
        let coefficients = coefficients(nx, ny, dx, dy, contact_modulus);
        let mut operator = GridOperator {
            nx,
            ny,
            width,
            height,
            own: coefficients[0],
            lines: lines(nx, &coefficients),
            spectrum: vec![T::zero(); (width / 2 + 1) * height],
            plans: workspace.planners.plans(width, height),
        };
        workspace.fit(&operator);
        operator.transform_coefficients(&coefficients, workspace);
        operator
    }

    /// Number of values in the spectrum of a row.
    fn half(&self) -> usize {
        self.width / 2 + 1
    }

    /// Displacement at the centre of a cell per unit of its own pressure, in mm/MPa.
    #[must_use]
    pub fn own(&self) -> f64 {
        self.own
    }

    /// Displacement in mm at every centre for pressures in MPa.
    pub fn apply(
        &self,
        pressure: &[f64],
        displacement: &mut [f64],
        workspace: &mut GridWorkspace<T>,
    ) {
        let nx = self.nx;
        let largest = pressure.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
        if largest == 0.0 {
            displacement.fill(0.0);
            return;
        }
        workspace.fit(self);
        // A pair of rows leaves twice its spectra.
        let (down, up) = (0.5 / largest, largest * self.own);
        let zero = Complex::new(T::zero(), T::zero());
        for (block, rows) in pressure.chunks(nx * BLOCK).enumerate() {
            let pairs = rows.chunks(2 * nx);
            for (pair, both) in workspace.pairs.chunks_exact_mut(self.width).zip(pairs) {
                let (one, other) = both.split_at(nx);
                for (to, from) in pair.iter_mut().zip(one) {
                    *to = Complex::new(T::of(from * down), T::zero());
                }
                for (to, from) in pair.iter_mut().zip(other) {
                    to.im = T::of(from * down);
                }
                pair[nx..].fill(zero);
            }
            self.store_pairs(block * BLOCK, rows.len() / nx, workspace);
        }
        self.clear_rows_from(self.ny, workspace);
        transform_columns(&*self.plans.columns_forward, workspace);
        for (value, factor) in workspace.columns.iter_mut().zip(&self.spectrum) {
            (value.re, value.im) = (value.re * *factor, value.im * *factor);
        }
        transform_columns(&*self.plans.columns_backward, workspace);
        for (block, rows) in displacement.chunks_mut(nx * BLOCK).enumerate() {
            self.fetch_pairs(block * BLOCK, rows.len() / nx, workspace);
            let pairs = rows.chunks_mut(2 * nx);
            for (both, pair) in pairs.zip(workspace.pairs.chunks_exact(self.width)) {
                let (one, other) = both.split_at_mut(nx);
                for (to, from) in one.iter_mut().zip(pair) {
                    *to = up * from.re.into();
                }
                for (to, from) in other.iter_mut().zip(pair) {
                    *to = up * from.im.into();
                }
            }
        }
    }

    /// Adds the displacement in mm at every centre caused by additional pressures in MPa on some cells.
    pub fn add(&self, changes: &[(usize, f64)], displacement: &mut [f64]) {
        Arch::new().dispatch(Addition {
            nx: self.nx,
            lines: &self.lines,
            changes,
            displacement,
        });
    }

    /// Transforms the pairs of a block of `count` rows, and stores the spectra of the rows as lines of the columns from `first` on.
    fn store_pairs(&self, first: usize, count: usize, workspace: &mut GridWorkspace<T>) {
        let GridWorkspace {
            pairs,
            columns,
            scratch,
            ..
        } = workspace;
        let pairs = &mut pairs[..count.div_ceil(2) * self.width];
        self.plans.rows_forward.process_with_scratch(pairs, scratch);
        for (i, column) in columns.chunks_exact_mut(self.height).enumerate() {
            let image = if i == 0 { 0 } else { self.width - i };
            let column = &mut column[first..first + count];
            for (pair, rows) in pairs.chunks_exact(self.width).zip(column.chunks_mut(2)) {
                // The even part belongs to the real row, the odd one to the imaginary row.
                let (here, there) = (pair[i], pair[image]);
                rows[0] = Complex::new(here.re + there.re, here.im - there.im);
                if let Some(other) = rows.get_mut(1) {
                    *other = Complex::new(here.im + there.im, there.re - here.re);
                }
            }
        }
    }

    /// The reverse of [`GridOperator::store_pairs`].
    fn fetch_pairs(&self, first: usize, count: usize, workspace: &mut GridWorkspace<T>) {
        let GridWorkspace {
            pairs,
            columns,
            scratch,
            ..
        } = workspace;
        let pairs = &mut pairs[..count.div_ceil(2) * self.width];
        for (i, column) in columns.chunks_exact(self.height).enumerate() {
            let column = &column[first..first + count];
            for (pair, rows) in pairs.chunks_exact_mut(self.width).zip(column.chunks(2)) {
                let zero = Complex::new(T::zero(), T::zero());
                let (one, other) = (rows[0], rows.get(1).copied().unwrap_or(zero));
                pair[i] = Complex::new(one.re - other.im, one.im + other.re);
                if i > 0 {
                    pair[self.width - i] = Complex::new(one.re + other.im, other.re - one.im);
                }
            }
        }
        self.plans
            .rows_backward
            .process_with_scratch(pairs, scratch);
    }

    fn clear_rows_from(&self, first: usize, workspace: &mut GridWorkspace<T>) {
        for column in workspace.columns.chunks_exact_mut(self.height) {
            column[first..].fill(Complex::new(T::zero(), T::zero()));
        }
    }

    /// Fills the spectrum; `coefficients[j * nx + i]` belongs to the distance of i and j cells.
    fn transform_coefficients(&mut self, coefficients: &[f64], workspace: &mut GridWorkspace<T>) {
        let (nx, ny, height) = (self.nx, self.ny, self.height);
        self.clear_rows_from(0, workspace);
        for j in 0..ny {
            workspace.row.fill(T::zero());
            for i in 0..nx {
                let value = T::of(coefficients[j * nx + i] / self.own);
                workspace.row[i] = value;
                if i > 0 {
                    workspace.row[self.width - i] = value;
                }
            }
            let GridWorkspace {
                row,
                spectrum,
                columns,
                scratch,
                ..
            } = &mut *workspace;
            let forward = &self.plans.forward;
            let done = forward.process_with_scratch(row, spectrum, scratch);
            debug_assert!(done.is_ok());
            for (column, value) in columns.chunks_exact_mut(self.height).zip(spectrum) {
                column[j] = *value;
            }
        }
        for column in workspace.columns.chunks_exact_mut(height) {
            for j in 1..ny {
                column[height - j] = column[j];
            }
        }
        transform_columns(&*self.plans.columns_forward, workspace);
        let scale = T::of(1.0 / (self.width * height) as f64);
        for (factor, value) in self.spectrum.iter_mut().zip(&workspace.columns) {
            *factor = scale * value.re;
        }
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

fn transform_columns<T: FftFloat>(plan: &dyn Fft<T>, workspace: &mut GridWorkspace<T>) {
    plan.process_with_scratch(&mut workspace.columns, &mut workspace.scratch);
}

/// The smallest even number not below `n` with no prime factor above 5, because transforms of such lengths are fast.
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

impl<T> std::fmt::Debug for GridOperator<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("GridOperator")
            .field("nx", &self.nx)
            .field("ny", &self.ny)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::half_space::kernels::{Rectangle, rectangle};

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
            let mut double = GridWorkspace::<f64>::default();
            let operator = GridOperator::new(cells, size, modulus, &mut double);
            compare(&operator, &mut double, &pressure, &expected, 1e-12);
            // A workspace already used for products of another size.
            let mut single = GridWorkspace::<f32>::default();
            let other = GridOperator::new([9, 40], [0.2, 0.1], modulus, &mut single);
            other.apply(&[1.0; 360], &mut [0.0; 360], &mut single);
            let operator = GridOperator::new(cells, size, modulus, &mut single);
            other.apply(&[1.0; 360], &mut [0.0; 360], &mut single);
            compare(&operator, &mut single, &pressure, &expected, 2e-6);
        }
    }

    fn compare<T: FftFloat>(
        operator: &GridOperator<T>,
        workspace: &mut GridWorkspace<T>,
        pressure: &[f64],
        expected: &[f64],
        allowed: f64,
    ) {
        let mut found = vec![f64::NAN; pressure.len()];
        let largest = expected.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
        // The first product must not affect the second.
        for _ in 0..2 {
            operator.apply(pressure, &mut found, workspace);
            for (a, b) in found.iter().zip(expected) {
                assert!((a - b).abs() < allowed * largest, "{a} {b}");
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
        let workspace = &mut GridWorkspace::<f32>::default();
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
        let mut workspace = GridWorkspace::<f32>::default();
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
        let sizes = [1, 2, 14, 62, 97, 101, 128].map(smooth_even);
        assert_eq!(sizes, [2, 2, 16, 64, 100, 108, 128]);
    }
}
