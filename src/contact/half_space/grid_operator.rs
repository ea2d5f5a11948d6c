//! Normal influence between equal rectangles on a regular grid, applied as a convolution: by transforms along the longer axis, where the
//! grid is padded, and as plain sums along the shorter one.

use pulp::NullaryFnOnce;
use rustfft::num_complex::Complex;

use crate::contact::half_space::line_sums::{LineSums, Spectra};
use crate::contact::half_space::transforms::{FftFloat, FftPlanners, FftPlans};
use crate::contact::numerics::simd;
use crate::contact::numerics::simd::Float;

/// Normal displacement at the centres of `nx` by `ny` equal rectangles caused by uniform pressures on them, both bodies
/// together.
///
/// With `E* = G/(1−ν)` the displacement is `1/(πE*) Σ p [[ q asinh(p/|q|) + p asinh(q/|p|) ]]` (Boussinesq; Love 1929),
/// the coefficient [`rectangle`](crate::contact::half_space::kernels::rectangle) calls `zz`. Values are stored at
/// `j * nx + i`, i along x. The product equals that of the dense matrix to about 1e-14 (`f64`) or 1e-6 (`f32`) of the largest displacement.
///
/// Lines along the longer axis are padded to twice their length and transformed, two as the real and the imaginary part of one. Between the
/// lines each wave is summed by itself. In place of transforms along both axes this takes 2 % off a row with one patch, on 31 × 31 cells, and
/// 12 % off one with two, on 31 × 150 (`cargo bench --bench wheels -- rows 1000`).
pub struct GridOperator<T> {
    nx: usize,
    ny: usize,
    /// Lines along the longer axis: how many, of how many cells, and where their cells are stored.
    lines: GridLines,
    /// Padded length of a line.
    width: usize,
    /// Displacement of a cell per unit of its own pressure.
    own: f64,
    /// Coefficients at a distance of i and j cells, i from `1 − nx` to `nx − 1` and j from 0, row by row.
    coefficients: Vec<f64>,
    /// Transforms of the coefficients relative to `own`, divided by the padded length: one for each distance of two lines. They are
    /// real because the coefficients are even.
    sums: LineSums<T>,
    plans: FftPlans<T>,
}

/// The cells of a grid as lines: cell i of line m is stored at `m * between + i * along`.
#[derive(Debug, Clone, Copy)]
struct GridLines {
    count: usize,
    cells: usize,
    between: usize,
    along: usize,
}

impl GridLines {
    /// The lines along the longer axis.
    fn of(nx: usize, ny: usize) -> GridLines {
        let [count, cells, between, along] = if nx >= ny {
            [ny, nx, nx, 1]
        } else {
            [nx, ny, 1, nx]
        };
        GridLines {
            count,
            cells,
            between,
            along,
        }
    }

    fn pairs(self) -> usize {
        self.count.div_ceil(2)
    }

    /// The first and the last line with a value that is not 0; the first one if there is none.
    fn loaded(self, values: &[f64]) -> [usize; 2] {
        let is_loaded = |number: &usize| {
            let mut any = false;
            self.each(*number, |_, place| any |= values[place] != 0.0);
            any
        };
        let first = (0..self.count).find(is_loaded).unwrap_or(0);
        let last = (0..self.count).rfind(is_loaded).unwrap_or(0);
        [first, last]
    }

    /// Calls with each cell of a line, from its first on, and the place of its value.
    #[inline(always)]
    fn each(self, number: usize, mut call: impl FnMut(usize, usize)) {
        let first = number * self.between;
        // Two loops, because the compiler runs the one over neighbours in the machine's lanes.
        if self.along == 1 {
            (0..self.cells).for_each(|i| call(i, first + i));
        } else {
            (0..self.cells).for_each(|i| call(i, first + i * self.along));
        }
    }
}

/// Plans and buffers for the products of one solve. It fits grids of any size and carries no state from one product to the next.
pub struct GridWorkspace<T: FftFloat> {
    planners: FftPlanners<T>,
    /// Lines, two and two.
    pairs: Vec<Complex<T>>,
    scratch: Vec<Complex<T>>,
    /// Spectra of pressures and of displacements.
    spectra: [Spectra<T>; 2],
}

impl<T: FftFloat> Default for GridWorkspace<T> {
    fn default() -> Self {
        GridWorkspace {
            planners: FftPlanners::default(),
            pairs: Vec::new(),
            scratch: Vec::new(),
            spectra: [Spectra::default(), Spectra::default()],
        }
    }
}

impl<T: FftFloat> GridWorkspace<T> {
    /// Resizes the buffers for an operator.
    fn fit(&mut self, operator: &GridOperator<T>) {
        let plans = &operator.plans;
        let scratch = [
            plans.forward.get_inplace_scratch_len(),
            plans.backward.get_inplace_scratch_len(),
        ];
        let zero = Complex::new(T::zero(), T::zero());
        self.pairs
            .resize(operator.width * operator.lines.pairs(), zero);
        self.scratch
            .resize(scratch.into_iter().max().unwrap_or(0), zero);
        let waves = operator.width / 2 + 1;
        let [from, to] = &mut self.spectra;
        from.fit(operator.lines.count, waves);
        to.fit(operator.lines.count, waves);
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
        let cells = GridLines::of(nx, ny);
        let width = smooth_even(2 * cells.cells);
        let coefficients = coefficients(nx, ny, dx, dy, contact_modulus);
        let mut operator = GridOperator {
            nx,
            ny,
            lines: cells,
            width,
            own: coefficients[0],
            coefficients: lines(nx, &coefficients),
            sums: LineSums::new(cells.count, width / 2 + 1),
            plans: workspace.planners.plans(width),
        };
        workspace.fit(&operator);
        operator.transform_coefficients(&coefficients, workspace);
        operator
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
        let largest = pressure.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
        if largest == 0.0 {
            displacement.fill(0.0);
            return;
        }
        workspace.fit(self);
        let (lines, width) = (self.lines, self.width);
        // A pair of lines leaves twice its spectra.
        let (down, up) = (0.5 / largest, largest * self.own);
        let [first, last] = lines.loaded(pressure).map(|line| line / 2);
        let GridWorkspace {
            pairs,
            scratch,
            spectra,
            ..
        } = workspace;
        let loaded = &mut pairs[first * width..(last + 1) * width];
        for (k, pair) in loaded.chunks_exact_mut(width).enumerate() {
            let one = 2 * (first + k);
            fill(pair, one, lines, |p| T::of(p * down), pressure);
        }
        self.plans.forward.process_with_scratch(loaded, scratch);
        simd::dispatch(self.sums.of_pairs(pairs, first..last + 1, spectra));
        self.plans.backward.process_with_scratch(pairs, scratch);
        for (k, pair) in pairs.chunks_exact(width).enumerate() {
            spread(&pair[..lines.cells], 2 * k, lines, up, displacement);
        }
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

    /// Fills the transforms of the coefficients; `coefficients[j * nx + i]` belongs to the distance of i and j cells.
    fn transform_coefficients(&mut self, coefficients: &[f64], workspace: &mut GridWorkspace<T>) {
        let (lines, width) = (self.lines, self.width);
        let scale = 1.0 / (self.own * width as f64);
        let GridWorkspace { pairs, scratch, .. } = workspace;
        for (k, pair) in pairs.chunks_exact_mut(width).enumerate() {
            fill(pair, 2 * k, lines, |c| T::of(c * scale), coefficients);
            for i in 1..lines.cells {
                pair[width - i] = pair[i];
            }
        }
        self.plans.forward.process_with_scratch(pairs, scratch);
        for (k, pair) in pairs.chunks_exact(width).enumerate() {
            // Spectra of even lines are real: each keeps the part that it came in.
            self.sums.set(2 * k, pair.iter().map(|value| value.re));
            if 2 * k + 1 < lines.count {
                self.sums.set(2 * k + 1, pair.iter().map(|value| value.im));
            }
        }
    }
}

/// Two lines as real and imaginary part, padded with 0.
fn fill<T: FftFloat>(
    pair: &mut [Complex<T>],
    one: usize,
    lines: GridLines,
    of: impl Fn(f64) -> T,
    values: &[f64],
) {
    let zero = T::zero();
    let (own, padding) = pair.split_at_mut(lines.cells);
    if one + 1 == lines.count {
        lines.each(one, |i, place| {
            own[i] = Complex::new(of(values[place]), zero);
        });
    } else if lines.along == 1 {
        let (re, im) = values[one * lines.between..].split_at(lines.cells);
        for ((cell, re), im) in own.iter_mut().zip(re).zip(im) {
            *cell = Complex::new(of(*re), of(*im));
        }
    } else {
        for (cell, row) in own.iter_mut().zip(values.chunks_exact(lines.along)) {
            *cell = Complex::new(of(row[one]), of(row[one + 1]));
        }
    }
    padding.fill(Complex::new(zero, zero));
}

/// What [`fill`] does, the other way, and times a factor.
fn spread<T: FftFloat>(
    pair: &[Complex<T>],
    one: usize,
    lines: GridLines,
    factor: f64,
    values: &mut [f64],
) {
    let of = |part: T| factor * part.into();
    if one + 1 == lines.count {
        lines.each(one, |i, place| values[place] = of(pair[i].re));
    } else if lines.along == 1 {
        let (re, im) = values[one * lines.between..].split_at_mut(lines.cells);
        for ((cell, re), im) in pair.iter().zip(re).zip(im) {
            (*re, *im) = (of(cell.re), of(cell.im));
        }
    } else {
        for (cell, row) in pair.iter().zip(values.chunks_exact_mut(lines.along)) {
            (row[one], row[one + 1]) = (of(cell.re), of(cell.im));
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

/// Displacement i cells along x and j cells along y away from a cell with unit pressure, stored at `j * nx + i`.
pub(crate) fn coefficients(
    nx: usize,
    ny: usize,
    dx: f64,
    dy: f64,
    contact_modulus: f64,
) -> Vec<f64> {
    let factor = 1.0 / (std::f64::consts::PI * contact_modulus);
    // Corners lie half a cell before and after the centres. Neighbouring cells share them, so each is evaluated once; the
    // two corners of the first cell differ only in sign.
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
