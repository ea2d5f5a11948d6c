//! Tests that tables and evaluations of one tenant leave slots to others, and that they end.

use std::fmt::Write as _;
use std::sync::Arc;
use std::thread::available_parallelism;
use std::time::Duration;

use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::guarded::Guarded;
use crate::server::{Answer, Setup, example};
use crate::support::case;

/// Returns a case whose rows the simplified theory answers in tens of microseconds each.
fn fastsim() -> Value {
    let mut template = example("spin.case.json");
    template["solver"] = json!({ "method": "fastsim", "mesh": { "strips": 30, "cells": 30 } });
    template["outputs"] = json!(["resultants"]);
    template
}

/// Sends every kind of request with a table: a batch and a run with a template, a batch of lines, and an evaluation.
async fn every_table(guarded: &Guarded, key: &str, template: &str) -> Vec<(&'static str, Answer)> {
    let line = format!("{}\n", case("line"));
    let evaluate =
        json!({ "template": fastsim(), "columns": { "/motion/creepage_x": [0.001, 0.002] } });
    let mut run = example("run.json");
    run["columns"]["km"][0] = json!(7);
    let query = |path: &str| format!("{path}?template={template}");
    let table = "creepage_x\n0.001\n0.002\n".to_owned();
    let mut answers = Vec::new();
    for (what, path, form, body) in [
        ("batch", query("/v1/batches"), "text/csv", table.clone()),
        ("lines", "/v1/batches".into(), "application/x-ndjson", line),
        ("run", query("/v1/runs"), "text/csv", table.clone()),
        (
            "rows",
            "/v1/runs".into(),
            "application/json",
            run.to_string(),
        ),
        (
            "evaluation",
            "/v1/evaluate".into(),
            "application/json",
            evaluate.to_string(),
        ),
    ] {
        let answer = guarded.post_as(key, &path, form, body).await;
        answers.push((what, answer));
    }
    answers
}

#[tokio::test(flavor = "multi_thread")]
async fn long_evaluations_of_one_tenant_leave_turns_to_another() {
    let mut setup = Setup::idle();
    setup.http.memory_max_bytes = 4 << 30;
    setup.http.tenant_memory_max_bytes = 2 << 30;
    let guarded = Guarded::start(setup, |_| {}).await;
    let template = guarded.submit(&guarded.south, &fastsim()).await;
    let template = template.rsplit('/').next().unwrap();
    // The requests would occupy every slot for minutes if their answers were awaited.
    let mut rows = String::with_capacity(7_000_000);
    (0..1_000_000)
        .for_each(|row| write!(rows, "{}0.00{}", if row > 0 { "," } else { "" }, row % 9).unwrap());
    let body = format!(
        "{{\"template\":{},\"columns\":{{\"/motion/creepage_x\":[{rows}]}}}}",
        fastsim()
    );
    let body: Arc<str> = body.into();
    let turns = available_parallelism().map_or(1, |cores| (cores.get() / 2).max(1));
    let long: Vec<_> = (0..turns)
        .map(|_| {
            let request = reqwest::Client::new()
                .post(format!("http://{}/v1/evaluate", guarded.server.address))
                .bearer_auth(&guarded.north)
                .header("content-type", "application/json")
                .body(body.to_string());
            tokio::spawn(request.send())
        })
        .collect();
    // The long requests have usually begun by then. Otherwise they would take the slots soon.
    tokio::time::sleep(Duration::from_millis(500)).await;
    for round in 0..3 {
        for (what, answer) in every_table(&guarded, &guarded.south, template).await {
            let right = if what == "evaluation" { 200 } else { 202 };
            assert_eq!(answer.status, right, "{what} {round}: {}", answer.text);
        }
    }
    assert!(long.iter().all(|request| !request.is_finished()));
    for request in &long {
        request.abort();
    }
}

#[tokio::test]
async fn a_table_that_takes_longer_than_it_may_is_refused_and_leaves_nothing() {
    let mut setup = Setup::idle();
    setup.http.table_time = Duration::ZERO;
    let guarded = Guarded::start(setup, |_| {}).await;
    let template = guarded.submit(&guarded.south, &fastsim()).await;
    let template = template.rsplit('/').next().unwrap();
    for (what, answer) in every_table(&guarded, &guarded.south, template).await {
        // Columns in JSON are processed in a single step.
        if what == "rows" {
            assert_eq!(answer.status, 202, "{}", answer.text);
            continue;
        }
        assert_problem(&answer, 413, "body-too-large", "--table-time-s");
    }
    let used = guarded.get(&guarded.south, "/v1/me").await.json["used"].clone();
    assert_eq!(used["staged_bytes"], 0);
    let batches = guarded.get(&guarded.south, "/v1/batches").await.json;
    assert_eq!(batches["batches"], json!([]));
}
