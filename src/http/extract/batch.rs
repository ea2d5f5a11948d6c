//! Reads the body of a batch: an array, lines or a table, cut into cases while it arrives and checked portion by portion.
use std::collections::HashSet;
use std::fs::File;
use std::io::BufReader;

use axum::body::Body;
use axum::extract::Request;
use serde_json::Value;

use crate::contact::error::Fault;
use crate::contact::evaluate::varied::{Values, members};
use crate::http::extract::json::{BodyReader, essence, read_strict, weigh_case};
use crate::http::extract::query::DEADLINE_MAX_SECONDS;
use crate::http::extract::rows::{Table, read_spooled};
use crate::http::extract::tables::{Chunk, CsvRows, TableForm, TableRows, TableSource, Title};
use crate::http::extract::titles::{Place, faulty, is_text, number, place, question, short_names};
use crate::http::limits::{Computation, Memory, Pace, SMALL_BYTES};
use crate::http::options::HttpOptions;
use crate::http::problem::{ApiError, ProblemKind, Result};
use crate::jobs::Jobs;
use crate::jobs::batch::upload::{BatchCase, BatchRow, BatchUpload, Cell};
use crate::jobs::model::{CaseOptions, Kind, Priority};
use crate::jobs::run::model::converted;

/// How cases stand in a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// One per line; empty lines count as lines and hold no case.
    Lines,
    /// As elements of one JSON array.
    Array,
}

/// The text of one case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Element {
    /// The line it begins on, counted from 1; not of an array.
    pub line: Option<u64>,
    /// The text.
    pub text: Vec<u8>,
}

/// Where in an array the cutting stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SplitterState {
    Before,
    /// In an element, or before it.
    Inside,
    After,
}

/// Cuts a body piece by piece.
#[derive(Debug)]
pub struct Splitter {
    layout: Layout,
    max_bytes: usize,
    held: Vec<u8>,
    line: u64,
    place: SplitterState,
    depth: usize,
    in_string: bool,
    escaped: bool,
    elements: u64,
}

impl Splitter {
    /// Ready for the first piece; no case may be larger than `max_bytes`.
    #[must_use]
    pub fn new(layout: Layout, max_bytes: usize) -> Self {
        Splitter {
            layout,
            max_bytes,
            held: Vec::new(),
            line: 1,
            place: SplitterState::Before,
            depth: 0,
            in_string: false,
            escaped: false,
            elements: 0,
        }
    }

    /// Bytes of the case under way.
    #[must_use]
    pub fn held(&self) -> usize {
        self.held.len()
    }

    /// Takes a piece of the body and appends the cases that it completes.
    ///
    /// # Errors
    /// A case is too large, or the body is no array.
    pub fn feed(&mut self, piece: &[u8], out: &mut Vec<Element>) -> Result<()> {
        match self.layout {
            Layout::Lines => self.feed_lines(piece, out),
            Layout::Array => piece.iter().try_for_each(|byte| self.feed_byte(*byte, out)),
        }
    }

    /// Ends the body.
    ///
    /// # Errors
    /// The array is not closed.
    pub fn end(mut self, out: &mut Vec<Element>) -> Result<()> {
        match self.layout {
            Layout::Lines => self.complete_line(out),
            Layout::Array if self.place == SplitterState::After => {}
            Layout::Array if self.place == SplitterState::Before => {
                return Err(malformed("the body is empty; send an array of cases"));
            }
            Layout::Array => {
                return Err(malformed(&format!(
                    "the array is not closed; the body ends in element {} (counted from 0)",
                    self.elements
                )));
            }
        }
        Ok(())
    }

    fn feed_lines(&mut self, piece: &[u8], out: &mut Vec<Element>) -> Result<()> {
        let mut parts = piece.split(|byte| *byte == b'\n').peekable();
        while let Some(part) = parts.next() {
            self.require_room(part.len())?;
            self.held.extend_from_slice(part);
            if parts.peek().is_some() {
                self.complete_line(out);
            }
        }
        Ok(())
    }

    fn complete_line(&mut self, out: &mut Vec<Element>) {
        if !blank(&self.held) {
            out.push(Element {
                line: Some(self.line),
                text: std::mem::take(&mut self.held),
            });
        }
        self.held.clear();
        self.line += 1;
    }

    fn feed_byte(&mut self, byte: u8, out: &mut Vec<Element>) -> Result<()> {
        match self.place {
            _ if self.place != SplitterState::Inside && byte.is_ascii_whitespace() => {}
            SplitterState::Before if byte == b'[' => self.place = SplitterState::Inside,
            SplitterState::Before => return Err(no_array()),
            SplitterState::After => {
                return Err(malformed("something follows the end of the array"));
            }
            SplitterState::Inside if self.in_string => {
                self.hold(byte)?;
                match byte {
                    _ if self.escaped => self.escaped = false,
                    b'\\' => self.escaped = true,
                    b'"' => self.in_string = false,
                    _ => {}
                }
            }
            SplitterState::Inside => match byte {
                b',' if self.depth == 0 => self.complete_element(out)?,
                b']' if self.depth == 0 => {
                    if self.elements > 0 || !blank(&self.held) {
                        self.complete_element(out)?;
                    }
                    self.place = SplitterState::After;
                }
                _ => {
                    match byte {
                        b'"' => self.in_string = true,
                        b'[' | b'{' => self.depth += 1,
                        b']' | b'}' => self.depth = self.depth.saturating_sub(1),
                        _ => {}
                    }
                    if !(self.held.is_empty() && byte.is_ascii_whitespace()) {
                        self.hold(byte)?;
                    }
                }
            },
        }
        Ok(())
    }

    fn complete_element(&mut self, out: &mut Vec<Element>) -> Result<()> {
        if blank(&self.held) {
            return Err(malformed(&format!(
                "element {} of the array (counted from 0) is empty",
                self.elements
            )));
        }
        self.elements += 1;
        out.push(Element {
            line: None,
            text: std::mem::take(&mut self.held),
        });
        Ok(())
    }

    fn hold(&mut self, byte: u8) -> Result<()> {
        self.require_room(1)?;
        self.held.push(byte);
        Ok(())
    }

    fn require_room(&self, bytes: usize) -> Result<()> {
        if self.held.len() + bytes <= self.max_bytes {
            return Ok(());
        }
        let place = match self.layout {
            Layout::Lines => format!("line {}", self.line),
            Layout::Array => format!("element {} (counted from 0)", self.elements),
        };
        Err(ApiError::new(
            ProblemKind::BodyTooLarge,
            format!(
                "{place} is larger than the {} bytes that are allowed for one case",
                self.max_bytes
            ),
        ))
    }
}

fn blank(text: &[u8]) -> bool {
    text.iter().all(u8::is_ascii_whitespace)
}

fn malformed(detail: &str) -> ApiError {
    ApiError::new(
        ProblemKind::MalformedJson,
        format!("the body is not JSON: {detail}"),
    )
}

fn no_array() -> ApiError {
    ApiError::new(
        ProblemKind::FaultyBatch,
        "the body is no array; send `[case, case, …]`, or one case per line with `Content-Type: application/x-ndjson`",
    )
}

/// Names of the options, as members and as columns.
pub const OPTION_NAMES: [&str; 2] = ["priority", "deadline_s"];

/// The case that an element of a batch is or has.
///
/// # Errors
/// Every fault of its options.
pub fn read_options(mut element: Value) -> Result<BatchCase, Vec<Fault>> {
    let members = element.as_object_mut();
    let Some((members, case)) = members.and_then(|members| {
        let case = members.remove("case")?;
        Some((members, case))
    }) else {
        return Ok(BatchCase {
            case: element,
            wrapped: false,
            own: CaseOptions::default(),
        });
    };
    let mut own = CaseOptions::default();
    let mut faults = Vec::new();
    for (name, value) in members {
        if let Err(detail) = set_option(&mut own, name, value) {
            faults.push(Fault::new(
                format!("/{}", name.replace('~', "~0").replace('/', "~1")),
                detail,
            ));
        }
    }
    match faults.is_empty() {
        true => Ok(BatchCase {
            case,
            wrapped: true,
            own,
        }),
        false => Err(faults),
    }
}

/// Sets the option of this name.
///
/// # Errors
/// There is none, or the value is not one of it.
pub fn set_option(own: &mut CaseOptions, name: &str, value: &Value) -> Result<(), String> {
    match name {
        "priority" => {
            let priority = value.as_str().and_then(Priority::from_name);
            let words = Priority::ALL.map(Priority::name).join(", ");
            own.priority =
                Some(priority.ok_or_else(|| format!("{value} given; allowed: {words}"))?);
        }
        "deadline_s" => {
            let seconds = value
                .as_u64()
                .and_then(|seconds| u32::try_from(seconds).ok());
            let seconds = seconds.filter(|seconds| (1..=DEADLINE_MAX_SECONDS).contains(seconds));
            own.deadline_s = Some(seconds.ok_or_else(|| {
                format!(
                    "{value} given; a whole number from 1 to {DEADLINE_MAX_SECONDS} is needed, in s"
                )
            })?);
        }
        _ => {
            return Err(format!(
                "unknown member; beside `case` there may be `{}`",
                OPTION_NAMES.join("`, `")
            ));
        }
    }
    Ok(())
}

/// What a line puts into the template, or why it stands for no case.
pub type Row = Result<BatchRow, String>;

/// A column of a table that fills a template.
#[derive(Debug, PartialEq)]
pub struct TemplateColumn {
    /// As it stands in the header.
    title: String,
    /// The members that lead to the value; none for an option of the line.
    path: Vec<String>,
    /// What makes a number one of the case.
    factor: f64,
    /// The value is text, whatever it looks like.
    text: bool,
}

/// The columns of a table.
///
/// # Errors
/// `faulty-table`: a title names no column, or two the same.
pub fn columns_of(titles: &[Title]) -> Result<Vec<TemplateColumn>> {
    let mut seen = HashSet::new();
    let mut columns = Vec::new();
    for Title { name, unit, .. } in titles {
        let column = column(name, unit.as_deref()).map_err(faulty)?;
        let place = match column.path.is_empty() {
            true => vec![String::new(), column.title.clone()],
            false => column.path.clone(),
        };
        if !seen.insert(place) {
            return Err(faulty(format!("the column `{name}` is there twice")));
        }
        columns.push(column);
    }
    Ok(columns)
}

/// The rows of a part of a table whose columns have kinds.
pub fn rows_of(columns: &[TemplateColumn], chunk: &Chunk) -> impl Iterator<Item = Row> {
    let rows = chunk.first().map_or(0, Values::len);
    (0..rows).map(move |row| {
        let mut filled = BatchRow::default();
        for (column, values) in columns.iter().zip(chunk) {
            let value = match values {
                Values::Texts(texts) => match texts[row].as_deref().map(str::trim) {
                    None | Some("") => continue,
                    Some(text) => Value::from(text),
                },
                Values::Numbers(numbers) if numbers[row].is_nan() => continue,
                Values::Numbers(numbers) if column.text => numbers[row].to_string().into(),
                Values::Numbers(numbers) if column.path.is_empty() => {
                    serde_json::from_str(&numbers[row].to_string()).unwrap_or_default()
                }
                Values::Numbers(numbers) => Value::from(converted(numbers[row], column.factor)),
            };
            column.put(value, &mut filled)?;
        }
        Ok(filled)
    })
}

impl TemplateColumn {
    /// Puts the value of a row where it belongs.
    fn put(&self, value: Value, row: &mut BatchRow) -> Result<(), String> {
        if self.path.is_empty() {
            return set_option(&mut row.own, &self.title, &value)
                .map_err(|detail| format!("the column `{}`: {detail}", self.title));
        }
        row.cells.push(Cell(self.path.clone(), value));
        Ok(())
    }
}

fn column(title: &str, unit: Option<&str>) -> Result<TemplateColumn, String> {
    let label = title.strip_prefix("label:").filter(|key| !key.is_empty());
    let (path, factor) = if OPTION_NAMES.contains(&title) {
        (Vec::new(), 1.0)
    } else if let Some(key) = label {
        (vec!["labels".to_owned(), key.to_owned()], 1.0)
    } else {
        let found = match title {
            "/" => Ok(None),
            title => place(title, unit.filter(|_| !is_text(title))),
        };
        match found.map_err(|detail| format!("column `{title}`: {detail}"))? {
            Some(Place { pointer, factor }) => (members(&pointer), factor),
            None => {
                return Err(format!(
                    "`{title}` names no column; {} allowed: {}, a quantity with its unit such as `normal_force [kN]`, `priority`, `deadline_s`, \
                     `label:KEY`, which carries a column along, or a JSON pointer such as `/load/normal_force_n`",
                    question(title, unit),
                    short_names()
                ));
            }
        }
    };
    let text = matches!(path.first().map(String::as_str), Some("labels" | "name"));
    Ok(TemplateColumn {
        title: title.to_owned(),
        path,
        factor,
        text,
    })
}

/// What a record of CSV puts into the template.
///
/// # Errors
/// It has another number of fields, or a value of an option is not allowed.
pub fn row_of(columns: &[TemplateColumn], decimal_comma: bool, record: &csv::StringRecord) -> Row {
    if record.len() != columns.len() {
        return Err(format!(
            "the line has {} fields, the header has {}",
            record.len(),
            columns.len()
        ));
    }
    let mut row = BatchRow::default();
    for (column, field) in columns.iter().zip(record) {
        if field.is_empty() {
            continue;
        }
        let value = match column.text {
            true => Value::from(field),
            false => read_value(field, column.factor, decimal_comma),
        };
        column.put(value, &mut row)?;
    }
    Ok(row)
}

/// A number in the unit of the case, `true`, `false` or `null` as JSON has them; everything else is text, and the case says whether it may be.
fn read_value(field: &str, factor: f64, decimal_comma: bool) -> Value {
    let value = match serde_json::from_str(field) {
        Ok(value @ (Value::Number(_) | Value::Bool(_) | Value::Null)) => value,
        _ => {
            let number = number(field, decimal_comma).filter(|number| number.is_finite());
            match number.filter(|_| decimal_comma) {
                Some(number) => Value::from(number),
                None => Value::from(field),
            }
        }
    };
    match value.as_f64() {
        Some(number) if factor != 1.0 => Value::from(converted(number, factor)),
        _ => value,
    }
}

/// Cases are checked in portions of about this many bytes.
const PORTION_BYTES: usize = 256 << 10;

/// Reads and checks the body as it arrives: a table, or cases one after the other.
///
/// # Errors
/// The body is too large, too slow, broken, or not of its form; faults of single cases are kept in the draft.
pub async fn read_draft(
    (jobs, memory, options): (&Jobs, &Memory, &HttpOptions),
    table: Option<Table>,
    request: Request<Body>,
) -> Result<BatchUpload> {
    let limits = (options.body_timeout, options.batch_max_bytes, "one batch");
    let mut draft = jobs.draft(Kind::Cases)?;
    if let Some(table) = table {
        draft.set_row_template(jobs.with_profiles(table.template).await?);
        // An archive is read as a whole, once packed and once as numbers.
        let bytes = match table.form {
            TableForm::Csv => options.body_max_bytes,
            _ => 2 * options.evaluate_max_bytes,
        };
        let options = options.clone();
        let read = move |file, pace: &mut Pace| {
            let _held = table.share;
            read_rows(draft, (table.form, file), &options, pace)
        };
        return read_spooled((jobs, memory), limits, bytes, request, read).await;
    }
    let layout = match essence(request.headers()).as_str() {
        "application/json" => Layout::Array,
        _ => Layout::Lines,
    };
    let (timeout, most, what) = limits;
    let mut reader = BodyReader::new(timeout, most, what, request)?;
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
fn read_rows(
    mut draft: BatchUpload,
    (form, file): (TableForm, File),
    options: &HttpOptions,
    pace: &mut Pace,
) -> Result<BatchUpload> {
    let told = |detail| vec![Fault::new("", detail)];
    if form == TableForm::Csv {
        let mut rows = CsvRows::new(BufReader::new(file), options.body_max_bytes)?;
        let columns = columns_of(&rows.titles)?;
        while let Some((line, record)) = rows.record()? {
            pace.step()?;
            let row = row_of(&columns, rows.decimal_comma, &record).map_err(told);
            draft.add_row(Some(line), record.as_slice().as_bytes(), row)?;
            require_count(&draft, options)?;
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
            require_count(&draft, options)?;
        }
    }
    Ok(draft)
}

fn require_count(draft: &BatchUpload, options: &HttpOptions) -> Result<()> {
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
    ) -> Result<BatchUpload> {
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
) -> Result<()> {
    weigh_case(&element.text, parsed_max_bytes)?;
    match layout {
        Layout::Array => {
            let case = read_strict(&element.text)
                .map_err(|error| ApiError::malformed_element(draft.cases, &error))?;
            draft.add(element.line, &element.text, read_options(case))?;
        }
        Layout::Lines => {
            let case = read_strict(&element.text)
                .map_err(|error| vec![Fault::new("", format!("the line is not JSON: {error}"))])
                .and_then(read_options);
            draft.add(element.line, &element.text, case)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::http::extract::tables::CsvRows;
    use crate::jobs::batch::upload::fill;
    use crate::jobs::codec::table::COLUMNS_MAX;

    fn cut(layout: Layout, text: &str, piece: usize) -> Result<Vec<(Option<u64>, String)>> {
        let mut splitter = Splitter::new(layout, 40);
        let mut out = Vec::new();
        for piece in text.as_bytes().chunks(piece) {
            splitter.feed(piece, &mut out)?;
        }
        splitter.end(&mut out)?;
        let text = |element: Element| {
            let text = String::from_utf8(element.text).unwrap();
            (element.line, text.trim().to_owned())
        };
        Ok(out.into_iter().map(text).collect())
    }

    #[test]
    fn lines_keep_their_numbers_however_the_body_is_cut() {
        for piece in 1..30 {
            let cases = cut(Layout::Lines, "{\"a\":1}\n\n  \r\n{\"b\":2}\r\nx", piece).unwrap();
            let expected = [(1, "{\"a\":1}"), (4, "{\"b\":2}"), (5, "x")];
            let expected = expected.map(|(line, text)| (Some(line), text.to_owned()));
            assert_eq!(cases, expected);
        }
    }

    #[test]
    fn elements_end_at_their_own_commas_only() {
        let text = r#" [ {"a":[1,2],"s":"],\",{"} , [3] ,7 ] "#;
        for piece in 1..text.len() {
            let cases = cut(Layout::Array, text, piece).unwrap();
            let texts: Vec<_> = cases.iter().map(|(_, text)| text.as_str()).collect();
            assert_eq!(texts, [r#"{"a":[1,2],"s":"],\",{"}"#, "[3]", "7"]);
        }
        assert_eq!(cut(Layout::Array, "[]", 1).unwrap(), []);
    }

    #[test]
    fn broken_arrays_and_large_cases_are_refused() {
        for text in ["", "[1", "[1,]", "[,1]", "[1] 2", "{\"a\":1}", "[\"]"] {
            assert!(
                cut(Layout::Array, text, 2).is_err(),
                "{text:?} was accepted"
            );
        }
        let just = format!("\"{}\"", "a".repeat(38));
        assert!(cut(Layout::Array, &format!("[{just},{just}]"), 3).is_ok());
        assert!(cut(Layout::Array, &format!("[{just}0]"), 3).is_err());
        assert!(cut(Layout::Lines, &format!("{just}\n{just}"), 3).is_ok());
        assert!(cut(Layout::Lines, &format!("{just}0\n"), 50).is_err());
    }

    #[test]
    fn an_element_is_a_case_or_has_one_with_options() {
        let bare = read_options(json!({ "motion": {} })).unwrap();
        assert_eq!((bare.wrapped, bare.own), (false, CaseOptions::default()));
        let own =
            read_options(json!({ "case": { "motion": {} }, "priority": "high", "deadline_s": 60 }));
        let own = own.unwrap();
        assert_eq!((own.case, own.wrapped), (bare.case, true));
        assert_eq!(own.own.priority, Some(Priority::High));
        assert_eq!(own.own.deadline_s, Some(60));
    }

    #[test]
    fn every_faulty_option_is_named() {
        let element = json!({ "case": {}, "priority": "soon", "deadline_s": 0, "a/b": 1 });
        let mut pointers: Vec<String> = read_options(element)
            .unwrap_err()
            .into_iter()
            .map(|fault| fault.pointer)
            .collect();
        pointers.sort();
        assert_eq!(pointers, ["/a~1b", "/deadline_s", "/priority"]);
    }

    fn taken(lines: &[&str]) -> Result<Vec<Row>> {
        let text = lines.join("\n");
        let mut table = CsvRows::new(text.as_bytes(), 1 << 20)?;
        let columns = columns_of(&table.titles)?;
        let mut rows = Vec::new();
        while let Some((_, record)) = table.record()? {
            rows.push(row_of(&columns, table.decimal_comma, &record));
        }
        Ok(rows)
    }

    fn filled(lines: &[&str]) -> Value {
        let template = json!({ "motion": { "creepage_x": 0.001 }, "contact": { "y_mm": [0, 1] }, "solver": "x" });
        let row = taken(lines).expect("a table").remove(0).expect("a row");
        fill(&template, &row.cells).expect("a case")
    }

    #[test]
    fn columns_lead_to_members_of_the_case() {
        let header =
            "\u{feff}label:km,normal_force_n, creepage_x ,/contact/y_mm/1,/solver,name\r\n";
        let case = filled(&[header, "37.2,8e4,,-2,\"a, \"\"b\"\"\",12\r\n"]);
        let expected = json!({
            "labels": { "km": "37.2" },
            "load": { "normal_force_n": 8e4 },
            "motion": { "creepage_x": 0.001 },
            "contact": { "y_mm": [0, -2] },
            "solver": "a, \"b\"",
            "name": "12"
        });
        assert_eq!(case, expected);
    }

    #[test]
    fn units_semicolons_and_decimal_commas_give_the_same_case() {
        let expected = filled(&["label:km,normal_force_n,spin_per_mm", "37.2,64100.0,4e-4"]);
        for lines in [
            &["label:km,Normal force [kN],spin [1/m]", "37.2,64.1,0.4"][..],
            &["label:km;Normal force [kN];spin [1/m]", "37.2;64,1;0,4"],
            &[
                "label:km\tNormal force\tspin",
                "[km]\t[kN]\t[1/m]",
                "37.2\t64,1\t0,4",
            ],
            &[
                "label:km,normal_force_n,spin_per_m",
                ",N,",
                "37.2,64100.0,0.4",
            ],
        ] {
            assert_eq!(filled(lines), expected, "{lines:?}");
        }
    }

    #[test]
    fn lines_that_do_not_fit_say_so() {
        for (header, line, word) in [
            ("name,a_mm", "x", "1 fields, the header has 2"),
            ("priority", "soon", "allowed: high, normal, low"),
        ] {
            let fault = taken(&[header, line])
                .expect("a table")
                .remove(0)
                .unwrap_err();
            assert!(fault.contains(word), "{fault}");
        }
        let many: Vec<String> = (0..=COLUMNS_MAX).map(|k| format!("label:k{k}")).collect();
        for (header, words) in [
            ("speed", "has no unit"),
            ("Q_left", "normal_force [kN]"),
            ("km", "label:KEY"),
            ("name,name", "twice"),
            ("a_mm;b", "`b`"),
            ("label:", "names no column"),
            ("/", "names no column"),
            (&many.join(","), "at most 1000"),
        ] {
            let refused = format!("{:?}", taken(&[header, "1"]).expect_err(header));
            assert!(refused.contains(words), "{refused}");
        }
        let refused = taken(&["normal_force_n,creepage_x", "kN,%", "1,1"]).expect_err("units");
        assert!(refused.detail().contains("agree"), "{refused:?}");
    }
}
