//! Reads the body of a batch: cut into cases while it arrives, checked portion by portion.

use std::fs::File;
use std::io::BufReader;

use axum::body::Body;
use axum::extract::Request;
use axum::http::HeaderMap;
use serde_json::Value;

use crate::contact::error::Fault;
use crate::http::extract::batch::own_options;
use crate::http::extract::batch::splitter::{Element, Layout, Splitter};
use crate::http::extract::batch::table::{columns_of, row_of, rows_of};
use crate::http::extract::body_reader::BodyReader;
use crate::http::extract::json::{essence, read_strict, weigh_case};
use crate::http::extract::multipart::{Template, template_missing};
use crate::http::extract::run_body::spool;
use crate::http::extract::tables::{CsvRows, TableForm, TableRows, TableSource, unsupported};
use crate::http::limits::memory::{Memory, SMALL_BYTES};
use crate::http::limits::tenant_semaphore::Permit;
use crate::http::limits::turns::Computation;
use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::jobs::Jobs;
use crate::jobs::batch::upload::BatchUpload;
use crate::jobs::model::kind::Kind;

/// Cases are checked in portions of about this many bytes.
const PORTION_BYTES: usize = 256 << 10;

/// The form of a body.
#[derive(Debug)]
pub enum Form {
    /// Cases one after the other, checked while they arrive.
    Cases(Layout),
    /// A table that fills a template.
    Rows(TableForm, Value),
}

/// The form that a body is declared to have.
///
/// # Errors
/// The content type is none of a batch, or the template of a table is missing, unknown or not wanted.
pub async fn form(
    jobs: &Jobs,
    headers: &HeaderMap,
    template: Option<Template>,
) -> Result<(Form, Option<Permit>), ApiError> {
    let essence = essence(headers);
    let table = TableForm::of(&essence);
    let (form, template) = match (table, template) {
        (Some(form), Some(template)) => (form, template),
        (table, template) => {
            return match (essence.as_str(), table, template) {
                ("application/json", _, None) => Ok((Form::Cases(Layout::Array), None)),
                (_, Some(TableForm::Ndjson), None) => Ok((Form::Cases(Layout::Lines), None)),
                (_, Some(_), None) => Err(template_missing()),
                ("application/json", _, Some(_)) => Err(ApiError::bad_parameter(
                    "template",
                    "`template` belongs to a table, such as `text/csv`; an array has whole cases",
                )),
                _ => Err(unsupported(
                    &essence,
                    "an array with `application/json`, one case per line with `application/x-ndjson`",
                )),
            };
        }
    };
    let (case, share) = template.case(jobs).await?;
    let case = jobs.with_profiles(case).await?;
    Ok((Form::Rows(form, case), share))
}

/// Reads and checks the body as it arrives.
///
/// # Errors
/// The body is too large, too slow, broken, or not of its form; faults of single cases are kept in the draft.
pub async fn read_draft(
    jobs: &Jobs,
    memory: &Memory,
    options: &HttpOptions,
    form: Form,
    request: Request<Body>,
) -> Result<BatchUpload, ApiError> {
    let mut reader = BodyReader::new(
        options.body_timeout,
        options.batch_max_bytes,
        "one batch",
        request,
    )?;
    let mut draft = jobs.draft(Kind::Cases)?;
    let layout = match form {
        Form::Cases(layout) => layout,
        Form::Rows(form, template) => {
            draft.set_row_template(template);
            let file = spool(jobs, reader).await?;
            return read_rows((jobs, memory, options), draft, form, file).await;
        }
    };
    let mut splitter = Splitter::new(layout, options.body_max_bytes);
    let mut portion = Vec::new();
    let mut held = 0;
    let mut share = None;
    let mut checking = Checking {
        computation: memory.computation(jobs.tenant()),
        parsed_max_bytes: options.parsed_max_bytes,
    };
    while let Some(piece) = reader.next().await? {
        held += piece.len();
        // Most cases are small; a large one is held until its end has come.
        if share.is_none() && splitter.held() + piece.len() > SMALL_BYTES.max(PORTION_BYTES) {
            share = memory.body(jobs.tenant(), options.body_max_bytes).await?;
        }
        splitter.feed(&piece, &mut portion)?;
        if held >= PORTION_BYTES {
            held = 0;
            draft = checking
                .check(draft, layout, std::mem::take(&mut portion))
                .await?;
            require_count(&draft, options)?;
        }
    }
    splitter.end(&mut portion)?;
    draft = checking.check(draft, layout, portion).await?;
    drop(share);
    require_count(&draft, options)?;
    Ok(draft)
}

/// Adds the rows of a table that has arrived.
async fn read_rows(
    (jobs, memory, options): (&Jobs, &Memory, &HttpOptions),
    mut draft: BatchUpload,
    form: TableForm,
    file: File,
) -> Result<BatchUpload, ApiError> {
    // An archive is read as a whole, once packed and once as numbers.
    let bytes = match form {
        TableForm::Csv => options.body_max_bytes,
        _ => 2 * options.evaluate_max_bytes,
    };
    let share = memory.rows(jobs.tenant(), bytes).await?;
    let mut computation = memory.computation(jobs.tenant());
    let options = options.clone();
    let read = computation.run(move |pace| {
        let _held = share;
        let told = |detail| vec![Fault::new("", detail)];
        if form == TableForm::Csv {
            let mut rows = CsvRows::new(BufReader::new(file), options.body_max_bytes)?;
            let columns = columns_of(&rows.titles)?;
            while let Some((line, record)) = rows.record()? {
                pace.step()?;
                let row = row_of(&columns, rows.decimal_comma, &record).map_err(told);
                draft.add_row(Some(line), record.as_slice().as_bytes(), row)?;
                require_count(&draft, &options)?;
            }
            return Ok(draft);
        }
        let source = TableSource::File(file);
        let rows = TableRows::new(form, source, options.evaluate_max_bytes)?;
        let columns = columns_of(&rows.titles)?;
        for chunk in rows {
            for row in rows_of(&columns, &chunk?) {
                pace.step()?;
                draft.add_row(None, b"", row.map_err(told))?;
                require_count(&draft, &options)?;
            }
        }
        Ok(draft)
    });
    read.await
}

fn require_count(draft: &BatchUpload, options: &HttpOptions) -> Result<(), ApiError> {
    if draft.cases <= options.batch_max_cases {
        return Ok(());
    }
    Err(ApiError::new(
        ProblemKind::BodyTooLarge,
        format!(
            "the batch has more than the {} cases that are allowed",
            options.batch_max_cases
        ),
    ))
}

/// Checks cases off the threads that answer requests.
struct Checking {
    computation: Computation,
    parsed_max_bytes: usize,
}

impl Checking {
    /// Checks some cases, in turns.
    async fn check(
        &mut self,
        mut draft: BatchUpload,
        layout: Layout,
        portion: Vec<Element>,
    ) -> Result<BatchUpload, ApiError> {
        if portion.is_empty() {
            return Ok(draft);
        }
        let max_bytes = self.parsed_max_bytes;
        let checked = self.computation.run(move |pace| {
            for element in portion {
                pace.step()?;
                add(&mut draft, layout, &element, max_bytes)?;
            }
            Ok(draft)
        });
        checked.await
    }
}

/// Adds one case to a draft, with its faults if it has any.
fn add(
    draft: &mut BatchUpload,
    layout: Layout,
    element: &Element,
    parsed_max_bytes: usize,
) -> Result<(), ApiError> {
    weigh_case(&element.text, parsed_max_bytes)?;
    match layout {
        Layout::Array => {
            let case = read_strict(&element.text)
                .map_err(|error| ApiError::malformed_element(draft.cases, &error))?;
            draft.add(element.line, &element.text, own_options::read(case))?;
        }
        Layout::Lines => {
            let case = read_strict(&element.text)
                .map_err(|error| vec![Fault::new("", format!("the line is not JSON: {error}"))])
                .and_then(own_options::read);
            draft.add(element.line, &element.text, case)?;
        }
    }
    Ok(())
}
