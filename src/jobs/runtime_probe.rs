//! Estimate of the solve time of a case by solving it for a short time.
//!
//! The cost formulas of the physics do not include the speed of the machine or the number of refinements. Most cases end within the limit of
//! a probe. For the others the formulas extrapolate from the part that was solved.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use railhead_contact::error::SolveError;
use railhead_contact::monitor::{Monitor, Stop};
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::solution::words::answer::FoundBy;

/// Maximum memory of a case that is probed, in bytes: probes run outside the memory budget of the workers.
const BYTES_MAX: u64 = 128 << 20;

/// Default limit of a probe. 98 % of the cases of the stress bench end within it.
pub const USUAL_LIMIT: Duration = Duration::from_millis(200);

/// Lower bound of the total time of a first motion that did not end within a probe, relative to the probe. Of 27 such cases
/// of `cargo bench --bench stress -- --only times`, 25 are within a factor of 3.
const REST_TIMES: f64 = 2.0;
/// Number of solved motions from which the time of the others is extrapolated.
const MOTIONS_MIN: usize = 3;

/// Estimated solve time of a case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbedTime {
    /// Solve time in s on one core.
    pub seconds: f64,
    /// Source of the estimate.
    pub found_by: FoundBy,
}

struct ProbeClock {
    began: Instant,
    limit: Duration,
    progress: Cell<f64>,
}

impl Monitor for ProbeClock {
    fn tick(&self, progress: f64) -> ControlFlow<Stop> {
        self.progress.set(progress);
        if self.elapsed() > self.limit {
            return ControlFlow::Break(Stop::OutOfTime);
        }
        ControlFlow::Continue(())
    }

    fn elapsed(&self) -> Duration {
        self.began.elapsed()
    }
}

/// Runs `solve` for at most about `limit` and returns the solve time of the whole case.
pub fn probe(
    case: &CheckedCase,
    limit: Duration,
    solve: impl FnOnce(&dyn Monitor) -> Result<(), SolveError>,
) -> ProbedTime {
    let cost = case.cost();
    if limit.is_zero() || cost.own_bytes() > BYTES_MAX {
        return ProbedTime {
            seconds: cost.seconds,
            found_by: FoundBy::Formulas,
        };
    }
    let clock = ProbeClock {
        began: Instant::now(),
        limit,
        progress: Cell::new(0.0),
    };
    let end = solve(&clock);
    let taken = clock.elapsed().as_secs_f64();
    let (seconds, found_by) = match end {
        Ok(()) => (taken, FoundBy::Solve),
        Err(SolveError::OutOfTime { .. } | SolveError::Cancelled) => {
            let seconds = from_part(case, cost.seconds, taken, clock.progress.get());
            (seconds, FoundBy::PartOfSolve)
        }
        Err(_) => (taken, FoundBy::FailedSolve),
    };
    ProbedTime { seconds, found_by }
}

/// Solve time of a case from the formulas, the time taken so far and the progress reached.
fn from_part(case: &CheckedCase, formulas: f64, taken: f64, progress: f64) -> f64 {
    let motions = case.problem.motions.len();
    let done = (progress * motions as f64) as usize;
    if case.problem.history.is_some() || done < MOTIONS_MIN {
        return formulas.max(REST_TIMES * taken);
    }
    let expected = case.slice(0..done).cost().seconds;
    formulas.max(expected) * taken / expected
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use railhead_contact::case::solver::Limits;
    use railhead_contact::{check, solve};

    fn checked(motion: &Value, solver: &Value) -> CheckedCase {
        let case = json!({
            "material": { "shear_modulus_mpa": 82_000, "poisson_ratio": 0.28 },
            "friction": { "coefficient": 0.3 },
            "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
            "load": { "normal_force_n": 100_000 },
            "motion": motion,
            "solver": solver,
            "outputs": ["resultants"],
        });
        check(&case, &Limits::default()).unwrap()
    }

    fn motion() -> Value {
        json!({ "creepage_x": 0.001, "creepage_y": 0.0, "spin_per_mm": 0.0 })
    }

    fn sweep(points: u32) -> CheckedCase {
        let range = json!({ "from": 0.0, "to": 0.01, "points": points });
        let sweep = json!({ "sweep": { "creepage_x": range } });
        checked(&sweep, &json!({ "target_error": 0.005 }))
    }

    fn probe_for(case: &CheckedCase, limit: Duration) -> ProbedTime {
        probe(case, limit, |monitor| solve(case, monitor).map(drop))
    }

    #[test]
    fn a_case_that_ends_in_time_is_reported_as_solved() {
        let found = probe_for(&sweep(3), Duration::from_secs(3600));
        assert_eq!(found.found_by, FoundBy::Solve);
        assert!(found.seconds > 0.0);
    }

    #[test]
    fn without_time_or_memory_for_a_probe_the_formulas_are_used() {
        let case = sweep(3);
        let formulas = ProbedTime {
            seconds: case.cost().seconds,
            found_by: FoundBy::Formulas,
        };
        assert_eq!(probe_for(&case, Duration::ZERO), formulas);
        let mesh = json!({ "strips": 70, "cells": 60 });
        let large = checked(&motion(), &json!({ "mesh": mesh }));
        assert!(large.cost().own_bytes() > BYTES_MAX);
        let found = probe_for(&large, Duration::from_secs(3600));
        assert_eq!(found.found_by, FoundBy::Formulas);
    }

    #[test]
    fn motions_done_in_time_determine_the_time_of_the_others() {
        let case = sweep(5000);
        let found = probe_for(&case, Duration::from_millis(2));
        assert_eq!(found.found_by, FoundBy::PartOfSolve);
        assert!(found.seconds > 2e-3, "{found:?}");
        // Each of like motions takes what those done took, whatever the formulas expect of one.
        let formulas = case.cost().seconds;
        let done = 1000;
        let share = case.slice(0..done).cost().seconds / formulas;
        let told = from_part(&case, formulas, 7.0, done as f64 / 5000.0);
        assert!((told * share - 7.0).abs() < 1e-9, "{told} {share}");
    }

    #[test]
    fn a_single_motion_takes_longer_than_the_probe() {
        let case = checked(&motion(), &json!({ "target_error": 0.005 }));
        let told = from_part(&case, case.cost().seconds, 7.0, 0.5);
        assert_eq!(told, REST_TIMES * 7.0);
    }
}
