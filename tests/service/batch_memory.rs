//! Tests memory of batch results while they are read: it is bounded for small results and counted for each large one.

use axum::body::Body;
use http_body_util::BodyExt;
use railhead::http::{HttpOptions, Peer, router};
use serde_json::{Value, json};
use tower::ServiceExt;

use crate::server::{Server, link};
use crate::support::long_case;

/// The number of bytes counted for a reader of small results.
const READER_BYTES: usize = 512 << 10;
/// The ratio of the memory limit to the part of it for answers.
const ANSWERS: usize = 2;

/// Solves a batch of a small, a large and a small case. Returns the path of its results and the path of the large result.
async fn solved(server: &Server, motions: u32) -> (String, String) {
    let mut large = long_case("large", motions);
    large["solver"]["mesh"] = json!({ "strips": 2, "cells": 2 });
    let cases = json!([long_case("before", 2), large, long_case("behind", 3)]);
    let batch = server.post("/v1/batches", &cases).await.json;
    let path = link(&batch, "results").to_owned();
    let lines = server.get(&format!("{path}?wait=60")).await.lines();
    let job = lines[1]["id"].as_str().expect("an id");
    (path, format!("/v1/jobs/{job}/result"))
}

/// Returns a router on the same jobs with this much memory for answers.
fn with_answers(server: &Server, bytes: usize) -> axum::Router {
    let memory = ANSWERS * bytes;
    let options = HttpOptions {
        memory_max_bytes: memory,
        tenant_memory_max_bytes: memory,
        ..HttpOptions::default()
    };
    router(server.jobs.clone(), options)
}

/// Returns the status of an answer and its unread body.
async fn ask(router: &axum::Router, path: &str) -> (u16, Body) {
    let mut request = axum::http::Request::get(path)
        .header("host", "localhost")
        .body(Body::empty())
        .expect("a request");
    let peer = Peer("127.0.0.1".parse().expect("an address"));
    request.extensions_mut().insert(peer);
    let answer = router.clone().oneshot(request).await.expect("an answer");
    (answer.status().as_u16(), answer.into_body())
}

async fn text_of(body: Body) -> String {
    let bytes = body.collect().await.expect("a whole body").to_bytes();
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// Returns how many additional readers are accepted before one is refused.
async fn readers(router: &axum::Router, path: &str) -> usize {
    let mut reading = Vec::new();
    loop {
        match ask(router, path).await {
            (200, body) => reading.push(body),
            (status, _) => {
                assert_eq!(status, 503);
                return reading.len();
            }
        }
    }
}

#[tokio::test]
async fn a_result_that_is_larger_than_all_memory_for_answers_passes_through_the_lines_of_its_batch()
{
    let server = Server::start().await;
    let (path, large) = solved(&server, 1500).await;
    let result = server.get(&large).await;
    let little = with_answers(&server, 3 * READER_BYTES / 2);
    assert!(result.bytes.len() > 3 * READER_BYTES / 2, "it is not large");

    let (status, body) = ask(&little, &path).await;
    assert_eq!(status, 200);
    let lines: Vec<Value> = text_of(body)
        .await
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    assert_eq!(lines.len(), 3);
    assert_eq!(lines[1]["result"], result.json);

    // A table needs the whole result in memory, which exceeds the limit.
    let (_, body) = ask(&little, &format!("{path}?format=csv")).await;
    let table = text_of(body).await;
    assert_eq!(table.lines().count(), 1 + 2 + 1 + 3, "{table}");
    let refused = table.lines().nth(3).expect("a line");
    assert!(
        refused.contains("exceeds the memory limit of a table"),
        "{refused}"
    );
    let (_, body) = ask(
        &with_answers(&server, 32 << 20),
        &format!("{path}?format=csv"),
    )
    .await;
    assert_eq!(text_of(body).await.lines().count(), 1 + 2 + 1500 + 3);
    assert_counted_while_read(&server, &path, result.bytes.len()).await;
}

/// Asserts that the memory of a large result is counted while its table is read.
async fn assert_counted_while_read(server: &Server, path: &str, bytes: usize) {
    let places = 2 * bytes / READER_BYTES + 3;
    let router = with_answers(server, places * READER_BYTES);
    let table = format!("{path}?format=csv");
    assert_eq!(readers(&router, &table).await, places);

    let (_, mut body) = ask(&router, &table).await;
    let mut seen = String::new();
    while !seen.contains(",large,") {
        let frame = body.frame().await.expect("more").expect("a piece");
        let piece = frame.into_data().expect("data");
        seen.push_str(std::str::from_utf8(&piece).expect("UTF-8"));
    }
    let left = readers(&router, &table).await;
    let counted = places - 1 - left;
    assert!(
        (bytes / 2..2 * bytes).contains(&(counted * READER_BYTES)),
        "{counted} of {places} places for {bytes} bytes"
    );
    drop(body);
    assert_eq!(readers(&router, &table).await, places);
}
