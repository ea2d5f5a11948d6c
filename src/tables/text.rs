//! Tables as CSV and NDJSON, read some rows at a time.
//!
//! The first rows, at most [`ROWS`], decide the kind of each column: its first value makes it numbers or texts.

use std::cell::Cell;
use std::collections::VecDeque;
use std::io::{self, BufRead, Chain, Cursor, Read};
use std::rc::Rc;

use serde_json::{Map, Value};

use railhead_contact::evaluate::varied::Values;

pub use csv::StringRecord;

use crate::error::{Result, TableError, faulty};
use crate::strict_json::{Strict, without_position};
use crate::table::{Chunk, Title};
use crate::titles::{is_line_of_units, is_text, is_thing, require_few};

/// Rows that are read at once, and at most ahead of the first chunk.
const ROWS: usize = 8192;
/// Longest line, in bytes.
const LINE_BYTES_MAX: usize = 1 << 20;
/// Digits that a 64-bit float always preserves.
const EXACT_DIGITS: usize = 15;

/// A source behind its first line, which was read already, with a line break appended.
type Ended<R> = Chain<Chain<Cursor<Vec<u8>>, R>, &'static [u8]>;

/// A source that fails when a record takes more than a number of bytes.
pub struct Bounded<R> {
    /// The source of the bytes.
    pub source: R,
    /// Most bytes of a record.
    pub max: usize,
    /// Bytes that the present record may still take. The reader of the records sets it when a record begins.
    pub left: Rc<Cell<usize>>,
}

impl<R: Read> Read for Bounded<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.source.read(buffer)?;
        let left = self.left.get().checked_sub(read).ok_or_else(|| {
            let detail = format!("a row is longer than {} bytes", self.max);
            io::Error::new(io::ErrorKind::FileTooLarge, detail)
        })?;
        self.left.set(left);
        Ok(read)
    }
}

/// Rows of a CSV table. The first line names the columns; a line `sep=;` before it, as Excel writes, names the delimiter. Otherwise the
/// delimiter is that of the titles: comma, semicolon or tab. A line below the titles may give the units.
pub struct CsvRows<R: Read> {
    reader: csv::Reader<Bounded<Ended<R>>>,
    /// The decimal mark of its numbers.
    pub decimals: Decimals,
    /// The titles of the columns.
    pub titles: Vec<Title>,
    /// Rows that were read ahead, each with its line.
    ahead: VecDeque<(u64, StringRecord)>,
}

impl<R: BufRead> CsvRows<R> {
    /// Reads the titles and the first rows; no row may take more than `record_max` bytes.
    ///
    /// # Errors
    /// `faulty-table`
    pub fn new(mut source: R, record_max: usize) -> Result<CsvRows<R>> {
        let mut first = Vec::new();
        let mut line = (&mut source).take(LINE_BYTES_MAX as u64);
        line.read_until(b'\n', &mut first)?;
        if first.starts_with(b"\xff\xfe") || first.starts_with(b"\xfe\xff") {
            return Err(faulty("the table is UTF-16, not UTF-8; send it as UTF-8"));
        }
        let (delimiter, is_separator_line) = match separator_line(&first) {
            Some(named) => (named, true),
            None => (delimiter(&first), false),
        };
        // With this end of line the reader counts lines exactly; other files end their lines with `\r` alone.
        let terminator = match first.ends_with(b"\r\n") || !first.contains(&b'\r') {
            true => csv::Terminator::Any(b'\n'),
            false => csv::Terminator::CRLF,
        };
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .trim(csv::Trim::All)
            .terminator(terminator)
            .flexible(true)
            .delimiter(delimiter)
            // The last line ends as the others do.
            .from_reader(Bounded {
                max: record_max,
                left: Rc::new(Cell::new(record_max)),
                source: Cursor::new(first).chain(source).chain(&b"\n"[..]),
            });
        let mut rows = CsvRows {
            reader,
            decimals: Decimals::of(delimiter),
            titles: Vec::new(),
            ahead: VecDeque::new(),
        };
        if is_separator_line {
            rows.fetch()?;
        }
        let names = rows.fetch()?.map(|(_, names)| names).unwrap_or_default();
        require_few(names.len())?;
        let mut names: Vec<&str> = names
            .iter()
            .map(|name| name.trim_start_matches('\u{feff}'))
            .collect();
        // Spreadsheets write separators after the last column.
        while names.pop_if(|name| name.is_empty()).is_some() {}
        let second = rows.fetch()?;
        // Columns of texts have no units.
        let has_unit = |(name, unit): (&&str, &str)| !is_text(name) && !unit.is_empty();
        let units = second.as_ref().map(|(_, units)| units).filter(|units| {
            require_fields(units, names.len()).is_ok()
                && names.iter().zip(*units).any(has_unit)
                && is_line_of_units(units.iter())
        });
        let units: Vec<Option<String>> = match units {
            Some(units) => {
                let units = units.iter().take(names.len());
                units.map(|unit| Some(unit.to_owned())).collect()
            }
            None => {
                rows.ahead.extend(second.clone());
                vec![None; names.len()]
            }
        };
        rows.read_ahead(record_max)?;
        let titles = names.iter().zip(units).enumerate();
        rows.titles = titles
            .map(|(place, (name, unit))| rows.title(place, name, unit))
            .collect();
        Ok(rows)
    }

    /// Reads at most [`ROWS`] rows and about this many bytes ahead.
    fn read_ahead(&mut self, bytes_max: usize) -> Result<()> {
        let mut bytes = 0;
        while self.ahead.len() < ROWS && bytes < bytes_max {
            let Some((line, record)) = self.fetch()? else {
                break;
            };
            bytes += record.as_slice().len();
            self.ahead.push_back((line, record));
        }
        Ok(())
    }

    /// The title of a column, with its kind by the rows read ahead.
    fn title(&self, place: usize, name: &str, unit: Option<String>) -> Title {
        let fields = self
            .ahead
            .iter()
            .filter_map(|(_, record)| record.get(place));
        let mut fields = fields.filter(|field| !field.is_empty()).peekable();
        let comma = self.decimals.comma;
        Title {
            text: fields
                .peek()
                .is_some_and(|field| number(field, comma).is_none()),
            text_if_copied: is_thing(name) || !fields.all(is_exact),
            name: name.to_owned(),
            unit,
        }
    }

    /// Some more rows, none at the end.
    fn read(&mut self) -> Result<Chunk> {
        let mut values = empty(&self.titles);
        for _ in 0..ROWS {
            let Some((line, record)) = self.record()? else {
                break;
            };
            require_fields(&record, self.titles.len())
                .map_err(|detail| faulty(format!("line {line}: {detail}")))?;
            for ((field, column), values) in record.iter().zip(&self.titles).zip(&mut values) {
                let wrong =
                    |detail| faulty(format!("line {line}, column `{}`: {detail}", column.name));
                match values {
                    Values::Texts(texts) => {
                        texts.push(Some(field.to_owned()).filter(|text| !text.is_empty()));
                    }
                    Values::Numbers(numbers) if field.is_empty() => numbers.push(f64::NAN),
                    Values::Numbers(numbers) => {
                        let number = self.decimals.number(field).map_err(wrong)?;
                        numbers.push(number.ok_or_else(|| {
                            wrong(format!(
                                "`{field}` is not a number; the first value of this column is a number"
                            ))
                        })?);
                    }
                }
            }
        }
        Ok(values)
    }

    /// The fields of the next row and the line on which it begins.
    ///
    /// # Errors
    /// `faulty-table`
    pub fn record(&mut self) -> Result<Option<(u64, StringRecord)>> {
        match self.ahead.pop_front() {
            Some(next) => Ok(Some(next)),
            None => self.fetch(),
        }
    }

    /// Reads the next record that is not a blank line, and the number of the line on which it begins.
    fn fetch(&mut self) -> Result<Option<(u64, StringRecord)>> {
        let mut record = StringRecord::new();
        loop {
            let source = self.reader.get_ref();
            source.left.set(source.max);
            let more = self.reader.read_record(&mut record);
            if !more.map_err(|error| unread(&error))? {
                return Ok(None);
            }
            if record.len() > 1 || record.get(0) != Some("") {
                let inside = record.as_slice().bytes().filter(|byte| *byte == b'\n');
                let after = self.reader.position().line();
                let line = after.saturating_sub(1 + inside.count() as u64);
                return Ok(Some((line, record)));
            }
        }
    }
}

/// Refuses a line whose number of fields is not that of the titles. Empty fields after the last title are ignored.
///
/// # Errors
/// The reason.
pub fn require_fields(line: &StringRecord, titles: usize) -> std::result::Result<(), String> {
    let is_longer = line.iter().skip(titles).any(|field| !field.is_empty());
    match is_longer || line.len() < titles {
        false => Ok(()),
        true => Err(format!(
            "the number of fields is {}, that of the titles {titles}",
            line.len()
        )),
    }
}

fn unread(error: &csv::Error) -> TableError {
    faulty(match error.kind() {
        csv::ErrorKind::Utf8 { pos, .. } => {
            let line = pos.as_ref().map_or(1, csv::Position::line);
            format!("the table is not UTF-8, as its line {line} shows; send it as UTF-8")
        }
        _ => format!("the table cannot be read: {error}"),
    })
}

/// The text of a line without the byte order mark that the first one may begin with.
#[must_use]
pub fn without_mark(text: &[u8], line: u64) -> &[u8] {
    let rest = text.strip_prefix(b"\xef\xbb\xbf").filter(|_| line == 1);
    rest.unwrap_or(text)
}

/// The delimiter that a line `sep=;` names, as Excel writes it before the titles.
fn separator_line(first: &[u8]) -> Option<u8> {
    match without_mark(first, 1).strip_prefix(b"sep=")? {
        [mark @ (b',' | b';' | b'\t' | b'|'), rest @ ..] if rest.trim_ascii().is_empty() => {
            Some(*mark)
        }
        _ => None,
    }
}

/// The delimiter of the fields, by the line of titles: a tab if there is one outside of quotes, else a semicolon, else a comma.
fn delimiter(header: &[u8]) -> u8 {
    let mut quoted = false;
    let outside: Vec<u8> = header
        .iter()
        .copied()
        .filter(|byte| {
            quoted ^= *byte == b'"';
            !quoted
        })
        .collect();
    let found = [b'\t', b';']
        .into_iter()
        .find(|mark| outside.contains(mark));
    found.unwrap_or(b',')
}

/// The decimal mark of a table.
#[derive(Debug, Clone, Copy, Default)]
pub struct Decimals {
    /// Whether numbers may have a decimal comma.
    comma: bool,
    /// The decimal mark of the first number that has one.
    seen: Option<char>,
}

impl Decimals {
    /// The decimal mark of a table with this delimiter is not known yet.
    #[must_use]
    fn of(delimiter: u8) -> Decimals {
        Decimals {
            comma: delimiter != b',',
            seen: None,
        }
    }

    /// Reads a number; `None` if the field is not a number.
    ///
    /// # Errors
    /// The number has another decimal mark than those before it, as separators of thousands have.
    pub fn number(&mut self, field: &str) -> Result<Option<f64>, String> {
        let Some(number) = number(field, self.comma) else {
            return Ok(None);
        };
        if let Some(mark) = field.chars().find(|mark| [',', '.'].contains(mark)) {
            let seen = *self.seen.get_or_insert(mark);
            if seen != mark {
                return Err(format!(
                    "`{field}` has a `{mark}`, and a number before it a `{seen}` as its decimal mark; use one mark, and none between thousands"
                ));
            }
        }
        Ok(Some(number))
    }
}

/// Reads a number, whose decimal mark may be a comma if `decimal_comma` is set.
fn number(field: &str, decimal_comma: bool) -> Option<f64> {
    let plain = field.parse().ok();
    plain.or_else(|| {
        let pointed = field.replacen(',', ".", 1);
        (decimal_comma && !field.contains('.')).then(|| pointed.parse().ok())?
    })
}

/// Whether a number comes back as it was written. A whole number such as `007`, `+7`, or one of 20 digits does not.
fn is_exact(field: &str) -> bool {
    let digits = field.strip_prefix(['-', '+']).unwrap_or(field);
    let padded = digits.len() > 1 && digits.starts_with('0');
    !digits.bytes().all(|byte| byte.is_ascii_digit())
        || digits.len() <= EXACT_DIGITS && !padded && !field.starts_with('+')
}

/// A row by the titles of its columns.
type JsonRow = Map<String, Value>;

/// Rows as JSON objects, one per line.
pub(crate) struct JsonRows<R: BufRead> {
    source: R,
    /// Number of lines that were read.
    lines: u64,
    /// The titles of the columns: the members of the first row.
    pub titles: Vec<Title>,
    /// Rows that were read ahead, each with its line.
    ahead: VecDeque<(u64, JsonRow)>,
}

impl<R: BufRead> JsonRows<R> {
    /// Reads the first rows.
    ///
    /// # Errors
    /// `faulty-table`
    pub(crate) fn new(source: R) -> Result<JsonRows<R>> {
        let mut rows = JsonRows {
            source,
            lines: 0,
            titles: Vec::new(),
            ahead: VecDeque::new(),
        };
        let mut bytes = 0;
        while rows.ahead.len() < ROWS && bytes < LINE_BYTES_MAX {
            let Some((row, length)) = rows.fetch()? else {
                break;
            };
            bytes += length;
            rows.ahead.push_back((rows.lines, row));
        }
        let names = rows
            .ahead
            .front()
            .into_iter()
            .flat_map(|(_, row)| row.keys());
        let first_value = |name: &String| {
            let mut values = rows.ahead.iter().filter_map(|(_, row)| row.get(name));
            values.find(|value| !value.is_null())
        };
        let titles = names.map(|name| Title {
            name: name.clone(),
            unit: None,
            text: first_value(name).is_some_and(Value::is_string),
            text_if_copied: false,
        });
        rows.titles = titles.collect();
        require_few(rows.titles.len())?;
        Ok(rows)
    }

    /// Some more rows, none at the end.
    fn read(&mut self) -> Result<Chunk> {
        let mut values = empty(&self.titles);
        for _ in 0..ROWS {
            let Some((line, mut row)) = self.row()? else {
                break;
            };
            let wrong = |detail| faulty(format!("line {line}: {detail}"));
            for (column, values) in self.titles.iter().zip(&mut values) {
                match (values, row.remove(&column.name)) {
                    (Values::Texts(texts), Some(Value::String(text))) => texts.push(Some(text)),
                    (Values::Texts(texts), Some(Value::Null)) => texts.push(None),
                    (Values::Numbers(numbers), Some(Value::Null)) => numbers.push(f64::NAN),
                    (Values::Numbers(numbers), Some(value)) if value.is_number() => {
                        numbers.push(value.as_f64().unwrap_or(f64::NAN));
                    }
                    (_, Some(value)) => {
                        return Err(wrong(format!(
                            "`{}` is {value}, which has another type than the first value of this column",
                            column.name
                        )));
                    }
                    (_, None) => {
                        return Err(wrong(format!("the member `{}` is missing", column.name)));
                    }
                }
            }
            if let Some(other) = row.keys().next() {
                let detail = format!("the member `{other}` is not in the first row");
                return Err(wrong(detail));
            }
        }
        Ok(values)
    }

    fn row(&mut self) -> Result<Option<(u64, JsonRow)>> {
        match self.ahead.pop_front() {
            Some(next) => Ok(Some(next)),
            None => Ok(self.fetch()?.map(|(row, _)| (self.lines, row))),
        }
    }

    /// Reads the next line that is not blank: its row and its length in bytes.
    fn fetch(&mut self) -> Result<Option<(JsonRow, usize)>> {
        loop {
            let mut text = Vec::new();
            let mut line = (&mut self.source).take(LINE_BYTES_MAX as u64);
            let read = line.read_until(b'\n', &mut text)?;
            self.lines += 1;
            if read == 0 {
                return Ok(None);
            }
            let text = without_mark(&text, self.lines);
            if text.iter().all(u8::is_ascii_whitespace) {
                continue;
            }
            return match serde_json::from_slice(text) {
                Ok(Strict(Value::Object(row))) => Ok(Some((row, read))),
                Ok(_) => Err(faulty(format!(
                    "line {}: expected an object, a member for each column",
                    self.lines
                ))),
                Err(error) => Err(faulty(format!(
                    "line {}, column {}: {}",
                    self.lines,
                    error.column(),
                    without_position(&error)
                ))),
            };
        }
    }
}

impl<R: BufRead> Iterator for CsvRows<R> {
    type Item = Result<Chunk>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read().map(unless_empty).transpose()
    }
}

impl<R: BufRead> Iterator for JsonRows<R> {
    type Item = Result<Chunk>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read().map(unless_empty).transpose()
    }
}

fn empty(titles: &[Title]) -> Chunk {
    let empty = |title: &Title| match title.text {
        true => Values::Texts(Vec::new()),
        false => Values::Numbers(Vec::new()),
    };
    titles.iter().map(empty).collect()
}

fn unless_empty(chunk: Chunk) -> Option<Chunk> {
    let some = chunk.first().is_some_and(|column| !column.is_empty());
    some.then_some(chunk)
}

#[cfg(test)]
mod tests {
    use std::io::BufReader;

    use bytes::Bytes;

    use super::*;
    use crate::read::{TableForm, TableRows, TableSource};
    use crate::titles::NamedColumns;

    fn rows(form: TableForm, text: &'static str) -> Result<TableRows> {
        let source = TableSource::Memory(Bytes::from_static(text.as_bytes()));
        TableRows::new(form, source, text.len())
    }

    #[test]
    fn a_separator_line_names_the_delimiter_and_counts_as_a_line() {
        let plain = "creepage_x;km\r\n0,001;2\r\n";
        for text in [
            "sep=;\r\ncreepage_x;km\r\n0,001;2\r\n",
            "\u{feff}sep=;\ncreepage_x;km\n0,001;2\n",
        ] {
            let (mut marked, mut plain) = (
                rows(TableForm::Csv, text).unwrap(),
                rows(TableForm::Csv, plain).unwrap(),
            );
            assert_eq!(marked.titles, plain.titles);
            assert_eq!(
                marked.next().unwrap().unwrap(),
                plain.next().unwrap().unwrap()
            );
        }
        let tabs = rows(TableForm::Csv, "sep=\t\ncreepage_x\tkm\n1\tx\n2\n")
            .unwrap()
            .next();
        let refused = tabs.unwrap().unwrap_err().to_string();
        assert!(
            refused.contains("line 4: the number of fields is 1"),
            "{refused}"
        );
    }

    #[test]
    fn copied_names_and_padded_or_long_numbers_stay_as_they_are_written() {
        let text = "creepage_x,axle_no,code,order,km\n0.1,1,007,12345678901234567890,1.50\n0.2,2,010,1,2.0\n";
        let mut rows = rows(TableForm::Csv, text).unwrap();
        let named = ["code", "order"].map(|title| (title.to_owned(), String::new()));
        let columns = rows.named(&NamedColumns(Some(named.to_vec()))).unwrap();
        let texts: Vec<bool> = columns.iter().map(|column| column.text).collect();
        assert_eq!(texts, [false, true, true, true, false]);
        let values = rows.next().unwrap().unwrap();
        let texts =
            |values: [&str; 2]| Values::Texts(values.map(|text| Some(text.to_owned())).to_vec());
        assert_eq!(values[1], texts(["1", "2"]));
        assert_eq!(values[2], texts(["007", "010"]));
        assert_eq!(values[3], texts(["12345678901234567890", "1"]));
        assert_eq!(values[4], Values::Numbers(vec![1.5, 2.0]));
    }

    #[test]
    fn csv_and_ndjson_of_the_same_rows_are_the_same_columns() {
        let csv = "\u{feff}creepage_x, km ,section\r\n0.1,,a\r\n-2e-3,37.5,\"b, c\"\r\n";
        let json = "{\"creepage_x\":0.1,\"km\":null,\"section\":\"a\"}\n\n{\"section\":\"b, c\",\"km\":37.5,\"creepage_x\":-2e-3}";
        let mut by_csv = rows(TableForm::Csv, csv).unwrap();
        let mut by_json = rows(TableForm::Ndjson, json).unwrap();
        let kinds = |titles: &[Title]| -> Vec<(String, bool)> {
            let kinds = titles.iter().map(|title| (title.name.clone(), title.text));
            kinds.collect()
        };
        assert_eq!(kinds(&by_csv.titles), kinds(&by_json.titles));
        let columns = by_csv.named(&NamedColumns::default()).unwrap();
        let pointers = columns.iter().map(|column| column.pointer.as_deref());
        assert_eq!(
            pointers.collect::<Vec<_>>(),
            [Some("/motion/creepage_x"), None, None]
        );
        let values = by_csv.next().unwrap().unwrap();
        assert_eq!(
            format!("{values:?}"),
            format!("{:?}", by_json.next().unwrap().unwrap())
        );
        assert_eq!(values[0], Values::Numbers(vec![0.1, -2e-3]));
        assert_eq!(
            values[2],
            Values::Texts(["a", "b, c"].map(|text| Some(text.to_owned())).to_vec())
        );
        assert!(by_csv.next().is_none() && by_json.next().is_none());
    }

    #[test]
    fn tables_of_simulations_are_read_with_their_units_and_decimal_commas() {
        let comma =
            "time,Normal force,longitudinal creepage,spin\n[s],[kN],[-],[1/m]\n0.1,80,0.001,0.4\n";
        let semicolon = "time;Normal force [kN];longitudinal creepage;spin (1/m);;\r\n0,1;80;0,001;4,0e-1;;\r\n";
        let tab = "time\tnormal_force\tcreepage_x\tspin\ns\tkN\t-\t1/m\n0.1\t80\t0.001\t0.4\n";
        for text in [comma, semicolon, tab] {
            let mut rows = rows(TableForm::Csv, text).unwrap();
            let columns = rows.named(&NamedColumns::default()).unwrap();
            let places: Vec<_> = (columns.iter())
                .map(|column| (column.pointer.as_deref(), column.factor))
                .collect();
            let expected = [
                (None, 1.0),
                (Some("/load/normal_force_n"), 1e3),
                (Some("/motion/creepage_x"), 1.0),
                (Some("/motion/spin_per_mm"), 1e-3),
            ];
            assert_eq!(places, expected, "{text}");
            let values = rows.next().unwrap().unwrap();
            let numbers = [0.1, 80.0, 0.001, 0.4].map(|number| Values::Numbers(vec![number]));
            assert_eq!(values, numbers, "{text}");
        }
    }

    #[test]
    fn the_first_value_of_a_column_decides_its_type() {
        let csv = "remark,s,creepage_x\n,,0.1\n\n,7,0.2\nb,8,\n";
        let json = "{\"remark\":null,\"s\":null,\"creepage_x\":0.1}\n{\"remark\":null,\"s\":7,\"creepage_x\":0.2}\n\
                    {\"remark\":\"b\",\"s\":8,\"creepage_x\":null}";
        for (form, text) in [(TableForm::Csv, csv), (TableForm::Ndjson, json)] {
            let mut rows = rows(form, text).unwrap();
            let texts = rows.titles.iter().map(|title| (&*title.name, title.text));
            let mut texts: Vec<_> = texts.collect();
            texts.sort_unstable();
            assert_eq!(
                texts,
                [("creepage_x", false), ("remark", true), ("s", false)]
            );
            let place = rows.titles.iter().position(|title| title.name == "remark");
            let values = rows.next().unwrap().unwrap();
            let remark = Values::Texts(vec![None, None, Some("b".to_owned())]);
            assert_eq!(values[place.unwrap()], remark);
        }
        let csv = rows(TableForm::Csv, "s,remark\n1,\n2,\nx,a\n")
            .unwrap()
            .next();
        let told = csv.unwrap().unwrap_err().to_string();
        assert!(told.contains("line 4, column `s`"), "{told}");
    }

    #[test]
    fn numbers_with_separators_of_thousands_are_refused() {
        for text in [
            "normal_force_n;creepage_x\n80.000;0,001\n",
            "normal_force_n\tcreepage_x\n80,000\t0.001\n",
            "normal_force_n;creepage_x\n80000;0,001\n80.000;0,001\n",
        ] {
            let read = rows(TableForm::Csv, text).unwrap().next().unwrap();
            let told = read.unwrap_err().to_string();
            assert!(told.contains("thousands"), "{told}");
        }
    }

    #[test]
    fn an_empty_first_row_is_a_row() {
        let mut rows = rows(TableForm::Csv, "km,creepage_x\n,\n2,3\n").unwrap();
        assert_eq!(rows.next().unwrap().unwrap()[0].len(), 2);
    }

    #[test]
    fn faults_name_the_line() {
        let read = |form, text| rows(form, text).and_then(|mut rows| rows.next().transpose());
        let csv = |text| read(TableForm::Csv, text);
        let json = |text| read(TableForm::Ndjson, text);
        for (read, words) in [
            (csv("creepage_x\n0.1\nx\n"), ["line 3", "creepage_x"]),
            (
                csv("creepage_x\r\n0.1\r\n\r\nx\r\n"),
                ["line 4", "creepage_x"],
            ),
            (csv("creepage_x,s\n0.1\n"), ["line 2", "fields is 1"]),
            (
                csv("creepage_x,s\n\n0,\"a\nb\"\n\nx,"),
                ["line 6", "creepage_x"],
            ),
            (json("{\"s\":1}\n{\"b\":1}"), ["line 2", "`s`"]),
            (json("{\"s\":1}\n{\"s\":\"x\"}"), ["line 2", "type"]),
            (json("{\"s\":1}\n{\"s\":1,\"b\":2}"), ["line 2", "`b`"]),
            (
                json("{\"s\":1}\nnothing"),
                ["line 2, column 2: expected", ""],
            ),
            (json("{\"s\":1}\n[2]"), ["line 2", "an object"]),
            (json("{\"s\":1,\"s\":2}"), ["line 1", "written twice"]),
        ] {
            let fault = format!("{:?}", read.expect_err("it is faulty"));
            assert!(words.iter().all(|word| fault.contains(word)), "{fault}");
        }
    }

    #[test]
    fn a_row_that_does_not_end_is_refused_before_it_fills_the_memory() {
        for begin in ["a,b\n1,\"", "a,b\n1,2\n3,4\n1,\"\n"] {
            let source = begin.as_bytes().chain(io::repeat(b'x'));
            let rows = CsvRows::new(BufReader::new(source), 1 << 16);
            let refused = rows.and_then(|mut rows| rows.next().transpose().map(|_| ()));
            let refused = format!("{:?}", refused.unwrap_err());
            assert!(refused.contains("longer than 65536 bytes"), "{refused}");
        }
    }
}
