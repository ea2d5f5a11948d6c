//! Tests that no job is lost or solved twice while the table or the results cannot be written for longer than a lease.

use std::time::Duration;

use railhead::jobs::State;
use uuid::Uuid;

use crate::lab::{AT_MOST, Lab};
use crate::support::case;

const LEASE: Duration = Duration::from_millis(400);

/// Starts a service that stores results outside the table, and a job that is being solved.
async fn solving() -> (Lab, Uuid) {
    let lab = Lab::start(|options| {
        options.lease = LEASE;
        options.small_result_max_bytes = 0;
    })
    .await;
    let id = lab.begin(case("long")).await;
    (lab, id)
}

fn table(lab: &Lab) -> rusqlite::Connection {
    rusqlite::Connection::open(lab.folder.path().join("jobs.db")).unwrap()
}

async fn assert_solved_once(lab: Lab, id: Uuid) {
    lab.succeeds_at_once(id).await;
    assert_eq!(lab.gate.begun(), 1, "it was solved once");
    lab.jobs.solution(id).await.unwrap();
    lab.end().await;
}

#[tokio::test]
async fn results_that_cannot_be_stored_for_longer_than_a_lease_are_kept_under_it() {
    let (lab, id) = solving().await;
    // A file in place of the folder makes it impossible to store results.
    let results = lab.folder.path().join("results");
    assert!(!results.exists());
    std::fs::write(&results, b"no folder").unwrap();
    lab.gate.set_open(true);
    let table = table(&lab);
    let mut leases = Vec::new();
    for _ in 0..5 {
        tokio::time::sleep(LEASE).await;
        let lease = table.query_row("SELECT lease_until FROM jobs", (), |row| row.get(0));
        let lease: Option<i64> = lease.unwrap();
        leases.push(lease.expect("it is still held"));
    }
    assert!(leases.is_sorted() && leases[0] < leases[4], "{leases:?}");
    std::fs::remove_file(&results).unwrap();
    assert_solved_once(lab, id).await;
}

#[tokio::test]
async fn a_table_that_is_locked_for_longer_than_a_lease_gives_no_job_away() {
    // The table is locked while the job is solved, and while its end is to be written.
    for solved_meanwhile in [false, true] {
        let (lab, id) = solving().await;
        let other = table(&lab);
        other.execute_batch("BEGIN IMMEDIATE").unwrap();
        lab.gate.set_open(solved_meanwhile);
        tokio::time::sleep(4 * LEASE).await;
        other.execute_batch("ROLLBACK").unwrap();
        // Leaves time for several checks for expired leases.
        tokio::time::sleep(2 * LEASE).await;
        lab.gate.set_open(true);
        assert_solved_once(lab, id).await;
    }
}

#[tokio::test]
async fn more_deaf_solvers_than_allowed_break_the_service_and_no_fewer() {
    let lab = Lab::start(|options| {
        options.abandoned_max = 1;
        options.lease = LEASE;
    })
    .await;
    for name in ["deaf", "deaf as well"] {
        assert!(!lab.jobs.broken().is_cancelled());
        // The second job begins after the thread of the first was abandoned.
        let id = lab.begin(case(name)).await;
        assert!(!lab.jobs.broken().is_cancelled());
        lab.jobs.cancel(id).await.unwrap();
        assert_eq!(lab.wait(id).await.state, State::Cancelled);
    }
    let broken = tokio::time::timeout(AT_MOST, lab.jobs.broken().cancelled());
    broken.await.expect("two are more than one");
    lab.end().await;
}
