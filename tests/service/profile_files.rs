//! Tests cross-sections as file texts and in other units, on every route that accepts them.

use serde_json::{Value, json};

use crate::results::number;
use crate::server::{Server, example};

/// Returns the example of a wheel on a rail with both cross-sections as points, and these points.
fn case() -> (Value, [Vec<[f64; 2]>; 2]) {
    let mut case = example("wheel-rail.case.json");
    let contact = &case["contact"];
    let rail = contact["rail"]["points_mm"].clone();
    let rail: Vec<[f64; 2]> = serde_json::from_value(rail).expect("points");
    let row = |line: &str| {
        let mut numbers = line.split_whitespace().map(str::parse::<f64>);
        Some([numbers.next()?.ok()?, numbers.next()?.ok()?])
    };
    let wheel = contact["wheel"]["text"].as_str().expect("a text");
    let wheel: Vec<[f64; 2]> = wheel.lines().filter_map(row).collect();
    case["contact"]["rail"] = json!({ "points_mm": rail });
    case["contact"]["wheel"] = json!({ "points_mm": wheel });
    (case, [rail, wheel])
}

fn scaled(points: &[[f64; 2]], factor: f64) -> Vec<[f64; 2]> {
    points
        .iter()
        .map(|point| point.map(|part| part * factor))
        .collect()
}

fn text(points: &[[f64; 2]]) -> String {
    points.iter().map(|[y, z]| format!("{y} {z}\n")).collect()
}

fn with(case: &Value, rail: Value, wheel: Value) -> Value {
    let mut case = case.clone();
    case["contact"]["rail"] = rail;
    case["contact"]["wheel"] = wheel;
    case
}

/// Returns the lateral and vertical coordinate of the first contact of a case, in mm.
async fn touch(server: &Server, case: &Value) -> [f64; 2] {
    let checked = server.post("/v1/cases/check", case).await.is(200);
    let touch = &checked.json["understood"]["placement"]["first_touch"];
    [1, 2].map(|axis| number(&touch["track_mm"][axis]))
}

/// Returns whether two points are less than 0.01 mm apart.
fn is_near(found: [f64; 2], right: [f64; 2]) -> bool {
    (found[0] - right[0]).hypot(found[1] - right[1]) < 0.01
}

fn codes(remarks: &Value) -> Vec<&str> {
    let remarks = remarks.as_array().expect("remarks").iter();
    remarks
        .filter_map(|remark| remark["code"].as_str())
        .collect()
}

#[tokio::test]
async fn a_case_in_any_unit_and_format_is_the_case_in_millimetres() {
    let server = Server::idle().await;
    let (case, [rail, wheel]) = case();
    let right = touch(&server, &case).await;
    for (unit, factor) in [("m", 1e-3), ("cm", 0.1), ("inch", 1.0 / 25.4), ("mm", 1.0)] {
        let [rail, wheel] = [&rail, &wheel].map(|points| scaled(points, factor));
        let as_points = with(
            &case,
            json!({ "points_mm": rail, "unit": unit }),
            json!({ "points_mm": wheel, "unit": unit }),
        );
        let as_text = with(
            &case,
            json!({ "format": "columns", "text": text(&rail), "unit": unit }),
            json!({ "format": "miniprof", "text": format!("#MINIWHEELPROF\nStock..:\n\" 32.5 28.0 10.8\n\n{}", text(&wheel)), "unit": unit, "mirror_y": false }),
        );
        for case in [as_points, as_text] {
            let found = touch(&server, &case).await;
            assert!(is_near(found, right), "{unit}: {found:?} for {right:?}");
        }
    }
}

#[tokio::test]
async fn a_section_whose_size_says_another_unit_is_refused_or_remarked_with_it() {
    let server = Server::idle().await;
    let (case, [rail, wheel]) = case();
    let whole = json!({ "points_mm": wheel });
    let in_m = with(
        &case,
        json!({ "points_mm": scaled(&rail, 1e-3) }),
        whole.clone(),
    );
    let refused = server.post("/v1/cases/check", &in_m).await.is(422);
    assert!(
        refused.text.contains("state unit: \\\"m\\\""),
        "{}",
        refused.text
    );
    for (unit, factor) in [("cm", 0.1), ("inch", 1.0 / 25.4)] {
        let scaled_rail = scaled(&rail, factor);
        let plain = json!({ "points_mm": scaled_rail });
        let checked = server.post("/v1/profiles", &plain).await;
        // A section in inches is too small to be accepted in mm.
        let expected = if unit == "cm" { 201 } else { 422 };
        assert_eq!(checked.status, expected, "{}", checked.text);
        let words = format!("state unit: \\\"{unit}\\\"");
        assert!(checked.text.contains(&words), "{}", checked.text);
        let stated = json!({ "points_mm": scaled_rail, "unit": unit });
        let checked = server.post("/v1/profiles", &stated).await;
        assert_eq!(
            codes(&checked.json["remarks"]),
            Vec::<&str>::new(),
            "{}",
            checked.text
        );
        assert_eq!(checked.json["body"], "rail");
    }
    let unknown = with(&case, json!({ "points_mm": rail, "unit": "ft" }), whole);
    let refused = server.post("/v1/cases/check", &unknown).await;
    let fault = &refused.json["errors"][0];
    assert_eq!(fault["pointer"], "/contact/rail/unit");
    assert!(
        fault["detail"]
            .as_str()
            .expect("a detail")
            .contains("mm, cm, m, inch")
    );
}

#[tokio::test]
async fn a_kept_section_keeps_its_unit_and_a_case_may_state_another() {
    let server = Server::idle().await;
    let (case, [rail, wheel]) = case();
    let right = touch(&server, &case).await;
    let keep = async |section: Value| {
        let answer = server.post("/v1/profiles", &section).await.is(201);
        answer.json["digest"].clone()
    };
    let in_cm = keep(json!({ "points_mm": scaled(&rail, 0.1), "unit": "cm" })).await;
    let unsaid = keep(json!({ "format": "columns", "text": text(&scaled(&rail, 0.1)) })).await;
    for section in [
        json!({ "profile": in_cm }),
        json!({ "profile": unsaid, "unit": "cm" }),
    ] {
        let named = with(&case, section, json!({ "points_mm": wheel }));
        let found = touch(&server, &named).await;
        assert!(is_near(found, right), "{found:?} for {right:?}");
    }
}

#[tokio::test]
async fn units_hold_for_both_sides_of_a_wheelset() {
    let server = Server::idle().await;
    let (_, [rail, wheel]) = case();
    let mut wheelset = example("wheelset.case.json");
    let in_m = |points: &[[f64; 2]]| json!({ "points_mm": scaled(points, 1e-3), "unit": "m" });
    wheelset["contact"]["rail"] = in_m(&rail);
    wheelset["contact"]["wheel"] = in_m(&wheel);
    wheelset["contact"]["right"] = json!({ "rail": in_m(&rail), "wheel": in_m(&wheel) });
    let checked = server.post("/v1/cases/check", &wheelset).await.is(200);
    assert!(
        !checked.text.contains("profile-size-unusual"),
        "{}",
        checked.text
    );
}

#[tokio::test]
async fn a_text_that_is_not_understood_is_refused_alike_in_a_case_and_as_a_kept_section() {
    let server = Server::idle().await;
    let (case, [rail, wheel]) = case();
    let broken = format!("{}1.5 2.x5 # corner\n", text(&rail));
    let section = json!({ "format": "miniprof", "text": broken });
    let case = with(&case, section.clone(), json!({ "points_mm": wheel }));
    let refused = server.post("/v1/jobs", &case).await.is(422);
    let fault = &refused.json["errors"][0];
    assert_eq!(fault["pointer"], "/contact/rail/text");
    let detail = fault["detail"].as_str().expect("a detail");
    assert!(detail.contains("1.5 2.x5 # corner"), "{detail}");
    let kept = server.post("/v1/profiles", &section).await.is(422);
    let fault_of_kept = &kept.json["errors"][0];
    assert_eq!(fault_of_kept["pointer"], "/text");
    assert_eq!(fault_of_kept["detail"], fault["detail"]);
}

#[tokio::test]
async fn lengths_of_the_track_in_another_unit_are_named() {
    let server = Server::idle().await;
    let (case, _) = case();
    for (member, value, unit) in [
        ("gauge_mm", 1.435, "m"),
        ("flange_back_distance_mm", 136.0, "cm"),
        ("rolling_radius_mm", 0.46, "m"),
        ("rolling_radius_mm", 46.0, "cm"),
    ] {
        let mut case = case.clone();
        case["contact"][member] = json!(value);
        let checked = server.post("/v1/cases/check", &case).await;
        let words = format!("would be usual in {unit}: lengths are in mm");
        assert!(
            checked.text.contains(&words) && checked.text.contains(member),
            "{}",
            checked.text
        );
    }
    let checked = server.post("/v1/cases/check", &case).await;
    assert!(!checked.text.contains("length-unusual"), "{}", checked.text);
}
