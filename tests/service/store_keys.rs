//! Does one idempotency key make one job?

use std::collections::BTreeSet;

use railhead::jobs::State;
use railhead::jobs::store::{Enqueued, NewJob, QueueBounds};

use crate::store::{StoreKind, Table, conformance, new_job};

pub fn keyed(key: &str, digest: u8) -> NewJob {
    NewJob {
        idempotency: Some((key.to_owned(), [digest; 32])),
        ..new_job()
    }
}

async fn one_idempotency_key_makes_one_job(kind: StoreKind) {
    let table = Table::new(kind).await;
    let tries = (0..16).map(|_| {
        let store = table.store.clone();
        tokio::spawn(async move {
            store
                .enqueue(&keyed("k", 1), QueueBounds::NONE)
                .await
                .unwrap()
        })
    });
    let mut ids = BTreeSet::new();
    let mut created = 0;
    for enqueued in tries.collect::<Vec<_>>() {
        match enqueued.await.unwrap() {
            Enqueued::Created(job) => {
                created += 1;
                ids.insert(job.id);
            }
            Enqueued::Existing(job) => {
                ids.insert(job.id);
            }
            other => panic!("the cases are the same: {other:?}"),
        }
    }
    assert_eq!((created, ids.len()), (1, 1));
    assert_eq!(table.store.stats().await.unwrap().jobs[&State::Queued], 1);

    assert_eq!(
        table
            .store
            .enqueue(&keyed("k", 2), QueueBounds::NONE)
            .await
            .unwrap(),
        Enqueued::Conflict
    );
    assert_eq!(
        table.job_by_key("k", &[2; 32]).await,
        Some(Enqueued::Conflict)
    );
    assert_eq!(table.job_by_key("other", &[1; 32]).await, None);
    assert!(matches!(
        table
            .store
            .enqueue(&keyed("other", 2), QueueBounds::NONE)
            .await
            .unwrap(),
        Enqueued::Created(_)
    ));
}

conformance! {
    one_idempotency_key_makes_one_job,
}
