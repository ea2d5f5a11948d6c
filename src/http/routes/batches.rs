//! `/v1/batches`: many cases in one request, followed and cancelled as one.

use std::collections::BTreeMap;

use axum::Json;
use axum::extract::{Request, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::contact::case::Case;
use crate::http::dto::job::rfc3339;
use crate::http::dto::problem::Fault;
use crate::http::extract::batch::body::{form, read_draft};
use crate::http::extract::ids::BatchId;
use crate::http::extract::query::{Parameters, id, query, reader};
use crate::http::extract::submit_options::SubmitQuery;
use crate::http::layers::auth::Caller;
use crate::http::limits::memory::Memory;
use crate::http::options::HttpOptions;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::Kind;
use crate::http::routes::jobs::{idempotency_key, mark_replay};
use crate::jobs::batch::Batch;
use crate::jobs::draft::Draft;
use crate::jobs::job::State as JobState;

/// The cases of a batch.
#[derive(ToSchema)]
#[schema(min_items = 1, max_items = 200_000)]
#[expect(
    dead_code,
    reason = "the form of a body that is cut into cases while it arrives"
)]
pub struct Cases(Vec<Case>);

/// A batch that was accepted.
#[derive(Debug, Serialize, ToSchema)]
pub struct BatchReceipt {
    /// Identifier of the batch.
    #[schema(value_type = String, format = "uuid")]
    id: String,
    /// Number of jobs made.
    count: u32,
    /// Number of faulty cases that were left out; 0 unless the request said `accept=valid`.
    rejected: u32,
    /// The faults of the cases that were left out, those of the first 1000.
    errors: Vec<Fault>,
    /// Where to go from here.
    links: BTreeMap<String, String>,
}

/// A batch: how far it is.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Batch)]
pub struct BatchAnswer {
    /// Identifier of the batch.
    #[schema(value_type = String, format = "uuid")]
    id: String,
    /// Time of submission.
    #[schema(format = "date-time", example = "2026-01-31T09:30:00.000Z")]
    created_at: String,
    /// Number of jobs made.
    count: u32,
    /// Number of faulty cases that were left out.
    rejected: u32,
    /// Number of jobs in each state.
    states: BatchStates,
    /// Share of the jobs that have ended.
    #[schema(minimum = 0.0, maximum = 1.0)]
    progress: f64,
    /// Every job has ended.
    ended: bool,
    /// Where to go from here.
    links: BTreeMap<String, String>,
}

/// Number of jobs in each state.
#[derive(Debug, Serialize, ToSchema)]
pub struct BatchStates {
    queued: u64,
    running: u64,
    succeeded: u64,
    failed: u64,
    cancelled: u64,
}

impl From<Batch> for BatchAnswer {
    fn from(batch: Batch) -> Self {
        let (ended, all) = batch.ended();
        #[expect(clippy::cast_precision_loss, reason = "far fewer jobs than 2^53")]
        let progress = if all == 0 {
            1.0
        } else {
            ended as f64 / all as f64
        };
        BatchAnswer {
            id: batch.id.to_string(),
            created_at: rfc3339(batch.created_at),
            count: batch.count,
            rejected: batch.rejected,
            states: BatchStates {
                queued: batch.in_state(JobState::Queued),
                running: batch.in_state(JobState::Running),
                succeeded: batch.in_state(JobState::Succeeded),
                failed: batch.in_state(JobState::Failed),
                cancelled: batch.in_state(JobState::Cancelled),
            },
            progress,
            ended: ended == all,
            links: links(&batch),
        }
    }
}

fn links(batch: &Batch) -> BTreeMap<String, String> {
    let own = format!("/v1/batches/{}", batch.id);
    BTreeMap::from([
        ("results".to_owned(), format!("{own}/results")),
        ("cancel".to_owned(), format!("{own}/cancel")),
        ("events".to_owned(), format!("{own}/events")),
        ("jobs".to_owned(), format!("/v1/jobs?batch={}", batch.id)),
        ("self".to_owned(), own),
    ])
}

problems! {
    /// What `POST /v1/batches` can fail with.
    BatchProblems: MalformedJson, UnreadableBody, BadQuery, BadHeader, BodyTimeout, BodyTooLarge, UnsupportedMediaType, UnsupportedEncoding,
    FaultyBatch, FaultyTable, JobNotFound, IdempotencyConflict, QuotaExceeded, QueueFull, Draining, StorageFull, StorageUnwritable
}

query! {
    /// What the query of a submission says about the batch itself.
    BatchQuery(() => ()) {
        /// `all` (when left out): one faulty case refuses the batch; `valid`: faulty cases are left out and reported
        #[param(pattern = "^(all|valid)$", example = "valid")]
        accept: bool as String = reader("`all` or `valid`", |text| match text {
            "all" => Some(false),
            "valid" => Some(true),
            _ => None,
        });
        /// With `text/csv`, and needed there: the job whose case is the template
        #[param(format = "uuid")]
        template: Uuid as String = id("job");
    }
}

/// Submits many cases as one batch of jobs.
///
/// The body is a JSON array of cases, one case per line (`application/x-ndjson`), or a table (`text/csv`) whose lines fill the cells of
/// a template case; it is read as it arrives. All jobs of
/// a batch answered with `202` are stored durably. Without `accept=valid` one faulty case refuses the whole batch (`422`), and
/// nothing is stored; every fault names its case, and its line in NDJSON and CSV. A JSON array that is not JSON is `400`; a line that is not JSON is a faulty case.
#[utoipa::path(
    post,
    path = "/v1/batches",
    tag = "batches",
    operation_id = "submit_batch",
    params(
        BatchQuery,
        SubmitQuery,
        ("Idempotency-Key" = Option<String>, Header, min_length = 1, max_length = 255, pattern = "^[!-~]+$", description = "1 to 255 visible ASCII characters. Repeating a request with the same key, the same cases and the same options answers the first batch instead of making another"),
        ("Cache-Control" = Option<String>, Header, description = "`no-cache`: solve all cases, also those that are identical to cases solved before", example = "no-cache"),
        ("traceparent" = Option<String>, Header, description = "W3C trace context: where the service sends traces, that of the jobs goes on with the client's. What cannot be read is passed over", example = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01")
    ),
    request_body(content(
        (Cases = "application/json"),
        (String = "application/x-ndjson"),
        (String = "text/csv")
    ), description = "Cases, at most 200 000, each of at most 8 MiB and together at most 1 GiB"),
    responses(
        (status = 202, description = "The jobs are stored and will be solved", body = BatchReceipt, headers(
            ("Location" = String, description = "Path of the batch"),
            ("Idempotency-Replayed" = String, description = "`true` if this is the batch of an earlier request with the same `Idempotency-Key`; absent otherwise")
        )),
        BatchProblems
    )
)]
pub async fn submit(
    Caller(jobs): Caller,
    State(options): State<HttpOptions>,
    State(memory): State<Memory>,
    request: Request,
) -> Result<Response, ApiError> {
    let key = idempotency_key(request.headers())?;
    let (batch, submit) = <(BatchQuery, SubmitQuery)>::read(request.uri(), &())?;
    let wishes = submit.options(request.headers());
    let form = form(&jobs, request.headers(), batch.template).await?;
    let mut draft = read_draft(&jobs, &memory, &options, form, request).await?;
    draft.wishes = wishes;
    if draft.cases == draft.rejected || (draft.rejected > 0 && !batch.accept.unwrap_or(false)) {
        return Err(refusal(&draft));
    }
    let errors = faults(&draft);
    let (batch, replayed) = jobs.submit_batch(draft, key).await?;
    let location = [(header::LOCATION, format!("/v1/batches/{}", batch.id))];
    let receipt = BatchReceipt {
        id: batch.id.to_string(),
        count: batch.count,
        rejected: batch.rejected,
        errors,
        links: links(&batch),
    };
    let mut response = (StatusCode::ACCEPTED, location, Json(receipt)).into_response();
    mark_replay(&mut response, replayed);
    Ok(response)
}

/// Why a batch is not taken.
fn refusal(draft: &Draft) -> ApiError {
    if draft.cases == 0 {
        return ApiError::new(Kind::FaultyBatch, "the batch has no case");
    }
    let kept = draft.faulty.len();
    let more = match draft.rejected as usize - kept {
        0 => String::new(),
        _ => format!("; the faults of the first {kept} of them are listed"),
    };
    ApiError::faulty_batch(
        format!(
            "{} of {} cases have faults, so nothing was stored{more}",
            draft.rejected, draft.cases
        ),
        faults(draft),
    )
}

fn faults(draft: &Draft) -> Vec<Fault> {
    let cases = draft.faulty.iter();
    let faults = cases.flat_map(|case| {
        case.faults.iter().map(|fault| Fault {
            pointer: Some(format!("/{}{}", case.index, fault.pointer)),
            parameter: None,
            header: None,
            line: case.line,
            detail: fault.detail.clone(),
        })
    });
    faults.collect()
}

problems! {
    /// What looking at a batch can fail with.
    LookBatchProblems: BatchNotFound
}

/// Looks at a batch.
#[utoipa::path(
    get,
    path = "/v1/batches/{id}",
    tag = "batches",
    operation_id = "get_batch",
    params(("id" = String, Path, description = "Id of the batch", format = "uuid")),
    responses((status = 200, description = "The batch", body = BatchAnswer), LookBatchProblems)
)]
pub async fn look(
    Caller(jobs): Caller,
    BatchId(id): BatchId,
) -> Result<Json<BatchAnswer>, ApiError> {
    Ok(Json(jobs.batch(id).await?.into()))
}

/// Stops all jobs of a batch that have not ended. Those that have ended stay as they are.
#[utoipa::path(
    post,
    path = "/v1/batches/{id}/cancel",
    tag = "batches",
    operation_id = "cancel_batch",
    params(("id" = String, Path, description = "Id of the batch", format = "uuid")),
    responses(
        (status = 200, description = "Every job has ended", body = BatchAnswer),
        (status = 202, description = "The running jobs will stop shortly", body = BatchAnswer),
        LookBatchProblems
    )
)]
pub async fn cancel(Caller(jobs): Caller, BatchId(id): BatchId) -> Result<Response, ApiError> {
    let batch: BatchAnswer = jobs.cancel_batch(id).await?.into();
    let status = if batch.ended {
        StatusCode::OK
    } else {
        StatusCode::ACCEPTED
    };
    Ok((status, Json(batch)).into_response())
}

problems! {
    /// What deleting a batch can fail with.
    DeleteBatchProblems: BatchNotFound, BatchNotEnded
}

/// Removes a batch of which every job has ended, with its jobs, their cases and their results.
#[utoipa::path(
    delete,
    path = "/v1/batches/{id}",
    tag = "batches",
    operation_id = "delete_batch",
    params(("id" = String, Path, description = "Id of the batch", format = "uuid")),
    responses((status = 204, description = "The batch is gone"), DeleteBatchProblems)
)]
pub async fn delete(Caller(jobs): Caller, BatchId(id): BatchId) -> Result<StatusCode, ApiError> {
    jobs.delete_batch(id).await?;
    Ok(StatusCode::NO_CONTENT)
}
