//! `POST /v1/evaluate`: evaluates rows in the request, without jobs.

use std::cell::{OnceCell, RefCell};
use std::collections::BTreeMap;
use std::fmt;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use axum::body::{Body, Bytes};
use axum::extract::{Request, State};
use axum::response::Response;
use railhead_macros::none_is_absent;
use serde::Serialize;
use serde_json::Value;
use tokio::runtime::Handle;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::dto::CellValue;
use crate::extract::accept::{choose, one_of};
use crate::extract::caller::Caller;
use crate::extract::query::{Parameters, id, query};
use crate::extract::rows::{
    JSON, TableUpload, declared_bytes, read_body, read_json_columns, separate_table,
};
use crate::limits::{Memory, Pace, hold_while_sent};
use crate::options::HttpOptions;
use crate::problem::{ApiError, ProblemKind, Result, faulty, problems};
use crate::render::format::Format;
use crate::render::row_tables::{json_body, table_body};
use railhead_contact::error::{CaseError, Fault};
use railhead_contact::evaluate::answer::RowsAnswer;
use railhead_contact::evaluate::many::{NotAtOnce, SOLVED_ROWS_MAX};
use railhead_contact::evaluate::varied::{VariedColumn, make_room};
use railhead_contact::monitor::{Monitor, Stop};
use railhead_jobs::Jobs;
use railhead_jobs::run::draft::ReceivedRows;
use railhead_tables::error::too_large;
use railhead_tables::npz;
use railhead_tables::read::{TableForm, TableRows, TableSource};
use railhead_tables::titles::{NamedColumns, TitledColumn};

/// Formats of the response.
const FORMATS: &[Format] = &[
    Format::Json,
    Format::Csv,
    Format::Ndjson,
    Format::Arrow,
    Format::Parquet,
    Format::Npz,
];

/// Rows to evaluate: a case, and columns of values that replace some of its members.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = EvaluateRequest)]
#[allow(
    dead_code,
    reason = "describes a body that is read directly into columns"
)]
pub(crate) struct EvaluateRequest {
    /// A case with one motion, of any contact and method. Members that a column replaces may be omitted. Of `outputs` only `gradients` has
    /// an effect.
    #[schema(value_type = Object)]
    template: Value,
    /// Columns by the JSON pointer of the member that they replace, such as `/load/normal_force_n`; all of the same length. Texts are
    /// digests of stored profiles or keywords of the case.
    columns: BTreeMap<String, Vec<CellValue>>,
}

/// Results of the rows, in their order; null where a row has none.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = EvaluateAnswer)]
#[allow(
    dead_code,
    reason = "describes a response that is written column by column"
)]
pub(crate) struct EvaluateAnswer {
    /// Number of rows.
    rows: usize,
    /// The columns.
    columns: EvaluateColumns,
}

/// Result columns.
#[none_is_absent]
#[derive(Debug, Serialize, ToSchema)]
#[allow(
    dead_code,
    reason = "describes a response that is written column by column"
)]
pub(crate) struct EvaluateColumns {
    /// Longitudinal force on the lower body in N.
    force_x_n: Vec<Option<f64>>,
    /// Lateral force on the lower body in N.
    force_y_n: Vec<Option<f64>>,
    /// Moment about the centre of the ellipse in N·mm.
    moment_z_n_mm: Vec<Option<f64>>,
    /// Bound of the error of each force in N; the bound for the moment is this value times √(ab). It holds for 99 of 100 motions.
    error_estimate: Vec<Option<f64>>,
    /// Friction power divided by rolling speed, ν_x F_x + ν_y F_y + φ M_z, in N (J/m).
    friction_power_n: Vec<Option<f64>>,
    /// Share of the patch that sticks, 0 to 1.
    stick_share: Vec<Option<f64>>,
    /// ∂`force_x_n`/∂`creepage_x`; with `gradients` only.
    force_x_n_by_creepage_x: Option<Vec<Option<f64>>>,
    /// ∂`force_x_n`/∂`creepage_y`; with `gradients` only.
    force_x_n_by_creepage_y: Option<Vec<Option<f64>>>,
    /// ∂`force_x_n`/∂`spin_per_mm`; with `gradients` only.
    force_x_n_by_spin_per_mm: Option<Vec<Option<f64>>>,
    /// ∂`force_y_n`/∂`creepage_x`; with `gradients` only.
    force_y_n_by_creepage_x: Option<Vec<Option<f64>>>,
    /// ∂`force_y_n`/∂`creepage_y`; with `gradients` only.
    force_y_n_by_creepage_y: Option<Vec<Option<f64>>>,
    /// ∂`force_y_n`/∂`spin_per_mm`; with `gradients` only.
    force_y_n_by_spin_per_mm: Option<Vec<Option<f64>>>,
    /// ∂`moment_z_n_mm`/∂`creepage_x`; with `gradients` only.
    moment_z_n_mm_by_creepage_x: Option<Vec<Option<f64>>>,
    /// ∂`moment_z_n_mm`/∂`creepage_y`; with `gradients` only.
    moment_z_n_mm_by_creepage_y: Option<Vec<Option<f64>>>,
    /// ∂`moment_z_n_mm`/∂`spin_per_mm`; with `gradients` only.
    moment_z_n_mm_by_spin_per_mm: Option<Vec<Option<f64>>>,
    /// Sum of the normal forces in N. This column and the following ones are present only if the template needs the solver.
    normal_force_n: Option<Vec<Option<f64>>>,
    /// Estimated error of the moment in N·mm.
    moment_error_estimate: Option<Vec<Option<f64>>>,
    /// Contact area in mm².
    area_mm2: Option<Vec<Option<f64>>>,
    /// Largest pressure in MPa.
    pressure_max_mpa: Option<Vec<Option<f64>>>,
    /// Number of patches.
    patches: Option<Vec<Option<f64>>>,
    /// Iterations of the solver.
    iterations: Option<Vec<Option<f64>>>,
    /// Longitudinal creepage found for a prescribed force.
    creepage_x: Option<Vec<Option<f64>>>,
    /// Lateral creepage found for a prescribed force.
    creepage_y: Option<Vec<Option<f64>>>,
    /// Angular velocity found for a prescribed force or torque, in rad/s.
    angular_velocity_rad_per_s: Option<Vec<Option<f64>>>,
    /// Lateral velocity found for a prescribed force, in mm/s.
    lateral_velocity_mm_per_s: Option<Vec<Option<f64>>>,
    /// `ok`; `target_missed`: the estimated error exceeds the target; `needs_solver`: more than 200 rows need the solver (submit a run);
    /// `not_covered`: the method does not cover the patch; `refused`: the case has faults; `not_finite`; `not_converged`, `unsolvable`,
    /// `out_of_time`, `solver_failed`: the solver found no solution. Only rows with `ok` or `target_missed` have numbers.
    status: Vec<String>,
    /// Why a row has no result.
    reason: Vec<Option<String>>,
    /// Codes of the remarks of a solved row, separated by blanks.
    remarks: Vec<Option<String>>,
}

problems! {
    /// Problems of `POST /v1/evaluate`.
    EvaluateProblems: MalformedJson, UnreadableBody, BadQuery, BodyTimeout, BodyTooLarge, UnsupportedMediaType, UnsupportedEncoding,
    FaultyCase, FaultyTable, JobNotFound, EvaluationTooLong
}

query! {
    /// Parameters of an evaluation.
    EvaluateQuery {
        /// Id of the job whose case is the template of a table; not with `multipart/form-data`, which contains the template
        #[param(format = "uuid")]
        template: Uuid as String = id("job");
        /// `json`, `csv`, `ndjson`, `arrow`, `parquet` or `npz`; overrides `Accept`
        #[param(pattern = "^(json|csv|ndjson|arrow|parquet|npz)$", example = "csv")]
        format: Format as String = one_of(FORMATS);
    }
}

/// Evaluates rows immediately. No job is created and nothing is stored.
///
/// A row is the template with the values of the row; the template is any case with one motion. Contacts of type `radii` and `ellipse` are
/// answered by the table of creep forces or FASTSIM if the method allows it, at most 1 000 000 rows; all others are solved, at most 200
/// rows within 10 s. A larger request is refused with `evaluation-too-long`; `/v1/runs` accepts the same body. A number outside the range
/// of a case is refused with its row and column.
#[utoipa::path(
    post,
    path = "/v1/evaluate",
    tag = "cases",
    operation_id = "evaluate_rows",
    params(EvaluateQuery),
    request_body(content((EvaluateRequest = "application/json"), (String = "text/csv"), (String = "application/x-ndjson"), (Vec<u8> = "application/vnd.apache.arrow.stream"), (Vec<u8> = "application/vnd.apache.parquet"), (Vec<u8> = "application/x-npz"), (TableUpload = "multipart/form-data")), description = "At most 1 000 000 rows and 64 MiB"),
    responses((status = 200, description = "The resultants of the rows", content((EvaluateAnswer = "application/json"), (String = "text/csv"), (String = "application/x-ndjson"), (Vec<u8> = "application/vnd.apache.arrow.stream"), (Vec<u8> = "application/vnd.apache.parquet"), (Vec<u8> = "application/x-npz"))), EvaluateProblems)
)]
pub(crate) async fn evaluate(
    Caller(jobs): Caller,
    State(options): State<HttpOptions>,
    State(memory): State<Memory>,
    request: Request,
) -> Result<Response> {
    let EvaluateQuery { template, format } = EvaluateQuery::read(request.uri())?;
    let format = choose(request.headers(), format, FORMATS)?;
    let state = (&jobs, &memory, &options);
    let declared = declared_bytes(&request, &options).min(options.evaluate_max_bytes);
    let (request, table) = separate_table(state, template, JSON, request).await?;
    let packed = table.as_ref().is_some_and(|table| table.form.packed());
    // First the text and its numbers, then the numbers and the response, each about twice the text. The size of a packed table is not known yet.
    let bytes = match packed {
        true => options.evaluate_max_bytes,
        false => 2 * declared,
    };
    let mut share = memory.rows(jobs.tenant(), bytes).await?;
    let text = read_body(request, &options).await?;
    if !packed && let Some(share) = &mut share {
        share.shrink_to(2 * text.len());
    }
    let (slots, tenant) = (memory.clone(), jobs.tenant().to_owned());
    let work = slots.compute(&tenant, move |pace| {
        let (template, rows, _held) = match table {
            Some(table) => {
                let rows = read_rows(table.form, &text, &options, pace)?;
                if packed && let Some(share) = &mut share {
                    share.shrink_to(2 * (text.len() + rows.bytes()));
                }
                (table.template, rows, table.share)
            }
            None => {
                let (template, named, values) = read_json_columns(&text, &NamedColumns::default())?;
                let mut rows = varied_alone(named)?;
                rows.push(values)?;
                (template, rows, None)
            }
        };
        drop(text);
        let answer = answer((&jobs, &memory, &options), template, rows, pace)?;
        let (bytes, body) = match format {
            Format::Json => (answer.bytes(), json_body(answer)),
            Format::Npz => {
                let archive = npz::write_rows(&answer).map_err(ApiError::internal)?;
                (archive.len(), Body::from(archive))
            }
            _ => {
                let bytes = answer.bytes();
                let body = table_body(format, answer);
                (bytes, body.map_err(ApiError::internal)?)
            }
        };
        if let Some(share) = &mut share {
            share.shrink_to(bytes);
        }
        Ok((body, share))
    });
    let (body, share) = work.await?;
    let response = format.answer("evaluate", body);
    Ok(hold_while_sent(response, share))
}

/// Reads all rows of a table, within limits of their number and, in a compressed format, of their bytes.
fn read_rows(
    form: TableForm,
    text: &Bytes,
    options: &HttpOptions,
    pace: &mut Pace,
) -> Result<ReceivedRows> {
    let (rows_max, bytes_max) = (options.evaluate_max_rows, options.evaluate_max_bytes);
    let source = TableSource::Memory(text.clone());
    let mut table = TableRows::new(form, source, bytes_max)?;
    let mut rows = varied_alone(table.named(&NamedColumns::default())?)?;
    for chunk in table {
        pace.step()?;
        rows.push(chunk?)?;
        if rows.held() > rows_max {
            return Err(too_many(rows.held(), rows_max));
        }
        if form.packed() && rows.bytes() > bytes_max {
            return Err(too_large(bytes_max).into());
        }
    }
    Ok(rows)
}

/// Creates an empty table of these columns, which must all vary the case.
fn varied_alone(columns: Vec<TitledColumn>) -> Result<ReceivedRows> {
    let carried = columns.iter().find(|column| column.pointer.is_none());
    match carried {
        None => Ok(ReceivedRows::new(columns)?),
        Some(TitledColumn { name, .. }) => Err(faulty(format!(
            "the column `{name}` names nothing in the case; only runs copy further columns"
        ))),
    }
}

fn too_many(rows: usize, rows_max: usize) -> ApiError {
    let detail = format!("{rows} rows given; 1 to {rows_max} are allowed (`--evaluate-max-rows`)");
    CaseError(vec![Fault::new("/columns", detail)]).into()
}

/// Evaluates rows within the limits of the options.
fn answer(
    (jobs, memory, options): (&Jobs, &Memory, &HttpOptions),
    mut template: Value,
    rows: ReceivedRows,
    pace: &mut Pace,
) -> Result<RowsAnswer> {
    let count = rows.held();
    let (names, columns): (Vec<String>, Vec<VariedColumn>) = rows.into_varied().unzip();
    if count == 0 || count > options.evaluate_max_rows {
        return Err(too_many(count, options.evaluate_max_rows));
    }
    make_room(&mut template, columns.iter().map(|column| &*column.pointer));
    let template = Handle::current().block_on(jobs.with_profiles(template))?;
    let profiles = jobs.profiles_of(&columns)?;
    let names = columns.iter().zip(&names);
    let names: Vec<(&str, &str)> = names
        .map(|(column, name)| (&*column.pointer, &**name))
        .collect();
    let first = jobs.first_row(&template, &columns, &profiles, &names, |_| None);
    let (case, checked) = first?;
    // The solver is not used for more rows.
    let solver_bytes = match count <= SOLVED_ROWS_MAX {
        true => usize::try_from(checked.cost().own_bytes()).unwrap_or(usize::MAX),
        false => 0,
    };
    if !memory.has_room_for(solver_bytes) {
        let reason = format_args!("a row needs {solver_bytes} bytes of memory");
        return Err(too_long(reason));
    }
    let _solver = memory.ready_answer(jobs.tenant(), solver_bytes)?;
    let pace = RefCell::new(pace);
    let watch = Watch {
        pace: &pace,
        time: options.evaluate_time,
        begun: OnceCell::new(),
        ended: RefCell::new(None),
    };
    let step = || pace.borrow_mut().step();
    let answered = jobs.evaluate((&case, &checked), &columns, &profiles, &watch, step);
    answered.map_err(|error| match error {
        NotAtOnce::Step(error) => error,
        NotAtOnce::TooManyRows(rows) => too_long(format_args!(
            "{rows} rows need the solver; at most {SOLVED_ROWS_MAX} are solved at once"
        )),
        NotAtOnce::Stopped => watch.ended.take().unwrap_or_else(|| {
            let seconds = watch.time.as_secs_f64();
            too_long(format_args!(
                "the solver took longer than {seconds} s (`--evaluate-time-s`)"
            ))
        }),
    })
}

fn too_long(reason: fmt::Arguments<'_>) -> ApiError {
    let detail = format!("{reason}; submit the same body to `/v1/runs`");
    ApiError::new(ProblemKind::EvaluationTooLong, detail)
}

/// Stops the solver when its time is over or the client disconnects, and lets other requests run.
struct Watch<'a, 'b> {
    pace: &'a RefCell<&'b mut Pace>,
    time: Duration,
    begun: OnceCell<Instant>,
    /// The error with which the pace ended the work.
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
