//! What becomes of running jobs when the service stops or dies?

use std::ops::ControlFlow;
use std::time::Duration;

use railhead::contact::monitor::Monitor;
use railhead::contact::problem::Problem;
use railhead::jobs::store::sqlite::SqliteStore;
use railhead::jobs::{FailureKind, Jobs, JobsError, Options, State};
use tokio::sync::mpsc::unbounded_channel;

use crate::support::{answer_at_once, case, jobs_with};

#[tokio::test]
async fn a_running_job_goes_back_to_the_queue_uncounted() {
    let folder = tempfile::tempdir().unwrap();
    let (started, mut has_started) = unbounded_channel();
    let jobs = jobs_with(folder.path(), move |_: &Problem, monitor: &dyn Monitor| {
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

    let jobs = jobs_with(folder.path(), answer_at_once).await;
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
    let jobs = jobs_with(
        folder.path(),
        move |problem: &Problem, monitor: &dyn Monitor| {
            started.send(()).unwrap();
            may_finish.lock().unwrap().recv().unwrap();
            answer_at_once(problem, monitor)
        },
    )
    .await;
    jobs.start().unwrap();
    let first = jobs.submit(case("nearly done"), None).await.unwrap().id;
    let second = jobs.submit(case("still queued"), None).await.unwrap().id;
    has_started.recv().await.unwrap();
    jobs.drain();
    assert!(matches!(jobs.ready().await, Err(JobsError::Draining)));
    finish.send(()).unwrap();
    jobs.shutdown(Duration::from_secs(60)).await;

    let jobs = jobs_with(folder.path(), answer_at_once).await;
    assert_eq!(jobs.get(first).await.unwrap().state, State::Succeeded);
    assert_eq!(jobs.get(second).await.unwrap().state, State::Queued);
}

#[tokio::test]
async fn draining_ends_all_waiting() {
    let folder = tempfile::tempdir().unwrap();
    let jobs = jobs_with(folder.path(), answer_at_once).await;
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
    let reopen = async || {
        Jobs::open_with(
            options.clone(),
            railhead::jobs::recipe::Recipe {
                check: std::sync::Arc::new(crate::standin::check),
                solve: std::sync::Arc::new(answer_at_once),
            },
        )
        .await
        .unwrap()
    };
    let jobs = reopen().await;
    let id = jobs.submit(case("poison"), None).await.unwrap().id;
    jobs.shutdown(Duration::ZERO).await;
    for attempt in 1..=3 {
        // A process that claims the job and dies: nothing after the claim reaches the table.
        let store = SqliteStore::open(&folder.path().join("jobs.db"))
            .await
            .unwrap();
        assert_eq!(
            store
                .claim("doomed", 0, i64::MAX / 2)
                .await
                .unwrap()
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
    let jobs = jobs_with(folder.path(), answer_at_once).await;
    let second = Jobs::open(Options::new(folder.path())).await;
    assert!(
        matches!(second, Err(JobsError::DataDirInUse(_))),
        "{second:?}"
    );
    jobs.shutdown(Duration::ZERO).await;
    Jobs::open(Options::new(folder.path())).await.unwrap();
}
