//! `/v1/evolutions`: profiles that wear under a traffic, as work of their own.

use axum::extract::{Path, State};
use axum::http::{HeaderMap, Uri, header};
use axum::response::{IntoResponse, Response};
use serde_json::{Map, Value};
use uuid::Uuid;

use crate::contact::error::{CaseError, Fault};
use crate::contact::evaluate::request_faults::column_pointer;
use crate::contact::solution::words::evolution::{EvolutionAnswer, EvolutionRecord, WornBody};
use crate::http::dto::evolution::EvolutionRequest;
use crate::http::extract::accept::{choose, one_of};
use crate::http::extract::caller::Caller;
use crate::http::extract::ids::{JobId, parsed};
use crate::http::extract::json::JsonBody;
use crate::http::extract::query::{Parameters, count, query, reader};
use crate::http::extract::titles::place;
use crate::http::limits::holding_body::hold_while_sent;
use crate::http::limits::memory::Memory;
use crate::http::limits::tenant_semaphore::Permit;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::http::render::format::Format;
use crate::http::render::row_tables::RowWriter;
use crate::http::routes::jobs::{GetProblems, SubmitProblems};
use crate::http::routes::results::ResultProblems;
use crate::http::routes::submission::{JobAccepted, NamedQuery, Submission, SubmitParameters};
use crate::jobs::codec::table::{RowTable, TableColumn};
use crate::jobs::model::kind::Kind;
use crate::jobs::{Jobs, JobsError};

/// The forms of the tables.
const TABLES: &[Format] = &[Format::Csv, Format::Ndjson, Format::Arrow, Format::Parquet];

/// Submits an evolution: profiles that wear under a traffic, step by step.
///
/// An evolution is followed, waited for, cancelled and deleted like a job. Its steps are stored as they are taken, and one that is interrupted goes
/// on from the last of them to the same answer.
#[utoipa::path(
    post,
    path = "/v1/evolutions",
    tag = "evolutions",
    operation_id = "submit_evolution",
    params(NamedQuery, SubmitParameters),
    request_body(content = EvolutionRequest, description = "Case, traffic and plan", content_type = "application/json"),
    responses(JobAccepted, SubmitProblems)
)]
pub(crate) async fn submit(
    Submission {
        jobs,
        own: named,
        options,
        idempotency_key,
        reply,
    }: Submission<NamedQuery>,
    State(memory): State<Memory>,
    JsonBody { mut value, room }: JsonBody,
) -> Result<Response, ApiError> {
    let jobs = jobs.of_kind(Kind::Evolution);
    let named = named.read_for(&jobs)?;
    name_columns(&mut value)?;
    let submitted = jobs.submit_evolution(value, named, idempotency_key, options);
    let (job, replayed) = submitted.await?;
    drop(room);
    reply
        .send(&jobs, &memory, (job.into(), replayed), None)
        .await
}

/// Names the columns of the traffic by JSON pointers, in the units of the case. What is no table is left to the check.
fn name_columns(request: &mut Value) -> Result<(), ApiError> {
    let columns = request.pointer_mut("/traffic/columns");
    let Some(Value::Object(columns)) = columns else {
        return Ok(());
    };
    let (mut named, mut faults) = (Map::new(), Vec::new());
    for (title, mut values) in std::mem::take(columns) {
        let found = place(&title, None).and_then(|found| {
            found.ok_or_else(|| {
                "names nothing in the case; allowed are JSON pointers such as `/contact/lateral_shift_mm` and the names of columns of runs".to_owned()
            })
        });
        let added = found.and_then(|found| {
            scale(&mut values, found.factor);
            match named.insert(found.pointer.clone(), values) {
                Some(_) => Err(format!("a second column for `{}`", found.pointer)),
                None => Ok(()),
            }
        });
        let pointer = format!("/traffic{}", column_pointer(&title));
        faults.extend(added.err().map(|detail| Fault::new(pointer, detail)));
    }
    *columns = named;
    match faults.is_empty() {
        true => Ok(()),
        false => Err(JobsError::from(CaseError(faults)).into()),
    }
}

/// Multiplies the numbers of a column, or of its distribution.
fn scale(values: &mut Value, factor: f64) {
    match values {
        Value::Array(values) => values.iter_mut().for_each(|value| scale(value, factor)),
        Value::Object(values) => values.values_mut().for_each(|value| scale(value, factor)),
        Value::Number(number) if factor != 1.0 => {
            *values = number.as_f64().map(|number| factor * number).into();
        }
        _ => {}
    }
}

/// An evolution as it was submitted, with the columns of its traffic named by JSON pointers.
#[utoipa::path(
    get,
    path = "/v1/evolutions/{id}/request",
    tag = "evolutions",
    operation_id = "get_evolution_request",
    params(("id" = String, Path, description = "Id of the evolution", format = "uuid")),
    responses((status = 200, description = "Case, traffic and plan", body = EvolutionRequest), GetProblems)
)]
pub(crate) async fn request(Caller(jobs): Caller, JobId(id): JobId) -> Result<Response, ApiError> {
    let text = jobs.of_kind(Kind::Evolution).case(id).await?;
    Ok(([(header::CONTENT_TYPE, Format::Json.media_type())], text).into_response())
}

/// The answer of a succeeded evolution.
#[utoipa::path(
    get,
    path = "/v1/evolutions/{id}/result",
    tag = "evolutions",
    operation_id = "get_evolution_result",
    params(("id" = String, Path, description = "Id of the evolution", format = "uuid")),
    responses((status = 200, description = "The answer", body = EvolutionAnswer), ResultProblems)
)]
pub(crate) async fn result(
    Caller(jobs): Caller,
    JobId(id): JobId,
    State(memory): State<Memory>,
) -> Result<Response, ApiError> {
    let jobs = jobs.of_kind(Kind::Evolution);
    let share = memory.ready_answer(jobs.tenant(), jobs.answer_bytes(id).await?)?;
    let text = jobs.answer(id).await?.solution;
    let head = [(header::CONTENT_TYPE, Format::Json.media_type())];
    Ok(hold_while_sent((head, text).into_response(), share))
}

query! {
    /// Parameters of the tables of an evolution.
    EvolutionTableQuery(() => ()) {
        /// `records`, a row for each stored step (when left out), or `points`, a row for each point of both sections in each of them
        #[param(pattern = "^(records|points)$", example = "records")]
        of: TableOf as String = reader("`records` or `points`", |text| match text {
            "records" => Some(TableOf::Records),
            "points" => Some(TableOf::Points),
            _ => None,
        });
        /// `csv`, `ndjson`, `arrow` or `parquet`; overrides `Accept`
        #[param(pattern = "^(csv|ndjson|arrow|parquet)$", example = "parquet")]
        format: Format as String = one_of(TABLES);
    }
}

/// What the rows of a table are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TableOf {
    /// Stored steps.
    Records,
    /// Points of the sections.
    Points,
}

/// The answer of a succeeded evolution as a table.
#[utoipa::path(
    get,
    path = "/v1/evolutions/{id}/table",
    tag = "evolutions",
    operation_id = "get_evolution_table",
    params(("id" = String, Path, description = "Id of the evolution", format = "uuid"), EvolutionTableQuery),
    responses((status = 200, description = "The table", content(
        (String = "text/csv"),
        (String = "application/x-ndjson"),
        (Vec<u8> = "application/vnd.apache.arrow.stream"),
        (Vec<u8> = "application/vnd.apache.parquet")
    )), ResultProblems)
)]
pub(crate) async fn table(
    Caller(jobs): Caller,
    JobId(id): JobId,
    uri: Uri,
    State(memory): State<Memory>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let query = EvolutionTableQuery::read(&uri, &())?;
    let format = choose(&headers, query.format, TABLES)?;
    let found = read(jobs, &memory, id, move |evolution| {
        let table = match query.of {
            Some(TableOf::Points) => points_table(evolution),
            _ => records_table(evolution),
        };
        RowWriter::whole(format, table).map_err(|error| ApiError::internal(&error))
    });
    let (text, share) = found.await?;
    let head = [
        (header::CONTENT_TYPE, format.media_type()),
        (header::VARY, "Accept"),
    ];
    let mut response = (head, text).into_response();
    let name = format!("evolution-{id}");
    response.headers_mut().extend(format.disposition(&name));
    Ok(hold_while_sent(response, share))
}

query! {
    /// Parameters of a section of an evolution.
    SectionQuery(() => ()) {
        /// Number of the record, from 0; the last when left out
        #[param(minimum = 0, maximum = 100000, example = 3)]
        record: u32 as u32 = count(0, 100_000);
        /// `columns` (when left out), `miniprof` or `simpack`
        #[param(pattern = "^(columns|miniprof|simpack)$", example = "miniprof")]
        format: SectionForm as String = reader("`columns`, `miniprof` or `simpack`", |text| {
            FORMS.into_iter().find(|(name, _)| *name == text)
        });
    }
}

/// A form of a file with a section: its name, and the extensions for a rail and a wheel.
type SectionForm = (&'static str, [&'static str; 2]);
const FORMS: [SectionForm; 3] = [
    ("columns", ["txt", "txt"]),
    ("miniprof", ["ban", "whl"]),
    ("simpack", ["prr", "prw"]),
];

/// A section of a succeeded evolution as a file for other programs.
#[utoipa::path(
    get,
    path = "/v1/evolutions/{id}/sections/{body}",
    tag = "evolutions",
    operation_id = "get_evolution_section",
    params(
        ("id" = String, Path, description = "Id of the evolution", format = "uuid"),
        ("body" = String, Path, description = "`rail` or `wheel`", pattern = "^(rail|wheel)$"),
        SectionQuery
    ),
    responses((status = 200, description = "The file", content((String = "text/plain"))), ResultProblems)
)]
pub(crate) async fn section(
    Caller(jobs): Caller,
    Path((id, body)): Path<(String, String)>,
    uri: Uri,
    State(memory): State<Memory>,
) -> Result<Response, ApiError> {
    let query = SectionQuery::read(&uri, &())?;
    let id = parsed(&id, ProblemKind::JobNotFound, "evolution")?;
    if !["rail", "wheel"].contains(&body.as_str()) {
        let detail = format!("`{body}` is no body; allowed: rail, wheel");
        return Err(ApiError::new(ProblemKind::JobNotFound, detail));
    }
    let wheel = body == "wheel";
    let (form, extensions) = query.format.unwrap_or(FORMS[0]);
    let found = read(jobs, &memory, id, move |evolution| {
        let last = evolution.records.len().saturating_sub(1);
        let number = query.record.map_or(last, |number| number as usize);
        let record = evolution.records.get(number).ok_or_else(|| {
            ApiError::bad_parameter("record", format!("{number} given; 0 to {last} are there"))
        })?;
        let worn = if wheel { &record.wheel } else { &record.rail };
        Ok(file(worn, wheel, form).into_bytes())
    });
    let (text, share) = found.await?;
    let extension = extensions[usize::from(wheel)];
    let name = format!("attachment; filename=\"{body}-{id}.{extension}\"");
    let head = [
        (header::CONTENT_TYPE, "text/plain; charset=utf-8".to_owned()),
        (header::CONTENT_DISPOSITION, name),
    ];
    Ok(hold_while_sent((head, text).into_response(), share))
}

/// Makes something of the answer of an evolution, off the threads that answer requests.
async fn read(
    jobs: Jobs,
    memory: &Memory,
    id: Uuid,
    make: impl FnOnce(&EvolutionAnswer) -> Result<Vec<u8>, ApiError> + Send + 'static,
) -> Result<(Vec<u8>, Option<Permit>), ApiError> {
    let jobs = jobs.of_kind(Kind::Evolution);
    // Once as text, and about as much as numbers.
    let share = memory.ready_answer(jobs.tenant(), 2 * jobs.answer_bytes(id).await?)?;
    let text = jobs.answer(id).await?.solution;
    let made = tokio::task::spawn_blocking(move || {
        let read = serde_json::from_slice(&text);
        make(&read.map_err(|error| ApiError::internal(&error))?)
    });
    let made = made.await.map_err(|error| ApiError::internal(&error))??;
    Ok((made, share))
}

fn records_table(evolution: &EvolutionAnswer) -> RowTable {
    type Of = fn(&EvolutionRecord) -> Option<f64>;
    let columns: [(&str, Of); 26] = [
        ("share", |r| Some(r.progress.share)),
        ("mgt", |r| r.progress.mgt),
        ("axle_passes", |r| r.progress.axle_passes),
        ("wheel_distance_km", |r| r.progress.wheel_distance_km),
        ("height_mm", |r| r.losses.height_mm),
        ("gauge_face_mm", |r| r.losses.gauge_face_mm),
        ("gauge_corner_mm", |r| r.losses.gauge_corner_mm),
        ("tread_mm", |r| r.losses.tread_mm),
        ("flange_mm", |r| r.losses.flange_mm),
        ("rail_worn_area_mm2", |r| Some(r.rail.worn_area_mm2)),
        ("rail_machined_area_mm2", |r| Some(r.rail.machined_area_mm2)),
        ("rail_damage_max", |r| largest(&r.rail.damage)),
        ("rail_depth_max_mm", |r| largest(&r.rail.depth_mm)),
        ("rail_coefficients_low", |r| {
            Some(r.rail.uncertainty.coefficients[0])
        }),
        ("rail_coefficients_high", |r| {
            Some(r.rail.uncertainty.coefficients[1])
        }),
        ("wheel_worn_area_mm2", |r| Some(r.wheel.worn_area_mm2)),
        ("wheel_machined_area_mm2", |r| {
            Some(r.wheel.machined_area_mm2)
        }),
        ("wheel_damage_max", |r| largest(&r.wheel.damage)),
        ("wheel_depth_max_mm", |r| largest(&r.wheel.depth_mm)),
        ("conicity", |r| r.conicity),
        ("pressure_max_mpa", |r| Some(r.contact.pressure_max_mpa)),
        ("pressure_mean_mpa", |r| Some(r.contact.pressure_mean_mpa)),
        ("y_over_q_max", |r| Some(r.contact.y_over_q_max)),
        ("y_over_q_mean", |r| Some(r.contact.y_over_q_mean)),
        ("t_gamma_mean_n", |r| Some(r.contact.t_gamma_mean_n)),
        ("unsolved_share", |r| Some(r.contact.unsolved_share)),
    ];
    let records = &evolution.records;
    let numbers = (0..records.len()).map(|k| k as i64).collect();
    let first = [("record".to_owned(), TableColumn::Integers(numbers))];
    let rest = columns.into_iter().map(|(name, of)| {
        let values = records.iter().map(|record| of(record).unwrap_or(f64::NAN));
        (name.to_owned(), TableColumn::Numbers(values.collect()))
    });
    RowTable {
        columns: first.into_iter().chain(rest).collect(),
    }
}

fn largest(values: &[f64]) -> Option<f64> {
    values.iter().copied().max_by(f64::total_cmp)
}

fn points_table(evolution: &EvolutionAnswer) -> RowTable {
    let (mut record, mut point) = (Vec::new(), Vec::new());
    let mut body = Vec::new();
    let mut values: [Vec<f64>; 5] = Default::default();
    for (number, one) in evolution.records.iter().enumerate() {
        for (name, worn) in [("rail", &one.rail), ("wheel", &one.wheel)] {
            for (k, [y, z]) in worn.points_mm.iter().enumerate() {
                record.push(number as i64);
                point.push(k as i64);
                body.push(Some(name.to_owned()));
                let row = [one.progress.share, *y, *z, worn.depth_mm[k], worn.damage[k]];
                values
                    .iter_mut()
                    .zip(row)
                    .for_each(|(column, value)| column.push(value));
            }
        }
    }
    let names = ["share", "y_mm", "z_mm", "depth_mm", "damage"];
    let numbers = names.into_iter().zip(values);
    let numbers = numbers.map(|(name, values)| (name.to_owned(), TableColumn::Numbers(values)));
    let first = [
        ("record".to_owned(), TableColumn::Integers(record)),
        ("body".to_owned(), TableColumn::Texts(body)),
        ("point".to_owned(), TableColumn::Integers(point)),
    ];
    RowTable {
        columns: first.into_iter().chain(numbers).collect(),
    }
}

/// The text of a file with a section, in mm.
fn file(worn: &WornBody, wheel: bool, form: &str) -> String {
    let points = worn.points_mm.iter();
    let kind = u8::from(wheel);
    match form {
        "miniprof" => {
            // MiniProf's X points to the track centre.
            let rows = points.map(|[y, z]| format!("{:.6}\t{z:.6}\n", 0.0 - y));
            let (count, rows) = (worn.points_mm.len(), rows.collect::<String>());
            format!("ProgramName=railhead\nXYPoints={count}\nColumnDef=X,Y\n\n{rows}")
        }
        _ => {
            let rows: String = points.map(|[y, z]| format!("{y:.6} {z:.6}\n")).collect();
            match form {
                "simpack" => format!(
                    "header.begin\n  version = 1\n  type = {kind}\nheader.end\nspline.begin\n  type = 0\n  units.len.f = 1000\n  point.begin\n{rows}  point.end\nspline.end\n"
                ),
                _ => rows,
            }
        }
    }
}
