//! Runs whose rows prescribe forces.

use serde_json::json;

use crate::runs::{ended, submit, template};
use crate::server::Server;

#[tokio::test]
async fn rows_with_prescribed_forces_tell_the_creepages_that_were_found() {
    let server = Server::start().await;
    let mut body = json!({
        "template": template("auto"),
        "columns": {
            "/load/normal_force_n": [8e4, 9e4],
            "/motion/force_y_n": [4000.0, -9000.0],
            "/motion/creepage_x": [1e-3, 0.0],
        },
    });
    body["template"]["motion"] = json!({ "spin_per_mm": 0.0004 });
    let run = submit(&server, &body).await;
    let ended = ended(&server, &run).await;
    let names: Vec<&str> = (ended["answers"].as_array().expect("columns").iter())
        .map(|column| column["name"].as_str().expect("a name"))
        .collect();
    assert!(names.contains(&"creepage_y") && !names.contains(&"creepage_x"));
    let results = server.get(&format!("{run}/results?format=ndjson")).await;
    for (row, asked) in results.lines().iter().zip([4000.0, -9000.0]) {
        let number = |name: &str| row[name].as_f64().expect("a number");
        assert!(
            (number("force_y_n") - asked).abs() < 0.01 * 0.3 * 8e4,
            "{row}"
        );
        // Submitted as a job, the row with this creepage has this force.
        let mut case = body["template"].clone();
        case["load"]["normal_force_n"] = number("normal_force_n").into();
        let at = number("row") as usize;
        case["motion"]["creepage_x"] = body["columns"]["/motion/creepage_x"][at].clone();
        case["motion"]["creepage_y"] = number("creepage_y").into();
        let solved = server.solve(&case).await;
        let force = solved["result"]["total"][0]["force_y_n"]
            .as_f64()
            .expect("a force");
        assert!(
            (force - asked).abs() < 0.02 * 0.3 * 8e4,
            "{force} N, {asked} N asked for"
        );
    }
}
