//! Asks the same question on every route over HTTP. Each answer agrees with that of a single job within both error estimates. `tests/routes` covers
//! all features and routes.

use serde_json::{Value, json};

use crate::batches::{results, send};
use crate::results::number;
use crate::runs::answers;
use crate::server::Server;

const CREEPAGES: [[f64; 2]; 2] = [[1e-3, -5e-4], [-2e-3, 1e-3]];

fn template(friction: &Value) -> Value {
    let mut case = json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": friction,
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 80000 },
        "motion": { "creepage_x": 0.0, "creepage_y": 0.0, "speed_mm_per_s": 20000 },
        "solver": { "target_error": 0.02 },
        "outputs": ["resultants"],
    });
    if friction.get("by_temperature").is_some() {
        case["thermal"] = json!({ "conductivity_w_per_mk": 50, "density_kg_per_m3": 7850, "specific_heat_j_per_kgk": 450, "bulk_c": 20 });
    }
    case
}

/// Returns a constant coefficient, and friction that depends on the path of a point through the contact.
fn frictions() -> [Value; 2] {
    [
        json!({ "coefficient": 0.3 }),
        json!({ "by_temperature": { "temperature_c": [20, 400], "coefficient": [0.3, 0.1] } }),
    ]
}

/// Returns both forces and their error estimates.
fn of_total(total: &Value) -> [[f64; 2]; 2] {
    let names = ["force_x_n", "force_y_n"];
    [
        names.map(|name| number(&total[name])),
        names.map(|name| number(&total["error_estimate"][name])),
    ]
}

/// Returns both forces of a row. The row has one error estimate, that of the less certain force, which is returned for both.
fn of_row(row: &Value) -> [[f64; 2]; 2] {
    let estimate = number(&row["error_estimate"]);
    [
        ["force_x_n", "force_y_n"].map(|name| number(&row[name])),
        [estimate; 2],
    ]
}

/// Asserts that forces agree with those of single motions within both error estimates.
fn assert_agrees(what: &str, found: &[[[f64; 2]; 2]], alone: &[[[f64; 2]; 2]]) {
    assert_eq!(found.len(), alone.len(), "{what}");
    for ([forces, errors], [known, known_errors]) in found.iter().zip(alone) {
        for k in 0..2 {
            let allowed = errors[k] + known_errors[k];
            assert!(
                (forces[k] - known[k]).abs() <= allowed,
                "{what}: {forces:?} N, alone {known:?} N, ± {allowed}"
            );
        }
    }
}

/// Returns the two motions of a case as single cases.
fn singles(case: &Value) -> [Value; 2] {
    CREEPAGES.map(|[x, y]| {
        let mut single = case.clone();
        single["motion"]["creepage_x"] = json!(x);
        single["motion"]["creepage_y"] = json!(y);
        single
    })
}

fn totals(job: &Value) -> Vec<[[f64; 2]; 2]> {
    let totals = job["result"]["total"].as_array().expect("totals");
    totals.iter().map(of_total).collect()
}

/// Tests jobs with several motions, and batches.
async fn assert_jobs(server: &Server, case: &Value, alone: &[[[f64; 2]; 2]]) {
    let friction = &case["friction"];
    let singles = singles(case);
    let mut list = case.clone();
    list["motion"] = singles
        .iter()
        .map(|single| single["motion"].clone())
        .collect();
    let list = totals(&server.solve(&list).await);
    assert_agrees(&format!("list, {friction}"), &list, alone);
    let mut sweep = case.clone();
    let values = |k: usize| json!({ "values": CREEPAGES.map(|creepages| creepages[k]) });
    sweep["motion"] = json!({ "sweep": { "creepage_x": values(0), "creepage_y": values(1), "speed_mm_per_s": 20000 } });
    let sweep = totals(&server.solve(&sweep).await);
    assert_agrees(&format!("sweep, {friction}"), &sweep, alone);
    let query = format!("?template={}", server.keep(&singles[0]).await);
    let table = "creepage_x,creepage_y\n1e-3,-5e-4\n-2e-3,1e-3\n".to_owned();
    let cases = Value::from(singles.to_vec()).to_string();
    for (query, content, body) in [
        ("", "application/json", cases),
        (&*query, "text/csv", table),
    ] {
        let batch = send(server, query, content, body).await.is(202);
        let answers = results(server, &batch.json, "?wait=60").await;
        let found: Vec<_> = answers
            .iter()
            .map(|line| of_total(&line["result"]["total"][0]))
            .collect();
        assert_agrees(&format!("batch of {content}, {friction}"), &found, alone);
    }
}

/// Tests runs and evaluations.
async fn assert_rows(server: &Server, case: &Value, alone: &[[[f64; 2]; 2]]) {
    let friction = &case["friction"];
    let columns = json!({
        "/motion/creepage_x": CREEPAGES.map(|creepages| creepages[0]),
        "/motion/creepage_y": CREEPAGES.map(|creepages| creepages[1]),
    });
    let rows = json!({ "template": case, "columns": columns });
    let run = server.post("/v1/runs", &rows).await.is(202);
    let run = run.location();
    let answers = answers(server, &run).await;
    let found: Vec<_> = answers.iter().map(of_row).collect();
    assert_agrees(&format!("run, {friction}"), &found, alone);
    let answer = server.post("/v1/evaluate", &rows).await.is(200);
    let columns = &answer.json["columns"];
    let row = |k: usize| {
        let of = |name: &str| columns[name][k].clone();
        json!({ "force_x_n": of("force_x_n"), "force_y_n": of("force_y_n"), "error_estimate": of("error_estimate") })
    };
    assert_eq!(columns["status"], json!(["ok", "ok"]), "{friction}");
    let found = [0, 1].map(|k| of_row(&row(k)));
    assert_agrees(&format!("evaluate, {friction}"), &found, alone);
}

#[tokio::test]
async fn a_case_has_the_same_answer_on_every_route_whatever_its_friction() {
    let server = Server::start().await;
    for friction in frictions() {
        let case = template(&friction);
        let mut alone = Vec::new();
        for single in singles(&case) {
            let job = server.solve(&single).await;
            alone.push(of_total(&job["result"]["total"][0]));
        }
        assert_jobs(&server, &case, &alone).await;
        assert_rows(&server, &case, &alone).await;
    }
}
