//! A chunk of the rows of a run as it waits in the queue: its columns, packed.

use std::io::Read;

use crate::contact::evaluate::varied::{Values, VariedColumn};
use crate::jobs::codec::table::TableColumn;
use crate::jobs::error::JobsError;
use crate::jobs::run::head::{RunColumn, RunHead, table_column};

/// What a chunk begins with.
const MAGIC: &[u8] = b"RHROWS1\n";
/// Cheap compression; chunks are unpacked before every solve.
const ZSTD_LEVEL: i32 = 1;
/// In the place of the length of a text: the row has none.
const NO_TEXT: u64 = u64::MAX;

/// Rows of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunChunk {
    /// The number of its first row in the run.
    pub first_row: u64,
    /// Its columns, as the head of the run names them.
    pub columns: Vec<Values>,
}

impl RunChunk {
    /// As it is stored.
    ///
    /// # Errors
    /// There is no memory to pack it.
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
    /// It is damaged.
    pub fn read(body: &[u8], columns: &[RunColumn]) -> Result<RunChunk, JobsError> {
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
        let column = |column: &RunColumn| {
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

/// What varies the case, and what is carried along.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chunk_comes_back_as_it_was_and_a_broken_one_is_refused() {
        let column = |text| RunColumn {
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
