//! Cases that are rows of a table: a template, and what the row puts into it. Only the latter is kept for each row.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::contact::evaluate::varied::{self, Replaced, put};
use crate::jobs::error::JobsError;
use crate::jobs::idempotency;
use crate::jobs::store::submission::StoredCase;

/// A value and the members that lead to its place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cell(pub Vec<String>, pub Value);

impl Cell {
    /// The place as a JSON pointer.
    #[must_use]
    pub fn pointer(&self) -> String {
        let escaped = |part: &String| format!("/{}", part.replace('~', "~0").replace('/', "~1"));
        self.0.iter().map(escaped).collect()
    }
}

/// Digest of the cells of a row, whatever their order.
#[must_use]
pub fn digest(cells: &[Cell]) -> [u8; 32] {
    let places = cells.iter().map(|cell| (cell.pointer(), cell.1.clone()));
    idempotency::digest(&Value::Object(places.collect()))
}

/// As [`fill`], in the template itself; [`restore`] takes the values of the row away again.
///
/// # Errors
/// As [`fill`]; the template is then unchanged.
pub fn fill_in_place(template: &mut Value, row: &[Cell]) -> Result<Vec<Replaced>, (usize, String)> {
    let mut filled = Vec::with_capacity(row.len());
    for (number, Cell(path, value)) in row.iter().enumerate() {
        match varied::replace(template, path, value.clone()) {
            Ok(replaced) => filled.push(replaced),
            Err(reason) => {
                restore(template, row, filled);
                return Err((number, reason));
            }
        }
    }
    Ok(filled)
}

/// Undoes [`fill_in_place`].
pub fn restore(template: &mut Value, row: &[Cell], filled: Vec<Replaced>) {
    for (Cell(path, _), replaced) in row.iter().zip(filled).rev() {
        varied::restore(template, path, replaced);
    }
}

/// The template with the values of a row in their places.
///
/// # Errors
/// The number of the first cell that leads nowhere, and why.
pub fn fill(template: &Value, row: &[Cell]) -> Result<Value, (usize, String)> {
    let mut case = template.clone();
    for (number, Cell(path, value)) in row.iter().enumerate() {
        put(&mut case, path, value.clone()).map_err(|reason| (number, reason))?;
    }
    Ok(case)
}

impl StoredCase {
    /// The case as JSON.
    ///
    /// # Errors
    /// What is stored cannot be read.
    pub fn value(&self) -> Result<Value, JobsError> {
        let damaged = |reason: String| JobsError::Damaged(format!("a stored case: {reason}"));
        let Some(template) = &self.template else {
            return serde_json::from_slice(&self.body).map_err(|error| damaged(error.to_string()));
        };
        let template = serde_json::from_slice(template);
        let template: Value = template.map_err(|error| damaged(error.to_string()))?;
        let row: Vec<Cell> =
            serde_json::from_slice(&self.body).map_err(|error| damaged(error.to_string()))?;
        fill(&template, &row).map_err(|(_, reason)| damaged(reason))
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::jobs::model::kind::Kind;

    #[test]
    fn a_stored_row_is_the_case_that_was_checked() {
        let template = json!({ "load": { "normal_force_n": 1 }, "y_mm": [0, 1] });
        let row = vec![
            Cell(vec!["load".into(), "normal_force_n".into()], json!(8e4)),
            Cell(vec!["labels".into(), "km".into()], json!("37.2")),
            Cell(vec!["y_mm".into(), "1".into()], json!(-2)),
        ];
        let checked = fill(&template, &row).unwrap();
        let stored = StoredCase {
            kind: Kind::Case,
            template: Some(template.to_string().into()),
            head: None,
            body: serde_json::to_vec(&row).unwrap().into(),
        };
        assert_eq!(stored.value().unwrap(), checked);
        assert_eq!(
            checked,
            json!({ "load": { "normal_force_n": 8e4 }, "labels": { "km": "37.2" }, "y_mm": [0, -2] })
        );
    }
}
