//! Prescribed tangential forces, asked for and answered over HTTP.

use serde_json::json;

use crate::errors::assert_problem;
use crate::results::number;
use crate::server::{Server, example};

#[tokio::test]
async fn a_prescribed_force_is_answered_with_its_creepage_or_refused() {
    let server = Server::start().await;
    let mut case = example("hertz-steel.case.json");
    let normal = number(&case["load"]["normal_force_n"]);
    let limit = normal * number(&case["friction"]["coefficient"]);
    case["motion"] = json!({ "force_x_n": 0.4 * limit, "spin_per_mm": 0.0003 });
    let job = server.solve(&case).await;
    assert_eq!(job["state"], "succeeded", "{job}");
    let point = &job["result"]["patches"][0]["points"][0];
    assert!(
        (number(&point["force_x_n"]) / limit - 0.4).abs() < 1e-4,
        "{point}"
    );
    assert!(number(&point["motion"]["creepage_x"]) > 0.0, "{point}");
    assert_eq!(point["saturated"], false);
    case["motion"] = json!({ "force_x_n": 1.1 * limit });
    let answer = server.post("/v1/jobs", &case).await;
    assert_problem(&answer, 422, "faulty-case", "");
    assert_eq!(answer.json["errors"][0]["pointer"], "/motion/force_x_n");
}
