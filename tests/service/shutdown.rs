//! Tests running jobs when the service stops or is killed.

use std::time::Duration;

use railhead::jobs::{FailureKind, Jobs, JobsError, State};
use reqwest::Method;

use crate::lab::Lab;
use crate::server::count;
use crate::store::{claim_up_to, open_beside};
use crate::support::{Service, case, endless_case, long_case, pause};

#[tokio::test]
async fn a_job_that_ends_within_the_grace_period_is_not_run_again() {
    // Jobs are claimed one by one, so that the second one is still queued.
    let mut lab = Lab::start(|options| options.group_max = 1).await;
    let first = lab.begin(case("deaf to the end")).await;
    let second = lab.submit(case("still queued")).await;
    lab.jobs.drain();
    assert!(matches!(lab.jobs.ready().await, Err(JobsError::Draining)));
    lab.gate.set_open(true);
    lab.reopen(Duration::from_secs(60)).await;
    assert_eq!(lab.get(first).await.state, State::Succeeded);
    assert_eq!(lab.get(second).await.state, State::Queued);
}

#[tokio::test]
async fn draining_ends_all_waiting() {
    let lab = Lab::idle(|_| {}).await;
    lab.jobs.ready().await.unwrap();
    let id = lab.submit(case("never claimed")).await;
    let jobs = lab.jobs.clone();
    let waiting = tokio::spawn(async move { jobs.wait(id, Duration::from_secs(3600)).await });
    lab.jobs.drain();
    assert_eq!(waiting.await.unwrap().unwrap().state, State::Queued);
}

#[tokio::test]
async fn a_job_that_kills_every_process_fails_in_the_end() {
    let mut lab = Lab::idle(|options| options.attempts_max = 3).await;
    let id = lab.submit(case("poison")).await;
    for attempt in 1..=3 {
        // Simulates a process that claims the job and dies: nothing after the claim reaches the table.
        lab.jobs.shutdown(Duration::ZERO).await;
        let store = open_beside(lab.folder.path()).await;
        let claims = claim_up_to(&*store, 0, i64::MAX / 2, 1).await;
        assert_eq!(claims[0].attempt, attempt);
        store.close().await;

        lab.reopen(Duration::ZERO).await;
        let job = lab.get(id).await;
        let state = if attempt < 3 {
            State::Queued
        } else {
            State::Failed
        };
        assert_eq!(job.state, state);
        if let Some(failure) = job.failure {
            assert_eq!((failure.kind, attempt), (FailureKind::WorkerLost, 3));
        }
    }
}

#[tokio::test]
async fn a_data_folder_serves_one_process_at_a_time() {
    let lab = Lab::idle(|_| {}).await;
    let second = Jobs::open(lab.options.clone()).await;
    assert!(
        matches!(second, Err(JobsError::DataDirInUse(_))),
        "{second:?}"
    );
    lab.jobs.shutdown(Duration::ZERO).await;
    Jobs::open(lab.options).await.unwrap();
}

#[tokio::test]
async fn a_stopped_service_hands_its_running_job_to_the_next_one() {
    let folder = tempfile::tempdir().unwrap();
    let flags = ["--shutdown-grace-s", "0", "--workers", "1"];
    let service = Service::start(folder.path(), &flags);
    let id = service.submit(&endless_case("long")).await;
    service.until(&id, "running").await;
    let waiting = service
        .request(Method::POST, "/v1/jobs")
        .header("Prefer", "wait=60");
    let waiting = tokio::spawn(waiting.json(&long_case("behind", 2)).send());
    while count(&service.get("/v1/jobs").await["jobs"]) < 2 {
        pause().await;
    }
    service.signal("TERM");
    // A waiting request is answered and does not delay the shutdown.
    assert_eq!(waiting.await.unwrap().unwrap().status(), 202);
    assert_eq!(service.wait().code(), Some(0));

    let service = Service::start(folder.path(), &flags);
    let job = service.until(&id, "running").await;
    assert_eq!(job["attempt"], 1, "the first attempt does not count");
    assert_eq!(
        service.logged("job of a dead process returned to the queue"),
        0
    );
    service.cancel(&id).await;
    service.until(&id, "cancelled").await;
}

#[tokio::test]
async fn a_second_signal_ends_a_service_at_once_that_solves_or_waits_for_its_load_balancer() {
    for (flag, signal) in [("--shutdown-grace-s", "INT"), ("--drain-delay-s", "TERM")] {
        let (_folder, service) = Service::fresh(&[flag, "3600"]);
        let id = service.submit(&endless_case("long")).await;
        service.until(&id, "running").await;
        service.signal(signal);
        service.until_logged("stopping", 1).await;
        service.signal(signal);
        assert_eq!(service.wait().code(), Some(130));
    }
}

#[tokio::test]
async fn a_service_says_that_it_is_not_ready_before_its_port_closes() {
    let (_folder, service) = Service::fresh(&["--drain-delay-s", "2"]);
    // Each check uses a new connection, as a load balancer may do.
    let look = async || {
        let url = format!("http://{}/readyz", service.address());
        let client = reqwest::Client::builder().pool_max_idle_per_host(0);
        let answer = client.build().unwrap().get(url).send().await;
        answer.map(|answer| answer.status().as_u16())
    };
    assert_eq!(look().await.unwrap(), 200);
    service.signal("TERM");
    service.until_logged("stopping", 1).await;
    let mut refusals = 0;
    while let Ok(status) = look().await {
        assert!(
            status == 503 || (status == 200 && refusals == 0),
            "{status}"
        );
        refusals += u32::from(status == 503);
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    assert!(refusals >= 5, "503 was seen {refusals} times in 2 s");
    assert_eq!(service.wait().code(), Some(0));
}

#[tokio::test]
async fn a_service_whose_table_hangs_is_gone_within_five_seconds_after_the_grace_period() {
    let folder = tempfile::tempdir().unwrap();
    let flags = ["--shutdown-grace-s", "0", "--drain-delay-s", "0"];
    let service = Service::start(folder.path(), &flags);
    let id = service.submit(&endless_case("long")).await;
    service.until(&id, "running").await;
    // Another process holds the write lock of the table, so that the running job cannot be released.
    let table = folder.path().join("jobs.db");
    let other = rusqlite::Connection::open(table).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    let start = std::time::Instant::now();
    service.signal("TERM");
    let status = tokio::task::spawn_blocking(|| service.wait())
        .await
        .unwrap();
    let took = start.elapsed();
    assert!(took < Duration::from_secs(60), "{took:?}");
    assert_eq!(status.code(), Some(0));
}
