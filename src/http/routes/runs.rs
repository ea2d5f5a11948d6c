//! `/v1/runs`: many rows over one case, followed and cancelled as one.

use axum::Json;
use axum::extract::{Request, State};
use axum::http::{StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::http::dto::run::{RunAnswer, RunRequest};
use crate::http::extract::caller::Caller;
use crate::http::extract::ids::RunId;
use crate::http::extract::labels::{name, new_label};
use crate::http::extract::multipart::{TableUpload, separate_template};
use crate::http::extract::query::{Parameters, Repeated, count, id, query, reader};
use crate::http::extract::run_body::{form, read_run};
use crate::http::extract::submit_options::SubmitQuery;
use crate::http::extract::titles::{NamedColumns, named_column};
use crate::http::limits::memory::Memory;
use crate::http::options::HttpOptions;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::routes::batches::labels_of;
use crate::http::routes::job_list::{ListProblems, ListTotal};
use crate::http::routes::jobs::{idempotency_key, mark_replay};
use crate::http::routes::next_page::{answer, list_query};
use crate::http::routes::wait::{Wait, WaitQuery};
use crate::jobs::error::JobsError;
use crate::jobs::model::kind::Kind;
use crate::jobs::run::draft::RunOptions;
use crate::jobs::run::model::Run;
use crate::jobs::{BATCH_PAGE_MAX, BatchFilter, Jobs};

/// Runs in one page of a list when nothing is said.
const LIST_LIMIT_DEFAULT: u32 = 20;

problems! {
    /// What `POST /v1/runs` can fail with.
    SubmitRunProblems: MalformedJson, UnreadableBody, BadQuery, BadHeader, BodyTimeout, BodyTooLarge, UnsupportedMediaType, UnsupportedEncoding,
    FaultyCase, FaultyTable, JobNotFound, IdempotencyConflict, QuotaExceeded, StoredQuotaExceeded, QueueFull, Overloaded, Draining, StorageFull, StorageUnwritable
}

query! {
    /// What the query of a submission says about the run itself.
    RunQuery(() => ()) {
        /// Name of the run
        #[param(min_length = 1, max_length = 200, example = "night of 3 May")]
        name: String as String = name();
        /// A label of the run, written `key:value`; may be repeated, for at most 32 labels with different keys
        #[param(max_items = 32, example = json!(["line:A12"]))]
        label: Vec<(String, String)> as Vec<String> = Repeated(new_label());
        /// The job whose case is the template of a table; not with `multipart/form-data`, which holds the template itself
        #[param(format = "uuid")]
        template: Uuid as String = id("job");
        /// What a column is whose title does not say it, as `TITLE:NAME`; may be repeated. The name is a JSON pointer, a short name or a name with a
        /// unit, such as `Q:vertical_force [kN]`; a unit in the title or in a line of units may be left out. Without a name the column is carried along
        /// to the answers
        #[param(max_items = 100, example = json!(["Q:vertical_force [kN]"]))]
        column: Vec<(String, String)> as Vec<String> = Repeated(reader("`TITLE:NAME`", named_column));
        /// Titles of columns that are carried along to the answers, with commas between. Columns of places, times, sections and vehicles, such as `km`,
        /// `time` or `axle_no`, need no mention; any other column whose title names nothing in the case is refused
        #[param(example = "Y_left,curvature")]
        carry: Vec<String> as String = reader("titles of columns with commas between", |text| {
            Some(text.split(',').map(|title| title.trim().to_owned()).collect())
        });
    }
}

/// Submits many rows as one run.
///
/// A row is the template with the row's values in place of its own; it is solved as a case of its own, to the last bit, whatever other rows there are. With `auto`, a row takes the table of creep forces where its bound meets the target, and `boundary_element` elsewhere. The body is
/// JSON with `template` and `columns`, at most as large as one of `/v1/evaluate`, or a table, which is read as it arrives: as `multipart/form-data` with the parts `template` and `table`, or alone with `?template=` naming a job. A
/// row that cannot be solved has a `status` in the results that says why, and does not affect other rows.
#[utoipa::path(
    post,
    path = "/v1/runs",
    tag = "runs",
    operation_id = "submit_run",
    params(
        RunQuery,
        SubmitQuery,
        WaitQuery,
        ("Prefer" = Option<String>, Header, description = "`wait=N`, as `?wait=N` (RFC 7240)", example = "wait=10"),
        ("Idempotency-Key" = Option<String>, Header, min_length = 1, max_length = 255, pattern = "^[!-~]+$", description = "1 to 255 visible ASCII characters. Repeating a request with the same key, the same rows and the same options answers the first run instead of making another"),
        ("traceparent" = Option<String>, Header, description = "W3C trace context: if the service exports traces, the trace of the run continues the client's trace. An unreadable value is ignored", example = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01")
    ),
    request_body(content(
        (RunRequest = "application/json"),
        (String = "text/csv"),
        (String = "application/x-ndjson"),
        (Vec<u8> = "application/vnd.apache.arrow.stream"),
        (Vec<u8> = "application/vnd.apache.parquet"),
        (Vec<u8> = "application/x-npz"),
        (TableUpload = "multipart/form-data")
    ), description = "At most 10 000 000 rows and 1 GiB"),
    responses(
        (status = 200, description = "The run ended within the wait", body = RunAnswer, headers(
            ("Location" = String, description = "Path of the run"),
            ("Preference-Applied" = String, description = "The wait that was applied, if one was preferred"),
            ("Idempotency-Replayed" = String, description = "`true` if this is the run of an earlier request with the same `Idempotency-Key`; absent otherwise")
        )),
        (status = 202, description = "The rows are stored and will be solved", body = RunAnswer, headers(
            ("Location" = String, description = "Path of the run"),
            ("Idempotency-Replayed" = String, description = "`true` if this is the run of an earlier request with the same `Idempotency-Key`; absent otherwise")
        )),
        SubmitRunProblems
    )
)]
pub(crate) async fn submit(
    Caller(jobs): Caller,
    wait: Wait,
    State(options): State<HttpOptions>,
    State(memory): State<Memory>,
    request: Request,
) -> Result<Response, ApiError> {
    let idempotency_key = idempotency_key(request.headers())?;
    let ((run, submit), _) = <((RunQuery, SubmitQuery), WaitQuery)>::read(request.uri(), &())?;
    let mut labels = labels_of(run.label.unwrap_or_default())?;
    jobs.bind(&mut labels)
        .map_err(|faults| ApiError::bad_parameter("label", faults[0].detail.clone()))?;
    let options_of_run = RunOptions {
        name: run.name,
        labels,
        submit: submit.options(request.headers()),
        idempotency_key,
    };
    let (request, template) =
        separate_template(&jobs, &memory, &options, run.template, request).await?;
    let table = form(request.headers(), template)?;
    let carried = run.carry.unwrap_or_default().into_iter();
    let named = run.column.unwrap_or_default().into_iter();
    let named = named.chain(carried.map(|title| (title, String::new())));
    let read = (table, NamedColumns(named.collect()));
    let draft = read_run(&jobs, &memory, &options, read, request).await?;
    let (mut run, replayed) = jobs.submit_run(draft, options_of_run).await?;
    let id = run.chunks.id;
    let location = [(header::LOCATION, format!("/v1/runs/{id}"))];
    // The run is stored: whatever ends the wait early, the client must learn its id.
    let waited = wait.hold(&jobs, async |at_most| jobs.wait_run(id, at_most).await);
    if let Ok(Some(Ok(later))) = waited.await {
        run = later;
    }
    let status = match run.state().ended() {
        true if wait.at_most().is_some() => StatusCode::OK,
        _ => StatusCode::ACCEPTED,
    };
    let run = Json(RunAnswer::from(run));
    let mut response = (status, location, run).into_response();
    mark_replay(&mut response, replayed);
    Ok(wait.tell_applied(response))
}

/// A page of runs, newest first.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RunPage {
    /// The runs of this page.
    runs: Vec<RunAnswer>,
    /// Give this as `cursor` for the next page; null on the last one.
    next_cursor: Option<String>,
    #[serde(flatten)]
    count: ListTotal,
}

list_query! {
    /// Filters and page of a list of runs.
    RunListQuery {
        /// Runs in one page; 20 when left out
        #[param(minimum = 1, maximum = 100)]
        limit: u32 as u32 = count(1, BATCH_PAGE_MAX);
    }
}

/// Lists runs, newest first.
#[utoipa::path(
    get,
    path = "/v1/runs",
    tag = "runs",
    operation_id = "list_runs",
    params(RunListQuery),
    responses((status = 200, description = "A page of runs", body = RunPage, headers(
        ("Link" = String, description = "The next page (`rel=next`), unless this is the last one")
    )), ListProblems)
)]
pub(crate) async fn list(Caller(jobs): Caller, uri: Uri) -> Result<Response, ApiError> {
    let query = RunListQuery::read(&uri, &())?;
    let filter = BatchFilter {
        kind: Kind::Rows,
        labels: query.label.unwrap_or_default(),
        name: query.name,
        created_after: query.created_after,
        created_before: query.created_before,
    };
    let limit = query.limit.unwrap_or(LIST_LIMIT_DEFAULT);
    let page = jobs
        .batches(&filter, query.cursor.as_deref(), limit)
        .await?;
    let mut runs = Vec::with_capacity(page.entries.len());
    for batch in page.entries {
        match jobs.with_head(batch).await {
            Ok(run) => runs.push(RunAnswer::from(run)),
            // Deleted meanwhile, or about to be removed.
            Err(JobsError::BatchNotFound(_) | JobsError::Expired) => {}
            Err(error) => return Err(error.into()),
        }
    }
    let cursor = page.next_cursor.clone();
    let page = RunPage {
        runs,
        next_cursor: page.next_cursor,
        count: page.total.into(),
    };
    Ok(answer(&uri, cursor.as_deref(), page))
}

problems! {
    /// What asking for a run can fail with.
    GetRunProblems: BadQuery, RunNotFound
}

/// Returns a run.
#[utoipa::path(
    get,
    path = "/v1/runs/{id}",
    tag = "runs",
    operation_id = "get_run",
    params(
        ("id" = String, Path, description = "Id of the run", format = "uuid"),
        WaitQuery,
        ("Prefer" = Option<String>, Header, description = "`wait=N`, as `?wait=N` (RFC 7240)", example = "wait=10")
    ),
    responses((status = 200, description = "The run", body = RunAnswer, headers(
        ("Preference-Applied" = String, description = "The wait that was applied, if one was preferred")
    )), GetRunProblems)
)]
pub(crate) async fn get(
    Caller(jobs): Caller,
    RunId(id): RunId,
    wait: Wait,
) -> Result<Response, ApiError> {
    let run = ended_run(&jobs, id, &wait).await?;
    Ok(wait.tell_applied(Json(RunAnswer::from(run)).into_response()))
}

/// A run, after the wait that the request asks for.
pub(crate) async fn ended_run(jobs: &Jobs, id: Uuid, wait: &Wait) -> Result<Run, ApiError> {
    let waited = wait.hold(jobs, async |at_most| jobs.wait_run(id, at_most).await);
    match waited.await? {
        Some(run) => Ok(run?),
        None => Ok(jobs.run(id).await?),
    }
}

/// Stops a run. Finished rows keep their answers.
#[utoipa::path(
    post,
    path = "/v1/runs/{id}/cancel",
    tag = "runs",
    operation_id = "cancel_run",
    params(("id" = String, Path, description = "Id of the run", format = "uuid")),
    responses(
        (status = 200, description = "The run has ended", body = RunAnswer),
        (status = 202, description = "What is being solved will stop shortly", body = RunAnswer),
        GetRunProblems
    )
)]
pub(crate) async fn cancel(Caller(jobs): Caller, RunId(id): RunId) -> Result<Response, ApiError> {
    let run: RunAnswer = jobs
        .with_head(jobs.cancel_batch(Kind::Rows, id).await?)
        .await?
        .into();
    let status = match run.ended() {
        true => StatusCode::OK,
        false => StatusCode::ACCEPTED,
    };
    Ok((status, Json(run)).into_response())
}

problems! {
    /// What deleting a run can fail with.
    DeleteRunProblems: BadQuery, RunNotFound, RunNotEnded
}

/// Removes an ended run with its rows and answers.
#[utoipa::path(
    delete,
    path = "/v1/runs/{id}",
    tag = "runs",
    operation_id = "delete_run",
    params(("id" = String, Path, description = "Id of the run", format = "uuid")),
    responses((status = 204, description = "The run is gone"), DeleteRunProblems)
)]
pub(crate) async fn delete(Caller(jobs): Caller, RunId(id): RunId) -> Result<StatusCode, ApiError> {
    jobs.delete_batch(Kind::Rows, id).await?;
    Ok(StatusCode::NO_CONTENT)
}
