//! Influence between the cells of a contact surface that bends around the rail.
//!
//! The surface is unfolded: cells are equal rectangles along x and along the arc length s of the cross-section, whose tangent has the angle α. With
//! `A` the normal influence of the half-space at the distances `x` and `d = s_j − s_k`, and `Δ = α_j − α_k` the turn from the loaded strip k to
//! the strip j, both bodies together:
//!
//! - pressure opens the gap by `cos(1.25 Δ) A`,
//! - pressure displaces the surfaces along s by `−2κ sin(Δ/2) A`, and tractions along s open the gap by the opposite,
//! - pressure displaces them along x by `−(Δ/d) x (a + b d²/r²) A` (`−Δ/d` is `−dα/ds` on the strip itself), tractions along x open the gap by the
//!   opposite,
//! - tangential displacements by tractions are those of the half-space.
//!
//! The factors were fitted to boundary elements of two equal bodies that follow an arc between straight flanks. They leave forces within 1.5 % of μN
//! for turns up to 1.25 rad.

use rustfft::num_complex::Complex;

use crate::contact::half_space::elasticity::Elasticity;
use crate::contact::half_space::grid_coefficients::coefficients;
use crate::contact::half_space::transforms::{FftPlanners, FftPlans};

/// How strips of a bent surface act on each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Influence {
    /// As on a half-space, within a run of contact only.
    HalfSpace,
    /// With factors for the turn between them, across the whole contact.
    AngleCorrected,
    /// As on a half-space, across the whole contact: what the factors for the turn start from.
    Unfolded,
}

/// Turn up to which the factors were compared with boundary elements, in rad.
pub const TURN_MAX: f64 = 1.25;
/// The factor of the turn in the influence of pressures on the gap.
const TURN_OF_PRESSURE: f64 = 1.25;

/// The strips of a surface: arc lengths are those of equally wide strips.
#[derive(Debug, Clone, PartialEq)]
pub struct BentStrips {
    /// The angle of each strip in rad.
    pub angle: Vec<f64>,
    /// The run of contact that each strip belongs to; runs do not act on each other.
    pub run: Vec<usize>,
    /// Do the factors for the turn apply?
    pub corrected: bool,
}

/// Normal displacements and gaps of cells of a bent surface by pressures and tractions on them.
#[derive(Debug)]
pub struct BentOperator {
    strips: BentStrips,
    convolution: Convolution,
    /// The normal influence of a cell; the one along x at other strips, over the turn; and that at its own strip, over its curvature.
    normal: Spectrum,
    along: Option<[Spectrum; 2]>,
    /// `−dα/ds` of each strip in 1/mm.
    curvature: Vec<f64>,
    /// 2κ.
    coupling: f64,
    /// Normal influence at a distance of i cells along x and j along s, at `j * cells[0] + i`.
    coefficients: Vec<f64>,
    dx: f64,
}

impl BentOperator {
    /// The operator of `cells` along x and s of sizes `step` in mm; there are as many strips as cells along s.
    #[must_use]
    pub fn new(
        cells: [usize; 2],
        step: [f64; 2],
        elasticity: &Elasticity,
        strips: BentStrips,
    ) -> BentOperator {
        let nu = elasticity.poisson_ratio;
        let [nx, ny] = cells;
        let known = coefficients(nx, ny, step[0], step[1], elasticity.contact_modulus());
        let at = |i: isize, j: isize| known[j.unsigned_abs() * nx + i.unsigned_abs()];
        let convolution = Convolution::new(cells);
        let normal = convolution.spectrum(at);
        let (a, b) = (-0.226 * (1.0 - 2.0 * nu), 1.29 * nu - 0.163);
        let along = strips.corrected.then(|| {
            let others = |i: isize, j: isize| {
                if i == 0 || j == 0 {
                    return 0.0;
                }
                let (x, d) = (i as f64 * step[0], j as f64 * step[1]);
                -x / d * (a + b * d * d / (x * x + d * d)) * at(i, j)
            };
            let own = |i: isize, j: isize| match j {
                0 => i as f64 * step[0] * a * at(i, 0),
                _ => 0.0,
            };
            [convolution.spectrum(others), convolution.spectrum(own)]
        });
        BentOperator {
            curvature: curvatures(&strips.angle, step[1]),
            strips,
            normal,
            along,
            coupling: 1.17 * (1.0 + 1.0 / (1.0 - nu)),
            dx: step[0],
            convolution,
            coefficients: known,
        }
    }

    /// Displacement of a cell by its own unit pressure in mm/MPa.
    #[must_use]
    pub fn own(&self) -> f64 {
        self.coefficients[0]
    }

    fn is_corrected(&self) -> bool {
        self.strips.corrected
    }

    /// The angle of the strip that a cell lies in times a factor, as a number on the unit circle.
    fn phases(&self, factor: f64) -> Vec<Complex<f64>> {
        let turned = |angle: &f64| Complex::cis(factor * angle);
        self.strips.angle.iter().map(turned).collect()
    }

    /// `Σ_k A e^{i c (α_j − α_k)} v_k` at every cell: its real part has the cosines of the turns, its imaginary part the sines.
    fn turned(&self, factor: f64, values: &[f64], workspace: &mut BentWorkspace) {
        let nx = self.convolution.cells[0];
        let phases = self.phases(factor);
        workspace.field.clear();
        for (row, phase) in values.chunks_exact(nx).zip(&phases) {
            workspace.field.extend(row.iter().map(|v| phase.conj() * v));
        }
        self.convolution.apply(&self.normal, workspace);
        for (row, phase) in workspace.field.chunks_exact_mut(nx).zip(&phases) {
            row.iter_mut().for_each(|value| *value *= phase);
        }
    }

    /// The gap in mm that pressures in MPa open.
    pub fn opened_by_pressure(
        &self,
        pressure: &[f64],
        gap: &mut [f64],
        workspace: &mut BentWorkspace,
    ) {
        if self.is_corrected() {
            self.turned(TURN_OF_PRESSURE, pressure, workspace);
            for (gap, value) in gap.iter_mut().zip(&workspace.field) {
                *gap = value.re;
            }
            return;
        }
        let nx = self.convolution.cells[0];
        let runs = self.strips.run.iter().max().map_or(0, |last| last + 1);
        // Two runs at once, as the real and the imaginary part.
        for first in (0..runs).step_by(2) {
            let part = |strip: usize, p: f64| match self.strips.run[strip].wrapping_sub(first) {
                0 => Complex::new(p, 0.0),
                1 => Complex::new(0.0, p),
                _ => Complex::new(0.0, 0.0),
            };
            workspace.field.clear();
            let cells = pressure.iter().enumerate();
            workspace.field.extend(cells.map(|(k, p)| part(k / nx, *p)));
            self.convolution.apply(&self.normal, workspace);
            for (k, (gap, value)) in gap.iter_mut().zip(&workspace.field).enumerate() {
                match self.strips.run[k / nx].wrapping_sub(first) {
                    0 => *gap = value.re,
                    1 => *gap = value.im,
                    _ => {}
                }
            }
        }
    }

    /// Adds the gap in mm that changed pressures in MPa open, cell by cell.
    pub fn add_opened(&self, changes: &[(usize, f64)], gap: &mut [f64]) {
        let nx = self.convolution.cells[0];
        for (cell, pressure) in changes {
            let (column, strip) = (cell % nx, cell / nx);
            for (j, row) in gap.chunks_exact_mut(nx).enumerate() {
                let line = &self.coefficients[j.abs_diff(strip) * nx..][..nx];
                let share = pressure * self.share(j, strip);
                for (i, gap) in row.iter_mut().enumerate() {
                    *gap += share * line[i.abs_diff(column)];
                }
            }
        }
    }

    /// The factor of the normal influence of a strip on another.
    fn share(&self, strip: usize, of: usize) -> f64 {
        let BentStrips {
            angle,
            run,
            corrected,
        } = &self.strips;
        match corrected {
            true => (TURN_OF_PRESSURE * (angle[strip] - angle[of])).cos(),
            false => f64::from(u8::from(run[strip] == run[of])),
        }
    }

    /// The gap in mm that tractions on the rail in MPa, along x and s, open; none on a surface without factors for the turn.
    #[must_use]
    pub fn opened_by_traction(
        &self,
        traction: &[Vec<f64>; 2],
        workspace: &mut BentWorkspace,
    ) -> Option<Vec<f64>> {
        let along = self.along(&traction[0], workspace)?;
        self.turned(0.5, &traction[1], workspace);
        let across = workspace.field.iter().map(|value| self.coupling * value.im);
        Some(across.zip(along).map(|(s, x)| s - x).collect())
    }

    /// The slip that pressures in MPa cause in steady rolling, along x and s: the derivatives along x of the displacements of the rail relative to the
    /// wheel; none on a surface without factors for the turn.
    #[must_use]
    pub fn slip_of_pressure(
        &self,
        pressure: &[f64],
        workspace: &mut BentWorkspace,
    ) -> Option<[Vec<f64>; 2]> {
        let along = self.along(pressure, workspace)?;
        self.turned(0.5, pressure, workspace);
        let across = workspace
            .field
            .iter()
            .map(|value| -self.coupling * value.im);
        let across: Vec<f64> = across.collect();
        Some([self.derivative(&along), self.derivative(&across)])
    }

    /// Displacements along x by pressures.
    fn along(&self, pressure: &[f64], workspace: &mut BentWorkspace) -> Option<Vec<f64>> {
        let [others, own] = self.along.as_ref()?;
        let nx = self.convolution.cells[0];
        let strips = || self.strips.angle.iter();
        workspace.field.clear();
        for (row, angle) in pressure.chunks_exact(nx).zip(strips()) {
            workspace
                .field
                .extend(row.iter().map(|p| Complex::new(*p, p * angle)));
        }
        self.convolution.apply(others, workspace);
        let cells = workspace.field.chunks_exact(nx).zip(strips());
        let mut displacement: Vec<f64> = cells
            .flat_map(|(row, angle)| row.iter().map(move |u| angle * u.re - u.im))
            .collect();
        workspace.field.clear();
        let real = pressure.iter().map(|p| Complex::new(*p, 0.0));
        workspace.field.extend(real);
        self.convolution.apply(own, workspace);
        let rows = displacement.chunks_exact_mut(nx).zip(&self.curvature);
        for ((row, curvature), own) in rows.zip(workspace.field.chunks_exact(nx)) {
            for (u, own) in row.iter_mut().zip(own) {
                *u += curvature * own.re;
            }
        }
        Some(displacement)
    }

    /// Derivative along x by central differences, one-sided at the ends of a strip.
    fn derivative(&self, values: &[f64]) -> Vec<f64> {
        let nx = self.convolution.cells[0];
        let of_row = |row: &[f64]| -> Vec<f64> {
            let slope = |i: usize| {
                let (low, high) = (i.saturating_sub(1), (i + 1).min(nx - 1));
                (row[high] - row[low]) / ((high - low) as f64 * self.dx)
            };
            (0..nx).map(slope).collect()
        };
        values.chunks_exact(nx).flat_map(of_row).collect()
    }
}

/// `−dα/ds` of strips of equal width.
fn curvatures(angle: &[f64], step: f64) -> Vec<f64> {
    let last = angle.len() - 1;
    let of = |j: usize| {
        let (low, high) = (j.saturating_sub(1), (j + 1).min(last));
        match high - low {
            0 => 0.0,
            strips => -(angle[high] - angle[low]) / (strips as f64 * step),
        }
    };
    (0..=last).map(of).collect()
}

/// Buffers of products.
#[derive(Debug, Default)]
pub struct BentWorkspace {
    /// Values at the cells, before and after a product.
    field: Vec<Complex<f64>>,
    rows: Vec<Complex<f64>>,
    columns: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
}

/// The transform of the influence of one cell, column by column.
type Spectrum = Vec<Complex<f64>>;

/// Convolutions of complex values on a grid with kernels that reach over all of it.
struct Convolution {
    cells: [usize; 2],
    padded: [usize; 2],
    plans: [FftPlans<f64>; 2],
}

impl std::fmt::Debug for Convolution {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("Convolution")
            .field("cells", &self.cells)
            .finish_non_exhaustive()
    }
}

impl Convolution {
    fn new(cells: [usize; 2]) -> Convolution {
        let padded = cells.map(|n| smooth(2 * n - 1));
        let mut planners = FftPlanners::default();
        Convolution {
            cells,
            padded,
            plans: padded.map(|n| planners.plans(n)),
        }
    }

    /// The spectrum of a kernel by the distances in cells along x and s, divided by the padded size.
    fn spectrum(&self, kernel: impl Fn(isize, isize) -> f64) -> Spectrum {
        let [nx, ny] = self.cells.map(|n| n as isize);
        let [px, py] = self.padded;
        let mut rows = vec![Complex::new(0.0, 0.0); px * py];
        let scale = 1.0 / (px * py) as f64;
        for j in 1 - ny..ny {
            for i in 1 - nx..nx {
                let place = |k: isize, n: usize| k.rem_euclid(n as isize) as usize;
                rows[place(j, py) * px + place(i, px)] = (scale * kernel(i, j)).into();
            }
        }
        self.plans[0].forward.process(&mut rows);
        let mut columns = vec![Complex::new(0.0, 0.0); px * py];
        transpose(&rows, px, &mut columns);
        self.plans[1].forward.process(&mut columns);
        columns
    }

    /// Replaces the field of the workspace by its convolution.
    fn apply(&self, kernel: &Spectrum, workspace: &mut BentWorkspace) {
        let ([nx, ny], [px, py]) = (self.cells, self.padded);
        let BentWorkspace {
            field,
            rows,
            columns,
            scratch,
        } = workspace;
        let zero = Complex::new(0.0, 0.0);
        rows.clear();
        rows.resize(px * ny, zero);
        for (row, values) in rows.chunks_exact_mut(px).zip(field.chunks_exact(nx)) {
            row[..nx].copy_from_slice(values);
        }
        let needed = self.plans.iter().flat_map(|plans| {
            [
                plans.forward.get_inplace_scratch_len(),
                plans.backward.get_inplace_scratch_len(),
            ]
        });
        scratch.resize(needed.max().unwrap_or(0), zero);
        self.plans[0].forward.process_with_scratch(rows, scratch);
        columns.clear();
        columns.resize(px * py, zero);
        for (column, line) in columns.chunks_exact_mut(py).enumerate() {
            for j in 0..ny {
                line[j] = rows[j * px + column];
            }
        }
        self.plans[1].forward.process_with_scratch(columns, scratch);
        for (value, factor) in columns.iter_mut().zip(kernel) {
            *value *= factor;
        }
        self.plans[1]
            .backward
            .process_with_scratch(columns, scratch);
        for (column, line) in columns.chunks_exact(py).enumerate() {
            for j in 0..ny {
                rows[j * px + column] = line[j];
            }
        }
        self.plans[0].backward.process_with_scratch(rows, scratch);
        for (row, values) in rows.chunks_exact(px).zip(field.chunks_exact_mut(nx)) {
            values.copy_from_slice(&row[..nx]);
        }
    }
}

/// Writes the columns of rows of `width` one after the other.
fn transpose(rows: &[Complex<f64>], width: usize, columns: &mut [Complex<f64>]) {
    let height = rows.len() / width;
    for (i, column) in columns.chunks_exact_mut(height).enumerate() {
        for (j, value) in column.iter_mut().enumerate() {
            *value = rows[j * width + i];
        }
    }
}

/// The least number not below `n` without prime factors above 5.
fn smooth(n: usize) -> usize {
    let is_smooth = |n: &usize| {
        let mut n = *n;
        for factor in [2, 3, 5] {
            while n.is_multiple_of(factor) {
                n /= factor;
            }
        }
        n == 1
    };
    (n.max(1)..).find(is_smooth).unwrap_or(n)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    const NU: f64 = 0.28;
    const STEP: [f64; 2] = [0.4, 0.3];
    const CELLS: [usize; 2] = [9, 12];

    fn steel() -> Elasticity {
        Elasticity {
            shear_modulus: 82_000.0,
            poisson_ratio: NU,
            difference: 0.0,
        }
    }

    /// A gauge corner: straight, then an arc of 13 mm.
    fn bent(corrected: bool, run: impl Fn(usize) -> usize) -> BentStrips {
        let angle = (0..CELLS[1]).map(|j| -0.1 - (j as f64 * STEP[1] - 1.0).max(0.0) / 13.0);
        BentStrips {
            angle: angle.collect(),
            run: (0..CELLS[1]).map(run).collect(),
            corrected,
        }
    }

    /// The normal influence in closed form (Love 1929).
    fn influence(i: isize, j: isize) -> f64 {
        let corner = |p: f64, q: f64| p * (q / p.abs()).asinh() + q * (p / q.abs()).asinh();
        let x = [-0.5, 0.5].map(|half| (i as f64 + half) * STEP[0]);
        let y = [-0.5, 0.5].map(|half| (j as f64 + half) * STEP[1]);
        let sum = corner(x[1], y[1]) - corner(x[0], y[1]) - corner(x[1], y[0]) + corner(x[0], y[0]);
        sum * (1.0 - NU) / (PI * 82_000.0)
    }

    fn loads(seed: usize) -> Vec<f64> {
        let count = CELLS[0] * CELLS[1];
        (0..count).map(|k| ((k * 37 + seed) % 101) as f64).collect()
    }

    /// Sums over pairs of cells: `of(x, d, Δ, own curvature)` times the influence.
    fn dense(
        strips: &BentStrips,
        of: impl Fn(f64, f64, f64, f64) -> f64,
        load: &[f64],
    ) -> Vec<f64> {
        let nx = CELLS[0];
        let curvature = curvatures(&strips.angle, STEP[1]);
        let pair = |k: usize, m: usize| {
            let (i, j) = (
                (k % nx) as isize - (m % nx) as isize,
                (k / nx) as isize - (m / nx) as isize,
            );
            let turn = strips.angle[k / nx] - strips.angle[m / nx];
            let factor = of(
                i as f64 * STEP[0],
                j as f64 * STEP[1],
                turn,
                curvature[k / nx],
            );
            factor * influence(i, j) * load[m]
        };
        let all = load.len();
        (0..all)
            .map(|k| (0..all).map(|m| pair(k, m)).sum())
            .collect()
    }

    fn assert_alike(found: &[f64], expected: &[f64]) {
        let largest = expected.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < 1e-11 * largest, "{a} {b}");
        }
    }

    #[test]
    fn products_are_the_sums_over_pairs_of_cells() {
        let strips = bent(true, |_| 0);
        let operator = BentOperator::new(CELLS, STEP, &steel(), strips.clone());
        let workspace = &mut BentWorkspace::default();
        let (p, x, s) = (loads(11), loads(5), loads(77));
        let mut gap = vec![f64::NAN; p.len()];
        operator.opened_by_pressure(&p, &mut gap, workspace);
        assert_alike(
            &gap,
            &dense(&strips, |_, _, turn, _| (1.25 * turn).cos(), &p),
        );
        let changes: Vec<(usize, f64)> = p.iter().copied().enumerate().collect();
        let mut summed = vec![0.0; p.len()];
        operator.add_opened(&changes, &mut summed);
        assert_alike(&summed, &gap);
        let coupling = 1.17 * (1.0 + 1.0 / (1.0 - NU));
        let (a, b) = (-0.226 * (1.0 - 2.0 * NU), 1.29 * NU - 0.163);
        let along = |x: f64, d: f64, turn: f64, own: f64| match d == 0.0 {
            true => own * x * a,
            false => -turn / d * x * (a + b * d * d / (x * x + d * d)),
        };
        let opened = operator.opened_by_traction(&[x.clone(), s.clone()], workspace);
        let across = dense(&strips, |_, _, turn, _| coupling * (0.5 * turn).sin(), &s);
        let by_x = dense(&strips, along, &x);
        let expected: Vec<f64> = across.iter().zip(by_x).map(|(s, x)| s - x).collect();
        assert_alike(&opened.unwrap(), &expected);
        let slip = operator.slip_of_pressure(&p, workspace).unwrap();
        let moved = dense(&strips, along, &p);
        let inner = |values: &[f64], k: usize| (values[k + 1] - values[k - 1]) / (2.0 * STEP[0]);
        let k = 4 * CELLS[0] + 3;
        assert!((slip[0][k] / inner(&moved, k) - 1.0).abs() < 1e-9);
    }

    /// Work of one load on the displacement of another does not depend on their order.
    #[test]
    fn influences_are_reciprocal() {
        let operator = BentOperator::new(CELLS, STEP, &steel(), bent(true, |_| 0));
        let workspace = &mut BentWorkspace::default();
        let (p, x, s) = (loads(3), loads(29), loads(58));
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let opened = operator.opened_by_traction(&[x.clone(), s.clone()], workspace);
        let along = operator.along(&p, workspace).unwrap();
        operator.turned(0.5, &p, workspace);
        let across: Vec<f64> = workspace
            .field
            .iter()
            .map(|value| -operator.coupling * value.im)
            .collect();
        let (one, other) = (
            dot(&opened.unwrap(), &p),
            dot(&along, &x) + dot(&across, &s),
        );
        assert!((one / other - 1.0).abs() < 1e-9, "{one} {other}");
    }

    #[test]
    fn runs_of_a_half_space_do_not_act_on_each_other() {
        let workspace = &mut BentWorkspace::default();
        let run = |j: usize| j / 4;
        let operator = BentOperator::new(CELLS, STEP, &steel(), bent(false, run));
        let p = loads(11);
        let mut gap = vec![f64::NAN; p.len()];
        operator.opened_by_pressure(&p, &mut gap, workspace);
        let all = BentOperator::new(CELLS, STEP, &steel(), bent(false, |_| 0));
        for k in 0..3 {
            let rows = k * 4 * CELLS[0]..(k + 1) * 4 * CELLS[0];
            let mut part = vec![0.0; p.len()];
            part[rows.clone()].copy_from_slice(&p[rows.clone()]);
            let mut alone = vec![0.0; p.len()];
            all.opened_by_pressure(&part, &mut alone, workspace);
            assert_alike(&gap[rows.clone()], &alone[rows]);
        }
        assert!(operator.slip_of_pressure(&p, workspace).is_none());
    }
}
