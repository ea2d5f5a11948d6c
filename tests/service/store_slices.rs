//! Does the job table keep the slices of a sweep for as long as the sweep is not whole?

use std::collections::HashSet;
use std::time::Duration;

use bytes::Bytes;
use railhead::jobs::codec::result::EncodedResult;
use railhead::jobs::store::sqlite::database::SqliteStore;
use railhead::jobs::store::types::Moment;
use railhead::jobs::store::types::SliceRecord;
use railhead::jobs::store::types::{
    Claim, ClaimKind, ClaimRequest, Ending, NewSlice, ReleaseReason, StoredResult,
};
use railhead::jobs::{Failure, State};

use crate::store::{Table, claim_up_to, new_job, success};

/// Claims a job of which some slices are solved.
async fn claim_begun(store: &SqliteStore, now: i64) -> Option<Claim> {
    let request = ClaimRequest {
        worker: "w",
        tenant: "anonymous",
        kind: ClaimKind::Begun,
        jobs: 1,
        cost_us: 1_000_000,
        each_slice_us: None,
        workers: 1,
        lease_until: now + 1000,
        now,
        late_before: now,
        skip: &HashSet::new(),
    };
    store.claim(&request).await.unwrap().pop()
}

/// The file, for what no store would do.
async fn other_writer(table: &Table) -> sqlx::SqlitePool {
    let file = table.folder.path().join("jobs.db");
    sqlx::SqlitePool::connect(&format!("sqlite:{}", file.display()))
        .await
        .unwrap()
}

fn slice(number: u32, key: Option<&str>) -> NewSlice {
    NewSlice {
        note: SliceRecord {
            number,
            motions: 2 * (number + 1),
            digest: "d".to_owned(),
            spent: Duration::from_secs(u64::from(number) + 1),
        },
        result: match key {
            Some(key) => StoredResult::Blob(key.to_owned(), 7),
            None => StoredResult::Inline(EncodedResult {
                solution: Bytes::from_static(b"{}"),
                fields: None,
            }),
        },
        done: f64::from(number + 1) / 4.0,
        rest_us: 1000,
    }
}

#[tokio::test]
async fn a_stored_slice_is_fenced_and_stored_once_and_begins_the_count_of_attempts_anew() {
    let table = Table::new().await;
    let store = &table.store;
    let id = table.add(new_job()).await.id;
    // Two attempts die alone.
    for _ in 0..2 {
        claim_up_to(store, 0, 1000, 1).await;
        store.reap_dead(1, 5).await.unwrap();
    }
    let old = table.claim(2).await.unwrap();
    assert_eq!((old.attempt, old.slices), (3, 0));
    for _ in 0..2 {
        assert!(store.add_slice(&old, &slice(0, Some("a"))).await.unwrap());
    }
    assert!(store.add_slice(&old, &slice(1, None)).await.unwrap());
    let job = store.get(id).await.unwrap().unwrap();
    assert_eq!((job.attempt, job.progress), (1, 0.5));
    let why = ReleaseReason::NotBegun;
    store
        .release(std::slice::from_ref(&old), why, 3)
        .await
        .unwrap();
    let job = store.get(id).await.unwrap().unwrap();
    assert_eq!(
        (job.state, job.attempt, job.progress),
        (State::Queued, 0, 0.5)
    );
    assert!(
        !store.add_slice(&old, &slice(2, None)).await.unwrap(),
        "it is not held"
    );
    let tenants = claim_up_to(store, 4, 1000, 1).await;
    assert!(tenants.is_empty(), "it is no new job");
    let claim = claim_begun(store, 4).await.unwrap();
    assert_eq!((claim.attempt, claim.slices), (1, 2));
    let notes = store.slice_notes(id).await.unwrap();
    assert_eq!(notes, [slice(0, None).note, slice(1, None).note]);
    // Another solver begins again: what was there from its number on is replaced.
    let mut other = slice(0, Some("b"));
    other.note.digest = "e".to_owned();
    assert!(store.add_slice(&claim, &other).await.unwrap());
    assert_eq!(store.slice_notes(id).await.unwrap(), [other.note]);
    assert_eq!(store.released_blobs(&[], 9).await.unwrap(), ["a"]);
    assert_eq!(
        store.known_blobs(&["a".into(), "b".into()]).await.unwrap(),
        ["b"]
    );
}

#[tokio::test]
async fn whatever_ends_a_job_releases_its_slices() {
    let lost = || Ending::Failed(Failure::worker_lost(1));
    for end in [
        "succeeded",
        "failed",
        "cancelled",
        "cancelled queued",
        "reaped",
        "late",
    ] {
        let table = Table::new().await;
        let store = &table.store;
        let id = table.add(new_job()).await.id;
        let claim = table.claim(0).await.unwrap();
        assert!(store.add_slice(&claim, &slice(0, Some("a"))).await.unwrap());
        assert!(store.add_slice(&claim, &slice(1, None)).await.unwrap());
        match end {
            "succeeded" => drop(table.finish(&claim, &success(), 1).await.unwrap()),
            "failed" => drop(table.finish(&claim, &lost(), 1).await.unwrap()),
            "cancelled" => drop(table.finish(&claim, &Ending::Cancelled, 1).await.unwrap()),
            "cancelled queued" => {
                store
                    .release(&[claim], ReleaseReason::NotBegun, 1)
                    .await
                    .unwrap();
                store.cancel(id, 2).await.unwrap();
            }
            "reaped" => drop(store.reap_dead(1, 1).await.unwrap()),
            _ => {
                store
                    .release(&[claim], ReleaseReason::NotBegun, 1)
                    .await
                    .unwrap();
                sqlx::query("UPDATE jobs SET deadline = 5")
                    .execute(&other_writer(&table).await)
                    .await
                    .unwrap();
                let moment = Moment {
                    now: 6,
                    set_at: 0,
                    unset: 6,
                };
                let late = store.fail_late(&Failure::worker_lost(1), moment).await;
                assert_eq!(late.unwrap(), [id]);
            }
        }
        assert!(store.get(id).await.unwrap().unwrap().state.ended(), "{end}");
        assert!(store.slice_notes(id).await.unwrap().is_empty(), "{end}");
        assert_eq!(store.released_blobs(&[], 9).await.unwrap(), ["a"], "{end}");
        let blobs: i64 = sqlx::query_scalar("SELECT COUNT(*) FROM blobs")
            .fetch_one(&other_writer(&table).await)
            .await
            .unwrap();
        assert_eq!(blobs, i64::from(end == "succeeded"), "{end}");
    }
}
