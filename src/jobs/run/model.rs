//! Stored form and state of a run: head, chunks and progress.
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Read;
use std::ops::Not;

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::{JobsError, Result};
use crate::model::{Batch, RunRecord, State};
use railhead_contact::evaluate::varied::{Values, VariedColumn, row_of};
use railhead_tables::table::{TableColumn, TableKind};
use railhead_tables::titles::TitledColumn;

/// Version of the stored form of heads and chunks.
const FORM: u32 = 1;

/// Name of the column with the reason why a row has no answer.
pub const REASON: &str = "reason";
/// Name of the column with the codes of the remarks of a row.
pub const REMARKS: &str = "remarks";

/// Converts a column of rows to a column of a table.
#[must_use]
pub fn table_column(values: Values) -> TableColumn {
    match values {
        Values::Numbers(numbers) => TableColumn::Numbers(numbers),
        Values::Texts(texts) => TableColumn::Texts(texts),
    }
}

/// Data that all chunks of a run share.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunHead {
    form: u32,
    /// The case of the first row. It names the cross-sections that columns name.
    pub case: Value,
    /// The submitted columns in their order.
    pub columns: Vec<TitledColumn>,
    /// Names of the numeric result columns.
    pub numbers: Vec<String>,
    /// Stored profiles that rows refer to.
    #[serde(default)]
    pub profiles: BTreeMap<String, Value>,
    /// The requested method.
    pub method: String,
    /// Always false. Stored runs have this member, and a repeated submission is recognised by the bytes of its head.
    #[serde(default)]
    from_neighbours: bool,
    /// Whether the answers have the column of reasons, which older runs lack.
    #[serde(default)]
    pub with_reasons: bool,
    /// Whether the answers have the column of remarks, which older runs lack.
    #[serde(default, skip_serializing_if = "Not::not")]
    pub with_remarks: bool,
    /// Number of rows.
    pub rows: u64,
    /// Number of rows of each chunk but the last.
    pub chunk_rows: u32,
    /// Places and values of the first row, which are inserted into the template; empty if `case` is stored.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    first_row: Vec<(String, Value)>,
}

/// The part of the stored head that runs with the same template share.
#[derive(Debug, Serialize, Deserialize)]
struct CommonPart<'a> {
    template: Cow<'a, Value>,
    profiles: Cow<'a, BTreeMap<String, Value>>,
}

impl RunHead {
    /// A head of the current version, without rows.
    #[must_use]
    pub fn new(
        case: Value,
        columns: Vec<TitledColumn>,
        numbers: Vec<String>,
        method: String,
    ) -> Self {
        RunHead {
            form: FORM,
            case,
            columns,
            numbers,
            profiles: BTreeMap::new(),
            method,
            from_neighbours: false,
            with_reasons: true,
            with_remarks: true,
            rows: 0,
            chunk_rows: 0,
            first_row: Vec::new(),
        }
    }

    /// The JSON text of the whole head, which identifies a submission.
    #[must_use]
    pub fn whole(&self) -> Vec<u8> {
        // An older version identified the same submission without this member.
        let older = RunHead {
            with_remarks: false,
            ..self.clone()
        };
        serde_json::to_vec(&older).unwrap_or_default()
    }

    /// The stored form: the part that runs with the same template share, and the rest. `first_row` are the values that turn
    /// the template into the case.
    #[must_use]
    pub fn into_parts(self, template: &Value, first_row: Vec<(String, Value)>) -> (Bytes, Bytes) {
        let common = CommonPart {
            template: Cow::Borrowed(template),
            profiles: Cow::Borrowed(&self.profiles),
        };
        let common = serde_json::to_vec(&common).unwrap_or_default();
        let own = RunHead {
            case: Value::Null,
            profiles: BTreeMap::new(),
            first_row,
            ..self
        };
        let own = serde_json::to_vec(&own).unwrap_or_default();
        (common.into(), own.into())
    }

    /// Reads a stored head from its common part and the rest. Runs of earlier versions have everything in the first.
    ///
    /// # Errors
    /// The head is damaged, or of another version.
    pub fn read(common: &[u8], own: Option<&[u8]>) -> Result<RunHead> {
        let damaged = |reason: String| JobsError::Damaged(format!("the head of a run: {reason}"));
        let text = own.unwrap_or(common);
        let mut head: RunHead =
            serde_json::from_slice(text).map_err(|error| damaged(error.to_string()))?;
        if head.form != FORM {
            return Err(damaged(format!("it is of form {}", head.form)));
        }
        if own.is_some() {
            let common: CommonPart<'_> =
                serde_json::from_slice(common).map_err(|error| damaged(error.to_string()))?;
            head.profiles = common.profiles.into_owned();
            let first_row: Vec<VariedColumn> = std::mem::take(&mut head.first_row)
                .into_iter()
                .map(|(pointer, value)| VariedColumn {
                    pointer,
                    values: match value {
                        Value::Number(number) => {
                            Values::Numbers(vec![number.as_f64().unwrap_or(f64::NAN)])
                        }
                        text => Values::Texts(vec![text.as_str().map(str::to_owned)]),
                    },
                })
                .collect();
            let case = row_of(&common.template, &first_row, 0);
            head.case =
                case.map_err(|(pointer, reason)| damaged(format!("{pointer}: {reason}")))?;
        }
        Ok(head)
    }

    /// Names and types of the result columns in their order: row, copied columns, status and method, numbers, reason, remarks.
    #[must_use]
    pub fn answers(&self) -> Vec<(String, TableKind)> {
        let carried = self
            .columns
            .iter()
            .filter(|column| column.pointer.is_none());
        let carried = carried.map(|column| (column.name.clone(), column.kind()));
        let text = |name: &str| (name.to_owned(), TableKind::Texts);
        let words = ["status", "method"].map(text);
        let numbers = self.numbers.iter();
        let numbers = numbers.map(|name| (name.clone(), TableKind::Numbers));
        let row = ("row".to_owned(), TableKind::Integers);
        std::iter::once(row)
            .chain(carried)
            .chain(words)
            .chain(numbers)
            .chain(self.with_reasons.then(|| text(REASON)))
            .chain(self.with_remarks.then(|| text(REMARKS)))
            .collect()
    }

    /// The rows of a chunk.
    #[must_use]
    pub fn rows_of(&self, chunk: u32) -> std::ops::Range<u64> {
        let each = u64::from(self.chunk_rows);
        let begin = (u64::from(chunk) * each).min(self.rows);
        begin..(begin + each).min(self.rows)
    }
}

/// Signature of a stored chunk.
const MAGIC: &[u8] = b"RHROWS1\n";
/// Cheap compression, because chunks are decompressed before every solve.
const ZSTD_LEVEL: i32 = 1;
/// Length of a text that is absent.
const NO_TEXT: u64 = u64::MAX;

/// A chunk of rows of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunChunk {
    /// Number of its first row in the run.
    pub first_row: u64,
    /// Its columns, in the order of the head.
    pub columns: Vec<Values>,
}

impl RunChunk {
    /// The stored form: a signature, then a zstd frame with the first row and the number of rows (u64), and column by column
    /// the values: numbers as f64, texts with a length (u64) before each, all little-endian.
    ///
    /// # Errors
    /// Compression failed.
    pub fn to_bytes(&self) -> std::io::Result<Vec<u8>> {
        let rows = self.columns.first().map_or(0, Values::len);
        let mut plain = Vec::with_capacity(16 + 8 * rows * self.columns.len());
        plain.extend(self.first_row.to_le_bytes());
        plain.extend((rows as u64).to_le_bytes());
        for column in &self.columns {
            match column {
                Values::Numbers(numbers) => {
                    plain.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
                }
                Values::Texts(texts) => {
                    for text in texts {
                        let length = text.as_ref().map_or(NO_TEXT, |text| text.len() as u64);
                        plain.extend(length.to_le_bytes());
                        plain.extend(text.as_deref().unwrap_or_default().as_bytes());
                    }
                }
            }
        }
        let mut body = MAGIC.to_vec();
        body.extend(zstd::encode_all(plain.as_slice(), ZSTD_LEVEL)?);
        Ok(body)
    }

    /// Reads a stored chunk of a run with these columns.
    ///
    /// # Errors
    /// The chunk is damaged.
    pub fn read(body: &[u8], columns: &[TitledColumn]) -> Result<RunChunk> {
        let damaged = |what: String| JobsError::Damaged(format!("rows of a run: {what}"));
        let packed = body.strip_prefix(MAGIC);
        let packed = packed.ok_or_else(|| damaged("not the body of a chunk".to_owned()))?;
        let mut plain = Vec::new();
        let read = zstd::Decoder::new(packed).and_then(|mut text| text.read_to_end(&mut plain));
        read.map_err(|error| damaged(error.to_string()))?;
        let mut rest = plain.as_slice();
        let cut = || damaged("cut short".to_owned());
        let first_row = number(&mut rest).ok_or_else(cut)?;
        let rows = number(&mut rest).ok_or_else(cut)?;
        let column = |column: &TitledColumn| {
            if !column.text {
                let values = (0..rows).map(|_| number(&mut rest).map(f64::from_bits));
                return values.collect::<Option<_>>().map(Values::Numbers);
            }
            let texts = (0..rows).map(|_| {
                let length = number(&mut rest)?;
                if length == NO_TEXT {
                    return Some(None);
                }
                let (text, after) = rest.split_at_checked(usize::try_from(length).ok()?)?;
                rest = after;
                String::from_utf8(text.to_vec()).ok().map(Some)
            });
            texts.collect::<Option<_>>().map(Values::Texts)
        };
        let columns = columns.iter().map(column).collect::<Option<Vec<Values>>>();
        Ok(RunChunk {
            first_row,
            columns: columns.ok_or_else(cut)?,
        })
    }
}

fn number(rest: &mut &[u8]) -> Option<u64> {
    let (head, after) = rest.split_first_chunk::<8>()?;
    *rest = after;
    Some(u64::from_le_bytes(*head))
}

/// Divides the columns of a chunk into those that vary the case and those that are copied to the results.
pub(crate) fn parted(
    head: &RunHead,
    chunk: RunChunk,
) -> (Vec<VariedColumn>, Vec<(String, TableColumn)>) {
    let (mut varied, mut carried) = (Vec::new(), Vec::new());
    for (column, values) in head.columns.iter().zip(chunk.columns) {
        match &column.pointer {
            Some(pointer) => varied.push(VariedColumn {
                pointer: pointer.clone(),
                values,
            }),
            None => carried.push((column.name.clone(), table_column(values))),
        }
    }
    (varied, carried)
}

/// A run with its state.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Its chunks, as jobs of a batch.
    pub chunks: Batch,
    /// Its case, columns and sizes.
    pub head: RunHead,
    /// Number of rows without an answer in ended chunks, including chunks without a result.
    pub without_answer: u64,
    /// Progress from 0 to 1.
    pub progress: f64,
}

impl Run {
    /// Creates a run from its stored parts.
    #[must_use]
    pub fn new(chunks: Batch, head: RunHead, record: &RunRecord) -> Run {
        let each = u64::from(head.chunk_rows);
        let lost = chunks.in_state(State::Failed) + chunks.in_state(State::Cancelled);
        let missing = match record.last_lost {
            true => head.rows.next_multiple_of(each.max(1)) - head.rows,
            false => 0,
        };
        let (ended, all) = chunks.ended();
        #[expect(clippy::cast_precision_loss, reason = "far fewer chunks than 2^53")]
        let progress = (ended as f64 + record.running) / all.max(1) as f64;
        Run {
            without_answer: record.without_answer + lost * each - missing,
            progress: if ended == all { 1.0 } else { progress.min(1.0) },
            chunks,
            head,
        }
    }

    /// State of the run.
    #[must_use]
    pub fn state(&self) -> State {
        let number = |state| self.chunks.in_state(state);
        let (ended, all) = self.chunks.ended();
        if ended < all {
            let begun = ended + number(State::Running) > 0;
            return if begun { State::Running } else { State::Queued };
        }
        if number(State::Cancelled) > 0 {
            State::Cancelled
        } else if number(State::Succeeded) == 0 && number(State::Failed) > 0 {
            State::Failed
        } else {
            State::Succeeded
        }
    }

    /// Number of rows in ended chunks.
    #[must_use]
    pub fn rows_done(&self) -> u64 {
        let (ended, _) = self.chunks.ended();
        (ended * u64::from(self.head.chunk_rows)).min(self.head.rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_another_unit_are_converted_to_15_digits() {
        let column = |factor| TitledColumn {
            name: "Q [kN]".to_owned(),
            pointer: None,
            factor,
            unit: None,
            text: false,
        };
        assert_ne!(64.1 * 1e3, 64_100.0, "what the digits are for");
        assert_eq!(column(1e3).in_case(64.1), 64_100.0);
        assert_eq!(column(1e-3).in_case(-0.3), -3e-4);
        assert_eq!(column(1.0).in_case(0.1 + 0.2), 0.1 + 0.2);
        assert!(column(1e3).in_case(f64::NAN).is_nan());
    }

    #[test]
    fn a_chunk_comes_back_as_it_was_and_a_broken_one_is_refused() {
        let column = |text| TitledColumn {
            factor: 1.0,
            unit: None,
            name: "c".to_owned(),
            pointer: None,
            text,
        };
        let columns = [column(false), column(true)];
        let chunk = RunChunk {
            first_row: 70_000,
            columns: vec![
                Values::Numbers(vec![0.1, -0.0, 1e300]),
                Values::Texts(vec![Some("km 3".to_owned()), None, Some(String::new())]),
            ],
        };
        let body = chunk.to_bytes().unwrap();
        assert_eq!(RunChunk::read(&body, &columns).unwrap(), chunk);
        assert!(RunChunk::read(&body[..body.len() - 4], &columns).is_err());
        assert!(RunChunk::read(&body, &[column(false), column(true), column(true)]).is_err());
    }
}
