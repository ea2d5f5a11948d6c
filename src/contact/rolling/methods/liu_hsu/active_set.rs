//! The outer iteration over stick and slip zones, and Newton–Raphson for the tractions of the slip cells (eq. 8, 9 and 13).

use faer::{Mat, MatMut};

use crate::monitor::{Monitor, Stop};
use crate::numerics::roots::ROUNDING;
use crate::numerics::{ITERATIONS_MAX, lu};
use crate::rolling::methods::boundary_element::task::STEPS_MAX;
use crate::rolling::methods::liu_hsu::stick_block::{DenseProblem, SlipSystem, both_components};
use crate::rolling::slip_rules::Rule;
use crate::rolling::task::Motion;

/// A cell of given tractions counts as slipping if its traction is below its bound by at most this share.
const START_MARGIN: f64 = 1e-6;

/// The end of the outer iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ZonesTermination {
    /// The zones agree with the resulting tractions and slips.
    Converged,
    /// Newton–Raphson did not converge for a division into zones.
    NewtonDiverged,
    /// A division occurred again, so the iteration would cycle.
    ZonesRepeat,
    /// The largest number of divisions was reached.
    IterationLimit,
    /// The zones are consistent, but rounding keeps the residual above the tolerance.
    Inexact,
}

impl ZonesTermination {
    /// Whether the residual reached the tolerance.
    pub fn converged(self) -> bool {
        self == ZonesTermination::Converged
    }

    /// A clause for messages.
    pub fn reason(self) -> &'static str {
        match self {
            ZonesTermination::Converged => "converged",
            ZonesTermination::NewtonDiverged => "Newton-Raphson diverged",
            ZonesTermination::ZonesRepeat => "the stick and slip zones repeat in a cycle",
            ZonesTermination::IterationLimit => "too many changes of the stick and slip zones",
            ZonesTermination::Inexact => "the residual stays above the tolerance",
        }
    }
}

/// A run of the outer iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZonesRun {
    /// The discretisation rule.
    pub rule: Rule,
    /// The initial guess.
    pub guess: InitialGuess,
    /// The end of the run.
    pub exit: ZonesTermination,
    /// Number of divisions that were solved.
    pub outer_iterations: u32,
    /// Number of Newton–Raphson steps over all divisions.
    pub newton_iterations: u32,
}

/// Tractions and zones of the cells, without padding.
#[derive(Debug, Clone, PartialEq)]
pub struct Zoning {
    /// Tractions, x of all cells before y.
    pub tractions: Vec<f64>,
    /// Whether each cell slips.
    pub slips: Vec<bool>,
}

/// Runs the outer iteration, with all cells sticking at first, or with the zones of given tractions.
///
/// In each pass, stick cells whose traction reaches the bound and slip cells whose traction opposes the slip (eq. 10) change their zones.
///
/// # Errors
/// Only if the monitor stops the work.
pub fn run(
    task: &DenseProblem,
    guess: InitialGuess,
    start: Option<&[f64]>,
    monitor: &dyn Monitor,
) -> Result<(ZonesRun, Zoning), Stop> {
    let mut attempt = ZonesRun {
        rule: task.rule,
        guess,
        exit: ZonesTermination::IterationLimit,
        outer_iterations: 0,
        newton_iterations: 0,
    };
    let mut division = first_division(task, start);
    let mut seen: Vec<Vec<bool>> = Vec::new();
    while attempt.outer_iterations < STEPS_MAX {
        attempt.outer_iterations += 1;
        seen.push(division.slips.clone());
        // Each division has its own system, because its stick tractions are eliminated.
        let system = SlipSystem::new(task, &division.slips, monitor)?;
        if !solve_division(task, &system, &mut attempt, &mut division, monitor)? {
            attempt.exit = ZonesTermination::NewtonDiverged;
            break;
        }
        let contradicting = contradicting_cells(task, &system, &division.tractions);
        if contradicting.is_empty() {
            attempt.exit = ZonesTermination::Converged;
            break;
        }
        let mut next = division.slips.clone();
        for cell in contradicting {
            next[cell] = !next[cell];
        }
        // A repeated division means a cycle.
        if seen.contains(&next) {
            attempt.exit = ZonesTermination::ZonesRepeat;
            break;
        }
        division.slips = next;
    }
    Ok((attempt, division))
}

/// The first division: all cells stick, or those of `start` whose traction reaches the bound slip. A cell without pressure never sticks.
fn first_division(task: &DenseProblem, start: Option<&[f64]>) -> Zoning {
    let n = task.cells;
    let tractions = start.map_or_else(|| vec![0.0; 2 * n], <[f64]>::to_vec);
    let slips = (0..n)
        .map(|i| tractions[i].hypot(tractions[n + i]) >= task.bound[i] * (1.0 - START_MARGIN))
        .collect();
    Zoning { tractions, slips }
}

/// Solves for the tractions of a division; returns whether Newton–Raphson converged.
fn solve_division(
    task: &DenseProblem,
    system: &SlipSystem,
    attempt: &mut ZonesRun,
    division: &mut Zoning,
    monitor: &dyn Monitor,
) -> Result<bool, Stop> {
    let bound: Vec<f64> = system.slip_cells.iter().map(|i| task.bound[*i]).collect();
    let mut t = start_tractions(task, system, attempt.guess, &division.tractions);
    let (converged, steps) = solve(system, &bound, &mut t, monitor)?;
    attempt.newton_iterations += steps;
    if !converged {
        return Ok(false);
    }
    division.tractions.fill(0.0);
    let on_stick = both_components(&system.stick_cells, task.cells);
    for (place, value) in on_stick.iter().zip(system.stick_tractions(&t)) {
        division.tractions[*place] = value;
    }
    let on_slip = both_components(&system.slip_cells, task.cells);
    for (place, value) in on_slip.iter().zip(&t) {
        division.tractions[*place] = *value;
    }
    Ok(true)
}

/// Indices, in the list of slip cells, of the cells whose tractions oppose their slips (eq. 10).
fn opposed(system: &SlipSystem, t: &[f64]) -> Vec<usize> {
    let count = system.slip_cells.len();
    let slip = system.slip(t);
    (0..count)
        .filter(|k| slip[*k] * t[*k] + slip[count + k] * t[count + k] < 0.0)
        .collect()
}

/// The initial guess for the slip cells, x before y.
fn start_tractions(
    task: &DenseProblem,
    system: &SlipSystem,
    guess: InitialGuess,
    before: &[f64],
) -> Vec<f64> {
    let count = system.slip_cells.len();
    let mut t = vec![0.0; 2 * count];
    for (k, &i) in system.slip_cells.iter().enumerate() {
        let before = [before[i], before[task.cells + i]];
        let at = [task.x[i], task.y[i]];
        let [x, y] = guess.direction(&task.motion, at, before);
        t[k] = task.bound[i] * x;
        t[count + k] = task.bound[i] * y;
    }
    t
}

/// The cells whose tractions or slips contradict their zones.
fn contradicting_cells(task: &DenseProblem, system: &SlipSystem, t: &[f64]) -> Vec<usize> {
    let n = task.cells;
    let mut found: Vec<usize> = system
        .stick_cells
        .iter()
        .copied()
        .filter(|i| t[*i].hypot(t[n + i]) >= task.bound[*i] * (1.0 + ROUNDING))
        .collect();
    let t_slip: Vec<f64> = both_components(&system.slip_cells, n)
        .into_iter()
        .map(|place| t[place])
        .collect();
    let opposed = opposed(system, &t_slip);
    found.extend(opposed.into_iter().map(|k| system.slip_cells[k]));
    found
}

/// The directions of the slip tractions at the start; their length is always the friction bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InitialGuess {
    /// Initial guess 1: along the rigid slip `(ν_x − φ y, ν_y + φ x)` (eq. 14).
    RigidSlip,
    /// Initial guess 2: around a spin pole, `sgn φ (−(y − y_p), x − x_p)` (eq. 15).
    ///
    /// The paper prints a minus under the root of eq. 15, which must be a plus, and omits the sign of φ. With the rigid pole `(−ν_y/φ, ν_x/φ)` this would equal
    /// guess 1; the pole of the elastic problem differs.
    SpinPole([f64; 2]),
    /// Along the tractions of the start or of the previous division; not in the paper (see [`liu_hsu`](crate::rolling::methods::liu_hsu)).
    Continued,
}

impl InitialGuess {
    /// Unit direction at a cell at `(x, y)` with the traction `before` in the previous division.
    ///
    /// An undefined direction (at a pole, or without a previous traction) is replaced by that of the rigid slip, and at the rigid pole by x; any direction works.
    pub fn direction(self, motion: &Motion, at: [f64; 2], before: [f64; 2]) -> [f64; 2] {
        let [x, y] = at;
        let rigid = [
            motion.creepage_x - motion.spin_per_mm * y,
            motion.creepage_y + motion.spin_per_mm * x,
        ];
        let wanted = match self {
            InitialGuess::RigidSlip => rigid,
            InitialGuess::SpinPole([pole_x, pole_y]) => {
                let sign = motion.spin_per_mm.signum();
                [-sign * (y - pole_y), sign * (x - pole_x)]
            }
            InitialGuess::Continued => before,
        };
        unit(wanted).or_else(|| unit(rigid)).unwrap_or([1.0, 0.0])
    }
}

/// The unit vector along `v`, unless `v` is 0 or not finite.
fn unit(v: [f64; 2]) -> Option<[f64; 2]> {
    let length = v[0].hypot(v[1]);
    (length > 0.0 && length.is_finite()).then(|| [v[0] / length, v[1] / length])
}

/// The iteration has converged if no traction changes by more than this share of its bound. The error left is about the square of this.
const STEP_SMALL: f64 = 1e-8;

/// Solves `|T|² = g²` (eq. 8) and `s_x T_y − s_y T_x = 0` (eq. 9), `s = q' + K T` (eq. 13), on the slip cells.
///
/// `t` contains the initial guess and receives the solution, x of all slip cells before y; no initial traction is 0. `bound` is g of the slip cells, more than
/// 0. The guess determines the root (traction along or against the slip). Returns whether the last step was small, and the number of steps. A step that is not
/// finite ends the iteration.
///
/// # Errors
/// Only if the monitor stops the work.
pub fn solve(
    system: &SlipSystem,
    bound: &[f64],
    t: &mut [f64],
    monitor: &dyn Monitor,
) -> Result<(bool, u32), Stop> {
    if bound.is_empty() {
        return Ok((true, 0));
    }
    for taken in 1..=ITERATIONS_MAX as u32 {
        monitor.go_on(0.0)?;
        let step = newton_step(system, bound, t, monitor)?;
        let n = bound.len();
        let largest =
            (0..n)
                .map(|i| step[i].hypot(step[n + i]) / bound[i])
                .fold(
                    0.0,
                    |a: f64, b| if b.is_nan() { f64::NAN } else { a.max(b) },
                );
        if !largest.is_finite() {
            return Ok((false, taken));
        }
        for (value, change) in t.iter_mut().zip(&step) {
            *value += change;
        }
        if largest <= STEP_SMALL {
            return Ok((true, taken));
        }
    }
    Ok((false, ITERATIONS_MAX as u32))
}

/// One step of Newton's method on all equations (8) and (9).
///
/// The row of (8) contains only the cell's own traction and is eliminated: with a unit vector `n ⟂ T` the step is `ρ T + τ n`, `ρ = (g² − |T|²)/(2|T|²)`. This
/// leaves one unknown τ per cell and the row of (9), `Σ_j n_i·K_ij n_j τ_j − τ_i s_i·T_i/|T_i|² = −(1 + ρ_i) n_i·s_i − Σ_j n_i·K_ij T_j ρ_j`. The iterates are
/// those of the full system at an eighth of its cost.
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
    let unknowns = MatMut::from_column_major_slice_mut(&mut tau, n, 1);
    lu::solve(&matrix, unknowns, monitor)?;
    for i in 0..n {
        radial_part[i] += tau[i] * across[i].0;
        radial_part[n + i] += tau[i] * across[i].1;
    }
    Ok(radial_part)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOTION: Motion = Motion {
        creepage_x: 0.3,
        creepage_y: -0.2,
        spin_per_mm: -0.5,
    };

    #[test]
    fn guess_2_about_the_rigid_pole_is_guess_1_for_either_sign_of_spin() {
        for spin in [-0.5, 0.5] {
            let motion = Motion {
                spin_per_mm: spin,
                ..MOTION
            };
            let pole = [-motion.creepage_y / spin, motion.creepage_x / spin];
            for at in [[0.0, 0.0], [1.0, 2.0], [-3.0, 0.4]] {
                let one = InitialGuess::RigidSlip.direction(&motion, at, [0.0; 2]);
                let two = InitialGuess::SpinPole(pole).direction(&motion, at, [0.0; 2]);
                assert!((one[0] - two[0]).abs() < 1e-15 && (one[1] - two[1]).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn a_direction_is_a_unit_vector_even_at_a_pole() {
        let still = Motion {
            creepage_x: 0.0,
            creepage_y: 0.0,
            spin_per_mm: 1.0,
        };
        for guess in [
            InitialGuess::RigidSlip,
            InitialGuess::SpinPole([0.0, 0.0]),
            InitialGuess::Continued,
        ] {
            let [x, y] = guess.direction(&still, [0.0, 0.0], [0.0, 0.0]);
            assert!((x.hypot(y) - 1.0).abs() < 1e-15, "{guess:?}");
        }
    }

    #[test]
    fn the_continued_guess_keeps_the_direction_before() {
        let [x, y] = InitialGuess::Continued.direction(&MOTION, [1.0, 1.0], [3.0, -4.0]);
        assert!((x - 0.6).abs() < 1e-15 && (y + 0.8).abs() < 1e-15);
    }
}
