//! In which order are jobs claimed, and what is held against them when their process dies?

use railhead::jobs::State;
use railhead::jobs::model::submit_options::{Priority, SubmitOptions};
use railhead::jobs::store::claim::{ClaimKind, ClaimRequest, Lease, Reap, ReleaseReason};
use railhead::jobs::store::submission::{NewJob, QueueBounds};

use crate::store::{StoreKind, Table, claim_up_to, conformance, new_job, success};

conformance!(
    jobs_are_claimed_by_priority_and_then_by_age,
    a_bystander_of_a_dead_process_counts_no_attempt,
    a_job_that_was_longer_than_thought_is_known_as_long,
);

fn wishing(tenant: &str, priority: Priority) -> NewJob {
    NewJob {
        tenant: tenant.into(),
        options: SubmitOptions {
            priority,
            ..SubmitOptions::default()
        },
        ..new_job()
    }
}

async fn jobs_are_claimed_by_priority_and_then_by_age(kind: StoreKind) {
    let table = Table::new(kind).await;
    let mut added = Vec::new();
    for priority in [
        Priority::Low,
        Priority::Normal,
        Priority::High,
        Priority::Normal,
        Priority::High,
    ] {
        added.push(table.add(wishing("t", priority)).await.id);
    }
    let mut claimed = Vec::new();
    while let Some(claim) = table.claim(0).await {
        claimed.push(claim.id);
    }
    assert_eq!(claimed, [2, 4, 1, 3, 0].map(|place: usize| added[place]));
}

async fn a_bystander_of_a_dead_process_counts_no_attempt(kind: StoreKind) {
    let table = Table::new(kind).await;
    let store = &*table.store;
    let ids = [table.add(new_job()).await.id, table.add(new_job()).await.id];
    for _ in 0..2 {
        assert_eq!(claim_up_to(store, 0, 1000, 1).await.len(), 1);
    }
    // Both were being solved: nobody knows which of them it was.
    assert_eq!(store.reap(Reap::Dead, 1, 1).await.unwrap().len(), 2);
    for id in ids {
        let job = store.job("anonymous", id).await.unwrap().unwrap();
        assert_eq!((job.state, job.attempt), (State::Queued, 0));
    }
    // Now each comes alone, and is marked when it is solved alone.
    let suspect = claim_up_to(store, 2, 1000, 8).await;
    assert_eq!((suspect.len(), suspect[0].suspect), (1, true));
    let waiting = claim_up_to(store, 2, 1000, 8).await;
    store.set_solving(&suspect, true).await.unwrap();
    let mut taken = store.reap(Reap::Dead, 3, 1).await.unwrap();
    taken.sort_unstable();
    assert_eq!(taken, [(ids[0], State::Failed), (ids[1], State::Queued)]);
    assert_eq!(waiting[0].id, ids[1]);
    assert_eq!(
        store
            .job("anonymous", ids[1])
            .await
            .unwrap()
            .unwrap()
            .attempt,
        0
    );
    // One that waited at its gate is no suspect either.
    let other = claim_up_to(store, 4, 1000, 1).await;
    store.set_solving(&other, false).await.unwrap();
    assert_eq!(
        store.reap(Reap::Dead, 5, 1).await.unwrap(),
        [(ids[1], State::Queued)]
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
    let request = |each_slice_us| ClaimRequest {
        worker: "w",
        tenant: "anonymous",
        jobs: 8,
        cost_us: 200_000,
        kind: ClaimKind::New,
        each_slice_us,
        workers: 1,
        lease: Lease { now: 0, ms: 1000 },
        now: 2,
        late_before: 2,
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
