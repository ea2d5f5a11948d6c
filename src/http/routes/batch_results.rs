//! `/v1/batches/{id}/results`: one line per case in the order they were sent, written while it is read.

use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;

use axum::Extension;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::{HeaderMap, Uri, header};
use axum::response::{IntoResponse, Response};
use futures_util::stream::try_unfold;
use serde::Serialize;
use tokio::time::Instant;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::http::dto::problem::ProblemBody;
use crate::http::dto::result::JobResult;
use crate::http::extract::accept::{Format, choose, one_of};
use crate::http::extract::caller::{Caller, Credential, revoked};
use crate::http::extract::ids::BatchId;
use crate::http::extract::query::{Parameters, Repeated, id, query, reader, seconds};
use crate::http::layers::compression::StreamedUnbuffered;
use crate::http::limits::concurrency::ConcurrencyLimits;
use crate::http::limits::holding_body::{HeldShares, hold_while_sent};
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::http::render::batch_csv::Columns;
use crate::jobs::Jobs;
use crate::jobs::batch::model::{BatchItem, ItemResult};
use crate::jobs::error::JobsError;
use crate::jobs::model::State as JobState;

/// Longest time results are waited for, in s.
const WAIT_MAX_SECONDS: u32 = 3600;
/// Most jobs read at once, and how many the first time.
const PAGE_JOBS: u32 = 500;
const FIRST_PAGE_JOBS: u32 = 50;

/// One line of the results of a batch.
#[derive(Debug, Serialize, ToSchema)]
pub struct BatchLine {
    /// Place of the case in what was sent, counted from 0.
    index: u32,
    /// Identifier of the job.
    #[schema(format = "uuid")]
    id: String,
    /// Free text of the case.
    name: Option<String>,
    /// Labels of the case.
    labels: std::collections::BTreeMap<String, String>,
    /// Where the job stands.
    state: JobState,
    /// The result, as `/v1/jobs/{id}/result` answers it; only of a succeeded job.
    #[serde(skip_serializing_if = "Option::is_none")]
    result: Option<JobResult>,
    /// Why there is no result: why the job failed, or that its result was removed while the lines were read or cannot be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<ProblemBody>,
}

/// The forms that the results of a batch come in.
const FORMATS: &[Format] = &[Format::Ndjson, Format::Csv];

query! {
    /// Parameters of the results of a batch.
    BatchResultsQuery(() => ()) {
        /// Wait for jobs that have not ended, at most this many seconds in all; lines are sent as soon as everything before them is there
        #[param(minimum = 0, maximum = 3600)]
        wait: u32 as u32 = seconds(0, WAIT_MAX_SECONDS);
        /// Only lines after that of this job, as to go on after the last line that was read
        #[param(format = "uuid")]
        after: Uuid as String = id("job");
        /// Only lines of jobs in this state; may be repeated for jobs in one of several
        state: Vec<JobState> as Vec<JobState> = Repeated(reader(JobState::ALL.map(JobState::name).join(", "), JobState::from_name));
        /// Columns of the CSV, with commas between, such as `label:km,force_y_n`; with `patch` among them there is a line for each patch. See `docs/formats.md`
        #[param(example = "label:km,pressure_max_mpa,target_met")]
        columns: Columns as String = reader(Columns::allowed(), Columns::read);
        /// `ndjson` or `csv`; overrides `Accept`
        #[param(pattern = "^(ndjson|csv)$", example = "csv")]
        format: Format as String = one_of(FORMATS);
    }
}

problems! {
    /// What the results of a batch can fail with.
    BatchResultProblems: BadQuery, BatchNotFound
}

/// The results of a batch in the order its cases were sent.
///
/// NDJSON: exactly one line per job, nothing else. CSV: a header, then one line per job and motion with the sums over
/// all patches, or with the column `patch` one line per job, motion and patch; a job without a result has one line without numbers. Without `wait` unfinished jobs appear with their state.
#[utoipa::path(
    get,
    path = "/v1/batches/{id}/results",
    tag = "batches",
    operation_id = "get_batch_results",
    params(
        ("id" = String, Path, description = "Id of the batch", format = "uuid"),
        BatchResultsQuery
    ),
    responses((status = 200, description = "One line per job", content((BatchLine = "application/x-ndjson"), (String = "text/csv"))), BatchResultProblems)
)]
pub async fn results(
    Caller(jobs): Caller,
    BatchId(id): BatchId,
    uri: Uri,
    State(crowds): State<ConcurrencyLimits>,
    Extension(held): Extension<HeldShares>,
    key: Option<Extension<Credential>>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let query = BatchResultsQuery::read(&uri, &())?;
    let wait = query.wait;
    let format = choose(&headers, query.format, FORMATS)?;
    if query.columns.is_some() && format != Format::Csv {
        let detail = "only CSV has columns; ask for it with `format=csv`";
        return Err(ApiError::bad_parameter("columns", detail));
    }
    // Unknown batches are answered before the stream begins.
    jobs.batch(id).await?;
    let place = match wait {
        Some(_) => Some(crowds.require_wait(jobs.tenant())?),
        None => None,
    };
    if place.is_some() {
        held.release();
    }
    let until = wait.map(|seconds| Instant::now() + Duration::from_secs(seconds.into()));
    let columns = Arc::new(query.columns.unwrap_or_default());
    let head = match format {
        Format::Csv => {
            let head = columns.head().map_err(|error| ApiError::internal(&error))?;
            Some(Bytes::from(head))
        }
        _ => None,
    };
    let revoked = Box::pin(revoked(jobs.clone(), key.map(|Extension(key)| key)));
    let start = StreamPosition {
        revoked,
        jobs,
        batch: id,
        format,
        until,
        after: query.after,
        states: query.state.unwrap_or_default(),
        columns,
        page: FIRST_PAGE_JOBS,
        head,
    };
    let body = Body::from_stream(try_unfold(start, next_piece));
    let headers = [
        (header::CONTENT_TYPE, format.media_type()),
        (header::VARY, "Accept"),
    ];
    let mut response = (headers, body).into_response();
    if wait.is_some() {
        response.extensions_mut().insert(StreamedUnbuffered);
    }
    Ok(hold_while_sent(response, place))
}

/// Where a stream of results stands.
struct StreamPosition {
    /// The key was revoked; nothing more is sent.
    revoked: Pin<Box<dyn Future<Output = ()> + Send>>,
    jobs: Jobs,
    batch: Uuid,
    format: Format,
    until: Option<Instant>,
    after: Option<Uuid>,
    /// States of the jobs that have lines; all if there is none.
    states: Vec<JobState>,
    columns: Arc<Columns>,
    /// Jobs to read at once; large results are read few at a time.
    page: u32,
    head: Option<Bytes>,
}

async fn next_piece(
    mut place: StreamPosition,
) -> Result<Option<(Bytes, StreamPosition)>, JobsError> {
    if let Some(head) = place.head.take() {
        return Ok(Some((head, place)));
    }
    loop {
        let read = place.jobs.batch_items(
            place.batch,
            place.after,
            place.page,
            place.until,
            &place.states,
        );
        let (lines, last) = tokio::select! {
            read = read => read?,
            // Broken off, so that what was sent is not taken for all there is.
            () = &mut place.revoked => return Err(JobsError::BatchNotFound),
        };
        let Some(last) = last else {
            return Ok(None);
        };
        place.after = Some(last);
        let read = u32::try_from(lines.len()).unwrap_or(PAGE_JOBS);
        place.page = match place.states.is_empty() {
            true => (2 * read).clamp(4, PAGE_JOBS),
            false => PAGE_JOBS,
        };
        if lines.is_empty() {
            continue;
        }
        let (format, columns) = (place.format, place.columns.clone());
        let written = tokio::task::spawn_blocking(move || match format {
            Format::Csv => write_csv(&columns, &lines),
            _ => write_ndjson(&lines),
        });
        let piece = written
            .await
            .map_err(|error| JobsError::Damaged(error.to_string()))??;
        return Ok(Some((Bytes::from(piece), place)));
    }
}

/// Writes lines of CSV, without the header.
fn write_csv(columns: &Columns, lines: &[BatchItem]) -> Result<Vec<u8>, JobsError> {
    let written = columns.lines(lines, |line| {
        let error = error_of(line).map(|problem| problem.detail);
        error.or_else(|| line.result.as_ref().map(|_| UNREADABLE.to_owned()))
    });
    written.map_err(|error| JobsError::Damaged(error.to_string()))
}

/// The part of a line before the result.
#[derive(Serialize)]
struct Front<'a> {
    index: u32,
    id: String,
    name: Option<&'a str>,
    labels: &'a std::collections::BTreeMap<String, String>,
    state: JobState,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<ProblemBody>,
}

/// Writes lines of NDJSON. A stored solution is passed on as it is, without reading it.
fn write_ndjson(lines: &[BatchItem]) -> Result<Vec<u8>, JobsError> {
    let mut out = Vec::with_capacity(lines.len() * 2048);
    for line in lines {
        let job = &line.job;
        let front = Front {
            index: line.index,
            id: job.id.to_string(),
            name: job.name.as_deref(),
            labels: &job.labels,
            state: job.state,
            error: error_of(line),
        };
        write_json(&mut out, &front)?;
        if let Some(ItemResult::Solution(solution)) = &line.result {
            // Both are objects that are continued: the closing brace makes way.
            out.pop();
            out.extend_from_slice(b",\"result\":");
            let open = solution.strip_suffix(b"}").ok_or_else(|| {
                JobsError::Damaged(format!("solution of job {} is no object", job.id))
            })?;
            out.extend_from_slice(open);
            out.extend_from_slice(b",\"cached\":");
            write_json(&mut out, &job.cached)?;
            out.extend_from_slice(b",\"links\":");
            write_json(&mut out, &JobResult::links(job.id, &outputs(line)))?;
            out.extend_from_slice(b"}}");
        }
        out.push(b'\n');
    }
    Ok(out)
}

fn write_json<T: Serialize>(out: &mut Vec<u8>, value: &T) -> Result<(), JobsError> {
    serde_json::to_writer(out, value).map_err(|error| JobsError::Damaged(error.to_string()))
}

const UNREADABLE: &str = "the stored result cannot be read";

/// Why a line has no result although its job has ended.
fn error_of(line: &BatchItem) -> Option<ProblemBody> {
    let job = &line.job;
    let mut problem = match &line.result {
        None | Some(ItemResult::Solution(_)) => {
            let failure = job.failure.as_ref()?;
            return Some(ProblemBody::of_job(job, failure));
        }
        Some(ItemResult::Gone) => ProblemBody::new(
            ProblemKind::Expired,
            "the job was removed with its result while the results were read",
        ),
        Some(ItemResult::Unreadable) => ProblemBody::new(ProblemKind::Internal, UNREADABLE),
    };
    problem.instance = Some(format!("/v1/jobs/{}", job.id));
    Some(problem)
}

fn outputs(line: &BatchItem) -> Vec<String> {
    serde_json::from_str(&line.outputs).unwrap_or_default()
}
