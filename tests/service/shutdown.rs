//! What becomes of running jobs when the service stops or dies?

use std::ops::ControlFlow;
use std::time::Duration;

use railhead::contact::solve;
use railhead::jobs::{FailureKind, Jobs, JobsError, Options, State};
use reqwest::Method;
use tokio::sync::mpsc::unbounded_channel;

use crate::store::claim_up_to;
use crate::store::open_beside;
use crate::support::{Service, case, endless_case, jobs_with, long_case, open, pause};

#[tokio::test]
async fn a_running_job_goes_back_to_the_queue_uncounted() {
    let folder = tempfile::tempdir().unwrap();
    let (started, mut has_started) = unbounded_channel();
    let jobs = jobs_with(folder.path(), move |_, monitor| {
        started.send(()).unwrap();
        loop {
            if let ControlFlow::Break(stop) = monitor.tick(0.1) {
                return Err(stop.into());
            }
        }
    })
    .await;
    jobs.start().unwrap();
    let id = jobs.submit(case("long"), None).await.unwrap().id;
    has_started.recv().await.unwrap();
    jobs.shutdown(Duration::ZERO).await;

    let jobs = jobs_with(folder.path(), solve).await;
    let job = jobs.get(id).await.unwrap();
    assert_eq!(job.failure, None);
    assert_eq!(
        (job.state, job.attempt, job.started_at),
        (State::Queued, 0, None)
    );
    jobs.start().unwrap();
    let job = jobs.wait(id, Duration::from_secs(60)).await.unwrap();
    assert_eq!((job.state, job.attempt), (State::Succeeded, 1));
    jobs.shutdown(Duration::from_secs(10)).await;
}

#[tokio::test]
async fn a_job_that_ends_within_the_grace_period_is_not_run_again() {
    let folder = tempfile::tempdir().unwrap();
    let (started, mut has_started) = unbounded_channel();
    let (finish, may_finish) = std::sync::mpsc::channel::<()>();
    let may_finish = std::sync::Mutex::new(may_finish);
    // Taken one by one, so that the second is still queued whenever it comes.
    let options = Options {
        group_max: 1,
        ..Options::new(folder.path())
    };
    let jobs = open(options, move |case, monitor| {
        started.send(()).unwrap();
        may_finish.lock().unwrap().recv().unwrap();
        solve(case, monitor)
    })
    .await;
    jobs.start().unwrap();
    let first = jobs.submit(case("nearly done"), None).await.unwrap().id;
    let second = jobs.submit(case("still queued"), None).await.unwrap().id;
    has_started.recv().await.unwrap();
    jobs.drain();
    assert!(matches!(jobs.ready().await, Err(JobsError::Draining)));
    finish.send(()).unwrap();
    jobs.shutdown(Duration::from_secs(60)).await;

    let jobs = jobs_with(folder.path(), solve).await;
    assert_eq!(jobs.get(first).await.unwrap().state, State::Succeeded);
    assert_eq!(jobs.get(second).await.unwrap().state, State::Queued);
}

#[tokio::test]
async fn draining_ends_all_waiting() {
    let folder = tempfile::tempdir().unwrap();
    let jobs = jobs_with(folder.path(), solve).await;
    jobs.ready().await.unwrap();
    let id = jobs.submit(case("never claimed"), None).await.unwrap().id;
    let waiting = tokio::spawn({
        let jobs = jobs.clone();
        async move { jobs.wait(id, Duration::from_secs(3600)).await.unwrap() }
    });
    jobs.drain();
    assert_eq!(waiting.await.unwrap().state, State::Queued);
}

#[tokio::test]
async fn a_job_that_kills_every_process_fails_in_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let options = Options {
        attempts_max: 3,
        ..Options::new(folder.path())
    };
    let reopen = async || Jobs::open(options.clone()).await.unwrap();
    let jobs = reopen().await;
    let id = jobs.submit(case("poison"), None).await.unwrap().id;
    jobs.shutdown(Duration::ZERO).await;
    for attempt in 1..=3 {
        // A process that claims the job and dies: nothing after the claim reaches the table.
        let store = open_beside(folder.path()).await;
        assert_eq!(
            claim_up_to(&*store, 0, i64::MAX / 2, 1)
                .await
                .pop()
                .unwrap()
                .attempt,
            attempt
        );
        store.close().await;

        let jobs = reopen().await;
        let job = jobs.get(id).await.unwrap();
        assert_eq!(
            job.state,
            if attempt < 3 {
                State::Queued
            } else {
                State::Failed
            }
        );
        if let Some(failure) = job.failure {
            assert_eq!((failure.kind, attempt), (FailureKind::WorkerLost, 3));
        }
        jobs.shutdown(Duration::ZERO).await;
    }
}

#[tokio::test]
async fn a_data_folder_serves_one_process_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let jobs = jobs_with(folder.path(), solve).await;
    let second = Jobs::open(Options::new(folder.path())).await;
    assert!(
        matches!(second, Err(JobsError::DataDirInUse(_))),
        "{second:?}"
    );
    jobs.shutdown(Duration::ZERO).await;
    Jobs::open(Options::new(folder.path())).await.unwrap();
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
    while service.get("/v1/jobs").await["jobs"]
        .as_array()
        .unwrap()
        .len()
        < 2
    {
        pause().await;
    }
    service.signal("TERM");
    // Whoever waits is answered instead of being cut off or holding up the end.
    assert_eq!(waiting.await.unwrap().unwrap().status(), 202);
    assert_eq!(service.wait().code(), Some(0));

    let service = Service::start(folder.path(), &flags);
    let job = service.until(&id, "running").await;
    assert_eq!(job["attempt"], 1, "the first attempt does not count");
    assert_eq!(service.logged("job of a dead process taken back"), 0);
    service.cancel(&id).await;
    service.until(&id, "cancelled").await;
}

#[tokio::test]
async fn a_second_signal_ends_the_service_at_once() {
    let (_folder, service) = Service::fresh(&["--shutdown-grace-s", "3600"]);
    let id = service.submit(&endless_case("long")).await;
    service.until(&id, "running").await;
    service.signal("INT");
    while service.logged("stopping") == 0 {
        pause().await;
    }
    service.signal("INT");
    assert_eq!(service.wait().code(), Some(130));
}

#[tokio::test]
async fn a_second_signal_ends_a_service_that_waits_for_its_load_balancer() {
    let (_folder, service) = Service::fresh(&["--drain-delay-s", "3600"]);
    service.signal("TERM");
    while service.logged("stopping") == 0 {
        pause().await;
    }
    service.signal("TERM");
    assert_eq!(service.wait().code(), Some(130));
}

#[tokio::test]
async fn a_service_says_that_it_is_not_ready_before_its_port_closes() {
    let (_folder, service) = Service::fresh(&["--drain-delay-s", "2"]);
    // Each look is a connection of its own, as that of a load balancer may be.
    let look = async || {
        let url = format!("http://{}/readyz", service.address());
        let client = reqwest::Client::builder().pool_max_idle_per_host(0);
        let answer = client.build().unwrap().get(url).send().await;
        answer.map(|answer| answer.status().as_u16())
    };
    assert_eq!(look().await.unwrap(), 200);
    service.signal("TERM");
    while service.logged("stopping") == 0 {
        pause().await;
    }
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
    // Another process holds the only place for writers, so the running job cannot be handed back.
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
