//! Tests active requests when their key is revoked.

use std::time::Duration;

use axum::body::Body;
use http_body_util::BodyExt;
use railhead::http::{HttpOptions, router};
use railhead::jobs::keys::Keyring;
use reqwest::Method;
use serde_json::json;
use tower::ServiceExt;

use crate::errors::assert_problem;
use crate::guarded::Guarded;
use crate::runs::template;
use crate::server::Setup;
use crate::support::case;

/// Timeout of a test that hangs.
const WITHIN: Duration = Duration::from_secs(45);

/// Starts a service without workers.
async fn idle() -> Guarded {
    Guarded::start(Setup::idle(), |_| {}).await
}

/// Revokes the key of the tenant `north` while the service runs.
async fn revoke(guarded: &Guarded) {
    let folder = &guarded.server.jobs.options().data_dir;
    let keys = Keyring::open(folder).await.unwrap();
    let id = guarded.north.split('_').nth(1).unwrap();
    assert!(keys.revoke(id).await.unwrap().is_some());
    keys.close().await;
}

#[tokio::test]
async fn requests_that_wait_end_long_before_their_time() {
    let guarded = idle().await;
    let job = guarded
        .submit(&guarded.north, &case("is never solved"))
        .await;
    let waiting = async |method: Method, path: &str| {
        let shape = |request: reqwest::RequestBuilder| {
            let request = request.bearer_auth(&guarded.north);
            let request = request.header("prefer", "wait=60");
            match path {
                "/v1/jobs" => request.json(&case("another")),
                _ => request,
            }
        };
        guarded.server.send(method, path, shape).await
    };
    let result = format!("{job}/result");
    let ended = tokio::time::timeout(WITHIN, async {
        tokio::join!(
            waiting(Method::GET, &job),
            waiting(Method::GET, &result),
            waiting(Method::POST, "/v1/jobs"),
            async {
                // The other requests have usually begun by then. The test does not depend on it.
                tokio::time::sleep(Duration::from_millis(500)).await;
                revoke(&guarded).await;
            }
        )
    });
    let (job, result, submitted, ()) = ended.await.expect("answers before the 60 s are over");
    assert_problem(&job, 401, "unauthorized", "revoked");
    assert_problem(&result, 401, "unauthorized", "revoked");
    // Accepted work is acknowledged.
    assert_eq!(submitted.status, 202, "{}", submitted.text);
    assert!(submitted.json["id"].is_string());
}

#[tokio::test]
async fn results_of_a_run_break_off_and_do_not_look_complete() {
    let guarded = idle().await;
    let north = &guarded.north;
    // Expensive rows make short chunks, each of which is a piece of the answer. A cancelled run has these chunks without a solve.
    let mut template = template("boundary_element");
    template["solver"] =
        json!({ "method": "boundary_element", "mesh": { "strips": 32, "cells": 32 } });
    let loads: Vec<f64> = (0..2500).map(|row| 50_000.0 + f64::from(row)).collect();
    let rows = json!({ "template": template, "columns": { "/load/normal_force_n": loads } });
    let run = guarded.post(north, "/v1/runs", &rows).await.is(202);
    let run = run.location();
    guarded.cancel(north, &run).await.is(200);
    let router = router(guarded.server.jobs.clone(), HttpOptions::default());
    let mut open = Vec::new();
    for format in ["csv", "ndjson", "arrow", "parquet"] {
        let request = axum::http::Request::get(format!("{run}/results?format={format}"))
            .header("host", "localhost")
            .header("authorization", format!("Bearer {north}"))
            .body(Body::empty())
            .unwrap();
        let answer = router.clone().oneshot(request).await.unwrap();
        assert_eq!(answer.status(), 200);
        let mut body = answer.into_body();
        assert!(matches!(body.frame().await, Some(Ok(_))), "{format}");
        open.push((format, body));
    }
    revoke(&guarded).await;
    // The key of an active answer is checked every 2 s.
    tokio::time::sleep(Duration::from_secs(3)).await;
    for (format, mut body) in open {
        let mut pieces = 0;
        let broken = loop {
            match body.frame().await {
                Some(Ok(_)) => pieces += 1,
                Some(Err(_)) => break true,
                None => break false,
            }
            // The key is checked during the pause.
            tokio::time::sleep(Duration::from_millis(200)).await;
        };
        assert!(broken, "{format}: complete after {pieces} pieces");
    }
}
