//! Reads the bodies of runs and evaluations: a template with columns in JSON, or with a table.
use std::collections::HashSet;
use std::fmt;
use std::fs::File;
use std::io::{Seek, SeekFrom};
use std::time::Duration;

use axum::BoxError;
use axum::body::{Body, Bytes};
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, header};
use futures_util::stream;
use multer::{Field, Multipart};
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::Value;
use tokio::io::AsyncWriteExt;
use tokio::time::timeout;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::extract::json::{
    BodyReader, Strict, UnexpectedPart, essence, not_json, read_json, require_utf8, unlike_json,
    unreadable, weigh_case,
};
use crate::limits::{Memory, Pace, Permit};
use crate::options::HttpOptions;
use crate::problem::{ApiError, ProblemKind, Result, faulty};
use railhead_contact::case::words::solver::Case;
use railhead_contact::evaluate::varied::Values;
use railhead_jobs::Jobs;
use railhead_jobs::run::draft::RunDraft;
use railhead_tables::read::{TableForm, TableRows, TableSource};
use railhead_tables::table::COLUMNS_MAX;
use railhead_tables::titles::{NamedColumns, TitledColumn, require_few};

/// The bytes that a request's body may have, or has as far as it says.
#[must_use]
pub fn declared_bytes(request: &Request, options: &HttpOptions) -> usize {
    let length = request.headers().get(header::CONTENT_LENGTH);
    let length = length.and_then(|value| value.to_str().ok()?.parse().ok());
    let packed = request.headers().contains_key(header::CONTENT_ENCODING);
    length
        .filter(|_| !packed)
        .unwrap_or(options.evaluate_max_bytes)
}

/// The whole body. It may take long as long as it keeps to the lowest rate of large bodies.
///
/// # Errors
/// It is too large, too slow, or breaks off.
pub async fn read_body(request: Request, options: &HttpOptions) -> Result<Bytes> {
    let max_bytes = options.evaluate_max_bytes;
    let declared = declared_bytes(&request, options);
    let mut reader = BodyReader::new(
        options.body_timeout,
        max_bytes as u64,
        "rows (`--evaluate-max-mib`)",
        request,
    )?;
    // A body that does not say its length grows.
    let mut text = Vec::with_capacity(if declared < max_bytes { declared } else { 0 });
    while let Some(piece) = reader.next().await? {
        text.extend_from_slice(&piece);
    }
    Ok(text.into())
}

/// A template and columns of numbers or texts from JSON, `{"template": …, "columns": {"<JSON pointer>": […], …}}`; the client may have said
/// what columns are.
///
/// # Errors
/// `malformed-json` with its position, and with column and row where the fault is in a column; or as [`NamedColumns::columns`].
pub fn read_json_columns(
    text: &[u8],
    named: &NamedColumns,
) -> Result<(Value, Vec<TitledColumn>, Vec<Values>)> {
    let read: RowsBody =
        serde_json::from_slice(text).map_err(|error| not_json(unlike_json(text), &error))?;
    require_few(read.columns.count)?;
    let columns = read.columns.columns;
    let titles = columns.iter();
    let titles = titles.map(|(title, values)| (&**title, None, matches!(values, Values::Texts(_))));
    let titles = named.columns(titles)?;
    let values = columns.into_iter().map(|(_, values)| values).collect();
    Ok((read.template.0, titles, values))
}

/// The JSON body of rows.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RowsBody {
    template: Strict,
    columns: RowColumns,
}

/// Columns; of those beyond [`COLUMNS_MAX`] only the count is kept.
#[derive(Default)]
struct RowColumns {
    columns: Vec<(String, Values)>,
    count: usize,
}

impl<'de> Deserialize<'de> for RowColumns {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(RowColumnsVisitor)
    }
}

struct RowColumnsVisitor;

impl<'de> Visitor<'de> for RowColumnsVisitor {
    type Value = RowColumns;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("an object of columns, each named by a JSON pointer into the case")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<RowColumns, A::Error> {
        let (mut read, mut seen) = (RowColumns::default(), HashSet::new());
        while let Some(pointer) = members.next_key::<String>()? {
            read.count += 1;
            if read.count > COLUMNS_MAX {
                members.next_value::<IgnoredAny>()?;
                continue;
            }
            if !seen.insert(pointer.clone()) {
                return Err(A::Error::custom(format_args!(
                    "the column `{pointer}` is written twice"
                )));
            }
            let values = members.next_value_seed(RowValues(&pointer))?;
            read.columns.push((pointer, values));
        }
        Ok(read)
    }
}

/// Reads the values of a column: numbers, or texts if the first one is a text.
struct RowValues<'a>(&'a str);

impl<'de> DeserializeSeed<'de> for RowValues<'_> {
    type Value = Values;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Values, D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for RowValues<'_> {
    type Value = Values;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "an array of numbers in the column `{}`", self.0)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Values, A::Error> {
        let (mut numbers, mut texts) = (Vec::new(), Vec::new());
        loop {
            let row = numbers.len() + texts.len();
            let at = |reason: &dyn fmt::Display| {
                A::Error::custom(format_args!("column `{}`, row {row}: {reason}", self.0))
            };
            match items.next_element().map_err(|error| at(&error))? {
                Some(RowValue::Number(number)) if texts.is_empty() => numbers.push(number),
                Some(RowValue::Text(text)) if numbers.is_empty() => texts.push(Some(text)),
                Some(RowValue::Number(number)) => {
                    return Err(at(&format_args!(
                        "`{number}` is a number, row 0 has a text"
                    )));
                }
                Some(RowValue::Text(text)) => {
                    return Err(at(&format_args!("{text:?} is a text, row 0 has a number")));
                }
                None if texts.is_empty() => return Ok(Values::Numbers(numbers)),
                None => return Ok(Values::Texts(texts)),
            }
        }
    }
}

/// A value of a column.
enum RowValue {
    Number(f64),
    Text(String),
}

impl<'de> Deserialize<'de> for RowValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RowValueVisitor)
    }
}

struct RowValueVisitor;

impl Visitor<'_> for RowValueVisitor {
    type Value = RowValue;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("a number, or a text if the whole column has texts")
    }

    fn visit_f64<E>(self, value: f64) -> Result<RowValue, E> {
        Ok(RowValue::Number(value))
    }

    #[expect(clippy::cast_precision_loss, reason = "as every number of a case")]
    fn visit_i64<E>(self, value: i64) -> Result<RowValue, E> {
        Ok(RowValue::Number(value as f64))
    }

    #[expect(clippy::cast_precision_loss, reason = "as every number of a case")]
    fn visit_u64<E>(self, value: u64) -> Result<RowValue, E> {
        Ok(RowValue::Number(value as f64))
    }

    fn visit_str<E>(self, value: &str) -> Result<RowValue, E> {
        Ok(RowValue::Text(value.to_owned()))
    }
}

/// What JSON is in a request with rows; NDJSON is a table.
pub const JSON: (&str, bool) = ("`application/json` with `template` and `columns`", false);

/// The part that holds the case.
const TEMPLATE: &str = "template";
/// The part that holds the table.
const TABLE: &str = "table";

/// A table whose columns replace members of a case.
#[derive(Debug)]
pub struct Table {
    /// The format of the table.
    pub form: TableForm,
    /// The case.
    pub template: Value,
    /// The memory that the case takes, if it came with the request.
    pub share: Option<Permit>,
}

/// Separates the table of a request from its template, a part of `multipart/form-data` or the case of `job`. The request returned has the table as
/// its body. There is none in a request with JSON, which is `json` here, and with `lines` none in NDJSON without a template.
///
/// # Errors
/// The content type is none of these; a template is missing, not wanted, or given twice; the parts are not `template` and then `table`; or the
/// template is not JSON, too large, or that of a job that does not exist.
pub async fn separate_table(
    (jobs, memory, options): (&Jobs, &Memory, &HttpOptions),
    job: Option<Uuid>,
    (json, lines): (&str, bool),
    request: Request,
) -> Result<(Request, Option<Table>)> {
    let (request, part) = match essence(request.headers()) == "multipart/form-data" {
        true if job.is_some() => {
            return Err(ApiError::bad_parameter(
                TEMPLATE,
                "the template is a part of the body; leave `?template=` out",
            ));
        }
        true => separate_parts(jobs, memory, options, request).await?,
        false => (request, None),
    };
    require_utf8(request.headers())?;
    let alone = part.is_none() && job.is_none();
    let essence = essence(request.headers());
    let form = match TableForm::of(&essence) {
        Some(TableForm::Ndjson) if alone && lines => return Ok((request, None)),
        Some(form) => form,
        None if essence != "application/json" => return Err(unsupported(&essence, json)),
        None if alone => return Ok((request, None)),
        None => {
            return Err(ApiError::bad_parameter(
                TEMPLATE,
                "`template` belongs to a table, such as `text/csv`; leave it out with JSON",
            ));
        }
    };
    let (template, share) = match (part, job) {
        (Some(part), _) => part,
        (None, Some(job)) => {
            let case = jobs.case(job).await;
            let case = case.map_err(|error| ApiError::from(error).about(TEMPLATE))?;
            (read_json(&case)?, None)
        }
        (None, None) => {
            return Err(ApiError::bad_parameter(
                TEMPLATE,
                "a table needs a template, the case whose members its columns replace: send both as `multipart/form-data` with the parts `template` \
                 (JSON) and `table`, or name a job with `?template=`",
            ));
        }
    };
    let table = Table {
        form,
        template,
        share,
    };
    Ok((request, Some(table)))
}

/// A case and the memory that it takes.
type Held = (Value, Option<Permit>);

/// The template of `multipart/form-data`, and a request whose body is the table, with the content type of its part.
async fn separate_parts(
    jobs: &Jobs,
    memory: &Memory,
    options: &HttpOptions,
    request: Request,
) -> Result<(Request, Option<Held>)> {
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
    require_utf8(template.headers())?;
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
    let template = (read_json(&text)?, share);
    let table = next_part(&mut parts, options, TABLE).await?;
    head.headers
        .insert(header::CONTENT_TYPE, content_type_of(&table));
    let table = stream::try_unfold((parts, Some(table)), last_part);
    let request = Request::from_parts(head, Body::from_stream(table));
    Ok((request, Some(template)))
}

/// The parts that are still to come, and the last one that is allowed.
type LastPart = (Multipart<'static>, Option<Field<'static>>);

/// The next piece of the last part. At its end no other part may follow.
async fn last_part((mut parts, mut part): LastPart) -> Result<Option<(Bytes, LastPart)>, BoxError> {
    if let Some(field) = &mut part
        && let Some(piece) = field.chunk().await?
    {
        return Ok(Some((piece, (parts, part))));
    }
    // The next part can be read once this one is gone.
    drop(part);
    match parts.next_field().await? {
        Some(other) => Err(UnexpectedPart(other.name().unwrap_or_default().to_owned()).into()),
        None => Ok(None),
    }
}

/// The next part, which must have this name.
async fn next_part(
    parts: &mut Multipart<'static>,
    options: &HttpOptions,
    name: &str,
) -> Result<Field<'static>> {
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
    /// The table; its content type, or else the extension of its file name, gives its format.
    #[schema(content_media_type = "application/octet-stream")]
    table: String,
}

/// Memory that a table takes while a piece of it is read.
const PIECE_BYTES: usize = 64 << 20;

/// Reads the rows into a draft: of a table, or of JSON, which has a template of its own.
///
/// # Errors
/// The body is too large, too slow, broken or not of its form; or what the draft says of its rows.
pub async fn read_run(
    (jobs, memory, options): (&Jobs, &Memory, &HttpOptions),
    (table, named): (Option<Table>, NamedColumns),
    request: Request<Body>,
) -> Result<RunDraft> {
    let (rows_max, bytes_max) = (options.run_max_rows, options.evaluate_max_bytes);
    let drafts = jobs.clone();
    let Some(table) = table else {
        let bytes = 2 * declared_bytes(&request, options).min(bytes_max);
        let share = memory.rows(jobs.tenant(), bytes).await?;
        let text = read_body(request, options).await?;
        let read = memory.compute(jobs.tenant(), move |_| {
            let _held = share;
            let (template, columns, values) = read_json_columns(&text, &named)?;
            drop(text);
            let mut draft = drafts.draft_run(template, columns, rows_max)?;
            draft.push(values)?;
            draft.cut_all()?;
            Ok(draft)
        });
        return read.await;
    };
    let limits = (options.body_timeout, options.run_max_bytes, "one run");
    // An archive is read as a whole, once packed and once as numbers.
    let bytes = match table.form {
        TableForm::Npz => 2 * bytes_max,
        _ => PIECE_BYTES,
    };
    let bytes = move |_| bytes;
    read_spooled((jobs, memory), limits, bytes, request, move |file, pace| {
        let _held = table.share;
        let rows = TableRows::new(table.form, TableSource::File(file), bytes_max)?;
        let mut draft = drafts.draft_run(table.template, rows.named(&named)?, rows_max)?;
        for chunk in rows {
            pace.step()?;
            draft.push(chunk?)?;
        }
        draft.cut_all()?;
        Ok(draft)
    })
    .await
}

/// Reads a body from a nameless file into which it is spooled while it arrives, so that a large one takes little memory. `limits` are the time
/// allowed for a piece of the body, its largest size, and its name in errors; `bytes` returns the memory in bytes that the reader needs for a body of a given length.
///
/// # Errors
/// The body is too large, too slow or broken; the file cannot be written; or the error of `read`.
pub async fn read_spooled<T: Send + 'static>(
    (jobs, memory): (&Jobs, &Memory),
    (timeout, most, what): (Duration, u64, &'static str),
    bytes: impl FnOnce(usize) -> usize,
    request: Request<Body>,
    read: impl FnOnce(File, &mut Pace) -> Result<T> + Send + 'static,
) -> Result<T> {
    let mut reader = BodyReader::new(timeout, most, what, request)?;
    let file = jobs.spool_file()?;
    let mut file = tokio::fs::File::from_std(file);
    let mut length = 0;
    while let Some(piece) = reader.next().await? {
        length += piece.len();
        let written = file.write_all(&piece).await;
        written.map_err(|source| ApiError::from(jobs.spool_failed(source)))?;
    }
    // Tells whether the last piece was written too.
    let written = file.flush().await;
    let mut file = file.into_std().await;
    let ready = written.and_then(|()| file.seek(SeekFrom::Start(0)));
    ready.map_err(|source| ApiError::from(jobs.spool_failed(source)))?;
    let share = memory.rows(jobs.tenant(), bytes(length)).await?;
    let read = memory.compute(jobs.tenant(), move |pace| {
        let _held = share;
        read(file, pace)
    });
    read.await
}

/// The fault of a body that is neither JSON nor a table.
pub(crate) fn unsupported(essence: &str, json: &str) -> ApiError {
    ApiError::new(
        ProblemKind::UnsupportedMediaType,
        format!(
            "the content type is `{essence}`; send {json}, or {}",
            TableForm::ALLOWED
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_name_row_and_column() {
        let text = |error: ApiError| format!("{error:?}");
        let null = br#"{"template":{},"columns":{"/motion/creepage_x":[0.1,null]}}"#;
        let fault = text(read_json_columns(null, &NamedColumns::default()).unwrap_err());
        assert!(
            fault.contains("/motion/creepage_x") && fault.contains("row 1"),
            "{fault}"
        );
    }
}
