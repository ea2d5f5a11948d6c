//! Runs whose rows start from rows like them, and what rows that prescribe forces are answered with.

use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::runs::{columns, ended, lines, submit, template};
use crate::server::Server;

#[tokio::test]
async fn a_run_whose_rows_start_from_their_neighbours_says_so_and_answers_as_its_rows_alone() {
    let server = Server::start().await;
    let mut rows = json!({ "template": template("boundary_element"), "columns": columns(60) });
    let steps: Vec<f64> = (0..60).map(|k| 2e-3 * (0.1 * f64::from(k)).sin()).collect();
    rows["columns"]["creepage_x"] = steps.into();
    let mut found = Vec::new();
    for (query, starts) in [("", "own"), ("?starts=neighbours", "neighbours")] {
        let answer = server.post(&format!("/v1/runs{query}"), &rows).await;
        assert_eq!(answer.status, 202, "{}", answer.text);
        assert_eq!(answer.json["starts"], starts);
        let run = answer.header("location").expect("a location").to_owned();
        assert_eq!(ended(&server, &run).await["rows_without_answer"], 0);
        let results = server.get(&format!("{run}/results?format=ndjson")).await;
        found.push(lines(&results));
    }
    let number = |row: &Value, name: &str| row[name].as_f64().expect("a number");
    let sum = |rows: &[Value]| -> f64 { rows.iter().map(|row| number(row, "iterations")).sum() };
    assert!(sum(&found[1]) < 0.7 * sum(&found[0]));
    for (own, near) in found[0].iter().zip(&found[1]) {
        assert_eq!(own["km"], near["km"]);
        assert_eq!(own["normal_force_n"], near["normal_force_n"]);
        let apart = (number(own, "force_x_n") - number(near, "force_x_n")).abs();
        // Three times 1 % of the smallest limit: more than two estimates that meet their target.
        assert!(apart < 0.03 * 0.3 * 5e4, "{own} {near}");
    }
    let answer = server.post("/v1/runs?starts=rows", &rows).await;
    assert_problem(&answer, 400, "bad-query", "starts");
    assert!(answer.text.contains("neighbours"), "{}", answer.text);
}

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
    for (row, asked) in lines(&results).iter().zip([4000.0, -9000.0]) {
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
