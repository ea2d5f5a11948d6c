//! The errors of this crate: a case with faults, and a solve without an answer.

use railhead_macros::Code;
use serde_json::{Number, Value};
use thiserror::Error;

use crate::method::Method;
use crate::monitor::Stop;

/// One fault of a case: its location, the given value and the allowed ones.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// JSON pointer (RFC 6901) to the faulty member; empty for the whole case.
    pub pointer: String,
    /// A sentence with the given value and the allowed ones.
    pub detail: String,
    /// The kind of the fault and its values, for programs.
    pub figures: Box<FaultFigures>,
}

impl Fault {
    /// Creates a fault that is described by its sentence alone.
    pub fn new(pointer: impl Into<String>, detail: impl Into<String>) -> Fault {
        Fault {
            pointer: pointer.into(),
            detail: detail.into(),
            figures: Box::default(),
        }
    }
}

/// The kind of a fault and its values, for programs.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FaultFigures {
    /// The kind of the fault.
    pub code: FaultCode,
    /// The given value, unless it is an array, an object or a long text.
    pub value: Option<Value>,
    /// Smallest allowed number.
    pub minimum: Option<Number>,
    /// Whether `minimum` itself is not allowed.
    pub minimum_excluded: bool,
    /// Largest allowed number, or number of characters.
    pub maximum: Option<Number>,
    /// Unit of `minimum` and `maximum`.
    pub unit: Option<&'static str>,
    /// The allowed values.
    pub allowed: Vec<String>,
}

/// Kinds of faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Code)]
pub enum FaultCode {
    /// Another kind, described by the sentence.
    #[default]
    Invalid,
    /// A required member is absent.
    Missing,
    /// A member is unknown.
    UnknownMember,
    /// A value has the wrong type.
    WrongType,
    /// A number is too small or too large.
    OutOfRange,
    /// A keyword is not among the allowed ones.
    UnknownWord,
    /// A text is too long.
    TooLong,
}

/// All faults of a case; never empty.
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
        /// Index of the motion in the case, from 0.
        point: usize,
        /// Number of iterations.
        iterations: usize,
        /// Residual of the best iterate, relative to the traction scale of the case.
        residual: f64,
        /// Tolerance of the residual.
        tolerance: f64,
        /// Advice as a clause.
        advice: String,
    },
    /// No strip of the mesh meets the patch: its edge is too irregular or it has too few samples.
    #[error(
        "none of the {strips} strips meets patch {patch}; give more strips, or a pressure with more samples"
    )]
    Unmeshable {
        /// Index of the patch, from 0.
        patch: usize,
        /// Number of strips of the mesh.
        strips: u32,
    },
    /// The normal problem has no solution.
    #[error("the normal problem has no solution: {reason}")]
    NormalProblem {
        /// The reason as a clause.
        reason: String,
    },
    /// The points of a profile do not allow a reliable result.
    #[error("{reason} (at {pointer})")]
    RoughProfile {
        /// JSON pointer to the profile.
        pointer: String,
        /// The defect, and the advice.
        reason: String,
    },
    /// The method does not cover the contact.
    #[error("{reason}")]
    NotCovered {
        /// The reason, and a method that covers it.
        reason: String,
    },
    /// The caller stopped the solve.
    #[error("the solve was cancelled")]
    Cancelled,
    /// The time limit of the case was reached.
    #[error("the solve ran out of time{}", reached(*.limit_s, *.motions))]
    OutOfTime {
        /// The limit in s, if the case has one.
        limit_s: Option<f64>,
        /// The numbers of solved and of all motions, if they are known.
        motions: Option<[usize; 2]>,
    },
    /// The answer contains a number that is not finite, so that it is not usable.
    #[error(
        "the result is not finite: {quantity}; check the case for values that are extremely large or small"
    )]
    NotFinite {
        /// Path of the number in the answer.
        quantity: String,
    },
}

impl SolveError {
    /// Creates the error of a normal problem without a solution from the reason, a clause.
    pub(crate) fn normal_problem(reason: impl Into<String>) -> SolveError {
        SolveError::NormalProblem {
            reason: reason.into(),
        }
    }
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

/// Formats the time limit and the progress of a solve.
fn reached(limit_s: Option<f64>, motions: Option<[usize; 2]>) -> String {
    let limit = limit_s.map_or_else(String::new, |limit| {
        format!(": time_limit_s {limit} was reached")
    });
    let far = motions.map_or_else(String::new, |[done, asked]| {
        format!(" with {done} of {asked} motions done")
    });
    limit + &far
}
