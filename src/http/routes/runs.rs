//! `POST /v1/runs`: many rows over one case, followed and cancelled as one.

use axum::extract::{Request, State};
use axum::response::Response;
use uuid::Uuid;

use crate::http::dto::run::RunRequest;
use crate::http::extract::multipart::{TableUpload, separate_template};
use crate::http::extract::query::{Repeated, id, query, reader};
use crate::http::extract::run_body::{form, read_run};
use crate::http::extract::titles::{NamedColumns, named_column};
use crate::http::limits::memory::Memory;
use crate::http::options::HttpOptions;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::routes::submission::{NamedQuery, RunAccepted, Submission, SubmitParameters};
use crate::jobs::run::draft::RunOptions;

problems! {
    /// What `POST /v1/runs` can fail with.
    SubmitRunProblems: MalformedJson, UnreadableBody, BadQuery, BadHeader, BodyTimeout, BodyTooLarge, UnsupportedMediaType, UnsupportedEncoding,
    FaultyCase, FaultyTable, JobNotFound, IdempotencyConflict, QuotaExceeded, StoredQuotaExceeded, QueueFull, Overloaded, Draining, StorageFull, StorageUnwritable
}

query! {
    /// What the query of a submission says about the run itself.
    RunQuery(() => ()) {
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
        options: submit,
        idempotency_key,
        reply,
    }: Submission<(RunQuery, NamedQuery)>,
    State(options): State<HttpOptions>,
    State(memory): State<Memory>,
    request: Request,
) -> Result<Response, ApiError> {
    let (name, labels) = named.read_for(&jobs)?;
    let options_of_run = RunOptions {
        name,
        labels,
        submit,
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
    let (run, replayed) = jobs.submit_run(draft, options_of_run).await?;
    reply
        .send(&jobs, &memory, (run.into(), replayed), None)
        .await
}
