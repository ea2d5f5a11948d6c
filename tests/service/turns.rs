//! Are short jobs served beside long solves, and is the job found that has killed a process?

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use railhead::contact::solve;
use railhead::jobs::store::Reap;
use railhead::jobs::{Jobs, Options, State};
use serde_json::json;

use crate::batches::small;
use crate::store::{claim_up_to, open_beside};
use crate::support::{case, open};

const AT_MOST: Duration = Duration::from_secs(60);

/// A service with one worker and short slices, on which a case named `long` ticks until it is let go.
struct Shop {
    jobs: Jobs,
    let_go: Arc<AtomicBool>,
    /// Solvers at work at this moment, and the most there ever were.
    working: Arc<[AtomicUsize; 2]>,
    folder: tempfile::TempDir,
}

async fn shop(change: impl FnOnce(&mut Options)) -> Shop {
    let folder = tempfile::tempdir().unwrap();
    let let_go = Arc::new(AtomicBool::new(false));
    let working = Arc::new([AtomicUsize::new(0), AtomicUsize::new(0)]);
    let mut options = Options {
        slice: Duration::from_millis(20),
        ..Options::new(folder.path())
    };
    change(&mut options);
    let (go, count) = (let_go.clone(), working.clone());
    let jobs = open(options, move |case, monitor| {
        while case
            .label
            .name
            .as_deref()
            .is_some_and(|name| name.starts_with("long"))
        {
            if let std::ops::ControlFlow::Break(stop) = monitor.tick(0.5) {
                return Err(stop.into());
            }
            let now = count[0].fetch_add(1, Ordering::SeqCst) + 1;
            count[1].fetch_max(now, Ordering::SeqCst);
            std::thread::sleep(Duration::from_millis(1));
            count[0].fetch_sub(1, Ordering::SeqCst);
            if go.load(Ordering::SeqCst) {
                break;
            }
        }
        solve(case, monitor)
    })
    .await;
    Shop {
        jobs,
        let_go,
        working,
        folder,
    }
}

/// Waits until a job runs.
async fn until_running(jobs: &Jobs, id: uuid::Uuid) {
    while jobs.get(id).await.unwrap().state != State::Running {
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
}

#[tokio::test]
async fn short_jobs_are_served_beside_a_long_solve_which_goes_on() {
    let shop = shop(|_| {}).await;
    let jobs = &shop.jobs;
    jobs.start().unwrap();
    let long = jobs.submit(case("long"), None).await.unwrap().id;
    until_running(jobs, long).await;
    for round in 0..5 {
        let mut short = small("short");
        short["load"]["normal_force_n"] = json!(50_000 + round);
        let id = jobs.submit(short, None).await.unwrap().id;
        let job = jobs.wait(id, AT_MOST).await.unwrap();
        assert_eq!(job.state, State::Succeeded);
        assert_eq!(jobs.get(long).await.unwrap().state, State::Running);
    }
    let other = jobs.of("other".into());
    let theirs = other
        .submit(small("another tenant's"), None)
        .await
        .unwrap()
        .id;
    let job = other.wait(theirs, AT_MOST).await.unwrap();
    assert_eq!(job.state, State::Succeeded);
    shop.let_go.store(true, Ordering::SeqCst);
    let job = jobs.wait(long, AT_MOST).await.unwrap();
    assert_eq!(
        (job.state, job.attempt),
        (State::Succeeded, 1),
        "it was not begun again"
    );
    jobs.shutdown(Duration::from_secs(10)).await;
}

#[tokio::test]
async fn a_process_without_workers_solves_nothing() {
    let shop = shop(|options| options.workers = 0).await;
    let jobs = &shop.jobs;
    jobs.start().unwrap();
    let id = jobs.submit(small("short"), None).await.unwrap().id;
    let job = jobs.wait(id, Duration::from_millis(500)).await.unwrap();
    assert_eq!((job.state, job.attempt), (State::Queued, 0));
    jobs.shutdown(Duration::ZERO).await;
}

#[tokio::test]
async fn beside_a_long_solve_jobs_that_turn_out_to_be_long_go_back() {
    let shop = shop(|_| {}).await;
    let jobs = &shop.jobs;
    let mut ids = Vec::new();
    for number in 0..6 {
        ids.push(
            jobs.submit(case(&format!("long {number}")), None)
                .await
                .unwrap()
                .id,
        );
    }
    let last = jobs.submit(small("short"), None).await.unwrap().id;
    jobs.start().unwrap();
    let job = jobs.wait(last, AT_MOST).await.unwrap();
    assert_eq!(job.state, State::Succeeded);
    // One can be cancelled wherever it is.
    jobs.cancel(ids[1]).await.unwrap();
    let job = jobs.wait(ids[1], AT_MOST).await.unwrap();
    assert_eq!(job.state, State::Cancelled);
    shop.let_go.store(true, Ordering::SeqCst);
    for id in ids {
        let job = jobs.wait(id, AT_MOST).await.unwrap();
        if job.state != State::Cancelled {
            assert_eq!((job.state, job.attempt), (State::Succeeded, 1));
        }
    }
    let most = shop.working[1].load(Ordering::SeqCst);
    assert_eq!(most, 2, "one worker and the spare one");
    jobs.shutdown(Duration::from_secs(10)).await;
}

#[tokio::test]
async fn long_solves_are_handed_back_at_the_end() {
    let shop = shop(|options| options.workers = 2).await;
    let jobs = &shop.jobs;
    jobs.start().unwrap();
    let mut ids = Vec::new();
    for number in 0..2 {
        ids.push(
            jobs.submit(case(&format!("long {number}")), None)
                .await
                .unwrap()
                .id,
        );
    }
    for id in &ids {
        until_running(jobs, *id).await;
    }
    jobs.shutdown(Duration::from_millis(50)).await;
    let again = Jobs::open(Options::new(shop.folder.path())).await.unwrap();
    for id in ids {
        let job = again.get(id).await.unwrap();
        assert_eq!((job.state, job.attempt), (State::Queued, 0));
    }
}

#[tokio::test]
async fn suspects_are_solved_one_after_the_other_and_hold_nobody_up() {
    let shop = shop(|options| options.workers = 3).await;
    let jobs = &shop.jobs;
    let store = open_beside(shop.folder.path()).await;
    let mut ids = Vec::new();
    for number in 0..3 {
        ids.push(
            jobs.submit(case(&format!("long {number}")), None)
                .await
                .unwrap()
                .id,
        );
    }
    for _ in 0..3 {
        claim_up_to(&*store, 0, 1000, 1).await;
    }
    store.reap(Reap::Dead, 1, 5).await.unwrap();
    let beside = jobs.submit(small("beside them"), None).await.unwrap().id;
    jobs.start().unwrap();
    let job = jobs.wait(beside, AT_MOST).await.unwrap();
    assert_eq!(job.state, State::Succeeded);
    until_running(jobs, ids[0]).await;
    tokio::time::sleep(Duration::from_millis(200)).await;
    shop.let_go.store(true, Ordering::SeqCst);
    for id in ids {
        let job = jobs.wait(id, AT_MOST).await.unwrap();
        assert_eq!((job.state, job.attempt), (State::Succeeded, 1));
    }
    assert_eq!(shop.working[1].load(Ordering::SeqCst), 1);
    jobs.shutdown(Duration::from_secs(10)).await;
}

#[tokio::test]
async fn the_time_limit_of_the_operator_holds_for_every_case() {
    let shop = shop(|options| options.time_limit = Duration::from_millis(1)).await;
    let mut greedy = crate::support::endless_case("asks for more");
    greedy["solver"]["time_limit_s"] = serde_json::json!(3600);
    let mut ids = Vec::new();
    for case in [crate::support::endless_case("no limit of its own"), greedy] {
        ids.push(shop.jobs.submit(case, None).await.unwrap().id);
    }
    shop.jobs.start().unwrap();
    for id in ids {
        let job = shop.jobs.wait(id, AT_MOST).await.unwrap();
        assert_eq!(job.failure.unwrap().kind.name(), "out_of_time");
    }
    shop.jobs.shutdown(Duration::from_secs(10)).await;
}

#[tokio::test]
async fn a_clock_that_is_set_forward_makes_nothing_late_or_old() {
    let folder = tempfile::tempdir().unwrap();
    let set = Arc::new(std::sync::atomic::AtomicI64::new(0));
    let system = railhead::jobs::clock::Clock::system();
    let shown = set.clone();
    let clock = railhead::jobs::clock::Clock::that_is_set(move || {
        system.now_ms() + shown.load(Ordering::SeqCst)
    });
    let let_go = Arc::new(AtomicBool::new(false));
    let go = let_go.clone();
    let options = Options {
        clock,
        retention: Some(Duration::from_secs(30 * 24 * 3600)),
        lease: Duration::from_secs(2),
        ..Options::new(folder.path())
    };
    let jobs = open(options, move |case, monitor| {
        while case.label.name.as_deref() == Some("long") && !go.load(Ordering::SeqCst) {
            assert!(
                monitor.tick(0.5).is_continue(),
                "it is neither late nor lost"
            );
            std::thread::sleep(Duration::from_millis(1));
        }
        solve(case, monitor)
    })
    .await;
    jobs.start().unwrap();
    let old = jobs.submit(small("old"), None).await.unwrap().id;
    assert_eq!(
        jobs.wait(old, AT_MOST).await.unwrap().state,
        State::Succeeded
    );
    let options = railhead::jobs::model::SubmitOptions {
        ends_within: Some(Duration::from_secs(1800)),
        ..Default::default()
    };
    let long = jobs
        .submit_with(case("long"), options.into())
        .await
        .unwrap()
        .0
        .id;
    until_running(&jobs, long).await;
    set.store(40 * 24 * 3600 * 1000, Ordering::SeqCst);
    // Some looks of whoever watches deadlines, leases and ages.
    tokio::time::sleep(Duration::from_millis(2500)).await;
    jobs.sweep_expired().await.unwrap();
    assert_eq!(
        jobs.get(old).await.unwrap().state,
        State::Succeeded,
        "nothing is removed"
    );
    let job = jobs.get(long).await.unwrap();
    assert_eq!((job.state, job.attempt), (State::Running, 1));
    let_go.store(true, Ordering::SeqCst);
    assert_eq!(
        jobs.wait(long, AT_MOST).await.unwrap().state,
        State::Succeeded
    );
    jobs.shutdown(Duration::from_secs(10)).await;
}
