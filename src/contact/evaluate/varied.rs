//! Columns that replace members of a case, the cases of their rows, and the faults of rows with JSON pointers into their request
//! (`/template/…`, `/columns/<pointer>/<row>`).

use std::cmp::Ordering;
use std::collections::BTreeMap;

use serde_json::{Map, Value};

use crate::case::words::object::{FAULTS_MAX, join};
use crate::error::{CaseError, Fault, FaultCode};
use crate::evaluate::variable::Variable;
use crate::remark::kind::Rounded;

/// The values of a column, one for each row.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Finite numbers.
    Numbers(Vec<f64>),
    /// Texts, such as digests of profiles; `None` for a row without one.
    Texts(Vec<Option<String>>),
}

/// A column with a value for each row.
#[derive(Debug, Clone, PartialEq)]
pub struct VariedColumn {
    /// JSON pointer into the case.
    pub pointer: String,
    /// The values.
    pub values: Values,
}

impl Values {
    /// The number of rows.
    pub fn len(&self) -> usize {
        match self {
            Values::Numbers(numbers) => numbers.len(),
            Values::Texts(texts) => texts.len(),
        }
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Memory of the values in bytes.
    pub fn bytes(&self) -> usize {
        match self {
            Values::Numbers(numbers) => size_of_val(&**numbers),
            Values::Texts(texts) => {
                let letters = texts.iter().flatten().map(String::len);
                size_of_val(&**texts) + letters.sum::<usize>()
            }
        }
    }

    /// Returns the value of a row in the form of a member of a case.
    pub fn value(&self, row: usize) -> Value {
        match self {
            Values::Numbers(numbers) => Value::from(numbers[row]),
            Values::Texts(texts) => {
                let text = texts[row].as_deref();
                text.and_then(truth)
                    .map_or_else(|| Value::from(text), Value::Bool)
            }
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

/// Returns the truth value of a text in a table, `true` or `false` in any case of letters.
pub fn truth(text: &str) -> Option<bool> {
    let names = [(true, "true"), (false, "false")].into_iter();
    let mut named = names.filter(|(_, name)| text.eq_ignore_ascii_case(name));
    named.next().map(|(value, _)| value)
}

/// Returns the case of a row: the template with the values of the row, and with cross-sections instead of their names.
///
/// # Errors
/// See [`row_of`].
pub fn case_of_row(
    template: &Value,
    columns: &[VariedColumn],
    profiles: &BTreeMap<String, Value>,
    row: usize,
) -> Result<Value, (String, String)> {
    let mut case = row_of(template, columns, row)?;
    put_sections(&mut case, profiles);
    Ok(case)
}

/// Returns the template with the values of a row.
///
/// # Errors
/// The pointer of the first column that leads nowhere in the template, and the reason.
pub fn row_of(
    template: &Value,
    columns: &[VariedColumn],
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
    Ok(case)
}

/// Replaces names of cross-sections in a case by those among `profiles`.
pub fn put_sections(case: &mut Value, profiles: &BTreeMap<String, Value>) {
    for (place, name) in named_sections(case) {
        if let Some(section) = profiles.get(&name) {
            put_section(case, place, section);
        }
    }
}

/// JSON pointers to the cross-sections of a case.
const PLACES: [&str; 4] = [
    "/contact/rail",
    "/contact/wheel",
    "/contact/right/rail",
    "/contact/right/wheel",
];
/// The member that names a stored cross-section.
const PROFILE: &str = "profile";
/// The members that it replaces.
const POINTS: [&str; 3] = ["points_mm", "format", "text"];

/// Returns JSON pointers and names of the cross-sections that a case names.
pub fn named_sections(case: &Value) -> Vec<(&'static str, String)> {
    let named = |place: &&'static str| {
        let name = case.pointer(place)?.get(PROFILE)?.as_str()?;
        Some((*place, name.to_owned()))
    };
    PLACES.iter().filter_map(named).collect()
}

/// Returns the JSON pointer to the first cross-section that is both named and given.
pub fn named_and_given(case: &Value) -> Option<&'static str> {
    let both = |place: &&&'static str| {
        let section = case.pointer(place);
        section.is_some_and(|section| {
            section.get(PROFILE).is_some() && POINTS.iter().any(|name| section.get(name).is_some())
        })
    };
    PLACES.iter().find(both).copied()
}

/// Removes cross-sections from a template whose columns, given by JSON pointers, name others.
///
/// A section with points is removed as a whole, because its other members describe these points. Of a section that only names another one, the
/// members that override stored ones remain.
pub fn make_room<'a>(template: &mut Value, columns: impl Iterator<Item = &'a str>) {
    let places = columns.filter_map(|pointer| pointer.strip_suffix("/profile"));
    for place in places.filter(|place| PLACES.contains(place)) {
        let Some(Value::Object(own)) = template.pointer_mut(place) else {
            continue;
        };
        own.remove(PROFILE);
        if POINTS.iter().any(|name| own.contains_key(*name)) {
            own.clear();
        }
    }
}

/// Replaces the name of a cross-section by the stored cross-section. Other members of the case's section, such as its smoothing, take
/// precedence over those of the stored one.
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

/// Returns the JSON pointer to a column in the request.
pub fn column_pointer(name: &str) -> String {
    join("/columns", name)
}

/// Changes the pointers of faults of the first row's case to pointers into the request. A column is its pointer into the case and its name.
pub fn of_first_row(CaseError(faults): CaseError, columns: &[(&str, &str)]) -> CaseError {
    in_template(CaseError(faults), |pointer| {
        let (_, name) = columns.iter().find(|(known, _)| *known == pointer)?;
        Some(format!("{}/0", column_pointer(name)))
    })
}

/// Changes the pointers of faults of a row's case to pointers into the request: that which `column` returns, or else one below `/template`.
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

/// Returns the faults of some values of a column, the first of which belongs to the row `first`: numbers that are not finite, or outside the
/// allowed range of the member if it is a [`Variable`]. The column has a name, a JSON pointer into the case, and the factor that converts its
/// numbers to the unit of the case.
pub fn of_values(
    (name, pointer, factor): (&str, &str, f64),
    values: &Values,
    first: u64,
) -> Vec<Fault> {
    let Values::Numbers(numbers) = values else {
        return Vec::new();
    };
    let allowed = Variable::at(pointer).map(Variable::allowed);
    let good = |number: f64| {
        let number = factor * number;
        number.is_finite() && allowed.is_none_or(|range| range.contains(number))
    };
    let wrong = (first..).zip(numbers).filter(|(_, number)| !good(**number));
    let fault = |(row, number): (u64, &f64)| {
        let pointer = format!("{}/{row}", column_pointer(name));
        let Some(allowed) = allowed else {
            return Fault::new(pointer, "no number given; a finite number is needed");
        };
        let in_case = factor * number;
        let given = match (number.is_nan(), factor == 1.0) {
            (true, _) => "no number given".to_owned(),
            (false, true) => format!("{number} given"),
            (false, false) => {
                let in_case = Rounded(in_case, 9);
                format!("{number} given, {in_case} in the unit of the case")
            }
        };
        let figures = allowed.figures(FaultCode::OutOfRange, Some(&Value::from(in_case)));
        Fault {
            figures: Box::new(figures),
            ..Fault::new(pointer, format!("{given}; {allowed} is needed"))
        }
    };
    wrong.take(FAULTS_MAX).map(fault).collect()
}

/// Splits a JSON pointer (RFC 6901) into its unescaped members.
pub fn members(pointer: &str) -> Vec<String> {
    let parts = pointer.split('/').skip(1);
    parts
        .map(|part| part.replace("~1", "/").replace("~0", "~"))
        .collect()
}

/// The place of the rolling speed, which in the motion of a wheelset is a member of `wheelset`.
const SPEED: [&str; 2] = ["motion", "speed_mm_per_s"];

/// Puts a value into a case at a path of members. Missing objects on the path are created. The rolling speed of a wheelset is put where it
/// belongs.
///
/// # Errors
/// The reason, if the path leads nowhere; the case is then unchanged.
pub fn put(case: &mut Value, path: &[String], value: Value) -> Result<(), String> {
    if path.is_empty() {
        return Ok(());
    }
    let mut path: Vec<&str> = path.iter().map(String::as_str).collect();
    if path == SPEED && case.pointer("/motion/wheelset").is_some() {
        path.insert(1, "wheelset");
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
    fn numbers_are_compared_with_the_allowed_range_in_the_unit_of_the_case() {
        let values = Values::Numbers(vec![250.0, 250_000.0]);
        let pointer = "/friction/coefficient";
        let faults = of_values(("mue [‰]", pointer, 1e-3), &values, 7);
        let [fault] = &faults[..] else {
            panic!("{faults:?}")
        };
        assert_eq!(fault.pointer, "/columns/mue [‰]/8");
        let said = "250000 given, 250 in the unit of the case; a number from 0 to 100 is needed";
        assert_eq!(fault.detail, said);
    }

    #[test]
    fn a_section_makes_room_for_those_of_the_rows() {
        let template = json!({ "contact": {
            "rail": { "points_mm": [[0, 0]], "unit": "cm", "smoothing_mm": 8 }, "wheel": { "profile": "b", "smoothing_mm": 3 }
        } });
        let mut bare = template.clone();
        let columns = [
            "/contact/rail/profile",
            "/contact/wheel/profile",
            "/contact/lateral_shift_mm",
            "/motion/profile",
        ];
        make_room(&mut bare, columns.into_iter());
        let expected = json!({ "contact": { "rail": {}, "wheel": { "smoothing_mm": 3 } } });
        assert_eq!(bare, expected);
        let mut same = template.clone();
        make_room(&mut same, columns[2..].iter().copied());
        assert_eq!(same, template);
    }

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
        let speed = members("/motion/speed_mm_per_s");
        for motion in [
            json!({ "creepage_x": 0.0 }),
            json!({ "wheelset": { "yaw": 1 } }),
        ] {
            let mut changed = json!({ "motion": motion });
            put(&mut changed, &speed, json!(7)).expect("a place");
            let motion = &changed["motion"];
            let own = motion.get("wheelset").unwrap_or(motion);
            assert_eq!(own["speed_mm_per_s"], json!(7), "{changed}");
        }
        for pointer in ["/y/2", "/y/b", "/load/f/g"] {
            let mut changed = case.clone();
            let refused = put(&mut changed, &members(pointer), json!(1));
            assert!(refused.is_err(), "{pointer}");
            assert_eq!(changed, case, "{pointer}");
        }
    }
}
