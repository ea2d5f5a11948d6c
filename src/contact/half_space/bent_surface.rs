//! Influence between the cells of a contact surface: a plane, or a surface that bends around the rail.
//!
//! A surface that bends is unfolded: cells are equal rectangles along x and along the arc length s of the cross-section, whose tangent has the angle α. Let `A` be the normal
//! influence of the half-space at the distances `x` and `d = s_j − s_k`, and `Δ = α_j − α_k` the turn from the loaded strip k to the strip j. For both bodies
//! together:
//!
//! - pressure opens the gap by `cos(1.25 Δ) A`,
//! - pressure displaces the surfaces along s by `−2κ sin(Δ/2) A`, and tractions along s open the gap by the opposite,
//! - pressure displaces them along x by `−(Δ/d) x (a + b d²/r²) A` (`−Δ/d` is `−dα/ds` on the strip itself), and tractions along x open the gap by the opposite,
//! - tangential displacements by tractions are those of the half-space,
//! - where the bodies differ, tractions also open the gap as on a half-space, times the factor of the pressures. The equations of the tractions contain the
//!   corresponding displacements by pressures.
//!
//! The factors were fitted to boundary elements of two equal bodies that follow an arc between straight flanks. Forces differ by at most 1.5 % of μN for turns up to
//! 1.25 rad.

use std::cmp::Ordering;
use std::sync::Arc;

use pulp::{NullaryFnOnce, Simd, WithSimd};
use railhead_macros::{Words, keyword};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use crate::half_space::unlike_bodies::{Elasticity, displacement_by_cell};
use crate::lazy_field::LazyField;
use crate::numerics::simd::{self, Float, LANES};

/// How cells of a curved contact surface act on each other.
#[keyword(Default, Words)]
#[schema(as = SurfaceInfluence)]
pub enum Influence {
    /// As on a half-space with factors for the turn of the surface between them, across the whole contact.
    #[default]
    AngleCorrected,
    /// As on a half-space, among strips that touch less than 4 mm from each other: for comparison with other programs.
    HalfSpace,
}

/// Largest turn in rad for which the factors were compared with boundary elements.
pub const TURN_MAX: f64 = 1.25;
/// Factor of the turn in the influence of pressures on the gap.
const TURN_OF_PRESSURE: f64 = 1.25;

/// The strips of a surface, of equal width.
#[derive(Debug, Clone, PartialEq)]
pub struct BentStrips {
    /// The place of each strip, in widths of a strip.
    pub number: Vec<usize>,
    /// The angle of each strip in rad.
    pub angle: Vec<f64>,
    /// The run of contact of each strip; runs do not interact.
    pub run: Vec<usize>,
    /// Whether the factors for the turn apply.
    pub corrected: bool,
}

impl BentStrips {
    /// Adjoining strips of a plane.
    fn flat(count: usize) -> BentStrips {
        BentStrips {
            number: (0..count).collect(),
            angle: vec![0.0; count],
            run: vec![0; count],
            corrected: false,
        }
    }
}

/// Normal displacements and gaps of cells of a curved surface by pressures and tractions on them.
///
/// A product transforms the strips along x and sums them wave by wave with a factor for each pair of strips. Parts of the surface without contact may be left out.
pub struct BentOperator {
    strips: BentStrips,
    /// Cells along x, and size of a cell along x and s in mm.
    nx: usize,
    step: [f64; 2],
    /// Padded length of a strip.
    width: usize,
    /// Forward and inverse transform of a padded strip.
    plans: [Arc<dyn Fft<f32>>; 2],
    /// Normal influence of a cell.
    normal: Spectrum,
    /// Influence along x: on other strips over the turn, on its own strip over the curvature.
    along: Option<Spectrum>,
    /// Displacements along x and along s by the pressure of a cell, if the bodies differ.
    unlike: Option<[Spectrum; 2]>,
    /// Factors of the influence between pressures and tractions along x and along s.
    coupled: LazyField<[StripFactors; 2]>,
    /// 2κ.
    coupling: f64,
    /// Normal influence at a distance of i cells along x, from `1 − nx` to `nx − 1`, and j strips, at `j * (2 * nx - 1) + i + nx - 1`.
    coefficients: Vec<f64>,
}

/// Factors of the influence of each strip on each, at `acting * strips + acted_on`.
#[derive(Debug, Clone, PartialEq)]
pub struct StripFactors(Vec<f32>);

/// Transforms of an influence for each distance of two strips, from the largest negative to the largest positive one, in each group of [`LANES`] waves. They are real;
/// the transform of an odd influence is `i` times these.
type Spectrum = Vec<[f32; LANES]>;

impl BentOperator {
    /// The operator of `nx` cells along x and `ny` strips of a plane, of sizes `step` in mm, for the contact modulus `E*` in MPa.
    pub fn flat(
        [nx, ny]: [usize; 2],
        step: [f64; 2],
        contact_modulus: f64,
        workspace: &mut BentWorkspace,
    ) -> BentOperator {
        // Without Poisson's ratio the contact modulus is the shear modulus.
        let elasticity = Elasticity {
            shear_modulus: contact_modulus,
            poisson_ratio: 0.0,
            difference: 0.0,
            lower_share: 0.5,
        };
        BentOperator::new(nx, step, &elasticity, BentStrips::flat(ny), workspace)
    }

    /// The operator of `nx` cells along x of sizes `step` in mm on strips.
    pub fn new(
        nx: usize,
        step: [f64; 2],
        elasticity: &Elasticity,
        strips: BentStrips,
        workspace: &mut BentWorkspace,
    ) -> BentOperator {
        let nu = elasticity.poisson_ratio;
        let first = strips.number[0];
        let distances = strips.number[strips.number.len() - 1] - first + 1;
        let known = coefficients(
            nx,
            distances,
            step[0],
            step[1],
            elasticity.contact_modulus(),
        );
        let width = smooth(2 * nx - 1);
        let mut used = vec![false; distances];
        for of in &strips.number {
            strips
                .number
                .iter()
                .for_each(|at| used[at.abs_diff(*of)] = true);
        }
        let mut operator = BentOperator {
            nx,
            step,
            width,
            plans: [
                workspace.planner.plan_fft_forward(width),
                workspace.planner.plan_fft_inverse(width),
            ],
            normal: Vec::new(),
            along: None,
            unlike: None,
            coupled: LazyField::default(),
            coupling: 1.17 * (1.0 + 1.0 / (1.0 - nu)),
            coefficients: lines(nx, &known),
            strips,
        };
        operator.normal = operator.spectrum(&used, 1.0, |i, j| known[j * nx + i], workspace);
        if operator.strips.corrected {
            let (a, b) = (-0.226 * (1.0 - 2.0 * nu), 1.29 * nu - 0.163);
            let along = |i: usize, j: usize| {
                let (x, d) = (i as f64 * step[0], j as f64 * step[1]);
                match j {
                    0 => x * a * known[i],
                    _ => -x / d * (a + b * d * d / (x * x + d * d)) * known[j * nx + i],
                }
            };
            operator.along = Some(operator.spectrum(&used, -1.0, along, workspace));
        }
        let &Elasticity {
            shear_modulus,
            difference,
            ..
        } = elasticity;
        if difference != 0.0 {
            operator.unlike = Some([(0, -1.0), (1, 1.0)].map(|(axis, parity)| {
                let displaced = |i: usize, j: usize| {
                    let at = [i as f64 * step[0], j as f64 * step[1]];
                    displacement_by_cell(difference, at, step)[axis] / shear_modulus
                };
                operator.spectrum(&used, parity, displaced, workspace)
            }));
        }
        operator
    }

    /// The spectrum of an influence, given for distances in cells along x and in strips, for the used distances of strips. At negative distances along x it is multiplied
    /// by `parity`.
    fn spectrum(
        &self,
        used: &[bool],
        parity: f64,
        kernel: impl Fn(usize, usize) -> f64,
        workspace: &mut BentWorkspace,
    ) -> Spectrum {
        let (nx, width) = (self.nx, self.width);
        // A product uses twice the spectra of its strips.
        let scale = 0.5 / width as f64;
        let needed: Vec<usize> = (0..used.len()).filter(|j| used[*j]).collect();
        let lines = &mut workspace.lines;
        lines.clear();
        lines.resize(needed.len().div_ceil(2) * width, Complex::default());
        for (pair, line) in needed.chunks(2).zip(lines.chunks_exact_mut(width)) {
            let at = |i: usize| {
                let of = |k: usize| pair.get(k).map_or(0.0, |j| scale * kernel(i, *j));
                [of(0), of(1)]
            };
            for i in 0..nx {
                let [re, im] = at(i);
                line[i] = Complex::new(re as f32, im as f32);
                if i > 0 {
                    line[width - i] = Complex::new((parity * re) as f32, (parity * im) as f32);
                }
            }
        }
        self.transform(&*self.plans[0], lines, &mut workspace.scratch);
        let last = used.len() - 1;
        let distances = 2 * last + 1;
        let mut spectrum = vec![[0.0; LANES]; distances * self.groups()];
        for (pair, line) in needed.chunks(2).zip(lines.chunks_exact(width)) {
            for (wave, value) in line[..=width / 2].iter().enumerate() {
                // The spectrum of an even line is real, that of an odd one imaginary.
                let parts = match parity > 0.0 {
                    true => [value.re, value.im],
                    false => [value.im, -value.re],
                };
                let group = wave / LANES * distances;
                for (j, part) in pair.iter().zip(parts) {
                    for distance in [last - j, last + j] {
                        spectrum[group + distance][wave % LANES] = part;
                    }
                }
            }
        }
        spectrum
    }

    fn groups(&self) -> usize {
        (self.width / 2 + 1).div_ceil(LANES)
    }

    fn transform(
        &self,
        plan: &dyn Fft<f32>,
        lines: &mut [Complex<f32>],
        scratch: &mut Vec<Complex<f32>>,
    ) {
        let needed = plan.get_inplace_scratch_len();
        if scratch.len() < needed {
            scratch.resize(needed, Complex::default());
        }
        plan.process_with_scratch(lines, scratch);
    }

    /// The angles of the strips in rad.
    pub fn angles(&self) -> &[f64] {
        &self.strips.angle
    }

    /// Displacement of a cell by its own unit pressure in mm/MPa.
    pub fn own(&self) -> f64 {
        self.coefficients[self.nx - 1]
    }

    /// Factors as a function of the strip acted on and the acting strip.
    fn factors(&self, of: impl Fn(usize, usize) -> f64) -> StripFactors {
        let count = self.strips.number.len();
        let mut factors = Vec::with_capacity(count * count);
        for k in 0..count {
            factors.extend((0..count).map(|j| of(j, k) as f32));
        }
        StripFactors(factors)
    }

    /// Sines and cosines of the angles of the strips times a factor. Those of turns are sums of their products.
    fn sines(&self, of_angle: f64) -> Vec<(f64, f64)> {
        let angles = self.strips.angle.iter();
        angles.map(|angle| (of_angle * angle).sin_cos()).collect()
    }

    /// The factors of the gaps opened by pressures.
    pub fn pressure_factors(&self) -> StripFactors {
        let run = &self.strips.run;
        if !self.strips.corrected {
            return self.factors(|j, k| f64::from(u8::from(run[j] == run[k])));
        }
        let sines = self.sines(TURN_OF_PRESSURE);
        self.factors(|j, k| sines[j].0 * sines[k].0 + sines[j].1 * sines[k].1)
    }

    /// These factors over the weights of the strip acted on and of the acting strip.
    pub fn weighted_pressure_factors(&self, weights: &[f64]) -> StripFactors {
        let StripFactors(mut factors) = self.pressure_factors();
        for (row, of) in factors.chunks_exact_mut(weights.len()).zip(weights) {
            for (factor, by) in row.iter_mut().zip(weights) {
                *factor /= (of * by) as f32;
            }
        }
        StripFactors(factors)
    }

    /// Factors `2κ sin(Δ/2)` between strips.
    fn turn_factors(&self) -> StripFactors {
        let sines = self.sines(0.5);
        self.factors(|j, k| self.coupling * (sines[j].0 * sines[k].1 - sines[j].1 * sines[k].0))
    }

    /// Factors Δ between strips, and `−dα/ds` of a strip on itself.
    fn bend_factors(&self) -> StripFactors {
        let BentStrips { angle, number, .. } = &self.strips;
        let own = curvatures(angle, number, self.step[1]);
        self.factors(|j, k| match j.cmp(&k) {
            Ordering::Less => angle[k] - angle[j],
            Ordering::Equal => own[j],
            Ordering::Greater => angle[j] - angle[k],
        })
    }

    /// The gap in mm opened by pressures in MPa.
    pub fn opened_by_pressure(
        &self,
        factors: &StripFactors,
        pressure: &[f64],
        gap: &mut [f64],
        workspace: &mut BentWorkspace,
    ) {
        self.product(&self.normal, factors, pressure, false, gap, workspace);
    }

    /// Adds the gap in mm opened by changed pressures in MPa, cell by cell.
    pub fn add_opened(&self, factors: &StripFactors, changes: &[(usize, f64)], gap: &mut [f64]) {
        simd::dispatch(Changes {
            operator: self,
            factors,
            changes,
            gap,
        });
    }

    /// The gap in mm opened by tractions on the rail in MPa, along x and s. `None` for like bodies without factors for the turn.
    pub fn opened_by_traction(
        &self,
        [x, s]: &[Vec<f64>; 2],
        workspace: &mut BentWorkspace,
    ) -> Option<Vec<f64>> {
        let less = |gap: &mut Vec<f64>, displaced: Vec<f64>| {
            gap.iter_mut()
                .zip(displaced)
                .for_each(|(gap, displaced)| *gap -= displaced);
        };
        let of_turn = self.coupled(x, s, workspace).map(|[along, mut gap]| {
            less(&mut gap, along);
            gap
        });
        let Some([along, across]) = &self.unlike else {
            return of_turn;
        };
        let mut gap = of_turn.unwrap_or_else(|| vec![0.0; x.len()]);
        let [even, odd] = self.unlike_factors();
        for (spectrum, factors, traction, is_odd) in
            [(along, even, x, true), (across, odd, s, false)]
        {
            let mut displaced = vec![0.0; x.len()];
            self.product(
                spectrum,
                &factors,
                traction,
                is_odd,
                &mut displaced,
                workspace,
            );
            less(&mut gap, displaced);
        }
        Some(gap)
    }

    /// Factors of the coupling between pressures and tractions of bodies that differ: along x, and along s, where the coefficients are odd in the distance.
    fn unlike_factors(&self) -> [StripFactors; 2] {
        let even = self.pressure_factors();
        let StripFactors(mut odd) = even.clone();
        for (k, row) in odd.chunks_exact_mut(self.strips.number.len()).enumerate() {
            row[..=k].iter_mut().for_each(|factor| *factor = -*factor);
        }
        [even, StripFactors(odd)]
    }

    /// The slip by pressures in MPa in steady rolling, along x and s: the derivatives along x of the displacements of the rail relative to the wheel. `None` without factors
    /// for the turn.
    pub fn slip_of_pressure(
        &self,
        pressure: &[f64],
        workspace: &mut BentWorkspace,
    ) -> Option<[Vec<f64>; 2]> {
        let [along, mut across] = self.coupled(pressure, pressure, workspace)?;
        across.iter_mut().for_each(|value| *value = -*value);
        Some([along, across].map(|displacement| self.derivative(&displacement)))
    }

    /// The displacements along x by the first values, and the product of the second values with `2κ sin(Δ/2) A`.
    fn coupled(
        &self,
        first: &[f64],
        second: &[f64],
        workspace: &mut BentWorkspace,
    ) -> Option<[Vec<f64>; 2]> {
        let spectrum = self.along.as_ref()?;
        let [bend, turn] = self
            .coupled
            .get_or_make(|| [self.bend_factors(), self.turn_factors()]);
        let mut out = [vec![0.0; first.len()], vec![0.0; first.len()]];
        let [along, across] = &mut out;
        self.product(spectrum, bend, first, true, along, workspace);
        self.product(&self.normal, turn, second, false, across, workspace);
        Some(out)
    }

    /// The product of an influence, which may be odd along x, with values at all cells, with a factor for each pair of strips.
    fn product(
        &self,
        spectrum: &Spectrum,
        factors: &StripFactors,
        values: &[f64],
        odd: bool,
        out: &mut [f64],
        workspace: &mut BentWorkspace,
    ) {
        let (nx, width, count) = (self.nx, self.width, self.strips.number.len());
        let BentWorkspace {
            lines,
            scratch,
            acting,
            from,
            to,
            ..
        } = workspace;
        acting.clear();
        let loaded = values.chunks_exact(nx).enumerate();
        let loaded = loaded.filter(|(_, row)| row.iter().any(|value| *value != 0.0));
        acting.extend(loaded.map(|(strip, _)| strip));
        let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        if largest == 0.0 {
            out.fill(0.0);
            return;
        }
        // Single precision needs values of about 1.
        let down = largest.recip();
        lines.clear();
        lines.resize(count.div_ceil(2) * width, Complex::default());
        for (pair, line) in acting.chunks(2).zip(lines.chunks_exact_mut(width)) {
            let row = |strip: usize| &values[strip * nx..][..nx];
            for (value, own) in line.iter_mut().zip(row(pair[0])) {
                value.re = (down * own) as f32;
            }
            for (value, own) in line
                .iter_mut()
                .zip(pair.get(1).map_or(&[][..], |strip| row(*strip)))
            {
                value.im = (down * own) as f32;
            }
        }
        let transformed = acting.len().div_ceil(2) * width;
        self.transform(&*self.plans[0], &mut lines[..transformed], scratch);
        from.resize(
            acting.len().next_multiple_of(2) * self.groups(),
            [[0.0; LANES]; 2],
        );
        to.resize(count.next_multiple_of(2) * self.groups(), [[0.0; LANES]; 2]);
        simd::dispatch(StripSums {
            spectrum,
            factors: &factors.0,
            number: &self.strips.number,
            acting,
            width,
            odd,
            lines,
            from,
            to,
        });
        self.transform(&*self.plans[1], lines, scratch);
        for (rows, line) in out.chunks_mut(2 * nx).zip(lines.chunks_exact(width)) {
            let (one, other) = rows.split_at_mut(nx);
            for (out, value) in one.iter_mut().zip(line) {
                *out = largest * f64::from(value.re);
            }
            for (out, value) in other.iter_mut().zip(line) {
                *out = largest * f64::from(value.im);
            }
        }
    }

    /// Derivative along x by central differences, one-sided at the ends of a strip.
    fn derivative(&self, values: &[f64]) -> Vec<f64> {
        let (last, per_step) = (self.nx - 1, self.step[0].recip());
        let mut slopes = Vec::with_capacity(values.len());
        for row in values.chunks_exact(self.nx) {
            let end = |low: usize, high: usize| {
                (row[high] - row[low]) * per_step / (high - low).max(1) as f64
            };
            slopes.push(end(0, last.min(1)));
            slopes.extend(row.windows(3).map(|of| 0.5 * per_step * (of[2] - of[0])));
            if last > 0 {
                slopes.push(end(last - 1, last));
            }
        }
        slopes
    }
}

impl std::fmt::Debug for BentOperator {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("BentOperator")
            .field("nx", &self.nx)
            .field("strips", &self.strips)
            .finish_non_exhaustive()
    }
}

/// Buffers of products, and plans of transforms. A solve uses few padded sizes, and planning one takes 2 to 14 µs, about a tenth of a product, so plans are kept only
/// during a solve.
pub struct BentWorkspace {
    planner: FftPlanner<f32>,
    /// Strips, two as the real and the imaginary part of one line.
    lines: Vec<Complex<f32>>,
    scratch: Vec<Complex<f32>>,
    /// Strips with values other than 0.
    acting: Vec<usize>,
    /// Transforms of acting strips: for each group of waves and each strip, the real and the imaginary parts.
    from: Vec<[[f32; LANES]; 2]>,
    /// Transforms of all strips.
    to: Vec<[[f32; LANES]; 2]>,
}

impl Default for BentWorkspace {
    fn default() -> Self {
        BentWorkspace {
            planner: FftPlanner::new(),
            lines: Vec::new(),
            scratch: Vec::new(),
            acting: Vec::new(),
            from: Vec::new(),
            to: Vec::new(),
        }
    }
}

/// Sums over the transforms of acting strips, two in a line, for all strips, two in a line; compiled for the instruction set of the machine.
struct StripSums<'a> {
    spectrum: &'a Spectrum,
    factors: &'a [f32],
    number: &'a [usize],
    acting: &'a [usize],
    width: usize,
    odd: bool,
    lines: &'a mut [Complex<f32>],
    from: &'a mut [[[f32; LANES]; 2]],
    to: &'a mut [[[f32; LANES]; 2]],
}

/// The sums of a group of waves.
struct GroupSums<'a> {
    kernel: &'a [[f32; LANES]],
    from: &'a [[[f32; LANES]; 2]],
    factors: &'a [f32],
    number: &'a [usize],
    acting: &'a [usize],
}

impl GroupSums<'_> {
    /// The real and the imaginary parts of `STRIPS` adjoining strips from `first` on. Each acting transform is loaded once for all of them, and their sums are independent,
    /// which hides the latency of the additions.
    #[inline(always)]
    fn of<S: Simd, const STRIPS: usize>(
        &self,
        simd: S,
        first: usize,
    ) -> [[[f32; LANES]; 2]; STRIPS] {
        let count = self.number.len();
        let from_zero = self.number[first] + self.kernel.len() / 2;
        let mut found = [[[0.0; LANES]; 2]; STRIPS];
        for lanes in 0..LANES / S::F32_LANES {
            let mut sums = [[simd.splat_f32s(0.0); 2]; STRIPS];
            for ([re, im], strip) in self.from.iter().zip(self.acting) {
                let [re, im] = [re, im].map(|part| S::as_simd_f32s(part).0[lanes]);
                let kernels = &self.kernel[from_zero - self.number[*strip]..][..STRIPS];
                let factors = &self.factors[strip * count + first..][..STRIPS];
                for ((sum, kernel), factor) in sums.iter_mut().zip(kernels).zip(factors) {
                    let [real, imaginary] = sum;
                    let factor = simd.splat_f32s(*factor);
                    let influence = simd.mul_f32s(factor, S::as_simd_f32s(kernel).0[lanes]);
                    *real = simd.mul_add_e_f32s(influence, re, *real);
                    *imaginary = simd.mul_add_e_f32s(influence, im, *imaginary);
                }
            }
            for (found, sums) in found.iter_mut().zip(sums) {
                for (found, sum) in found.iter_mut().zip(sums) {
                    S::as_mut_simd_f32s(found).0[lanes] = sum;
                }
            }
        }
        found
    }

    /// Writes the sums of `STRIPS` strips from `first` on to `to` if they adjoin each other; returns the number of summed strips.
    #[inline(always)]
    fn leave<S: Simd, const STRIPS: usize>(
        &self,
        simd: S,
        first: usize,
        to: &mut [[[f32; LANES]; 2]],
    ) -> usize {
        let numbers = self.number[first..].get(..STRIPS);
        if numbers.is_none_or(|numbers| numbers[STRIPS - 1] - numbers[0] >= STRIPS) {
            return 0;
        }
        let sums: [_; STRIPS] = self.of(simd, first);
        to[first..first + STRIPS].copy_from_slice(&sums);
        STRIPS
    }
}

impl WithSimd for StripSums<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let StripSums {
            spectrum,
            factors,
            number,
            acting,
            width,
            odd,
            lines,
            from,
            to,
        } = self;
        let (count, waves) = (number.len(), width / 2 + 1);
        let groups = waves.div_ceil(LANES);
        let distances = spectrum.len() / groups;
        let (from_all, to_all) = (from.len() / groups, to.len() / groups);
        for (pair, line) in lines
            .chunks_exact(width)
            .take(acting.len().div_ceil(2))
            .enumerate()
        {
            for group in 0..groups {
                let [one, other] = &mut from[group * from_all + 2 * pair..][..2] else {
                    unreachable!("two were taken")
                };
                let first = group * LANES;
                for (k, here) in line[first..waves].iter().take(LANES).enumerate() {
                    let wave = first + k;
                    let there = line[if wave == 0 { 0 } else { width - wave }];
                    // The even part belongs to the real line, the odd part to the imaginary line.
                    (one[0][k], one[1][k]) = (here.re + there.re, here.im - there.im);
                    (other[0][k], other[1][k]) = (here.im + there.im, there.re - here.re);
                }
            }
        }
        for group in 0..groups {
            let sums = GroupSums {
                kernel: &spectrum[group * distances..][..distances],
                from: &from[group * from_all..][..acting.len()],
                factors,
                number,
                acting,
            };
            let to = &mut to[group * to_all..][..count];
            let mut first = 0;
            while first < count {
                // The sums of eight strips fit into the registers if these hold all waves of a group.
                let mut done = 0;
                if S::F32_LANES == LANES {
                    done = sums.leave::<S, 8>(simd, first, to);
                }
                if done == 0 {
                    done = sums.leave::<S, 4>(simd, first, to);
                }
                if done == 0 {
                    done = sums.leave::<S, 1>(simd, first, to);
                }
                first += done;
            }
        }
        for (pair, line) in lines.chunks_exact_mut(width).enumerate() {
            for group in 0..groups {
                let [one, other] = &to[group * to_all + 2 * pair..][..2] else {
                    unreachable!("two were taken")
                };
                let of = |strip: &[[f32; LANES]; 2], k: usize| match odd {
                    true => [-strip[1][k], strip[0][k]],
                    false => [strip[0][k], strip[1][k]],
                };
                let first = group * LANES;
                for k in 0..LANES.min(waves - first) {
                    let ([a, b], [c, d]) = (of(one, k), of(other, k));
                    line[first + k] = Complex::new(a - d, b + c);
                    if first + k > 0 {
                        line[width - first - k] = Complex::new(a + d, c - b);
                    }
                }
            }
        }
    }
}

/// `−dα/ds` of each strip in 1/mm, from the strips before and after it.
fn curvatures(angle: &[f64], number: &[usize], width: f64) -> Vec<f64> {
    let last = angle.len() - 1;
    let of = |j: usize| {
        let (low, high) = (j.saturating_sub(1), (j + 1).min(last));
        match number[high] - number[low] {
            0 => 0.0,
            strips => -(angle[high] - angle[low]) / (strips as f64 * width),
        }
    };
    (0..=last).map(of).collect()
}

/// Changed pressures, and the gap to be updated.
struct Changes<'a> {
    operator: &'a BentOperator,
    factors: &'a StripFactors,
    changes: &'a [(usize, f64)],
    gap: &'a mut [f64],
}

impl NullaryFnOnce for Changes<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let (nx, number) = (self.operator.nx, &self.operator.strips.number);
        for (cell, pressure) in self.changes {
            let (column, strip) = (cell % nx, cell / nx);
            for (j, row) in self.gap.chunks_exact_mut(nx).enumerate() {
                let first = number[j].abs_diff(number[strip]) * (2 * nx - 1) + nx - 1 - column;
                let line = &self.operator.coefficients[first..first + nx];
                let share = pressure * f64::from(self.factors.0[strip * number.len() + j]);
                for (gap, influence) in row.iter_mut().zip(line) {
                    *gap += share * influence;
                }
            }
        }
    }
}

/// The smallest number not below `n` with no prime factor above 5, because transforms of such lengths are fast.
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
    (n..).find(is_smooth).unwrap_or(n)
}

/// Displacement i cells along x and j cells along y away from a cell with unit pressure, stored at `j * nx + i`.
fn coefficients(nx: usize, ny: usize, dx: f64, dy: f64, contact_modulus: f64) -> Vec<f64> {
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
fn lines(nx: usize, coefficients: &[f64]) -> Vec<f64> {
    let mut lines = Vec::with_capacity(coefficients.len() / nx * (2 * nx - 1));
    for row in coefficients.chunks_exact(nx) {
        lines.extend(row[1..].iter().rev());
        lines.extend_from_slice(row);
    }
    lines
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
            lower_share: 0.5,
        }
    }

    /// Strips with a gap of five after the first seven.
    fn number(j: usize) -> usize {
        if j < 7 { j } else { j + 5 }
    }

    fn operator(strips: &BentStrips) -> BentOperator {
        let workspace = &mut BentWorkspace::default();
        BentOperator::new(CELLS[0], STEP, &steel(), strips.clone(), workspace)
    }

    /// A gauge corner: straight, then an arc of 13 mm.
    fn bent(corrected: bool, run: impl Fn(usize) -> usize) -> BentStrips {
        let angle = (0..CELLS[1]).map(|j| -0.1 - (j as f64 * STEP[1] - 1.0).max(0.0) / 13.0);
        BentStrips {
            number: (0..CELLS[1]).map(number).collect(),
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
        let curvature = curvatures(&strips.angle, &strips.number, STEP[1]);
        let pair = |k: usize, m: usize| {
            let (i, j) = (
                (k % nx) as isize - (m % nx) as isize,
                number(k / nx) as isize - number(m / nx) as isize,
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
            assert!((a - b).abs() < 3e-6 * largest, "{a} {b}");
        }
    }

    #[test]
    fn products_are_the_sums_over_pairs_of_cells() {
        let strips = bent(true, |_| 0);
        let operator = operator(&strips);
        let workspace = &mut BentWorkspace::default();
        let (p, x, s) = (loads(11), loads(5), loads(77));
        let mut gap = vec![f64::NAN; p.len()];
        let factors = operator.pressure_factors();
        operator.opened_by_pressure(&factors, &p, &mut gap, workspace);
        assert_alike(
            &gap,
            &dense(&strips, |_, _, turn, _| (1.25 * turn).cos(), &p),
        );
        let changes: Vec<(usize, f64)> = p.iter().copied().enumerate().collect();
        let mut summed = vec![0.0; p.len()];
        operator.add_opened(&factors, &changes, &mut summed);
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
        assert!((slip[0][k] / inner(&moved, k) - 1.0).abs() < 1e-5);
    }

    /// Tractions of differing bodies open the gap by the sums of their closed form, where the pressures act, and as reciprocity wants it.
    #[test]
    fn tractions_of_differing_bodies_open_the_gap() {
        let like_bodies = steel();
        let differing = Elasticity {
            difference: 0.2,
            ..like_bodies
        };
        let workspace = &mut BentWorkspace::default();
        let traction = [loads(5), loads(77)];
        let opened = |elasticity, strips: &BentStrips, workspace: &mut BentWorkspace| {
            let operator = BentOperator::new(CELLS[0], STEP, elasticity, strips.clone(), workspace);
            operator.opened_by_traction(&traction, workspace)
        };
        let displaced = |strips: &BentStrips, axis: usize, load: &[f64], sign: f64| -> Vec<f64> {
            let nx = CELLS[0];
            let pair = |k: usize, m: usize| {
                let at = [
                    (k % nx) as f64 - (m % nx) as f64,
                    number(k / nx) as f64 - number(m / nx) as f64,
                ];
                let [x, s] = displacement_by_cell(0.2, [at[0] * STEP[0], at[1] * STEP[1]], STEP);
                let factor = match strips.corrected {
                    true => (1.25 * (strips.angle[k / nx] - strips.angle[m / nx])).cos(),
                    false => f64::from(u8::from(strips.run[k / nx] == strips.run[m / nx])),
                };
                factor * sign * [x, s][axis] / 82_000.0 * load[m]
            };
            let all = load.len();
            (0..all)
                .map(|k| (0..all).map(|m| pair(k, m)).sum())
                .collect()
        };
        let sum =
            |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a + b).collect() };
        for strips in [bent(true, |_| 0), bent(false, |j| j / 4)] {
            let like = opened(&like_bodies, &strips, workspace);
            let found = opened(&differing, &strips, workspace).unwrap();
            let [x, s] = [0, 1].map(|axis| displaced(&strips, axis, &traction[axis], -1.0));
            let own = sum(&x, &s);
            let like = like.unwrap_or_else(|| vec![0.0; own.len()]);
            assert_alike(&found, &sum(&like, &own));
            let p = loads(3);
            let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
            let moved = [0, 1].map(|axis| displaced(&strips, axis, &p, 1.0));
            let work = dot(&moved[0], &traction[0]) + dot(&moved[1], &traction[1]);
            assert!((dot(&own, &p) / work - 1.0).abs() < 1e-9);
        }
    }

    /// Work of one load on the displacement of another does not depend on their order.
    #[test]
    fn influences_are_reciprocal() {
        let operator = operator(&bent(true, |_| 0));
        let workspace = &mut BentWorkspace::default();
        let (p, x, s) = (loads(3), loads(29), loads(58));
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let opened = operator.opened_by_traction(&[x.clone(), s.clone()], workspace);
        let [along, across] = operator.coupled(&p, &p, workspace).unwrap();
        let (one, other) = (
            dot(&opened.unwrap(), &p),
            dot(&along, &x) - dot(&across, &s),
        );
        assert!((one / other - 1.0).abs() < 1e-5, "{one} {other}");
    }

    #[test]
    fn runs_of_a_half_space_do_not_act_on_each_other() {
        let workspace = &mut BentWorkspace::default();
        let run = |j: usize| j / 4;
        let parted = operator(&bent(false, run));
        let p = loads(11);
        let mut gap = vec![f64::NAN; p.len()];
        parted.opened_by_pressure(&parted.pressure_factors(), &p, &mut gap, workspace);
        let all = operator(&bent(false, |_| 0));
        for k in 0..3 {
            let rows = k * 4 * CELLS[0]..(k + 1) * 4 * CELLS[0];
            let mut part = vec![0.0; p.len()];
            part[rows.clone()].copy_from_slice(&p[rows.clone()]);
            let mut alone = vec![0.0; p.len()];
            all.opened_by_pressure(&all.pressure_factors(), &part, &mut alone, workspace);
            assert_alike(&gap[rows.clone()], &alone[rows]);
        }
        assert!(parted.slip_of_pressure(&p, workspace).is_none());
    }
}
