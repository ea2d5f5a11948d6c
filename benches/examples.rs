//! Shipped examples as cases.

use serde_json::{Value, json};

/// Lateral shifts of the wheelset in mm, from the tread to the gauge corner.
const SHIFTS: [f64; 7] = [3.0, 1.0, 0.0, -1.0, -2.0, -4.0, -5.5];

/// Returns the example in the file `name.case.json`.
pub fn example(name: &str) -> Value {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../api/examples");
    let text = std::fs::read_to_string(format!("{folder}/{name}.case.json")).expect("an example");
    serde_json::from_str(&text).expect("an example is JSON")
}

/// Returns the wheel of the examples at several lateral shifts and at the flange, with the name of each place. Only resultants are computed.
pub fn wheel_places() -> Vec<(String, Value)> {
    let shifted = SHIFTS.into_iter().map(|shift| {
        let mut case = example("wheel-rail");
        case["contact"]["lateral_shift_mm"] = json!(shift);
        (format!("shift {shift} mm"), case)
    });
    let flange = ("flange".to_owned(), example("wheel-rail-flange"));
    let mut places: Vec<_> = shifted.chain([flange]).collect();
    for (_, case) in &mut places {
        case["outputs"] = json!(["resultants"]);
    }
    places
}
