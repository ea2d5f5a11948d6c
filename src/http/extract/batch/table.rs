//! A table of cases: the first line names the columns, every other line fills a template case.
//!
//! A column is named by a JSON pointer into the case (`/load/normal_force_n`), by a short name (`normal_force_n`), by a quantity with its unit
//! (`Normal force [kN]`), or as `label:KEY` for a label; `priority` and `deadline_s` are options of the line. An empty field leaves what the
//! template says. The line below the titles may give the units.

use std::collections::HashSet;

use serde_json::Value;

use crate::contact::evaluate::varied::{Values, members};
use crate::http::extract::batch::own_options;
use crate::http::extract::tables::{Chunk, Title};
use crate::http::extract::titles::{Place, faulty, is_text, number, place, question, short_names};
use crate::http::problem::error::ApiError;
use crate::jobs::batch::template::Cell;
use crate::jobs::batch::upload::BatchRow;
use crate::jobs::run::head::converted;

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
pub fn columns_of(titles: &[Title]) -> Result<Vec<TemplateColumn>, ApiError> {
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
            return own_options::set(&mut row.own, &self.title, &value)
                .map_err(|detail| format!("the column `{}`: {detail}", self.title));
        }
        row.cells.push(Cell(self.path.clone(), value));
        Ok(())
    }
}

fn column(title: &str, unit: Option<&str>) -> Result<TemplateColumn, String> {
    let label = title.strip_prefix("label:").filter(|key| !key.is_empty());
    let (path, factor) = if own_options::NAMES.contains(&title) {
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

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::http::extract::tables::CsvRows;
    use crate::jobs::batch::template::fill;
    use crate::jobs::codec::table::COLUMNS_MAX;

    fn taken(lines: &[&str]) -> Result<Vec<Row>, ApiError> {
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
