//! Columns that may hold any number or text of a case.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use serde_json::Value;

use crate::contact::evaluate::placing::{members, put};
use crate::contact::evaluate::sections::{named_sections, put_section};

/// The values of a column, one for each row.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Finite numbers.
    Numbers(Vec<f64>),
    /// Texts, such as digests of profiles; nothing where a row has none.
    Texts(Vec<Option<String>>),
}

/// A column: where it stands in the case, and a value for each row.
#[derive(Debug, Clone, PartialEq)]
pub struct VariedColumn {
    /// JSON pointer into the case.
    pub pointer: String,
    /// The values.
    pub values: Values,
}

impl Values {
    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Values::Numbers(numbers) => numbers.len(),
            Values::Texts(texts) => texts.len(),
        }
    }

    /// There is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The values of these rows.
    #[must_use]
    pub fn pick(&self, rows: &[usize]) -> Values {
        match self {
            Values::Numbers(numbers) => {
                Values::Numbers(rows.iter().map(|row| numbers[*row]).collect())
            }
            Values::Texts(texts) => {
                Values::Texts(rows.iter().map(|row| texts[*row].clone()).collect())
            }
        }
    }

    /// The value of a row as a case has it.
    #[must_use]
    pub fn value(&self, row: usize) -> Value {
        match self {
            Values::Numbers(numbers) => Value::from(numbers[row]),
            Values::Texts(texts) => Value::from(texts[row].as_deref()),
        }
    }

    /// Orders two rows by this column.
    pub(crate) fn compare(&self, a: usize, b: usize) -> Ordering {
        match self {
            Values::Numbers(numbers) => numbers[a].total_cmp(&numbers[b]),
            Values::Texts(texts) => texts[a].cmp(&texts[b]),
        }
    }
}

/// The case of a row: the template with the row's values in their places, and cross-sections in the place of their names.
///
/// # Errors
/// The pointer of the first column that leads nowhere in the template, and why.
pub fn case_of_row(
    template: &Value,
    columns: &[VariedColumn],
    profiles: &BTreeMap<String, Value>,
    row: usize,
) -> Result<Value, (String, String)> {
    let mut case = template.clone();
    for column in columns {
        put(
            &mut case,
            &members(&column.pointer),
            column.values.value(row),
        )
        .map_err(|reason| (column.pointer.clone(), reason))?;
    }
    for (place, name) in named_sections(&case) {
        if let Some(section) = profiles.get(&name) {
            put_section(&mut case, place, section);
        }
    }
    Ok(case)
}
