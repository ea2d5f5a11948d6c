//! Loops over all cells of the conjugate gradients in SIMD lanes.

use pulp::{Simd, WithSimd};

use crate::numerics::simd;

/// Computes `g = u + h`; returns the weighted sum of g over the contact, and the sum of the weights.
pub(crate) struct Distances<'a> {
    pub(crate) distance: &'a mut [f64],
    pub(crate) displacement: &'a [f64],
    pub(crate) gap: &'a [f64],
    pub(crate) pressure: &'a [f64],
    /// How much the distance of each cell counts in the direction of steepest descent.
    pub(crate) weights: &'a [f64],
}

/// Subtracts the approach from the distances; returns their largest violation, and in the contact the weighted sums of their squares and of their products with the
/// displacement of the last direction.
pub(crate) struct Parting<'a> {
    pub(crate) distance: &'a mut [f64],
    pub(crate) displacement: &'a [f64],
    pub(crate) pressure: &'a [f64],
    /// How much the distance of each cell counts in the direction of steepest descent.
    pub(crate) weights: &'a [f64],
    pub(crate) approach: f64,
}

/// Computes the next direction: steepest descent plus a multiple of the last direction, 0 outside the contact.
pub(crate) struct Direction<'a> {
    pub(crate) direction: &'a mut [f64],
    pub(crate) distance: &'a [f64],
    pub(crate) pressure: &'a [f64],
    /// How much the distance of each cell counts in the direction of steepest descent.
    pub(crate) weights: &'a [f64],
    pub(crate) factor: f64,
}

/// Sums over the contact for the step length: distance times direction, displacement times direction, direction, weighted displacement, weights.
pub(crate) struct StepSums<'a> {
    pub(crate) distance: &'a [f64],
    pub(crate) direction: &'a [f64],
    pub(crate) displacement: &'a [f64],
    pub(crate) pressure: &'a [f64],
    /// How much the distance of each cell counts in the direction of steepest descent.
    pub(crate) weights: &'a [f64],
}

/// Takes a step along a direction in all pressures. Outside the contact, and where a cell leaves it, the pressure becomes 0 or follows from the overlap; `off` is the
/// difference from the full step.
pub(crate) struct Advance<'a> {
    pub(crate) pressure: &'a mut [f64],
    pub(crate) off: &'a mut [f64],
    pub(crate) direction: &'a [f64],
    pub(crate) distance: &'a [f64],
    /// How much the distance of each cell counts in the direction of steepest descent.
    pub(crate) weights: &'a [f64],
    pub(crate) step: f64,
}

/// Sum over all cells.
pub(crate) struct CellSum<'a>(pub(crate) &'a [f64]);

/// Runs a loop in the SIMD lanes of the machine.
pub(crate) fn run<W: WithSimd>(work: W) -> W::Output {
    simd::dispatch(work)
}

impl WithSimd for Distances<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [f64; 2] {
        let zero = simd.splat_f64s(0.0);
        let (mut sum, mut count) = (zero, zero);
        let (g, _) = S::as_mut_simd_f64s(self.distance);
        let [u, h, p, weights] = [self.displacement, self.gap, self.pressure, self.weights]
            .map(|values| &S::as_simd_f64s(values).0[..g.len()]);
        for k in 0..g.len() {
            g[k] = simd.add_f64s(u[k], h[k]);
            let inside = simd.greater_than_f64s(p[k], zero);
            let weight = simd.select_f64s(inside, weights[k], zero);
            // Outside the contact a gap may be infinite.
            let own = simd.select_f64s(inside, g[k], zero);
            sum = simd.mul_add_e_f64s(weight, own, sum);
            count = simd.add_f64s(count, weight);
        }
        [sum, count].map(|sums| simd.reduce_sum_f64s(sums))
    }
}

impl WithSimd for Parting<'_> {
    type Output = [f64; 3];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [f64; 3] {
        let zero = simd.splat_f64s(0.0);
        let approach = simd.splat_f64s(self.approach);
        let (mut violation, mut square, mut along) = (zero, zero, zero);
        let (g, _) = S::as_mut_simd_f64s(self.distance);
        let [r, p, weights] = [self.displacement, self.pressure, self.weights]
            .map(|values| &S::as_simd_f64s(values).0[..g.len()]);
        for k in 0..g.len() {
            let here = simd.sub_f64s(g[k], approach);
            g[k] = here;
            let inside = simd.greater_than_f64s(p[k], zero);
            let [apart, over] = [simd.abs_f64s(here), simd.neg_f64s(here)];
            violation = simd.max_f64s(violation, simd.select_f64s(inside, apart, over));
            let own = simd.select_f64s(inside, here, zero);
            let weighted = simd.mul_f64s(weights[k], own);
            square = simd.mul_add_e_f64s(weighted, own, square);
            along = simd.mul_add_e_f64s(weighted, r[k], along);
        }
        [
            simd.reduce_max_f64s(violation),
            simd.reduce_sum_f64s(square),
            simd.reduce_sum_f64s(along),
        ]
    }
}

impl WithSimd for Direction<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let zero = simd.splat_f64s(0.0);
        let factor = simd.splat_f64s(self.factor);
        let (t, _) = S::as_mut_simd_f64s(self.direction);
        let [g, p, weights] = [self.distance, self.pressure, self.weights]
            .map(|values| &S::as_simd_f64s(values).0[..t.len()]);
        for k in 0..t.len() {
            let next = simd.mul_add_e_f64s(weights[k], g[k], simd.mul_f64s(factor, t[k]));
            let inside = simd.greater_than_f64s(p[k], zero);
            t[k] = simd.select_f64s(inside, next, zero);
        }
    }
}

impl WithSimd for StepSums<'_> {
    type Output = [f64; 5];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [f64; 5] {
        let zero = simd.splat_f64s(0.0);
        let mut sums = [zero; 5];
        let (p, _) = S::as_simd_f64s(self.pressure);
        let [g, t, r, weights] = [
            self.distance,
            self.direction,
            self.displacement,
            self.weights,
        ]
        .map(|values| &S::as_simd_f64s(values).0[..p.len()]);
        for k in 0..p.len() {
            let inside = simd.greater_than_f64s(p[k], zero);
            let own = simd.select_f64s(inside, g[k], zero);
            let weight = simd.select_f64s(inside, weights[k], zero);
            let along = simd.select_f64s(inside, t[k], zero);
            sums = [
                simd.mul_add_e_f64s(along, own, sums[0]),
                simd.mul_add_e_f64s(along, r[k], sums[1]),
                simd.add_f64s(along, sums[2]),
                simd.mul_add_e_f64s(weight, r[k], sums[3]),
                simd.add_f64s(weight, sums[4]),
            ];
        }
        sums.map(|sums| simd.reduce_sum_f64s(sums))
    }
}

impl WithSimd for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let zero = simd.splat_f64s(0.0);
        let back = simd.splat_f64s(-self.step);
        let (p, _) = S::as_mut_simd_f64s(self.pressure);
        let off = &mut S::as_mut_simd_f64s(self.off).0[..p.len()];
        let [t, g, weights] = [self.direction, self.distance, self.weights]
            .map(|values| &S::as_simd_f64s(values).0[..p.len()]);
        for k in 0..p.len() {
            let stepped = simd.mul_add_e_f64s(back, t[k], p[k]);
            let overlap = simd.min_f64s(g[k], zero);
            let other = simd.mul_f64s(simd.mul_f64s(back, weights[k]), overlap);
            // Of a cell outside neither the pressure nor the step is more than 0.
            let was = simd.greater_than_f64s(p[k], zero);
            let stepped_in = simd.select_f64s(was, stepped, zero);
            let stays = simd.greater_than_f64s(stepped_in, zero);
            let next = simd.select_f64s(stays, stepped, other);
            p[k] = next;
            off[k] = simd.sub_f64s(next, stepped);
        }
    }
}

impl WithSimd for CellSum<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let mut sum = simd.splat_f64s(0.0);
        for values in S::as_simd_f64s(self.0).0 {
            sum = simd.add_f64s(sum, *values);
        }
        simd.reduce_sum_f64s(sum)
    }
}
