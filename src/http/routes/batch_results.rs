//! `/v1/batches/{id}/results`: one line per case in the order they were sent, written while it is read.

use std::pin::Pin;
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

use crate::contact::remark::entry::RemarkEntry;
use crate::contact::solution::words::Solution;
use crate::http::dto::problem::ProblemBody;
use crate::http::dto::result::JobResult;
use crate::http::extract::accept::{Format, choose, one_of};
use crate::http::extract::caller::{Caller, Credential, revoked};
use crate::http::extract::ids::BatchId;
use crate::http::extract::query::{Parameters, query, seconds};
use crate::http::layers::compression::StreamedUnbuffered;
use crate::http::limits::concurrency::ConcurrencyLimits;
use crate::http::limits::holding_body::{HeldShares, hold_while_sent};
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::http::render::csv::number;
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
/// all patches; a job without a result has one line without numbers. Without `wait` unfinished jobs appear with their state.
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
    let BatchResultsQuery { wait, format } = BatchResultsQuery::read(&uri, &())?;
    let format = choose(&headers, format, FORMATS)?;
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
    let head = match format {
        Format::Csv => Some(Bytes::from(csv_head())),
        _ => None,
    };
    let revoked = Box::pin(revoked(jobs.clone(), key.map(|Extension(key)| key)));
    let start = StreamPosition {
        revoked,
        jobs,
        batch: id,
        format,
        until,
        after: None,
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
    let lines = place
        .jobs
        .batch_items(place.batch, place.after, place.page, place.until);
    let lines = tokio::select! {
        lines = lines => lines?,
        // Broken off, so that what was sent is not taken for all there is.
        () = &mut place.revoked => return Err(JobsError::BatchNotFound),
    };
    let read = u32::try_from(lines.len()).unwrap_or(PAGE_JOBS);
    place.page = (2 * read).clamp(4, PAGE_JOBS);
    let Some(last) = lines.last() else {
        return Ok(None);
    };
    place.after = Some(last.job.id);
    let format = place.format;
    let written = tokio::task::spawn_blocking(move || match format {
        Format::Csv => write_csv(&lines),
        _ => write_ndjson(&lines),
    });
    let piece = written
        .await
        .map_err(|error| JobsError::Damaged(error.to_string()))??;
    Ok(Some((Bytes::from(piece), place)))
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

const CSV_COLUMNS: [&str; 18] = [
    "index",
    "id",
    "name",
    "state",
    "point",
    "creepage_x",
    "creepage_y",
    "spin_per_mm",
    "normal_force_n",
    "force_x_n",
    "force_y_n",
    "moment_z_n_mm",
    "error_force_x_n",
    "error_force_y_n",
    "error_moment_z_n_mm",
    "friction_power_n",
    "remarks",
    "error",
];

fn csv_head() -> String {
    CSV_COLUMNS.join(",") + "\n"
}

/// Writes lines of CSV, without the header.
fn write_csv(lines: &[BatchItem]) -> Result<Vec<u8>, JobsError> {
    let damaged = |error: &dyn std::fmt::Display| JobsError::Damaged(error.to_string());
    let mut out = csv::Writer::from_writer(Vec::new());
    for line in lines {
        let job = &line.job;
        let front = [
            line.index.to_string(),
            job.id.to_string(),
            for_sheets(job.name.as_deref().unwrap_or_default()),
            job.state.name().to_owned(),
        ];
        let solution = match &line.result {
            Some(ItemResult::Solution(text)) => serde_json::from_slice::<Solution>(text).ok(),
            _ => None,
        };
        let Some(solution) = solution else {
            let error = error_of(line).map(|problem| problem.detail);
            let unread = || line.result.as_ref().map(|_| UNREADABLE.to_owned());
            let empty = vec![String::new(); CSV_COLUMNS.len() - front.len() - 1];
            let row = front
                .into_iter()
                .chain(empty)
                .chain([error.or_else(unread).unwrap_or_default()]);
            out.write_record(row).map_err(|error| damaged(&error))?;
            continue;
        };
        for numbers in csv_numbers(&solution) {
            let row = front.iter().cloned().chain(numbers).chain([String::new()]);
            out.write_record(row).map_err(|error| damaged(&error))?;
        }
    }
    out.into_inner().map_err(|error| damaged(&error))
}

/// The codes of the remarks that hold for a motion, each once.
fn codes(remarks: &[RemarkEntry], point: usize) -> String {
    let mut codes: Vec<&str> = Vec::new();
    for remark in remarks.iter().filter(|remark| remark.holds_at(point)) {
        if !codes.contains(&&*remark.code) {
            codes.push(&remark.code);
        }
    }
    codes.join(" ")
}

/// A text of a client as a field of a table. Programs for sheets take what begins like a formula for one; an apostrophe
/// says that it is none.
fn for_sheets(text: &str) -> String {
    if text.starts_with(['=', '+', '-', '@']) {
        format!("'{text}")
    } else {
        text.to_owned()
    }
}

/// The numbers of each motion: sums over all patches.
fn csv_numbers(solution: &Solution) -> impl Iterator<Item = Vec<String>> {
    let normal: f64 = solution
        .patches
        .iter()
        .map(|patch| patch.normal_force_n)
        .sum();
    solution
        .total
        .iter()
        .enumerate()
        .map(move |(point, total)| {
            let parts = solution
                .patches
                .iter()
                .filter_map(|patch| patch.points.get(point));
            let power: f64 = parts.clone().map(|part| part.friction_power_n).sum();
            let motion = parts.clone().next().map(|part| part.motion);
            let estimate = total.error_estimate;
            let text = |value: Option<f64>| value.map_or_else(String::new, number);
            vec![
                point.to_string(),
                text(motion.map(|motion| motion.creepage_x)),
                text(motion.map(|motion| motion.creepage_y)),
                text(motion.map(|motion| motion.spin_per_mm)),
                number(normal),
                number(total.force_x_n),
                number(total.force_y_n),
                number(total.moment_z_n_mm),
                text(estimate.map(|estimate| estimate.force_x_n)),
                text(estimate.map(|estimate| estimate.force_y_n)),
                text(estimate.map(|estimate| estimate.moment_z_n_mm)),
                number(power),
                codes(&solution.remarks, point),
            ]
        })
}
