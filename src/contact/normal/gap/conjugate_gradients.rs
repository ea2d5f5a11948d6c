//! Pressure on a regular grid by conjugate gradients whose iterates satisfy the sign conditions.
//!
//! The solution satisfies `p ≥ 0`, `g = u(p) + h − δ ≥ 0` and `p g = 0` at every cell; either the sum of p or the approach δ is prescribed (Polonsky and Keer 1999).
//! Distances may be scaled by the displacement of a cell by its own pressure.

use crate::half_space::bent_surface::{BentOperator, BentWorkspace, StripFactors};
use crate::monitor::{Monitor, Stop};
use crate::normal::hertz::NormalLoad;

/// Largest number of changed pressures whose displacements are added one by one, which costs less than a product.
const CHANGES_MAX: usize = 80;

/// The influence of pressures multiplied by weights of their strips. On a surface that bends, a uniform approach of these lowers the wheel.
pub(crate) struct WeightedStrips<'a> {
    operator: &'a BentOperator,
    factors: StripFactors,
    weights: &'a [f64],
}

impl WeightedStrips<'_> {
    /// The influence on the strips of an operator, with a weight for each strip.
    pub(crate) fn new<'a>(operator: &'a BentOperator, weights: &'a [f64]) -> WeightedStrips<'a> {
        WeightedStrips {
            factors: operator.weighted_pressure_factors(weights),
            operator,
            weights,
        }
    }

    /// Displacement in mm at every centre for pressures in MPa.
    fn apply(&self, pressure: &[f64], displacement: &mut [f64], workspace: &mut BentWorkspace) {
        self.operator
            .opened_by_pressure(&self.factors, pressure, displacement, workspace);
    }

    /// Displacement in mm/MPa of the first cell by its own pressure.
    fn own(&self) -> f64 {
        self.operator.own() / self.weights[0].powi(2)
    }

    /// The displacement of the first cell by its own pressure over that of each cell. Distances times these weights are the direction of steepest descent.
    fn of_cells(&self, cells: usize) -> Vec<f64> {
        let width = cells / self.weights.len();
        let rows = self.weights.iter();
        let rows = rows.map(|weight| (weight / self.weights[0]).powi(2));
        rows.flat_map(|weight| std::iter::repeat_n(weight, width))
            .collect()
    }
}

/// Largest number of iterations. Smooth gaps take 10 to 30, rough ones up to about 100.
const ITERATIONS_MAX: u32 = 500;

/// The solution for two bodies pressed together, and its residual.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PressureAnswer {
    /// Pressure of every cell in MPa.
    pub(crate) pressure: Vec<f64>,
    /// Distance of the deformed surfaces at every cell in mm; about 0 in contact.
    pub(crate) distance: Vec<f64>,
    /// Approach in mm.
    pub(crate) approach: f64,
    /// Iterations done.
    pub(crate) iterations: u32,
    /// Largest violation of the contact conditions (|g| in contact, −g outside), relative to the deepest overlap of the undeformed surfaces.
    pub(crate) residual: f64,
}

impl PressureAnswer {
    /// The largest pressure in MPa.
    pub(crate) fn largest(&self) -> f64 {
        self.pressure.iter().copied().fold(0.0, f64::max)
    }
}

/// The reason why there is no pressure.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum PressureFailure {
    /// The iteration did not converge; the least residual.
    NotConverged(f64),
    /// The monitor stopped the work.
    Stopped(Stop),
}

/// The problem on a grid.
pub(crate) struct PressureTask<'a> {
    /// Gap of the undeformed surfaces at every cell in mm.
    pub(crate) gap: &'a [f64],
    /// Area of a cell in mm².
    pub(crate) cell: f64,
    pub(crate) loading: NormalLoad,
    /// Violation of the contact conditions to reach, see [`PressureAnswer::residual`].
    pub(crate) tolerance: f64,
}

/// Solves for the pressure under which the surfaces touch.
///
/// `start` is any pressure that is not 0 everywhere. It only affects the number of iterations.
pub(crate) fn solve_pressure(
    task: &PressureTask,
    influence: &WeightedStrips,
    start: Vec<f64>,
    workspace: &mut BentWorkspace,
    monitor: &dyn Monitor,
) -> Result<PressureAnswer, PressureFailure> {
    let PressureTask {
        gap,
        cell,
        loading,
        tolerance,
    } = *task;
    let least = gap.iter().copied().fold(f64::INFINITY, f64::min);
    let mut work = PressureIterate::new(gap, start, influence.of_cells(gap.len()));
    work.scale_to(loading, cell);
    influence.apply(&work.p, &mut work.u, workspace);
    let mut below = f64::INFINITY;
    let mut least_residual = f64::INFINITY;
    for iterations in 0..ITERATIONS_MAX {
        if let std::ops::ControlFlow::Break(stop) = monitor.tick(0.0) {
            return Err(PressureFailure::Stopped(stop));
        }
        let approach = work.distances(loading);
        let [violation, square, along] = work.part_from(approach);
        if !square.is_finite() {
            break;
        }
        let residual = violation / (approach - least);
        least_residual = least_residual.min(residual);
        if residual <= tolerance && approach > least {
            return Ok(PressureAnswer {
                pressure: work.p,
                distance: work.g,
                approach,
                iterations,
                residual,
            });
        }
        // Conjugate to the last direction, although cells may have come into contact or left it; 0 in the first step.
        let factor = (-along / below).max(0.0);
        let step;
        [step, below] = work.step_after(factor, influence, loading, workspace);
        work.advance(step);
        if work.changes.len() <= CHANGES_MAX {
            for (u, r) in work.u.iter_mut().zip(&work.r) {
                *u -= step * r;
            }
            influence
                .operator
                .add_opened(&influence.factors, &work.changes, &mut work.u);
            let scale = work.scale_to(loading, cell);
            if scale != 1.0 {
                work.u.iter_mut().for_each(|u| *u *= scale);
            }
        } else {
            work.scale_to(loading, cell);
            influence.apply(&work.p, &mut work.u, workspace);
        }
    }
    Err(PressureFailure::NotConverged(least_residual))
}

/// The vectors of the iteration over all cells.
struct PressureIterate<'a> {
    /// Gap of the undeformed surfaces.
    h: &'a [f64],
    weights: Vec<f64>,
    /// Pressure and displacement.
    p: Vec<f64>,
    u: Vec<f64>,
    /// Distance of the deformed surfaces.
    g: Vec<f64>,
    /// Direction of the step, 0 outside the contact, and its displacement.
    t: Vec<f64>,
    r: Vec<f64>,
    /// Cells whose pressure differs from that of the full step, with the difference.
    changes: Vec<(usize, f64)>,
}

impl PressureIterate<'_> {
    fn new(h: &[f64], p: Vec<f64>, weights: Vec<f64>) -> PressureIterate<'_> {
        let zeros = || vec![0.0; h.len()];
        PressureIterate {
            h,
            weights,
            p,
            u: zeros(),
            g: zeros(),
            t: zeros(),
            r: zeros(),
            changes: Vec::new(),
        }
    }

    /// Scales the pressures to the prescribed force; returns the factor.
    fn scale_to(&mut self, loading: NormalLoad, cell: f64) -> f64 {
        let NormalLoad::Force(force) = loading else {
            return 1.0;
        };
        let scale = force / (cell * self.p.iter().sum::<f64>());
        self.p.iter_mut().for_each(|p| *p *= scale);
        scale
    }

    /// Computes `g = u + h` and returns the approach δ; with a force it is the weighted mean of g over the contact.
    fn distances(&mut self, loading: NormalLoad) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for k in 0..self.p.len() {
            self.g[k] = self.u[k] + self.h[k];
            if self.p[k] > 0.0 {
                sum += self.weights[k] * self.g[k];
                count += self.weights[k];
            }
        }
        match loading {
            NormalLoad::Force(_) => sum / count,
            NormalLoad::Approach(approach) => approach,
        }
    }

    /// Subtracts the approach from the distances. Returns their largest violation, and in the contact the weighted sums of their squares and of their products with the
    /// displacement of the last direction.
    fn part_from(&mut self, approach: f64) -> [f64; 3] {
        let (mut violation, mut square, mut along) = (0.0_f64, 0.0, 0.0);
        for (k, g) in self.g.iter_mut().enumerate() {
            *g -= approach;
            if self.p[k] > 0.0 {
                violation = violation.max(g.abs());
                square += self.weights[k] * *g * *g;
                along += self.weights[k] * *g * self.r[k];
            } else {
                violation = violation.max(-*g);
            }
        }
        [violation, square, along]
    }

    /// Computes the next direction: steepest descent plus a multiple of the last direction, 0 outside the contact.
    fn direct(&mut self, factor: f64) {
        for (k, t) in self.t.iter_mut().enumerate() {
            *t = match self.p[k] > 0.0 {
                true => self.weights[k] * self.g[k] + factor * *t,
                false => 0.0,
            };
        }
    }

    /// Chooses the direction and computes its displacement. Returns the step length and the curvature `tᵀAt` along the direction.
    ///
    /// Cells that left the contact change the conjugate direction. If it no longer lowers the energy, steepest descent replaces it.
    fn step_after(
        &mut self,
        factor: f64,
        influence: &WeightedStrips,
        loading: NormalLoad,
        workspace: &mut BentWorkspace,
    ) -> [f64; 2] {
        for factor in [factor, 0.0] {
            self.direct(factor);
            influence.apply(&self.t, &mut self.r, workspace);
            if let Some(step) = self.step(loading) {
                return step;
            }
            if factor == 0.0 {
                break;
            }
        }
        // A single cell under a force has nothing to minimise. A step with its own stiffness brings other cells into contact.
        [1.0 / influence.own(), f64::INFINITY]
    }

    /// The step length and the curvature along the direction, if the direction lowers the energy.
    fn step(&self, loading: NormalLoad) -> Option<[f64; 2]> {
        let (mut above, mut product, mut along) = (0.0, 0.0, 0.0);
        let (mut sum, mut count) = (0.0, 0.0);
        for k in (0..self.p.len()).filter(|k| self.p[*k] > 0.0) {
            let (t, r, weight) = (self.t[k], self.r[k], self.weights[k]);
            above += t * self.g[k];
            product += t * r;
            along += t;
            sum += weight * r;
            count += weight;
        }
        let below = match loading {
            NormalLoad::Force(_) => product - sum / count * along,
            NormalLoad::Approach(_) => product,
        };
        (below > 0.0 && above > 0.0).then(|| [above / below, below])
    }

    /// Takes the step and records the cells whose pressure differs from the full step. Outside the contact, and where a cell leaves it, the pressure becomes 0 or follows from
    /// the overlap.
    fn advance(&mut self, step: f64) {
        self.changes.clear();
        for (k, p) in self.p.iter_mut().enumerate() {
            let stepped = *p - step * self.t[k];
            let next = match *p > 0.0 && stepped > 0.0 {
                true => stepped,
                false => -step * self.weights[k] * self.g[k].min(0.0),
            };
            *p = next;
            if next != stepped {
                self.changes.push((k, next - stepped));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::Unmonitored;

    const CELLS: usize = 24;
    const STEP: f64 = 0.5;
    const MODULUS: f64 = 115_000.0;

    fn paraboloid() -> Vec<f64> {
        let at = |i: usize| (i as f64 - 11.3) * STEP;
        (0..CELLS * CELLS)
            .map(|k| at(k % CELLS).powi(2) / 900.0 + at(k / CELLS).powi(2) / 600.0)
            .collect()
    }

    fn pressed(
        loading: NormalLoad,
        tolerance: f64,
        start: Vec<f64>,
    ) -> Result<PressureAnswer, PressureFailure> {
        let workspace = &mut BentWorkspace::default();
        let operator = BentOperator::flat([CELLS; 2], [STEP; 2], MODULUS, workspace);
        let task = PressureTask {
            gap: &paraboloid(),
            cell: STEP * STEP,
            loading,
            tolerance,
        };
        let influence = WeightedStrips::new(&operator, &[1.0; CELLS]);
        solve_pressure(&task, &influence, start, workspace, &Unmonitored)
    }

    fn solved(loading: NormalLoad, start: Vec<f64>) -> PressureAnswer {
        pressed(loading, 1e-6, start).unwrap()
    }

    #[test]
    fn a_tolerance_that_cannot_be_met_is_said() {
        match pressed(NormalLoad::Force(5e4), -1.0, vec![1.0; CELLS * CELLS]) {
            Err(PressureFailure::NotConverged(residual)) => assert!(residual < 1e-6, "{residual}"),
            Err(PressureFailure::Stopped(_)) => panic!("stopped"),
            Ok(pressed) => panic!("{}", pressed.residual),
        }
    }

    #[test]
    fn the_start_does_not_decide_the_pressure() {
        let even = solved(NormalLoad::Force(5e4), vec![1.0; CELLS * CELLS]);
        let mut corner = vec![0.0; CELLS * CELLS];
        corner[3] = 7.0;
        let far = solved(NormalLoad::Force(5e4), corner);
        let largest = even.pressure.iter().copied().fold(0.0, f64::max);
        for (a, b) in even.pressure.iter().zip(&far.pressure) {
            assert!((a - b).abs() < 1e-5 * largest, "{a} {b}");
        }
        assert!((even.pressure.iter().sum::<f64>() * STEP * STEP / 5e4 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn force_and_approach_are_two_names_for_one_contact() {
        let by_force = solved(NormalLoad::Force(5e4), vec![1.0; CELLS * CELLS]);
        let approach = NormalLoad::Approach(by_force.approach);
        let by_approach = solved(approach, vec![1.0; CELLS * CELLS]);
        let sum = |pressed: &PressureAnswer| pressed.pressure.iter().sum::<f64>();
        assert!((sum(&by_approach) / sum(&by_force) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn nothing_overlaps_and_only_touching_cells_press() {
        let pressed = solved(NormalLoad::Force(5e4), vec![1.0; CELLS * CELLS]);
        let depth = pressed.approach;
        for (p, g) in pressed.pressure.iter().zip(&pressed.distance) {
            assert!(*p >= 0.0 && *g >= -2e-6 * depth);
            assert!(*p == 0.0 || g.abs() < 2e-6 * depth, "{p} {g}");
        }
    }
}
