//! Tests nodes with wrong clocks, as real processes: leases and all reported times follow the clock of the database.

use std::time::Duration;

use jiff::Timestamp;
use serde_json::Value;

use crate::cluster::faketime::{library, set_ahead, with_clock};
use crate::cluster::{node_by, tables};
use crate::support::{Service, case, endless_case, railhead};

/// The duration of a lease, in seconds.
const LEASE: u64 = 2;

/// Tolerance for reported times, in ms. A node does not correct its clock while it is wrong by less than 250 ms.
const TOLD_WITHIN_MS: i64 = 1000;

/// Returns the offset of its clock that a node measured last, in ms. It is positive if the clock is ahead.
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
    let (url, library) = (or_skip!(tables().await), or_skip!(library()));
    let clocks = tempfile::tempdir().unwrap();
    let begun = Timestamp::now();
    // Starts a node whose clock is ahead by this many seconds.
    let start = |role: &str, ahead: i32| {
        let file = clocks.path().join(ahead.to_string());
        set_ahead(&file, ahead);
        let mut program = railhead();
        with_clock(&mut program, &library, &file);
        node_by(program, &url, role, &["--lease-s", &LEASE.to_string()])
    };
    let [right, behind] = [0, -10].map(|ahead| start("serve", ahead));
    let [fast, slow] = [40, -40].map(|ahead| start("worker", ahead));
    for (node, ahead) in [(&behind, -10_000), (&fast, 40_000), (&slow, -40_000)] {
        let found = found_ahead(node);
        assert!((found - ahead).abs() < TOLD_WITHIN_MS, "{found} ms");
    }

    // Each worker holds a job for longer than a lease, and the deadline does not pass early.
    let mut held = Vec::new();
    for api in [&right, &behind] {
        let case = endless_case("held");
        let job = api.post("/v1/jobs?deadline_s=35", &case).await.is(202).json;
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
