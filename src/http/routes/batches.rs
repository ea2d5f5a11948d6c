//! `/v1/batches`: many cases in one request, followed and cancelled as one.

use std::collections::BTreeMap;

use axum::Json;
use axum::extract::{Request, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use uuid::Uuid;

use crate::http::dto::batch::{BatchAnswer, BatchReceipt, Cases};
use crate::http::extract::batch::body::{form, read_draft};
use crate::http::extract::caller::Caller;
use crate::http::extract::ids::BatchId;
use crate::http::extract::labels::{LABELS_MAX, name, new_label};
use crate::http::extract::multipart::{TableUpload, separate_template};
use crate::http::extract::query::{Parameters, Repeated, id, query, reader};
use crate::http::extract::submit_options::SubmitQuery;
use crate::http::limits::memory::Memory;
use crate::http::options::HttpOptions;
use crate::http::problem::body::Fault;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::http::routes::jobs::{idempotency_key, mark_replay};
use crate::http::routes::wait::{Wait, WaitQuery};
use crate::jobs::batch::upload::BatchUpload;
use crate::jobs::model::kind::Kind;

problems! {
    /// What `POST /v1/batches` can fail with.
    BatchProblems: MalformedJson, UnreadableBody, BadQuery, BadHeader, BodyTimeout, BodyTooLarge, UnsupportedMediaType, UnsupportedEncoding,
    FaultyBatch, FaultyTable, JobNotFound, IdempotencyConflict, QuotaExceeded, StoredQuotaExceeded, QueueFull, Draining, StorageFull, StorageUnwritable, StorageUnreachable
}

query! {
    /// What the query of a submission says about the batch itself.
    BatchQuery(() => ()) {
        /// `reject` (when left out): one faulty case refuses the batch; `skip`: faulty cases are left out and reported
        #[param(pattern = "^(reject|skip)$", example = "skip")]
        on_invalid: bool as String = reader("`reject` or `skip`", |text| match text {
            "reject" => Some(false),
            "skip" => Some(true),
            _ => None,
        });
        /// Name of the batch
        #[param(min_length = 1, max_length = 200, example = "timetable 2026")]
        name: String as String = name();
        /// A label of the batch, written `key:value`; may be repeated, for at most 32 labels with different keys
        #[param(max_items = 32, example = json!(["line:A12"]))]
        label: Vec<(String, String)> as Vec<String> = Repeated(new_label());
        /// The job whose case is the template of a table; not with `multipart/form-data`, which holds the template itself
        #[param(format = "uuid")]
        template: Uuid as String = id("job");
    }
}

/// Submits many cases as one batch of jobs.
///
/// The body is a JSON array of cases, one case per line (`application/x-ndjson`), or a table whose lines fill the cells of
/// a template case: as `multipart/form-data` with the parts `template` and `table`, or alone with `?template=` naming a job. Tables are CSV,
/// Arrow, Parquet or NPZ, and with a template also NDJSON with a row per line. JSON, NDJSON and CSV are read as they arrive. All jobs of
/// a batch answered with `202` are stored durably. Without `on_invalid=skip` one faulty case refuses the whole batch (`422`), and
/// nothing is stored; every fault names its case, and its line in NDJSON and CSV. A JSON array that is not JSON is `400`; a line that is not JSON is a faulty case.
#[utoipa::path(
    post,
    path = "/v1/batches",
    tag = "batches",
    operation_id = "submit_batch",
    params(
        BatchQuery,
        SubmitQuery,
        WaitQuery,
        ("Prefer" = Option<String>, Header, description = "`wait=N`, as `?wait=N` (RFC 7240)", example = "wait=10"),
        ("Idempotency-Key" = Option<String>, Header, min_length = 1, max_length = 255, pattern = "^[!-~]+$", description = "1 to 255 visible ASCII characters. Repeating a request with the same key, the same cases and the same options answers the first batch instead of making another"),
        ("Cache-Control" = Option<String>, Header, description = "`no-cache`: solve all cases, also those that are identical to cases solved before", example = "no-cache"),
        ("traceparent" = Option<String>, Header, description = "W3C trace context: if the service exports traces, the traces of the jobs continue the client's trace. An unreadable value is ignored", example = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01")
    ),
    request_body(content(
        (Cases = "application/json"),
        (String = "application/x-ndjson"),
        (String = "text/csv"),
        (Vec<u8> = "application/vnd.apache.arrow.stream"),
        (Vec<u8> = "application/vnd.apache.parquet"),
        (Vec<u8> = "application/x-npz"),
        (TableUpload = "multipart/form-data")
    ), description = "Cases, at most 200 000, each of at most 8 MiB and together at most 1 GiB"),
    responses(
        (status = 200, description = "All jobs ended within the wait", body = BatchReceipt, headers(
            ("Location" = String, description = "Path of the batch"),
            ("Preference-Applied" = String, description = "The wait that was applied, if one was preferred"),
            ("Idempotency-Replayed" = String, description = "`true` if this is the batch of an earlier request with the same `Idempotency-Key`; absent otherwise")
        )),
        (status = 202, description = "The jobs are stored and will be solved", body = BatchReceipt, headers(
            ("Location" = String, description = "Path of the batch"),
            ("Idempotency-Replayed" = String, description = "`true` if this is the batch of an earlier request with the same `Idempotency-Key`; absent otherwise")
        )),
        BatchProblems
    )
)]
pub(crate) async fn submit(
    Caller(jobs): Caller,
    wait: Wait,
    State(options): State<HttpOptions>,
    State(memory): State<Memory>,
    request: Request,
) -> Result<Response, ApiError> {
    let key = idempotency_key(request.headers())?;
    let ((batch, submit), _) = <((BatchQuery, SubmitQuery), WaitQuery)>::read(request.uri(), &())?;
    let submit_options = submit.options(request.headers());
    let mut labels = labels_of(batch.label.unwrap_or_default())?;
    jobs.bind(&mut labels)
        .map_err(|faults| ApiError::bad_parameter("label", faults[0].detail.clone()))?;
    let (request, template) =
        separate_template(&jobs, &memory, &options, batch.template, request).await?;
    let (form, template_share) = form(&jobs, request.headers(), template).await?;
    let mut draft = read_draft(&jobs, &memory, &options, form, request).await?;
    drop(template_share);
    draft.options = submit_options;
    draft.name = batch.name;
    draft.labels = labels;
    if draft.cases == draft.rejected || (draft.rejected > 0 && !batch.on_invalid.unwrap_or(false)) {
        return Err(refusal(&draft));
    }
    let errors = faults(&draft);
    let (mut batch, replayed) = jobs.submit_batch(draft, key).await?;
    let location = [(header::LOCATION, format!("/v1/batches/{}", batch.id))];
    let id = batch.id;
    // The batch is stored: whatever ends the wait early, the client must learn its id.
    let waited = wait.hold(&jobs, async |at_most| {
        jobs.wait_batch(Kind::Cases, id, at_most).await
    });
    if let Ok(Some(Ok(later))) = waited.await {
        batch = later;
    }
    let batch = BatchAnswer::from(batch);
    let status = match batch.ended {
        true if wait.at_most().is_some() => StatusCode::OK,
        _ => StatusCode::ACCEPTED,
    };
    let receipt = BatchReceipt { batch, errors };
    let mut response = (status, location, Json(receipt)).into_response();
    mark_replay(&mut response, replayed);
    Ok(wait.tell_applied(response))
}

/// The labels of a submission.
///
/// # Errors
/// They are too many, or two have the same key.
pub(crate) fn labels_of(
    given: Vec<(String, String)>,
) -> Result<BTreeMap<String, String>, ApiError> {
    let number = given.len();
    let labels: BTreeMap<String, String> = given.into_iter().collect();
    if labels.len() < number || number > LABELS_MAX {
        let detail = format!(
            "{number} labels are given; at most {LABELS_MAX} with different keys are allowed"
        );
        return Err(ApiError::bad_parameter("label", detail));
    }
    Ok(labels)
}

/// Why a batch is not taken.
fn refusal(draft: &BatchUpload) -> ApiError {
    if draft.cases == 0 {
        return ApiError::new(ProblemKind::FaultyBatch, "the batch has no case");
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

fn faults(draft: &BatchUpload) -> Vec<Fault> {
    let cases = draft.faulty.iter();
    let faults = cases.flat_map(|case| {
        case.faults.iter().map(|fault| Fault {
            pointer: Some(format!("/{}{}", case.index, fault.pointer)),
            line: case.line,
            ..Fault::from(fault.clone())
        })
    });
    faults.collect()
}

problems! {
    /// What asking for a batch can fail with.
    GetBatchProblems: BadQuery, BatchNotFound
}

/// Returns a batch.
#[utoipa::path(
    get,
    path = "/v1/batches/{id}",
    tag = "batches",
    operation_id = "get_batch",
    params(
        ("id" = String, Path, description = "Id of the batch", format = "uuid"),
        WaitQuery,
        ("Prefer" = Option<String>, Header, description = "`wait=N`, as `?wait=N` (RFC 7240)", example = "wait=10")
    ),
    responses((status = 200, description = "The batch", body = BatchAnswer, headers(
        ("Preference-Applied" = String, description = "The wait that was applied, if one was preferred")
    )), GetBatchProblems)
)]
pub(crate) async fn get(
    Caller(jobs): Caller,
    BatchId(id): BatchId,
    wait: Wait,
) -> Result<Response, ApiError> {
    let kind = Kind::Cases;
    let waited = wait.hold(&jobs, async |at_most| {
        jobs.wait_batch(kind, id, at_most).await
    });
    let batch = match waited.await? {
        Some(batch) => batch?,
        None => jobs.batch(kind, id).await?,
    };
    Ok(wait.tell_applied(Json(BatchAnswer::from(batch)).into_response()))
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
        GetBatchProblems
    )
)]
pub(crate) async fn cancel(
    Caller(jobs): Caller,
    BatchId(id): BatchId,
) -> Result<Response, ApiError> {
    let batch: BatchAnswer = jobs.cancel_batch(Kind::Cases, id).await?.into();
    let status = if batch.ended {
        StatusCode::OK
    } else {
        StatusCode::ACCEPTED
    };
    Ok((status, Json(batch)).into_response())
}

problems! {
    /// What deleting a batch can fail with.
    DeleteBatchProblems: BadQuery, BatchNotFound, BatchNotEnded
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
pub(crate) async fn delete(
    Caller(jobs): Caller,
    BatchId(id): BatchId,
) -> Result<StatusCode, ApiError> {
    jobs.delete_batch(Kind::Cases, id).await?;
    Ok(StatusCode::NO_CONTENT)
}
