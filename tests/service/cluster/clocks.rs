//! Nodes whose clocks are wrong, as real processes: is a lease judged by the clock of the database alone, and are all times told by it?

use std::time::Duration;

use jiff::Timestamp;
use railhead::jobs::store::postgres::schema::migrate;
use reqwest::Method;
use serde_json::Value;
use tempfile::TempDir;

use crate::cluster::faketime::{library, set_ahead, with_clock};
use crate::cluster::postgres::database;
use crate::support::{Service, case, endless_case, railhead};

/// The lease, in seconds.
const LEASE: u64 = 2;

/// Times are told in milliseconds, by a clock that is left alone while it is off by less than a quarter of a second.
const TOLD_WITHIN_MS: i64 = 1000;

/// A node whose clock is ahead by so many seconds.
fn start(url: &str, role: &str, ahead: i32, folder: &TempDir) -> Option<Service> {
    let file = folder.path().join("clock");
    set_ahead(&file, ahead);
    let mut program = railhead();
    with_clock(&mut program, &library()?, &file);
    let workers = if role == "worker" { "1" } else { "0" };
    let lease = LEASE.to_string();
    let flags = ["--database-url", url, "--workers", workers];
    let flags = [&flags[..], &["--lease-s", &lease, "--cache", "false"]].concat();
    let data = folder.path().join("data");
    Some(Service::start_as(&mut program, role, &data, &flags))
}

/// By how much a node found its clock ahead, in ms.
fn found_ahead(service: &Service) -> i64 {
    let log = service.log_text();
    let events = log
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap());
    let mut offsets = events.filter_map(|event| event["offset_ms"].as_i64());
    -offsets
        .next_back()
        .expect("the node says that its clock is off")
}

fn told(job: &Value, member: &str) -> Timestamp {
    let text = job[member].as_str();
    let text = text.unwrap_or_else(|| panic!("no {member} in {job}"));
    text.parse().unwrap()
}

fn assert_within(job: &Value, member: &str, from: Timestamp, to: Timestamp) {
    let told = told(job, member).as_millisecond();
    let (from, to) = (from.as_millisecond(), to.as_millisecond());
    assert!(
        (from - TOLD_WITHIN_MS..=to + TOLD_WITHIN_MS).contains(&told),
        "{member} is not between {from} and {to}: {job}"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn clocks_that_are_off_by_40_seconds_cost_no_lease_and_shift_no_time() {
    let (Some(url), Some(_)) = (database().await, library()) else {
        return;
    };
    migrate(&url).await.unwrap();
    let folders: [TempDir; 4] = std::array::from_fn(|_| tempfile::tempdir().unwrap());
    let nodes = [
        ("serve", 0),
        ("serve", -10),
        ("worker", 40),
        ("worker", -40),
    ];
    let begun = Timestamp::now();
    let start = |number: usize| {
        let (role, ahead) = nodes[number];
        start(&url, role, ahead, &folders[number]).expect("the library is there")
    };
    let [right, behind, fast, slow] = std::array::from_fn(start);
    for (node, ahead) in [(&behind, -10_000), (&fast, 40_000), (&slow, -40_000)] {
        let found = found_ahead(node);
        assert!((found - ahead).abs() < TOLD_WITHIN_MS, "{found} ms");
    }

    // Each worker holds a job for longer than a lease, and its deadline does not come early.
    let mut held = Vec::new();
    for api in [&right, &behind] {
        let posted = api.request(Method::POST, "/v1/jobs?deadline_s=35");
        let job = posted.json(&endless_case("held")).send().await.unwrap();
        assert_eq!(job.status(), 202);
        let job: Value = job.json().await.unwrap();
        held.push(job["id"].as_str().unwrap().to_owned());
    }
    for id in &held {
        right.until(id, "running").await;
    }
    tokio::time::sleep(Duration::from_secs(LEASE) * 3 / 2).await;
    for id in &held {
        let job = right.get(&format!("/v1/jobs/{id}")).await;
        assert_eq!(
            (&job["state"], &job["attempt"]),
            (&"running".into(), &1.into())
        );
        behind.cancel(id).await;
        right.until(id, "cancelled").await;
    }
    for number in 0..8 {
        let api = [&right, &behind][number % 2];
        let id = api.submit(&case(&format!("case {number}"))).await;
        held.push(id);
    }
    for (number, id) in held.iter().enumerate() {
        let ended = if number < 2 { "cancelled" } else { "succeeded" };
        let job = right.until(id, ended).await;
        assert_eq!(job["attempt"], 1, "{job}");
        for member in ["created_at", "started_at", "ended_at"] {
            assert_within(&job, member, begun, Timestamp::now());
        }
    }
}
