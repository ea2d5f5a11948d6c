//! Does nobody lose a job, or solve it twice, while the table or the results cannot be written for longer than a lease?

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};
use std::time::Duration;

use railhead::contact::solve;
use railhead::jobs::{Jobs, Options, State};
use uuid::Uuid;

use crate::support::{case, open};

const AT_MOST: Duration = Duration::from_secs(60);
const LEASE: Duration = Duration::from_millis(600);

/// A service on which every case ticks until it is let go.
struct Shop {
    jobs: Jobs,
    let_go: Arc<AtomicBool>,
    begun: Arc<AtomicUsize>,
    folder: tempfile::TempDir,
}

impl Shop {
    async fn open() -> Shop {
        let folder = tempfile::tempdir().unwrap();
        let (let_go, begun) = (Arc::new(AtomicBool::new(false)), Arc::default());
        let options = Options {
            lease: LEASE,
            small_result_max_bytes: 0,
            ..Options::new(folder.path())
        };
        let (go, count): (_, Arc<AtomicUsize>) = (let_go.clone(), Arc::clone(&begun));
        let jobs = open(options, move |case, monitor| {
            count.fetch_add(1, Ordering::SeqCst);
            while !go.load(Ordering::SeqCst) {
                if let std::ops::ControlFlow::Break(stop) = monitor.tick(0.5) {
                    return Err(stop.into());
                }
                std::thread::sleep(Duration::from_millis(1));
            }
            solve(case, monitor)
        })
        .await;
        jobs.start().unwrap();
        Shop {
            jobs,
            let_go,
            begun,
            folder,
        }
    }

    /// Submits a case and waits until it is being solved.
    async fn running(&self) -> Uuid {
        let id = self.jobs.submit(case("one"), None).await.unwrap().id;
        while self.begun.load(Ordering::SeqCst) == 0 {
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
        id
    }

    fn table(&self) -> rusqlite::Connection {
        rusqlite::Connection::open(self.folder.path().join("jobs.db")).unwrap()
    }

    async fn succeeds_at_once(&self, id: Uuid) {
        let job = self.jobs.wait(id, AT_MOST).await.unwrap();
        assert_eq!((job.state, job.attempt), (State::Succeeded, 1));
        assert_eq!(self.begun.load(Ordering::SeqCst), 1, "it was solved once");
        self.jobs.solution(id).await.unwrap();
        self.jobs.shutdown(Duration::from_secs(10)).await;
    }
}

#[tokio::test]
async fn results_that_cannot_be_stored_for_longer_than_a_lease_are_kept_under_it() {
    let shop = Shop::open().await;
    let id = shop.running().await;
    // The place of the results is not there.
    let results = shop.folder.path().join("results");
    let away = shop.folder.path().join("away");
    let had: PathBuf = match results.exists() {
        true => std::fs::rename(&results, &away).map(|()| away).unwrap(),
        false => away,
    };
    std::fs::write(&results, b"no folder").unwrap();
    shop.let_go.store(true, Ordering::SeqCst);
    let table = shop.table();
    let mut leases = Vec::new();
    for _ in 0..5 {
        tokio::time::sleep(LEASE).await;
        let lease = table.query_row("SELECT lease_until FROM jobs", (), |row| row.get(0));
        let lease: Option<i64> = lease.unwrap();
        leases.push(lease.expect("it is still held"));
    }
    assert!(leases.is_sorted() && leases[0] < leases[4], "{leases:?}");
    std::fs::remove_file(&results).unwrap();
    if had.exists() {
        std::fs::rename(&had, &results).unwrap();
    }
    shop.succeeds_at_once(id).await;
}

#[tokio::test]
async fn a_table_that_is_locked_for_longer_than_a_lease_gives_no_job_away() {
    // While it is being solved, and while its end is to be written.
    for solved_meanwhile in [false, true] {
        let shop = Shop::open().await;
        let id = shop.running().await;
        let other = shop.table();
        other.execute_batch("BEGIN IMMEDIATE").unwrap();
        shop.let_go.store(solved_meanwhile, Ordering::SeqCst);
        tokio::time::sleep(4 * LEASE).await;
        other.execute_batch("ROLLBACK").unwrap();
        // Some looks of whoever takes jobs from silent workers.
        tokio::time::sleep(2 * LEASE).await;
        shop.let_go.store(true, Ordering::SeqCst);
        shop.succeeds_at_once(id).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn more_deaf_solvers_than_allowed_break_the_service_and_no_fewer() {
    let folder = tempfile::tempdir().unwrap();
    let options = Options {
        abandoned_max: 1,
        lease: LEASE,
        ..Options::new(folder.path())
    };
    let (release, released) = mpsc::channel::<()>();
    let released = std::sync::Mutex::new(released);
    let (begun, began) = mpsc::channel();
    let jobs = open(options, move |case, monitor| {
        if case.label.name.as_deref() == Some("deaf") {
            begun.send(()).unwrap();
            // Until the test is over.
            let _ = released.lock().unwrap().recv();
        }
        solve(case, monitor)
    })
    .await;
    jobs.start().unwrap();
    for _ in 0..2 {
        assert!(!jobs.broken().is_cancelled());
        let id = jobs.submit(case("deaf"), None).await.unwrap().id;
        // The second is begun once the thread of the first was left behind.
        tokio::task::block_in_place(|| began.recv()).unwrap();
        assert!(!jobs.broken().is_cancelled());
        jobs.cancel(id).await.unwrap();
        let job = jobs.wait(id, AT_MOST).await.unwrap();
        assert_eq!(job.state, State::Cancelled);
    }
    let broken = tokio::time::timeout(AT_MOST, jobs.broken().cancelled());
    broken.await.expect("two are more than one");
    drop(release);
    jobs.shutdown(Duration::from_secs(10)).await;
}
