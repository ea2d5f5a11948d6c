//! Valid cases for the tests, and functions that change them.

use railhead_contact::case::solver::Limits;
use railhead_contact::check;
use railhead_contact::error::Fault;
use railhead_contact::problem::checked_case::CheckedCase;
use serde_json::{Value, json};

/// Returns a complete, valid case.
pub fn good() -> Value {
    json!({
        "name": "UIC60 crown, 100 kN",
        "labels": { "line": "A12", "km": "37.2" },
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 100_000 },
        "motion": { "creepage_x": 0.001, "creepage_y": 0.0, "spin_per_mm": 0.0004 },
        "solver": { "method": "auto", "target_error": 0.005 },
        "outputs": ["resultants", "zones", "tractions"]
    })
}

/// Returns the case with the member at this pointer replaced or, with `None`, removed.
pub fn with(case: &Value, pointer: &str, value: Option<Value>) -> Value {
    let mut case = case.clone();
    let (parent, name) = pointer.rsplit_once('/').unwrap();
    let parent = case.pointer_mut(parent).unwrap();
    match (parent, value) {
        (Value::Object(members), Some(value)) => {
            members.insert(name.to_owned(), value);
        }
        (Value::Object(members), None) => {
            members.remove(name);
        }
        (Value::Array(elements), Some(value)) => elements[name.parse::<usize>().unwrap()] = value,
        _ => panic!("{pointer}"),
    }
    case
}

/// Returns the valid case with the member at this pointer replaced.
pub fn good_with(pointer: &str, value: Value) -> Value {
    with(&good(), pointer, Some(value))
}

/// Returns every fault of a case, or an empty list if the case is valid.
pub fn faults(case: &Value) -> Vec<Fault> {
    match check(case, &Limits::default()) {
        Ok(_) => Vec::new(),
        Err(error) => error.0,
    }
}

/// Returns the problem of a valid case.
pub fn problem(case: &Value) -> CheckedCase {
    check(case, &Limits::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Requires that the case has exactly one fault, at `pointer`, whose detail contains all of `words`.
#[track_caller]
pub fn assert_fault(case: &Value, pointer: &str, words: &[&str]) {
    let found = faults(case);
    assert_eq!(found.len(), 1, "{found:#?}");
    assert_eq!(found[0].pointer, pointer, "{found:?}");
    for word in words {
        assert!(
            found[0].detail.contains(word),
            "{word:?} is not in {:?}",
            found[0].detail
        );
    }
}

/// Returns the valid case with another contact, which includes its own load.
pub fn grid_case(contact: Value) -> Value {
    with(&good_with("/contact", contact), "/load", None)
}
