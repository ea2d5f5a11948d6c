//! Tests the machine-readable members of a validation error.

use serde_json::{Value, json};

use crate::server::{Server, example};

/// Returns the error at a pointer without its detail.
fn at(problem: &Value, pointer: &str) -> Value {
    let faults = problem["errors"].as_array().expect("faults");
    let fault = faults.iter().find(|fault| fault["pointer"] == pointer);
    let mut fault = fault
        .unwrap_or_else(|| panic!("{pointer} in {problem}"))
        .clone();
    let members = fault.as_object_mut().expect("an object");
    assert!(
        members
            .remove("detail")
            .is_some_and(|detail| detail.is_string())
    );
    members.remove("pointer");
    fault
}

#[tokio::test]
async fn faults_of_a_case_have_codes_values_ranges_units_and_words() {
    let server = Server::idle().await;
    let mut case = example("hertz-steel.case.json");
    case["friction"]["coefficient"] = json!(-0.5);
    case["load"]["normal_force_n"] = json!("much");
    case["contact"]["type"] = json!("round");
    case["motion"]["creepage_z"] = json!(1);
    case["name"] = json!("x".repeat(300));
    case["solver"] = json!({ "method": "magic" });
    case.as_object_mut().expect("an object").remove("material");
    let answer = server.post("/v1/cases/check", &case).await.is(422);
    let fault = |pointer| at(&answer.json, pointer);
    let range = json!({ "code": "out-of-range", "value": -0.5, "minimum": 0.0, "maximum": 100.0 });
    assert_eq!(fault("/friction/coefficient"), range);
    let load = fault("/load/normal_force_n");
    assert_eq!(
        (&load["code"], &load["value"], &load["unit"]),
        (&json!("wrong-type"), &json!("much"), &json!("N"))
    );
    assert_eq!(load["minimum"], 0.0);
    assert_eq!(load["minimum_excluded"], true);
    assert!(load["maximum"].is_number());
    assert_eq!(fault("/material"), json!({ "code": "missing" }));
    let word = fault("/contact/type");
    assert_eq!(word["code"], "unknown-word");
    assert_eq!(word["value"], "round");
    assert!(
        word["allowed"]
            .as_array()
            .expect("words")
            .contains(&json!("gap_profile"))
    );
    let member = fault("/motion/creepage_z");
    assert_eq!(member["code"], "unknown-member");
    assert_eq!(member["value"], 1);
    assert!(
        member["allowed"]
            .as_array()
            .expect("names")
            .contains(&json!("creepage_x"))
    );
    assert_eq!(
        fault("/name"),
        json!({ "code": "too-long", "maximum": 200 })
    );
    assert_eq!(fault("/solver/method")["code"], "unknown-word");
}

#[tokio::test]
async fn a_result_says_what_is_needed_to_read_it() {
    let server = Server::start().await;
    for (file, contact) in [
        ("hertz-steel", "radii"),
        ("pressure-grid", "pressure_grid"),
        ("wheel-rail", "profiles"),
        ("two-patches", "gap_grid"),
    ] {
        let case = example(&format!("{file}.case.json"));
        let result = server.solve(&case).await["result"].take();
        let asked = &result["asked"];
        assert_eq!(asked["contact"], contact);
        assert_eq!(
            asked["friction_coefficient"], case["friction"]["coefficient"],
            "{file}"
        );
        assert_eq!(
            asked["load"].is_object(),
            case["load"].is_object(),
            "{file}"
        );
        for patch in result["patches"].as_array().expect("patches") {
            let limit = patch["friction_limit_n"].as_f64().expect("a limit");
            let force = patch["normal_force_n"].as_f64().expect("a force");
            let friction = case["friction"]["coefficient"].as_f64().expect("a number");
            assert!((limit - friction * force).abs() <= 1e-9 * limit, "{file}");
        }
    }
}
