//! `/v1/evolutions`: wear of profiles under a traffic.

use axum::extract::{Path, State};
use axum::http::{HeaderMap, Uri, header};
use axum::response::{IntoResponse, Response};
use serde_json::{Map, Value};

use crate::extract::accept::{choose, one_of};
use crate::extract::caller::WorkPath;
use crate::extract::json::JsonBody;
use crate::extract::query::{Parameters, count, query, word};
use crate::limits::{Memory, hold_while_sent};
use crate::problem::{ApiError, ProblemKind, Result};
use crate::render::format::Format;
use crate::routes::jobs::{self, GetProblems, SubmitProblems};
use crate::routes::results::ResultProblems;
use crate::routes::submission::{JobAccepted, NamedQuery, Submission, SubmitParameters};
use railhead_contact::case::words::evolution::{EvolutionWords, WearLosses};
use railhead_contact::error::{CaseError, Fault};
use railhead_contact::evaluate::varied::column_pointer;
use railhead_contact::solution::words::evolution::{EvolutionAnswer, EvolutionRecord, WornBody};
use railhead_jobs::JobsError;
use railhead_jobs::model::Kind;
use railhead_jobs::sync::blocking;
use railhead_tables::table::{RowTable, TableColumn};
use railhead_tables::titles::{Place, place, question};
use railhead_tables::write::RowWriter;

/// Formats of the tables.
const TABLES: &[Format] = &[Format::Csv, Format::Ndjson, Format::Arrow, Format::Parquet];

/// Submits an evolution: profiles that wear under a traffic, step by step.
///
/// An evolution is followed, waited for, cancelled and deleted like a job. Its steps are stored; an interrupted evolution continues from
/// the last one and gives the same result.
#[utoipa::path(
    post,
    path = "/v1/evolutions",
    tag = "evolutions",
    operation_id = "submit_evolution",
    params(NamedQuery, SubmitParameters),
    request_body(content = EvolutionWords, description = "Case, traffic and plan", content_type = "application/json"),
    responses(JobAccepted, SubmitProblems)
)]
pub(crate) async fn submit(
    Submission {
        jobs,
        own: named,
        mut options,
        reply,
    }: Submission<NamedQuery>,
    State(memory): State<Memory>,
    JsonBody { mut value, room }: JsonBody,
) -> Result<Response> {
    let jobs = jobs.of_kind(Kind::Evolution);
    named.read_into(&mut options, &jobs)?;
    let titles = name_columns(&mut value)?;
    let submitted = jobs.submit_evolution(value, options);
    let (job, replayed) = submitted.await.map_err(|error| by_title(error, &titles))?;
    drop(room);
    reply
        .send(&jobs, &memory, (job.into(), replayed), None)
        .await
}

/// Pointers to a column of the request: with the JSON pointer of its member as the name, and with its title as the name.
type Title = [String; 2];

/// Renames the columns of the traffic to JSON pointers, and converts them to the units of the case. The check of the request refuses other
/// JSON than a table.
fn name_columns(request: &mut Value) -> Result<Vec<Title>> {
    let columns = request.pointer_mut("/traffic/columns");
    let (mut titles, mut named, mut faults) = (Vec::new(), Map::new(), Vec::new());
    let Some(Value::Object(columns)) = columns else {
        return Ok(titles);
    };
    for (title, mut values) in std::mem::take(columns) {
        let unknown = || {
            let allowed = "allowed are JSON pointers such as `/contact/lateral_shift_mm` and the names of columns of runs that replace a member";
            let asked = question(&title, None);
            let detail = format!("names nothing in the case; {allowed}; {asked}");
            detail.trim_end_matches("; ").to_owned()
        };
        let in_request = |name: &str| format!("/traffic{}", column_pointer(name));
        let detail = match place(&title, None).and_then(|found| found.ok_or_else(unknown)) {
            Ok(Place { pointer, factor }) => {
                scale(&mut values, factor);
                titles.push([&*pointer, &*title].map(in_request));
                let other = named.insert(pointer.clone(), values);
                other.map(|_| format!("a second column for `{pointer}`"))
            }
            Err(detail) => Some(detail),
        };
        faults.extend(detail.map(|detail| Fault::new(in_request(&title), detail)));
    }
    *columns = named;
    match faults.is_empty() {
        true => Ok(titles),
        false => Err(JobsError::from(CaseError(faults)).into()),
    }
}

/// Replaces the names of columns in the pointers of an error by their titles.
fn by_title(mut error: JobsError, titles: &[Title]) -> JobsError {
    if let JobsError::Case(CaseError(faults)) = &mut error {
        for fault in faults {
            let known = titles.iter().find_map(|[name, title]| {
                let rest = fault.pointer.strip_prefix(name.as_str())?;
                (rest.is_empty() || rest.starts_with('/')).then(|| format!("{title}{rest}"))
            });
            fault.pointer = known.unwrap_or_else(|| std::mem::take(&mut fault.pointer));
        }
    }
    error
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

/// Returns an evolution as it was submitted, with the columns of its traffic named by JSON pointers.
#[utoipa::path(
    get,
    path = "/v1/evolutions/{id}/request",
    tag = "evolutions",
    operation_id = "get_evolution_request",
    params(("id" = String, Path, description = "Id of the evolution", format = "uuid")),
    responses((status = 200, description = "Case, traffic and plan", body = EvolutionWords), GetProblems)
)]
pub(crate) async fn request(evolution: WorkPath) -> Result<Response> {
    jobs::case(evolution).await
}

/// Returns the result of a succeeded evolution.
#[utoipa::path(
    get,
    path = "/v1/evolutions/{id}/result",
    tag = "evolutions",
    operation_id = "get_evolution_result",
    params(("id" = String, Path, description = "Id of the evolution", format = "uuid")),
    responses((status = 200, description = "The result", body = EvolutionAnswer), ResultProblems)
)]
pub(crate) async fn result(
    WorkPath { jobs, id }: WorkPath,
    State(memory): State<Memory>,
) -> Result<Response> {
    let answer = jobs.open_answer(id).await?;
    let share = memory.ready_answer(jobs.tenant(), answer.bytes)?;
    let text = answer.text().await?;
    let head = [(header::CONTENT_TYPE, Format::Json.media_type())];
    Ok(hold_while_sent((head, text).into_response(), share))
}

query! {
    /// Parameters of the tables of an evolution.
    EvolutionTableQuery {
        /// `records` (default), a row for each stored step, or `points`, a row for each point of both sections in each stored step
        #[param(pattern = "^(records|points)$", example = "records")]
        of: TableOf as String = word(&ROWS);
        /// `csv`, `ndjson`, `arrow` or `parquet`; overrides `Accept`
        #[param(pattern = "^(csv|ndjson|arrow|parquet)$", example = "parquet")]
        format: Format as String = one_of(TABLES);
    }
}

/// Creates a table.
type TableOf = fn(&EvolutionAnswer) -> RowTable;
/// The tables by name.
const ROWS: [(&str, TableOf); 2] = [("records", records_table), ("points", points_table)];

/// Returns the result of a succeeded evolution as a table.
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
    evolution: WorkPath,
    uri: Uri,
    State(memory): State<Memory>,
    headers: HeaderMap,
) -> Result<Response> {
    let query = EvolutionTableQuery::read(&uri)?;
    let format = choose(&headers, query.format, TABLES)?;
    let id = evolution.id;
    let made = read(evolution, &memory, move |evolution| {
        let table = query.of.unwrap_or(records_table)(evolution);
        let text = RowWriter::whole(format.table(), table).map_err(ApiError::internal)?;
        Ok(format.answer(&format!("evolution-{id}"), text))
    });
    made.await
}

/// The bodies of a record.
type BodyOf = fn(&EvolutionRecord) -> &WornBody;
const BODIES: [(&str, BodyOf); 2] = [("rail", |r| &r.rail), ("wheel", |r| &r.wheel)];

query! {
    /// Parameters of a section of an evolution.
    SectionQuery {
        /// Index of the record, from 0; default: the last
        #[param(minimum = 0, maximum = 100000, example = 3)]
        record: u32 as u32 = count(0, 100_000);
        /// `columns` (default), `miniprof` or `simpack`
        #[param(pattern = "^(columns|miniprof|simpack)$", example = "miniprof")]
        format: SectionForm as String = word(&FORMS);
    }
}

/// Format of a file with a section: its extensions for a rail and a wheel, and the function that writes points `[y, z]` in mm.
type SectionForm = ([&'static str; 2], fn(&[[f64; 2]], bool) -> String);
const FORMS: [(&str, SectionForm); 3] = [
    (
        "columns",
        (["txt", "txt"], |points, _| lines(points, 1.0, ' ')),
    ),
    ("miniprof", (["ban", "whl"], miniprof)),
    ("simpack", (["prr", "prw"], simpack)),
];

/// Returns a section of a succeeded evolution as a file for other programs.
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
    evolution: WorkPath,
    Path((_id, body)): Path<(String, String)>,
    uri: Uri,
    State(memory): State<Memory>,
) -> Result<Response> {
    let query = SectionQuery::read(&uri)?;
    let id = evolution.id;
    let Some(k) = BODIES.iter().position(|(name, _)| *name == body) else {
        let detail = format!("`{body}` is not a body; allowed: rail, wheel");
        return Err(ApiError::new(ProblemKind::JobNotFound, detail));
    };
    let (extensions, text) = query.format.unwrap_or(FORMS[0].1);
    let made = read(evolution, &memory, move |evolution| {
        let last = evolution.records.len().saturating_sub(1);
        let number = query.record.map_or(last, |number| number as usize);
        let record = evolution.records.get(number).ok_or_else(|| {
            ApiError::bad_parameter("record", format!("{number} given; allowed: 0 to {last}"))
        })?;
        let extension = extensions[k];
        let name = format!("attachment; filename=\"{body}-{id}.{extension}\"");
        let head = [
            (header::CONTENT_TYPE, "text/plain; charset=utf-8".to_owned()),
            (header::CONTENT_DISPOSITION, name),
        ];
        Ok((head, text(&BODIES[k].1(record).points_mm, k == 1)).into_response())
    });
    made.await
}

/// Answers with the response that `make` creates from an evolution on a blocking thread.
async fn read(
    WorkPath { jobs, id }: WorkPath,
    memory: &Memory,
    make: impl FnOnce(&EvolutionAnswer) -> Result<Response> + Send + 'static,
) -> Result<Response> {
    // The text, and about as much for the parsed evolution.
    let answer = jobs.open_answer(id).await?;
    let share = memory.ready_answer(jobs.tenant(), 2 * answer.bytes)?;
    let text = answer.text().await?;
    let made = blocking(move || {
        let read = serde_json::from_slice(&text);
        make(&read.map_err(ApiError::internal)?)
    });
    Ok(hold_while_sent(made.await??, share))
}

fn records_table(evolution: &EvolutionAnswer) -> RowTable {
    let records = &evolution.records;
    let numbers = TableColumn::Integers((0..records.len() as i64).collect());
    let mut columns = vec![("record".to_owned(), numbers)];
    let mut add = |name: &str, of: &dyn Fn(&EvolutionRecord) -> Option<f64>| {
        let values = records.iter().map(|r| of(r).unwrap_or(f64::NAN));
        columns.push((name.to_owned(), TableColumn::Numbers(values.collect())));
    };
    add("share", &|r| Some(r.progress.share));
    add("mgt", &|r| r.progress.mgt);
    add("axle_passes", &|r| r.progress.axle_passes);
    add("wheel_distance_km", &|r| r.progress.wheel_distance_km);
    for (k, (name, _)) in WearLosses::default().named().into_iter().enumerate() {
        add(name, &|r| r.losses.named()[k].1);
    }
    let largest = |values: &[f64]| values.iter().copied().max_by(f64::total_cmp);
    for (name, body) in BODIES {
        let mut add = |what: &str, of: &dyn Fn(&WornBody) -> Option<f64>| {
            add(&format!("{name}_{what}"), &|r| of(body(r)));
        };
        add("worn_area_mm2", &|b| Some(b.worn_area_mm2));
        add("machined_area_mm2", &|b| Some(b.machined_area_mm2));
        add("damage_max", &|b| largest(&b.damage));
        add("depth_max_mm", &|b| largest(&b.depth_mm));
        let factor = |b: &WornBody, k: usize| Some(b.uncertainty.coefficients[k]);
        add("coefficients_low", &|b| factor(b, 0));
        add("coefficients_high", &|b| factor(b, 1));
    }
    add("conicity", &|r| r.conicity);
    add("pressure_max_mpa", &|r| Some(r.contact.pressure_max_mpa));
    add("pressure_mean_mpa", &|r| Some(r.contact.pressure_mean_mpa));
    add("y_over_q_max", &|r| Some(r.contact.y_over_q_max));
    add("y_over_q_mean", &|r| Some(r.contact.y_over_q_mean));
    add("t_gamma_mean_n", &|r| Some(r.contact.t_gamma_mean_n));
    add("unsolved_share", &|r| Some(r.contact.unsolved_share));
    RowTable { columns }
}

fn points_table(evolution: &EvolutionAnswer) -> RowTable {
    let (mut record, mut body, mut point) = (Vec::new(), Vec::new(), Vec::new());
    let mut values: [Vec<f64>; 5] = Default::default();
    for (number, one) in evolution.records.iter().enumerate() {
        for (name, worn) in BODIES.map(|(name, body)| (name, body(one))) {
            for (k, [y, z]) in worn.points_mm.iter().enumerate() {
                record.push(number as i64);
                body.push(Some(name.to_owned()));
                point.push(k as i64);
                let row = [one.progress.share, *y, *z, worn.depth_mm[k], worn.damage[k]];
                (0..5).for_each(|k| values[k].push(row[k]));
            }
        }
    }
    let first = [
        TableColumn::Integers(record),
        TableColumn::Texts(body),
        TableColumn::Integers(point),
    ];
    let names = [
        "record", "body", "point", "share", "y_mm", "z_mm", "depth_mm", "damage",
    ];
    let columns = first.into_iter().chain(values.map(TableColumn::Numbers));
    RowTable {
        columns: names.map(str::to_owned).into_iter().zip(columns).collect(),
    }
}

/// Returns a line per point; y is multiplied by `sense`.
fn lines(points: &[[f64; 2]], sense: f64, between: char) -> String {
    let line = |[y, z]: &[f64; 2]| format!("{:.6}{between}{z:.6}\n", 0.0 + sense * y);
    points.iter().map(line).collect()
}

/// Writes a MiniProf file, whose X points to the track centre.
fn miniprof(points: &[[f64; 2]], _: bool) -> String {
    let (count, lines) = (points.len(), lines(points, -1.0, '\t'));
    format!("ProgramName=railhead\nXYPoints={count}\nColumnDef=X,Y\n\n{lines}")
}

fn simpack(points: &[[f64; 2]], wheel: bool) -> String {
    let (kind, lines) = (u8::from(wheel), lines(points, 1.0, ' '));
    format!(
        "header.begin\n  version = 1\n  type = {kind}\nheader.end\nspline.begin\n  type = 0\n  units.len.f = 1000\n  point.begin\n{lines}  point.end\nspline.end\n"
    )
}
