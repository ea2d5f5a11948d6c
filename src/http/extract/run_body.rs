//! The body of `POST /v1/runs`: its form, its template, and its rows into a draft.

use std::fs::File;
use std::io::{Seek, SeekFrom, Write};

use axum::body::Body;
use axum::extract::Request;
use axum::http::HeaderMap;

use crate::contact::evaluate::varied::Values;
use crate::http::extract::body_reader::BodyReader;
use crate::http::extract::json::essence;
use crate::http::extract::multipart::{Template, template_missing};
use crate::http::extract::rows::{declared_bytes, read_body, read_json_columns};
use crate::http::extract::tables::{TableForm, TableRows, TableSource, unsupported};
use crate::http::extract::titles::NamedColumns;
use crate::http::limits::memory::Memory;
use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::jobs::Jobs;
use crate::jobs::run::draft::RunDraft;

/// Memory that a table takes while a piece of it is read.
const PIECE_BYTES: usize = 64 << 20;

/// A table with its template; nothing for JSON with `template` and `columns`.
///
/// # Errors
/// The content type is none of these, or the template is missing or not wanted.
pub fn form(
    headers: &HeaderMap,
    template: Option<Template>,
) -> Result<Option<(TableForm, Template)>, ApiError> {
    let essence = essence(headers);
    match (TableForm::of(&essence), template) {
        (Some(form), Some(template)) => Ok(Some((form, template))),
        (Some(_), None) => Err(template_missing()),
        (None, _) if essence != "application/json" => Err(unsupported(
            &essence,
            "`application/json` with `template` and `columns`",
        )),
        (None, None) => Ok(None),
        (None, Some(_)) => Err(ApiError::bad_parameter(
            "template",
            "`template` belongs to a table; JSON has a `template` of its own",
        )),
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
    (table, named): (Option<(TableForm, Template)>, NamedColumns),
    request: Request<Body>,
) -> Result<RunDraft, ApiError> {
    let rows_max = options.run_max_rows;
    let jobs = jobs.clone();
    let Some((form, template)) = table else {
        return from_json(jobs, memory, options, named, request).await;
    };
    let (template, template_share) = template.case(&jobs).await?;
    let (timeout, most) = (options.body_timeout, options.run_max_bytes);
    let reader = BodyReader::new(timeout, most, "one run", request)?;
    let file = spool(&jobs, reader).await?;
    let bytes_max = options.evaluate_max_bytes;
    // An archive is read as a whole, once packed and once as numbers.
    let bytes = match form {
        TableForm::Npz => 2 * bytes_max,
        _ => PIECE_BYTES,
    };
    let share = memory.rows(jobs.tenant(), bytes).await?;
    let mut computation = memory.computation(jobs.tenant());
    let read = computation.run(move |pace| {
        let _held = (share, template_share);
        let rows = TableRows::new(form, TableSource::File(file), bytes_max)?;
        let mut draft = jobs.draft_run(template, rows.named(&named)?, rows_max)?;
        for chunk in rows {
            pace.step()?;
            draft.push(chunk?)?;
        }
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

/// A body in a nameless file, which is at its beginning.
///
/// # Errors
/// The body is too large, too slow or broken, or the file cannot be written.
pub async fn spool(jobs: &Jobs, mut reader: BodyReader) -> Result<File, ApiError> {
    let file = jobs.spool_file()?;
    let mut file = tokio::fs::File::from_std(file);
    while let Some(piece) = reader.next().await? {
        let written = tokio::io::AsyncWriteExt::write_all(&mut file, &piece).await;
        written.map_err(|source| ApiError::from(jobs.spool_failed(source)))?;
    }
    let mut file = file.into_std().await;
    let ready = file.flush().and_then(|()| file.seek(SeekFrom::Start(0)));
    ready.map_err(|source| ApiError::from(jobs.spool_failed(source)))?;
    Ok(file)
}
