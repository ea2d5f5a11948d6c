//! `multipart/form-data` (RFC 7578): a table together with the case that its rows vary.

use axum::body::Body;
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, header};
use multer::{Field, Multipart};
use serde_json::Value;
use tokio::time::timeout;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::contact::case::words::solver::Case;
use crate::http::extract::body_reader::{BodyReader, unreadable};
use crate::http::extract::json::{essence, read_json, weigh_case};
use crate::http::extract::titles::faulty;
use crate::http::limits::memory::Memory;
use crate::http::limits::tenant_semaphore::Permit;
use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::jobs::Jobs;

/// The part that holds the case.
const TEMPLATE: &str = "template";
/// The part that holds the table.
const TABLE: &str = "table";

/// The case whose members the columns of a table replace.
#[derive(Debug)]
pub enum Template {
    /// The case of a job.
    Job(Uuid),
    /// A case of this request, with the memory that it takes.
    Case(Value, Option<Permit>),
}

impl Template {
    /// The case, and the memory that it takes.
    ///
    /// # Errors
    /// The job does not exist or has expired.
    pub async fn case(self, jobs: &Jobs) -> Result<(Value, Option<Permit>), ApiError> {
        match self {
            Template::Case(case, share) => Ok((case, share)),
            Template::Job(id) => {
                let case = jobs.case(id).await;
                let case = case.map_err(|error| ApiError::from(error).about(TEMPLATE))?;
                Ok((read_json(&case)?, None))
            }
        }
    }
}

/// The fault of a table without a template.
pub fn template_missing() -> ApiError {
    ApiError::bad_parameter(
        TEMPLATE,
        "a table needs a template, the case whose members its columns replace: send both as `multipart/form-data` with the parts `template` (JSON) and \
         `table`, or name a job with `?template=`",
    )
}

/// Separates the template from the table, if the request is `multipart/form-data`. The request returned has the table as its body, with the content
/// type of its part; other requests are returned as they are. `job` is the job that the query names as template.
///
/// # Errors
/// The parts are not `template` and then `table`, the template is not JSON or too large, or the query names a template as well.
pub async fn separate_template(
    jobs: &Jobs,
    memory: &Memory,
    options: &HttpOptions,
    job: Option<Uuid>,
    request: Request,
) -> Result<(Request, Option<Template>), ApiError> {
    if essence(request.headers()) != "multipart/form-data" {
        return Ok((request, job.map(Template::Job)));
    }
    if job.is_some() {
        return Err(ApiError::bad_parameter(
            TEMPLATE,
            "the template is a part of the body; leave `?template=` out",
        ));
    }
    let content_type = request.headers().get(header::CONTENT_TYPE);
    let content_type = content_type.and_then(|value| value.to_str().ok());
    let boundary = multer::parse_boundary(content_type.unwrap_or_default()).map_err(|error| {
        ApiError::new(
            ProblemKind::UnsupportedMediaType,
            format!("`multipart/form-data` without a readable `boundary`: {error}"),
        )
    })?;
    let (mut head, body) = request.into_parts();
    head.headers.remove(header::CONTENT_LENGTH);
    let mut parts = Multipart::new(body.into_data_stream(), boundary);
    let template = next_part(&mut parts, options, TEMPLATE).await?;
    let mut reader = BodyReader::new(
        options.body_timeout,
        options.body_max_bytes as u64,
        "one case",
        Request::new(Body::from_stream(template)),
    )?;
    let mut text = Vec::new();
    while let Some(piece) = reader.next().await? {
        text.extend_from_slice(&piece);
    }
    // The next part can be read once this one is gone.
    drop(reader);
    let weight = weigh_case(&text, options.parsed_max_bytes)?;
    let share = memory.parsed(jobs.tenant(), weight).await?;
    let template = Template::Case(read_json(&text)?, share);
    let table = next_part(&mut parts, options, TABLE).await?;
    head.headers
        .insert(header::CONTENT_TYPE, content_type_of(&table));
    let request = Request::from_parts(head, Body::from_stream(table));
    Ok((request, Some(template)))
}

/// The next part, which must have this name.
async fn next_part(
    parts: &mut Multipart<'static>,
    options: &HttpOptions,
    name: &str,
) -> Result<Field<'static>, ApiError> {
    let part = timeout(options.body_timeout, parts.next_field()).await;
    let part = part.map_err(|_| {
        let detail = format!("the part `{name}` did not arrive in time");
        ApiError::new(ProblemKind::BodyTimeout, detail)
    })?;
    match part.map_err(|error| unreadable(&error))? {
        Some(part) if part.name() == Some(name) => Ok(part),
        other => {
            let found = other.map(|part| part.name().unwrap_or_default().to_owned());
            let found = found.map_or("nothing".to_owned(), |found| format!("`{found}`"));
            Err(faulty(format!(
                "the body has {found} where the part `{name}` is expected; send the parts `template` (the case, JSON) and `table`, in this order"
            )))
        }
    }
}

/// The content type of a part. Clients that do not know the form of a file send none or `application/octet-stream`; the extension of its name tells it.
fn content_type_of(part: &Field<'_>) -> HeaderValue {
    let mut headers = HeaderMap::new();
    if let Some(value) = part.headers().get(header::CONTENT_TYPE) {
        headers.insert(header::CONTENT_TYPE, value.clone());
    }
    let declared = essence(&headers);
    let name = part.file_name().unwrap_or_default();
    let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
    let found = match extension.to_ascii_lowercase().as_str() {
        "csv" | "tsv" | "txt" => "text/csv",
        "ndjson" | "jsonl" => "application/x-ndjson",
        "arrow" | "arrows" | "feather" | "ipc" => "application/vnd.apache.arrow.stream",
        "parquet" => "application/vnd.apache.parquet",
        "npz" => "application/x-npz",
        _ => "text/csv",
    };
    match declared.as_str() {
        "" | "application/octet-stream" | "text/plain" | "application/vnd.ms-excel" => {
            HeaderValue::from_static(found)
        }
        _ => headers
            .remove(header::CONTENT_TYPE)
            .unwrap_or(HeaderValue::from_static("text/csv")),
    }
}

/// A table with its template, as `multipart/form-data`.
#[derive(ToSchema)]
#[expect(dead_code, reason = "describes the parts in the contract")]
pub(crate) struct TableUpload {
    /// The case whose members the columns of the table replace; the first part.
    template: Case,
    /// The table; its content type, or else the extension of its file name, tells its form.
    #[schema(content_media_type = "application/octet-stream")]
    table: String,
}
