//! Tests single jobs, claims and leases of a store.

use bytes::Bytes;
use railhead::jobs::State;
use railhead::jobs::store::{Deleted, Ending, Filter, Lease, NewJob, ReleaseReason};
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
    table.claim(0).await.unwrap();
    table.cancel(new.id, 1).await.unwrap();
    let (_, cancelled) = table.case(new.id).await.unwrap();
    assert!(cancelled, "whoever takes it up hears of it");
}

async fn a_job_ends_once_and_says_how(kind: StoreKind) {
    let table = Table::new(kind).await;
    for (ending, state) in [
        (success(), State::Succeeded),
        (failure(), State::Failed),
        (Ending::Cancelled, State::Cancelled),
    ] {
        table.add(new_job()).await;
        let claim = table.claim(5).await.unwrap();
        let job = table.finish(&claim, &ending, 9).await.unwrap();
        assert_eq!(
            (job.state, job.started_at, job.ended_at),
            (state, Some(5), Some(9))
        );
        assert_eq!(job.failure.is_some(), state == State::Failed);
        let (_, stored) = table.result(claim.id).await.unwrap();
        assert_eq!(stored.is_some(), state == State::Succeeded);
        if state == State::Succeeded {
            assert_eq!(job.remarks, [remark()]);
            assert!((job.progress - 1.0).abs() < f64::EPSILON);
            assert_eq!(stored.unwrap().field_patches, 2);
        }
        for late in [success(), failure(), Ending::Cancelled] {
            assert_eq!(table.finish(&claim, &late, 10).await, None);
        }
        assert_eq!(table.state(claim.id).await, state);
    }
}

async fn only_an_ended_job_can_be_deleted_and_all_that_hung_on_it_goes(kind: StoreKind) {
    let table = Table::new(kind).await;
    let new = NewJob {
        idempotency: Some(("k".to_owned(), [1; 32])),
        ..labelled("line", "A12")
    };
    let id = table.add(new).await.id;
    assert_eq!(table.delete(id).await, Deleted::NotEnded(State::Queued));
    let claim = table.claim(0).await.unwrap();
    assert_eq!(table.delete(id).await, Deleted::NotEnded(State::Running));
    table.finish(&claim, &success(), 1).await;
    assert_eq!(table.delete(id).await, Deleted::Done);
    assert_eq!(table.delete(id).await, Deleted::NotFound);

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

async fn an_end_that_is_written_again_because_its_answer_was_lost_keeps_its_result(
    kind: StoreKind,
) {
    let table = Table::new(kind).await;
    table.add(new_job()).await;
    let claim = table.claim(0).await.unwrap();
    assert!(table.finish(&claim, &success(), 1).await.is_some());
    // The worker considers the job lost and leaves the result to be removed.
    assert_eq!(table.finish(&claim, &success(), 2).await, None);
    table.store.abandon_blob("results/1").await.unwrap();
    assert!(table.released_blobs(&[], 9).await.is_empty());
    table.delete(claim.id).await;
    let released = table.released_blobs(&[], 9).await;
    assert_eq!(released, ["results/1"]);
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
    assert!(store.cached(&[]).await.unwrap().is_empty());
    assert!(table.finish(&claim, &success(), 1).await.is_some());
}

conformance! {
    of_no_jobs_nothing_is_asked,
    an_end_that_is_written_again_because_its_answer_was_lost_keeps_its_result,
    a_job_comes_back_as_it_was_queued,
    a_job_ends_once_and_says_how,
    only_an_ended_job_can_be_deleted_and_all_that_hung_on_it_goes,
}
