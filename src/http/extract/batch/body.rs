//! Reads the body of a batch: cut into cases while it arrives, checked portion by portion.

use axum::body::Body;
use axum::extract::Request;
use axum::http::HeaderMap;
use serde_json::Value;

use crate::contact::error::Fault;
use crate::http::extract::arriving::Arriving;
use crate::http::extract::batch::own_options;
use crate::http::extract::batch::splitter::{Element, Layout, Splitter};
use crate::http::extract::batch::table::TableBody;
use crate::http::extract::json::{essence, read_strict, weigh_case};
use crate::http::extract::multipart::{Template, template_missing};
use crate::http::limits::memory::{Memory, SMALL_BYTES};
use crate::http::limits::shares::Share;
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
    /// A JSON array of cases.
    Array,
    /// One case per line.
    Lines,
    /// A table that fills a template.
    Table(Box<TableBody>, Value),
}

impl Form {
    fn layout(&self) -> Layout {
        match self {
            Form::Array => Layout::Array,
            Form::Lines => Layout::Lines,
            Form::Table(..) => Layout::Rows,
        }
    }
}

/// The form that a body is declared to have.
///
/// # Errors
/// The content type is none of a batch, or the template of a table is missing, unknown or not wanted.
pub async fn form(
    jobs: &Jobs,
    headers: &HeaderMap,
    template: Option<Template>,
) -> Result<(Form, Option<Share>), ApiError> {
    let essence = essence(headers);
    if template.is_some() && essence != "text/csv" {
        return Err(ApiError::bad_parameter(
            "template",
            "`template` belongs to a table; send it with `Content-Type: text/csv`",
        ));
    }
    match (essence.as_str(), template) {
        ("application/json", _) => Ok((Form::Array, None)),
        ("application/x-ndjson" | "application/ndjson" | "application/jsonl", _) => {
            Ok((Form::Lines, None))
        }
        ("text/csv", Some(template)) => {
            let (case, share) = template.case(jobs).await?;
            let case = jobs.with_profiles(case).await?;
            Ok((Form::Table(Box::default(), case), share))
        }
        ("text/csv", None) => Err(template_missing()),
        (other, _) => Err(ApiError::new(
            ProblemKind::UnsupportedMediaType,
            format!(
                "the content type is `{other}`; send an array with `application/json`, one case per line with `application/x-ndjson`, a table with `text/csv`, or a template and a table with `multipart/form-data`"
            ),
        )),
    }
}

/// Reads and checks the body as it arrives.
///
/// # Errors
/// The body is too large, too slow, broken, or not of its form; faults of single cases are kept in the draft.
pub async fn read_draft(
    jobs: &Jobs,
    memory: &Memory,
    options: &HttpOptions,
    mut form: Form,
    request: Request<Body>,
) -> Result<BatchUpload, ApiError> {
    let mut arriving = Arriving::new(
        options.body_timeout,
        options.batch_max_bytes,
        "one batch",
        request,
    )?;
    let mut draft = jobs.draft(Kind::Cases)?;
    if let Form::Table(_, template) = &mut form {
        draft.set_row_template(template.take());
    }
    let mut splitter = Splitter::new(form.layout(), options.body_max_bytes);
    let mut portion = Vec::new();
    let mut held = 0;
    let mut share = None;
    let mut checking = Checking {
        computation: memory.computation(jobs.tenant()),
        parsed_max_bytes: options.parsed_max_bytes,
    };
    while let Some(piece) = arriving.next().await? {
        held += piece.len();
        // Most cases are small; a large one is held until its end has come.
        if share.is_none() && splitter.held() + piece.len() > SMALL_BYTES.max(PORTION_BYTES) {
            share = memory.body(jobs.tenant(), options.body_max_bytes).await?;
        }
        splitter.feed(&piece, &mut portion)?;
        if held >= PORTION_BYTES {
            held = 0;
            (draft, form) = checking
                .check(draft, form, std::mem::take(&mut portion))
                .await?;
            require_count(&draft, options)?;
        }
    }
    splitter.end(&mut portion)?;
    (draft, _) = checking.check(draft, form, portion).await?;
    drop(share);
    require_count(&draft, options)?;
    Ok(draft)
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
        mut form: Form,
        portion: Vec<Element>,
    ) -> Result<(BatchUpload, Form), ApiError> {
        if portion.is_empty() {
            return Ok((draft, form));
        }
        let max_bytes = self.parsed_max_bytes;
        let checked = self.computation.run(move |pace| {
            for element in portion {
                pace.step()?;
                add(&mut draft, &mut form, &element, max_bytes)?;
            }
            Ok((draft, form))
        });
        checked.await
    }
}

/// Adds one case to a draft, with its faults if it has any.
fn add(
    draft: &mut BatchUpload,
    form: &mut Form,
    element: &Element,
    parsed_max_bytes: usize,
) -> Result<(), ApiError> {
    weigh_case(&element.text, parsed_max_bytes)?;
    match form {
        Form::Array => {
            let case = read_strict(&element.text)
                .map_err(|error| ApiError::malformed_element(draft.cases, &error))?;
            draft.add(element.line, &element.text, own_options::read(case))?;
        }
        Form::Lines => {
            let case = read_strict(&element.text)
                .map_err(|error| vec![Fault::new("", format!("the line is not JSON: {error}"))])
                .and_then(own_options::read);
            draft.add(element.line, &element.text, case)?;
        }
        Form::Table(table, _) => {
            if let Some(row) = table.take(&element.text)? {
                let row = row.map_err(|detail| vec![Fault::new("", detail)]);
                draft.add_row(element.line, &element.text, row)?;
            }
        }
    }
    Ok(())
}
