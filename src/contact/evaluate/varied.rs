//! Columns that may hold any number or text of a case.
//!
//! Faults of rows with pointers into the request that brought them: `/template/…` and `/columns/<pointer>/<row>`.
//!
//! Puts a value into a case at the place that a JSON pointer leads to.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use serde_json::{Map, Value};

use crate::case::words::object::FAULTS_MAX;
use crate::error::{CaseError, Fault, FaultCode};
use crate::evaluate::variable::Variable;

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
    pub fn len(&self) -> usize {
        match self {
            Values::Numbers(numbers) => numbers.len(),
            Values::Texts(texts) => texts.len(),
        }
    }

    /// There is no row.
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
    pub fn value(&self, row: usize) -> Value {
        match self {
            Values::Numbers(numbers) => Value::from(numbers[row]),
            Values::Texts(texts) => match texts[row].as_deref() {
                Some("true") => Value::Bool(true),
                Some("false") => Value::Bool(false),
                text => Value::from(text),
            },
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

/// Where a case has cross-sections.
const PLACES: [&str; 4] = [
    "/contact/rail",
    "/contact/wheel",
    "/contact/right/rail",
    "/contact/right/wheel",
];
/// The member that names a stored cross-section.
const PROFILE: &str = "profile";
/// What it stands for.
const POINTS: [&str; 3] = ["points_mm", "format", "text"];

/// The cross-sections that a case names: where, and by which name.
pub fn named_sections(case: &Value) -> Vec<(&'static str, String)> {
    let named = |place: &&'static str| {
        let name = case.pointer(place)?.get(PROFILE)?.as_str()?;
        Some((*place, name.to_owned()))
    };
    PLACES.iter().filter_map(named).collect()
}

/// The first cross-section that is both named and given.
pub fn named_and_given(case: &Value) -> Option<&'static str> {
    let both = |place: &&&'static str| {
        let section = case.pointer(place);
        section.is_some_and(|section| {
            section.get(PROFILE).is_some() && POINTS.iter().any(|name| section.get(name).is_some())
        })
    };
    PLACES.iter().find(both).copied()
}

/// Puts the stored cross-section in the place of its name. What else the case says of it, such as its smoothing, stays.
pub fn put_section(case: &mut Value, place: &str, section: &Value) {
    let Some(Value::Object(own)) = case.pointer_mut(place) else {
        return;
    };
    own.remove(PROFILE);
    for name in POINTS {
        own.remove(name);
    }
    for (name, value) in section.as_object().into_iter().flatten() {
        if POINTS.contains(&name.as_str()) || !own.contains_key(name) {
            own.insert(name.clone(), value.clone());
        }
    }
}

/// The pointer of a column in the request.
pub fn column_pointer(name: &str) -> String {
    format!("/columns/{}", name.replace('~', "~0").replace('/', "~1"))
}

/// Faults of the case of the first row, with pointers into the request; of each column the pointer into the case and its name.
pub fn of_first_row(CaseError(faults): CaseError, columns: &[(&str, &str)]) -> CaseError {
    in_template(CaseError(faults), |pointer| {
        let (_, name) = columns.iter().find(|(known, _)| *known == pointer)?;
        Some(format!("{}/0", column_pointer(name)))
    })
}

/// Faults of the case of a row, with pointers into the request: that of a column where `column` knows the pointer into the case, below the template
/// elsewhere.
pub fn in_template(
    CaseError(faults): CaseError,
    column: impl Fn(&str) -> Option<String>,
) -> CaseError {
    let moved = faults.into_iter().map(|fault| Fault {
        pointer: column(&fault.pointer).unwrap_or_else(|| format!("/template{}", fault.pointer)),
        ..fault
    });
    CaseError(moved.collect())
}

/// Faults of some values of a column, the first of which belongs to the row `first`: numbers that are not finite, or that no case may have at
/// this place, as far as that is known of the place alone.
pub fn of_values(name: &str, pointer: &str, values: &Values, first: u64) -> Vec<Fault> {
    let Values::Numbers(numbers) = values else {
        return Vec::new();
    };
    let allowed = Variable::at(pointer).map(Variable::allowed);
    let good =
        |number: f64| number.is_finite() && allowed.is_none_or(|range| range.contains(number));
    let wrong = (first..).zip(numbers).filter(|(_, number)| !good(**number));
    wrong
        .take(FAULTS_MAX)
        .map(|(row, number)| {
            let place = format!("{}/{row}", column_pointer(name));
            match allowed {
                Some(allowed) => Fault {
                    figures: Box::new(
                        allowed.figures(FaultCode::OutOfRange, Some(&Value::from(*number))),
                    ),
                    ..Fault::new(
                        place,
                        match number.is_nan() {
                            true => format!("no number given; {allowed} is needed"),
                            false => format!("{number} given; {allowed} is needed"),
                        },
                    )
                },
                None => Fault::new(place, "no number given; a finite number is needed"),
            }
        })
        .collect()
}

/// The members of a JSON pointer (RFC 6901).
pub fn members(pointer: &str) -> Vec<String> {
    let parts = pointer.split('/').skip(1);
    parts
        .map(|part| part.replace("~1", "/").replace("~0", "~"))
        .collect()
}

/// Puts a value where the members lead; objects on the way are made.
///
/// # Errors
/// Returns the reason if a pointer leads nowhere; the case is then unchanged.
pub fn put(case: &mut Value, path: &[String], value: Value) -> Result<(), String> {
    if path.is_empty() {
        return Ok(());
    }
    let mut place = case;
    for member in path {
        if place.is_null() {
            *place = Value::Object(Map::new());
        }
        place = match place {
            Value::Object(members) => members.entry(member).or_insert(Value::Null),
            Value::Array(items) => {
                let count = items.len();
                let index = member.parse::<usize>().ok();
                let item = index.and_then(|index| items.get_mut(index));
                item.ok_or_else(|| format!("leads to `{member}` of an array with {count} entries"))?
            }
            _ => {
                return Err(format!(
                    "leads to `{member}` of a value in the template that is neither an object nor an array"
                ));
            }
        };
    }
    *place = value;
    Ok(())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_named_section_takes_the_place_of_its_name_and_of_other_points() {
        let mut case = json!({ "contact": {
            "rail": { "profile": "a", "smoothing_mm": 3 }, "wheel": { "points_mm": [[0, 0]], "profile": "b", "mirror_y": true }
        } });
        let named = named_sections(&case);
        assert_eq!(
            named,
            [
                ("/contact/rail", "a".to_owned()),
                ("/contact/wheel", "b".to_owned())
            ]
        );
        assert_eq!(named_and_given(&case), Some("/contact/wheel"));
        let stored =
            json!({ "format": "columns", "text": "…", "mirror_y": false, "smoothing_mm": 1 });
        for (place, _) in named {
            put_section(&mut case, place, &stored);
        }
        assert_eq!(
            case,
            json!({ "contact": {
            "rail": { "format": "columns", "text": "…", "mirror_y": false, "smoothing_mm": 3 },
            "wheel": { "format": "columns", "text": "…", "mirror_y": true, "smoothing_mm": 1 }
        } })
        );
    }
}

#[cfg(test)]
mod placing_tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_value_is_put_where_its_members_lead_or_nowhere() {
        let case = json!({ "load": { "f": 1 }, "y": [0, { "a": 2 }], "none": null });
        for pointer in [
            "/load/f", "/load/g", "/new/a/b", "/y/0", "/y/1/a", "/y/1/b/c", "/none/x", "/none",
        ] {
            let mut changed = case.clone();
            put(&mut changed, &members(pointer), json!("v")).expect(pointer);
            assert_eq!(changed.pointer(pointer), Some(&json!("v")), "{pointer}");
        }
        for pointer in ["/y/2", "/y/b", "/load/f/g"] {
            let mut changed = case.clone();
            let refused = put(&mut changed, &members(pointer), json!(1));
            assert!(refused.is_err(), "{pointer}");
            assert_eq!(changed, case, "{pointer}");
        }
    }
}
