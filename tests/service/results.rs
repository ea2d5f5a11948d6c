//! Tests results: fields, zones, grids, sweeps and rolling histories, compared with each other and with the solver.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::server::{Server, Setup, example, link};

/// Returns the numbers of an array.
pub fn numbers(value: &Value) -> Vec<f64> {
    let items = value
        .as_array()
        .unwrap_or_else(|| panic!("{value} is no array"));
    items
        .iter()
        .map(|item| {
            item.as_f64()
                .unwrap_or_else(|| panic!("{item} is no number"))
        })
        .collect()
}

/// Returns a JSON number.
pub fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

/// Returns the path of a job.
pub fn path_of(job: &Value) -> String {
    link(job, "self").to_owned()
}

fn assert_close(left: f64, right: f64, scale: f64, what: &str) {
    assert!(
        (left - right).abs() <= 1e-9 * scale,
        "{what}: {left} and {right} differ"
    );
}

#[tokio::test]
async fn a_result_is_read_without_a_look_at_the_case() {
    let checks = Arc::new(AtomicUsize::new(0));
    let counter = checks.clone();
    let mut setup = Setup::new();
    setup.recipe.check = Arc::new(move |known, case, limits| {
        counter.fetch_add(1, Ordering::SeqCst);
        railhead::contact::check_with(known, case, limits)
    });
    let server = setup.start().await;
    let mut case = example("spin.case.json");
    case["outputs"] = json!(["resultants"]);
    let job = server.solve(&case).await;
    let before = checks.load(Ordering::SeqCst);
    let path = link(&job, "result");
    let result = server.get(path).await;
    assert_eq!(result.json["links"], job["result"]["links"]);
    let slip = path.replace("result", "slip");
    assert_eq!(server.get(&slip).await.status, 404, "it was not asked for");
    assert_eq!(checks.load(Ordering::SeqCst), before);
}

/// Returns the area inside closed polygons. Holes count as negative.
fn area(polygons: &Value) -> f64 {
    let polygons = polygons
        .as_array()
        .expect("polygons")
        .iter()
        .map(|polygon| {
            let corners: Vec<Vec<f64>> = polygon
                .as_array()
                .expect("corners")
                .iter()
                .map(numbers)
                .collect();
            let next = corners.iter().cycle().skip(1);
            corners
                .iter()
                .zip(next)
                .map(|(a, b)| 0.5 * (a[0] * b[1] - b[0] * a[1]))
                .sum::<f64>()
        });
    polygons.sum()
}

#[tokio::test]
async fn outlines_enclose_the_areas_of_the_zones() {
    let server = Server::start().await;
    let job = server.solve(&example("hertz-steel.case.json")).await;
    let zones = server.read(&format!("{}/zones", path_of(&job))).await;
    let (stick, slip) = (
        number(&zones["stick_area_mm2"]),
        number(&zones["slip_area_mm2"]),
    );
    assert!(
        stick > 1.0 && slip > 1.0,
        "the patch sticks on {stick} and slips on {slip} mm²"
    );
    let patch = &job["result"]["patches"][0];
    assert_eq!(
        (
            &patch["points"][0]["stick_area_mm2"],
            &patch["points"][0]["slip_area_mm2"]
        ),
        (&zones["stick_area_mm2"], &zones["slip_area_mm2"])
    );
    assert_close(stick + slip, number(&patch["area_mm2"]), 1.0, "both areas");
    let cells = area(&zones["outlines"]["stick"]) + area(&zones["outlines"]["slip"]);
    let words = zones["cells"]["zone"].as_array().expect("zones");
    for (word, count, expected) in [
        ("stick", &zones["stick_cells"], stick),
        ("slip", &zones["slip_cells"], slip),
    ] {
        assert_eq!(
            words.iter().filter(|zone| **zone == word).count() as u64,
            count.as_u64().expect("a count"),
            "{word}"
        );
        // The areas are fractions of the area of the patch, which the cells approximate.
        let share = area(&zones["outlines"][word]) / cells;
        let expected = expected / (stick + slip);
        assert!(
            (share - expected).abs() < 1e-9,
            "{word}: the outline encloses {share} of the cells, not {expected}"
        );
    }
    let whole = area(&zones["outlines"]["patch"]);
    let contact = number(&patch["area_mm2"]);
    assert!(
        (whole - contact).abs() < 0.02 * contact,
        "the outline of the patch encloses {whole}, not {contact}"
    );
}

#[tokio::test]
async fn each_motion_of_a_sweep_is_fetched_by_its_number() {
    let server = Server::start().await;
    let job = server.solve(&example("sweep.case.json")).await;
    let path = path_of(&job);
    let all = server.read(&format!("{path}/resultants")).await;
    let forces: Vec<f64> = all["total"]
        .as_array()
        .expect("totals")
        .iter()
        .map(|total| number(&total["force_x_n"]).abs())
        .collect();
    assert_eq!(forces.len(), 11);
    assert!(
        forces[0].abs() < 1e-6 && forces.is_sorted(),
        "a creep curve rises from 0: {forces:?}"
    );
    let one = server
        .read(&format!("{path}/resultants?point=10&patch=0"))
        .await;
    assert_eq!(one["total"], json!([all["total"][10]]));
    assert_eq!(
        one["patches"][0]["points"],
        json!([all["patches"][0]["points"][10]])
    );
    let slipping = async |point: u32| {
        number(&server.read(&format!("{path}/zones?point={point}")).await["slip_area_mm2"])
    };
    assert!(slipping(10).await > slipping(1).await);
    for query in [
        "zones?point=11",
        "zones?patch=1",
        "resultants?point=11",
        "resultants?patch=1",
    ] {
        let answer = server.get(&format!("{path}/{query}")).await;
        assert_problem(&answer, 400, "bad-query", "");
    }
    for query in ["point=11", "patch=1"] {
        let fields = path_of(&server.solve(&example("spin.case.json")).await);
        let answer = server.get(&format!("{fields}/tractions?{query}")).await;
        assert_problem(&answer, 400, "bad-query", "`; allowed: 0 to 0");
    }
}

#[tokio::test]
async fn a_history_is_answered_point_by_point_in_json_and_csv() {
    let server = Server::start().await;
    let case = example("rolling.case.json");
    server.post("/v1/cases/check", &case).await.is(200);
    let job = server.solve(&case).await;
    assert_eq!(job["state"], "succeeded", "{job}");
    let distances = case["motion"]["history"]["distance_mm"].as_array().unwrap();
    let points = job["result"]["patches"][0]["points"].as_array().unwrap();
    assert_eq!(points.len(), distances.len());
    let mut dissipated = 0.0;
    for (point, distance) in points.iter().zip(distances) {
        let history = &point["history"];
        assert_eq!(number(&history["distance_mm"]), number(distance));
        assert!(number(&history["dissipated_n_mm"]) >= dissipated, "{point}");
        dissipated = number(&history["dissipated_n_mm"]);
    }
    // The two points without rolling are tangential shifts.
    let shifted = |k: usize| number(&points[k]["history"]["shift_x_mm"]);
    assert!(shifted(0) > 0.0 && shifted(12) < 0.0, "{job}");
    assert!(points[1]["history"].get("shift_x_mm").is_none());
    let path = format!("/v1/jobs/{}/resultants", job["id"].as_str().unwrap());
    let table = server.get(&format!("{path}?format=csv")).await.text;
    let mut lines = table.lines();
    let head = lines.next().unwrap();
    assert!(
        head.contains(",distance_mm,dissipated_n_mm,shift_x_mm"),
        "{head}"
    );
    let columns = head.split(',').count();
    assert!(lines.all(|line| line.split(',').count() == columns));
    let mut faulty = case;
    faulty["motion"]["history"]["distance_mm"] = json!([1, 0]);
    server.post("/v1/jobs", &faulty).await.is(422);
}
