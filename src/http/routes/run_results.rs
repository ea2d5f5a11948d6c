//! `/v1/runs/{id}/results` and `/manifest`: the answers of a run, in the order of its rows, in pieces as the client takes them.

use std::collections::VecDeque;
use std::ops::Range;

use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::{HeaderMap, Uri};
use axum::response::Response;
use axum::{Extension, Json};
use futures_util::stream::{self, StreamExt, try_unfold};
use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::http::dto::run::{AnswerColumn, answer_columns};
use crate::http::extract::accept::{choose, one_of};
use crate::http::extract::caller::{Caller, Credential, revoked, until_revoked};
use crate::http::extract::ids::RunId;
use crate::http::extract::query::{Parameters, query, reader};
use crate::http::limits::holding_body::hold_while_sent;
use crate::http::limits::memory::Memory;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::http::render::format::Format;
use crate::http::render::row_tables::{RowWriter, WriteError};
use crate::http::routes::wait::{Wait, WaitQuery};
use crate::http::routes::work::await_end;
use crate::jobs::codec::table::{RowTable, TableKind};
use crate::jobs::model::kind::Kind;
use crate::jobs::run::model::Run;
use crate::jobs::run::results::ChunkRef;
use crate::jobs::sync::blocking;
use crate::jobs::{Jobs, JobsError};

/// What a reader of answers holds: a chunk as columns and as text.
const STREAM_BYTES: usize = 12 << 20;

/// The forms that answers come in.
const FORMATS: &[Format] = &[Format::Ndjson, Format::Csv, Format::Arrow, Format::Parquet];

query! {
    /// Parameters of the results of a run.
    RunResultsQuery(() => ()) {
        /// Only these columns, with commas between, such as `row,force_y_n,status`
        #[param(example = "row,status,force_y_n")]
        columns: Vec<String> as String = reader("names of columns with commas between", |text| {
            Some(text.split(',').map(|name| name.trim().to_owned()).collect())
        });
        /// Only the rows from the first number on and before the second, such as `1000:2000`; either may be left out
        #[param(pattern = "^[0-9]*:[0-9]*$", example = "1000:2000")]
        rows: Range<u64> as String = reader("two row numbers with a colon between, such as `1000:2000`; either may be left out", row_range);
        /// `ndjson`, `csv`, `arrow` or `parquet`; overrides `Accept`
        #[param(pattern = "^(ndjson|csv|arrow|parquet)$", example = "parquet")]
        format: Format as String = one_of(FORMATS);
    }
}

fn row_range(text: &str) -> Option<Range<u64>> {
    let (begin, end) = text.split_once(':')?;
    let number = |text: &str, none| match text {
        "" => Some(none),
        digits => digits.parse().ok(),
    };
    let range = number(begin, 0)?..number(end, u64::MAX)?;
    (range.start <= range.end).then_some(range)
}

problems! {
    /// What the results of a run can fail with.
    RunResultProblems: BadQuery, RunNotFound, ResultNotReady, Overloaded
}

/// One row of the results, in NDJSON. The other columns are those that `answers` of the run lists.
#[derive(Debug, Serialize, ToSchema)]
#[allow(dead_code, reason = "the contract; rows are written column by column")]
pub(crate) struct RunRow {
    /// Number of the row in what was sent, counted from 0.
    row: u64,
    /// What became of the row: `ok`; `target_missed`, the estimated error is above the target; `refused`, its case has faults; `not_covered`,
    /// `not_converged`, `unsolvable`, `out_of_time`, `solver_failed`; or why its piece of the run was not solved, such as `cancelled`.
    status: String,
    /// The method that answered it; null without an answer.
    method: Option<String>,
    /// Why it has no answer, such as the first fault of its case; null with an answer.
    reason: Option<String>,
}

/// The answers of an ended run in the order of its rows.
///
/// One line, or one row of a table, for each row that was sent, whatever became of it. Columns: `row`, the columns that were passed through unchanged,
/// `status`, `method`, then numbers and `reason`: forces and moment are sums over the patches about the origin of the case, `error_estimate` is that of
/// the less certain force, and `reason` tells why a row has no answer. A cancelled run keeps the answers it had computed.
#[utoipa::path(
    get,
    path = "/v1/runs/{id}/results",
    tag = "runs",
    operation_id = "get_run_results",
    params(
        ("id" = String, Path, description = "Id of the run", format = "uuid"),
        RunResultsQuery,
        WaitQuery,
        ("Prefer" = Option<String>, Header, description = "`wait=N`, as `?wait=N` (RFC 7240)", example = "wait=10")
    ),
    responses((status = 200, description = "One line or row for each row", content(
        (RunRow = "application/x-ndjson"),
        (String = "text/csv"),
        (Vec<u8> = "application/vnd.apache.arrow.stream"),
        (Vec<u8> = "application/vnd.apache.parquet")
    )), RunResultProblems)
)]
pub(crate) async fn results(
    Caller(jobs): Caller,
    RunId(id): RunId,
    wait: Wait,
    uri: Uri,
    State(memory): State<Memory>,
    key: Option<Extension<Credential>>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let (query, _) = <(RunResultsQuery, WaitQuery)>::read(&uri, &())?;
    let format = choose(&headers, query.format, FORMATS)?;
    await_end(&jobs.of_kind(Kind::Rows), id, &wait).await?;
    let run = jobs.run(id).await?;
    require_ended(&run)?;
    let columns = selected(&run, query.columns)?;
    let share = memory.ready_answer(jobs.tenant(), STREAM_BYTES)?;
    let mut writer =
        RowWriter::new(format, &columns).map_err(|error| ApiError::internal(&error))?;
    let head = writer.head().map_err(|error| ApiError::internal(&error))?;
    let rows = query.rows.unwrap_or(0..u64::MAX);
    let mut answers = Answers {
        rows: rows.start..rows.end.min(run.head.rows),
        wanted: columns.into_iter().map(|(name, _)| name).collect(),
        source: ChunkSource::new(jobs.clone(), run),
    };
    // Answers that cannot be read are an error as long as the head has not been sent.
    let (first, writer) = answers.next(writer).await.map_err(unreadable)?;
    let rest = writer.map(|writer| (answers, writer));
    let rest = try_unfold(rest, |state| async move {
        let Some((mut answers, writer)) = state else {
            return Ok(None);
        };
        let next = answers.next(writer).await.inspect_err(|error| {
            tracing::error!(%error, run = %answers.source.run.chunks.id, "answers of a run cannot be read");
        });
        let (piece, writer) = next?;
        Ok(Some((piece, writer.map(|writer| (answers, writer)))))
    });
    let begin = stream::iter([Ok::<_, WriteError>(Bytes::from(head)), Ok(first)]);
    let revoked = revoked(jobs, key.map(|Extension(key)| key));
    let body = Body::from_stream(until_revoked(begin.chain(rest), revoked));
    let response = format.answer(&format!("run-{id}"), body);
    Ok(hold_while_sent(wait.tell_applied(response), share))
}

/// Why answers cannot be read.
fn unreadable(error: WriteError) -> ApiError {
    match error.downcast::<JobsError>() {
        Ok(error) => ApiError::from(*error),
        Err(error) => ApiError::internal(&error),
    }
}

/// A run has answers once it has ended.
pub(crate) fn require_ended(run: &Run) -> Result<(), ApiError> {
    match run.state() {
        state if state.ended() => Ok(()),
        state => Err(ApiError::new(
            ProblemKind::ResultNotReady,
            format!(
                "the run is {}; {} of {} rows are over",
                state.name(),
                run.rows_done(),
                run.head.rows
            ),
        )),
    }
}

/// The columns that are wanted, in the order of the answers.
pub(crate) fn selected(
    run: &Run,
    wanted: Option<Vec<String>>,
) -> Result<Vec<(String, TableKind)>, ApiError> {
    let mut columns = run.head.answers();
    let Some(wanted) = wanted else {
        return Ok(columns);
    };
    if let Some(unknown) = wanted
        .iter()
        .find(|name| !columns.iter().any(|(known, _)| known == *name))
    {
        let known: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
        return Err(ApiError::bad_parameter(
            "columns",
            format!(
                "`{unknown}` is no column of this run; allowed: {}",
                known.join(", ")
            ),
        ));
    }
    columns.retain(|(name, _)| wanted.contains(name));
    Ok(columns)
}

/// The chunks of a run, one after the other.
pub(crate) struct ChunkSource {
    jobs: Jobs,
    /// The run.
    pub run: Run,
    read: VecDeque<ChunkRef>,
    last: Option<Uuid>,
    over: bool,
}

impl ChunkSource {
    /// The chunks of a run from the first on.
    pub(crate) fn new(jobs: Jobs, run: Run) -> ChunkSource {
        ChunkSource {
            jobs,
            run,
            read: VecDeque::new(),
            last: None,
            over: false,
        }
    }

    /// The next chunk.
    pub(crate) async fn next(&mut self) -> Result<Option<ChunkRef>, JobsError> {
        if self.read.is_empty() && !self.over {
            let more = self.jobs.run_chunks(self.run.chunks.id, self.last).await?;
            self.last = more.last().map(|chunk| chunk.job);
            self.over = more.is_empty();
            self.read.extend(more);
        }
        Ok(self.read.pop_front())
    }

    /// The answers of a chunk.
    pub(crate) async fn answers(
        &self,
        chunk: &ChunkRef,
        wanted: Vec<String>,
    ) -> Result<RowTable, JobsError> {
        self.jobs
            .chunk_answers(&self.run.head, chunk, Some(wanted))
            .await
    }
}

/// Answers under way to a client.
struct Answers {
    source: ChunkSource,
    rows: Range<u64>,
    wanted: Vec<String>,
}

impl Answers {
    /// The next piece, and the writer if there is more to come.
    async fn next(
        &mut self,
        mut writer: RowWriter,
    ) -> Result<(Bytes, Option<RowWriter>), WriteError> {
        while let Some(chunk) = self.source.next().await? {
            let own = self.source.run.head.rows_of(chunk.index);
            let common = own.start.max(self.rows.start)..own.end.min(self.rows.end);
            if common.is_empty() {
                continue;
            }
            let table = self.source.answers(&chunk, self.wanted.clone()).await?;
            let place = |row: u64| usize::try_from(row - own.start).unwrap_or(usize::MAX);
            let cut = place(common.start)..place(common.end);
            let written = blocking(move || {
                let piece = writer.write(table.cut(&cut));
                (piece, writer)
            });
            let (piece, writer) = written.await?;
            return Ok((Bytes::from(piece?), Some(writer)));
        }
        Ok((Bytes::from(writer.finish()?), None))
    }
}

/// The files of an ended run, for programs that read them in place.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RunManifest {
    /// Identifier of the run.
    #[schema(format = "uuid")]
    id: String,
    /// Number of rows.
    rows: u64,
    /// The columns of every file, in their order.
    columns: Vec<AnswerColumn>,
    /// The files in the order of their rows.
    files: Vec<RunFile>,
}

/// A file of answers.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RunFile {
    /// Number of its first row.
    first_row: u64,
    /// Number of its rows.
    rows: u64,
    /// Key of the Parquet file below `--results-url`, or below the data folder; null where these rows were not solved.
    key: Option<String>,
    /// Where these rows are answered as Parquet.
    url: String,
}

/// Where the answers of an ended run lie: a Parquet file for each piece of it.
#[utoipa::path(
    get,
    path = "/v1/runs/{id}/manifest",
    tag = "runs",
    operation_id = "get_run_manifest",
    params(("id" = String, Path, description = "Id of the run", format = "uuid")),
    responses((status = 200, description = "The files", body = RunManifest), RunResultProblems)
)]
pub(crate) async fn manifest(
    Caller(jobs): Caller,
    RunId(id): RunId,
) -> Result<Json<RunManifest>, ApiError> {
    let run = jobs.run(id).await?;
    require_ended(&run)?;
    let (rows, columns) = (run.head.rows, answer_columns(&run));
    let mut source = ChunkSource::new(jobs, run);
    let mut files = Vec::new();
    while let Some(chunk) = source.next().await? {
        let rows = source.run.head.rows_of(chunk.index);
        files.push(RunFile {
            url: format!(
                "/v1/runs/{id}/results?format=parquet&rows={}:{}",
                rows.start, rows.end
            ),
            first_row: rows.start,
            rows: rows.end - rows.start,
            key: chunk.key.map(|folder| format!("{folder}/rows.parquet")),
        });
    }
    Ok(Json(RunManifest {
        id: id.to_string(),
        rows,
        columns,
        files,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_rows_are_open_where_a_number_is_left_out() {
        assert_eq!(row_range("5:9"), Some(5..9));
        assert_eq!(row_range(":9"), Some(0..9));
        assert_eq!(row_range("5:"), Some(5..u64::MAX));
        for bad in ["", "5", "9:5", "a:b", "-1:2"] {
            assert_eq!(row_range(bad), None, "{bad}");
        }
    }
}
