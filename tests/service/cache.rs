//! Tests that only an identical case is answered with an earlier result.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use railhead::contact;
use railhead::contact::monitor::Stop;
use railhead::jobs::Options;
use reqwest::Method;
use serde_json::{Value, json};

use crate::metrics::samples;
use crate::results::path_of;
use crate::server::{Answer, Server, Setup};
use crate::support::{Service, case, files_below, loaded};

/// Starts a service that counts its solves.
async fn counting(change: impl FnOnce(&mut Options)) -> (Server, Arc<AtomicUsize>) {
    let solves = Arc::new(AtomicUsize::new(0));
    let counter = solves.clone();
    let mut setup = Setup::new().solving(move |problem, monitor| {
        counter.fetch_add(1, Ordering::SeqCst);
        contact::solve(problem, monitor)
    });
    change(&mut setup.options);
    (setup.start().await, solves)
}

fn renamed(name: &str) -> Value {
    let mut case = case(name);
    case["labels"] = json!({ "km": name });
    case
}

/// Returns the result of a job without the members that differ between jobs.
fn bare(result: &Value) -> Value {
    let mut result = result.clone();
    let members = result.as_object_mut().expect("a result");
    members.remove("links");
    members.remove("cached");
    result
}

async fn solve_fresh(server: &Server, case: &Value) -> Answer {
    let control = "max-age=0, No-Cache";
    server
        .post_with("/v1/jobs?wait=60", "cache-control", control, case)
        .await
}

#[tokio::test]
async fn an_identical_case_is_answered_at_once_with_the_first_result() {
    let (server, solves) = counting(|_| {}).await;
    let first = server.solve(&renamed("first")).await;
    assert_eq!(first["cached"], false);
    assert_eq!(first["result"]["cached"], false);
    // The request does not wait, but the job has already ended when it is accepted.
    let answer = server.post("/v1/jobs", &renamed("second")).await.is(202);
    assert_eq!(answer.json["state"], "succeeded");
    let second = server.read(&path_of(&answer.json)).await;
    assert_eq!(second["cached"], true);
    assert_eq!(second["name"], "second");
    assert_eq!(second["labels"]["km"], "second");
    assert_eq!(second["attempt"], 0);
    assert_eq!(second["progress"], 1.0);
    assert_eq!(second["remarks"], first["remarks"]);
    let result = server.read(&format!("{}/result", path_of(&second))).await;
    assert_eq!(result["cached"], true);
    // The solver times are those of the only solve.
    assert_eq!(bare(&result), bare(&first["result"]));
    for part in ["tractions", "zones", "resultants"] {
        let of = async |job: &Value| server.read(&format!("{}/{part}", path_of(job))).await;
        assert_eq!(of(&second).await, of(&first).await, "{part}");
    }
    assert_eq!(solves.load(Ordering::SeqCst), 1);
    let figures = samples(&server).await;
    assert_eq!(figures["railhead_cache_hits_total"], 1.0);
    assert_eq!(figures["railhead_cache_misses_total"], 1.0);
    assert_eq!(
        figures[r#"railhead_jobs_ended_total{state="succeeded"}"#],
        2.0
    );
}

#[tokio::test]
async fn what_changes_the_answer_or_refuses_the_cache_is_solved() {
    let (server, solves) = counting(|_| {}).await;
    server.solve(&case("first")).await;
    let mut other_outputs = case("first");
    other_outputs["outputs"] = json!(["resultants"]);
    let mut other_load = case("first");
    other_load["load"]["normal_force_n"] = json!(100_001);
    for (number, different) in [other_outputs, other_load].iter().enumerate() {
        assert_eq!(server.solve(different).await["cached"], false);
        assert_eq!(solves.load(Ordering::SeqCst), 2 + number);
    }
    let fresh = solve_fresh(&server, &case("first")).await.is(200);
    assert_eq!(fresh.json["cached"], false);
    assert_eq!(solves.load(Ordering::SeqCst), 4);

    let (server, solves) = counting(|options| options.cache = false).await;
    for _ in 0..2 {
        assert_eq!(server.solve(&case("one")).await["cached"], false);
    }
    assert_eq!(solves.load(Ordering::SeqCst), 2);
}

#[tokio::test]
async fn a_batch_is_answered_from_earlier_results() {
    let (server, solves) = counting(|_| {}).await;
    let cases: Vec<Value> = (1..=30).map(|number| loaded(10_000 * number)).collect();
    let first = submit(&server, &cases[..20], false).await;
    let solved = lines(&server, &first).await;
    assert_eq!(solves.load(Ordering::SeqCst), 20);
    let second = submit(&server, &cases, false).await;
    let known = server.read(&second).await;
    assert!(known["states"]["succeeded"].as_u64() >= Some(20), "{known}");
    let again = lines(&server, &second).await;
    assert_eq!(solves.load(Ordering::SeqCst), 30);
    for (index, line) in again.iter().enumerate() {
        assert_eq!(line["state"], "succeeded");
        assert_eq!(line["result"]["cached"], index < 20);
    }
    for (old, new) in solved.iter().zip(&again) {
        assert_eq!(bare(&new["result"]), bare(&old["result"]));
    }
    let fresh = submit(&server, &cases, true).await;
    lines(&server, &fresh).await;
    assert_eq!(solves.load(Ordering::SeqCst), 60);
}

/// Sends a batch and returns its path.
async fn submit(server: &Server, cases: &[Value], fresh: bool) -> String {
    let (cases, control) = (json!(cases), if fresh { "no-cache" } else { "max-age=60" });
    let sent = server.post_with("/v1/batches", "cache-control", control, &cases);
    sent.await.is(202).location()
}

/// Returns the result lines of a batch once all jobs have ended.
async fn lines(server: &Server, batch: &str) -> Vec<Value> {
    let results = format!("{batch}/results?wait=60");
    server.get(&results).await.lines()
}

#[tokio::test]
async fn of_identical_cases_in_one_batch_one_is_solved() {
    let (server, solves) = counting(|_| {}).await;
    let cases: Vec<Value> = (0..600)
        .map(|number| {
            let mut case = renamed(&format!("number {number}"));
            case["load"]["normal_force_n"] = json!(50_000 + number % 2);
            case
        })
        .collect();
    let batch = submit(&server, &cases, false).await;
    let lines = lines(&server, &batch).await;
    assert_eq!(solves.load(Ordering::SeqCst), 2);
    for (index, line) in lines.iter().enumerate() {
        assert_eq!(line["state"], "succeeded", "{line}");
        assert_eq!(line["result"]["cached"], index >= 2);
        assert_eq!(
            bare(&line["result"])["total"],
            bare(&lines[index % 2]["result"])["total"]
        );
    }
    let fresh = submit(&server, &cases[..10], true).await;
    server.get(&format!("{fresh}?wait=60")).await.is(200);
    assert_eq!(solves.load(Ordering::SeqCst), 12, "no-cache is kept to");
}

#[tokio::test]
async fn identical_cases_that_fail_all_say_why() {
    let solves = Arc::new(AtomicUsize::new(0));
    let counter = solves.clone();
    let server = Setup::new()
        .solving(move |_, _| {
            counter.fetch_add(1, Ordering::SeqCst);
            Err(Stop::OutOfTime.into())
        })
        .start()
        .await;
    let batch = submit(&server, &vec![case("hopeless"); 100], false).await;
    let lines = lines(&server, &batch).await;
    for line in &lines {
        assert_eq!(
            line["error"]["type"], "/problems/out-of-time",
            "a failure is not used again: {line}"
        );
    }
    assert_eq!((lines.len(), solves.load(Ordering::SeqCst)), (100, 100));
    let later = server.solve(&case("hopeless")).await;
    assert_eq!(
        (&later["state"], &later["cached"]),
        (&json!("failed"), &json!(false))
    );
}

#[tokio::test]
async fn earlier_results_outlive_the_process_and_the_deletion_of_their_job() {
    let folder = tempfile::tempdir().unwrap();
    // The mesh is so fine that the fields do not fit into the table.
    let mut large = case("large");
    large["solver"]["mesh"] = json!({ "strips": 40, "cells": 40 });
    let solve = async |service: &Service| -> Value {
        service.post("/v1/jobs?wait=60", &large).await.is(200).json
    };
    let service = Service::start(folder.path(), &[]);
    let first = solve(&service).await;
    service.kill();
    let service = Service::start(folder.path(), &[]);
    let second = solve(&service).await;
    assert_eq!(first["cached"], false);
    assert_eq!(second["cached"], true);
    assert!(
        !files_below(&folder.path().join("results")).is_empty(),
        "it is a large one"
    );
    let path = format!("/v1/jobs/{}", first["id"].as_str().unwrap());
    let gone = service.request(Method::DELETE, &path).send().await.unwrap();
    assert_eq!(gone.status(), 204);
    service.kill();
    // The cleanup at the start keeps data that another job refers to.
    let service = Service::start(folder.path(), &[]);
    let path = format!("/v1/jobs/{}", second["id"].as_str().unwrap());
    for _ in 0..20 {
        service.get(&format!("{path}/tractions")).await;
        crate::support::pause().await;
    }
    let result = service.get(&format!("{path}/result")).await;
    assert_eq!(bare(&result), bare(&first["result"]));
}
