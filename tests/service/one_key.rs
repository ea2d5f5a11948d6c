//! Does one idempotency key make one batch and one run, however many requests with it arrive while others write?

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use futures_util::future::join_all;
use serde_json::{Value, json};

use crate::server::{Server, example};
use crate::support::case;

/// Keys that are used, each by so many requests at once.
const KEYS: usize = 30;
const REQUESTS: usize = 6;

/// Sends the same request at moments that differ by a few milliseconds; the statuses, and the ids that were answered.
async fn submit(server: &Server, path: &str, key: &str, body: &Value) -> Vec<(u16, String)> {
    let one = async |number: usize| {
        tokio::time::sleep(Duration::from_millis(3 * number as u64)).await;
        let answer = server.post_with(path, "idempotency-key", key, body).await;
        let id = answer.json["id"].as_str().unwrap_or_default().to_owned();
        (answer.status, id)
    };
    join_all((0..REQUESTS).map(one)).await
}

#[tokio::test(flavor = "multi_thread")]
async fn one_key_makes_one_batch_and_one_run_while_others_write() {
    let server = Arc::new(Server::idle().await);
    let over = Arc::new(AtomicBool::new(false));
    let writers: Vec<_> = (0..3)
        .map(|writer| {
            let (server, over) = (server.clone(), over.clone());
            tokio::spawn(async move {
                let mut number = 0;
                while !over.load(Ordering::Relaxed) {
                    let cases = json!([case(&format!("{writer}.{number}"))]);
                    server.post("/v1/batches", &cases).await;
                    number += 1;
                }
            })
        })
        .collect();
    for number in 0..KEYS {
        let key = format!("k{number}");
        let mut run = example("run.json");
        run["columns"]["km"][0] = json!(number);
        let batch = json!([case(&format!("of key {number}"))]);
        let (runs, batches) = tokio::join!(
            submit(&server, "/v1/runs", &key, &run),
            submit(&server, "/v1/batches", &key, &batch)
        );
        for (what, answers) in [("run", runs), ("batch", batches)] {
            assert!(
                answers
                    .iter()
                    .all(|answer| *answer == (202, answers[0].1.clone())),
                "{what} of {key}: {answers:?}"
            );
        }
    }
    over.store(true, Ordering::Relaxed);
    for writer in writers {
        writer.await.unwrap();
    }
    let page = server.read("/v1/runs?limit=100").await;
    assert_eq!(page["runs"].as_array().unwrap().len(), KEYS);
}
