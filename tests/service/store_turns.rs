//! Tests the order in which jobs are claimed, and the attempts counted when their process dies.

use railhead::jobs::model::Kind;
use railhead::jobs::store::{
    BatchBegun, ClaimRequest, Enqueued, NewBatch, NewJob, QueueBounds, Reap, Refusal, ReleaseReason,
};
use railhead::jobs::{Filter, State, Total};

use crate::store::*;

conformance!(
    a_bystander_of_a_dead_process_counts_no_attempt,
    a_job_that_was_longer_than_thought_is_known_as_long,
    jobs_and_chunks_of_a_tenant_wait_in_two_queues_and_count_together,
);

async fn a_bystander_of_a_dead_process_counts_no_attempt(kind: StoreKind) {
    let table = Table::new(kind).await;
    let store = &*table.store;
    let ids = [table.add(new_job()).await.id, table.add(new_job()).await.id];
    for _ in 0..2 {
        assert_eq!(claim_up_to(store, 0, 1000, 1).await.len(), 1);
    }
    // Both jobs were running, so that the cause is unknown.
    assert_eq!(store.reap(Reap::Dead, 1, 1).await.unwrap().len(), 2);
    for id in ids {
        let job = store.job("anonymous", id).await.unwrap().unwrap();
        assert_eq!((job.state, job.attempt), (State::Queued, 0));
    }
    // Each suspect is now claimed alone, and a process that solves one does not claim another.
    let suspect = claim_up_to(store, 2, 1000, 8).await;
    assert_eq!((suspect.len(), suspect[0].suspect), (1, true));
    let queue = queue_of("anonymous");
    let without = ClaimRequest {
        suspects: false,
        ..request(&queue, 8, 2)
    };
    assert_eq!(store.claim(&without).await.unwrap(), []);
    let beside = table.add(new_job()).await.id;
    assert_eq!(store.claim(&without).await.unwrap()[0].id, beside);
    // The suspect is the cause. The job that ran at the same time is not.
    let mut taken = store.reap(Reap::Dead, 3, 1).await.unwrap();
    taken.sort_unstable();
    assert_eq!(taken, [(ids[0], State::Failed), (beside, State::Queued)]);
    let job = store.job("anonymous", beside).await.unwrap().unwrap();
    assert_eq!(job.attempt, 0);
    // A job that ran alone counts its attempt, whether it is a suspect or not.
    assert_eq!(claim_up_to(store, 4, 1000, 1).await[0].id, ids[1]);
    assert_eq!(
        store.reap(Reap::Dead, 5, 1).await.unwrap(),
        [(ids[1], State::Failed)]
    );
}

async fn a_job_that_was_longer_than_thought_is_known_as_long(kind: StoreKind) {
    let table = Table::new(kind).await;
    let store = &*table.store;
    let id = table.add(new_job()).await.id;
    let claims = claim_up_to(store, 0, 1000, 1).await;
    let long = ReleaseReason::Long {
        slice_us: 5_000_000,
    };
    assert_eq!(
        store.release(&claims, long, 1).await.unwrap(),
        [(id, State::Queued)]
    );
    let queue = queue_of("anonymous");
    let request = |each_slice_us| ClaimRequest {
        each_slice_us,
        ..request(&queue, 8, 2)
    };
    assert!(
        store
            .claim(&request(Some(2_000_000)))
            .await
            .unwrap()
            .is_empty()
    );
    let claims = store.claim(&request(None)).await.unwrap();
    assert_eq!((claims.len(), claims[0].attempt), (1, 1));
    let ends = [(claims[0].clone(), success())];
    assert_eq!(store.finish(&ends, 3).await.unwrap().len(), 1);
    assert_eq!(store.stats().await.unwrap().jobs[&State::Queued], 0);
    store.enqueue(&new_job(), QueueBounds::NONE).await.unwrap();
    assert_eq!(store.stats().await.unwrap().jobs[&State::Queued], 1);
}

async fn jobs_and_chunks_of_a_tenant_wait_in_two_queues_and_count_together(kind: StoreKind) {
    let table = Table::new(kind).await;
    let store = &*table.store;
    let of_kind = |kind| NewJob { kind, ..new_job() };
    let run = NewBatch {
        kind: Kind::Rows,
        idempotency: Some(("key".to_owned(), [1; 32])),
        ..new_batch("anonymous", 2)
    };
    let chunks = [of_kind(Kind::Rows), of_kind(Kind::Rows)];
    let chunk = chunks[0].id;
    begin(store, &run, chunks).await;
    store.complete_batch(run.id).await.unwrap();
    let job = table.add(of_kind(Kind::Case)).await.id;

    // Both kinds share one quota.
    let bounds = QueueBounds {
        tenant: 3,
        ..QueueBounds::NONE
    };
    let refused = store.enqueue(&new_job(), bounds).await.unwrap();
    assert_eq!(refused, Enqueued::Refused(Refusal::Quota));
    assert_eq!(
        store.usage("anonymous").await.unwrap().jobs[&State::Queued],
        3
    );
    // Clients see neither a chunk as a job nor a run as a batch.
    let listed = store.list("anonymous", &Filter::default(), None, 9).await;
    let listed = listed.unwrap();
    assert_eq!(ids(&listed.entries), [job]);
    assert_eq!(listed.total, Total::Exactly(1));
    assert_eq!(store.job("anonymous", chunk).await.unwrap(), None);
    assert_eq!(store.result("anonymous", chunk).await.unwrap(), None);
    assert_eq!(store.cancel("anonymous", chunk, 1).await.unwrap(), None);
    for (kind, found) in [(Kind::Rows, 1), (Kind::Cases, 0)] {
        let filter = Filter::of(kind);
        let page = store.batches("anonymous", &filter, None, 9).await.unwrap();
        assert_eq!(page.entries.len(), found);
        let batch = store.batch("anonymous", kind, run.id).await.unwrap();
        assert_eq!(batch.is_some(), found == 1);
    }
    let queues = store.queues().await.unwrap();
    let kinds: Vec<Kind> = queues.iter().map(|(queue, _)| queue.kind).collect();
    assert_eq!(kinds, [Kind::Case, Kind::Rows]);
    let claims = claim_up_to(store, 0, 1000, 8).await;
    assert_eq!(
        claims.iter().map(|claim| claim.id).collect::<Vec<_>>(),
        [job]
    );
    assert_eq!(claim_up_to(store, 0, 1000, 8).await.len(), 2);
    assert_eq!(store.queues().await.unwrap(), []);
    // The same key can belong to a run and to a batch.
    for (kind, begun) in [
        (Kind::Rows, BatchBegun::Existing(run.id)),
        (Kind::Cases, BatchBegun::Created),
    ] {
        let again = NewBatch {
            kind,
            idempotency: run.idempotency.clone(),
            ..new_batch("anonymous", 2)
        };
        let answer = store.begin_batch(&again, &|_| false, QueueBounds::NONE);
        assert_eq!(answer.await.unwrap(), begun);
    }
}
