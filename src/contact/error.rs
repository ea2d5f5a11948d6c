//! What can go wrong in `contact`: a case that cannot be asked, and a solve that has no answer.

use thiserror::Error;

use crate::contact::monitor::Stop;
use crate::contact::rolling::methods::method::Method;

/// One fault of a case: where it is, what was given, what is allowed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// JSON pointer (RFC 6901) to the faulty member; empty for the whole case.
    pub pointer: String,
    /// The value given and what is allowed, as a sentence.
    pub detail: String,
}

/// Every fault of a case at once; never empty.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("the case has {} fault(s): {}", .0.len(), .0.iter().map(|f| format!("{}: {}", f.pointer, f.detail)).collect::<Vec<_>>().join("; "))]
pub struct CaseError(pub Vec<Fault>);

/// Why a solve gave no answer.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SolveError {
    /// The iteration ended without meeting its tolerance.
    #[error(
        "{} did not converge at motion {point}: residual {residual:.3e} after {iterations} iterations, {tolerance:.1e} was needed; {advice}",
        .method.name()
    )]
    NotConverged {
        /// The method that gave up.
        method: Method,
        /// Which motion of the case, counted from 0.
        point: usize,
        /// Iterations done.
        iterations: usize,
        /// Residual of the best iterate, relative to the traction scale of the case.
        residual: f64,
        /// Residual that was needed.
        tolerance: f64,
        /// What to try instead, as a clause.
        advice: String,
    },
    /// No strip of the mesh meets the patch: its edge is too ragged or its samples too few.
    #[error(
        "none of the {strips} strips meets patch {patch}; give more strips, or a pressure with more samples"
    )]
    Unmeshable {
        /// The patch, counted from 0.
        patch: usize,
        /// Strips of the mesh.
        strips: u32,
    },
    /// There is no region and pressure to go on with.
    #[error("the normal problem has no answer: {reason}")]
    NormalProblem {
        /// Why, as a clause.
        reason: String,
    },
    /// The points of a profile allow no answer that can be relied on.
    #[error("{reason} (at {pointer})")]
    RoughProfile {
        /// JSON pointer to the profile.
        pointer: String,
        /// What is wrong with it, and what to do.
        reason: String,
    },
    /// The caller stopped the solve.
    #[error("the solve was cancelled")]
    Cancelled,
    /// The time limit of the case was reached.
    #[error("the solve ran out of time{}", reached(*.limit_s, *.motions))]
    OutOfTime {
        /// The limit in s, where it is the case's own.
        limit_s: Option<f64>,
        /// Motions done and asked for, where that is known.
        motions: Option<[usize; 2]>,
    },
    /// The answer holds something that is no number; nothing of it is to be used.
    #[error(
        "the answer is not finite: {quantity}; check the case for values that are extremely large or small"
    )]
    NotFinite {
        /// Where it stands in the answer.
        quantity: String,
    },
}

impl From<Stop> for SolveError {
    fn from(stop: Stop) -> Self {
        match stop {
            Stop::Cancelled => SolveError::Cancelled,
            Stop::OutOfTime => SolveError::OutOfTime {
                limit_s: None,
                motions: None,
            },
        }
    }
}

/// Which limit was reached, and how far the solve had come.
fn reached(limit_s: Option<f64>, motions: Option<[usize; 2]>) -> String {
    let limit = limit_s.map_or_else(String::new, |limit| {
        format!(": time_limit_s {limit} was reached")
    });
    let far = motions.map_or_else(String::new, |[done, asked]| {
        format!(" with {done} of {asked} motions done")
    });
    limit + &far
}
