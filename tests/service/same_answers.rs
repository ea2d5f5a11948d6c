//! Asks the same question in jobs, in a run and in an evaluation. The answers agree within both error estimates. `tests/routes` covers all features
//! and routes.

use serde_json::{Value, json};

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
fn of_row<'a>(cell: impl Fn(&str) -> &'a Value) -> [[f64; 2]; 2] {
    let [x, y, error] = ["force_x_n", "force_y_n", "error_estimate"].map(|name| number(cell(name)));
    [[x, y], [error; 2]]
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

/// Returns the columns of an evaluation and the rows of a run. Their texts agree.
async fn evaluated(server: &Server, rows: &Value) -> (Value, Vec<Value>) {
    let run = server.post("/v1/runs", rows).await.is(202);
    let of_run = answers(server, &run.location()).await;
    let columns = server.post("/v1/evaluate", rows).await.is(200).json["columns"].take();
    for name in ["status", "reason", "remarks"] {
        let texts: Vec<&Value> = of_run.iter().map(|row| &row[name]).collect();
        assert_eq!(columns[name], json!(texts), "{name}");
    }
    (columns, of_run)
}

#[tokio::test]
async fn a_row_without_a_result_has_the_same_reason_in_a_run_and_in_an_evaluation() {
    let mut case = template(&frictions()[0]);
    case["solver"] = json!({ "method": "table" });
    let columns =
        json!({ "/contact/lateral_mm": [300, 1, 300], "/friction/coefficient": [0.3, 0.3, 1e-13] });
    let rows = json!({ "template": case, "columns": columns });
    let (columns, _) = evaluated(&Server::start().await, &rows).await;
    assert_eq!(columns["status"], json!(["ok", "not_covered", "refused"]));
    assert!(columns["reason"][2].is_string(), "{columns}");
}

#[tokio::test]
async fn a_case_has_the_same_answer_alone_in_a_run_and_in_an_evaluation() {
    let server = Server::start().await;
    for friction in frictions() {
        let case = template(&friction);
        let mut alone = Vec::new();
        for [x, y] in CREEPAGES {
            let mut single = case.clone();
            single["motion"]["creepage_x"] = json!(x);
            single["motion"]["creepage_y"] = json!(y);
            let job = server.solve(&single).await;
            alone.push(of_total(&job["result"]["total"][0]));
        }
        let columns = json!({
            "/motion/creepage_x": CREEPAGES.map(|creepages| creepages[0]),
            "/motion/creepage_y": CREEPAGES.map(|creepages| creepages[1]),
        });
        let rows = json!({ "template": case, "columns": columns });
        let (columns, of_run) = evaluated(&server, &rows).await;
        let found = of_run.iter().map(|row| of_row(|name| &row[name]));
        let found: Vec<_> = found.collect();
        assert_agrees(&format!("run, {friction}"), &found, &alone);
        assert_eq!(columns["status"], json!(["ok", "ok"]), "{friction}");
        let row = |k: usize| of_row(|name| &columns[name][k]);
        assert_agrees(&format!("evaluate, {friction}"), &[0, 1].map(row), &alone);
    }
}
