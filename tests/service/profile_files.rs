//! Cross-sections as texts of files and in other units, on every route that takes them.

use serde_json::{Value, json};

use crate::server::{Server, example};

/// The shipped wheel on a rail with both cross-sections as points, and these points.
fn case() -> (Value, [Vec<[f64; 2]>; 2]) {
    let mut case = example("wheel-rail.case.json");
    case["outputs"] = json!(["resultants"]);
    case["solver"] = json!({ "mesh": { "strips": 6, "cells": 6 } });
    let rail = points(&case["contact"]["rail"]["points_mm"]);
    let wheel = &case["contact"]["wheel"];
    let wheel = match wheel.get("points_mm") {
        Some(points_mm) => points(points_mm),
        None => rows(wheel["text"].as_str().expect("a text")),
    };
    case["contact"]["rail"] = json!({ "points_mm": rail });
    case["contact"]["wheel"] = json!({ "points_mm": wheel });
    (case, [rail, wheel])
}

fn points(value: &Value) -> Vec<[f64; 2]> {
    serde_json::from_value(value.clone()).expect("points")
}

fn rows(text: &str) -> Vec<[f64; 2]> {
    let row = |line: &str| {
        let mut numbers = line.split_whitespace().map(str::parse::<f64>);
        Some([numbers.next()?.ok()?, numbers.next()?.ok()?])
    };
    text.lines().filter_map(row).collect()
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

fn force(job: &Value) -> f64 {
    let total = &job["result"]["total"][0];
    total["force_y_n"]
        .as_f64()
        .unwrap_or_else(|| panic!("{job}"))
}

/// Whether forces differ by less than 1e-3 of the friction limit: scaled numbers differ from the given ones in their last digit.
fn is_near(found: f64, right: f64) -> bool {
    const FRICTION_LIMIT: f64 = 22_500.0;
    (found - right).abs() < 1e-3 * FRICTION_LIMIT
}

fn codes(remarks: &Value) -> Vec<&str> {
    let remarks = remarks.as_array().expect("remarks").iter();
    remarks
        .filter_map(|remark| remark["code"].as_str())
        .collect()
}

#[tokio::test]
async fn a_case_in_any_unit_and_format_is_the_case_in_millimetres() {
    let server = Server::start().await;
    let (case, [rail, wheel]) = case();
    let right = force(&server.solve(&case).await);
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
            let found = force(&server.solve(&case).await);
            assert!(is_near(found, right), "{unit}: {found} for {right}");
        }
    }
}

#[tokio::test]
async fn a_section_whose_size_says_another_unit_is_refused_or_remarked_with_it() {
    let server = Server::start().await;
    let (case, [rail, wheel]) = case();
    let whole = json!({ "points_mm": wheel });
    let in_m = with(
        &case,
        json!({ "points_mm": scaled(&rail, 1e-3) }),
        whole.clone(),
    );
    let refused = server.post("/v1/cases/check", &in_m).await;
    assert_eq!(refused.status, 422);
    assert!(
        refused.text.contains("state unit: \\\"m\\\""),
        "{}",
        refused.text
    );
    for (unit, factor) in [("cm", 0.1), ("inch", 1.0 / 25.4)] {
        let scaled_rail = scaled(&rail, factor);
        let plain = json!({ "points_mm": scaled_rail });
        let checked = server.post("/v1/profiles", &plain).await;
        // A section in inches is too short to be one in mm.
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
    let server = Server::start().await;
    let (case, [rail, wheel]) = case();
    let right = force(&server.solve(&case).await);
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
        let found = force(&server.solve(&named).await);
        assert!(is_near(found, right), "{found} for {right}");
    }
}

#[tokio::test]
async fn units_hold_for_both_sides_of_a_wheelset() {
    let server = Server::start().await;
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
    let right_wheel = &mut wheelset["contact"]["right"]["wheel"];
    right_wheel
        .as_object_mut()
        .expect("a section")
        .remove("unit");
    let refused = server.post("/v1/cases/check", &wheelset).await;
    let fault = &refused.json["errors"][0];
    assert_eq!(fault["pointer"], "/contact/right/wheel/points_mm");
    let detail = fault["detail"].as_str().expect("a detail");
    assert!(detail.contains("state unit: \"m\""), "{detail}");
}

#[tokio::test]
async fn edited_files_are_taken_with_remarks_and_broken_ones_are_shown() {
    let server = Server::start().await;
    let (case, [rail, wheel]) = case();
    let wheel = json!({ "points_mm": wheel });
    let edited = format!(
        "XYPoints={}\nColumnDef=X,Y\n\n{}\" 0 9 % too close\n",
        rail.len() + 3,
        text(&rail)
    );
    let section = json!({ "format": "miniprof", "text": edited, "mirror_y": false });
    let checked = server
        .post("/v1/cases/check", &with(&case, section, wheel.clone()))
        .await;
    assert_eq!(checked.status, 200, "{}", checked.text);
    assert!(
        codes(&checked.json["remarks"]).contains(&"profile-count-differs"),
        "{}",
        checked.text
    );
    for (format, text, words) in [
        (
            "miniprof",
            format!("{}1.5 2.x5 # corner\n", text(&rail)),
            ["1.5 2.x5 # corner", "remarks begin with"],
        ),
        (
            "simpack",
            "spline.begin\n file = 'rail.dat'\nspline.end\n".to_owned(),
            ["another file, rail.dat", "send its text"],
        ),
        (
            "simpack",
            "0 100 S_OFFSET\n2 NSLC\n0.0 'a/1.prr'\n5.0 'a/2.prr'\n".to_owned(),
            [
                "vary along the track (.slcs)",
                "the slice at the place of contact",
            ],
        ),
    ] {
        let section = json!({ "format": format, "text": text });
        let refused = server
            .post("/v1/jobs", &with(&case, section.clone(), wheel.clone()))
            .await;
        assert_eq!(refused.status, 422, "{}", refused.text);
        let fault = &refused.json["errors"][0];
        assert_eq!(fault["pointer"], "/contact/rail/text");
        let detail = fault["detail"].as_str().expect("a detail");
        assert!(words.iter().all(|word| detail.contains(word)), "{detail}");
        // Kept cross-sections are refused in the same words.
        let kept = server.post("/v1/profiles", &section).await;
        assert_eq!(
            [
                &kept.json["errors"][0]["pointer"],
                &kept.json["errors"][0]["detail"]
            ],
            [&json!("/text"), &fault["detail"]]
        );
    }
}

#[tokio::test]
async fn lengths_of_the_track_in_another_unit_are_named() {
    let server = Server::start().await;
    let (case, _) = case();
    for (member, value, unit) in [
        ("gauge_mm", 1.435, "m"),
        ("gauge_mm", 56.5, "inch"),
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
