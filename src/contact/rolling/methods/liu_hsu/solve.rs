//! The sequence of runs: the guesses of the paper, then a start from tractions of the boundary element method.

use crate::monitor::{Monitor, Stop};
use crate::numerics::simd::length;
use crate::rolling::methods::boundary_element::newton::Newton;
use crate::rolling::methods::boundary_element::task::{Convergence, NewtonTask};
use crate::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use crate::rolling::methods::liu_hsu::active_set;
use crate::rolling::methods::liu_hsu::active_set::{
    InitialGuess, ZonesRun, ZonesTermination, Zoning,
};
use crate::rolling::methods::liu_hsu::stick_block::{DenseProblem, DenseTask};
use crate::rolling::task::TOLERANCE_LEAST;

/// The results of a solve besides the tractions.
#[derive(Debug, Clone, PartialEq)]
pub struct ZonesOutcome {
    /// Residual of the final tractions, see [`Convergence`].
    pub residual: f64,
    /// The runs on the fine mesh, in order; the last one determines the outcome.
    pub attempts: Vec<ZonesRun>,
    /// Slip of every cell for the final tractions, in the layout of the equations.
    pub slip: Vec<f64>,
    /// Whether each cell slips.
    pub slips: Vec<bool>,
}

impl ZonesOutcome {
    /// The last run.
    pub fn last(&self) -> &ZonesRun {
        &self.attempts[self.attempts.len() - 1]
    }

    /// The end of the last run.
    pub fn exit(&self) -> ZonesTermination {
        self.last().exit
    }

    /// The reason for a failure, with advice, as a clause.
    pub fn advice(&self) -> String {
        let reason = self.exit().reason();
        format!("{reason}; use \"boundary_element\", which solves the same equations")
    }

    /// Number of divisions that were solved in all runs.
    pub fn outer_iterations(&self) -> u32 {
        self.attempts.iter().map(|a| a.outer_iterations).sum()
    }

    /// Number of Newton–Raphson steps in all runs.
    pub fn newton_iterations(&self) -> u32 {
        self.attempts.iter().map(|a| a.newton_iterations).sum()
    }
}

/// Solves for the tractions on the fine mesh with guess 1, then guess 2, then from the tractions of the boundary element method (see the [module](super)).
///
/// `t` receives the solution or, without convergence, the tractions with the smallest residual. Without a coarse mesh or without spin there is no pole, and guess
/// 2 is skipped.
///
/// # Errors
/// Only if the monitor stops the work; the outcome reports other failures.
pub fn solve(
    fine: &DenseTask,
    coarse: Option<&DenseTask>,
    t: &mut [f64],
    monitor: &dyn Monitor,
) -> Result<ZonesOutcome, Stop> {
    let mut search = ZonesSearch::new(fine, monitor)?;
    if !search.as_in_the_paper(coarse)? {
        search.continue_from_newton()?;
    }
    Ok(search.finish(t))
}

/// Solves with one guess. `t` is as in [`solve`].
///
/// # Errors
/// Only if the monitor stops the work.
pub fn solve_with(
    stage: &DenseTask,
    guess: InitialGuess,
    t: &mut [f64],
    monitor: &dyn Monitor,
) -> Result<ZonesOutcome, Stop> {
    let mut search = ZonesSearch::new(stage, monitor)?;
    search.attempt(guess)?;
    Ok(search.finish(t))
}

/// The spin pole from a solution on a coarse mesh with guess 1; `None` without spin or without a vortex.
///
/// # Errors
/// Only if the monitor stops the work.
pub fn coarse_pole(coarse: &DenseTask, monitor: &dyn Monitor) -> Result<Option<[f64; 2]>, Stop> {
    if coarse.motion.spin_per_mm == 0.0 {
        return Ok(None);
    }
    let task = DenseProblem::new(coarse, monitor)?;
    let (_, division) = active_set::run(&task, InitialGuess::RigidSlip, None, monitor)?;
    let load: Vec<f64> = (0..task.cells)
        .map(|i| task.bound[i] * coarse.law.area[i])
        .collect();
    Ok(vortex_centre(&division.tractions, &task.x, &task.y, &load))
}

/// The runs on one mesh with the best tractions found.
struct ZonesSearch<'a> {
    stage: &'a DenseTask<'a>,
    monitor: &'a dyn Monitor,
    task: DenseProblem,
    /// Tractions whose zones are the first ones, without padding; `None` if all cells stick at first.
    start: Option<Vec<f64>>,
    newton: Newton<'a>,
    workspace: NewtonWorkspace,
    attempts: Vec<ZonesRun>,
    best: Option<(f64, Zoning)>,
}

impl<'a> ZonesSearch<'a> {
    fn new(stage: &'a DenseTask<'a>, monitor: &'a dyn Monitor) -> Result<ZonesSearch<'a>, Stop> {
        Ok(ZonesSearch {
            stage,
            monitor,
            start: None,
            task: DenseProblem::new(stage, monitor)?,
            newton: Newton::new(stage.equations),
            workspace: NewtonWorkspace::default(),
            attempts: Vec::new(),
            best: None,
        })
    }

    /// Tries guess 1, then guess 2 about the pole of the coarse mesh; returns whether one converged.
    fn as_in_the_paper(&mut self, coarse: Option<&DenseTask>) -> Result<bool, Stop> {
        if self.attempt(InitialGuess::RigidSlip)? {
            return Ok(true);
        }
        let Some(coarse) = coarse else {
            return Ok(false);
        };
        match coarse_pole(coarse, self.monitor)? {
            Some(pole) => self.attempt(InitialGuess::SpinPole(pole)),
            None => Ok(false),
        }
    }

    /// Starts from the tractions at which the Newton iteration of the boundary element method ends.
    fn continue_from_newton(&mut self) -> Result<bool, Stop> {
        let law = NewtonTask {
            tolerance: TOLERANCE_LEAST,
            ..self.stage.law
        };
        let mut t = vec![0.0; 2 * self.stage.equations.padded()];
        let workspace = &mut self.workspace;
        self.newton.solve(&law, &mut t, workspace, self.monitor)?;
        self.start = Some(self.task.compact(&t));
        self.attempt(InitialGuess::Continued)
    }

    /// Runs the outer iteration with one guess; returns whether it converged.
    fn attempt(&mut self, guess: InitialGuess) -> Result<bool, Stop> {
        let start = self.start.as_deref();
        let (mut attempt, division) = active_set::run(&self.task, guess, start, self.monitor)?;
        let residual = self.residual(&division.tractions);
        let exact = residual <= self.stage.law.tolerance;
        if attempt.exit.converged() && !exact {
            attempt.exit = ZonesTermination::Inexact;
        }
        self.attempts.push(attempt);
        let converged = attempt.exit.converged();
        if converged
            || self
                .best
                .as_ref()
                .is_none_or(|(least, _)| residual < *least)
        {
            self.best = Some((residual, division));
        }
        Ok(converged)
    }

    /// Residual of the projected friction law, as in `boundary_element`.
    fn residual(&mut self, tractions: &[f64]) -> f64 {
        let padded = self.task.padded(tractions);
        let mut unused = Convergence::default();
        let workspace = &mut self.workspace;
        self.newton
            .evaluate(&self.stage.law, &padded, workspace, &mut unused)
    }

    fn finish(mut self, t: &mut [f64]) -> ZonesOutcome {
        let (_, division) = self.best.take().unwrap_or_else(|| {
            let tractions = vec![0.0; 2 * self.task.cells];
            let slips = vec![false; self.task.cells];
            (f64::INFINITY, Zoning { tractions, slips })
        });
        // The workspace contains the slips of the last evaluation.
        let residual = self.residual(&division.tractions);
        t.copy_from_slice(&self.task.padded(&division.tractions));
        ZonesOutcome {
            residual,
            attempts: self.attempts,
            slip: self.workspace.slip().to_vec(),
            slips: division.slips,
        }
    }
}

/// The point around which tractions turn: the least-squares solution of `n·(x − x_p) = 0` over all cells, with `n = T/|T|` and the load of each cell as `weight`.
///
/// `t` has x of all cells before y. `None` if the tractions do not turn, because all are parallel or 0; the pole is then far from the patch.
pub fn vortex_centre(t: &[f64], x: &[f64], y: &[f64], weight: &[f64]) -> Option<[f64; 2]> {
    let n = x.len();
    let (mut xx, mut xy, mut yy, mut rhs) = (0.0, 0.0, 0.0, [0.0; 2]);
    for i in 0..n {
        let size = length(t[i], t[n + i]);
        if size == 0.0 || !size.is_finite() {
            continue;
        }
        let (nx, ny) = (t[i] / size, t[n + i] / size);
        let along = weight[i] * (nx * x[i] + ny * y[i]);
        xx += weight[i] * nx * nx;
        xy += weight[i] * nx * ny;
        yy += weight[i] * ny * ny;
        rhs[0] += along * nx;
        rhs[1] += along * ny;
    }
    let determinant = xx * yy - xy * xy;
    // (xx + yy)² = 4 × determinant for tractions in all directions alike, and determinant = 0 for parallel ones.
    if determinant <= 1e-6 * (xx + yy).powi(2) {
        return None;
    }
    Some([
        (yy * rhs[0] - xy * rhs[1]) / determinant,
        (xx * rhs[1] - xy * rhs[0]) / determinant,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> (Vec<f64>, Vec<f64>) {
        let at = |k: usize| -1.0 + 0.4 * k as f64;
        (0..36).map(|k| (at(k % 6), at(k / 6))).unzip()
    }

    #[test]
    fn a_rigid_rotation_has_its_vortex_at_its_centre() {
        let (x, y) = grid();
        let weight: Vec<f64> = (0..36).map(|i| 1.0 + f64::from(i % 5)).collect();
        for [px, py] in [[0.13, -0.4], [3.0, 1.0]] {
            for sign in [-1.0, 1.0] {
                let tx = y.iter().map(|y| -sign * (y - py));
                let t: Vec<f64> = tx.chain(x.iter().map(|x| sign * (x - px))).collect();
                let [cx, cy] = vortex_centre(&t, &x, &y, &weight).unwrap();
                assert!((cx - px).abs() < 1e-10 && (cy - py).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn parallel_tractions_have_no_vortex() {
        let (x, y) = grid();
        let t: Vec<f64> = (0..72).map(|i| if i < 36 { 0.6 } else { -0.8 }).collect();
        assert_eq!(vortex_centre(&t, &x, &y, &[1.0; 36]), None);
        assert_eq!(vortex_centre(&[0.0; 72], &x, &y, &[1.0; 36]), None);
    }
}
