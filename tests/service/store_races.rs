//! Tests concurrent calls of a store through separate connections.

use std::collections::HashSet;
use std::sync::Arc;

use futures_util::future::try_join_all;
use railhead::jobs::store::{BatchBegun, Enqueued, NewJob, QueueBounds, Store};

use crate::store::*;

/// Opens a store twice, as two processes do.
async fn two(kind: StoreKind) -> (Table, [Arc<dyn Store>; 2]) {
    let table = Table::new(kind).await;
    let other = table.open_again().await;
    let stores = [table.store.clone(), other];
    (table, stores)
}

/// Submits jobs at the same time, alternately to both stores.
async fn submit(
    stores: &[Arc<dyn Store>; 2],
    jobs: Vec<NewJob>,
    bounds: QueueBounds,
) -> Vec<Enqueued> {
    let submitted = jobs.into_iter().enumerate().map(|(number, job)| {
        let store = stores[number % 2].clone();
        tokio::spawn(async move { store.enqueue(&job, bounds).await.unwrap() })
    });
    try_join_all(submitted).await.unwrap()
}

async fn one_key_makes_one_job_whoever_asks_at_the_same_moment(kind: StoreKind) {
    let (table, stores) = two(kind).await;
    let keyed = |key: &str, digest: u8| NewJob {
        idempotency: Some((key.to_owned(), [digest; 32])),
        ..new_job()
    };
    let jobs = (0..32).map(|_| keyed("k", 7)).collect();
    let answers = submit(&stores, jobs, QueueBounds::NONE).await;
    let mut ids = HashSet::new();
    let mut created = 0;
    for answer in answers {
        created += usize::from(matches!(answer, Enqueued::Created(_)));
        match answer {
            Enqueued::Created(job) | Enqueued::Existing(job) => ids.insert(job.id),
            other => panic!("{other:?}"),
        };
    }
    assert_eq!((created, ids.len()), (1, 1));
    // Another case with the same key is a conflict. An unused key is accepted.
    let conflict = Some(Enqueued::Conflict);
    assert_eq!(table.job_by_key("k", &[2; 32]).await, conflict);
    assert_eq!(table.job_by_key("other", &[7; 32]).await, None);
    let others = vec![keyed("k", 2), keyed("other", 7)];
    let others = submit(&stores, others, QueueBounds::NONE).await;
    assert_eq!(others[0], Enqueued::Conflict);
    assert!(matches!(others[1], Enqueued::Created(_)));
}

async fn a_quota_is_exact_whoever_submits_at_the_same_moment(kind: StoreKind) {
    let (_table, stores) = two(kind).await;
    let bounds = QueueBounds {
        all: 1000,
        tenant: 20,
        stored: None,
    };
    // A batch holds some of the places already.
    begin(&*stores[0], &new_batch("anonymous", 5), []).await;
    let jobs = (0..40).map(|_| new_job()).collect();
    let answers = submit(&stores, jobs, bounds).await;
    let created = answers
        .iter()
        .filter(|answer| matches!(answer, Enqueued::Created(_)));
    assert_eq!(created.count(), 15);
}

async fn one_key_makes_one_batch_and_is_known_once_it_is_acknowledged(kind: StoreKind) {
    let (_table, stores) = two(kind).await;
    let keyed = || {
        let mut batch = new_batch("anonymous", 1);
        batch.idempotency = Some(("k".to_owned(), [7; 32]));
        batch
    };
    let (first, second) = (keyed(), keyed());
    let filled = |id| id == first.id;
    begin(&*stores[0], &first, []).await;
    let begun = stores[1].begin_batch(&second, &filled, QueueBounds::NONE);
    assert_eq!(begun.await.unwrap(), BatchBegun::Unfinished);
    // No job of the batch is claimed before all of them are stored.
    stores[0]
        .fill_batch(first.id, &[(0, new_job())])
        .await
        .unwrap();
    assert!(claim_up_to(&*stores[1], 0, LEASE, 9).await.is_empty());
    stores[0].complete_batch(first.id).await.unwrap();
    let known = stores[1].begin_batch(&second, &|_| false, QueueBounds::NONE);
    assert_eq!(known.await.unwrap(), BatchBegun::Existing(first.id));
    assert_eq!(claim_up_to(&*stores[1], 0, LEASE, 9).await.len(), 1);
}

async fn what_was_given_up_is_neither_filled_nor_acknowledged(kind: StoreKind) {
    let (_table, stores) = two(kind).await;
    let batch = new_batch("anonymous", 3);
    begin(&*stores[0], &batch, [new_job(), new_job()]).await;
    // Another process considers the batch abandoned and has begun to remove it.
    assert!(!stores[1].drop_batch(batch.id, 1).await.unwrap());
    let late = [(2, new_job())];
    assert!(stores[0].fill_batch(batch.id, &late).await.is_err());
    assert!(stores[0].complete_batch(batch.id).await.is_err());
    assert!(stores[1].drop_batch(batch.id, 9).await.unwrap());
}

async fn each_job_is_claimed_and_ended_once_by_many(kind: StoreKind) {
    let (_table, stores) = two(kind).await;
    for _ in 0..60 {
        stores[0]
            .enqueue(&new_job(), QueueBounds::NONE)
            .await
            .unwrap();
    }
    let workers = (0..6).map(|number| {
        let store = stores[number % 2].clone();
        tokio::spawn(async move {
            let mut ended = Vec::new();
            // Other workers may hold the remaining jobs for a moment.
            while store.stats().await.unwrap().jobs[&railhead::jobs::State::Queued] > 0 {
                for claim in claim_up_to(&*store, 0, LEASE, 4).await {
                    let job = finish_one(&*store, &claim, &success(), 1).await;
                    ended.push(job.expect("the lease is held").id);
                }
            }
            ended
        })
    });
    let ended = try_join_all(workers).await.unwrap().concat();
    let distinct: HashSet<_> = ended.iter().collect();
    assert_eq!((ended.len(), distinct.len()), (60, 60));
}

conformance! {
    one_key_makes_one_job_whoever_asks_at_the_same_moment,
    a_quota_is_exact_whoever_submits_at_the_same_moment,
    one_key_makes_one_batch_and_is_known_once_it_is_acknowledged,
    what_was_given_up_is_neither_filled_nor_acknowledged,
    each_job_is_claimed_and_ended_once_by_many,
}
