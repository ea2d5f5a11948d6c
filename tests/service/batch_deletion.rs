//! Deleting a batch takes its jobs along, and nothing else.

use serde_json::{Value, json};

use crate::batches::results;
use crate::errors::assert_problem;
use crate::server::{Server, link};
use crate::support::case;

#[tokio::test]
async fn ended_batch_is_deleted_with_all_that_hangs_on_it() {
    let server = Server::start().await;
    let cases: Vec<Value> = (0..7)
        .map(|number| case(&format!("case {number}")))
        .collect();
    let body = Value::Array(cases);
    let batch = server.post("/v1/batches", &body).await.json;
    let other = server.post("/v1/batches", &body).await.json;
    let path = link(&batch, "self").to_owned();
    results(&server, &batch, "?wait=60").await;
    results(&server, &other, "?wait=60").await;
    let list = format!("/v1/jobs?batch={}", batch["id"].as_str().expect("an id"));
    let jobs = server.read(&list).await["jobs"].take();
    assert_eq!(jobs.as_array().expect("jobs").len(), 7);
    assert_eq!(server.delete(&path).await.status, 204);
    assert_problem(&server.get(&path).await, 404, "batch-not-found", "");
    assert_problem(&server.delete(&path).await, 404, "batch-not-found", "");
    for job in jobs.as_array().expect("jobs") {
        let job = link(job, "self");
        assert_problem(&server.get(job).await, 404, "job-not-found", "");
    }
    assert_eq!(server.read(&list).await["jobs"], json!([]));
    assert_eq!(
        results(&server, &other, "").await.len(),
        7,
        "the other batch stays"
    );
}
