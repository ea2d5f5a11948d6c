//! The solver of Liu and Hsu: Newton–Raphson on the slip cells inside an iteration over stick and slip zones.
//!
//! Source: "Non-Hertzian rolling contact stress analysis" (eq. 6 to 15; "the paper" below), after Liu and Paul. It is
//! here for fidelity and comparison: it solves the same discrete equations as
//! [`boundary_element`](crate::contact::rolling::methods::boundary_element::solve), with dense matrices and a smaller domain of
//! convergence. The course, as in §4 and §5 of the paper:
//!
//! 1. All cells stick; their tractions follow from eq. 11.
//! 2. Stick cells at or above their bound and slip cells that pull against their slip (eq. 10) change zones
//!    ([`active_set`]).
//! 3. The stick tractions are eliminated (eq. 13, [`stick_block`]); Newton–Raphson gives the slip tractions
//!    (eq. 8 and 9, [`newton_raphson`]) from an initial guess (eq. 14 or 15, [`initial_guess`]). Back to 2 until no cell
//!    changes.
//! 4. This is done with guess 1. If it fails, guess 1 on a coarse mesh gives the spin pole ([`spin_pole`]) for guess 2.
//!
//! # What the paper leaves open
//!
//! | question | here |
//! |---|---|
//! | eq. 6 sums slip along the strip, eq. 12 needs slip itself | rows are differenced along the strip: the map is that of [`Equations`] |
//! | weight of the own cell in eq. 6 | one half, from the centre to the side: [`Rule::Trapezoid`]; any other rule serves too |
//! | `x_U`, "the closest boundary" | the leading edge for every cell; with a stick/slip boundary the equations change with the zones, and some have two solutions or none |
//! | when a stick cell slips | T reaches `μp (1 + 1e-9)` |
//! | when a slip cell sticks | `s·T < 0`, in the same pass |
//! | unknowns | slip tractions alone; slips are linear in them, so the steps are the same |
//! | eq. 14 and 15 at a pole (0/0) | any direction |
//! | eq. 15 | plus under the root, factor `sgn φ` |
//! | where the spin pole is | the centre of the vortex of the coarse tractions, least squares weighted with the load; with the rigid pole eq. 15 is eq. 14 |
//! | a coarse solution that failed | its last tractions still give the pole; a cured coarse solution gave no better one |
//! | all cells slip, or all stick | eq. 11 or eq. 8 and 9 fall away |
//! | a division that comes up again | the run ends: it would go round for ever |
//!
//! # Where it converges
//!
//! The paper says always. Measured, that holds for the upwind rule without spin only. Most failures are divisions that
//! repeat, because Newton–Raphson ends on a root of eq. 9 with some tractions against their slips. So a third run
//! follows where both guesses fail, which is not in the paper ([`Guess::Continued`]): tractions start from those of the
//! division before and stay on their circles, and a root with tractions against their slips is tried again with these
//! turned round. The rules of second order come to it by way of an upwind solution ([`solve_by_upwind`]). Of 109 motions
//! (normalised creepage 0 to 3 in four directions, spin 0 to 20) so many converge, guess 2 with the pole of 25 coarse
//! cells or guess 1 where there is no spin (`cargo bench --bench convergence_domain` prints more):
//!
//! | rule, mesh | region | guess 1 | guess 2 | 1, then 2 (the paper) | and the third run |
//! |---|---|---|---|---|---|
//! | upwind, 5 × 5 equal cells | circle | 63 | 101 | 102 | 109 |
//! | | ellipse, b = 0.3 a | 59 | 88 | 90 | 107 |
//! | | ellipse, b = 3.3 a | 75 | 97 | 97 | 106 |
//! | | egg | 70 | 102 | 102 | 109 |
//! | upwind, 10 × 10 equal cells | circle | 54 | 93 | 93 | 108 |
//! | | ellipse, b = 0.3 a | 53 | 78 | 80 | 108 |
//! | | ellipse, b = 3.3 a | 99 | 105 | 105 | 109 |
//! | | egg | 43 | 89 | 89 | 109 |
//! | trapezoid, 5 × 5 equal cells | circle | 78 | 99 | 100 | 109 |
//! | | ellipse, b = 0.3 a | 66 | 92 | 94 | 109 |
//! | | ellipse, b = 3.3 a | 89 | 91 | 94 | 109 |
//! | | egg | 84 | 99 | 103 | 109 |
//! | trapezoid, 12 × 12 graded cells | circle | 51 | 84 | 84 | 109 |
//! | | ellipse, b = 0.3 a | 45 | 61 | 66 | 109 |
//! | | ellipse, b = 3.3 a | 92 | 96 | 96 | 109 |
//! | | egg | 59 | 82 | 84 | 108 |
//!
//! A solve that ends otherwise says so; `boundary_element` converges in all these states. All is dense: 1000 cells take
//! seconds and 100 MB and more, and the checks of a case allow no more.

use crate::contact::monitor::{Monitor, Stop};
use crate::contact::rolling::methods::boundary_element::newton::Newton;
use crate::contact::rolling::methods::boundary_element::task::Convergence;
use crate::contact::rolling::methods::liu_hsu::active_set;
use crate::contact::rolling::methods::liu_hsu::active_set::{Attempt, Division, Exit};
use crate::contact::rolling::methods::liu_hsu::dense_task::Stage;
use crate::contact::rolling::methods::liu_hsu::initial_guess::Guess;
use crate::contact::rolling::methods::liu_hsu::stick_block::DenseProblem;
use crate::contact::rolling::slip_rules::Rule;
use crate::contact::rolling::vortex;

/// What a solve leaves behind besides the tractions.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Did the residual reach the tolerance?
    pub converged: bool,
    /// Residual of the tractions returned, as in [`Convergence`].
    pub residual: f64,
    /// The runs of the outer iteration on the fine mesh, in order; the last one is what counts.
    pub attempts: Vec<Attempt>,
    /// Slip of every cell for the tractions returned, in the layout of the equations.
    pub slip: Vec<f64>,
    /// Does the cell slip?
    pub slips: Vec<bool>,
}

impl Outcome {
    /// The run of the outer iteration that counts.
    #[must_use]
    pub fn last(&self) -> &Attempt {
        &self.attempts[self.attempts.len() - 1]
    }

    /// Why there is no answer and what to do, as a clause for messages.
    #[must_use]
    pub fn advice(&self) -> String {
        let reason = self.last().exit.reason();
        format!("{reason}; use \"boundary_element\", which solves the same equations")
    }

    /// Divisions into stick and slip that were solved, over all runs.
    #[must_use]
    pub fn outer_iterations(&self) -> u32 {
        self.attempts.iter().map(|a| a.outer_iterations).sum()
    }

    /// Newton–Raphson steps over all runs.
    #[must_use]
    pub fn newton_iterations(&self) -> u32 {
        self.attempts.iter().map(|a| a.newton_iterations).sum()
    }
}

/// Solves for the tractions of the fine stage: guess 1, then guess 2, then the continued run, see the module's text.
///
/// `t` holds the tractions from which the continued run starts (0 if none are known); it receives the answer, or without
/// convergence the tractions with the smallest residual met. Without a coarse stage, or without spin, there is no pole
/// and guess 2 is left out.
///
/// # Errors
/// Only if the monitor stops the work; an iteration that does not converge is told in the outcome.
pub fn solve(
    fine: &Stage,
    coarse: Option<&Stage>,
    t: &mut [f64],
    monitor: &dyn Monitor,
) -> Result<Outcome, Stop> {
    let mut search = Search::new(fine, t, monitor)?;
    if !search.as_in_the_paper(coarse)? {
        search.attempt(Guess::Continued)?;
    }
    Ok(search.finish(t))
}

/// Like [`solve`], but the continued run starts from a solution on the stage `upwind`, the same mesh and motion with
/// [`Rule::Upwind`]. This is for the other rules, whose own continued run fails more often.
///
/// # Errors
/// Only if the monitor stops the work; an iteration that does not converge is told in the outcome.
pub fn solve_by_upwind(
    fine: &Stage,
    upwind: &Stage,
    coarse: Option<&Stage>,
    t: &mut [f64],
    monitor: &dyn Monitor,
) -> Result<Outcome, Stop> {
    debug_assert_eq!(upwind.equations.rule, Rule::Upwind);
    let mut search = Search::new(fine, t, monitor)?;
    if !search.as_in_the_paper(coarse)? {
        let first = solve(upwind, None, t, monitor)?;
        search.attempts.extend(&first.attempts);
        if first.converged {
            search.start = search.task.compact(t);
        }
        search.attempt(Guess::Continued)?;
    }
    Ok(search.finish(t))
}

/// Solves with one guess alone. `t` is as in [`solve`]; only [`Guess::Continued`] reads it.
///
/// # Errors
/// Only if the monitor stops the work.
pub fn solve_with(
    stage: &Stage,
    guess: Guess,
    t: &mut [f64],
    monitor: &dyn Monitor,
) -> Result<Outcome, Stop> {
    let mut search = Search::new(stage, t, monitor)?;
    search.attempt(guess)?;
    Ok(search.finish(t))
}

/// The first stage: the spin pole from a coarse mesh solved with guess 1; `None` without spin or without a vortex.
///
/// # Errors
/// Only if the monitor stops the work.
pub fn coarse_pole(coarse: &Stage, monitor: &dyn Monitor) -> Result<Option<[f64; 2]>, Stop> {
    if coarse.motion.spin_per_mm == 0.0 {
        return Ok(None);
    }
    let task = DenseProblem::new(coarse, monitor)?;
    let (_, division) = active_set::run(&task, Guess::RigidSlip, None, monitor)?;
    let load: Vec<f64> = (0..task.cells)
        .map(|i| task.bound[i] * coarse.law.area[i])
        .collect();
    Ok(vortex::vortex_centre(
        &division.tractions,
        &task.x,
        &task.y,
        &load,
    ))
}

/// The runs on one mesh and the best tractions so far.
struct Search<'a> {
    stage: &'a Stage<'a>,
    monitor: &'a dyn Monitor,
    task: DenseProblem,
    /// Tractions given by the caller, over the cells without padding.
    start: Vec<f64>,
    newton: Newton<'a>,
    attempts: Vec<Attempt>,
    best: Option<(f64, Division)>,
}

impl<'a> Search<'a> {
    fn new(stage: &'a Stage<'a>, t: &[f64], monitor: &'a dyn Monitor) -> Result<Search<'a>, Stop> {
        let task = DenseProblem::new(stage, monitor)?;
        Ok(Search {
            stage,
            monitor,
            start: task.compact(t),
            task,
            newton: Newton::new(stage.equations),
            attempts: Vec::new(),
            best: None,
        })
    }

    /// Guess 1, then guess 2 about the pole of the coarse stage; did either converge?
    fn as_in_the_paper(&mut self, coarse: Option<&Stage>) -> Result<bool, Stop> {
        if self.attempt(Guess::RigidSlip)? {
            return Ok(true);
        }
        let Some(coarse) = coarse else {
            return Ok(false);
        };
        match coarse_pole(coarse, self.monitor)? {
            Some(pole) => self.attempt(Guess::SpinPole(pole)),
            None => Ok(false),
        }
    }

    /// Runs the outer iteration with one guess; did it converge?
    fn attempt(&mut self, guess: Guess) -> Result<bool, Stop> {
        let start = (guess == Guess::Continued).then_some(&self.start[..]);
        let (mut attempt, division) = active_set::run(&self.task, guess, start, self.monitor)?;
        let residual = self.residual(&division.tractions);
        let exact = residual <= self.stage.law.tolerance;
        if attempt.exit == Exit::Converged && !exact {
            attempt.exit = Exit::Inexact;
        }
        self.attempts.push(attempt);
        let converged = attempt.exit == Exit::Converged;
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

    /// Residual of the projected friction law, the measure both methods share.
    fn residual(&mut self, tractions: &[f64]) -> f64 {
        let padded = self.task.padded(tractions);
        let mut unused = Convergence {
            converged: false,
            iterations: 0,
            products: 0,
            residual: 0.0,
            inexact_steps: 0,
        };
        self.newton.evaluate(&self.stage.law, &padded, &mut unused)
    }

    fn finish(mut self, t: &mut [f64]) -> Outcome {
        let (_, division) = self.best.take().unwrap_or_else(|| {
            let tractions = vec![0.0; 2 * self.task.cells];
            let slips = vec![false; self.task.cells];
            (f64::INFINITY, Division { tractions, slips })
        });
        // Evaluated once more, because the slips kept by the evaluation are those of its last call.
        let residual = self.residual(&division.tractions);
        t.copy_from_slice(&self.task.padded(&division.tractions));
        Outcome {
            converged: self
                .attempts
                .last()
                .is_some_and(|a| a.exit == Exit::Converged),
            residual,
            attempts: self.attempts,
            slip: self.newton.slip().to_vec(),
            slips: division.slips,
        }
    }
}
