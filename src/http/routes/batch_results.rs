//! `/v1/batches/{id}/results`: one line per case in the order they were sent, in pieces as the client takes them.

use std::collections::VecDeque;
use std::sync::Arc;

use axum::Extension;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::{HeaderMap, Uri};
use axum::response::Response;
use futures_util::{StreamExt, stream};
use serde::Serialize;
use tokio::time::Instant;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::http::dto::result::JobResult;
use crate::http::extract::accept::{choose, one_of};
use crate::http::extract::caller::{Caller, Credential, revoked, until_revoked};
use crate::http::extract::ids::BatchId;
use crate::http::extract::query::{Parameters, Repeated, id, query, reader};
use crate::http::layers::compression::StreamedUnbuffered;
use crate::http::limits::holding_body::hold_while_sent;
use crate::http::limits::memory::Memory;
use crate::http::problem::body::ProblemBody;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::render::batch_table::Columns;
use crate::http::render::format::Format;
use crate::http::render::row_tables::RowWriter;
use crate::http::routes::batch_lines::{FIRST_PAGE_JOBS, Lines, STREAM_BYTES, Source};
use crate::http::routes::wait::{Wait, WaitQuery};
use crate::jobs::model::job::State as JobState;
use crate::jobs::model::kind::Kind;

/// Most columns of labels of a table for which no columns are named: three times as many as one case has labels.
const LABEL_COLUMNS_MAX: u32 = 100;

/// One line of the results of a batch.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct BatchLine {
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
const FORMATS: &[Format] = &[Format::Ndjson, Format::Csv, Format::Arrow, Format::Parquet];

query! {
    /// Parameters of the results of a batch.
    BatchResultsQuery(() => ()) {
        /// Only lines after that of this job, as to go on after the last line that was read
        #[param(format = "uuid")]
        after: Uuid as String = id("job");
        /// Only lines of jobs in this state; may be repeated for jobs in one of several
        state: Vec<JobState> as Vec<JobState> = Repeated(reader(JobState::ALL.map(JobState::name).join(", "), JobState::from_name));
        /// Columns of a table, with commas between, such as `label:km,force_y_n`; with `patch` among them there is a line for each patch. See `docs/formats.md`.
        /// When left out: the usual columns, and one for each label of the jobs, at most 100
        #[param(example = "label:km,pressure_max_mpa,target_met")]
        columns: Columns as String = reader(Columns::allowed(), Columns::read);
        /// `ndjson`, `csv`, `arrow` or `parquet`; overrides `Accept`
        #[param(pattern = "^(ndjson|csv|arrow|parquet)$", example = "csv")]
        format: Format as String = one_of(FORMATS);
    }
}

problems! {
    /// What the results of a batch can fail with.
    BatchResultProblems: BadQuery, BatchNotFound
}

/// The results of a batch in the order its cases were sent.
///
/// NDJSON: exactly one line per job, nothing else. A table (CSV, Arrow, Parquet) has one row per job and motion with the sums over
/// all patches, or with the column `patch` one row per job, motion and patch; a job without a result has one row without numbers. With a wait, lines are
/// sent as soon as everything before them is there. Without one, unfinished jobs appear with their state.
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
    Caller(jobs): Caller,
    BatchId(id): BatchId,
    uri: Uri,
    wait: Wait,
    State(memory): State<Memory>,
    key: Option<Extension<Credential>>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let (query, _) = <(BatchResultsQuery, WaitQuery)>::read(&uri, &())?;
    let format = choose(&headers, query.format, FORMATS)?;
    let is_table = format != Format::Ndjson;
    if query.columns.is_some() && !is_table {
        let detail =
            "NDJSON has no columns; ask for a table with `format=csv`, `arrow` or `parquet`";
        return Err(ApiError::bad_parameter("columns", detail));
    }
    // Unknown batches are answered before the stream begins.
    jobs.batch(Kind::Cases, id).await?;
    let until = wait.at_most().map(|at_most| Instant::now() + at_most);
    let waits = until.is_some();
    // What a reader holds of small results; large ones are counted one by one.
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
    let writer = RowWriter::new(format, &kinds).and_then(|mut writer| Ok((writer.head()?, writer)));
    let (head, writer) = writer.map_err(|error| ApiError::internal(&*error))?;
    let lines = Lines {
        source: Source {
            jobs: jobs.clone(),
            memory,
            columns,
        },
        batch: id,
        until,
        after: query.after,
        states: query.state.unwrap_or_default(),
        page: FIRST_PAGE_JOBS,
        read: VecDeque::new(),
        large: None,
    };
    let revoked = revoked(jobs, key.map(|Extension(key)| key));
    let head = stream::iter([Ok(Bytes::from(head))]);
    let body = Body::from_stream(until_revoked(head.chain(lines.text(writer)), revoked));
    let mut response = format.answer(&format!("batch-{id}"), body);
    if waits {
        response.extensions_mut().insert(StreamedUnbuffered);
    }
    response = wait.tell_applied(response);
    Ok(hold_while_sent(response, (wait.into_place(), share)))
}
