//! Tests that queue limits are exact under concurrent submissions and that refused work leaves nothing behind.

use std::collections::BTreeSet;

use futures_util::future::join_all;
use railhead::jobs::State;
use railhead::jobs::options::StagingBounds;
use reqwest::{Method, RequestBuilder};
use serde_json::{Value, json};

use crate::batches::{lines, send, small};
use crate::errors::assert_problem;
use crate::evolutions::request as evolution;
use crate::runs::{columns, template};
use crate::server::{Server, Setup};
use crate::support::{Turned, case};

/// Starts a service without workers with these queue limits.
async fn bounded(queue_max: u64, tenant_queue_max: u64) -> Server {
    let mut setup = Setup::idle();
    setup.options.queue_max = queue_max;
    setup.options.tenant_queue_max = tenant_queue_max;
    setup.start().await
}

fn many(count: usize) -> Vec<Value> {
    (0..count)
        .map(|number| small(&number.to_string()))
        .collect()
}

async fn queued(server: &Server) -> usize {
    let mut count = 0;
    let mut path = "/v1/jobs?state=queued&limit=1000".to_owned();
    loop {
        let page = server.read(&path).await;
        count += page["jobs"].as_array().expect("jobs").len();
        let Some(cursor) = page["next_cursor"].as_str() else {
            return count;
        };
        path = format!("/v1/jobs?state=queued&limit=1000&cursor={cursor}");
    }
}

#[tokio::test]
async fn batches_at_the_same_time_do_not_pass_the_bound_of_the_queue() {
    for (queue_max, of_tenant, size, kind, fit) in [
        (60, 10_000, 50, "queue-full", 1),
        (10_000, 110, 50, "quota-exceeded", 2),
        (2_500, 10_000, 2_000, "queue-full", 1),
    ] {
        let server = bounded(queue_max, of_tenant).await;
        let body = lines(&many(size));
        let one = || send(&server, "", "application/x-ndjson", body.clone());
        let answers = tokio::join!(one(), one(), one(), one(), one(), one());
        let answers: [_; 6] = answers.into();
        let accepted = answers.iter().filter(|answer| answer.status == 202).count();
        let status = if kind == "queue-full" { 503 } else { 429 };
        for refused in answers.iter().filter(|answer| answer.status != 202) {
            assert_problem(refused, status, kind, "");
        }
        assert_eq!(accepted, fit);
        assert_eq!(queued(&server).await, accepted * size);
        let room = queue_max.min(of_tenant) as usize - fit * size;
        send(&server, "", "application/x-ndjson", lines(&many(room)))
            .await
            .is(202);
        let one_more = server.post("/v1/jobs", &small("one more")).await;
        assert_problem(&one_more, status, kind, "nothing was stored");
        assert!(one_more.header("retry-after").is_some());
    }
}

#[tokio::test]
async fn staged_bytes_are_bounded_as_expanded() {
    let server = Server::idle_with(|setup| {
        setup.options.staging = StagingBounds {
            all: 1 << 20,
            tenant: 100_000,
        }
    })
    .await;
    let template = small("template");
    let id = server.keep(&template).await;
    let rows = 100_000 / template.to_string().len() + 1;
    let rows: String = (0..rows).map(|row| format!("{}\n", 50_000 + row)).collect();
    let table = format!("normal_force_n\n{rows}");
    assert!(table.len() < 10_000);
    let refused = send(&server, &format!("?template={id}"), "text/csv", table).await;
    assert_problem(&refused, 429, "quota-exceeded", "100000 bytes");
    // The jobs that were counted are released.
    let half = lines(&many(150));
    assert!(half.len() > 50_000, "two of these are too many together");
    for _ in 0..3 {
        send(&server, "", "application/x-ndjson", half.clone())
            .await
            .is(202);
    }
}

#[tokio::test]
async fn a_key_stands_for_one_piece_of_work_with_its_options() {
    let server = Server::idle().await;
    let rows = |count| json!({ "template": template("table"), "columns": columns(count) });
    for (path, body, other) in [
        ("/v1/jobs", small("one"), small("two")),
        ("/v1/batches", json!([small("one")]), json!([small("two")])),
        ("/v1/runs", rows(3), rows(4)),
        ("/v1/evolutions", evolution(1), evolution(2)),
    ] {
        let ask = async |query: &str, key: &str, body: &Value| {
            let path = format!("{path}{query}");
            server.post_with(&path, "idempotency-key", key, body).await
        };
        let first = ask("?priority=low", path, &body).await.is(202);
        assert_eq!(first.header("idempotency-replayed"), None);
        let again = (0..6).map(|_| ask("?priority=low", path, &body));
        for again in join_all(again).await {
            assert_eq!(again.header("idempotency-replayed"), Some("true"));
            assert_eq!(again.is(202).json, first.json);
        }
        // Concurrent requests with a new key create a single piece of work.
        let key = format!("{path}/2");
        let new = (0..6).map(|_| ask("?priority=low", &key, &body));
        let new = join_all(new).await.into_iter();
        let ids: BTreeSet<String> = new.map(|made| made.is(202).location()).collect();
        assert_eq!(ids.len(), 1, "{ids:?}");
        assert!(!ids.contains(&first.location()));
        for options in ["", "?priority=high", "?priority=low&deadline_s=60"] {
            let refused = ask(options, path, &body).await;
            assert_problem(&refused, 422, "idempotency-conflict", "");
        }
        let refused = ask("?priority=low", path, &other).await;
        assert_problem(&refused, 422, "idempotency-conflict", "different");
    }
}

#[tokio::test]
async fn the_key_of_an_expired_job_makes_a_new_one() {
    let mut setup = Setup::new();
    setup.options.retention = Some(std::time::Duration::from_secs(30 * 24 * 3600));
    let turned = Turned::default();
    setup.options.clock = turned.clock();
    setup.options.cache = false;
    let server = setup.start().await;
    let shape = |request: RequestBuilder| {
        let request = request.header("idempotency-key", "k");
        request
            .header("prefer", "wait=60")
            .json(&case("kept for a while"))
    };
    let first = server.send(Method::POST, "/v1/jobs", shape).await;
    assert_eq!(
        first.json["state"],
        State::Succeeded.name(),
        "{}",
        first.text
    );
    turned.turn(31);
    let second = server.send(Method::POST, "/v1/jobs", shape).await.is(200);
    assert_eq!(second.header("idempotency-replayed"), None);
    assert_ne!(second.json["id"], first.json["id"]);
}
