//! What all chunks of a run share: the case, the columns, the sizes.

use std::borrow::Cow;
use std::collections::BTreeMap;

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::contact::evaluate::varied::{Values, VariedColumn, case_of_row};
use crate::jobs::codec::table::{TableColumn, TableKind};
use crate::jobs::error::JobsError;

/// The form of heads and chunks that is written.
const FORM: u32 = 1;

/// The column with the reason why a row has no answer.
pub const REASON: &str = "reason";

/// A column of the rows of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunColumn {
    /// As the client names it, and as it is answered.
    pub name: String,
    /// The place in the case that it stands for; a column without one is carried along to the answers.
    pub pointer: Option<String>,
    /// What makes a number that was sent one of the case, in its unit.
    #[serde(default = "unchanged")]
    pub factor: f64,
    /// The unit that its title or a line of units names.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// It holds texts; otherwise numbers.
    pub text: bool,
}

/// A number times the factor of its unit, to 15 digits, so that 64.1 kN are 64100 N.
#[must_use]
pub fn converted(number: f64, factor: f64) -> f64 {
    if factor == 1.0 {
        return number;
    }
    let number = factor * number;
    format!("{number:.14e}").parse().unwrap_or(number)
}

/// The factor of a column in the unit of the case.
fn unchanged() -> f64 {
    1.0
}

impl RunColumn {
    /// A number that was sent, in the unit of the case.
    #[must_use]
    pub fn in_case(&self, number: f64) -> f64 {
        converted(number, self.factor)
    }

    /// What it holds.
    #[must_use]
    pub fn kind(&self) -> TableKind {
        match self.text {
            true => TableKind::Texts,
            false => TableKind::Numbers,
        }
    }
}

/// The values of a column of rows as a column of a table.
#[must_use]
pub fn table_column(values: Values) -> TableColumn {
    match values {
        Values::Numbers(numbers) => TableColumn::Numbers(numbers),
        Values::Texts(texts) => TableColumn::Texts(texts),
    }
}

/// What all chunks of a run share.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunHead {
    form: u32,
    /// The case of the first row.
    pub case: Value,
    /// The columns that were sent, in their order.
    pub columns: Vec<RunColumn>,
    /// Names of the columns of numbers of the answers.
    pub numbers: Vec<String>,
    /// Kept cross-sections that rows name.
    #[serde(default)]
    pub profiles: BTreeMap<String, Value>,
    /// The method asked for.
    pub method: String,
    /// Always false. Stored runs have the member, and a repeated submission is recognised by the bytes of its head.
    #[serde(default)]
    from_neighbours: bool,
    /// Answers have the column of reasons; those of older runs do not.
    #[serde(default)]
    pub with_reasons: bool,
    /// Number of rows.
    pub rows: u64,
    /// Rows of each chunk but the last.
    pub chunk_rows: u32,
    /// Places and values that the first row puts into the template; none where `case` is stored itself.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    first_row: Vec<(String, Value)>,
}

/// The part of what the chunks of a run share that runs over the same template have in common.
#[derive(Debug, Serialize, Deserialize)]
struct CommonPart<'a> {
    template: Cow<'a, Value>,
    profiles: Cow<'a, BTreeMap<String, Value>>,
}

impl RunHead {
    /// A head of the present form, without rows.
    #[must_use]
    pub fn new(case: Value, columns: Vec<RunColumn>, numbers: Vec<String>, method: String) -> Self {
        RunHead {
            form: FORM,
            case,
            columns,
            numbers,
            profiles: BTreeMap::new(),
            method,
            from_neighbours: false,
            with_reasons: true,
            rows: 0,
            chunk_rows: 0,
            first_row: Vec::new(),
        }
    }

    /// The text of all of it, by which a submission is known again.
    #[must_use]
    pub fn whole(&self) -> Vec<u8> {
        serde_json::to_vec(self).unwrap_or_default()
    }

    /// As it is stored: the part in common with other runs over this template, and the rest. `first_row` is what makes the case of the
    /// template.
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
        (common.into(), own.whole().into())
    }

    /// Reads a stored head: the common part and the rest. Runs of earlier versions have all in the first.
    ///
    /// # Errors
    /// It is damaged, or of another form.
    pub fn read(common: &[u8], own: Option<&[u8]>) -> Result<RunHead, JobsError> {
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
            let case = case_of_row(&common.template, &first_row, &head.profiles, 0);
            head.case =
                case.map_err(|(pointer, reason)| damaged(format!("{pointer}: {reason}")))?;
        }
        Ok(head)
    }

    /// Names and kinds of the columns of the answers, in their order: the row, what was carried along, what became of it, its numbers,
    /// and why it has none.
    #[must_use]
    pub fn answers(&self) -> Vec<(String, TableKind)> {
        let carried = self
            .columns
            .iter()
            .filter(|column| column.pointer.is_none());
        let carried = carried.map(|column| (column.name.clone(), column.kind()));
        let words = ["status", "method"].map(|name| (name.to_owned(), TableKind::Texts));
        let numbers = self.numbers.iter();
        let numbers = numbers.map(|name| (name.clone(), TableKind::Numbers));
        let row = ("row".to_owned(), TableKind::Integers);
        let reason = (REASON.to_owned(), TableKind::Texts);
        std::iter::once(row)
            .chain(carried)
            .chain(words)
            .chain(numbers)
            .chain(self.with_reasons.then_some(reason))
            .collect()
    }

    /// The rows of a chunk.
    #[must_use]
    pub fn rows_of(&self, chunk: u64) -> std::ops::Range<u64> {
        let each = u64::from(self.chunk_rows);
        let begin = (chunk * each).min(self.rows);
        begin..(begin + each).min(self.rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_another_unit_are_converted_to_15_digits() {
        let column = |factor| RunColumn {
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
}
