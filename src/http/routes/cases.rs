//! `/v1/cases/check`: checks a case and estimates its cost, without a job.

use axum::Json;
use axum::extract::State;
use railhead_macros::none_is_absent;
use serde::Serialize;
use utoipa::ToSchema;

use crate::extract::caller::Caller;
use crate::extract::json::JsonBody;
use crate::limits::{Memory, MemoryPermit};
use crate::options::HttpOptions;
use crate::problem::{ApiError, Result, problems};
use railhead_contact::case::words::solver::{Case, MethodName, Output};
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::remark::entry::{RemarkEntry, merged};
use railhead_contact::solution::words::answer::{FoundBy, Understanding};
use railhead_contact::solution::words::damage::PairQuality;
use railhead_jobs::sync::blocking;

/// A case that can be solved, and its expected cost.
#[none_is_absent]
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = CheckedCase)]
pub(crate) struct CheckReport {
    /// Digest of everything that determines the result; cases with equal digests have equal results.
    digest: String,
    /// The method the case asks for.
    method: MethodName,
    /// What will be computed.
    outputs: Vec<Output>,
    /// Number of motions.
    motions: usize,
    /// Expected cost.
    estimate: Estimate,
    /// How the case was interpreted; absent if no part of the wheel lies above the rail.
    understood: Option<Understanding>,
    /// Quality of the points of the profiles, as far as it is known before solving; only for `profiles`.
    quality: Option<PairQuality>,
    /// Remarks to read before using the numbers.
    remarks: Vec<RemarkEntry>,
}

/// Rough estimate of the cost of a case.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Estimate {
    /// Peak memory in bytes.
    bytes: u64,
    /// Part of `bytes` that stays in the operator store, which all workers share.
    operator_store_bytes: u64,
    /// Solve time on one core, in s.
    seconds: f64,
    /// How `seconds` was determined.
    found_by: FoundBy,
}

problems! {
    /// Problems of `POST /v1/cases/check`.
    CheckProblems: BadQuery, MalformedJson, UnreadableBody, BodyTimeout, BodyTooLarge, UnsupportedMediaType, UnsupportedEncoding, FaultyCase
}

/// Checks a case and estimates its cost, without making a job.
///
/// The case is solved for 0.2 s, unless the operator sets another time. If it does not end within this time, formulas estimate the rest.
#[utoipa::path(
    post,
    path = "/v1/cases/check",
    tag = "cases",
    operation_id = "check_case",
    request_body(content = Case, description = "One case", content_type = "application/json"),
    responses((status = 200, description = "The case can be solved", body = CheckReport), CheckProblems)
)]
pub(crate) async fn check(
    Caller(jobs): Caller,
    State(memory): State<Memory>,
    State(options): State<HttpOptions>,
    JsonBody { value, mut room }: JsonBody,
) -> Result<Json<CheckReport>> {
    if room.turn.is_none() {
        room.turn = Some(memory.turn(jobs.tenant(), 0).await?);
    }
    let value = jobs.with_profiles(value).await?;
    let MemoryPermit { share, turn } = room;
    // Checking a large grid would delay other requests.
    let checked = blocking(move || {
        // The slot is held until the work ends, even if the client has disconnected.
        let _turn = turn;
        let checked = jobs.check(&value)?;
        let report = report(&checked);
        Ok::<_, ApiError>((jobs, checked, report))
    });
    let (jobs, case, mut report) = checked.await??;
    let limit = options.check_trial;
    let turn = match limit.is_zero() {
        true => None,
        false => memory.trial(jobs.tenant(), limit).await,
    };
    if let Some(turn) = turn {
        let probed = blocking(move || {
            let _held = (turn, share);
            jobs.probe(&case, limit)
        });
        // If the trial panics, the estimate by formulas remains.
        if let Ok(probed) = probed.await {
            report.estimate.seconds = probed.seconds;
            report.estimate.found_by = probed.found_by;
        }
    }
    Ok(Json(report))
}

/// Returns the report on a checked case, with the time by formulas.
fn report(checked: &CheckedCase) -> CheckReport {
    let (cost, remarks) = (checked.cost(), checked.remarks.iter());
    CheckReport {
        digest: checked.label.digest.clone(),
        method: checked.run.method_asked,
        outputs: checked.run.outputs.clone(),
        motions: checked.problem.motions.len(),
        estimate: Estimate {
            bytes: cost.bytes,
            operator_store_bytes: cost.operator_store_bytes,
            seconds: cost.seconds,
            found_by: FoundBy::Formulas,
        },
        // A wheel that lies nowhere above its rail has no placement; solving such a case reports it.
        understood: checked.understood().ok(),
        quality: checked.quality(),
        remarks: merged(remarks.cloned().chain(checked.touch_remarks())),
    }
}
