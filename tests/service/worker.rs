//! Do workers solve what is queued, and survive what they solve?

use std::sync::{Mutex, mpsc};
use std::time::Duration;

use railhead::contact::solve;
use railhead::jobs::model::SubmitOptions;
use railhead::jobs::{JobsError, Options, State};
use serde_json::json;
use tokio::sync::mpsc::unbounded_channel;

use crate::support::{case, files_below, open};

#[tokio::test]
async fn a_solved_job_keeps_its_answer_and_its_remarks() {
    // Once in the database, once in a folder.
    for small_result_max_bytes in [1 << 20, 0] {
        keeps_its_answer(small_result_max_bytes).await;
    }
}

async fn keeps_its_answer(small_result_max_bytes: usize) {
    let folder = tempfile::tempdir().unwrap();
    let (answer, answers) = mpsc::channel();
    let jobs = open(
        Options {
            small_result_max_bytes,
            ..Options::new(folder.path())
        },
        move |case, monitor| {
            let solved = solve(case, monitor)?;
            answer.send(solved.clone()).unwrap();
            Ok(solved)
        },
    )
    .await;
    let mut worker = jobs.worker("w").unwrap();
    assert!(!worker.step().await.unwrap().busy);

    let mut remarkable = case("one");
    remarkable["friction"]["coefficient"] = json!(1.5);
    let id = jobs.submit(remarkable.clone(), None).await.unwrap().id;
    assert!(matches!(
        jobs.solution(id).await,
        Err(JobsError::NotReady(State::Queued))
    ));
    assert_eq!(worker.step().await.unwrap().ended, [(id, State::Succeeded)]);

    let (solution, fields) = answers.recv().unwrap();
    assert!(!solution.remarks.is_empty());
    assert!(fields.patches[0].points[0].traction_x_mpa.is_some());
    let job = jobs.get(id).await.unwrap();
    assert_eq!((job.state, job.attempt), (State::Succeeded, 1));
    assert_eq!(job.remarks, solution.remarks);
    assert_eq!(jobs.solution(id).await.unwrap(), solution);
    assert_eq!(jobs.patch_fields(id, 0).await.unwrap(), fields.patches[0]);
    assert_eq!(
        jobs.point_fields(id, 0, 0).await.unwrap(),
        fields.patches[0]
    );
    assert!(matches!(
        jobs.patch_fields(id, 1).await,
        Err(JobsError::NoSuchPatch(1))
    ));
    assert!(matches!(
        jobs.point_fields(id, 0, 1).await,
        Err(JobsError::NoSuchPoint(1))
    ));
    let in_folder = !files_below(&folder.path().join("results")).is_empty();
    assert_eq!(in_folder, small_result_max_bytes == 0);
    let submitted =
        serde_json::from_slice::<serde_json::Value>(&jobs.case(id).await.unwrap()).unwrap();
    assert_eq!(submitted, remarkable);

    jobs.delete(id).await.unwrap();
    assert!(matches!(
        jobs.solution(id).await,
        Err(JobsError::NotFound(_))
    ));
    assert!(files_below(&folder.path().join("results")).is_empty());
}

#[tokio::test]
async fn a_ticking_solver_keeps_its_lease_and_shows_its_progress() {
    let folder = tempfile::tempdir().unwrap();
    let (finish, may_finish) = mpsc::channel::<()>();
    let may_finish = Mutex::new(may_finish);
    let options = Options {
        lease: Duration::from_millis(1_500),
        ..Options::new(folder.path())
    };
    let jobs = open(options, move |case, monitor| {
        let may_finish = may_finish.lock().unwrap();
        while may_finish.try_recv().is_err() {
            assert!(monitor.tick(0.5).is_continue());
            std::thread::sleep(Duration::from_millis(1));
        }
        solve(case, monitor)
    })
    .await;
    let id = jobs.submit(case("long"), None).await.unwrap().id;
    jobs.start().unwrap();
    // Two heartbeats reach the table: the version grows with the claim and with the first progress only.
    while jobs.get(id).await.unwrap().progress < 0.5 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    finish.send(()).unwrap();
    let job = jobs.wait(id, Duration::from_secs(60)).await.unwrap();
    assert_eq!((job.state, job.attempt), (State::Succeeded, 1));
    jobs.shutdown(Duration::from_secs(10)).await;
}

#[tokio::test]
async fn a_solver_that_hangs_loses_its_job_but_not_the_worker() {
    let folder = tempfile::tempdir().unwrap();
    let (release, released) = mpsc::channel::<()>();
    let released = Mutex::new(Some(released));
    let options = Options {
        lease: Duration::from_secs(2),
        ..Options::new(folder.path())
    };
    let jobs = open(options, move |case, monitor| {
        let first_time = released.lock().unwrap().take();
        if let Some(released) = first_time {
            // The first attempt hangs, without a tick, until the test is over.
            let _ = released.recv();
        }
        solve(case, monitor)
    })
    .await;
    let id = jobs.submit(case("hangs once"), None).await.unwrap().id;
    jobs.start().unwrap();
    let job = jobs.wait(id, Duration::from_secs(60)).await.unwrap();
    assert_eq!(job.state, State::Succeeded);
    // A slow machine may lose the lease once more.
    assert!(job.attempt >= 2, "{}", job.attempt);
    drop(release);
    jobs.shutdown(Duration::from_secs(10)).await;
}

#[tokio::test]
async fn a_solver_deaf_to_its_cancellation_is_left_behind() {
    // When its lease is over, and long before that.
    for lease in [Duration::from_millis(300), Duration::from_secs(600)] {
        assert_eq!(end_of_deaf(lease, None).await, State::Cancelled);
    }
}

#[tokio::test]
async fn a_solver_deaf_to_its_deadline_is_left_behind() {
    let deadline = Some(Duration::from_secs(1));
    let ended = end_of_deaf(Duration::from_secs(600), deadline).await;
    assert_eq!(ended, State::Failed);
}

/// How a job ends whose solver does not listen, at its deadline or else by cancellation; the next one is solved.
async fn end_of_deaf(lease: Duration, deadline: Option<Duration>) -> State {
    let folder = tempfile::tempdir().unwrap();
    let (started, mut has_started) = unbounded_channel();
    let (release, released) = mpsc::channel::<()>();
    let released = Mutex::new(Some(released));
    let options = Options {
        lease,
        ..Options::new(folder.path())
    };
    let jobs = open(options, move |case, monitor| {
        let first_time = released.lock().unwrap().take();
        if let Some(released) = first_time {
            started.send(()).unwrap();
            let _ = released.recv();
        }
        solve(case, monitor)
    })
    .await;
    let asked = SubmitOptions {
        ends_within: deadline,
        ..SubmitOptions::default()
    };
    let submitted = jobs.submit_with(case("deaf"), asked.into()).await;
    let deaf = submitted.unwrap().0.id;
    jobs.start().unwrap();
    has_started.recv().await.unwrap();
    if deadline.is_none() {
        jobs.cancel(deaf).await.unwrap();
    }
    let next = jobs.submit(case("next"), None).await.unwrap().id;
    let at_most = Duration::from_secs(60);
    let ended = jobs.wait(deaf, at_most).await.unwrap().state;
    assert_eq!(
        jobs.wait(next, at_most).await.unwrap().state,
        State::Succeeded
    );
    drop(release);
    jobs.shutdown(Duration::from_secs(10)).await;
    ended
}

#[tokio::test]
async fn a_pool_solves_everything_and_waiting_callers_hear_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let options = Options {
        workers: 3,
        ..Options::new(folder.path())
    };
    let jobs = open(options, solve).await;
    jobs.start().unwrap();
    let mut waiting = Vec::new();
    for number in 0..40 {
        let id = jobs
            .submit(case(&number.to_string()), None)
            .await
            .unwrap()
            .id;
        let jobs = jobs.clone();
        waiting.push(tokio::spawn(async move {
            jobs.wait(id, Duration::from_secs(60)).await.unwrap()
        }));
    }
    for job in waiting {
        let job = job.await.unwrap();
        assert_eq!((job.state, job.attempt), (State::Succeeded, 1));
    }
    jobs.shutdown(Duration::from_secs(10)).await;
}
