//! Tests rolling histories over HTTP.

use serde_json::json;

use crate::results::number;
use crate::server::{Server, example};

#[tokio::test]
async fn a_history_is_answered_point_by_point_in_json_and_csv() {
    let server = Server::start().await;
    let case = example("rolling.case.json");
    let check = server.post("/v1/cases/check", &case).await;
    assert_eq!(check.status, 200, "{}", check.json);
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
    let answer = server.post("/v1/jobs", &faulty).await;
    assert_eq!(answer.status, 422, "{}", answer.json);
}
