//! Rows as CSV and NDJSON, some lines at a time. The first value of a column decides whether it holds numbers or texts.

use std::collections::VecDeque;
use std::io::{self, BufRead, Chain, Cursor, Read};

use serde_json::{Map, Value};

use railhead_contact::evaluate::varied::Values;

pub use csv::StringRecord;

use crate::error::{Result, TableError, faulty};
use crate::table::{Chunk, Title};
use crate::titles::{Decimals, delimiter, is_line_of_units, is_text, number, require_few};

/// Rows that are read at once.
const ROWS: usize = 8192;
/// Longest line in bytes.
const LINE_BYTES_MAX: u64 = 1 << 20;

/// A source from its first line on, with an end of line behind it.
type Ended<R> = Chain<Chain<Cursor<Vec<u8>>, R>, &'static [u8]>;

/// A source of which a record takes a bounded number of bytes.
struct Bounded<R> {
    source: R,
    /// Most bytes of a record.
    max: usize,
    /// What is left of them.
    left: usize,
}

impl<R: Read> Read for Bounded<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.source.read(buffer)?;
        let left = self.left.checked_sub(read);
        let too_long = || io::Error::other(format!("a row is longer than {} bytes", self.max));
        self.left = left.ok_or_else(too_long)?;
        Ok(read)
    }
}

/// Rows in CSV, whose first line names the columns; fields are parted by what parts the titles, commas, semicolons or tabs. A second line may give
/// the units.
pub struct CsvRows<R: Read> {
    reader: csv::Reader<Bounded<Ended<R>>>,
    /// The decimal mark of its numbers.
    pub decimals: Decimals,
    /// The titles of the columns.
    pub titles: Vec<Title>,
    /// The next row and its line, if there is one.
    record: Option<(u64, StringRecord)>,
    /// Rows after it that were read to find the first values of columns.
    ahead: VecDeque<(u64, StringRecord)>,
}

impl<R: BufRead> CsvRows<R> {
    /// Reads the header and the first row; no row may take more than `record_max` bytes.
    ///
    /// # Errors
    /// `faulty-table`
    pub fn new(mut source: R, record_max: usize) -> Result<CsvRows<R>> {
        let mut first = Vec::new();
        let read = (&mut source).take(LINE_BYTES_MAX);
        let read = { read }.read_until(b'\n', &mut first);
        read?;
        if first.starts_with(b"\xff\xfe") || first.starts_with(b"\xfe\xff") {
            return Err(faulty("the table is UTF-16, not UTF-8; send it as UTF-8"));
        }
        let delimiter = delimiter(&first);
        // With this end of line the reader counts lines exactly; other files end their lines with `\r` alone.
        let terminator = match first.ends_with(b"\r\n") || !first.contains(&b'\r') {
            true => csv::Terminator::Any(b'\n'),
            false => csv::Terminator::CRLF,
        };
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .terminator(terminator)
            .flexible(true)
            .delimiter(delimiter)
            // The last line ends as the others do.
            .from_reader(Bounded {
                max: record_max,
                left: record_max + first.len(),
                source: Cursor::new(first).chain(source).chain(&b"\n"[..]),
            });
        let titles = reader.headers();
        let titles = titles.map_err(|error| unread(&error))?;
        require_few(titles.len())?;
        let titles: Vec<String> = titles
            .iter()
            .map(|title| title.trim_start_matches('\u{feff}').to_owned())
            .collect();
        let mut rows = CsvRows {
            reader,
            decimals: Decimals::of(delimiter),
            titles: Vec::new(),
            record: Some((0, StringRecord::new())),
            ahead: VecDeque::new(),
        };
        rows.advance()?;
        let second = rows.record.as_ref().map(|(_, record)| record.clone());
        let units = second.filter(|units| {
            // Texts have no units.
            let said = |(title, unit): (&String, &str)| !is_text(title) && !unit.is_empty();
            units.len() == titles.len()
                && titles.iter().zip(units).any(said)
                && is_line_of_units(units.iter())
        });
        if units.is_some() {
            rows.advance()?;
        }
        let unit = |place: usize| units.as_ref().and_then(|units| units.get(place));
        let texts = rows.texts(titles.len(), record_max)?;
        let titles = titles.into_iter().enumerate().map(|(place, name)| Title {
            name,
            unit: unit(place).map(str::to_owned),
            text: texts[place],
        });
        rows.titles = titles.collect();
        Ok(rows)
    }

    /// Whether the first value of each column is a text. Reads ahead while columns are empty, at most [`ROWS`] rows and about so many bytes.
    fn texts(&mut self, columns: usize, bytes_max: usize) -> Result<Vec<bool>> {
        let mut texts = vec![None; columns];
        let mut look = |record: &StringRecord| {
            for (field, text) in record.iter().zip(&mut texts) {
                if text.is_none() && !field.is_empty() {
                    *text = Some(number(field, self.decimals.comma).is_none());
                }
            }
            texts.iter().any(Option::is_none)
        };
        let mut open = self.record.as_ref().is_some_and(|(_, record)| look(record));
        let mut bytes = 0;
        while open && self.ahead.len() < ROWS && bytes < bytes_max {
            let mut record = StringRecord::new();
            let Some(line) = next_record(&mut self.reader, &mut record)? else {
                break;
            };
            open = look(&record);
            bytes += record.as_slice().len();
            self.ahead.push_back((line, record));
        }
        Ok(texts.into_iter().map(Option::unwrap_or_default).collect())
    }

    /// Some more rows, none at the end.
    fn read(&mut self) -> Result<Chunk> {
        let mut values = empty(&self.titles);
        for _ in 0..ROWS {
            let Some((line, record)) = &self.record else {
                break;
            };
            if record.len() != self.titles.len() {
                return Err(faulty(format!(
                    "line {line} has {} fields, the header has {}",
                    record.len(),
                    self.titles.len()
                )));
            }
            for ((field, column), values) in record.iter().zip(&self.titles).zip(&mut values) {
                let wrong = || {
                    faulty(format!(
                        "line {line}, column `{}`: `{field}` is not a number; the first value of this column is a number",
                        column.name
                    ))
                };
                match values {
                    Values::Texts(texts) => {
                        texts.push(Some(field.to_owned()).filter(|text| !text.is_empty()));
                    }
                    Values::Numbers(numbers) if field.is_empty() => numbers.push(f64::NAN),
                    Values::Numbers(numbers) => {
                        let number = self.decimals.number(field);
                        let number = number.map_err(|detail| {
                            faulty(format!("line {line}, column `{}`: {detail}", column.name))
                        })?;
                        numbers.push(number.ok_or_else(wrong)?);
                    }
                }
            }
            self.advance()?;
        }
        Ok(values)
    }

    /// The fields of the next row and the line on which it begins, whatever the fields hold.
    ///
    /// # Errors
    /// `faulty-table`
    pub fn record(&mut self) -> Result<Option<(u64, StringRecord)>> {
        let next = self.record.clone();
        self.advance()?;
        Ok(next)
    }

    /// Goes on to the next record.
    fn advance(&mut self) -> Result<()> {
        if let Some(next) = self.ahead.pop_front() {
            self.record = Some(next);
        } else if let Some((line, record)) = &mut self.record {
            match next_record(&mut self.reader, record)? {
                Some(next) => *line = next,
                None => self.record = None,
            }
        }
        Ok(())
    }
}

/// Reads the next record that is no blank line, and the number of the line on which it begins.
fn next_record<R: Read>(
    reader: &mut csv::Reader<Bounded<Ended<R>>>,
    record: &mut StringRecord,
) -> Result<Option<u64>> {
    loop {
        let source = reader.get_mut();
        source.left = source.max;
        let more = reader.read_record(record);
        if !more.map_err(|error| unread(&error))? {
            return Ok(None);
        }
        if record.len() > 1 || record.get(0) != Some("") {
            let inside = record.as_slice().bytes().filter(|byte| *byte == b'\n');
            let after = reader.position().line();
            return Ok(Some(after.saturating_sub(1 + inside.count() as u64)));
        }
    }
}

/// The refusal of a CSV table that cannot be read.
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

/// A row by the titles of its columns.
type JsonRow = Map<String, Value>;

/// Rows as JSON objects, one in a line.
pub(crate) struct JsonRows<R: BufRead> {
    source: R,
    /// Lines that were read.
    lines: u64,
    /// The line of the next row.
    line: u64,
    /// The titles of the columns: the members of the first row.
    pub titles: Vec<Title>,
    row: Option<JsonRow>,
    /// Rows after it that were read to find the first values of columns.
    ahead: VecDeque<(u64, JsonRow)>,
}

impl<R: BufRead> JsonRows<R> {
    /// Reads the first row.
    ///
    /// # Errors
    /// `faulty-table`
    pub(crate) fn new(source: R) -> Result<JsonRows<R>> {
        let mut rows = JsonRows {
            source,
            lines: 0,
            line: 0,
            titles: Vec::new(),
            row: None,
            ahead: VecDeque::new(),
        };
        rows.advance()?;
        let members = rows.row.iter().flatten();
        let names: Vec<String> = members.map(|(name, _)| name.clone()).collect();
        require_few(names.len())?;
        let mut texts = vec![None; names.len()];
        let mut look = |row: &JsonRow| {
            for (name, text) in names.iter().zip(&mut texts) {
                let value = row.get(name).filter(|value| !value.is_null());
                *text = text.or(value.map(Value::is_string));
            }
            texts.iter().any(Option::is_none)
        };
        let mut open = rows.row.as_ref().is_some_and(&mut look);
        let mut bytes = 0;
        while open && rows.ahead.len() < ROWS && bytes < LINE_BYTES_MAX {
            let Some((line, row, length)) = rows.fetch()? else {
                break;
            };
            open = look(&row);
            bytes += length;
            rows.ahead.push_back((line, row));
        }
        let titles = names.into_iter().zip(texts).map(|(name, text)| Title {
            name,
            unit: None,
            text: text.unwrap_or_default(),
        });
        rows.titles = titles.collect();
        Ok(rows)
    }

    /// Some more rows, none at the end.
    fn read(&mut self) -> Result<Chunk> {
        let mut values = empty(&self.titles);
        for _ in 0..ROWS {
            let Some(mut row) = self.row.take() else {
                break;
            };
            for (column, values) in self.titles.iter().zip(&mut values) {
                match (values, row.remove(&column.name)) {
                    (Values::Texts(texts), Some(Value::String(text))) => texts.push(Some(text)),
                    (Values::Texts(texts), Some(Value::Null)) => texts.push(None),
                    (Values::Numbers(numbers), Some(Value::Null)) => numbers.push(f64::NAN),
                    (Values::Numbers(numbers), Some(value)) if value.is_number() => {
                        numbers.push(value.as_f64().unwrap_or(f64::NAN));
                    }
                    (_, Some(value)) => {
                        return Err(self.wrong(&format!(
                            "`{}` is {value}, which has another type than the first value of this column",
                            column.name
                        )));
                    }
                    (_, None) => {
                        return Err(self.wrong(&format!("the member `{}` is missing", column.name)));
                    }
                }
            }
            if let Some(other) = row.keys().next() {
                let detail = format!("the member `{other}` is not in the first row");
                return Err(self.wrong(&detail));
            }
            self.advance()?;
        }
        Ok(values)
    }

    /// Goes on to the next row.
    fn advance(&mut self) -> Result<()> {
        let next = match self.ahead.pop_front() {
            Some(next) => Some(next),
            None => self.fetch()?.map(|(line, row, _)| (line, row)),
        };
        let (line, row) = next.unzip();
        self.line = line.unwrap_or(self.line);
        self.row = row;
        Ok(())
    }

    /// Reads the next line that is not blank: its number, its row and its length.
    fn fetch(&mut self) -> Result<Option<(u64, JsonRow, u64)>> {
        loop {
            let mut text = Vec::new();
            let mut line = (&mut self.source).take(LINE_BYTES_MAX);
            let read = line.read_until(b'\n', &mut text)?;
            self.lines += 1;
            if read == 0 {
                return Ok(None);
            }
            let row = without_mark(&text, self.lines);
            if row.iter().all(u8::is_ascii_whitespace) {
                continue;
            }
            let row = serde_json::from_slice(row);
            let row = row.map_err(|error| faulty(format!("line {}: {error}", self.lines)))?;
            return Ok(Some((self.lines, row, read as u64)));
        }
    }

    fn wrong(&self, detail: &str) -> TableError {
        faulty(format!("line {}: {detail}", self.line))
    }
}

impl<R: BufRead> Iterator for CsvRows<R> {
    type Item = Result<Chunk>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read().map(there).transpose()
    }
}

impl<R: BufRead> Iterator for JsonRows<R> {
    type Item = Result<Chunk>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read().map(there).transpose()
    }
}

fn empty(titles: &[Title]) -> Chunk {
    let empty = |title: &Title| match title.text {
        true => Values::Texts(Vec::new()),
        false => Values::Numbers(Vec::new()),
    };
    titles.iter().map(empty).collect()
}

/// The chunk, unless it has no row.
fn there(chunk: Chunk) -> Option<Chunk> {
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
    fn csv_and_ndjson_of_the_same_rows_are_the_same_columns() {
        let csv = "\u{feff}creepage_x, km ,section\r\n0.1,,a\r\n-2e-3,37.5,\"b, c\"\r\n";
        let json = "{\"creepage_x\":0.1,\"km\":null,\"section\":\"a\"}\n\n{\"section\":\"b, c\",\"km\":37.5,\"creepage_x\":-2e-3}";
        let mut by_csv = rows(TableForm::Csv, csv).unwrap();
        let mut by_json = rows(TableForm::Ndjson, json).unwrap();
        assert_eq!(by_csv.titles, by_json.titles);
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
        let semicolon =
            "time;Normal force [kN];longitudinal creepage;spin (1/m)\r\n0,1;80;0,001;4,0e-1\r\n";
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
            (csv("creepage_x,s\n0.1\n"), ["line 2", "1 fields"]),
            (
                csv("creepage_x,s\n\n0,\"a\nb\"\n\nx,"),
                ["line 6", "creepage_x"],
            ),
            (json("{\"s\":1}\n{\"b\":1}"), ["line 2", "`s`"]),
            (json("{\"s\":1}\n{\"s\":\"x\"}"), ["line 2", "type"]),
            (json("{\"s\":1}\n{\"s\":1,\"b\":2}"), ["line 2", "`b`"]),
            (json("{\"s\":1}\nnothing"), ["line 2", "expected"]),
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
