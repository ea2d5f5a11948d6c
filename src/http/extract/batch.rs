//! Reads the body of a batch: an array, lines or a table, which is spooled while it arrives and then split into cases.

use std::cell::Cell;
use std::collections::HashSet;
use std::fmt::{self, Display};
use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::rc::Rc;

use axum::body::Body;
use axum::extract::Request;
use serde::Deserializer as _;
use serde::de::{Error, SeqAccess, Visitor};
use serde_json::error::Category;
use serde_json::value::RawValue;
use serde_json::{Deserializer, Value};

use crate::extract::json::{essence, not_json, read_strict, unlike_json, weigh_case};
use crate::extract::query::DEADLINE_MAX_SECONDS;
use crate::extract::rows::{Table, read_spooled};
use crate::limits::{Memory, Pace};
use crate::options::HttpOptions;
use crate::problem::{ApiError, ProblemKind, Result, faulty};
use railhead_contact::error::Fault;
use railhead_contact::evaluate::varied::{Values, members, truth};
use railhead_jobs::Jobs;
use railhead_jobs::batch::upload::{BatchCase, BatchRow, BatchUpload, Cell as FilledCell};
use railhead_jobs::model::{CaseOptions, Kind, Priority};
use railhead_tables::read::{TableForm, TableRows, TableSource, require_exact};
use railhead_tables::strict_json::without_position;
use railhead_tables::table::{Chunk, Title};
use railhead_tables::text::{
    Bounded, CsvRows, Decimals, StringRecord, require_fields, without_mark,
};
use railhead_tables::titles::{Place, converted, is_text, place, question, short_names};

/// Adds a case, with the number of its line in a body of lines.
pub type Add<'a> = &'a mut dyn FnMut(Option<u64>, &[u8]) -> Result<()>;

/// Reads cases of one line each, of at most `most` bytes. Blank lines are counted and skipped.
///
/// # Errors
/// `body-too-large`: a line is longer; or the error of `add`.
pub fn read_lines(mut source: impl BufRead, most: usize, add: Add<'_>) -> Result<()> {
    let mut text = Vec::new();
    for line in 1.. {
        text.clear();
        let mut rest = (&mut source).take(most as u64 + 1);
        let read = rest.read_until(b'\n', &mut text);
        if read.map_err(ApiError::internal)? == 0 {
            break;
        }
        text.pop_if(|byte| *byte == b'\n');
        require_fitting(format_args!("line {line}"), text.len(), most)?;
        let text = without_mark(&text, line);
        if !text.iter().all(u8::is_ascii_whitespace) {
            add(Some(line), text)?;
        }
    }
    Ok(())
}

/// Reads cases that are the elements of an array, each of at most `most` bytes.
///
/// # Errors
/// `malformed-json`; `faulty-batch`: the body is not an array; `body-too-large`: an element is longer; or the error of `add`.
pub fn read_elements(source: impl Read, most: usize, add: Add<'_>) -> Result<()> {
    let max = most + BETWEEN;
    let left = Rc::new(Cell::new(max));
    let source = Bounded {
        source,
        max,
        left: left.clone(),
    };
    let mut source = BufReader::new(source);
    let begin = source.fill_buf().map_err(ApiError::internal)?;
    // With leading blanks, the buffer may contain nothing else.
    let blank = begin.first().is_some_and(u8::is_ascii_whitespace);
    let unlike = unlike_json(begin).filter(|_| !blank);
    let mut json = Deserializer::from_reader(source);
    let mut elements = Elements {
        most,
        left,
        number: 0,
        add,
        refusal: None,
    };
    let read = json.deserialize_seq(&mut elements);
    let read = read.and_then(|()| json.end());
    match (read, elements.refusal.take()) {
        (_, Some(refusal)) => Err(refusal),
        (Ok(()), None) => Ok(()),
        (Err(error), None) if error.io_error_kind() == Some(ErrorKind::FileTooLarge) => {
            require_fitting(elements.place(), usize::MAX, most)
        }
        (Err(error), None) => Err(match error.classify() {
            Category::Data => no_array(),
            Category::Io => ApiError::internal(&error),
            Category::Syntax | Category::Eof => not_json(unlike, &error),
        }),
    }
}

/// Bytes that are read ahead or separate two elements.
const BETWEEN: usize = 16 << 10;

/// Reads the elements of an array one by one.
struct Elements<'a> {
    most: usize,
    left: Rc<Cell<usize>>,
    number: u64,
    add: Add<'a>,
    refusal: Option<ApiError>,
}

impl Elements<'_> {
    fn place(&self) -> String {
        format!("element {} (counted from 0)", self.number)
    }
}

impl<'de> Visitor<'de> for &mut Elements<'_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("an array of cases")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<(), A::Error> {
        while let Some(text) = elements.next_element::<Box<RawValue>>()? {
            let text = text.get().as_bytes();
            let fits = require_fitting(self.place(), text.len(), self.most);
            if let Err(refusal) = fits.and_then(|()| (self.add)(None, text)) {
                self.refusal = Some(refusal);
                return Err(A::Error::custom("refused"));
            }
            self.number += 1;
            self.left.set(self.most + BETWEEN);
        }
        Ok(())
    }
}

fn require_fitting(place: impl Display, bytes: usize, most: usize) -> Result<()> {
    if bytes <= most {
        return Ok(());
    }
    let detail = format!("{place} is larger than the {most} bytes that are allowed for one case");
    Err(ApiError::new(ProblemKind::BodyTooLarge, detail))
}

fn no_array() -> ApiError {
    ApiError::new(
        ProblemKind::FaultyBatch,
        "the body is not an array; send `[case, case, …]`, or one case per line with `Content-Type: application/x-ndjson`",
    )
}

/// Names of the options, as members and as columns.
const OPTION_NAMES: [&str; 2] = ["priority", "deadline_s"];

/// Reads the case of an element of a batch, with its options if it has some.
///
/// # Errors
/// Every fault of its options.
fn read_options(mut element: Value) -> Result<BatchCase, Vec<Fault>> {
    let members = element.as_object_mut();
    let inner = members.and_then(|members| members.remove("case"));
    let (mut own, mut faults) = (CaseOptions::default(), Vec::new());
    let options = element.as_object().filter(|_| inner.is_some());
    for (name, value) in options.into_iter().flatten() {
        if let Err(detail) = set_option(&mut own, name, value) {
            let member = name.replace('~', "~0").replace('/', "~1");
            faults.push(Fault::new(format!("/{member}"), detail));
        }
    }
    match faults.is_empty() {
        true => Ok(BatchCase {
            wrapped: inner.is_some(),
            case: inner.unwrap_or(element),
            own,
        }),
        false => Err(faults),
    }
}

/// Sets the option of this name.
///
/// # Errors
/// The option does not exist, or the value is not allowed.
fn set_option(own: &mut CaseOptions, name: &str, value: &Value) -> Result<(), String> {
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
                "unknown member; allowed besides `case`: `{}`",
                OPTION_NAMES.join("`, `")
            ));
        }
    }
    Ok(())
}

/// The values of a row for the template, or the reason why the row is not a case.
pub type Row = Result<BatchRow, String>;

/// A column of a table that fills a template.
#[derive(Debug, PartialEq)]
pub struct TemplateColumn {
    /// The title as sent.
    title: String,
    /// Path of members to the value; empty for an option of the row.
    path: Vec<String>,
    /// Factor from the unit of the column to that of the case.
    factor: f64,
    /// Whether values are texts even if they are written like numbers.
    text: bool,
}

/// Returns the columns of a table.
///
/// # Errors
/// `faulty-table`: a title is not known, or two columns have the same member.
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
            return Err(faulty(format!("the column `{name}` is given twice")));
        }
        columns.push(column);
    }
    Ok(columns)
}

/// Returns the rows of a part of a table whose columns have kinds.
fn rows_of(columns: &[TemplateColumn], chunk: &Chunk) -> impl Iterator<Item = Row> {
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
                Values::Numbers(numbers) if column.text => {
                    let exact = require_exact(numbers[row]);
                    exact.map_err(|detail| format!("the column `{}`: {detail}", column.title))?;
                    numbers[row].to_string().into()
                }
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
    /// Adds the value of a row to its cells or its options.
    fn put(&self, value: Value, row: &mut BatchRow) -> Result<(), String> {
        if self.path.is_empty() {
            return set_option(&mut row.own, &self.title, &value)
                .map_err(|detail| format!("the column `{}`: {detail}", self.title));
        }
        row.cells.push(FilledCell(self.path.clone(), value));
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
                    "`{title}` names no column; {}allowed: {}, a quantity with its unit such as `normal_force [kN]`, `priority`, `deadline_s`, \
                     `label:KEY`, which carries a column along, or a JSON pointer such as `/load/normal_force_n`",
                    match question(title, unit) {
                        asked if asked.is_empty() => asked,
                        asked => asked + " ",
                    },
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

/// Reads a record of CSV.
///
/// # Errors
/// The record has another number of fields or a number with another decimal mark, or the value of an option is not allowed.
pub fn row_of(columns: &[TemplateColumn], decimals: &mut Decimals, record: &StringRecord) -> Row {
    require_fields(record, columns.len())?;
    let mut row = BatchRow::default();
    for (column, field) in columns.iter().zip(record) {
        if field.is_empty() {
            continue;
        }
        let value = match column.text {
            true => Value::from(field),
            false => read_value(field, column.factor, decimals)
                .map_err(|detail| format!("column `{}`: {detail}", column.title))?,
        };
        column.put(value, &mut row)?;
    }
    Ok(row)
}

/// Parses a field: a number, converted to the unit of the case, or `true`, `false` or `null`. Any other field is a text.
fn read_value(field: &str, factor: f64, decimals: &mut Decimals) -> Result<Value, String> {
    let number = decimals.number(field)?.filter(|number| number.is_finite());
    // JSON numbers have no plus sign. Whole numbers remain integers.
    let text = number.map_or(field, |_| field.trim_start_matches('+'));
    let value = match (serde_json::from_str(text), number) {
        (Ok(value @ (Value::Number(_) | Value::Null)), _) => value,
        (_, Some(number)) => Value::from(number),
        _ => truth(field).map_or_else(|| Value::from(field), Value::Bool),
    };
    Ok(match value.as_f64() {
        Some(number) if factor != 1.0 => Value::from(converted(number, factor)),
        _ => value,
    })
}

/// Reads and checks a body: a table, or cases one after the other. The faults of single cases are kept in the draft.
///
/// # Errors
/// The body is too large, too slow, ends early or is malformed.
pub async fn read_draft(
    (jobs, memory, options): (&Jobs, &Memory, &HttpOptions),
    table: Option<Table>,
    request: Request<Body>,
) -> Result<BatchUpload> {
    let limits = (options.body_timeout, options.batch_max_bytes, "one batch");
    let mut draft = jobs.draft(Kind::Cases)?;
    let array = essence(request.headers()) == "application/json";
    let form = table.as_ref().map_or(TableForm::Csv, |table| table.form);
    let (one, archive) = (options.body_max_bytes, 2 * options.evaluate_max_bytes);
    let bytes = move |length: usize| match form {
        TableForm::Csv => length.min(one),
        // The table is held in memory, compressed and as numbers.
        _ => archive,
    };
    let mut held = None;
    if let Some(table) = table {
        let whole = jobs.with_profiles(table.template.clone()).await?;
        draft.set_row_template(whole, table.template);
        held = Some(table.share);
    }
    let options = options.clone();
    let read = move |file, pace: &mut Pace| match held {
        Some(_held) => read_rows(draft, (form, file), &options, pace),
        None => {
            let most = options.body_max_bytes;
            let add: Add<'_> = &mut |line, text| {
                pace.step()?;
                add(&mut draft, line, text, &options)
            };
            match array {
                true => read_elements(file, most, add),
                false => read_lines(BufReader::new(file), most, add),
            }?;
            Ok(draft)
        }
    };
    read_spooled((jobs, memory), limits, bytes, request, read).await
}

/// Adds the rows of a spooled table.
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
            let row = row_of(&columns, &mut rows.decimals, &record).map_err(told);
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

/// Adds a case to a draft, with its faults. A line whose JSON cannot be read is a faulty case, an element is not.
fn add(
    draft: &mut BatchUpload,
    line: Option<u64>,
    text: &[u8],
    options: &HttpOptions,
) -> Result<()> {
    weigh_case(text, options.parsed_max_bytes)?;
    let case = match (read_strict(text), line) {
        (Ok(case), _) => read_options(case),
        (Err(error), None) => return Err(ApiError::malformed_element(draft.cases, &error)),
        (Err(error), Some(_)) => {
            let (column, reason) = (error.column(), without_position(&error));
            let detail = format!("column {column} of the line: {reason}");
            Err(vec![Fault::new("", detail)])
        }
    };
    draft.add(line, text, case)?;
    require_count(draft, options)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use railhead_jobs::batch::upload::fill;
    use railhead_tables::table::COLUMNS_MAX;

    fn cut(array: bool, text: &str) -> Result<Vec<(Option<u64>, String)>> {
        let mut out = Vec::new();
        let add: Add<'_> = &mut |line, text| {
            let text = String::from_utf8_lossy(text);
            out.push((line, text.trim().to_owned()));
            Ok(())
        };
        match array {
            true => read_elements(text.as_bytes(), 40, add)?,
            false => read_lines(text.as_bytes(), 40, add)?,
        }
        Ok(out)
    }

    #[test]
    fn lines_keep_their_numbers_however_the_body_is_cut() {
        let cases = cut(false, "{\"a\":1}\n\n  \r\n{\"b\":2}\r\nx").unwrap();
        let expected = [(1, "{\"a\":1}"), (4, "{\"b\":2}"), (5, "x")];
        let expected = expected.map(|(line, text)| (Some(line), text.to_owned()));
        assert_eq!(cases, expected);
    }

    #[test]
    fn elements_end_at_their_own_commas_only() {
        let cases = cut(true, r#" [ {"a":[1,2],"s":"],\",{"} , [3] ,7 ] "#).unwrap();
        let texts: Vec<_> = cases.iter().map(|(_, text)| text.as_str()).collect();
        assert_eq!(texts, [r#"{"a":[1,2],"s":"],\",{"}"#, "[3]", "7"]);
        assert_eq!(cut(true, "[]").unwrap(), []);
    }

    #[test]
    fn broken_arrays_and_large_cases_are_refused() {
        for text in ["", "[1", "[1,]", "[,1]", "[1] 2", "{\"a\":1}", "[\"]"] {
            assert!(cut(true, text).is_err(), "{text:?} was accepted");
        }
        let just = format!("\"{}\"", "a".repeat(38));
        assert!(cut(true, &format!("[{just},{just}]")).is_ok());
        let endless = "1".repeat(1 << 20);
        for text in [
            format!("[{just},\"{}\"]", "a".repeat(60)),
            format!("[{just},{endless}"),
        ] {
            let refusal = format!("{:?}", cut(true, &text).unwrap_err());
            assert!(refusal.contains("element 1"), "{refusal}");
        }
        assert!(cut(false, &format!("{just}\n{just}")).is_ok());
        assert!(cut(false, &format!("{just}0\n")).is_err());
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
            rows.push(row_of(&columns, &mut table.decimals, &record));
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
            ("name,a_mm", "x", "fields is 1, that of the titles 2"),
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
