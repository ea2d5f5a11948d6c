//! `POST /v1/evaluate`: many rows of numbers answered at once, without jobs.

use std::cell::{OnceCell, RefCell};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde_json::Value;
use tokio::runtime::Handle;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::contact::error::{CaseError, Fault};
use crate::contact::evaluate::answer::RowsAnswer;
use crate::contact::evaluate::column::Column;
use crate::contact::evaluate::many::solve::{NotAtOnce, SOLVED_ROWS_MAX};
use crate::contact::evaluate::many::task::several_answers;
use crate::contact::evaluate::request_faults::{column_pointer, of_first_row, of_values};
use crate::contact::evaluate::varied::{Values, VariedColumn, case_of_row};
use crate::contact::monitor::{Monitor, Stop};
use crate::http::dto::run::CellValue;
use crate::http::extract::accept::{choose, one_of};
use crate::http::extract::caller::Caller;
use crate::http::extract::json::essence;
use crate::http::extract::multipart::{TableUpload, Template, separate_template, template_missing};
use crate::http::extract::npz::read_npz;
use crate::http::extract::query::{Parameters, id, query};
use crate::http::extract::rows::{
    NamedValues, declared_bytes, read_arrow, read_body, read_csv, read_json_columns,
};
use crate::http::extract::titles::{NamedColumns, faulty};
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
    /// A case with one motion, of any contact and method. Values that a column holds may be left out. Of `outputs` only `gradients` counts.
    #[schema(value_type = Object)]
    template: Value,
    /// Columns by the JSON pointer of the value that they stand for, such as `/load/normal_force_n`; all of the same length. Texts are digests
    /// of stored profiles or words of the case.
    columns: BTreeMap<String, Vec<CellValue>>,
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
    /// Sum of the normal forces in N. This and the next columns are there only if the template needs the solver.
    #[schema(nullable = false)]
    normal_force_n: Option<Vec<Option<f64>>>,
    /// Estimated error of the moment in N·mm.
    #[schema(nullable = false)]
    moment_error_estimate: Option<Vec<Option<f64>>>,
    /// Contact area in mm².
    #[schema(nullable = false)]
    area_mm2: Option<Vec<Option<f64>>>,
    /// Largest pressure in MPa.
    #[schema(nullable = false)]
    pressure_max_mpa: Option<Vec<Option<f64>>>,
    /// Number of patches.
    #[schema(nullable = false)]
    patches: Option<Vec<Option<f64>>>,
    /// Iterations of the solver.
    #[schema(nullable = false)]
    iterations: Option<Vec<Option<f64>>>,
    /// Longitudinal creepage found for a prescribed force.
    #[schema(nullable = false)]
    creepage_x: Option<Vec<Option<f64>>>,
    /// Lateral creepage found for a prescribed force.
    #[schema(nullable = false)]
    creepage_y: Option<Vec<Option<f64>>>,
    /// Angular velocity found for a prescribed force or torque, in rad/s.
    #[schema(nullable = false)]
    angular_velocity_rad_per_s: Option<Vec<Option<f64>>>,
    /// Lateral velocity found for a prescribed force, in mm/s.
    #[schema(nullable = false)]
    lateral_velocity_mm_per_s: Option<Vec<Option<f64>>>,
    /// `ok`; `target_missed`: the estimated error is above the target; `needs_solver`: with `auto`, the table does not answer the row, and more
    /// than 200 rows of the request need the solver: submit them as a run; `not_covered`: the method does not cover the patch; `refused`: the
    /// case of the row has faults, which `POST /v1/cases/check` names; `not_finite`: a number of the answer is not finite; `not_converged`,
    /// `unsolvable`, `out_of_time`, `solver_failed`: the solver has no answer. Only rows that are `ok` or `target_missed` have numbers.
    status: Vec<String>,
}

problems! {
    /// What `POST /v1/evaluate` can fail with.
    EvaluateProblems: MalformedJson, UnreadableBody, BadQuery, BodyTimeout, BodyTooLarge, UnsupportedMediaType, UnsupportedEncoding,
    FaultyCase, FaultyTable, JobNotFound, EvaluationTooLong
}

query! {
    /// Parameters of an evaluation.
    EvaluateQuery(() => ()) {
        /// The job whose case is the template of a table; not with `multipart/form-data`, which holds the template itself
        #[param(format = "uuid")]
        template: Uuid as String = id("job");
        /// `json`, `csv`, `arrow` or `npz`; overrides `Accept`
        #[param(pattern = "^(json|csv|arrow|npz)$", example = "csv")]
        format: Format as String = one_of(FORMATS);
    }
}

/// Answers rows at once. No job is made and nothing is stored.
///
/// A row is the template with the row's values in place of its own; the template may be any case of one motion. Contacts of type `radii` and
/// `ellipse` are answered by the table of creep forces or by FASTSIM where the method allows, 1 000 000 rows at most. Everything else is solved as
/// a run solves it: at most 200 rows, in 10 s. A request beyond that is refused with `evaluation-too-long`; `/v1/runs` takes the same body. If a
/// number is outside the range allowed in a case, the request is refused with its row and column.
#[utoipa::path(
    post,
    path = "/v1/evaluate",
    tag = "cases",
    operation_id = "evaluate_rows",
    params(EvaluateQuery),
    request_body(content((EvaluateRequest = "application/json"), (String = "text/csv"), (Vec<u8> = "application/vnd.apache.arrow.stream"), (Vec<u8> = "application/x-npz"), (TableUpload = "multipart/form-data")), description = "At most 1 000 000 rows and 64 MiB"),
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
    let (request, template) =
        separate_template(&jobs, &memory, &options, template, request).await?;
    let essence = essence(request.headers());
    let (template, template_share) = match table_template(&essence, template)? {
        Some(template) => {
            let (case, share) = template.case(&jobs).await?;
            (Some(case), share)
        }
        None => (None, None),
    };
    // First the text and its numbers, then these and the answer: about twice the text at any time.
    let bytes = match &*essence {
        // May be packed.
        NPZ => options.evaluate_max_bytes,
        _ => declared_bytes(&request, &options).min(options.evaluate_max_bytes),
    };
    let mut share = memory.rows(jobs.tenant(), 2 * bytes).await?;
    let text = read_body(request, &options).await?;
    if essence != NPZ
        && let Some(share) = &mut share
    {
        share.keep(2 * text.len());
    }
    let mut computation = memory.computation(jobs.tenant());
    let bytes_max = options.evaluate_max_bytes;
    let evaluation = Evaluation {
        jobs,
        memory,
        rows_max: options.evaluate_max_rows,
        time: options.evaluate_time,
    };
    let work = computation.run(move |pace| {
        let _held = template_share;
        let (template, columns) = match template {
            Some(template) if essence == NPZ => {
                (template, varied(read_npz(text.clone(), bytes_max)?))
            }
            Some(template) if essence == "text/csv" => (template, varied(read_csv(&text)?)),
            Some(template) => (template, varied(read_arrow(text.clone())?)),
            None => {
                let (template, columns) = read_json_columns(&text)?;
                (template, named(columns)?)
            }
        };
        drop(text);
        let answer = evaluation.answer(template, &columns, pace)?;
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
    let mut response = (headers, body).into_response();
    response
        .headers_mut()
        .extend(format.disposition("evaluate"));
    Ok(hold_while_sent(response, share))
}

/// Columns of JSON, named by pointers, short names or quantities with units, as those of a run are.
fn named(columns: NamedValues) -> Result<Vec<VariedColumn>, ApiError> {
    let kinds = columns.iter();
    let kinds = kinds.map(|(title, values)| (&**title, None, matches!(values, Values::Texts(_))));
    let named = NamedColumns::default().columns(kinds)?;
    let mut varied: Vec<VariedColumn> = Vec::new();
    for (column, (title, values)) in named.iter().zip(columns) {
        let Some(pointer) = column.pointer.clone() else {
            return Err(faulty(format!(
                "the column `{title}` stands for nothing in the case; only runs carry columns along"
            )));
        };
        if varied.iter().any(|before| before.pointer == pointer) {
            return Err(faulty(format!(
                "the column `{title}` stands for `{pointer}`, as another one does"
            )));
        }
        let values = match values {
            Values::Numbers(numbers) => {
                let numbers = numbers.into_iter();
                Values::Numbers(numbers.map(|number| column.in_case(number)).collect())
            }
            texts @ Values::Texts(_) => texts,
        };
        varied.push(VariedColumn { pointer, values });
    }
    Ok(varied)
}

fn varied(columns: Vec<Column>) -> Vec<VariedColumn> {
    let columns = columns.into_iter();
    columns
        .map(|Column { pointer, values }| VariedColumn {
            pointer,
            values: Values::Numbers(values),
        })
        .collect()
}

/// The template of a table; nothing for JSON, which has its own.
fn table_template(essence: &str, template: Option<Template>) -> Result<Option<Template>, ApiError> {
    match (essence, template) {
        ("application/json", None) => Ok(None),
        ("application/json", Some(_)) => Err(ApiError::bad_parameter(
            "template",
            "`template` belongs to a table; JSON has a `template` of its own",
        )),
        ("text/csv" | ARROW_STREAM | ARROW_FILE | NPZ, Some(template)) => Ok(Some(template)),
        ("text/csv" | ARROW_STREAM | ARROW_FILE | NPZ, None) => Err(template_missing()),
        (other, _) => Err(ApiError::new(
            ProblemKind::UnsupportedMediaType,
            format!(
                "the content type is `{other}`; send `application/json` with `template` and `columns`, or a table with `text/csv`, `application/vnd.apache.arrow.stream` or `application/x-npz`, or a template and a table with `multipart/form-data`"
            ),
        )),
    }
}

/// The rows with the limits that they are answered under.
struct Evaluation {
    jobs: Jobs,
    memory: Memory,
    rows_max: usize,
    time: Duration,
}

impl Evaluation {
    fn answer(
        &self,
        template: Value,
        columns: &[VariedColumn],
        pace: &mut Pace,
    ) -> Result<RowsAnswer, ApiError> {
        let rows_max = self.rows_max;
        let rows = columns.first().map_or(0, |column| column.values.len());
        if rows == 0 || rows > rows_max {
            let detail =
                format!("{rows} rows given; 1 to {rows_max} are allowed (`--evaluate-max-rows`)");
            return Err(CaseError(vec![Fault::new("/columns", detail)]).into());
        }
        let faults = faults_of_columns(columns, rows);
        if !faults.is_empty() {
            return Err(CaseError(faults).into());
        }
        let template = Handle::current().block_on(self.jobs.with_profiles(template))?;
        let profiles = self.jobs.profiles_of(columns)?;
        let case = case_of_row(&template, columns, &profiles, 0).map_err(|(pointer, reason)| {
            let detail = format!("the column `{pointer}` {reason}");
            CaseError(vec![Fault::new("/columns", detail)])
        })?;
        let checked = self.jobs.check(&case).map_err(|error| {
            let pointers = columns.iter().map(|column| &*column.pointer);
            let pointers: Vec<_> = pointers.map(|pointer| (pointer, pointer)).collect();
            of_first_row(error, &pointers)
        })?;
        if let Some(fault) = several_answers(&checked) {
            let pointer = format!("/template{}", fault.pointer);
            return Err(CaseError(vec![Fault { pointer, ..fault }]).into());
        }
        // Beyond this number of rows the solver is not used.
        let solver_bytes = match rows <= SOLVED_ROWS_MAX {
            true => usize::try_from(checked.cost().own_bytes()).unwrap_or(usize::MAX),
            false => 0,
        };
        if !self.memory.has_room_for(solver_bytes) {
            return Err(too_long(&format!(
                "a row needs {solver_bytes} bytes of memory"
            )));
        }
        let _solver = self.memory.ready_answer(self.jobs.tenant(), solver_bytes)?;
        let pace = RefCell::new(pace);
        let watch = Watch {
            pace: &pace,
            time: self.time,
            begun: OnceCell::new(),
            ended: RefCell::new(None),
        };
        let step = || pace.borrow_mut().step();
        let jobs = &self.jobs;
        let answered = jobs.evaluate((&case, &checked), columns, &profiles, &watch, step);
        answered.map_err(|error| match error {
            NotAtOnce::Step(error) => error,
            NotAtOnce::TooManyRows(rows) => too_long(&format!(
                "{rows} rows need the solver; at most {SOLVED_ROWS_MAX} are solved at once"
            )),
            NotAtOnce::Stopped => watch.ended.take().unwrap_or_else(|| {
                let seconds = self.time.as_secs_f64();
                too_long(&format!(
                    "the solver took longer than {seconds} s (`--evaluate-time-s`)"
                ))
            }),
        })
    }
}

/// Columns of unlike length, and values that no case may have in their place.
fn faults_of_columns(columns: &[VariedColumn], rows: usize) -> Vec<Fault> {
    let mut faults = Vec::new();
    for VariedColumn { pointer, values } in columns {
        if values.len() == rows {
            faults.extend(of_values(pointer, pointer, values, 0));
        } else {
            let detail = format!(
                "{} values given, the first column has {rows}; all columns need as many",
                values.len()
            );
            faults.push(Fault::new(column_pointer(pointer), detail));
        }
    }
    faults
}

fn too_long(reason: &str) -> ApiError {
    let detail = format!("{reason}; submit the same body to `/v1/runs`");
    ApiError::new(ProblemKind::EvaluationTooLong, detail)
}

/// Stops the solver when its time is over or the client leaves, and passes the turn on to other requests.
struct Watch<'a, 'b> {
    pace: &'a RefCell<&'b mut Pace>,
    time: Duration,
    begun: OnceCell<Instant>,
    /// Why the pace ended the work.
    ended: RefCell<Option<ApiError>>,
}

impl Monitor for Watch<'_, '_> {
    fn tick(&self, _progress: f64) -> ControlFlow<Stop> {
        if self.begun.get_or_init(Instant::now).elapsed() > self.time {
            return ControlFlow::Break(Stop::Cancelled);
        }
        match self.pace.borrow_mut().step() {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                *self.ended.borrow_mut() = Some(error);
                ControlFlow::Break(Stop::Cancelled)
            }
        }
    }

    fn elapsed(&self) -> Duration {
        let begun = self.begun.get();
        begun.map_or(Duration::ZERO, Instant::elapsed)
    }
}
