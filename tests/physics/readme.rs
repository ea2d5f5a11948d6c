//! Tests that the answer shown in the README is that of the example.

use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::{check, solve};
use serde_json::{Value, json};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

fn read(file: &str) -> String {
    std::fs::read_to_string(format!("{ROOT}/{file}")).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the first block of JSON.
fn block(text: &str) -> Value {
    let (_, rest) = text.split_once("```json\n").expect("a block of JSON");
    let (block, _) = rest.split_once("```").expect("its end");
    serde_json::from_str(block).expect("JSON")
}

/// Returns one unit in the last shown digit of a number.
fn unit(shown: &serde_json::Number) -> f64 {
    let text = shown.to_string();
    let digits = text.split_once('.').map_or(0, |(_, digits)| digits.len());
    10.0_f64.powi(-i32::try_from(digits).expect("few digits"))
}

/// Returns the shown value with the numbers of the answer, rounded alike. Paths of differing values are appended to `differing`.
fn filled(shown: &Value, found: &Value, path: &str, differing: &mut Vec<String>) -> Value {
    match (shown, found) {
        (Value::Object(members), _) => members
            .iter()
            .map(|(name, shown)| {
                let path = format!("{path}/{name}");
                (name.clone(), filled(shown, &found[name], &path, differing))
            })
            .collect(),
        (Value::Array(items), _) => items
            .iter()
            .enumerate()
            .map(|(k, shown)| filled(shown, &found[k], &format!("{path}/{k}"), differing))
            .collect(),
        (Value::Number(number), Value::Number(value)) => {
            let (number_f, value) = (number.as_f64().unwrap(), value.as_f64().unwrap());
            let unit = unit(number);
            if (number_f - value).abs() <= 0.501 * unit {
                return shown.clone();
            }
            differing.push(format!("{path}: {number_f} is shown, {value} is found"));
            let rounded = (value / unit).round() * unit;
            json!((rounded * 1e9).round() / 1e9)
        }
        _ => {
            if shown != found {
                differing.push(format!("{path}: {shown} is shown, {found} is found"));
            }
            found.clone()
        }
    }
}

#[test]
fn the_answer_in_the_readme_is_the_one_of_its_example() {
    let case: Value = serde_json::from_str(&read("api/examples/hertz-steel.case.json")).unwrap();
    let checked = check(&case, &Limits::default()).unwrap();
    let (solution, _) = solve(&checked, &Unmonitored).unwrap();
    let found = json!({ "state": "succeeded", "result": serde_json::to_value(solution).unwrap() });
    let mut differing = Vec::new();
    let wanted = filled(&block(&read("README.md")), &found, "", &mut differing);
    assert!(
        differing.is_empty(),
        "README.md shows another answer:\n{}\nThe block should hold\n{wanted:#}",
        differing.join("\n")
    );
}
