//! Tests that ended jobs are kept for their retention time and then removed with all their data.

use std::time::Duration;

use bytes::Bytes;
use railhead::jobs::clock::Clock;
use railhead::jobs::store::{NewJob, QueueBounds};
use railhead::jobs::{Jobs, JobsError, Options};
use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::results::path_of;
use crate::server::{Server, Setup};
use crate::store::{claim_up_to, finish_one, new_job, open_beside, success};
use crate::support::{DAY_MS, Turned, case, endless_case, files_below, loaded, pause};

/// Returns the setup of a service that keeps ended jobs for 30 days, and its clock.
fn keeping_30_days() -> (Setup, Turned) {
    let mut setup = Setup::new();
    let turned = Turned::default();
    setup.options.retention = Some(Duration::from_secs(30 * 24 * 3600));
    setup.options.clock = turned.clock();
    (setup, turned)
}

fn epoch_ms(time: &Value) -> i64 {
    let time: jiff::Timestamp = time.as_str().expect("a time").parse().unwrap();
    time.as_millisecond()
}

async fn assert_expired(server: &Server, path: &str) {
    let ways = ["", "/result", "/case", "/tractions", "/resultants"];
    let ways: &[&str] = if path.contains("batches") {
        &["", "/results"]
    } else {
        &ways
    };
    for part in ways {
        let answer = server.get(&format!("{path}{part}")).await;
        assert_problem(&answer, 410, "expired", "");
    }
}

#[tokio::test]
async fn an_ended_job_says_when_it_will_go_and_goes_then() {
    for small_result_max_bytes in [32 << 10, 0] {
        let (mut setup, turned) = keeping_30_days();
        setup.options.small_result_max_bytes = small_result_max_bytes;
        let results = setup.options.data_dir.join("results");
        let server = setup.start().await;
        let job = server.solve(&case("kept for 30 days")).await;
        assert_eq!(
            epoch_ms(&job["expires_at"]) - epoch_ms(&job["ended_at"]),
            30 * DAY_MS
        );
        let path = path_of(&job);
        turned.turn(29);
        server.jobs.sweep_expired().await.unwrap();
        assert_eq!(server.get(&format!("{path}/result")).await.status, 200);

        turned.turn(1);
        // The job is expired even before a sweep removes it.
        assert_expired(&server, &path).await;
        assert_eq!(server.read("/v1/jobs").await["jobs"], json!([]));
        server.jobs.sweep_expired().await.unwrap();
        assert_expired(&server, &path).await;
        assert!(files_below(&results).is_empty());
        let id = path.rsplit('/').next().unwrap().parse().unwrap();
        let foreign = server.jobs.of("another".into()).get(id).await;
        assert!(
            matches!(foreign, Err(JobsError::NotFound(_))),
            "{foreign:?}"
        );

        // The id is remembered for another 30 days.
        turned.turn(29);
        server.jobs.sweep_expired().await.unwrap();
        assert_expired(&server, &path).await;
        turned.turn(2);
        server.jobs.sweep_expired().await.unwrap();
        assert_problem(&server.get(&path).await, 404, "job-not-found", "");
    }
}

#[tokio::test]
async fn a_running_service_removes_what_has_expired_by_itself() {
    let (mut setup, _) = keeping_30_days();
    setup.options.clock = Clock::system();
    setup.options.retention = Some(Duration::from_millis(50));
    setup.options.small_result_max_bytes = 0;
    let results = setup.options.data_dir.join("results");
    let server = setup.start().await;
    let path = server.submit(&case("short-lived")).await;
    while server.get(&path).await.status != 410 || !files_below(&results).is_empty() {
        pause().await;
    }
}

#[tokio::test]
async fn jobs_that_have_not_ended_and_services_without_retention_lose_nothing() {
    let (setup, turned) = keeping_30_days();
    let server = setup.start().await;
    let running = server.submit(&endless_case("runs")).await;
    server.until(&running, "running").await;
    let queued = server.submit(&endless_case("waits")).await;
    turned.turn(400);
    assert_eq!(server.jobs.sweep_expired().await.unwrap(), 0);
    for path in [&running, &queued] {
        let job = server.get(path).await;
        assert_eq!((job.status, &job.json["expires_at"]), (200, &Value::Null));
        server.cancel(path).await;
    }

    let (mut setup, turned) = keeping_30_days();
    setup.options.retention = None;
    let server = setup.start().await;
    let job = server.solve(&case("kept for ever")).await;
    assert_eq!(job["expires_at"], Value::Null);
    turned.turn(40_000);
    assert_eq!(server.jobs.sweep_expired().await.unwrap(), 0);
    let result = format!("{}/result", path_of(&job));
    assert_eq!(server.get(&result).await.status, 200);
}

#[tokio::test]
async fn a_batch_goes_with_the_last_of_its_jobs() {
    let (mut setup, turned) = keeping_30_days();
    setup.working = false;
    let server = setup.start().await;
    let cases: Vec<Value> = (10_001..=10_600).map(loaded).collect();
    let answer = server.post("/v1/batches", &json!(cases)).await;
    let batch = answer.location();
    server.cancel(&batch).await.is(200);
    turned.turn(31);
    assert_eq!(server.jobs.sweep_expired().await.unwrap(), 600);
    assert_expired(&server, &batch).await;
}

#[tokio::test]
async fn the_database_shrinks_when_its_jobs_go() {
    const JOBS: usize = 128;
    const CASE_BYTES: usize = 400 << 10;
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("jobs.db");
    let store = open_beside(folder.path()).await;
    for _ in 0..JOBS {
        let body = Bytes::from(vec![b' '; CASE_BYTES]);
        let new = NewJob { body, ..new_job() };
        store.enqueue(&new, QueueBounds::NONE).await.unwrap();
        let claim = claim_up_to(&*store, 0, 1000, 1).await.pop().unwrap();
        let now = Clock::system().now_ms();
        finish_one(&*store, &claim, &success(), now).await.unwrap();
    }
    store.close().await;
    let size = || std::fs::metadata(&file).unwrap().len();
    let full = size();
    assert!(full > (JOBS * CASE_BYTES) as u64, "{full}");

    let turned = Turned::default();
    turned.turn(31);
    let options = Options {
        retention: Some(Duration::from_secs(30 * 24 * 3600)),
        clock: turned.clock(),
        ..Options::new(folder.path())
    };
    let jobs = Jobs::open(options).await.unwrap();
    assert_eq!(jobs.sweep_expired().await.unwrap(), JOBS as u64);
    jobs.shutdown(Duration::ZERO).await;
    // The file keeps some space in reserve for later jobs.
    assert!(size() < full / 2, "{} of {full}", size());
}
