//! Tests stored cross-sections that are referenced by cases, batches and runs.

use serde_json::{Value, json};

use crate::batches::results;
use crate::errors::assert_problem;
use crate::runs::answers;
use crate::server::{Server, Setup, count, example};
use crate::table_forms::send_rows;
use crate::uploads::upload;

/// Returns the example of a wheel on a rail, its rail and its wheel.
fn pair() -> (Value, Value, Value) {
    let mut case = example("wheel-rail.case.json");
    let [rail, wheel] = ["rail", "wheel"].map(|name| case["contact"][name].clone());
    case["outputs"] = json!(["resultants"]);
    case["solver"] = json!({ "mesh": { "strips": 6, "cells": 6 } });
    (case, rail, wheel)
}

async fn keep(server: &Server, section: &Value) -> Value {
    let answer = server.post("/v1/profiles", section).await.is(201);
    answer.json
}

fn forces(result: &Value) -> &Value {
    &result["total"][0]["force_y_n"]
}

#[tokio::test]
async fn a_case_that_names_its_profiles_is_the_case_with_their_points() {
    let servers = Server::on_every_store().await;
    for server in servers {
        let (case, rail, wheel) = pair();
        let (kept_rail, kept_wheel) = (keep(&server, &rail).await, keep(&server, &wheel).await);
        assert_eq!([&kept_rail["body"], &kept_wheel["body"]], ["rail", "wheel"]);
        assert!(kept_rail["quality"]["points"].as_u64().expect("points") > 20);
        assert_eq!(server.post("/v1/profiles", &rail).await.status, 200);
        let mut named = case.clone();
        named["contact"]["rail"] = json!({ "profile": kept_rail["digest"] });
        named["contact"]["wheel"] = json!({ "profile": kept_wheel["digest"] });
        let by_name = server.solve(&named).await;
        let by_points = server.solve(&case).await;
        assert_eq!(forces(&by_name["result"]), forces(&by_points["result"]));
        assert_eq!(by_points["cached"], true, "both are the same case");
        let path = format!(
            "/v1/profiles/{}",
            kept_rail["digest"].as_str().expect("a digest")
        );
        assert_eq!(server.read(&path).await, rail);
        let listed = server.read("/v1/profiles").await;
        assert_eq!(count(&listed["profiles"]), 2);
        assert_run(&server, &named, &kept_rail).await;
        assert_pages(&server).await;
        assert_eq!(server.delete(&path).await.status, 204);
        assert_problem(&server.get(&path).await, 404, "profile-not-found", "digest");
        let gone = server.post("/v1/jobs", &named).await;
        assert_problem(&gone, 422, "faulty-case", "fault");
        assert!(gone.text.contains("/contact/rail/profile"), "{}", gone.text);
    }
}

/// Asserts that the two profiles are listed page by page.
async fn assert_pages(server: &Server) {
    let first = server.get("/v1/profiles?limit=1").await;
    let cursor = first.json["next_cursor"].as_str().expect("a next page");
    let next = format!("/v1/profiles?limit=1&cursor={cursor}");
    assert_eq!(
        first.header("link"),
        Some(&*format!("<{next}>; rel=\"next\""))
    );
    let second = server.read(&next).await;
    assert_eq!(second["next_cursor"], Value::Null);
    let all = server.read("/v1/profiles").await["profiles"].clone();
    assert_eq!(
        all,
        json!([first.json["profiles"][0], second["profiles"][0]])
    );
    for wrong in ["cursor=x", "limit=0", "limit=1001", "name=x"] {
        let refused = server.get(&format!("/v1/profiles?{wrong}")).await;
        let (name, _) = wrong.split_once('=').expect("a value");
        assert_problem(&refused, 400, "bad-query", name);
    }
}

/// Solves a run in which each row references its rail.
async fn assert_run(server: &Server, named: &Value, rail: &Value) {
    let rows = json!({ "template": named, "columns": {
        "/contact/rail/profile": [rail["digest"], rail["digest"]], "lateral_shift_mm": [0.0, 1.0]
    } });
    let run = server.post("/v1/runs", &rows).await.is(202).location();
    let rows = answers(server, &run).await;
    let mut single = named.clone();
    single["contact"]["lateral_shift_mm"] = json!(1.0);
    let single = server.solve(&single).await;
    assert_eq!(&rows[1]["force_y_n"], forces(&single["result"]));
    assert_ne!(rows[0]["force_y_n"], rows[1]["force_y_n"]);
    let id = server.keep(named).await;
    let csv = format!(
        "/contact/rail/profile,lateral_shift_mm\n{},0\n,1\n",
        rail["digest"].as_str().expect("a digest")
    );
    let empty = send_rows(server, &id, "text/csv", csv).await;
    assert_problem(&empty, 422, "faulty-case", "no text given");
    let csv = "side,lateral_shift_mm\nright,0\n";
    let copied = send_rows(server, &id, "text/csv", csv).await;
    assert_problem(&copied, 422, "faulty-table", "`/contact/side`");
    let mut unknown =
        json!({ "template": named, "columns": { "/contact/rail/profile": ["nothing"] } });
    let refused = server.post("/v1/runs", &unknown).await;
    assert_problem(&refused, 422, "faulty-case", "fault");
    unknown["columns"] = json!({ "lateral_shift_mm": [0.0] });
    unknown["template"]["contact"]["rail"] = json!({ "profile": "nothing" });
    let refused = server.post("/v1/runs", &unknown).await;
    assert!(
        refused.text.contains("/contact/rail/profile"),
        "{}",
        refused.text
    );
}

/// Tests that the profile of a row is read as it was stored, whatever is stored with that of the template, by every route.
#[tokio::test]
async fn a_column_of_profiles_replaces_the_section_of_the_template() {
    let server = Server::start().await;
    let (mut case, plain, _) = pair();
    let mut turned = plain.clone();
    turned["mirror_y"] = json!(true);
    let mut smooth = plain.clone();
    smooth["smoothing_mm"] = json!(8.0);
    let plain = keep(&server, &plain).await["digest"].clone();
    let smooth = keep(&server, &smooth).await["digest"].clone();
    case["outputs"] = json!(["resultants"]);
    let named = |digest: &Value| {
        let mut case = case.clone();
        case["contact"]["rail"] = json!({ "profile": digest });
        case
    };
    let mut expected = Vec::new();
    for digest in [&smooth, &plain] {
        let solved = server.solve(&named(digest)).await;
        expected.push(forces(&solved["result"]).clone());
    }
    assert_ne!(expected[0], expected[1]);
    let mut given = case.clone();
    given["contact"]["rail"] = turned;
    for template in [named(&smooth), named(&plain), given] {
        let columns = json!({ "/contact/rail/profile": [smooth, plain] });
        let rows = json!({ "template": template, "columns": columns });
        let run = server.post("/v1/runs", &rows).await.is(202).location();
        let found = answers(&server, &run).await;
        let evaluated = server.post("/v1/evaluate", &rows).await.is(200);
        for (k, expected) in expected.iter().enumerate() {
            assert_eq!(&found[k]["force_y_n"], expected);
            assert_eq!(&evaluated.json["columns"]["force_y_n"][k], expected);
        }
        let (template, table) = (
            template.to_string(),
            format!(
                "/contact/rail/profile\n{}\n{}\n",
                smooth.as_str().expect("a digest"),
                plain.as_str().expect("a digest")
            ),
        );
        let parts = [
            ("name=\"template\"", &*template),
            ("name=\"table\"", &*table),
        ];
        let batch = upload(&server, "/v1/batches", &parts).await.is(202);
        let solved = results(&server, &batch.json, "?wait=60").await;
        for (solved, expected) in solved.iter().zip(&expected) {
            assert_eq!(forces(&solved["result"]), expected, "{solved}");
        }
    }
}

#[tokio::test]
async fn profiles_are_bounded_and_faulty_ones_are_refused() {
    let mut setup = Setup::idle();
    let (case, rail, wheel) = pair();
    setup.options.tenant_profiles_max_bytes = rail.to_string().len() as u64 + 10;
    let server = setup.start().await;
    let rail = keep(&server, &rail).await;
    let full = server.post("/v1/profiles", &wheel).await;
    assert_problem(&full, 429, "profiles-full", "tenant-profiles-mb");
    let faulty = server
        .post("/v1/profiles", &json!({ "points_mm": [[0, 0], [1, 0]] }))
        .await;
    assert_problem(&faulty, 422, "faulty-case", "fault");
    assert_eq!(
        faulty.json["errors"][0]["pointer"], "/points_mm",
        "{}",
        faulty.text
    );
    let mut both = case.clone();
    both["contact"]["rail"]["profile"] = rail["digest"].clone();
    let refused = server.post("/v1/cases/check", &both).await;
    assert_problem(&refused, 422, "faulty-case", "fault");
    // The batch has one case with a valid reference and one with an unknown profile.
    let mut named = case;
    named["contact"]["rail"] = json!({ "profile": rail["digest"] });
    let mut unknown = named.clone();
    unknown["contact"]["rail"]["profile"] = json!("0");
    let batch = server
        .post("/v1/batches?on_invalid=skip", &json!([named, unknown]))
        .await
        .is(202);
    assert_eq!(batch.json["rejected"], 1);
    assert_eq!(
        batch.json["errors"][0]["pointer"],
        "/1/contact/rail/profile"
    );
}
