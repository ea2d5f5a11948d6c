//! How the time that a case will take was found.

use serde::Serialize;
use utoipa::ToSchema;

/// How a time was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FoundBy {
    /// The case was solved.
    Solve,
    /// The case was solved up to an error, with which a job would end as well.
    FailedSolve,
    /// The solve had begun when the time ran out.
    PartOfSolve,
    /// Nothing was solved.
    Formulas,
}
