//! Reads the body of a batch: cut into cases while it arrives, checked portion by portion.

use std::time::Duration;

use axum::body::{Body, BodyDataStream, Bytes};
use axum::extract::Request;
use axum::http::{HeaderMap, header};
use futures_util::StreamExt;
use tokio::time::{Instant, timeout_at};
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use crate::contact::error::Fault;
use crate::http::extract::batch::own_options;
use crate::http::extract::batch::splitter::{Element, Layout, Splitter};
use crate::http::extract::batch::table::TableBody;
use crate::http::extract::json::{essence, read_json, read_strict, unreadable, weigh_case};
use crate::http::layers::admission::{PackedLength, too_long};
use crate::http::limits::memory::{Memory, SMALL_BYTES};
use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::jobs::Jobs;
use crate::jobs::batch::upload::BatchUpload;

/// Bytes per second of a batch at least, on average and after a head start of the time that a piece may take: otherwise
/// one byte at a time could keep a connection and a file open for ever.
const LOWEST_RATE: f64 = 1024.0;
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
    Table(Box<TableBody>),
}

impl Form {
    fn layout(&self) -> Layout {
        match self {
            Form::Array => Layout::Array,
            Form::Lines => Layout::Lines,
            Form::Table(_) => Layout::Rows,
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
    template: Option<Uuid>,
) -> Result<Form, ApiError> {
    let essence = essence(headers);
    if template.is_some() && essence != "text/csv" {
        return Err(ApiError::bad_parameter(
            "template",
            "`template` belongs to a table; send it with `Content-Type: text/csv`",
        ));
    }
    match (essence.as_str(), template) {
        ("application/json", _) => Ok(Form::Array),
        ("application/x-ndjson" | "application/ndjson" | "application/jsonl", _) => Ok(Form::Lines),
        ("text/csv", Some(job)) => {
            let case = jobs.case(job).await;
            let case = case.map_err(|error| ApiError::from(error).about("template"))?;
            let case = read_json(&case)?;
            Ok(Form::Table(Box::new(TableBody::new(case))))
        }
        ("text/csv", None) => Err(ApiError::bad_parameter(
            "template",
            "a table needs `?template=` with the id of a job; its case is what the columns are filled into",
        )),
        (other, _) => Err(ApiError::new(
            ProblemKind::UnsupportedMediaType,
            format!(
                "the content type is `{other}`; send an array with `application/json`, one case per line with `application/x-ndjson`, or a table with `text/csv`"
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
    let mut arriving = Arriving::new(options, request)?;
    let mut draft = jobs.draft()?;
    if let Form::Table(table) = &form {
        draft.set_template(table.text());
    }
    let mut splitter = Splitter::new(form.layout(), options.body_max_bytes);
    let mut portion = Vec::new();
    let mut held = 0;
    let mut share = None;
    let checking = Checking {
        memory,
        parsed_max_bytes: options.parsed_max_bytes,
        gone: CancellationToken::new(),
    };
    // Dropped with this request when its client goes away.
    let _gone = checking.gone.clone().drop_guard();
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

/// A body on its way, held to its limits of size and time.
struct Arriving<'a> {
    options: &'a HttpOptions,
    pieces: BodyDataStream,
    packed: Option<PackedLength>,
    total: u64,
    begun: Instant,
}

impl Arriving<'_> {
    /// # Errors
    /// The body says itself that it is too large.
    fn new(options: &HttpOptions, request: Request<Body>) -> Result<Arriving<'_>, ApiError> {
        let declared = request.headers().get(header::CONTENT_LENGTH);
        let declared = declared.and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
        let packed = request.extensions().get::<PackedLength>().cloned();
        let arriving = Arriving {
            options,
            pieces: request.into_body().into_data_stream(),
            packed,
            total: 0,
            begun: Instant::now(),
        };
        if declared.is_some_and(|length| length > options.batch_max_bytes) {
            return Err(arriving.too_large());
        }
        Ok(arriving)
    }

    /// The next piece, or nothing at the end.
    async fn next(&mut self) -> Result<Option<Bytes>, ApiError> {
        let options = self.options;
        #[expect(clippy::cast_precision_loss, reason = "far fewer bytes than 2^53")]
        let owed = Duration::from_secs_f64(self.total as f64 / LOWEST_RATE);
        let latest = self.begun + options.body_timeout + owed;
        let piece = timeout_at(
            latest.min(Instant::now() + options.body_timeout),
            self.pieces.next(),
        );
        let piece = piece.await.map_err(|_| {
            ApiError::new(
                ProblemKind::BodyTimeout,
                format!(
                    "nothing of the body arrived for {} s, or all of it at less than {LOWEST_RATE} bytes per second",
                    options.body_timeout.as_secs_f64()
                ),
            )
        })?;
        let Some(piece) = piece else { return Ok(None) };
        let piece = piece.map_err(|error| {
            if too_long(&error) {
                self.too_large()
            } else {
                unreadable(&error)
            }
        })?;
        self.total += piece.len() as u64;
        if self.total > options.batch_max_bytes {
            return Err(self.too_large());
        }
        let packed = self.packed.as_ref();
        if packed.is_some_and(|packed| packed.is_bomb(self.total)) {
            return Err(PackedLength::refusal());
        }
        Ok(Some(piece))
    }

    fn too_large(&self) -> ApiError {
        ApiError::new(
            ProblemKind::BodyTooLarge,
            format!(
                "the body is larger than the {} bytes that are allowed for one batch",
                self.options.batch_max_bytes
            ),
        )
    }
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

/// What it takes to check cases off the threads that answer requests.
struct Checking<'a> {
    memory: &'a Memory,
    parsed_max_bytes: usize,
    /// Nobody waits for the answer any more.
    gone: CancellationToken,
}

impl Checking<'_> {
    /// Checks some cases, in their turn.
    async fn check(
        &self,
        mut draft: BatchUpload,
        mut form: Form,
        portion: Vec<Element>,
    ) -> Result<(BatchUpload, Form), ApiError> {
        if portion.is_empty() {
            return Ok((draft, form));
        }
        let turn = self.memory.turn(usize::MAX).await?;
        let (gone, max_bytes) = (self.gone.clone(), self.parsed_max_bytes);
        let checked = tokio::task::spawn_blocking(move || {
            let _turn = turn;
            for element in portion {
                if gone.is_cancelled() {
                    return Err(ApiError::internal(&"the client has gone"));
                }
                add(&mut draft, &mut form, &element, max_bytes)?;
            }
            Ok((draft, form))
        });
        checked.await.map_err(|error| ApiError::internal(&error))?
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
        Form::Table(table) => {
            if let Some(row) = table.take(&element.text)? {
                let row = row.map_err(|detail| vec![Fault::new("", detail)]);
                draft.add_row(element.line, &element.text, row)?;
            }
        }
    }
    Ok(())
}
