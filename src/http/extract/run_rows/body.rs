//! The body of `POST /v1/runs`: its form, its template, and its rows into a draft.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom, Write};

use axum::body::Body;
use axum::extract::Request;
use axum::http::HeaderMap;

use crate::contact::evaluate::varied::Values;
use crate::http::extract::arriving::Arriving;
use crate::http::extract::json::essence;
use crate::http::extract::multipart::{Template, template_missing};
use crate::http::extract::npz::{read_arrays, too_large};
use crate::http::extract::rows::{declared_bytes, read_body, read_json_columns};
use crate::http::extract::run_rows::text::{CsvRows, JsonRows};
use crate::http::extract::titles::{NamedColumns, faulty, require_few};
use crate::http::limits::memory::Memory;
use crate::http::limits::turns::Pace;
use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::jobs::codec::arrow;
use crate::jobs::codec::parquet::TableReader;
use crate::jobs::codec::table::{RowTable, TableColumn, TableKind};
use crate::jobs::run::draft::RunDraft;
use crate::jobs::run::head::RunColumn;
use crate::jobs::{Jobs, JobsError};

/// Memory that a packed table takes while a piece of it is read.
const PIECE_BYTES: usize = 64 << 20;
/// Largest group of rows of a Parquet file, unpacked.
const GROUP_BYTES_MAX: i64 = 1 << 28;

/// The forms that rows come in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowsForm {
    /// Template and columns.
    Json,
    /// A line for each row, the first names the columns.
    Csv,
    /// An object for each row.
    Ndjson,
    /// An Arrow stream or file.
    Arrow,
    /// A Parquet file.
    Parquet,
    /// NumPy's archive of arrays, held in memory as JSON is.
    Npz,
}

/// The form that the rows are declared to have. A table needs a template, JSON has its own.
///
/// # Errors
/// The content type is none of these, or the template is missing or not wanted.
pub fn form(headers: &HeaderMap, template: Option<&Template>) -> Result<RowsForm, ApiError> {
    let form = match essence(headers).as_str() {
        "application/json" => RowsForm::Json,
        "text/csv" => RowsForm::Csv,
        "application/x-ndjson" | "application/ndjson" | "application/jsonl" => RowsForm::Ndjson,
        "application/vnd.apache.arrow.stream" | "application/vnd.apache.arrow.file" => {
            RowsForm::Arrow
        }
        "application/vnd.apache.parquet" => RowsForm::Parquet,
        "application/x-npz" => RowsForm::Npz,
        other => {
            return Err(ApiError::new(
                ProblemKind::UnsupportedMediaType,
                format!(
                    "the content type is `{other}`; send `application/json` with `template` and `columns`, or a table with `text/csv`, `application/x-ndjson`, `application/vnd.apache.arrow.stream`, `application/vnd.apache.parquet` or `application/x-npz`, or a template and a table with `multipart/form-data`"
                ),
            ));
        }
    };
    match (form, template) {
        (RowsForm::Json, Some(_)) => Err(ApiError::bad_parameter(
            "template",
            "`template` belongs to a table; JSON has a `template` of its own",
        )),
        (RowsForm::Json, None) | (_, Some(_)) => Ok(form),
        (_, None) => Err(template_missing()),
    }
}

/// Reads the rows into a draft. A table is spooled into a nameless file while it arrives, so that a large one takes little memory.
///
/// # Errors
/// The body is too large, too slow, broken or not of its form; or what the draft says of its rows.
pub async fn read_run(
    jobs: &Jobs,
    memory: &Memory,
    options: &HttpOptions,
    ((form, template), named): ((RowsForm, Option<Template>), NamedColumns),
    request: Request<Body>,
) -> Result<RunDraft, ApiError> {
    let rows_max = options.run_max_rows;
    let jobs = jobs.clone();
    let Some(template) = template else {
        return from_json(jobs, memory, options, named, request).await;
    };
    let (template, template_share) = template.case(&jobs).await?;
    let file = spool(&jobs, options, request).await?;
    let bytes_max = options.evaluate_max_bytes;
    // An archive is read as a whole, once packed and once as numbers.
    let bytes = match form {
        RowsForm::Npz => 2 * bytes_max,
        _ => PIECE_BYTES,
    };
    let share = memory.rows(jobs.tenant(), bytes).await?;
    let mut computation = memory.computation(jobs.tenant());
    let read = computation.run(move |pace| {
        let _held = (share, template_share);
        let draft = |columns| jobs.draft_run(template.clone(), columns, rows_max);
        let mut draft = match form {
            RowsForm::Ndjson => {
                let mut rows = JsonRows::new(BufReader::new(file), &named)?;
                let mut draft = draft(rows.columns.clone())?;
                while let Some(values) = rows.next()? {
                    pace.step()?;
                    draft.push(values)?;
                }
                draft
            }
            RowsForm::Arrow => {
                let damaged = |error: &dyn std::fmt::Display| {
                    faulty(format!("the Arrow data cannot be read: {error}"))
                };
                let mut tables =
                    arrow::read(BufReader::new(file)).map_err(|error| damaged(&error))?;
                let tables = tables
                    .by_ref()
                    .map(|table| table.map_err(|error| damaged(&error)));
                from_tables(tables, &named, draft, pace)?
            }
            RowsForm::Parquet => from_tables(groups(file)?, &named, draft, pace)?,
            RowsForm::Npz => {
                let table = npz_table(file, bytes_max);
                from_tables(std::iter::once(table), &named, draft, pace)?
            }
            RowsForm::Csv | RowsForm::Json => {
                let mut rows = CsvRows::new(BufReader::new(file), &named)?;
                let mut draft = draft(rows.columns.clone())?;
                while let Some(values) = rows.next()? {
                    pace.step()?;
                    draft.push(values)?;
                }
                draft
            }
        };
        draft.cut_all()?;
        Ok(draft)
    });
    read.await
}

/// Rows in JSON, which has a template of its own and is held in memory.
async fn from_json(
    jobs: Jobs,
    memory: &Memory,
    options: &HttpOptions,
    named: NamedColumns,
    request: Request<Body>,
) -> Result<RunDraft, ApiError> {
    let rows_max = options.run_max_rows;
    let bytes = 2 * declared_bytes(&request, options).min(options.evaluate_max_bytes);
    let share = memory.rows(jobs.tenant(), bytes).await?;
    let text = read_body(request, options).await?;
    let mut computation = memory.computation(jobs.tenant());
    let read = computation.run(move |_| {
        let _held = share;
        let (template, columns) = read_json_columns(&text)?;
        drop(text);
        let (titles, values): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
        let kinds = titles.iter().zip(&values);
        let kinds = kinds.map(|(title, values): (&String, _)| {
            (&**title, None, matches!(values, Values::Texts(_)))
        });
        let mut draft = jobs.draft_run(template, named.columns(kinds)?, rows_max)?;
        draft.push(values)?;
        draft.cut_all()?;
        Ok(draft)
    });
    read.await
}

async fn spool(
    jobs: &Jobs,
    options: &HttpOptions,
    request: Request<Body>,
) -> Result<File, ApiError> {
    let timeout = options.body_timeout;
    let mut arriving = Arriving::new(timeout, options.run_max_bytes, "one run", request)?;
    let file = jobs.spool_file()?;
    let mut file = tokio::fs::File::from_std(file);
    while let Some(piece) = arriving.next().await? {
        let written = tokio::io::AsyncWriteExt::write_all(&mut file, &piece).await;
        written.map_err(|source| ApiError::from(jobs.spool_failed(source)))?;
    }
    let mut file = file.into_std().await;
    let ready = file.flush().and_then(|()| file.seek(SeekFrom::Start(0)));
    ready.map_err(|source| ApiError::from(jobs.spool_failed(source)))?;
    Ok(file)
}

/// The arrays of an NPZ archive, which is read as a whole.
fn npz_table(file: File, bytes_max: usize) -> Result<RowTable, ApiError> {
    let mut archive = Vec::new();
    file.take(bytes_max as u64 + 1)
        .read_to_end(&mut archive)
        .map_err(|error| faulty(format!("the NPZ archive cannot be read: {error}")))?;
    if archive.len() > bytes_max {
        return Err(too_large(bytes_max));
    }
    let arrays = read_arrays(archive.into(), bytes_max)?.into_iter();
    let columns = arrays.map(|(name, values)| (name, TableColumn::Numbers(values)));
    Ok(RowTable {
        columns: columns.collect(),
    })
}

/// The groups of rows of a Parquet file.
fn groups(file: File) -> Result<impl Iterator<Item = Result<RowTable, ApiError>>, ApiError> {
    let damaged =
        |error: &dyn std::fmt::Display| faulty(format!("the Parquet file cannot be read: {error}"));
    let reader = TableReader::new(file).map_err(|error| damaged(&error))?;
    require_few(reader.names().len())?;
    let large = (0..reader.groups()).find(|group| reader.group_size(*group).1 > GROUP_BYTES_MAX);
    if let Some(group) = large {
        return Err(faulty(format!(
            "the group of rows {group} unpacks to more than {GROUP_BYTES_MAX} bytes; write smaller groups"
        )));
    }
    Ok((0..reader.groups()).map(move |group| {
        reader
            .read(group, |_| true)
            .map_err(|error| damaged(&error))
    }))
}

/// A draft of tables that all have the columns of the first.
fn from_tables(
    tables: impl Iterator<Item = Result<RowTable, ApiError>>,
    named: &NamedColumns,
    draft: impl Fn(Vec<RunColumn>) -> Result<RunDraft, JobsError>,
    pace: &mut Pace,
) -> Result<RunDraft, ApiError> {
    let mut begun: Option<RunDraft> = None;
    for table in tables {
        pace.step()?;
        let table = table?;
        let titles = table.columns.iter();
        let titles =
            titles.map(|(name, values)| (&**name, None, values.kind() == TableKind::Texts));
        let draft = match &mut begun {
            Some(draft) => draft,
            None => begun.insert(draft(named.columns(titles)?)?),
        };
        draft.push(
            table
                .columns
                .into_iter()
                .map(|(_, values)| plain(values))
                .collect(),
        )?;
    }
    begun.ok_or_else(|| faulty("the table has no rows"))
}

fn plain(column: TableColumn) -> Values {
    match column {
        TableColumn::Numbers(numbers) => Values::Numbers(numbers),
        TableColumn::Texts(texts) => Values::Texts(texts),
        #[expect(clippy::cast_precision_loss, reason = "as every number of a case")]
        TableColumn::Integers(values) => {
            Values::Numbers(values.into_iter().map(|value| value as f64).collect())
        }
    }
}
