//! One question on every route over HTTP: each answer is that of the job alone, within both estimates. The full matrix of features and routes is
//! `tests/routes`.

use railhead::jobs::codec::arrow::read;
use railhead::jobs::codec::parquet::TableReader;
use railhead::jobs::codec::table::TableColumn;
use serde_json::{Value, json};

use crate::batches::{results, send};
use crate::runs::answers;
use crate::server::{Server, example};

const CREEPAGES: [[f64; 2]; 2] = [[1e-3, -5e-4], [-2e-3, 1e-3]];
/// Lateral forces on planes and on the curve differ by more N than this in the case below.
const APART: f64 = 200.0;

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

fn frictions() -> [Value; 6] {
    [
        json!({ "coefficient": 0.3 }),
        json!({ "coefficient": 0.3, "reduction": 0.3 }),
        json!({ "coefficient": 0.3, "layer": { "shear_modulus_mpa": 1500, "thickness_mm": 0.02, "yield_mpa": 100 } }),
        json!({ "law": "exponential", "limit": 0.15, "terms": [{ "coefficient": 0.15, "half_speed_mm_per_s": 100 }] }),
        json!({ "across": { "y_mm": [-4, 4], "coefficient": [0.4, 0.15] } }),
        json!({ "by_temperature": { "temperature_c": [20, 400], "coefficient": [0.3, 0.1] } }),
    ]
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

/// Both forces and their estimates.
fn of_total(total: &Value) -> [[f64; 2]; 2] {
    let names = ["force_x_n", "force_y_n"];
    [
        names.map(|name| number(&total[name])),
        names.map(|name| number(&total["error_estimate"][name])),
    ]
}

/// The same of a row, whose estimate is that of the less certain force.
fn of_row(row: &Value) -> [[f64; 2]; 2] {
    let estimate = number(&row["error_estimate"]);
    [
        ["force_x_n", "force_y_n"].map(|name| number(&row[name])),
        [estimate; 2],
    ]
}

/// Forces that were found agree with those of the motions alone, within both estimates and within so many N.
fn assert_agrees(what: &str, found: &[[[f64; 2]; 2]], alone: &[[[f64; 2]; 2]], within: f64) {
    assert_eq!(found.len(), alone.len(), "{what}");
    for ([forces, errors], [known, known_errors]) in found.iter().zip(alone) {
        for k in 0..2 {
            let allowed = (errors[k] + known_errors[k]).min(within);
            assert!(
                (forces[k] - known[k]).abs() <= allowed,
                "{what}: {forces:?} N, alone {known:?} N, ± {allowed}"
            );
        }
    }
}

/// Rows in every form have the same statuses, and finite forces where they are `ok`.
async fn assert_forms(server: &Server, run: &str, rows: &[Value]) {
    for row in rows {
        let finite = [
            "force_x_n",
            "force_y_n",
            "moment_z_n_mm",
            "normal_force_n",
            "friction_power_n",
        ]
        .iter()
        .all(|name| row[*name].is_f64());
        assert!(
            row["status"] == "ok" && finite && row["reason"].is_null(),
            "{row}"
        );
    }
    let csv = server
        .get(&format!(
            "{run}/results?format=csv&columns=status,force_x_n"
        ))
        .await;
    let expected: String = rows
        .iter()
        .map(|row| format!("ok,{}\n", row["force_x_n"]))
        .collect();
    assert_eq!(csv.text, format!("status,force_x_n\n{expected}"));
    let forces: Vec<f64> = rows.iter().map(|row| number(&row["force_x_n"])).collect();
    let arrow = server.get(&format!("{run}/results?format=arrow")).await;
    let mut tables = read(std::io::Cursor::new(arrow.bytes)).expect("Arrow");
    let table = tables.next().expect("a batch").expect("a table");
    assert_eq!(
        table.column("force_x_n"),
        Some(&TableColumn::Numbers(forces.clone()))
    );
    let parquet = server.get(&format!("{run}/results?format=parquet")).await;
    let parquet = TableReader::new(bytes::Bytes::from(parquet.bytes)).expect("Parquet");
    let table = parquet.read(0, |_| true).expect("a group");
    assert_eq!(
        table.column("force_x_n"),
        Some(&TableColumn::Numbers(forces))
    );
    assert_eq!(
        table.column("reason"),
        Some(&TableColumn::Texts(vec![None; rows.len()]))
    );
}

/// The two motions of a case, each alone.
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

/// Jobs with several motions, and batches.
async fn assert_jobs(server: &Server, case: &Value, alone: &[[[f64; 2]; 2]], within: f64) {
    let friction = &case["friction"];
    let singles = singles(case);
    let mut list = case.clone();
    list["motion"] = singles
        .iter()
        .map(|single| single["motion"].clone())
        .collect();
    let list = totals(&server.solve(&list).await);
    assert_agrees(&format!("list, {friction}"), &list, alone, within);
    let mut sweep = case.clone();
    let values = |k: usize| json!({ "values": CREEPAGES.map(|creepages| creepages[k]) });
    sweep["motion"] = json!({ "sweep": { "creepage_x": values(0), "creepage_y": values(1), "speed_mm_per_s": 20000 } });
    let sweep = totals(&server.solve(&sweep).await);
    assert_agrees(&format!("sweep, {friction}"), &sweep, alone, within);
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
        assert_agrees(
            &format!("batch of {content}, {friction}"),
            &found,
            alone,
            within,
        );
    }
}

/// Runs and rows at once.
async fn assert_rows(server: &Server, case: &Value, alone: &[[[f64; 2]; 2]], within: f64) {
    let friction = &case["friction"];
    let columns = json!({
        "/motion/creepage_x": CREEPAGES.map(|creepages| creepages[0]),
        "/motion/creepage_y": CREEPAGES.map(|creepages| creepages[1]),
    });
    let rows = json!({ "template": case, "columns": columns });
    let run = server.post("/v1/runs", &rows).await.is(202);
    let run = run.location();
    let answers = answers(server, &run).await;
    assert_forms(server, &run, &answers).await;
    let found: Vec<_> = answers.iter().map(of_row).collect();
    assert_agrees(&format!("run, {friction}"), &found, alone, within);
    let answer = server.post("/v1/evaluate", &rows).await.is(200);
    let columns = &answer.json["columns"];
    let row = |k: usize| {
        let of = |name: &str| columns[name][k].clone();
        json!({ "force_x_n": of("force_x_n"), "force_y_n": of("force_y_n"), "error_estimate": of("error_estimate") })
    };
    assert_eq!(columns["status"], json!(["ok", "ok"]), "{friction}");
    let found = [0, 1].map(|k| of_row(&row(k)));
    assert_agrees(&format!("evaluate, {friction}"), &found, alone, within);
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
        assert_jobs(&server, &case, &alone, f64::INFINITY).await;
        assert_rows(&server, &case, &alone, f64::INFINITY).await;
    }
}

#[tokio::test]
async fn a_row_without_an_answer_has_a_reason_and_a_run_has_one_position_in_each_row() {
    let server = Server::start().await;
    let mut case = template(&frictions()[0]);
    // An ellipse whose pressure is absurd in the second row, which no look at one number shows.
    case["contact"] = json!({ "type": "ellipse", "a_mm": 5, "b_mm": 4 });
    let columns =
        json!({ "/load/normal_force_n": [8e4, 1e-20], "/motion/creepage_x": [1e-3, 1e-3] });
    let rows = json!({ "template": case, "columns": columns });
    let answer = server.post("/v1/evaluate", &rows).await;
    assert_eq!(
        answer.json["columns"]["status"],
        json!(["ok", "refused"]),
        "{}",
        answer.text
    );
    assert!(answer.json["columns"]["force_x_n"][1].is_null());
    let run = server.post("/v1/runs", &rows).await;
    let run = run.location();
    let answers = answers(&server, &run).await;
    assert_eq!(answers[1]["status"], "refused");
    let reason = answers[1]["reason"].as_str().expect("a reason");
    assert!(reason.contains("/load: the largest pressure"), "{reason}");
    let mut positions = example("wheelset.case.json");
    positions["contact"]
        .as_object_mut()
        .expect("a contact")
        .remove("kinematics");
    let rows = json!({ "template": positions, "columns": { "/load/vertical_force_n": [150_000, 140_000] } });
    let refused = server.post("/v1/runs", &rows).await;
    assert!(
        refused.status == 422 && refused.text.contains("3 positions"),
        "{}",
        refused.text
    );
}

/// A wheel at the gauge corner, where planes and the curve differ by more than their estimates.
fn at_gauge_corner(other: Value) -> Value {
    let mut case = example("wheel-rail-flange.case.json");
    case["contact"]["lateral_shift_mm"] = json!(-6.0);
    case["load"] = json!({ "normal_force_n": 80_000 });
    case["motion"] = json!({ "creepage_x": 0.0, "creepage_y": 0.0, "speed_mm_per_s": 20_000 });
    case["solver"] = json!({ "target_error": 0.02 });
    case["outputs"] = json!(["resultants"]);
    for (block, members) in other.as_object().expect("blocks") {
        for (name, member) in members.as_object().expect("members") {
            case[block][name] = member.clone();
        }
    }
    case
}

#[tokio::test]
async fn a_wheel_is_solved_on_the_same_surface_on_every_route() {
    let server = Server::start().await;
    let soft = json!({ "shear_modulus_mpa": 26_000, "poisson_ratio": 0.33 });
    let steel = json!({ "shear_modulus_mpa": 82_000, "poisson_ratio": 0.28 });
    let usual = at_gauge_corner(json!({}));
    let mut differ = usual.clone();
    differ["material"] = json!({ "upper": soft, "lower": steel });
    let planes = at_gauge_corner(json!({ "contact": { "reference_surface": "plane" } }));
    let fastsim =
        at_gauge_corner(json!({ "solver": { "method": "fastsim", "target_error": 0.2 } }));
    let mut surfaces = Vec::new();
    let cases = [usual, planes, differ, fastsim].into_iter();
    for (case, on_planes) in cases.zip([false, false, false, true]) {
        let mut alone = Vec::new();
        for single in singles(&case) {
            let job = server.solve(&single).await;
            let remarks = job["result"]["remarks"].as_array().expect("remarks");
            let told = remarks.iter().any(|remark| remark["code"] == "on-planes");
            assert_eq!(told, on_planes, "{remarks:?}");
            alone.push(of_total(&job["result"]["total"][0]));
        }
        assert_jobs(&server, &case, &alone, APART / 4.0).await;
        assert_rows(&server, &case, &alone, APART / 4.0).await;
        surfaces.push(alone);
    }
    let [[_, of_curve], _] = [surfaces[0][0], surfaces[0][1]].map(|[forces, _]| forces);
    let [[_, of_planes], _] = [surfaces[1][0], surfaces[1][1]].map(|[forces, _]| forces);
    assert!(
        (of_curve - of_planes).abs() > APART,
        "{of_curve} {of_planes}"
    );
}
