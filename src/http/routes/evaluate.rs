//! `POST /v1/evaluate`: many rows of numbers answered at once, without jobs.

use std::collections::BTreeMap;

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::contact::error::{CaseError, Fault};
use crate::contact::evaluate::answer::RowsAnswer;
use crate::contact::evaluate::column::Column;
use crate::contact::evaluate::request_faults::of_first_row;
use crate::contact::evaluate::rows::Rows;
use crate::http::extract::accept::{choose, one_of};
use crate::http::extract::caller::Caller;
use crate::http::extract::json;
use crate::http::extract::json::essence;
use crate::http::extract::npz::read_npz;
use crate::http::extract::query::{Parameters, id, query};
use crate::http::extract::rows::{declared_bytes, read_arrow, read_body, read_csv, read_json};
use crate::http::limits::holding_body::hold_while_sent;
use crate::http::limits::memory::Memory;
use crate::http::limits::turns::Pace;
use crate::http::options::HttpOptions;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::http::render::format::Format;
use crate::http::render::npz;
use crate::http::render::rows::{arrow_body, csv_body, json_body};
use crate::jobs::Jobs;
use crate::jobs::batch::template::{Cell, fill};

/// The forms of Arrow data.
const ARROW_STREAM: &str = "application/vnd.apache.arrow.stream";
const ARROW_FILE: &str = "application/vnd.apache.arrow.file";
/// NumPy's archive of arrays.
const NPZ: &str = "application/x-npz";
/// The forms of an answer.
const FORMATS: &[Format] = &[Format::Json, Format::Csv, Format::Arrow, Format::Npz];

/// Rows to evaluate: a case, and columns of numbers that stand in place of some of its numbers.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = EvaluateRequest)]
#[allow(
    dead_code,
    reason = "the contract; bodies are read straight into columns"
)]
pub(crate) struct EvaluateRequest {
    /// A case of type `radii` or `ellipse` with one motion; `method` is `table`, `fastsim` or `auto`. Numbers that a column holds may be
    /// left out. Of `outputs` only `gradients` counts.
    #[schema(value_type = Object)]
    template: Value,
    /// Columns by the JSON pointer of the number that they stand for, such as `/load/normal_force_n`; all of the same length.
    columns: BTreeMap<String, Vec<f64>>,
}

/// Answers to rows, in their order; null where a row has none.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = EvaluateAnswer)]
#[allow(
    dead_code,
    reason = "the contract; answers are written column by column"
)]
pub(crate) struct EvaluateAnswer {
    /// Number of rows.
    rows: usize,
    /// The columns.
    columns: EvaluateColumns,
}

/// Columns of an answer.
#[derive(Debug, Serialize, ToSchema)]
#[allow(
    dead_code,
    reason = "the contract; answers are written column by column"
)]
pub(crate) struct EvaluateColumns {
    /// Longitudinal force on the lower body in N.
    force_x_n: Vec<Option<f64>>,
    /// Lateral force on the lower body in N.
    force_y_n: Vec<Option<f64>>,
    /// Moment about the centre of the ellipse in N·mm.
    moment_z_n_mm: Vec<Option<f64>>,
    /// Bound of the error of either force in N; that of the moment is this times √(ab). It holds for 99 of 100 motions.
    error_estimate: Vec<Option<f64>>,
    /// ν_x F_x + ν_y F_y + φ M_z in N (J/m).
    friction_power_n: Vec<Option<f64>>,
    /// Share of the patch that sticks, 0 to 1.
    stick_share: Vec<Option<f64>>,
    /// ∂`force_x_n`/∂`creepage_x`; with `gradients` only.
    #[schema(nullable = false)]
    force_x_n_by_creepage_x: Option<Vec<Option<f64>>>,
    /// ∂`force_x_n`/∂`creepage_y`; with `gradients` only.
    #[schema(nullable = false)]
    force_x_n_by_creepage_y: Option<Vec<Option<f64>>>,
    /// ∂`force_x_n`/∂`spin_per_mm`; with `gradients` only.
    #[schema(nullable = false)]
    force_x_n_by_spin_per_mm: Option<Vec<Option<f64>>>,
    /// ∂`force_y_n`/∂`creepage_x`; with `gradients` only.
    #[schema(nullable = false)]
    force_y_n_by_creepage_x: Option<Vec<Option<f64>>>,
    /// ∂`force_y_n`/∂`creepage_y`; with `gradients` only.
    #[schema(nullable = false)]
    force_y_n_by_creepage_y: Option<Vec<Option<f64>>>,
    /// ∂`force_y_n`/∂`spin_per_mm`; with `gradients` only.
    #[schema(nullable = false)]
    force_y_n_by_spin_per_mm: Option<Vec<Option<f64>>>,
    /// ∂`moment_z_n_mm`/∂`creepage_x`; with `gradients` only.
    #[schema(nullable = false)]
    moment_z_n_mm_by_creepage_x: Option<Vec<Option<f64>>>,
    /// ∂`moment_z_n_mm`/∂`creepage_y`; with `gradients` only.
    #[schema(nullable = false)]
    moment_z_n_mm_by_creepage_y: Option<Vec<Option<f64>>>,
    /// ∂`moment_z_n_mm`/∂`spin_per_mm`; with `gradients` only.
    #[schema(nullable = false)]
    moment_z_n_mm_by_spin_per_mm: Option<Vec<Option<f64>>>,
    /// `ok`; `target_missed`: the bound is above the target; `needs_solver`: the bound is above the target, or the table does not represent the law
    /// of friction or the layer, and `auto` does not solve rows here: submit them as a run; `not_covered`: a/b is beyond 0.1 to 10; `refused`: the
    /// case of the row has faults, which `POST /v1/cases/check` names; `not_finite`: a number of the answer is not finite. Only rows that are `ok` or
    /// `target_missed` have numbers, and all of them.
    status: Vec<String>,
}

problems! {
    /// What `POST /v1/evaluate` can fail with.
    EvaluateProblems: MalformedJson, UnreadableBody, BadQuery, BodyTimeout, BodyTooLarge, UnsupportedMediaType, UnsupportedEncoding,
    FaultyCase, FaultyTable, JobNotFound
}

query! {
    /// Parameters of an evaluation.
    EvaluateQuery(() => ()) {
        /// With a table, and needed there: the job whose case is the template
        #[param(format = "uuid")]
        template: Uuid as String = id("job");
        /// `json`, `csv`, `arrow` or `npz`; overrides `Accept`
        #[param(pattern = "^(json|csv|arrow|npz)$", example = "csv")]
        format: Format as String = one_of(FORMATS);
    }
}

/// Evaluates rows of numbers by the table of creep forces or by the simplified theory, and answers at once.
///
/// A row is the template with the row's numbers in place of its own. No job is made and nothing is stored. If a number is outside the
/// range allowed in a case, the request is refused with its row and column.
#[utoipa::path(
    post,
    path = "/v1/evaluate",
    tag = "cases",
    operation_id = "evaluate_rows",
    params(EvaluateQuery),
    request_body(content((EvaluateRequest = "application/json"), (String = "text/csv"), (Vec<u8> = "application/vnd.apache.arrow.stream"), (Vec<u8> = "application/x-npz")), description = "At most 1 000 000 rows and 64 MiB"),
    responses((status = 200, description = "The rows' resultants", content((EvaluateAnswer = "application/json"), (String = "text/csv"), (Vec<u8> = "application/vnd.apache.arrow.stream"), (Vec<u8> = "application/x-npz"))), EvaluateProblems)
)]
pub(crate) async fn evaluate(
    Caller(jobs): Caller,
    State(options): State<HttpOptions>,
    State(memory): State<Memory>,
    request: Request,
) -> Result<Response, ApiError> {
    let EvaluateQuery { template, format } = EvaluateQuery::read(request.uri(), &())?;
    let format = choose(request.headers(), format, FORMATS)?;
    let essence = essence(request.headers());
    let template = stored_template(&jobs, &essence, template).await?;
    // First the text and its numbers, then these and the answer: about twice the text at any time.
    let bytes = match &*essence {
        // May be packed.
        NPZ => options.evaluate_max_bytes,
        _ => declared_bytes(&request, &options).min(options.evaluate_max_bytes),
    };
    let mut share = memory.rows(jobs.tenant(), 2 * bytes).await?;
    let text = read_body(request, &options).await?;
    let mut computation = memory.computation(jobs.tenant());
    let (rows_max, bytes_max) = (options.evaluate_max_rows, options.evaluate_max_bytes);
    let work = computation.run(move |pace| {
        let (template, columns) = match template {
            Some(template) if essence == NPZ => (template, read_npz(text.clone(), bytes_max)?),
            Some(template) if essence == "text/csv" => (template, read_csv(&text)?),
            Some(template) => (template, read_arrow(text.clone())?),
            None => read_json(&text)?,
        };
        drop(text);
        let answer = answer(&jobs, &template, columns, rows_max, pace)?;
        let (bytes, body) = match format {
            Format::Csv => (answer.bytes(), csv_body(answer)),
            Format::Arrow => (answer.bytes(), arrow_body(answer)),
            Format::Npz => {
                let archive =
                    npz::write_rows(&answer).map_err(|error| ApiError::internal(&error))?;
                (archive.len(), Body::from(archive))
            }
            _ => (answer.bytes(), json_body(answer)),
        };
        if let Some(share) = &mut share {
            share.keep(bytes);
        }
        Ok((body, share))
    });
    let (body, share) = work.await?;
    let headers = [
        (header::CONTENT_TYPE, format.media_type()),
        (header::VARY, "Accept"),
    ];
    Ok(hold_while_sent((headers, body).into_response(), share))
}

/// The template of a table; nothing for JSON, which has its own.
async fn stored_template(
    jobs: &Jobs,
    essence: &str,
    template: Option<Uuid>,
) -> Result<Option<Value>, ApiError> {
    match (essence, template) {
        ("application/json", None) => Ok(None),
        ("application/json", Some(_)) => Err(ApiError::bad_parameter(
            "template",
            "`template` belongs to a table; JSON has a `template` of its own",
        )),
        ("text/csv" | ARROW_STREAM | ARROW_FILE | NPZ, Some(job)) => {
            let case = jobs.case(job).await;
            let case = case.map_err(|error| ApiError::from(error).about("template"))?;
            json::read_json(&case).map(Some)
        }
        ("text/csv" | ARROW_STREAM | ARROW_FILE | NPZ, None) => Err(ApiError::bad_parameter(
            "template",
            "a table needs `?template=` with the id of a job; its case is what the columns are filled into",
        )),
        (other, _) => Err(ApiError::new(
            ProblemKind::UnsupportedMediaType,
            format!(
                "the content type is `{other}`; send `application/json` with `template` and `columns`, or a table with `text/csv`, `application/vnd.apache.arrow.stream` or `application/x-npz`"
            ),
        )),
    }
}

fn answer(
    jobs: &Jobs,
    template: &Value,
    columns: Vec<Column>,
    rows_max: usize,
    pace: &mut Pace,
) -> Result<RowsAnswer, ApiError> {
    let rows = columns.first().map_or(0, |column| column.values.len());
    if rows == 0 || rows > rows_max {
        let detail =
            format!("{rows} rows given; 1 to {rows_max} are allowed (`--evaluate-max-rows`)");
        return Err(CaseError(vec![Fault::new("/columns", detail)]).into());
    }
    let first = first_row(template, &columns)?;
    let checked = jobs.check(&first).map_err(|error| {
        let pointers = columns.iter().map(|column| &*column.pointer);
        let pointers: Vec<_> = pointers.map(|pointer| (pointer, pointer)).collect();
        of_first_row(error, &pointers)
    })?;
    Rows::new(&first, &checked, columns)?.evaluate_stepwise(|| pace.step())
}

/// The case of the first row.
fn first_row(template: &Value, columns: &[Column]) -> Result<Value, ApiError> {
    let cells: Vec<Cell> = columns
        .iter()
        .filter_map(|column| Some((column, column.values.first()?)))
        .map(|(column, value)| {
            let parts = column.pointer.split('/').skip(1);
            let path = parts.map(|part| part.replace("~1", "/").replace("~0", "~"));
            Cell(path.collect(), Value::from(*value))
        })
        .collect();
    fill(template, &cells).map_err(|(number, reason)| {
        let column = &columns[number].pointer;
        let fault = Fault::new("/columns", format!("the column `{column}` {reason}"));
        CaseError(vec![fault]).into()
    })
}
