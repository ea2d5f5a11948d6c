//! Tests that workers solve queued jobs and survive failures of the solver.

use std::sync::mpsc;
use std::time::Duration;

use railhead::contact::solve;
use railhead::jobs::engine::Engine;
use railhead::jobs::model::SubmitOptions;
use railhead::jobs::{JobsError, Options, State};
use serde_json::json;

use crate::lab::{Gate, Lab};
use crate::support::{case, files_below, pause};

#[tokio::test]
async fn a_solved_job_keeps_its_answer_and_its_remarks() {
    // The result is stored once in the database and once in a folder.
    for small_result_max_bytes in [1 << 20, 0] {
        keeps_its_answer(small_result_max_bytes).await;
    }
}

async fn keeps_its_answer(small_result_max_bytes: usize) {
    let (answer, answers) = mpsc::channel();
    let engine = Engine::contact().solving(move |case, monitor| {
        let solved = solve(case, monitor)?;
        answer.send(solved.clone()).unwrap();
        Ok(solved)
    });
    let change = |options: &mut Options| options.small_result_max_bytes = small_result_max_bytes;
    let lab = Lab::of(Gate::default(), engine, change).await;
    let (jobs, folder) = (&lab.jobs, &lab.folder);
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
    assert_eq!(
        jobs.patch_fields(id, 0, None).await.unwrap(),
        fields.patches[0]
    );
    assert_eq!(
        jobs.patch_fields(id, 0, Some(0)).await.unwrap(),
        fields.patches[0]
    );
    assert!(matches!(
        jobs.patch_fields(id, 1, None).await,
        Err(JobsError::NoSuchPatch(1))
    ));
    assert!(matches!(
        jobs.patch_fields(id, 0, Some(1)).await,
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
    let lab = Lab::start(|options| options.lease = Duration::from_millis(1_500)).await;
    let id = lab.submit(case("long")).await;
    // The version increases only with the claim and with the first progress. Two heartbeats reach the table.
    while lab.get(id).await.progress < 0.5 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    lab.gate.set_open(true);
    lab.succeeds_at_once(id).await;
    lab.end().await;
}

#[tokio::test]
async fn a_solver_that_hangs_loses_its_job_but_not_the_worker() {
    let lab = Lab::start(|options| options.lease = Duration::from_secs(2)).await;
    let id = lab.submit(case("deaf at the first attempt")).await;
    let job = lab.wait(id).await;
    assert_eq!(job.state, State::Succeeded);
    // A slow machine may lose the lease once more.
    assert!(job.attempt >= 2, "{}", job.attempt);
    lab.end().await;
}

#[tokio::test]
async fn a_solver_deaf_to_its_cancellation_or_deadline_is_left_behind() {
    let [short, long] = [Duration::from_millis(300), Duration::from_secs(600)];
    // The solver is abandoned when its lease ends, and also with a lease that is much longer.
    for (lease, deadline, ended) in [
        (short, None, State::Cancelled),
        (long, None, State::Cancelled),
        (long, Some(Duration::from_secs(1)), State::Failed),
    ] {
        assert_eq!(end_of_deaf(lease, deadline).await, ended);
    }
}

/// Returns the final state of a job whose solver ignores its deadline or cancellation. Asserts that the next job is solved.
async fn end_of_deaf(lease: Duration, deadline: Option<Duration>) -> State {
    let lab = Lab::start(|options| options.lease = lease).await;
    let asked = SubmitOptions {
        ends_within: deadline,
        ..SubmitOptions::default()
    };
    let submitted = lab.jobs.submit_with(case("deaf"), asked.into()).await;
    let deaf = submitted.unwrap().0.id;
    while lab.gate.begun() == 0 {
        pause().await;
    }
    if deadline.is_none() {
        lab.jobs.cancel(deaf).await.unwrap();
    }
    let next = lab.submit(case("next")).await;
    let ended = lab.wait(deaf).await.state;
    assert_eq!(lab.wait(next).await.state, State::Succeeded);
    lab.end().await;
    ended
}
