//! A table of cases: the first line names the columns, every other line fills a template case.
//!
//! A column is named by a JSON pointer into the case (`/load/normal_force_n`), by a short name (`normal_force_n`), or as
//! `label:KEY` for a label; `priority` and `deadline_s` are options of the line. An empty field leaves what the template says.

use std::collections::HashSet;

use axum::body::Bytes;
use serde_json::Value;

use crate::http::extract::batch::own_options;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::jobs::batch::template;
use crate::jobs::batch::template::Cell;
use crate::jobs::batch::upload::BatchRow;
use crate::jobs::model::submit_options::CaseOptions;

/// Short names of columns and what they stand for.
const SHORT_NAMES: [(&str, &str); 18] = [
    ("name", "/name"),
    ("normal_force_n", "/load/normal_force_n"),
    ("vertical_force_n", "/load/vertical_force_n"),
    ("approach_mm", "/load/approach_mm"),
    ("creepage_x", "/motion/creepage_x"),
    ("creepage_y", "/motion/creepage_y"),
    ("spin_per_mm", "/motion/spin_per_mm"),
    ("force_x_n", "/motion/force_x_n"),
    ("force_y_n", "/motion/force_y_n"),
    ("friction_coefficient", "/friction/coefficient"),
    ("rolling_mm", "/contact/rolling_mm"),
    ("lateral_mm", "/contact/lateral_mm"),
    ("a_mm", "/contact/a_mm"),
    ("b_mm", "/contact/b_mm"),
    ("rolling_radius_mm", "/contact/rolling_radius_mm"),
    ("lateral_shift_mm", "/contact/lateral_shift_mm"),
    ("yaw_rad", "/contact/yaw_rad"),
    ("roll_rad", "/contact/roll_rad"),
];

/// Most columns of a table. A case has far fewer members that differ from line to line.
const COLUMNS_MAX: usize = 1000;

/// A table under way.
#[derive(Debug)]
pub struct TableBody {
    template: Value,
    /// The template as it is stored.
    text: Bytes,
    columns: Option<Vec<TemplateColumn>>,
}

/// The case of a line with what it puts into the template, or why it stands for none.
pub type Row = Result<BatchRow, String>;

#[derive(Debug, PartialEq, Eq)]
struct TemplateColumn {
    /// As it stands in the header.
    title: String,
    /// The members that lead to the value; none for an option of the line.
    path: Vec<String>,
    /// The value is text, whatever it looks like.
    text: bool,
}

impl TableBody {
    /// A table that fills this case.
    #[must_use]
    pub fn new(template: Value) -> Self {
        TableBody {
            text: Bytes::from(template.to_string()),
            template,
            columns: None,
        }
    }

    /// The text of the template.
    #[must_use]
    pub fn text(&self) -> Bytes {
        self.text.clone()
    }

    /// Takes the next line; the case that it stands for with what it puts into the template, or why it stands for none.
    /// Nothing for the header.
    ///
    /// # Errors
    /// `faulty-table`: the header cannot be understood.
    pub fn take(&mut self, line: &[u8]) -> Result<Option<Row>, ApiError> {
        let Some(columns) = &self.columns else {
            let line = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line);
            let columns = read_header(line).map_err(|detail| {
                ApiError::new(ProblemKind::FaultyTable, format!("line 1: {detail}"))
            })?;
            self.columns = Some(columns);
            return Ok(None);
        };
        Ok(Some(fill(&self.template, columns, line)))
    }
}

fn read_header(line: &[u8]) -> Result<Vec<TemplateColumn>, String> {
    let titles = fields(line)?;
    if titles.len() > COLUMNS_MAX {
        return Err(format!(
            "the table has {} columns; allowed: at most {COLUMNS_MAX}",
            titles.len()
        ));
    }
    let mut seen = HashSet::new();
    let mut columns = Vec::with_capacity(titles.len());
    for title in titles {
        let column = column(title.trim())?;
        let place = match column.path.is_empty() {
            true => vec![String::new(), column.title.clone()],
            false => column.path.clone(),
        };
        if !seen.insert(place) {
            return Err(format!("the column `{}` is there twice", column.title));
        }
        columns.push(column);
    }
    Ok(columns)
}

/// The JSON pointer that a short name stands for.
#[must_use]
pub fn short_pointer(title: &str) -> Option<&'static str> {
    let short = SHORT_NAMES.iter().find(|(name, _)| *name == title);
    short.map(|(_, pointer)| *pointer)
}

/// The JSON pointers that a header names columns by.
///
/// # Errors
/// A column that is not known, or is there twice.
pub fn column_pointers(header: &[u8]) -> Result<Vec<String>, String> {
    let header = header.strip_prefix(b"\xef\xbb\xbf").unwrap_or(header);
    let columns = read_header(header)?;
    Ok(columns
        .iter()
        .map(|column| pointer_of(&column.path))
        .collect())
}

/// The JSON pointer that a title names.
///
/// # Errors
/// It names no place in a case.
pub fn column_pointer(title: &str) -> Result<String, String> {
    let path = column(title)?.path;
    match path.is_empty() {
        true => Err(format!("`{title}` is no number of a case")),
        false => Ok(pointer_of(&path)),
    }
}

fn pointer_of(path: &[String]) -> String {
    let escaped = |part: &String| format!("/{}", part.replace('~', "~0").replace('/', "~1"));
    path.iter().map(escaped).collect()
}

fn column(title: &str) -> Result<TemplateColumn, String> {
    let short = SHORT_NAMES.iter().find(|(name, _)| *name == title);
    let path = if own_options::NAMES.contains(&title) {
        Vec::new()
    } else if let Some((_, pointer)) = short {
        pointed(pointer)
    } else if let Some(key) = title.strip_prefix("label:").filter(|key| !key.is_empty()) {
        vec!["labels".to_owned(), key.to_owned()]
    } else if title.len() > 1 && title.starts_with('/') {
        pointed(title)
    } else {
        let names: Vec<String> = SHORT_NAMES
            .iter()
            .map(|(name, _)| format!("`{name}`"))
            .collect();
        return Err(format!(
            "`{title}` names no column; allowed: {}, `priority`, `deadline_s`, `label:KEY`, or a JSON pointer such as `/load/normal_force_n`; columns are parted by commas",
            names.join(", ")
        ));
    };
    let text = matches!(path.first().map(String::as_str), Some("labels" | "name"));
    Ok(TemplateColumn {
        title: title.to_owned(),
        path,
        text,
    })
}

/// The members of a JSON pointer (RFC 6901).
fn pointed(pointer: &str) -> Vec<String> {
    let parts = pointer.split('/').skip(1);
    parts
        .map(|part| part.replace("~1", "/").replace("~0", "~"))
        .collect()
}

fn fill(template: &Value, columns: &[TemplateColumn], line: &[u8]) -> Row {
    let fields = fields(line)?;
    if fields.len() != columns.len() {
        return Err(format!(
            "the line has {} fields, the header has {}",
            fields.len(),
            columns.len()
        ));
    }
    let (mut cells, mut titles) = (Vec::new(), Vec::new());
    let mut own = CaseOptions::default();
    for (column, field) in columns.iter().zip(&fields) {
        let field = field.trim();
        if field.is_empty() {
            continue;
        }
        let value = if column.text {
            Value::from(field)
        } else {
            read_value(field)
        };
        if column.path.is_empty() {
            own_options::set(&mut own, &column.title, &value)
                .map_err(|detail| format!("the column `{}`: {detail}", column.title))?;
            continue;
        }
        cells.push(Cell(column.path.clone(), value));
        titles.push(&column.title);
    }
    let case = template::fill(template, &cells)
        .map_err(|(number, reason)| format!("the column `{}` {reason}", titles[number]))?;
    Ok(BatchRow { case, cells, own })
}

/// A number, `true`, `false` or `null` as JSON has them; everything else is text, and the case says whether it may be.
fn read_value(field: &str) -> Value {
    match serde_json::from_str(field) {
        Ok(value @ (Value::Number(_) | Value::Bool(_) | Value::Null)) => value,
        _ => Value::from(field),
    }
}

/// The fields of one line of CSV.
fn fields(line: &[u8]) -> Result<Vec<String>, String> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .from_reader(line);
    let mut record = csv::StringRecord::new();
    match reader.read_record(&mut record) {
        Ok(true) => Ok(record.iter().map(str::to_owned).collect()),
        Ok(false) => Ok(Vec::new()),
        Err(error) => Err(format!("the line cannot be read: {error}")),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn filled(header: &str, line: &str) -> Result<Value, String> {
        let template = json!({ "motion": { "creepage_x": 0.001 }, "contact": { "y_mm": [0, 1] }, "solver": "x" });
        let mut table = TableBody::new(template);
        assert!(table.take(header.as_bytes()).expect("a header").is_none());
        let row = table.take(line.as_bytes()).expect("a line");
        row.expect("a case").map(|row| row.case)
    }

    #[test]
    fn columns_lead_to_members_of_the_case() {
        let header =
            "\u{feff}label:km,normal_force_n, creepage_x ,/contact/y_mm/1,/solver,name\r\n";
        let case = filled(header, "37.2,8e4,,-2,\"a, \"\"b\"\"\",12\r\n").unwrap();
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
    fn lines_that_do_not_fit_say_so() {
        for (header, line, word) in [
            ("name,a_mm", "x", "1 fields, the header has 2"),
            ("/solver/mesh", "3", "neither an object nor an array"),
            ("/contact/y_mm/2", "3", "array with 2 entries"),
            ("priority", "soon", "allowed: high, normal, low"),
        ] {
            let fault = filled(header, line).unwrap_err();
            assert!(fault.contains(word), "{fault}");
        }
        let many: Vec<String> = (0..=COLUMNS_MAX).map(|k| format!("label:k{k}")).collect();
        for header in [
            "speed",
            "name,name",
            "a_mm;b_mm",
            "label:",
            "/",
            &many.join(","),
        ] {
            let table = &mut TableBody::new(json!({}));
            assert!(table.take(header.as_bytes()).is_err(), "{header}");
        }
    }
}
