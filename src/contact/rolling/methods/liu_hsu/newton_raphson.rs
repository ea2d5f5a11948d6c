//! Newton–Raphson for the tractions of the slip cells (eq. 8, 9 and 13).

use faer::{Mat, MatMut};

use crate::contact::monitor::{Monitor, Stop};
use crate::contact::numerics::lu::{DenseLu, check};
use crate::contact::rolling::methods::liu_hsu::stick_block::SlipSystem;

/// Steps after which the iteration ends without convergence.
const ITERATIONS_MAX: u32 = 40;
/// The iteration has converged when no traction changes by more than this share of its bound; the remaining error is about the
/// square of this.
const STEP_SMALL: f64 = 1e-8;
/// A step on the circles is halved at most this often.
const HALVINGS_MAX: u32 = 6;

/// How a step is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepRule {
    /// As in the paper: full steps; `|T|² = g²` is one of the equations.
    Full,
    /// The unknown is the angle of each traction, so that tractions stay on their friction circles; a step is halved until
    /// the component of slip perpendicular to the traction decreases.
    OnCircles,
}

/// How an iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NewtonRaphsonTermination {
    /// The last step was small.
    Converged,
    /// A step was not finite.
    Diverged,
    /// The steps were used up.
    StepsUsedUp,
}

/// Result of an iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NewtonEnd {
    /// How it ended.
    pub exit: NewtonRaphsonTermination,
    /// Steps taken.
    pub iterations: u32,
}

/// Solves `|T|² = g²` (eq. 8) and `s_x T_y − s_y T_x = 0` (eq. 9), `s = q' + K T` (eq. 13), on the slip cells.
///
/// `t` holds the initial guess and receives the answer, x of all slip cells before y; no traction in it may be 0. `bound`
/// is g of the slip cells, more than 0. The guess determines which root is found (traction along or against the slip).
///
/// # Errors
/// Only if the monitor stops the work.
pub fn solve(
    system: &SlipSystem,
    bound: &[f64],
    steps: StepRule,
    t: &mut [f64],
    monitor: &dyn Monitor,
) -> Result<NewtonEnd, Stop> {
    let mut end = NewtonEnd {
        exit: NewtonRaphsonTermination::StepsUsedUp,
        iterations: 0,
    };
    if bound.is_empty() {
        end.exit = NewtonRaphsonTermination::Converged;
        return Ok(end);
    }
    while end.iterations < ITERATIONS_MAX {
        check(monitor)?;
        let step = newton_step(system, bound, t, monitor)?;
        end.iterations += 1;
        let n = bound.len();
        let largest =
            (0..n)
                .map(|i| step[i].hypot(step[n + i]) / bound[i])
                .fold(
                    0.0,
                    |a: f64, b| if b.is_nan() { f64::NAN } else { a.max(b) },
                );
        if !largest.is_finite() {
            end.exit = NewtonRaphsonTermination::Diverged;
            break;
        }
        match steps {
            StepRule::Full => {
                for (value, change) in t.iter_mut().zip(&step) {
                    *value += change;
                }
            }
            StepRule::OnCircles => search_on_circles(system, bound, &step, t),
        }
        if largest <= STEP_SMALL {
            end.exit = NewtonRaphsonTermination::Converged;
            break;
        }
    }
    Ok(end)
}

/// One step of Newton's method on all equations (8) and (9).
///
/// The row of (8) contains only the cell's own traction and is eliminated in closed form: with `n ⟂ T` a unit vector, the
/// step is `ρ T + τ n`, `ρ = (g² − |T|²)/(2|T|²)`, which leaves one unknown τ per cell and the row of (9),
/// `Σ_j n_i·K_ij n_j τ_j − τ_i s_i·T_i/|T_i|² = −(1 + ρ_i) n_i·s_i − Σ_j n_i·K_ij T_j ρ_j`. The iterates are those of
/// the full system at an eighth of its cost.
///
/// # Errors
/// Only if the monitor stops the work.
pub fn newton_step(
    system: &SlipSystem,
    bound: &[f64],
    t: &[f64],
    monitor: &dyn Monitor,
) -> Result<Vec<f64>, Stop> {
    let n = bound.len();
    let slip = system.slip(t);
    let length: Vec<f64> = (0..n).map(|i| t[i].hypot(t[n + i])).collect();
    let across: Vec<(f64, f64)> = (0..n)
        .map(|i| (-t[n + i] / length[i], t[i] / length[i]))
        .collect();
    let radial: Vec<f64> = (0..n)
        .map(|i| 0.5 * ((bound[i] / length[i]).powi(2) - 1.0))
        .collect();
    let mut radial_part = vec![0.0; 2 * n];
    for i in 0..n {
        radial_part[i] = radial[i] * t[i];
        radial_part[n + i] = radial[i] * t[n + i];
    }
    let k = &system.response;
    let changed = system.slip(&radial_part);
    let mut matrix = Mat::zeros(n, n);
    let mut tau = vec![0.0; n];
    for j in 0..n {
        let (nx, ny) = across[j];
        let (from_x, from_y) = (k.col_as_slice(j), k.col_as_slice(n + j));
        let column = matrix.col_as_slice_mut(j);
        for i in 0..n {
            let along_x = from_x[i] * nx + from_y[i] * ny;
            let along_y = from_x[n + i] * nx + from_y[n + i] * ny;
            column[i] = across[i].0 * along_x + across[i].1 * along_y;
        }
        column[j] -= (slip[j] * t[j] + slip[n + j] * t[n + j]) / (length[j] * length[j]);
        let elastic = |place: usize| changed[place] - system.constant[place];
        tau[j] = -(1.0 + radial[j]) * (nx * slip[j] + ny * slip[n + j])
            - (nx * elastic(j) + ny * elastic(n + j));
    }
    DenseLu::new(matrix, monitor)?
        .solve(MatMut::from_column_major_slice_mut(&mut tau, n, 1), monitor)?;
    for i in 0..n {
        radial_part[i] += tau[i] * across[i].0;
        radial_part[n + i] += tau[i] * across[i].1;
    }
    Ok(radial_part)
}

/// Moves `t` along the step and projects it onto the circles; takes the first of the halved steps that reduces the residual of eq. 9.
fn search_on_circles(system: &SlipSystem, bound: &[f64], step: &[f64], t: &mut [f64]) {
    let n = bound.len();
    let before = t.to_vec();
    let start = slip_across(system, bound, &before);
    for halvings in 0..=HALVINGS_MAX {
        let share = 0.5_f64.powi(halvings as i32);
        for i in 0..n {
            let (x, y) = (
                before[i] + share * step[i],
                before[n + i] + share * step[n + i],
            );
            let length = x.hypot(y);
            t[i] = bound[i] * x / length;
            t[n + i] = bound[i] * y / length;
        }
        if slip_across(system, bound, t) < (1.0 - 1e-4 * share) * start {
            break;
        }
    }
}

/// Root of the sum of squares of the slip perpendicular to the traction.
fn slip_across(system: &SlipSystem, bound: &[f64], t: &[f64]) -> f64 {
    let n = bound.len();
    let slip = system.slip(t);
    (0..n)
        .map(|i| ((slip[i] * t[n + i] - slip[n + i] * t[i]) / bound[i]).powi(2))
        .sum::<f64>()
        .sqrt()
}
