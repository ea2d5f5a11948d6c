//! Tests that the job table keeps the slices of a sweep until the sweep is complete.

use std::time::Duration;

use bytes::Bytes;
use railhead::jobs::State;
use railhead::jobs::codec::result::EncodedResult;
use railhead::jobs::store::{
    Claim, ClaimKind, ClaimRequest, NewSlice, Reap, ReleaseReason, SliceRecord, Store, StoredResult,
};
use uuid::Uuid;

use crate::store::*;

/// Claims a job with some slices solved.
async fn claim_begun(store: &dyn Store, now: i64) -> Option<Claim> {
    let queue = queue_of("anonymous");
    let request = ClaimRequest {
        kind: ClaimKind::Begun,
        ..request(&queue, 1, now)
    };
    store.claim(&request).await.unwrap().pop()
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

async fn a_stored_slice_is_fenced_and_stored_once_and_begins_the_count_of_attempts_anew(
    kind: StoreKind,
) {
    let table = Table::new(kind).await;
    let store = &*table.store;
    let id = table.add(new_job()).await.id;
    // Two attempts die while the job runs alone.
    for _ in 0..2 {
        claim_up_to(store, 0, 1000, 1).await;
        store.reap(Reap::Dead, 1, 5).await.unwrap();
    }
    let old = table.claim(2).await.unwrap();
    assert_eq!((old.attempt, old.slices), (3, 0));
    for _ in 0..2 {
        assert!(store.add_slice(&old, &slice(0, Some("a"))).await.unwrap());
    }
    assert!(store.add_slice(&old, &slice(1, None)).await.unwrap());
    let job = store.job("anonymous", id).await.unwrap().unwrap();
    assert_eq!((job.attempt, job.progress), (1, 0.5));
    let why = ReleaseReason::NotBegun;
    store
        .release(std::slice::from_ref(&old), why, 3)
        .await
        .unwrap();
    let job = store.job("anonymous", id).await.unwrap().unwrap();
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
    let notes = store.slices(id).await.unwrap();
    assert_eq!(notes, [slice(0, None).note, slice(1, None).note]);
    // Another solver begins again. Its slice replaces the slices from this number on.
    let mut other = slice(0, Some("b"));
    other.note.digest = "e".to_owned();
    assert!(store.add_slice(&claim, &other).await.unwrap());
    assert_eq!(store.slices(id).await.unwrap(), [other.note]);
    assert_eq!(store.released_blobs(&[], 9).await.unwrap(), ["a"]);
    assert_eq!(
        store
            .orphans(&[(Uuid::now_v7(), "a".into()), (Uuid::now_v7(), "b".into())])
            .await
            .unwrap(),
        ["a"]
    );
}

conformance! {
    a_stored_slice_is_fenced_and_stored_once_and_begins_the_count_of_attempts_anew,
}
