//! Tests that short jobs are served during long solves, and that a job that kills its process is found.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::Duration;

use railhead::jobs::clock::Clock;
use railhead::jobs::model::SubmitOptions;
use railhead::jobs::store::Reap;
use railhead::jobs::{Options, State};
use serde_json::json;
use uuid::Uuid;

use crate::batches::{small, small_loaded};
use crate::lab::{AT_MOST, Lab};
use crate::store::{claim_up_to, open_beside};
use crate::support::{case, endless_case};

/// Opens a service with short slices. It has one worker unless `change` sets another number.
async fn lab(change: impl FnOnce(&mut Options)) -> Lab {
    let short = |options: &mut Options| {
        options.slice = Duration::from_millis(20);
        change(options);
    };
    Lab::idle(short).await
}

/// Submits this many long cases.
async fn submit_long(lab: &Lab, count: usize) -> Vec<Uuid> {
    let mut ids = Vec::new();
    for number in 0..count {
        ids.push(lab.submit(case(&format!("long {number}"))).await);
    }
    ids
}

async fn until_running(lab: &Lab, id: Uuid) {
    while lab.get(id).await.state != State::Running {
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
}

#[tokio::test]
async fn short_jobs_are_served_beside_a_long_solve_which_goes_on() {
    let lab = lab(|_| {}).await;
    lab.jobs.start().unwrap();
    let long = lab.begin(case("long")).await;
    for round in 0..5 {
        let id = lab.submit(small_loaded("short", 50_000 + round)).await;
        assert_eq!(lab.wait(id).await.state, State::Succeeded);
        assert_eq!(lab.get(long).await.state, State::Running);
    }
    let other = lab.jobs.of("other".into());
    let theirs = other.submit(small("another tenant's"), None).await;
    let job = other.wait(theirs.unwrap().id, AT_MOST).await.unwrap();
    assert_eq!(job.state, State::Succeeded);
    lab.gate.set_open(true);
    // It was not started again.
    lab.succeeds_at_once(long).await;
    lab.end().await;
}

#[tokio::test]
async fn a_process_without_workers_solves_nothing() {
    let lab = Lab::start(|options| options.workers = 0).await;
    let id = lab.submit(small("short")).await;
    let job = lab.jobs.wait(id, Duration::from_millis(500)).await.unwrap();
    assert_eq!((job.state, job.attempt), (State::Queued, 0));
    lab.end().await;
}

#[tokio::test]
async fn beside_a_long_solve_jobs_that_turn_out_to_be_long_go_back() {
    let lab = lab(|_| {}).await;
    let mut ids = submit_long(&lab, 6).await;
    let last = lab.submit(small("short")).await;
    lab.jobs.start().unwrap();
    assert_eq!(lab.wait(last).await.state, State::Succeeded);
    // A long job can be cancelled whether it is queued or running.
    let cancelled = ids.remove(1);
    lab.jobs.cancel(cancelled).await.unwrap();
    assert_eq!(lab.wait(cancelled).await.state, State::Cancelled);
    lab.gate.set_open(true);
    for id in ids {
        lab.succeeds_at_once(id).await;
    }
    assert_eq!(lab.gate.most(), 2, "one worker and the spare one");
    lab.end().await;
}

#[tokio::test]
async fn suspects_are_solved_one_after_the_other_and_hold_nobody_up() {
    let lab = lab(|options| options.workers = 3).await;
    let store = open_beside(lab.folder.path()).await;
    let ids = submit_long(&lab, 3).await;
    for _ in 0..3 {
        claim_up_to(&*store, 0, 1000, 1).await;
    }
    store.reap(Reap::Dead, 1, 5).await.unwrap();
    let beside = lab.submit(small("beside them")).await;
    lab.jobs.start().unwrap();
    assert_eq!(lab.wait(beside).await.state, State::Succeeded);
    until_running(&lab, ids[0]).await;
    tokio::time::sleep(Duration::from_millis(200)).await;
    lab.gate.set_open(true);
    for id in ids {
        lab.succeeds_at_once(id).await;
    }
    assert_eq!(lab.gate.most(), 1);
    lab.end().await;
}

#[tokio::test]
async fn the_time_limit_of_the_operator_holds_for_every_case() {
    let lab = Lab::start(|options| options.time_limit = Duration::from_millis(1)).await;
    let mut greedy = endless_case("asks for more");
    greedy["solver"]["time_limit_s"] = json!(3600);
    for case in [endless_case("no limit of its own"), greedy] {
        let id = lab.submit(case).await;
        let failure = lab.wait(id).await.failure.unwrap();
        assert_eq!(failure.kind.name(), "out_of_time");
    }
    lab.end().await;
}

#[tokio::test]
async fn a_clock_that_is_set_forward_makes_nothing_late_or_old() {
    let (set, system) = (Arc::new(AtomicI64::new(0)), Clock::system());
    let shown = set.clone();
    let lab = Lab::start(|options| {
        options.clock = Clock::that_is_set(move || system.now_ms() + shown.load(Ordering::SeqCst));
        options.retention = Some(Duration::from_secs(30 * 24 * 3600));
        options.lease = Duration::from_secs(2);
    })
    .await;
    let old = lab.submit(small("old")).await;
    assert_eq!(lab.wait(old).await.state, State::Succeeded);
    let options = SubmitOptions {
        ends_within: Some(Duration::from_secs(1800)),
        ..Default::default()
    };
    let long = lab.jobs.submit_with(case("long"), options.into()).await;
    let long = long.unwrap().0.id;
    until_running(&lab, long).await;
    set.store(40 * 24 * 3600 * 1000, Ordering::SeqCst);
    // Leaves time for several checks of deadlines, leases and ages.
    tokio::time::sleep(Duration::from_millis(2500)).await;
    lab.jobs.sweep_expired().await.unwrap();
    let kept = lab.get(old).await.state;
    assert_eq!(kept, State::Succeeded, "nothing is removed");
    let job = lab.get(long).await;
    assert_eq!((job.state, job.attempt), (State::Running, 1));
    lab.gate.set_open(true);
    // Its solver received neither the deadline nor the loss of its job.
    lab.succeeds_at_once(long).await;
    lab.end().await;
}
