//! Tests single jobs, claims and leases of a store.

use bytes::Bytes;
use railhead::jobs::State;
use railhead::jobs::store::{Filter, Lease, NewJob, ReleaseReason};
use uuid::Uuid;

use crate::store::*;

async fn a_job_comes_back_as_it_was_queued(kind: StoreKind) {
    let table = Table::new(kind).await;
    let new = NewJob {
        body: Bytes::from_static("{\"name\":\"Weiche ½\"}".as_bytes()),
        ..labelled("line", "A12")
    };
    let job = table.add(new.clone()).await;
    assert_eq!(table.job(new.id).await, Some(job.clone()));
    assert_eq!(job.state, State::Queued);
    assert_eq!((job.name, job.labels), (new.name, new.labels));
    assert_eq!(
        (job.created_at, job.started_at, job.ended_at),
        (new.created_at, None, None)
    );
    assert_eq!((job.attempt, job.failure), (0, None));
    assert_eq!(table.case(new.id).await, Some((new.body, false)));
    assert_eq!(table.job(Uuid::now_v7()).await, None);
    assert_eq!(table.case(Uuid::now_v7()).await, None);
    table.claim(5).await.unwrap();
    assert_eq!(table.job(new.id).await.unwrap().started_at, Some(5));
    table.cancel(new.id, 6).await.unwrap();
    let (_, cancelled) = table.case(new.id).await.unwrap();
    assert!(cancelled, "whoever takes it up hears of it");
}

async fn only_an_ended_job_can_be_deleted_and_all_that_hung_on_it_goes(kind: StoreKind) {
    let table = Table::new(kind).await;
    let new = NewJob {
        idempotency: Some(("k".to_owned(), [1; 32])),
        ..labelled("line", "A12")
    };
    let id = table.add(new).await.id;
    assert!(!table.delete(id).await);
    let claim = table.claim(0).await.unwrap();
    assert!(!table.delete(id).await);
    assert!(table.finish(&claim, &success(), 1).await.is_some());
    // The end is written again because its answer was lost. The worker considers the job lost and leaves the result to be removed.
    assert_eq!(table.finish(&claim, &success(), 2).await, None);
    table.store.abandon_blob("results/1").await.unwrap();
    assert!(table.released_blobs(&[], 9).await.is_empty());
    assert!(table.delete(id).await);
    assert!(!table.delete(id).await);

    assert_eq!(table.case(id).await, None);
    assert_eq!(table.job_by_key("k", &[1; 32]).await, None);
    let filter = Filter {
        labels: vec![("line".to_owned(), "A12".to_owned())],
        ..Filter::default()
    };
    assert_eq!(table.list(&filter, None, 10).await.entries, []);
    let released = table.released_blobs(&[], 10).await;
    assert_eq!(released, ["results/1"], "its result is left to be removed");
    let released = table.released_blobs(&released, 10).await;
    assert!(released.is_empty(), "what was removed is forgotten");
}

async fn of_no_jobs_nothing_is_asked(kind: StoreKind) {
    let table = Table::new(kind).await;
    let store = &*table.store;
    table.add(new_job()).await;
    let claim = table.claim(0).await.unwrap();
    assert!(store.claimed_cases(&[]).await.unwrap().is_empty());
    let lease = Lease { now: 0, ms: LEASE };
    assert!(store.renew(&[], lease).await.unwrap().is_empty());
    assert!(store.finish(&[], 1).await.unwrap().is_empty());
    let why = ReleaseReason::NotBegun;
    assert!(store.release(&[], why, 1).await.unwrap().is_empty());
    assert!(store.orphans(&[]).await.unwrap().is_empty());
    assert!(table.finish(&claim, &success(), 1).await.is_some());
}

conformance! {
    of_no_jobs_nothing_is_asked,
    a_job_comes_back_as_it_was_queued,
    only_an_ended_job_can_be_deleted_and_all_that_hung_on_it_goes,
}
