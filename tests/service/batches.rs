//! Tests batches: atomic acceptance, solution in groups, results in input order, options of single cases.

use std::time::Duration;

use railhead::contact::solve;
use railhead::jobs::model::Kind;
use railhead::jobs::store::NewBatch;
use reqwest::Method;
use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::lab::Lab;
use crate::server::{Answer, Server, Setup, count, link};
use crate::store::{begin, new_batch, new_job, open_beside};
use crate::support::{case, pause, tick_forever};

pub fn lines(cases: &[Value]) -> String {
    let lines: Vec<String> = cases.iter().map(Value::to_string).collect();
    lines.join("\n")
}

/// Returns a case that is solved very quickly.
pub fn small(name: &str) -> Value {
    let mut case = case(name);
    case["solver"] = json!({ "method": "boundary_element", "mesh": { "strips": 2, "cells": 2 } });
    case["outputs"] = json!(["resultants"]);
    case
}

/// Returns the same case as `small` with this normal force.
pub fn small_loaded(name: &str, newtons: usize) -> Value {
    let mut case = small(name);
    case["load"]["normal_force_n"] = json!(newtons);
    case
}

/// Sends the body of a batch with this media type.
pub async fn send(
    server: &Server,
    query: &str,
    content: &str,
    body: impl Into<reqwest::Body>,
) -> Answer {
    server
        .post_as(&format!("/v1/batches{query}"), content, body)
        .await
}

/// Returns the lines of the results of a batch.
pub async fn results(server: &Server, batch: &Value, query: &str) -> Vec<Value> {
    let path = link(batch, "results");
    let answer = server.get(&format!("{path}{query}")).await.is(200);
    assert_eq!(answer.header("content-type"), Some("application/x-ndjson"));
    answer.lines()
}

#[tokio::test]
async fn results_come_in_input_order_with_one_line_per_case() {
    let mut setup = Setup::new();
    // Without the cache, the second format is solved as well.
    setup.options.cache = false;
    let server = setup.start().await;
    let cases: Vec<Value> = (0..150).map(|i| small(&format!("case {i}"))).collect();
    for (content, body) in [
        ("application/json", Value::from(cases.clone()).to_string()),
        ("application/x-ndjson", lines(&cases)),
    ] {
        let batch = send(&server, "", content, body).await.is(202);
        assert_eq!(batch.json["count"], 150);
        assert_eq!(
            batch.header("location"),
            batch.json["links"]["self"].as_str()
        );
        let lines = results(&server, &batch.json, "?wait=60").await;
        assert_eq!(lines.len(), 150);
        for (index, line) in lines.iter().enumerate() {
            assert_eq!(line["index"], index);
            assert_eq!(line["name"], format!("case {index}"));
            assert_eq!(line["state"], "succeeded", "{line}");
        }
        let path = link(&batch.json, "self");
        let now = server.read(path).await;
        assert_eq!(now["states"]["succeeded"], 150);
        assert_eq!(now["progress"], 1.0);
        assert_eq!(now["ended"], true);
        // A line has the same content as the resources of its job.
        let id = lines[77]["id"].as_str().expect("an id");
        let alone = server.read(&format!("/v1/jobs/{id}/result")).await;
        assert_eq!(lines[77]["result"], alone);
        let job = server.read(&format!("/v1/jobs/{id}")).await;
        assert_eq!(job["batch_id"], batch.json["id"]);
        assert_eq!(job["attempt"], 1);
    }
}

#[tokio::test]
async fn one_faulty_case_refuses_the_batch_and_names_its_line() {
    let server = Server::idle().await;
    let mut faulty = small("faulty");
    faulty["friction"]["coefficient"] = json!(-1);
    let body = format!("{}\n\n{faulty}\n{{\"a\":\n{}\n", small("1"), small("2"));
    let answer = send(&server, "", "application/x-ndjson", body.clone()).await;
    assert_problem(&answer, 422, "faulty-batch", "2 of 4 cases");
    let errors = answer.json["errors"].as_array().expect("errors");
    assert_eq!(errors[0]["pointer"], "/1/friction/coefficient");
    assert_eq!(errors[0]["code"], "out-of-range");
    assert_eq!(errors[0]["line"], 3);
    assert_eq!(errors[1]["line"], 4);
    assert_eq!(errors[1]["pointer"], "/2");
    let jobs = server.read("/v1/jobs").await;
    assert_eq!(jobs["jobs"], json!([]), "nothing was stored");

    let answer = send(&server, "?on_invalid=skip", "application/x-ndjson", body)
        .await
        .is(202);
    assert_eq!(answer.json["count"], 2);
    assert_eq!(answer.json["rejected"], 2);
    assert_eq!(
        answer.json["errors"].as_array().map(Vec::len),
        Some(errors.len())
    );
    let lines = results(&server, &answer.json, "").await;
    let places: Vec<_> = lines
        .iter()
        .map(|line| (&line["index"], &line["state"]))
        .collect();
    let queued = json!("queued");
    assert_eq!(places, [(&json!(0), &queued), (&json!(3), &queued)]);
}

#[tokio::test]
async fn bodies_that_are_no_batch_are_refused() {
    let server = Server::idle().await;
    for (content, body, status, kind) in [
        ("application/json", "[", 400, "malformed-json"),
        ("application/json", "[{\"a\":NaN}]", 400, "malformed-json"),
        ("application/json", "", 400, "malformed-json"),
        ("application/json", "{}", 422, "faulty-batch"),
        ("application/json", "[]", 422, "faulty-batch"),
        ("application/x-ndjson", "\n \n", 422, "faulty-batch"),
        ("text/plain", "a,b", 415, "unsupported-media-type"),
    ] {
        let answer = send(&server, "?on_invalid=skip", content, body).await;
        assert_problem(&answer, status, kind, "");
    }
    let answer = send(&server, "?on_invalid=some", "application/json", "[]").await;
    assert_problem(&answer, 400, "bad-query", "on_invalid");
}

#[tokio::test]
async fn a_batch_is_bounded_by_case_by_bytes_and_by_count() {
    let mut setup = Setup::idle();
    setup.http.body_max_bytes = 1000;
    setup.http.batch_max_bytes = 4000;
    setup.http.batch_max_cases = 3;
    setup.options.queue_max = 4;
    let server = setup.start().await;
    let three = lines(&vec![small("x"); 3]);
    assert!(three.len() < 2000);
    let ndjson = "application/x-ndjson";
    send(&server, "", ndjson, three.clone()).await.is(202);
    for (body, word) in [
        (lines(&vec![small("x"); 4]), "3 cases"),
        (small(&"n".repeat(900)).to_string(), "line 1 is larger"),
        ("\n".repeat(4001), "one batch"),
    ] {
        let answer = send(&server, "", ndjson, body).await;
        assert_problem(&answer, 413, "body-too-large", word);
    }
    let answer = send(&server, "", ndjson, three).await;
    assert_problem(&answer, 503, "queue-full", "nothing was stored");
    let jobs = server.read("/v1/jobs").await;
    assert_eq!(count(&jobs["jobs"]), 3);
}

#[tokio::test]
async fn results_as_csv_have_a_header_and_a_line_per_motion() {
    let server = Server::start().await;
    let mut sweep = small("two, motions");
    sweep["friction"]["coefficient"] = json!(1.5);
    let motion = sweep["motion"].clone();
    sweep["motion"] = json!([motion, motion]);
    let cases = json!([small("one"), sweep]);
    let batch = server.post("/v1/batches", &cases).await;
    let path = link(&batch.json, "results");
    let answer = server.get(&format!("{path}?wait=60&format=csv")).await;
    let rows: Vec<&str> = answer.text.lines().collect();
    assert_eq!(rows.len(), 4, "{}", answer.text);
    assert!(rows[0].starts_with("index,id,name,state,point,"));
    assert!(
        rows[3].contains("\"two, motions\",succeeded,1,0.001,"),
        "{}",
        rows[3]
    );
    let codes = |row: &str| row.rsplit(',').nth(1).unwrap_or_default().to_owned();
    assert_eq!(codes(rows[0]), "remarks");
    assert!(!codes(rows[1]).contains("friction-unusual"), "{}", rows[1]);
    for row in &rows[2..] {
        assert!(codes(row).contains("friction-unusual"), "{row}");
    }
    let by_accept = server.get_with(path, "accept", "text/csv").await;
    assert_eq!(by_accept.text, answer.text);
}

#[tokio::test]
async fn a_panic_in_a_group_fails_that_job_only() {
    let setup = Setup::new().solving(|checked, monitor| {
        assert!(checked.label.name.as_deref() != Some("bad"), "boom");
        solve(checked, monitor)
    });
    let server = setup.start().await;
    // If the cases were identical, only the first one would be solved.
    let cases = [("a", 50_000), ("bad", 50_001), ("c", 50_002)];
    let cases = cases.map(|(name, load)| small_loaded(name, load));
    let batch = send(&server, "", "application/x-ndjson", lines(&cases)).await;
    let lines = results(&server, &batch.json, "?wait=60").await;
    let states: Vec<_> = lines.iter().map(|line| line["state"].as_str()).collect();
    assert_eq!(
        states,
        [Some("succeeded"), Some("failed"), Some("succeeded")]
    );
    assert_eq!(lines[1]["error"]["type"], "/problems/solver-panic");
}

#[tokio::test]
async fn a_running_group_stops_when_its_batch_is_cancelled() {
    let server = Setup::new()
        .solving(|_, monitor| Err(tick_forever(monitor)))
        .start()
        .await;
    let cases = json!(vec![small("x"); 3]);
    let batch = server.post("/v1/batches", &cases).await;
    let path = link(&batch.json, "self");
    while server.read(path).await["states"]["running"] == 0 {
        pause().await;
    }
    let cancel = link(&batch.json, "cancel");
    server.send(Method::POST, cancel, |request| request).await;
    let lines = results(&server, &batch.json, "?wait=60").await;
    assert!(
        lines.iter().all(|line| line["state"] == "cancelled"),
        "{lines:?}"
    );
}

#[tokio::test]
async fn an_incomplete_batch_is_gone_after_a_restart() {
    let mut lab = Lab::idle(|_| {}).await;
    lab.jobs.shutdown(Duration::ZERO).await;
    let store = open_beside(lab.folder.path()).await;
    let new = NewBatch {
        idempotency: Some(("k".to_owned(), [1; 32])),
        ..new_batch("anonymous", 2)
    };
    let job = new_job();
    let id = job.id;
    begin(&*store, &new, [job]).await;
    store.close().await;
    lab.reopen(Duration::ZERO).await;
    assert!(lab.jobs.get(id).await.is_err());
    assert!(lab.jobs.of_kind(Kind::Cases).work(new.id).await.is_err());
}

#[tokio::test]
async fn a_group_is_handed_back_when_the_service_stops() {
    let mut lab = Lab::start(|_| {}).await;
    let mut ids = Vec::new();
    for case in [case("long"), small("long a"), small("long b")] {
        ids.push(lab.submit(case).await);
    }
    lab.reopen(Duration::from_millis(20)).await;
    for id in ids {
        let job = lab.get(id).await;
        assert_eq!((job.state.name(), job.attempt), ("queued", 0));
    }
}

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
