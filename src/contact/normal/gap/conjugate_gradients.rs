//! Pressure on a regular grid by conjugate gradients that never leave the contact conditions.
//!
//! The unknowns satisfy `p ≥ 0`, `g = u(p) + h − δ ≥ 0` and `p g = 0` at every cell; either the sum of p or the approach δ is
//! prescribed (Polonsky and Keer 1999). Cells may differ in size: scalar products are weighted with their areas, and
//! distances are scaled by what a cell's own pressure displaces, so that small cells take no more iterations than large ones.

use crate::contact::half_space::grid_operator::{GridOperator, GridWorkspace};
use crate::contact::half_space::transforms::FftFloat;
use crate::contact::monitor::{Monitor, Stop};
use crate::contact::normal::hertz::NormalLoad;

/// Displacements that pressures on cells cause, cells of one size or of several.
pub(crate) trait PressureInfluence {
    /// Up to so many changed pressures are added to the displacement one by one, which costs less than a whole product.
    const CHANGES_MAX: usize;
    /// Buffers of a product.
    type Workspace;
    /// Displacement in mm at every centre for pressures in MPa.
    fn apply(&self, pressure: &[f64], displacement: &mut [f64], workspace: &mut Self::Workspace);
    /// Adds the displacement in mm for changed pressures in MPa, cell by cell; never more than `CHANGES_MAX`.
    fn add(&self, changes: &[(usize, f64)], displacement: &mut [f64]);
    /// Displacement in mm/MPa of the first cell by its own pressure.
    fn own(&self) -> f64;
    /// Area of a cell relative to that of the first one.
    fn area(&self, cell: usize) -> f64;
    /// Displacement of the first cell by its own pressure relative to that of this one: distances times this are the direction
    /// of steepest descent for cells of several sizes.
    fn yielding(&self, cell: usize) -> f64;
}

impl<T: FftFloat> PressureInfluence for GridOperator<T> {
    const CHANGES_MAX: usize = 12;
    type Workspace = GridWorkspace<T>;

    fn apply(&self, pressure: &[f64], displacement: &mut [f64], workspace: &mut GridWorkspace<T>) {
        GridOperator::apply(self, pressure, displacement, workspace);
    }

    fn add(&self, changes: &[(usize, f64)], displacement: &mut [f64]) {
        for (cell, pressure) in changes {
            GridOperator::add(self, *cell, *pressure, displacement);
        }
    }

    fn own(&self) -> f64 {
        GridOperator::own(self)
    }

    #[inline]
    fn area(&self, _cell: usize) -> f64 {
        1.0
    }

    #[inline]
    fn yielding(&self, _cell: usize) -> f64 {
        1.0
    }
}

/// Iterations after which something is wrong: smooth gaps take 10 to 30, rough ones up to about 100.
const ITERATIONS_MAX: u32 = 500;

/// Pressures, distances and approach of two bodies pressed together, and how well they meet the contact conditions.
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
    /// Largest violation of the contact conditions: |g| in contact, −g outside, relative to the deepest overlap of the
    /// undeformed surfaces.
    pub(crate) residual: f64,
}

impl PressureAnswer {
    /// The largest pressure in MPa.
    pub(crate) fn largest(&self) -> f64 {
        self.pressure.iter().copied().fold(0.0, f64::max)
    }
}

/// Why there is no pressure.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum PressureFailure {
    /// The iteration ended with this residual.
    NotConverged(f64),
    /// The caller stopped the work.
    Stopped(Stop),
}

/// What is asked of the pressure on a grid.
pub(crate) struct PressureTask<'a> {
    /// Gap of the undeformed surfaces at every cell in mm.
    pub(crate) gap: &'a [f64],
    /// Area of the first cell in mm².
    pub(crate) cell: f64,
    pub(crate) loading: NormalLoad,
    /// Violation of the contact conditions to reach, see [`PressureAnswer::residual`].
    pub(crate) tolerance: f64,
}

/// Solves for the pressure under which the surfaces touch.
///
/// `start` is any pressure that is not 0 everywhere; it decides the number of iterations only.
pub(crate) fn solve_pressure<I: PressureInfluence>(
    task: &PressureTask,
    influence: &I,
    start: Vec<f64>,
    workspace: &mut I::Workspace,
    monitor: &dyn Monitor,
) -> Result<PressureAnswer, PressureFailure> {
    let PressureTask {
        gap,
        cell,
        loading,
        tolerance,
    } = *task;
    let least = gap.iter().copied().fold(f64::INFINITY, f64::min);
    let n = gap.len();
    let mut work = PressureIterate {
        p: start,
        u: vec![0.0; n],
        g: vec![0.0; n],
        t: vec![0.0; n],
        r: vec![0.0; n],
        changes: Vec::new(),
    };
    work.scale_to(influence, loading, cell);
    influence.apply(&work.p, &mut work.u, workspace);
    let (mut follow, mut last) = (false, 1.0);
    let mut residual = f64::INFINITY;
    for iterations in 0..ITERATIONS_MAX {
        if let std::ops::ControlFlow::Break(stop) = monitor.tick(0.0) {
            return Err(PressureFailure::Stopped(stop));
        }
        let approach = work.distances(influence, gap, loading);
        let (violation, square) = work.part_from(influence, approach);
        residual = violation / (approach - least);
        if residual <= tolerance && approach > least {
            return Ok(PressureAnswer {
                pressure: work.p,
                distance: work.g,
                approach,
                iterations,
                residual,
            });
        }
        let factor = if follow { square / last } else { 0.0 };
        last = square;
        work.direction(influence, factor);
        influence.apply(&work.t, &mut work.r, workspace);
        let step = work.step(influence, loading);
        follow = work.advance(influence, step);
        if work.changes.len() <= I::CHANGES_MAX {
            influence.add(&work.changes, &mut work.u);
            let scale = work.scale_to(influence, loading, cell);
            work.u.iter_mut().for_each(|u| *u *= scale);
        } else {
            work.scale_to(influence, loading, cell);
            influence.apply(&work.p, &mut work.u, workspace);
        }
    }
    Err(PressureFailure::NotConverged(residual))
}

struct PressureIterate {
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

impl PressureIterate {
    /// Scales the pressures to the prescribed force; returns the factor.
    fn scale_to(
        &mut self,
        influence: &impl PressureInfluence,
        loading: NormalLoad,
        cell: f64,
    ) -> f64 {
        let NormalLoad::Force(force) = loading else {
            return 1.0;
        };
        let [sum] = sums(self.p.len(), |k| [influence.area(k) * self.p[k]]);
        let scale = force / (cell * sum);
        self.p.iter_mut().for_each(|p| *p *= scale);
        scale
    }

    /// Puts `u + h` into the distances and returns the approach δ; with a force it makes the mean over the contact 0.
    fn distances(
        &mut self,
        influence: &impl PressureInfluence,
        gap: &[f64],
        loading: NormalLoad,
    ) -> f64 {
        for ((g, u), h) in self.g.iter_mut().zip(&self.u).zip(gap) {
            *g = u + h;
        }
        match loading {
            NormalLoad::Force(_) => {
                let [sum, count] = self.inside(|k| {
                    let weight = influence.area(k) * influence.yielding(k);
                    [weight * self.g[k], weight]
                });
                sum / count
            }
            NormalLoad::Approach(approach) => approach,
        }
    }

    /// Subtracts the approach from the distances; returns their largest violation and the sum of their squares in the contact.
    fn part_from(&mut self, influence: &impl PressureInfluence, approach: f64) -> (f64, f64) {
        let mut violation = 0.0_f64;
        for (g, p) in self.g.iter_mut().zip(&self.p) {
            *g -= approach;
            violation = violation.max(if *p > 0.0 { g.abs() } else { -*g });
        }
        let [square] =
            self.inside(|k| [influence.area(k) * influence.yielding(k) * (self.g[k] * self.g[k])]);
        (violation, square)
    }

    fn direction(&mut self, influence: &impl PressureInfluence, factor: f64) {
        for (k, ((t, g), p)) in self.t.iter_mut().zip(&self.g).zip(&self.p).enumerate() {
            *t = if *p > 0.0 {
                influence.yielding(k) * g + factor * *t
            } else {
                0.0
            };
        }
    }

    /// Length of the step that leaves no distance along the direction.
    fn step(&self, influence: &impl PressureInfluence, loading: NormalLoad) -> f64 {
        let (g, t, r) = (&self.g, &self.t, &self.r);
        let [above, product, along, sum, count] = self.inside(|k| {
            let area = influence.area(k);
            let weight = area * influence.yielding(k);
            [
                area * (g[k] * t[k]),
                area * (r[k] * t[k]),
                area * t[k],
                weight * r[k],
                weight,
            ]
        });
        let below = match loading {
            NormalLoad::Force(_) => product - sum / count * along,
            NormalLoad::Approach(_) => product,
        };
        // A single cell under a force leaves nothing to minimise; a step by its own stiffness lets other cells in.
        if below > 0.0 && above > 0.0 {
            above / below
        } else {
            1.0 / influence.own()
        }
    }

    /// Takes the step, and records the cells whose pressure had to be changed otherwise. Returns whether the next direction may be
    /// conjugate to this one: no cell came into contact.
    fn advance(&mut self, influence: &impl PressureInfluence, step: f64) -> bool {
        let mut follow = true;
        self.changes.clear();
        for (k, p) in self.p.iter_mut().enumerate() {
            let stepped = *p - step * self.t[k];
            if *p > 0.0 && stepped > 0.0 {
                *p = stepped;
                continue;
            }
            // Outside, and what has just left the contact although the bodies overlap there.
            *p = if self.g[k] < 0.0 {
                follow = false;
                -step * influence.yielding(k) * self.g[k]
            } else {
                0.0
            };
            if *p != stepped {
                self.changes.push((k, *p - stepped));
            }
        }
        for (u, r) in self.u.iter_mut().zip(&self.r) {
            *u -= step * r;
        }
        follow
    }

    /// Sums over the cells in contact.
    fn inside<const N: usize>(&self, term: impl Fn(usize) -> [f64; N]) -> [f64; N] {
        sums(self.p.len(), |k| {
            let inside = f64::from(u8::from(self.p[k] > 0.0));
            term(k).map(|value| inside * value)
        })
    }
}

/// Sums of several terms over `0..n`, in four chains: one would wait for each addition.
fn sums<const N: usize>(n: usize, term: impl Fn(usize) -> [f64; N]) -> [f64; N] {
    let mut chains = [[0.0; N]; 4];
    let mut add = |chain: usize, k: usize| {
        for (sum, value) in chains[chain].iter_mut().zip(term(k)) {
            *sum += value;
        }
    };
    let whole = n - n % 4;
    for k in (0..whole).step_by(4) {
        for chain in 0..4 {
            add(chain, k + chain);
        }
    }
    for k in whole..n {
        add(0, k);
    }
    std::array::from_fn(|m| chains.iter().map(|chain| chain[m]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::monitor::Unmonitored;

    const CELLS: usize = 24;
    const STEP: f64 = 0.5;
    const MODULUS: f64 = 115_000.0;

    fn paraboloid() -> Vec<f64> {
        let at = |i: usize| (i as f64 - 11.3) * STEP;
        (0..CELLS * CELLS)
            .map(|k| at(k % CELLS).powi(2) / 900.0 + at(k / CELLS).powi(2) / 600.0)
            .collect()
    }

    fn solved(loading: NormalLoad, start: Vec<f64>) -> PressureAnswer {
        let mut workspace = GridWorkspace::<f64>::default();
        let influence = GridOperator::new([CELLS; 2], [STEP; 2], MODULUS, &mut workspace);
        let task = PressureTask {
            gap: &paraboloid(),
            cell: STEP * STEP,
            loading,
            tolerance: 1e-9,
        };
        solve_pressure(&task, &influence, start, &mut workspace, &Unmonitored).unwrap()
    }

    #[test]
    fn a_tolerance_that_cannot_be_met_is_said() {
        let mut workspace = GridWorkspace::<f64>::default();
        let influence = GridOperator::new([CELLS; 2], [STEP; 2], MODULUS, &mut workspace);
        let task = PressureTask {
            gap: &paraboloid(),
            cell: STEP * STEP,
            loading: NormalLoad::Force(5e4),
            tolerance: -1.0,
        };
        let start = vec![1.0; CELLS * CELLS];
        match solve_pressure(&task, &influence, start, &mut workspace, &Unmonitored) {
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
            assert!(*p >= 0.0 && *g >= -1e-8 * depth);
            assert!(*p == 0.0 || g.abs() < 1e-8 * depth, "{p} {g}");
        }
    }
}
