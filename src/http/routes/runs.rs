//! `/v1/runs`: many rows that vary one case, their results and statistics.

use std::collections::BTreeMap;
use std::iter::repeat;
use std::ops::Range;

use axum::extract::{Path, Request, State};
use axum::http::{HeaderMap, Uri};
use axum::response::Response;
use axum::{Extension, Json};
use futures_util::stream::{self, Stream, StreamExt, TryStreamExt, try_unfold};
use railhead_macros::none_is_absent;
use serde::{Serialize, Serializer};
use serde_json::{Map, Value};
use utoipa::ToSchema;
use uuid::Uuid;

use crate::dto::{AnswerColumn, RunRequest, answer_columns};
use crate::extract::accept::{choose, one_of};
use crate::extract::caller::{Credential, WorkPath};
use crate::extract::query::{Parameters, Reader, id, list, query, reader, repeated};
use crate::extract::rows::{JSON, TableUpload, read_run, separate_table};
use crate::limits::{Memory, hold_while_sent};
use crate::options::HttpOptions;
use crate::problem::{ApiError, ProblemKind, Result, problems};
use crate::render::format::Format;
use crate::render::row_tables::Piece;
use crate::routes::submission::{NamedQuery, RunAccepted, Submission, SubmitParameters};
use crate::routes::wait::{Wait, WaitQuery};
use crate::routes::work::{RESULT_FORMATS, await_end, table_answer};
use railhead_jobs::model::Kind;
use railhead_jobs::run::model::Run;
use railhead_jobs::sync::blocking;
use railhead_jobs::{Jobs, JobsError};
use railhead_tables::table::{RowTable, TableColumn, TableKind};
use railhead_tables::titles::{NamedColumns, named_column};
use railhead_tables::write::{RowWriter, WriteError};

problems! {
    /// Problems of `POST /v1/runs`.
    SubmitRunProblems: MalformedJson, UnreadableBody, BadQuery, BadHeader, BodyTimeout, BodyTooLarge, UnsupportedMediaType, UnsupportedEncoding,
    FaultyCase, FaultyTable, JobNotFound, IdempotencyConflict, QuotaExceeded, StoredQuotaExceeded, QueueFull, Overloaded, Draining, StorageFull, StorageUnwritable
}

query! {
    /// Parameters of the submission of a run.
    RunQuery {
        /// Id of the job whose case is the template of a table; not with `multipart/form-data`, which contains the template
        #[param(format = "uuid")]
        template: Uuid as String = id("job");
        /// Meaning of a column, as `TITLE:NAME`; may be repeated. NAME is a JSON pointer, a short name or a name with a unit, such as
        /// `Q:vertical_force [kN]`; the unit may be omitted if the title or a line of units gives it. Without NAME, the column is copied to
        /// the results
        #[param(max_items = 100, example = json!(["Q:vertical_force [kN]"]))]
        column: Vec<(String, String)> as Vec<String> = repeated(reader("`TITLE:NAME`", named_column));
        /// Comma-separated titles of columns that are copied to the results. Columns of places, times, sections and vehicles, such as `km`,
        /// `time` or `axle_no`, are always copied; other unknown titles are refused
        #[param(example = "Y_left,curvature")]
        carry: Vec<String> as String = names("comma-separated titles of columns");
    }
}

/// Submits many rows as one run.
///
/// A row is the template with the values of the row. It is solved like a separate case, to the last bit. With `auto`, a row is answered by
/// the table of creep forces if its error bound meets the target, otherwise by `boundary_element`. The body is JSON with `template` and
/// `columns`, at most as large as for `/v1/evaluate`, or a table, which is read as it arrives: as `multipart/form-data` with the parts
/// `template` and `table`, or alone with a job id in `?template=`. A row that cannot be solved has a `status` with the reason and does not
/// affect other rows.
#[utoipa::path(
    post,
    path = "/v1/runs",
    tag = "runs",
    operation_id = "submit_run",
    params(RunQuery, NamedQuery, SubmitParameters),
    request_body(content(
        (RunRequest = "application/json"),
        (String = "text/csv"),
        (String = "application/x-ndjson"),
        (Vec<u8> = "application/vnd.apache.arrow.stream"),
        (Vec<u8> = "application/vnd.apache.parquet"),
        (Vec<u8> = "application/x-npz"),
        (TableUpload = "multipart/form-data")
    ), description = "At most 10 000 000 rows and 1 GiB"),
    responses(RunAccepted, SubmitRunProblems)
)]
pub(crate) async fn submit(
    Submission {
        jobs,
        own: (run, named),
        options: mut work,
        reply,
    }: Submission<(RunQuery, NamedQuery)>,
    State(options): State<HttpOptions>,
    State(memory): State<Memory>,
    request: Request,
) -> Result<Response> {
    named.read_into(&mut work, &jobs)?;
    let state = (&jobs, &memory, &options);
    let (request, table) = separate_table(state, run.template, JSON, request).await?;
    let carried = run.carry.unwrap_or_default().into_iter();
    let named = run.column.unwrap_or_default().into_iter();
    let named = named.chain(carried.map(|title| (title, String::new())));
    let read = (table, NamedColumns(Some(named.collect())));
    let draft = read_run(state, read, request).await?;
    let (id, replayed) = jobs.submit_batch(draft, work).await?;
    let run = jobs.of_kind(Kind::Rows).work(id).await?;
    reply.send(&jobs, &memory, (run, replayed), None).await
}

/// Memory of a response, in bytes: a chunk as columns and as text.
const STREAM_BYTES: usize = 12 << 20;

query! {
    /// Parameters of the results of a run.
    RunResultsQuery {
        /// Comma-separated columns, such as `row,force_y_n,status`; default: all
        #[param(example = "row,status,force_y_n")]
        columns: Vec<String> as String = names("comma-separated names of columns");
        /// Rows from the first index up to, but not including, the second, such as `1000:2000`; either may be omitted
        #[param(pattern = "^[0-9]*:[0-9]*$", example = "1000:2000")]
        rows: Range<u64> as String = reader("two row indices separated by a colon, such as `1000:2000`; either may be omitted", row_range);
        /// `ndjson`, `csv`, `arrow` or `parquet`; overrides `Accept`
        #[param(pattern = "^(ndjson|csv|arrow|parquet)$", example = "parquet")]
        format: Format as String = one_of(RESULT_FORMATS);
    }
}

/// Returns the reader of a comma-separated list of names.
fn names(allowed: &'static str) -> Reader<Vec<String>> {
    list(allowed, |name| Some(name.trim().to_owned()))
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
    /// Problems of the results of a run.
    RunResultProblems: BadQuery, RunNotFound, ResultNotReady, Overloaded
}

/// One row of the results, in NDJSON. `answers` of the run lists the other columns.
#[derive(Debug, Serialize, ToSchema)]
#[allow(dead_code, reason = "describes rows that are written column by column")]
pub(crate) struct RunRow {
    /// Index of the row in the request, from 0.
    row: u64,
    /// Outcome of the row: `ok`; `target_missed`, the estimated error exceeds the target; `refused`, its case has faults; `not_covered`,
    /// `not_converged`, `unsolvable`, `out_of_time`, `solver_failed`; or why its chunk of the run was not solved, such as `cancelled`.
    status: String,
    /// The method that was used; null without a result.
    method: Option<String>,
    /// Why the row has no result, such as the first fault of its case; null with a result.
    reason: Option<String>,
    /// Codes of the remarks of a solved row, separated by blanks.
    remarks: Option<String>,
}

/// Returns the results of an ended run in the order of its rows.
///
/// One line, or one row of a table, for each row that was sent. Columns: `row`, the copied columns, `status`, `method`, then numbers and
/// `reason`. Forces and moment are sums over the patches about the origin of the case, `error_estimate` is that of the less certain force,
/// and `reason` says why a row has no result. A cancelled run keeps the results it computed.
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
    responses((status = 200, description = "One line or table row for each row of the run", content(
        (RunRow = "application/x-ndjson"),
        (String = "text/csv"),
        (Vec<u8> = "application/vnd.apache.arrow.stream"),
        (Vec<u8> = "application/vnd.apache.parquet")
    )), RunResultProblems)
)]
pub(crate) async fn results(
    WorkPath { jobs, id }: WorkPath,
    wait: Wait,
    uri: Uri,
    State(memory): State<Memory>,
    key: Option<Extension<Credential>>,
    headers: HeaderMap,
) -> Result<Response> {
    let (query, _) = <(RunResultsQuery, WaitQuery)>::read(&uri)?;
    let format = choose(&headers, query.format, RESULT_FORMATS)?;
    await_end(&jobs, id, &wait).await?;
    let run = jobs.run(id).await?;
    require_ended(&run)?;
    let columns = selected(&run, query.columns)?;
    let share = memory.ready_answer(jobs.tenant(), STREAM_BYTES)?;
    let rows = query.rows.unwrap_or(0..u64::MAX);
    let wanted = columns.iter().map(|(name, _)| name.clone()).collect();
    let mut answers = Box::pin(answers(jobs.clone(), run, rows, wanted));
    // Unreadable results are a problem as long as the head has not been sent.
    let first = answers.try_next().await?;
    let rest = answers.inspect_err(
        move |error| tracing::error!(%error, run = %id, "answers of a run cannot be read"),
    );
    let pieces = stream::iter(first.map(Ok)).chain(rest);
    let order: Vec<String> = columns.iter().map(|(name, _)| name.clone()).collect();
    let pieces = pieces.map_ok(move |mut table| {
        let place = |name: &str| order.iter().position(|known| known == name);
        table.columns.sort_by_key(|(name, _)| place(name));
        Piece::Table(table)
    });
    let pieces = pieces.map_err(WriteError::from);
    let form = (format, &*format!("run-{id}"));
    let response = table_answer((jobs, key), form, &columns, pieces)?;
    Ok(hold_while_sent(wait.tell_applied(response), share))
}

/// Requires that a run has ended.
fn require_ended(run: &Run) -> Result<()> {
    match run.state() {
        state if state.ended() => Ok(()),
        state => Err(ApiError::new(
            ProblemKind::ResultNotReady,
            format!(
                "the run is {}; {} of {} rows are finished",
                state.name(),
                run.rows_done(),
                run.head.rows
            ),
        )),
    }
}

/// Returns the requested columns in order, or all columns.
fn selected(run: &Run, wanted: Option<Vec<String>>) -> Result<Vec<(String, TableKind)>> {
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
                "`{unknown}` is not a column of this run; allowed: {}",
                known.join(", ")
            ),
        ));
    }
    let place = |name: &str| wanted.iter().position(|wanted| wanted == name);
    columns.retain(|(name, _)| place(name).is_some());
    columns.sort_by_key(|(name, _)| place(name));
    Ok(columns)
}

/// Returns the results of these rows of a run, a chunk at a time.
fn answers(
    jobs: Jobs,
    run: Run,
    rows: Range<u64>,
    wanted: Vec<String>,
) -> impl Stream<Item = Result<RowTable, JobsError>> {
    let state = (jobs.items(run.chunks.id), jobs, run, rows, wanted);
    try_unfold(state, async |mut state| {
        let (chunks, jobs, run, rows, wanted) = &mut state;
        while let Some(chunk) = chunks.next().await? {
            let own = run.head.rows_of(chunk.index);
            let common = own.start.max(rows.start)..own.end.min(rows.end);
            if common.is_empty() {
                continue;
            }
            let answers = jobs.chunk_answers(&run.head, &chunk, Some(wanted.clone()));
            let place = |row: u64| usize::try_from(row - own.start).unwrap_or(usize::MAX);
            let cut = place(common.start)..place(common.end);
            return Ok(Some((answers.await?.cut(&cut), state)));
        }
        Ok(None)
    })
}

/// The files of an ended run, for programs that read them directly.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RunManifest {
    /// Identifier of the run.
    #[schema(format = "uuid")]
    id: String,
    /// Number of rows.
    rows: u64,
    /// The columns of every file, in order.
    columns: Vec<AnswerColumn>,
    /// The files in the order of their rows.
    files: Vec<RunFile>,
}

/// A file of results.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RunFile {
    /// Index of its first row.
    first_row: u64,
    /// Number of its rows.
    rows: u64,
    /// Key of the Parquet file below `--results-url`, or below the data folder; null if these rows were not solved.
    key: Option<String>,
    /// Path of these rows as Parquet.
    url: String,
}

/// Lists the files of an ended run: one Parquet file per chunk.
#[utoipa::path(
    get,
    path = "/v1/runs/{id}/manifest",
    tag = "runs",
    operation_id = "get_run_manifest",
    params(("id" = String, Path, description = "Id of the run", format = "uuid")),
    responses((status = 200, description = "The files", body = RunManifest), RunResultProblems)
)]
pub(crate) async fn manifest(WorkPath { jobs, id }: WorkPath) -> Result<Json<RunManifest>> {
    let run = jobs.run(id).await?;
    require_ended(&run)?;
    let (rows, columns) = (run.head.rows, answer_columns(&run));
    let mut chunks = jobs.items(id);
    let mut files = Vec::new();
    while let Some(chunk) = chunks.next().await? {
        let rows = run.head.rows_of(chunk.index);
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

problems! {
    /// Problems of one row of a run.
    RunRowProblems: BadQuery, RunNotFound, RowNotFound, Expired
}

/// One row of a run.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RunRowAlone {
    /// Index of the row in the request, from 0.
    row: u64,
    /// The case of the row: the template with the values of the row. Submitted as a job, it also gives the values per cell, which a run
    /// omits.
    #[schema(value_type = Object)]
    case: Value,
    /// The result of the row by column name; null until it is solved.
    #[schema(value_type = Option<Object>)]
    answer: Option<Map<String, Value>>,
}

/// Returns one row of a run: its case, and its result as soon as there is one.
#[utoipa::path(
    get,
    path = "/v1/runs/{id}/rows/{row}",
    tag = "runs",
    operation_id = "get_run_row",
    params(
        ("id" = String, Path, description = "Id of the run", format = "uuid"),
        ("row" = u64, Path, description = "Index of the row, from 0", minimum = 0)
    ),
    responses((status = 200, description = "The row", body = RunRowAlone), RunRowProblems)
)]
pub(crate) async fn row(
    WorkPath { jobs, id }: WorkPath,
    Path((_id, row)): Path<(String, String)>,
) -> Result<Json<RunRowAlone>> {
    let unknown = |detail| ApiError::new(ProblemKind::RowNotFound, detail);
    let not_index = format!("`{row}` is not the index of a row; rows are counted from 0");
    let row = row.parse().map_err(|_| unknown(not_index))?;
    let run = jobs.run(id).await?;
    if row >= run.head.rows {
        let rows = run.head.rows;
        let detail = format!("the run has {rows} rows, counted from 0");
        return Err(unknown(detail));
    }
    let (case, answer) = jobs.run_row(&run, row).await?;
    let answer = answer.map(members).transpose()?;
    Ok(Json(RunRowAlone { row, case, answer }))
}

/// Returns the only row of a table as a line of the results.
fn members(table: RowTable) -> Result<Map<String, Value>> {
    let line = RowWriter::Ndjson.write(table);
    let line = line.map_err(ApiError::internal)?;
    serde_json::from_slice(&line).map_err(ApiError::internal)
}

/// Default columns of statistics.
const COLUMNS: [&str; 4] = [
    "force_x_n",
    "force_y_n",
    "friction_power_n",
    "pressure_max_mpa",
];
/// Default percentiles.
const PERCENTILES: [f64; 4] = [50.0, 90.0, 99.0, 100.0];
/// Largest number of sections.
const SECTIONS_MAX: usize = 10_000;

query! {
    /// Parameters of the totals of a run.
    RunTotalsQuery {
        /// Comma-separated columns of numbers; default: forces, power and pressure
        #[param(example = "force_y_n,friction_power_n")]
        columns: Vec<String> as String = names("comma-separated names of columns");
        /// Comma-separated percentiles from 0 to 100; default: 50, 90, 99 and 100
        #[param(example = "50,95,99.9")]
        percentiles: Vec<f64> as String = reader("comma-separated numbers from 0 to 100", |text| {
            numbers(text).filter(|all| all.iter().all(|percent| (0.0..=100.0).contains(percent)))
        });
        /// Comma-separated thresholds: counts the rows whose absolute value is at least each threshold
        #[param(example = "20000,30000")]
        above: Vec<f64> as String = reader("comma-separated numbers", numbers);
        /// A column copied from the request: statistics for each of its values, or of its intervals if it contains numbers
        #[param(example = "section")]
        by: String as String = reader("the name of a column", |text| Some(text.to_owned()));
        /// Length of the intervals; required with `by` if that column contains numbers
        #[param(exclusive_minimum = 0.0, example = 100)]
        width: f64 as f64 = reader("a number above 0", |text| {
            text.parse().ok().filter(|width: &f64| *width > 0.0 && width.is_finite())
        });
    }
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    let number = |text: &str| text.trim().parse().ok().filter(|x: &f64| x.is_finite());
    let mut numbers = text.split(',').map(number).collect::<Option<Vec<f64>>>()?;
    numbers.sort_unstable_by(f64::total_cmp);
    numbers.dedup();
    Some(numbers)
}

/// Statistics of the results of a run.
#[none_is_absent]
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RunTotals {
    /// All rows.
    all: SectionTotals,
    /// Sections in the order of their values; only with `by`.
    sections: Option<Vec<SectionTotals>>,
}

/// Statistics of the results of some rows.
#[none_is_absent]
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct SectionTotals {
    /// Value of the column `by`; only for texts, and absent for rows without one.
    value: Option<String>,
    /// Start of the interval; only for numbers.
    from: Option<f64>,
    /// Number of rows.
    rows: u64,
    /// Number of rows by `status`.
    statuses: BTreeMap<String, u64>,
    /// Statistics by column, over the rows with a number in that column.
    columns: BTreeMap<String, ColumnTotals>,
}

/// Statistics of the numbers in a column.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ColumnTotals {
    /// Number of rows with a value.
    count: u64,
    /// Smallest value; null if there is none.
    min: Option<f64>,
    /// Largest value.
    max: Option<f64>,
    /// Mean value.
    mean: Option<f64>,
    /// Percentiles of the absolute values.
    #[serde(serialize_with = "in_order")]
    #[schema(value_type = BTreeMap<String, f64>)]
    percentiles: Vec<(String, f64)>,
    /// Number of rows whose absolute value is at least each threshold.
    #[serde(serialize_with = "in_order")]
    #[schema(value_type = BTreeMap<String, u64>)]
    above: Vec<(String, u64)>,
}

/// Writes an object whose members keep their order.
fn in_order<S: Serializer, V: Serialize>(
    members: &[(String, V)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(members.iter().map(|(name, value)| (name, value)))
}

/// Returns statistics of the results of an ended run: percentiles and exceedances, in total and per section of the line.
#[utoipa::path(
    get,
    path = "/v1/runs/{id}/totals",
    tag = "runs",
    operation_id = "get_run_totals",
    params(
        ("id" = String, Path, description = "Id of the run", format = "uuid"),
        RunTotalsQuery
    ),
    responses((status = 200, description = "The statistics", body = RunTotals), RunResultProblems)
)]
pub(crate) async fn totals(
    WorkPath { jobs, id }: WorkPath,
    uri: Uri,
    State(memory): State<Memory>,
) -> Result<Json<RunTotals>> {
    let query = RunTotalsQuery::read(&uri)?;
    let run = jobs.run(id).await?;
    require_ended(&run)?;
    let named = query.columns;
    let names = named.unwrap_or_else(|| COLUMNS.map(str::to_owned).to_vec());
    for (name, kind) in selected(&run, Some(names.clone()))? {
        if kind != TableKind::Numbers {
            let detail = format!("`{name}` holds no numbers");
            return Err(ApiError::bad_parameter("columns", detail));
        }
    }
    let section = section_of(&run.head.answers(), query.by, query.width)?;
    let rows = usize::try_from(run.head.rows).unwrap_or(usize::MAX);
    // Every number is held once for all rows and once for its section.
    let bytes = rows.saturating_mul(16 * names.len());
    let share = memory.rows(jobs.tenant(), bytes).await?;
    let mut wanted = names.clone();
    wanted.push("status".to_owned());
    wanted.extend(section.iter().map(|section| section.name.clone()));
    let mut gathered = Gathered {
        names,
        section,
        all: Numbers::default(),
        sections: BTreeMap::new(),
    };
    let mut answers = Box::pin(answers(jobs, run, 0..u64::MAX, wanted));
    while let Some(table) = answers.try_next().await? {
        gathered.add(&table)?;
    }
    let percentiles = query.percentiles.unwrap_or_else(|| PERCENTILES.to_vec());
    let above = query.above.unwrap_or_default();
    let totals = blocking(move || {
        let _share = share;
        gathered.totals(&percentiles, &above)
    });
    Ok(Json(totals.await?))
}

/// The column that assigns rows to sections.
struct RowSection {
    name: String,
    /// Length of an interval; `None` for a column of texts.
    width: Option<f64>,
}

fn section_of(
    columns: &[(String, TableKind)],
    by: Option<String>,
    width: Option<f64>,
) -> Result<Option<RowSection>> {
    let refused = |parameter, detail| Err(ApiError::bad_parameter(parameter, detail));
    let Some(name) = by else {
        return match width {
            None => Ok(None),
            Some(_) => refused("width", "`width` belongs to `by`".to_owned()),
        };
    };
    let known = columns.iter().find(|(known, _)| *known == name);
    let Some((_, kind)) = known else {
        return refused("by", format!("`{name}` is not a column of this run"));
    };
    match (*kind == TableKind::Texts, width) {
        (true, Some(_)) => refused(
            "width",
            format!("`{name}` holds texts; `width` is for numbers only"),
        ),
        (false, None) => refused(
            "width",
            format!("`{name}` holds numbers; give `width`, the length of an interval"),
        ),
        _ => Ok(Some(RowSection { name, width })),
    }
}

/// Identifies a section: the index of its interval, or its text, if it has one.
type SectionKey = (Option<i64>, Option<String>);

/// The numbers of all rows, and of each section.
struct Gathered {
    names: Vec<String>,
    section: Option<RowSection>,
    all: Numbers,
    sections: BTreeMap<SectionKey, Numbers>,
}

/// The numbers of some rows.
#[derive(Default)]
struct Numbers {
    rows: u64,
    statuses: BTreeMap<String, u64>,
    columns: Vec<Vec<f64>>,
}

impl Gathered {
    fn add(&mut self, table: &RowTable) -> Result<()> {
        let Some(TableColumn::Texts(statuses)) = table.column("status") else {
            return Err(ApiError::internal("answers without a status"));
        };
        let columns = self.names.iter();
        let columns = columns.filter_map(|name| match table.column(name)? {
            TableColumn::Numbers(numbers) => Some(numbers.as_slice()),
            _ => None,
        });
        let columns: Vec<&[f64]> = columns.collect();
        for (row, status) in statuses.iter().enumerate() {
            let status = status.as_deref().unwrap_or_default();
            self.all.note(status, &columns, row);
            let section = self.section.as_ref();
            let Some(key) = section.and_then(|section| section.key(table, row)) else {
                continue;
            };
            let numbers = self.sections.entry(key).or_default();
            numbers.note(status, &columns, row);
            if self.sections.len() > SECTIONS_MAX {
                let detail = format!("there are more than {SECTIONS_MAX} sections");
                return Err(ApiError::bad_parameter("by", detail));
            }
        }
        Ok(())
    }

    fn totals(self, percentiles: &[f64], above: &[f64]) -> RunTotals {
        let names = &self.names;
        let width = self.section.as_ref().and_then(|section| section.width);
        let sections = self.sections.into_iter().map(|((place, value), numbers)| {
            // 15 digits: -14 times 0.1 is -1.4.
            let start = |place: i64| format!("{:.14e}", place as f64 * width?).parse().ok();
            SectionTotals {
                value,
                from: place.and_then(start),
                ..numbers.totals(names, percentiles, above)
            }
        });
        RunTotals {
            sections: self.section.is_some().then(|| sections.collect()),
            all: self.all.totals(names, percentiles, above),
        }
    }
}

impl RowSection {
    fn key(&self, table: &RowTable, row: usize) -> Option<SectionKey> {
        let number = match table.column(&self.name)? {
            TableColumn::Texts(texts) => {
                return Some((None, texts[row].clone()));
            }
            TableColumn::Numbers(numbers) => numbers[row],
            TableColumn::Integers(numbers) => numbers[row] as f64,
        };
        let quotient = number / self.width?;
        let nearest = quotient.round();
        // 0.3 begins the fourth interval of length 0.1, although the quotient is less than 3.
        let place = match (quotient - nearest).abs() <= 4.0 * f64::EPSILON * nearest.abs() {
            true => nearest,
            false => quotient.floor(),
        };
        (!place.is_nan()).then_some((Some(place as i64), None))
    }
}

impl Numbers {
    fn note(&mut self, status: &str, columns: &[&[f64]], row: usize) {
        self.rows += 1;
        match self.statuses.get_mut(status) {
            Some(count) => *count += 1,
            None => drop(self.statuses.insert(status.to_owned(), 1)),
        }
        self.columns.resize_with(columns.len(), Vec::new);
        for (kept, column) in self.columns.iter_mut().zip(columns) {
            if !column[row].is_nan() {
                kept.push(column[row]);
            }
        }
    }

    fn totals(self, names: &[String], percentiles: &[f64], above: &[f64]) -> SectionTotals {
        // A section without rows has no columns.
        let columns = self.columns.into_iter().chain(repeat(Vec::new()));
        let columns = names.iter().cloned().zip(columns);
        SectionTotals {
            value: None,
            from: None,
            rows: self.rows,
            statuses: self.statuses,
            columns: columns
                .map(|(name, values)| (name, column_totals(values, percentiles, above)))
                .collect(),
        }
    }
}

fn column_totals(values: Vec<f64>, percentiles: &[f64], above: &[f64]) -> ColumnTotals {
    let count = values.len();
    let found = |value: f64| (count > 0).then_some(value);
    let min = values.iter().copied().fold(f64::INFINITY, f64::min);
    let max = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mean = values.iter().sum::<f64>() / count.max(1) as f64;
    let mut sizes: Vec<f64> = values.into_iter().map(f64::abs).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let percentile = |percent: f64| {
        let place = (percent / 100.0 * count as f64).ceil() as usize;
        sizes.get(place.max(1) - 1).copied()
    };
    let percentiles = percentiles.iter();
    ColumnTotals {
        count: count as u64,
        min: found(min),
        max: found(max),
        mean: found(mean),
        percentiles: percentiles
            .filter_map(|percent| Some((percent.to_string(), percentile(*percent)?)))
            .collect(),
        above: above
            .iter()
            .map(|limit| {
                let below = sizes.partition_point(|size| size < limit);
                (limit.to_string(), (count - below) as u64)
            })
            .collect(),
    }
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

    #[test]
    fn percentiles_and_exceedances_are_of_sizes() {
        let values: Vec<f64> = (1..=100)
            .map(|k| f64::from(k) * if k % 2 == 0 { -1.0 } else { 1.0 })
            .collect();
        let totals = column_totals(values, &[0.0, 50.0, 99.0, 100.0], &[90.0, 90.5]);
        let percentiles = [("0", 1.0), ("50", 50.0), ("99", 99.0), ("100", 100.0)];
        let named = percentiles.map(|(name, value)| (name.to_owned(), value));
        assert_eq!(totals.percentiles, named);
        let above = [("90", 11), ("90.5", 10)].map(|(name, count)| (name.to_owned(), count));
        assert_eq!(totals.above, above);
        assert_eq!((totals.min, totals.max), (Some(-100.0), Some(99.0)));
        let none = column_totals(Vec::new(), &[50.0], &[1.0]);
        assert_eq!((none.count, none.mean, none.above[0].1), (0, None, 0));
        assert!(none.percentiles.is_empty());
    }
}
