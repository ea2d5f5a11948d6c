//! Reads the bodies of runs and evaluations: a template and columns in JSON, or a template and a table.

use std::collections::HashSet;
use std::fmt;
use std::fs::File;
use std::io::{Seek, SeekFrom};
use std::time::Duration;

use axum::BoxError;
use axum::body::{Body, Bytes};
use axum::extract::Request;
use axum::http::{HeaderValue, header};
use futures_util::stream;
use multer::{Field, Multipart};
use serde::Deserialize;
use serde::de::{
    DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Unexpected, Visitor,
};
use serde_json::Value;
use tokio::io::AsyncWriteExt;
use tokio::time::timeout;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::extract::json::{
    BodyReader, UnexpectedPart, essence, not_json, read_json, require_utf8, unlike_json,
    unreadable, weigh_case,
};
use crate::layers::admission::declared_length;
use crate::limits::{Memory, Pace, Permit};
use crate::options::HttpOptions;
use crate::problem::{ApiError, ProblemKind, Result, faulty};
use railhead_contact::case::words::solver::Case;
use railhead_contact::evaluate::varied::Values;
use railhead_jobs::Jobs;
use railhead_jobs::batch::upload::BatchUpload;
use railhead_tables::error::TableError;
use railhead_tables::read::{TableForm, TableRows, TableSource};
use railhead_tables::strict_json::Strict;
use railhead_tables::table::{COLUMNS_MAX, Title};
use railhead_tables::titles::{NamedColumns, TitledColumn, require_few};

/// Returns the declared length of a body in bytes, or the largest allowed one.
#[must_use]
pub fn declared_bytes(request: &Request, options: &HttpOptions) -> usize {
    let most = options.evaluate_max_bytes;
    match declared_length(request.headers()) {
        Some(length) if !request.headers().contains_key(header::CONTENT_ENCODING) => {
            usize::try_from(length).unwrap_or(most)
        }
        _ => most,
    }
}

/// Reads the whole body, without a limit of its total time.
///
/// # Errors
/// The body is too large, too slow, or ends early.
pub async fn read_body(request: Request, options: &HttpOptions) -> Result<Bytes> {
    let max_bytes = options.evaluate_max_bytes;
    let declared = declared_bytes(&request, options);
    let mut reader = BodyReader::new(
        options.body_timeout,
        max_bytes as u64,
        "rows (`--evaluate-max-mib`)",
        request,
    )?;
    // The buffer of a body without a declared length grows.
    let mut text = Vec::with_capacity(if declared < max_bytes { declared } else { 0 });
    reader.read_to_end(&mut text).await?;
    Ok(text.into())
}

/// Reads a template and columns of numbers or texts from JSON, `{"template": …, "columns": {"<JSON pointer>": […], …}}`.
///
/// # Errors
/// `malformed-json` with the position, and with column and row for a fault in a column; or the error of [`NamedColumns::columns`].
pub fn read_json_columns(
    text: &[u8],
    named: &NamedColumns,
) -> Result<(Value, Vec<TitledColumn>, Vec<Values>)> {
    let read: RowsBody =
        serde_json::from_slice(text).map_err(|error| not_json(unlike_json(text), &error))?;
    require_few(read.columns.count)?;
    let (titles, values): (Vec<Title>, _) = read.columns.columns.into_iter().unzip();
    let Strict(template) = read.template;
    let columns = named.columns(&titles)?;
    Ok((template, columns, values))
}

/// A JSON body with rows.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RowsBody {
    template: Strict,
    columns: RowColumns,
}

/// Columns. Those beyond [`COLUMNS_MAX`] are only counted.
#[derive(Default)]
struct RowColumns {
    columns: Vec<(Title, Values)>,
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
            let title = Title {
                name: pointer,
                unit: None,
                text: matches!(values, Values::Texts(_)),
                text_if_copied: false,
            };
            read.columns.push((title, values));
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
                Some(Value::Number(number)) if texts.is_empty() => {
                    numbers.push(number.as_f64().unwrap_or(f64::NAN));
                }
                Some(Value::String(text)) if numbers.is_empty() => texts.push(Some(text)),
                Some(Value::Bool(value)) if numbers.is_empty() => {
                    texts.push(Some(value.to_string()));
                }
                Some(Value::Number(number)) => {
                    return Err(at(&format_args!(
                        "`{number}` is a number, row 0 has a text"
                    )));
                }
                Some(Value::String(text)) => {
                    return Err(at(&format_args!("{text:?} is a text, row 0 has a number")));
                }
                Some(other) => {
                    let found = match other {
                        Value::Null => Unexpected::Unit,
                        Value::Bool(value) => Unexpected::Bool(value),
                        Value::Array(_) => Unexpected::Seq,
                        _ => Unexpected::Map,
                    };
                    let expected =
                        &"a number, or a text or truth value if no value of the column is a number";
                    return Err(at(&A::Error::invalid_type(found, expected)));
                }
                None if texts.is_empty() => return Ok(Values::Numbers(numbers)),
                None => return Ok(Values::Texts(texts)),
            }
        }
    }
}

/// The JSON that a request with rows accepts, for errors; NDJSON is a table.
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
    /// The permit for the memory of the case, if the request contains it.
    pub share: Option<Permit>,
}

/// Separates the table of a request from its template, which is a part of `multipart/form-data` or the case of `job`. The body of the
/// returned request is the table. There is no table in a request with JSON, which `json` describes for errors. If `lines` is set, NDJSON
/// without a template is not a table either.
///
/// # Errors
/// The content type is not supported; the template is missing, not allowed, or given twice; the parts are not `template` and then `table`; the
/// template is not JSON or too large; or `job` does not exist.
pub async fn separate_table(
    (jobs, memory, options): (&Jobs, &Memory, &HttpOptions),
    job: Option<Uuid>,
    (json, lines): (&str, bool),
    request: Request,
) -> Result<(Request, Option<Table>)> {
    let refused = |detail| Err(ApiError::bad_parameter(TEMPLATE, detail));
    let (request, part) = match essence(request.headers()) == "multipart/form-data" {
        true if job.is_some() => {
            return refused("the template is a part of the body; leave `?template=` out");
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
            return refused(
                "`template` belongs to a table, such as `text/csv`; leave it out with JSON",
            );
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
            return refused(
                "a table needs a template, the case whose members its columns replace: send both as `multipart/form-data` with the parts `template` \
                 (JSON) and `table`, or name a job with `?template=`",
            );
        }
    };
    let table = Table {
        form,
        template,
        share,
    };
    Ok((request, Some(table)))
}

/// A case and the permit for its memory.
type Held = (Value, Option<Permit>);

/// Returns the template of `multipart/form-data`, and a request whose body is the table, with the content type of its part.
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
    reader.read_to_end(&mut text).await?;
    // The next part can be read once this one is dropped.
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

/// The remaining parts, and the last allowed one.
type LastPart = (Multipart<'static>, Option<Field<'static>>);

/// Returns the next piece of the last part. No other part may follow it.
async fn last_part((mut parts, mut part): LastPart) -> Result<Option<(Bytes, LastPart)>, BoxError> {
    if let Some(field) = &mut part
        && let Some(piece) = field.chunk().await?
    {
        return Ok(Some((piece, (parts, part))));
    }
    // The next part can be read once this one is dropped.
    drop(part);
    match parts.next_field().await? {
        Some(other) => Err(UnexpectedPart(other.name().unwrap_or_default().to_owned()).into()),
        None => Ok(None),
    }
}

/// Returns the next part, which must have this name.
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

/// Returns the content type of a part. Clients that do not know the format of a file send no content type or `application/octet-stream`; the
/// extension of the file name then determines it.
fn content_type_of(part: &Field<'_>) -> HeaderValue {
    let declared = part.headers().get(header::CONTENT_TYPE);
    let name = part.file_name().unwrap_or_default();
    let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
    let found = match extension.to_ascii_lowercase().as_str() {
        "ndjson" | "jsonl" => "application/x-ndjson",
        "arrow" | "arrows" | "feather" | "ipc" => "application/vnd.apache.arrow.stream",
        "parquet" => "application/vnd.apache.parquet",
        "npz" => "application/x-npz",
        _ => "text/csv",
    };
    match (essence(part.headers()).as_str(), declared) {
        ("" | "application/octet-stream" | "text/plain" | "application/vnd.ms-excel", _)
        | (_, None) => HeaderValue::from_static(found),
        (_, Some(declared)) => declared.clone(),
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

/// Memory for reading a piece of a table, in bytes.
const PIECE_BYTES: usize = 64 << 20;

/// Reads the rows of a run, from a table or from JSON, which contains its template.
///
/// # Errors
/// The body is too large, too slow, ends early or is malformed; or the error of the draft.
pub async fn read_run(
    (jobs, memory, options): (&Jobs, &Memory, &HttpOptions),
    (table, named): (Option<Table>, NamedColumns),
    request: Request<Body>,
) -> Result<BatchUpload> {
    let (rows_max, bytes_max) = (options.run_max_rows, options.evaluate_max_bytes);
    let drafts = jobs.clone();
    let Some(table) = table else {
        let bytes = 2 * declared_bytes(&request, options).min(bytes_max);
        let share = memory.rows(jobs.tenant(), bytes).await?;
        let text = read_body(request, options).await?;
        let read = memory.compute(jobs.tenant(), move |_| {
            let _held = share;
            let (template, columns, values) = read_json_columns(&text, &named)?;
            refuse_copied_members(&template, &columns, &named)?;
            drop(text);
            let mut draft = drafts.draft_run(template, columns, rows_max)?;
            draft.push(values)?;
            Ok(draft.finish()?)
        });
        return read.await;
    };
    let limits = (options.body_timeout, options.run_max_bytes, "one run");
    // An archive is held in memory, compressed and as numbers.
    let bytes = match table.form {
        TableForm::Npz => 2 * bytes_max,
        _ => PIECE_BYTES,
    };
    let bytes = move |_| bytes;
    read_spooled((jobs, memory), limits, bytes, request, move |file, pace| {
        let _held = table.share;
        let mut rows = TableRows::new(table.form, TableSource::File(file), bytes_max)?;
        let columns = rows.named(&named)?;
        refuse_copied_members(&table.template, &columns, &named)?;
        let mut draft = drafts.draft_run(table.template, columns, rows_max)?;
        for chunk in rows {
            pace.step()?;
            draft.push(chunk?)?;
        }
        Ok(draft.finish()?)
    })
    .await
}

/// Refuses columns such as `side` that would be copied to the results by their title, although the template has a member of this name. The
/// client titles such a column with the pointer of the member, or names it in `carry`.
///
/// # Errors
/// `faulty-table` with every such column.
fn refuse_copied_members(
    template: &Value,
    columns: &[TitledColumn],
    named: &NamedColumns,
) -> Result<()> {
    let mut faults = Vec::new();
    for TitledColumn {
        name,
        pointer,
        text,
        ..
    } in columns
    {
        if pointer.is_some() || named.names(name) {
            continue;
        }
        let parts = template.as_object().into_iter().flatten();
        for (part, members) in parts.filter(|(part, _)| *part != "labels") {
            let member = name.to_lowercase();
            let place = match members.get(&member) {
                // Texts in place of a cross-section are digests of stored profiles.
                Some(Value::Object(_)) if *text => format!("/{part}/{member}/profile"),
                None | Some(Value::Object(_) | Value::Array(_)) => continue,
                Some(_) => format!("/{part}/{member}"),
            };
            let detail = format!(
                "column `{name}`: the template has the member `{place}`; title the column `{place}` to vary it, or copy it to the results with \
                 `?carry={name}`"
            );
            faults.push((name.clone(), detail));
        }
    }
    if faults.is_empty() {
        return Ok(());
    }
    let details: Vec<&str> = faults.iter().map(|(_, detail)| &**detail).collect();
    let detail = details.join("; ");
    Err(TableError::Faulty {
        detail,
        columns: faults,
    }
    .into())
}

/// Spools a body to a nameless file while it arrives, then calls `read` with the file, so that a large body takes little memory. The limits
/// are the time of a piece of the body, its largest size, and its name in errors. `bytes` returns the memory in bytes that `read` needs for a
/// body of a given length.
///
/// # Errors
/// The body is too large, too slow or ends early; the file cannot be written; or the error of `read`.
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
    // Flushing reports whether the last piece was written.
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

/// Returns the refusal of a body that is neither JSON nor a table.
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
    use serde_json::json;

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

    #[test]
    fn a_copied_column_must_not_have_the_name_of_a_member_of_the_template() {
        let template =
            json!({ "contact": { "type": "profiles", "side": "left", "rail": {}, "wheel": {} } });
        let column = |name: &str, text| TitledColumn {
            name: name.to_owned(),
            pointer: None,
            factor: 1.0,
            unit: None,
            text,
        };
        let columns = [
            column("side", true),
            column("Rail", true),
            column("wheel", false),
            column("km", false),
        ];
        let refused = refuse_copied_members(&template, &columns, &NamedColumns(None)).unwrap_err();
        let detail = refused.detail();
        for word in ["`/contact/side`", "`/contact/rail/profile`", "?carry=side"] {
            assert!(detail.contains(word), "{detail}");
        }
        assert!(
            !detail.contains("wheel") && !detail.contains("km"),
            "{detail}"
        );
        let named = ["side", "Rail"].map(|name| (name.to_owned(), String::new()));
        let named = NamedColumns(Some(named.to_vec()));
        assert!(refuse_copied_members(&template, &columns, &named).is_ok());
    }
}
