//! The outer iteration: which cells stick and which slip.

use crate::contact::monitor::{Monitor, Stop};
use crate::contact::rolling::methods::liu_hsu::newton_raphson;
use crate::contact::rolling::methods::liu_hsu::newton_raphson::{
    NewtonRaphsonTermination, StepRule,
};
use crate::contact::rolling::methods::liu_hsu::stick_block::{
    DenseProblem, SlipSystem, both_components,
};
use crate::contact::rolling::slip_rules::Rule;
use crate::contact::rolling::task::Motion;

/// Divisions into stick and slip after which the run ends without convergence.
const DIVISIONS_MAX: u32 = 60;
/// A stick cell slips when its traction exceeds its bound by this share, so that rounding does not decide.
const STICK_MARGIN: f64 = 1e-9;
/// In given tractions, a cell counts as slipping if its traction is less than its bound by at most this share.
const START_MARGIN: f64 = 1e-6;

/// How the outer iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ZonesTermination {
    /// The division into zones agrees with the tractions and slips that follow from it.
    Converged,
    /// Newton–Raphson found no tractions for a division.
    NewtonDiverged,
    /// A division occurred for the second time, so that the iteration would cycle.
    ZonesRepeat,
    /// The limit of divisions was reached.
    IterationLimit,
    /// The zones are consistent, but rounding keeps the residual above the tolerance.
    Inexact,
}

impl ZonesTermination {
    /// Did the residual reach the tolerance?
    #[must_use]
    pub fn converged(self) -> bool {
        self == ZonesTermination::Converged
    }

    /// A clause for messages.
    #[must_use]
    pub fn reason(self) -> &'static str {
        match self {
            ZonesTermination::Converged => "converged",
            ZonesTermination::NewtonDiverged => "Newton-Raphson diverged",
            ZonesTermination::ZonesRepeat => "the division into stick and slip repeats itself",
            ZonesTermination::IterationLimit => "too many divisions into stick and slip",
            ZonesTermination::Inexact => "the residual stays above the tolerance",
        }
    }
}

/// One run of the outer iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZonesRun {
    /// The discretisation rule.
    pub rule: Rule,
    /// The initial guess used.
    pub guess: InitialGuess,
    /// How it ended.
    pub exit: ZonesTermination,
    /// Divisions into stick and slip that were solved.
    pub outer_iterations: u32,
    /// Newton–Raphson steps over all divisions.
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

/// Runs the outer iteration from all cells sticking, or from the zones of given tractions.
///
/// A stick cell whose traction reaches its bound and a slip cell whose traction opposes its slip (eq. 10) change their
/// zones in the same pass.
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
    while attempt.outer_iterations < DIVISIONS_MAX {
        attempt.outer_iterations += 1;
        seen.push(division.slips.clone());
        // Stick tractions are eliminated, and which these are depends on the division: each has a system of its own.
        let system = SlipSystem::new(task, &division.slips, monitor)?;
        if !solve_division(task, &system, &mut attempt, &mut division, monitor)? {
            attempt.exit = ZonesTermination::NewtonDiverged;
            break;
        }
        let load_mismatch = load_mismatch(task, &system, &division.tractions);
        if load_mismatch.is_empty() {
            attempt.exit = ZonesTermination::Converged;
            break;
        }
        let mut next = division.slips.clone();
        for cell in load_mismatch {
            next[cell] = !next[cell];
        }
        // A division that comes back means that the iteration cycles.
        if seen.contains(&next) {
            attempt.exit = ZonesTermination::ZonesRepeat;
            break;
        }
        division.slips = next;
    }
    Ok((attempt, division))
}

/// The division to start from: all cells stick, or with `start` the cells whose traction there reaches the bound slip. A cell without
/// pressure never sticks.
fn first_division(task: &DenseProblem, start: Option<&[f64]>) -> Zoning {
    let n = task.cells;
    let tractions = start.map_or_else(|| vec![0.0; 2 * n], <[f64]>::to_vec);
    let slips = (0..n)
        .map(|i| tractions[i].hypot(tractions[n + i]) >= task.bound[i] * (1.0 - START_MARGIN))
        .collect();
    Zoning { tractions, slips }
}

/// Solves for the tractions of one division into zones; returns `false` if Newton–Raphson does not converge.
fn solve_division(
    task: &DenseProblem,
    system: &SlipSystem,
    attempt: &mut ZonesRun,
    division: &mut Zoning,
    monitor: &dyn Monitor,
) -> Result<bool, Stop> {
    let bound = system.slip_cells.iter().map(|i| task.bound[*i]);
    let mut roots = RootChoice {
        system,
        bound: bound.collect(),
        iterations: 0,
        monitor,
    };
    let start = |guess| start_tractions(task, system, guess, &division.tractions);
    let found = match attempt.guess {
        InitialGuess::Continued => roots.along_slip(
            start(InitialGuess::Continued),
            start(InitialGuess::RigidSlip),
        )?,
        // The guesses of the paper take its full steps, and whatever root these lead to.
        guess => roots.find(start(guess), StepRule::Full)?,
    };
    attempt.newton_iterations += roots.iterations;
    let Some(t) = found else {
        return Ok(false);
    };
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

/// The search for a root of eq. 8 and 9 for one division.
struct RootChoice<'a> {
    system: &'a SlipSystem,
    bound: Vec<f64>,
    iterations: u32,
    monitor: &'a dyn Monitor,
}

impl RootChoice<'_> {
    /// The root that Newton–Raphson finds from a start, if any.
    fn find(&mut self, mut t: Vec<f64>, steps: StepRule) -> Result<Option<Vec<f64>>, Stop> {
        let end = newton_raphson::solve(self.system, &self.bound, steps, &mut t, self.monitor)?;
        self.iterations += end.iterations;
        Ok((end.exit == NewtonRaphsonTermination::Converged).then_some(t))
    }

    /// A root with as few tractions as possible that oppose their slip. Eq. 9 has a root for every choice of such
    /// cells. The search starts from `first`, then from the root found with those tractions reversed, then from `second`.
    fn along_slip(&mut self, first: Vec<f64>, second: Vec<f64>) -> Result<Option<Vec<f64>>, Stop> {
        let mut best = self.find(first, StepRule::OnCircles)?;
        let turned = best.as_ref().map(|t| turned(self.system, t));
        for start in turned.into_iter().chain([second]) {
            let count = |t: &Vec<f64>| opposed(self.system, t).len();
            let least = best.as_ref().map_or(usize::MAX, count);
            // No traction opposes its slip: there is no better root.
            if least == 0 {
                break;
            }
            if let Some(t) = self.find(start, StepRule::OnCircles)?
                && opposed(self.system, &t).len() < least
            {
                best = Some(t);
            }
        }
        Ok(best)
    }
}

/// The slip cells, as indices into the list of slip cells, whose tractions oppose their slips (eq. 10).
fn opposed(system: &SlipSystem, t: &[f64]) -> Vec<usize> {
    let count = system.slip_cells.len();
    let slip = system.slip(t);
    (0..count)
        .filter(|k| slip[*k] * t[*k] + slip[count + k] * t[count + k] < 0.0)
        .collect()
}

/// The tractions, with those that oppose their slips reversed.
fn turned(system: &SlipSystem, t: &[f64]) -> Vec<f64> {
    let count = system.slip_cells.len();
    let mut next = t.to_vec();
    for k in opposed(system, t) {
        next[k] = -next[k];
        next[count + k] = -next[count + k];
    }
    next
}

/// The initial guess for all slip cells, x before y.
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
fn load_mismatch(task: &DenseProblem, system: &SlipSystem, t: &[f64]) -> Vec<usize> {
    let n = task.cells;
    let mut found: Vec<usize> = system
        .stick_cells
        .iter()
        .copied()
        .filter(|i| t[*i].hypot(t[n + i]) >= task.bound[*i] * (1.0 + STICK_MARGIN))
        .collect();
    let t_slip: Vec<f64> = both_components(&system.slip_cells, n)
        .into_iter()
        .map(|place| t[place])
        .collect();
    let opposed = opposed(system, &t_slip);
    found.extend(opposed.into_iter().map(|k| system.slip_cells[k]));
    found
}

/// How the directions of the slip tractions are chosen; their magnitude is always the friction bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InitialGuess {
    /// Initial guess 1: along the rigid slip `(ν_x − φ y, ν_y + φ x)` (eq. 14).
    RigidSlip,
    /// Initial guess 2: around a spin pole, `sgn φ (−(y − y_p), x − x_p)` (eq. 15).
    ///
    /// The paper prints a minus under the root of eq. 15, which must be a plus, and leaves out the sign of φ. With the
    /// rigid pole `(−ν_y/φ, ν_x/φ)` this would equal guess 1; the pole of the elastic problem differs from it.
    SpinPole([f64; 2]),
    /// Along the tractions of the previous division, see the third run in
    /// [`liu_hsu`](crate::contact::rolling::methods::liu_hsu) (not in the paper).
    Continued,
}

impl InitialGuess {
    /// Unit direction at a cell at `(x, y)`, where the previous division gave the traction `before`.
    ///
    /// Where the direction is undefined (at a pole, or without a previous traction) it is that of the rigid slip, and at
    /// the rigid pole that of x; the iteration works with any direction there.
    #[must_use]
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
