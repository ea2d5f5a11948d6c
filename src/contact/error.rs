//! The errors of `contact`: a case with faults, and a solve without an answer.

use railhead_macros::Code;
use serde_json::{Number, Value};
use thiserror::Error;

use crate::method::Method;
use crate::monitor::Stop;

/// One fault of a case: where it is, what was given, what is allowed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// JSON pointer (RFC 6901) to the faulty member; empty for the whole case.
    pub pointer: String,
    /// The value given and what is allowed, as a sentence.
    pub detail: String,
    /// The same in a form for programs, as far as it can be expressed so.
    pub figures: Box<FaultFigures>,
}

impl Fault {
    /// A fault described by its sentence alone.
    pub fn new(pointer: impl Into<String>, detail: impl Into<String>) -> Fault {
        Fault {
            pointer: pointer.into(),
            detail: detail.into(),
            figures: Box::default(),
        }
    }
}

/// What a fault is, for programs.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FaultFigures {
    /// The kind of the fault.
    pub code: FaultCode,
    /// The value given, unless it is an array, an object or a long text.
    pub value: Option<Value>,
    /// Smallest number allowed.
    pub minimum: Option<Number>,
    /// The smallest number itself is not allowed.
    pub minimum_excluded: bool,
    /// Largest number, or number of elements or characters, allowed.
    pub maximum: Option<Number>,
    /// Unit of `minimum` and `maximum`.
    pub unit: Option<&'static str>,
    /// The values that are allowed.
    pub allowed: Vec<String>,
}

/// Kinds of faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Code)]
pub enum FaultCode {
    /// Another kind, described by the sentence.
    #[default]
    Invalid,
    /// A member that is needed is not there.
    Missing,
    /// A member is not known here.
    UnknownMember,
    /// A value of another type is needed.
    WrongType,
    /// A number is too small or too large.
    OutOfRange,
    /// A word is none of those allowed.
    UnknownWord,
    /// A text is too long.
    TooLong,
}

/// Every fault of a case at once; never empty.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("the case has {} fault(s): {}", .0.len(), .0.iter().map(|f| format!("{}: {}", f.pointer, f.detail)).collect::<Vec<_>>().join("; "))]
pub struct CaseError(pub Vec<Fault>);

impl From<Fault> for CaseError {
    fn from(fault: Fault) -> CaseError {
        CaseError(vec![fault])
    }
}

/// Why a solve gave no answer.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SolveError {
    /// The iteration ended without meeting its tolerance.
    #[error(
        "{} did not converge at motion {point}: residual {residual:.3e} after {iterations} iterations, {tolerance:.1e} was needed; {advice}",
        .method.name()
    )]
    NotConverged {
        /// The method that did not converge.
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
    #[error("the normal problem has no solution: {reason}")]
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
    /// The method does not cover the contact.
    #[error("{reason}")]
    NotCovered {
        /// Why, and which method does.
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
    /// The answer contains a number that is not finite; none of it is usable.
    #[error(
        "the result is not finite: {quantity}; check the case for values that are extremely large or small"
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
