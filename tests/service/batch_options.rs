//! Tests individual priorities and deadlines of the cases of a batch.

use serde_json::{Value, json};

use crate::batches::{lines, send, small};
use crate::server::Server;

const NDJSON: &str = "application/x-ndjson";

/// Returns, for each job of a batch in the order of the cases, its priority and whether it has a deadline.
async fn options(server: &Server, batch: &Value) -> Vec<(String, bool)> {
    let id = batch["id"].as_str().expect("an id");
    let page = server.read(&format!("/v1/jobs?batch={id}")).await;
    let jobs = page["jobs"].as_array().expect("jobs").iter().rev();
    jobs.map(|job| {
        let priority = job["priority"].as_str().expect("a priority");
        (priority.to_owned(), job["deadline_at"].is_string())
    })
    .collect()
}

#[tokio::test]
async fn a_case_of_a_batch_may_have_options_of_its_own_in_every_form_of_a_batch() {
    let server = Server::idle().await;
    let own = json!({ "case": small("b"), "priority": "high", "deadline_s": 600 });
    let cases = [small("a"), own, json!({ "case": small("c") })];
    let expected = [("low", false), ("high", true), ("low", false)]
        .map(|(priority, deadline)| (priority.to_owned(), deadline));
    for (content, body) in [
        (NDJSON, lines(&cases)),
        ("application/json", json!(cases).to_string()),
    ] {
        let batch = send(&server, "?priority=low", content, body).await.is(202);
        assert_eq!(options(&server, &batch.json).await, expected);
    }
    let template = server.keep(&small("template")).await;
    let query = format!("?priority=low&template={template}");
    let table = "name,priority,deadline_s\na,,\nb,high,600\nc,,\n".to_owned();
    let batch = send(&server, &query, "text/csv", table).await;
    assert_eq!(options(&server, &batch.json).await, expected);

    // Only the case is stored.
    let id = batch.json["id"].as_str().expect("an id");
    let page = server.read(&format!("/v1/jobs?batch={id}")).await;
    let job = page["jobs"][1]["id"].as_str().expect("an id");
    let case = server.read(&format!("/v1/jobs/{job}/case")).await;
    assert_eq!(case["name"], "b");
    assert!(case.get("priority").is_none() && case.get("case").is_none());
}
