//! `/v1/batches`: many cases in one request, and their results.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, Uri};
use axum::response::Response;
use axum::{BoxError, Extension};
use futures_util::stream::{self, BoxStream, Stream, StreamExt, TryStreamExt, try_unfold};
use serde::Serialize;
use tokio::time::Instant;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::dto::{Cases, JobResult};
use crate::extract::accept::{choose, one_of};
use crate::extract::batch::read_draft;
use crate::extract::caller::{Credential, WorkPath};
use crate::extract::query::{Parameters, id, query, reader, repeated, word};
use crate::extract::rows::{TableUpload, separate_table};
use crate::layers::response::StreamedUnbuffered;
use crate::limits::{Memory, hold_while_sent};
use crate::options::HttpOptions;
use crate::problem::{ApiError, Fault, ProblemBody, ProblemKind, Result, problems};
use crate::render::batch_table::Columns;
use crate::render::format::Format;
use crate::render::row_tables::Piece;
use crate::routes::submission::{BatchAccepted, NamedQuery, Submission, SubmitParameters};
use crate::routes::wait::{Wait, WaitQuery};
use crate::routes::work::{RESULT_FORMATS, table_answer};
use railhead_contact::case::words::solver::Output;
use railhead_contact::solution::words::answer::Solution;
use railhead_jobs::Jobs;
use railhead_jobs::batch::control::{Items, OpenedItem, PAGE_BYTES};
use railhead_jobs::batch::upload::BatchUpload;
use railhead_jobs::error::JobsError;
use railhead_jobs::model::{BatchItem, Kind, State as JobState};
use railhead_jobs::sync::blocking;
use railhead_tables::table::RowTable;

problems! {
    /// Problems of `POST /v1/batches`.
    BatchProblems: MalformedJson, UnreadableBody, BadQuery, BadHeader, BodyTimeout, BodyTooLarge, UnsupportedMediaType, UnsupportedEncoding,
    FaultyBatch, FaultyTable, JobNotFound, IdempotencyConflict, QuotaExceeded, StoredQuotaExceeded, QueueFull, Draining, StorageFull, StorageUnwritable, StorageUnreachable
}

query! {
    /// Parameters of the submission of a batch.
    BatchQuery {
        /// `reject` (default): one faulty case refuses the batch; `skip`: faulty cases are skipped and reported
        #[param(pattern = "^(reject|skip)$", example = "skip")]
        on_invalid: bool as String = word(&[("reject", false), ("skip", true)]);
        /// Id of the job whose case is the template of a table; not with `multipart/form-data`, which contains the template
        #[param(format = "uuid")]
        template: Uuid as String = id("job");
    }
}

/// Submits many cases as one batch of jobs.
///
/// The body is a JSON array of cases, one case per line (`application/x-ndjson`), or a table whose rows fill a template case: as
/// `multipart/form-data` with the parts `template` and `table`, or alone with a job id in `?template=`. Tables are CSV, Arrow, Parquet or
/// NPZ, and with a template also NDJSON with a row per line. JSON, NDJSON and CSV are read as they arrive. Jobs of a batch answered with
/// `202` are stored durably. Without `on_invalid=skip`, one faulty case refuses the whole batch (`422`); every fault names its case, and
/// its line in NDJSON and CSV. A malformed array is `400`; a malformed line is a faulty case.
#[utoipa::path(
    post,
    path = "/v1/batches",
    tag = "batches",
    operation_id = "submit_batch",
    params(BatchQuery, NamedQuery, SubmitParameters),
    request_body(content(
        (Cases = "application/json"),
        (String = "application/x-ndjson"),
        (String = "text/csv"),
        (Vec<u8> = "application/vnd.apache.arrow.stream"),
        (Vec<u8> = "application/vnd.apache.parquet"),
        (Vec<u8> = "application/x-npz"),
        (TableUpload = "multipart/form-data")
    ), description = "Cases, at most 200 000, each of at most 8 MiB and together at most 1 GiB"),
    responses(BatchAccepted, BatchProblems)
)]
pub(crate) async fn submit(
    Submission {
        jobs,
        own: (own, named),
        options: mut work,
        reply,
    }: Submission<(BatchQuery, NamedQuery)>,
    State(options): State<HttpOptions>,
    State(memory): State<Memory>,
    request: Request,
) -> Result<Response> {
    named.read_into(&mut work, &jobs)?;
    let state = (&jobs, &memory, &options);
    let json = "an array with `application/json`, one case per line with `application/x-ndjson`";
    let (request, table) = separate_table(state, own.template, (json, true), request).await?;
    let draft = read_draft(state, table, request).await?;
    if draft.cases == draft.new.rejected
        || (draft.new.rejected > 0 && !own.on_invalid.unwrap_or(false))
    {
        return Err(refusal(&draft));
    }
    let errors = faults(&draft);
    let (id, replayed) = jobs.submit_batch(draft, work).await?;
    let batch = jobs.of_kind(Kind::Cases).work(id).await?;
    reply
        .send(&jobs, &memory, (batch, replayed), Some(errors))
        .await
}

/// Returns the refusal of a batch.
fn refusal(draft: &BatchUpload) -> ApiError {
    if draft.cases == 0 {
        return ApiError::new(ProblemKind::FaultyBatch, "the batch has no case");
    }
    let kept = draft.faulty.len();
    let more = match draft.new.rejected as usize - kept {
        0 => String::new(),
        _ => format!("; the faults of the first {kept} of them are listed"),
    };
    ApiError::listing(
        ProblemKind::FaultyBatch,
        format!(
            "{} of {} cases have faults, so nothing was stored{more}",
            draft.new.rejected, draft.cases
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

/// Memory of a response for small results, in bytes: a page of results and its text.
const STREAM_BYTES: usize = 2 * PAGE_BYTES;

/// The source of the lines of a response.
struct Source {
    jobs: Jobs,
    memory: Memory,
    /// Columns of the table; none for NDJSON.
    columns: Option<Arc<Columns>>,
}

type Pieces = BoxStream<'static, Result<Piece, BoxError>>;

/// Returns the lines of jobs.
fn lines(source: Source, items: Items) -> impl Stream<Item = Result<Piece, BoxError>> + Send {
    let pieces = try_unfold((source, items), async |(source, mut items)| {
        if !items.fill().await? {
            return Ok(None);
        }
        let small = items.read.iter().take_while(|item| item.key.is_none());
        let pieces = match small.count() {
            0 => match items.read.pop_front() {
                Some(item) => source.open_large(item).await?,
                None => return Ok(None),
            },
            small => one(source
                .write_small(items.read.drain(..small).collect())
                .await?),
        };
        Ok::<_, BoxError>(Some((pieces, (source, items))))
    });
    pieces.try_flatten()
}

impl Source {
    /// Returns the lines of jobs with small results.
    async fn write_small(&self, items: Vec<BatchItem>) -> Result<Piece, JobsError> {
        let columns = self.columns.clone();
        let written = blocking(move || match columns {
            Some(columns) => Ok(Piece::Table(table_of(&columns, &items))),
            None => Ok(Piece::Text(write_ndjson(&items)?.into())),
        });
        written.await?
    }

    /// Returns the lines of a job with a large result.
    async fn open_large(&self, item: BatchItem) -> Result<Pieces, BoxError> {
        let id = item.job.id;
        let key = item.key.as_deref().unwrap_or_default();
        let opened = self.jobs.open_item(id, key).await;
        let without = |error: ProblemBody| match &self.columns {
            Some(columns) => {
                let mut table = columns.empty();
                columns.add_without_result(&mut table, &item, &error.detail);
                Ok::<_, BoxError>(one(Piece::Table(table)))
            }
            None => {
                let mut text = Vec::new();
                write_json(&mut text, &BatchLine::new(&item, Some(error)))?;
                text.push(b'\n');
                Ok(one(Piece::Text(text.into())))
            }
        };
        let (bytes, solution) = match opened {
            Ok(opened) => opened,
            Err(error) => return without(missing_result(&item, &error)),
        };
        let Some(columns) = self.columns.clone() else {
            return Ok(ndjson_of(&item, solution)?);
        };
        // The text and the solution parsed from it.
        if !self.memory.has_room_for(2 * bytes) {
            let detail = format!(
                "the result of {bytes} bytes exceeds the memory limit of a table (`--tenant-request-memory-mb`); ask for NDJSON"
            );
            return without(problem(&item, ProblemKind::Overloaded, detail));
        }
        self.table_of_large(columns, item, (bytes, solution)).await
    }

    /// Returns the lines of a table for a job with a large result. They hold the permit for its memory.
    async fn table_of_large(
        &self,
        columns: Arc<Columns>,
        mut item: BatchItem,
        (bytes, mut pieces): OpenedItem,
    ) -> Result<Pieces, BoxError> {
        let refused = |error: ApiError| BoxError::from(error.detail().to_owned());
        let turn = self.memory.rendering(self.jobs.tenant(), 2 * bytes).await;
        let turn = turn.map_err(refused)?;
        let mut text = Vec::with_capacity(bytes);
        while let Some(piece) = pieces.try_next().await? {
            text.extend_from_slice(&piece);
        }
        text.push(b'}');
        item.solution = Some(text.into());
        let rows = move || Ok(table_of(&columns, &[item]));
        let made = turn.run(rows, move |_| bytes).await;
        let (table, share) = made.map_err(refused)?;
        let lines = one(Piece::Table(table)).inspect(move |_| {
            let _held = &share;
        });
        Ok(lines.boxed())
    }
}

fn one(piece: Piece) -> Pieces {
    stream::iter([Ok(piece)]).boxed()
}

/// Returns a line of NDJSON; `solution` is an object without its closing brace.
fn ndjson_of(
    item: &BatchItem,
    solution: BoxStream<'static, Result<Bytes, JobsError>>,
) -> Result<Pieces, JobsError> {
    let mut front = Vec::new();
    open_line(&mut front, item)?;
    let mut tail = Vec::new();
    close_line(&mut tail, item)?;
    let middle = solution.map_ok(Piece::Text).map_err(BoxError::from);
    let [front, tail] = [front, tail].map(|text| one(Piece::Text(text.into())));
    Ok(front.chain(middle).chain(tail).boxed())
}

/// Returns the lines of jobs whose solutions were read.
fn table_of(columns: &Columns, items: &[BatchItem]) -> RowTable {
    let mut table = columns.empty();
    for item in items {
        if let Some(text) = &item.solution
            && let Ok(solution) = serde_json::from_slice::<Solution>(text)
        {
            columns.add(&mut table, item, &solution);
            continue;
        }
        let error = failure(item).map(|problem| problem.detail);
        let error = error.unwrap_or_else(|| match item.solution {
            Some(_) => UNREADABLE.to_owned(),
            None => String::new(),
        });
        columns.add_without_result(&mut table, item, &error);
    }
    table
}

/// Writes lines of NDJSON of jobs with small results. A stored solution is copied without parsing it.
fn write_ndjson(items: &[BatchItem]) -> Result<Vec<u8>, JobsError> {
    let mut out = Vec::with_capacity(items.len() * 2048);
    for item in items {
        let Some(solution) = &item.solution else {
            write_json(&mut out, &BatchLine::new(item, failure(item)))?;
            out.push(b'\n');
            continue;
        };
        let open = solution.strip_suffix(b"}").ok_or_else(|| {
            JobsError::Damaged(format!("solution of job {} is no object", item.job.id))
        })?;
        open_line(&mut out, item)?;
        out.extend_from_slice(open);
        close_line(&mut out, item)?;
    }
    Ok(out)
}

/// Writes the part of a line before a solution.
fn open_line(out: &mut Vec<u8>, item: &BatchItem) -> Result<(), JobsError> {
    write_json(out, &BatchLine::new(item, None))?;
    // The object continues, so that its closing brace is removed.
    out.pop();
    out.extend_from_slice(b",\"result\":");
    Ok(())
}

/// Writes the part of a line after a solution without its closing brace.
fn close_line(out: &mut Vec<u8>, item: &BatchItem) -> Result<(), JobsError> {
    let outputs: Vec<Output> = serde_json::from_str(&item.outputs).unwrap_or_default();
    let tail = JobResult::tail(item.job.id, item.job.cached, &outputs);
    let tail = tail.map_err(|error| JobsError::Damaged(error.detail().to_owned()))?;
    out.extend_from_slice(tail.as_bytes());
    out.extend_from_slice(b"}\n");
    Ok(())
}

fn write_json<T: Serialize>(out: &mut Vec<u8>, value: &T) -> Result<(), JobsError> {
    serde_json::to_writer(out, value).map_err(|error| JobsError::Damaged(error.to_string()))
}

const UNREADABLE: &str = "the stored result cannot be read";

/// Returns the reason why an ended job has no result.
fn failure(item: &BatchItem) -> Option<ProblemBody> {
    let job = &item.job;
    Some(ProblemBody::of_job(job, job.failure.as_ref()?))
}

/// Returns the reason why the result of a succeeded job is missing.
fn missing_result(item: &BatchItem, error: &JobsError) -> ProblemBody {
    if let JobsError::Expired = error {
        let detail = "the job was removed with its result while the results were read";
        return problem(item, ProblemKind::Expired, detail);
    }
    tracing::error!(job = %item.job.id, %error, "a stored result cannot be read");
    problem(item, ProblemKind::Internal, UNREADABLE)
}

fn problem(item: &BatchItem, kind: ProblemKind, detail: impl Into<String>) -> ProblemBody {
    let mut problem = ProblemBody::new(kind, detail);
    problem.instance = Some(format!("/v1/jobs/{}", item.job.id));
    problem
}

/// Most columns of labels among the default columns, three times as many as a case may have.
const LABEL_COLUMNS_MAX: u32 = 100;

/// One line of the results of a batch.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct BatchLine {
    /// Index of the case in the request, from 0.
    index: u32,
    /// Identifier of the job.
    #[schema(format = "uuid")]
    id: String,
    /// Name of the case.
    name: Option<String>,
    /// Labels of the case.
    labels: BTreeMap<String, String>,
    /// State of the job.
    state: JobState,
    /// The result, as `/v1/jobs/{id}/result` returns it; only for a succeeded job.
    #[serde(skip_serializing_if = "Option::is_none")]
    result: Option<JobResult>,
    /// Why there is no result: the job failed, its result was removed while the lines were read, or the result cannot be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<ProblemBody>,
}

impl BatchLine {
    /// Creates the line of a job without its result.
    fn new(item: &BatchItem, error: Option<ProblemBody>) -> BatchLine {
        let job = &item.job;
        BatchLine {
            index: item.index,
            id: job.id.to_string(),
            name: job.name.clone(),
            labels: job.labels.clone(),
            state: job.state,
            result: None,
            error,
        }
    }
}

query! {
    /// Parameters of the results of a batch.
    BatchResultsQuery {
        /// Only lines after that of this job, to continue after the last line that was read
        #[param(format = "uuid")]
        after: Uuid as String = id("job");
        /// Only lines of jobs in this state; if repeated, of jobs in any of these states
        state: Vec<JobState> as Vec<JobState> = repeated(reader(JobState::ALL.map(JobState::name).join(", "), JobState::from_name));
        /// Comma-separated columns of a table, such as `label:km,force_y_n`; with `patch` among them there is a row for each patch. See
        /// `docs/formats.md`. Default: the usual columns, and one for each label of the jobs, at most 100
        #[param(example = "label:km,pressure_max_mpa,target_met")]
        columns: Columns as String = reader(Columns::allowed(), Columns::read);
        /// `ndjson`, `csv`, `arrow` or `parquet`; overrides `Accept`
        #[param(pattern = "^(ndjson|csv|arrow|parquet)$", example = "csv")]
        format: Format as String = one_of(RESULT_FORMATS);
    }
}

problems! {
    /// Problems of the results of a batch.
    BatchResultProblems: BadQuery, BatchNotFound
}

/// Returns the results of a batch in the order of its cases.
///
/// NDJSON: exactly one line per job. A table (CSV, Arrow, Parquet) has one row per job and motion with sums over all patches, or with the
/// column `patch` one row per patch; a job without a result has one row without numbers. With a wait, each line is sent when all lines
/// before it are complete; otherwise unfinished jobs appear with their state.
#[utoipa::path(
    get,
    path = "/v1/batches/{id}/results",
    tag = "batches",
    operation_id = "get_batch_results",
    params(
        ("id" = String, Path, description = "Id of the batch", format = "uuid"),
        BatchResultsQuery,
        WaitQuery,
        ("Prefer" = Option<String>, Header, description = "`wait=N`, as `?wait=N` (RFC 7240)", example = "wait=10")
    ),
    responses((status = 200, description = "One line per job", content(
        (BatchLine = "application/x-ndjson"),
        (String = "text/csv"),
        (Vec<u8> = "application/vnd.apache.arrow.stream"),
        (Vec<u8> = "application/vnd.apache.parquet")
    )), BatchResultProblems)
)]
pub(crate) async fn results(
    WorkPath { jobs, id }: WorkPath,
    uri: Uri,
    wait: Wait,
    State(memory): State<Memory>,
    key: Option<Extension<Credential>>,
    headers: HeaderMap,
) -> Result<Response> {
    let (query, _) = <(BatchResultsQuery, WaitQuery)>::read(&uri)?;
    let format = choose(&headers, query.format, RESULT_FORMATS)?;
    let is_table = format != Format::Ndjson;
    if query.columns.is_some() && !is_table {
        let detail =
            "NDJSON has no columns; ask for a table with `format=csv`, `arrow` or `parquet`";
        return Err(ApiError::bad_parameter("columns", detail));
    }
    // An unknown batch is a problem, which must be known before the stream begins.
    jobs.work(id).await?;
    let mut items = jobs.items(id);
    items.until = wait.at_most().map(|at_most| Instant::now() + at_most);
    items.after = query.after;
    items.states = query.state.unwrap_or_default();
    let waits = items.until.is_some();
    // Large results are counted one by one.
    let share = memory.ready_answer(jobs.tenant(), STREAM_BYTES)?;
    let columns = match (is_table, query.columns) {
        (true, None) => {
            let keys = jobs.batch_label_keys(id, LABEL_COLUMNS_MAX).await?;
            Some(Columns::with_labels(&keys))
        }
        (_, columns) => columns,
    };
    let columns = columns.map(Arc::new);
    let kinds = columns
        .as_ref()
        .map_or_else(Vec::new, |columns| columns.kinds());
    let source = Source {
        jobs: jobs.of_kind(Kind::Case),
        memory,
        columns,
    };
    let form = (format, &*format!("batch-{id}"));
    let mut response = table_answer((jobs, key), form, &kinds, lines(source, items))?;
    if waits {
        response.extensions_mut().insert(StreamedUnbuffered);
    }
    response = wait.tell_applied(response);
    Ok(hold_while_sent(response, (wait.into_place(), share)))
}
