//! Valid cases to start from, and ways to change them.

use railhead_contact::case::solver::Limits;
use railhead_contact::check;
use railhead_contact::error::Fault;
use railhead_contact::problem::checked_case::CheckedCase;
use serde_json::{Value, json};

/// A complete, valid case.
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

/// The good case with one member, given by its pointer, put in place or (with `None`) taken away.
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

/// The good case with one member put in place.
pub fn good_with(pointer: &str, value: Value) -> Value {
    with(&good(), pointer, Some(value))
}

/// Every fault of a case, none if it is good.
pub fn faults(case: &Value) -> Vec<Fault> {
    match check(case, &Limits::default()) {
        Ok(_) => Vec::new(),
        Err(error) => error.0,
    }
}

/// The problem of a good case.
pub fn problem(case: &Value) -> CheckedCase {
    check(case, &Limits::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The only fault of a case stands at `pointer` and says all of `words`.
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

/// The good case with another contact, which carries its own load.
pub fn grid_case(contact: Value) -> Value {
    with(&good_with("/contact", contact), "/load", None)
}
