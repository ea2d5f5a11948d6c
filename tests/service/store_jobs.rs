//! Does a store keep its promises about single jobs, claims and leases?

use bytes::Bytes;
use railhead::jobs::store::{
    Deleted, Ending, Enqueued, Filter, Lease, NewJob, Orphans, QueueBounds, Reap, ReleaseReason,
    Renewal,
};
use railhead::jobs::{FailureKind, State};
use uuid::Uuid;

use crate::store::*;
use crate::store_keys::keyed;

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
}

async fn jobs_are_claimed_oldest_first_and_each_once(kind: StoreKind) {
    let table = Table::new(kind).await;
    let mut ids = Vec::new();
    for _ in 0..60 {
        ids.push(table.add(new_job()).await.id);
    }
    let first = table.claim(0).await.unwrap();
    assert_eq!((first.id, first.attempt), (ids[0], 1));

    let claimers = (0..8).map(|_| {
        let store = table.store.clone();
        tokio::spawn(async move {
            let mut claimed = Vec::new();
            while let Some(claim) = claim_up_to(&*store, 0, LEASE, 1).await.pop() {
                claimed.push(claim.id);
            }
            claimed
        })
    });
    let mut claimed = Vec::new();
    for claimer in claimers.collect::<Vec<_>>() {
        let ids = claimer.await.unwrap();
        assert!(
            ids.is_sorted(),
            "each claimer meets the jobs in their order"
        );
        claimed.extend(ids);
    }
    claimed.sort_unstable();
    assert_eq!(claimed, ids[1..]);
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

async fn a_lease_ends_at_its_time_and_not_before(kind: StoreKind) {
    let table = Table::new(kind).await;
    let id = table.add(new_job()).await.id;
    let claim = table.claim(100).await.unwrap();
    assert_eq!(table.reap(Reap::Expired { now: 1_099 }, 1_099, 5).await, []);
    let renewed = table.renew(&claim, 0.25, 1_000).await;
    assert_eq!(
        renewed,
        Renewal::Held {
            cancel_requested: false
        }
    );
    assert_eq!(table.reap(Reap::Expired { now: 1_999 }, 1_999, 5).await, []);
    assert_eq!(
        table.reap(Reap::Expired { now: 2_000 }, 2_000, 5).await,
        [(id, State::Queued)]
    );
    let job = table.job(id).await.unwrap();
    assert_eq!(
        (job.state, job.attempt, job.started_at),
        (State::Queued, 1, None)
    );
}

async fn a_worker_that_lost_its_lease_changes_nothing(kind: StoreKind) {
    let table = Table::new(kind).await;
    let id = table.add(new_job()).await.id;
    let stale = table.claim(0).await.unwrap();
    table.reap(Reap::Expired { now: LEASE }, LEASE, 5).await;
    let queued = table.job(id).await;
    for claimed_again in [false, true] {
        if claimed_again {
            assert_eq!(table.claim(LEASE).await.unwrap().attempt, 2);
        }
        let before = table.job(id).await;
        assert_eq!(before == queued, !claimed_again);
        assert_eq!(table.renew(&stale, 0.9, LEASE).await, Renewal::Lost);
        assert_eq!(table.finish(&stale, &success(), LEASE).await, None);
        assert_eq!(table.release(&stale, LEASE).await, None);
        assert_eq!(table.job(id).await, before);
    }
}

async fn an_attempt_handed_back_does_not_count_but_still_fences(kind: StoreKind) {
    let table = Table::new(kind).await;
    let id = table.add(new_job()).await.id;
    let first = table.claim(0).await.unwrap();
    assert_eq!(table.release(&first, 1).await, Some(State::Queued));
    let queued = table.job(id).await.unwrap();
    assert_eq!((queued.attempt, queued.started_at), (0, None));

    let second = table.claim(2).await.unwrap();
    assert_eq!(second.attempt, 1);
    assert_ne!(second.lease_token, first.lease_token);
    assert_eq!(table.finish(&first, &success(), 3).await, None);
    assert!(table.finish(&second, &success(), 3).await.is_some());
}

async fn a_job_that_loses_every_worker_fails_after_the_allowed_attempts(kind: StoreKind) {
    let table = Table::new(kind).await;
    let id = table.add(new_job()).await.id;
    for attempt in 1..=3 {
        assert_eq!(table.claim(0).await.unwrap().attempt, attempt);
        let expected = if attempt < 3 {
            State::Queued
        } else {
            State::Failed
        };
        assert_eq!(
            table.reap(Reap::Expired { now: LEASE }, 7_000, 3).await,
            [(id, expected)]
        );
    }
    let job = table.job(id).await.unwrap();
    assert_eq!(job.failure.unwrap().kind, FailureKind::WorkerLost);
    assert_eq!((job.attempt, job.ended_at), (3, Some(7_000)));
    assert_eq!(table.claim(0).await, None);
}

async fn cancelling_ends_a_queued_job_asks_a_running_one_and_leaves_an_ended_one(kind: StoreKind) {
    let table = Table::new(kind).await;
    let queued = table.add(new_job()).await;
    let cancelled = table.cancel(queued.id, 4).await.unwrap();
    assert_eq!(
        (cancelled.state, cancelled.ended_at),
        (State::Cancelled, Some(4))
    );
    assert_eq!(table.claim(0).await, None);
    assert_eq!(table.cancel(queued.id, 5).await, Some(cancelled));

    let running = table.add(new_job()).await.id;
    let claim = table.claim(0).await.unwrap();
    let asked = table.cancel(running, 6).await.unwrap();
    assert_eq!((asked.state, asked.ended_at), (State::Running, None));
    assert_eq!(table.cancel(running, 7).await, Some(asked));
    assert!(table.case(running).await.unwrap().1);
    let renewed = table.renew(&claim, 0.5, 8).await;
    assert_eq!(
        renewed,
        Renewal::Held {
            cancel_requested: true
        }
    );
    let ended = table.finish(&claim, &success(), 9).await;
    assert_eq!(table.cancel(running, 10).await, ended);
    assert_eq!(table.cancel(Uuid::now_v7(), 0).await, None);
}

async fn a_cancelled_job_never_goes_back_to_the_queue(kind: StoreKind) {
    let table = Table::new(kind).await;
    let lost = table.add(new_job()).await.id;
    table.claim(0).await.unwrap();
    table.cancel(lost, 1).await;
    assert_eq!(
        table.reap(Reap::Expired { now: LEASE }, LEASE, 1).await,
        [(lost, State::Cancelled)]
    );

    let released = table.add(new_job()).await.id;
    let claim = table.claim(0).await.unwrap();
    table.cancel(released, 1).await;
    assert_eq!(table.release(&claim, 2).await, Some(State::Cancelled));
    for id in [lost, released] {
        let job = table.job(id).await.unwrap();
        assert_eq!((job.state, job.failure), (State::Cancelled, None));
        assert!(job.ended_at.is_some());
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

async fn the_table_outlives_its_process(kind: StoreKind) {
    let table = Table::new(kind).await;
    let id = table.add(keyed("k", 1)).await.id;
    let claim = table.claim(0).await.unwrap();
    let before = table.job(id).await;
    // Not closed: the second opening finds what a killed process would leave.
    let again = table.open_again().await;
    assert_eq!(again.job("anonymous", id).await.unwrap(), before);
    assert!(
        matches!(again.enqueue(&keyed("k", 1), QueueBounds::NONE).await.unwrap(), Enqueued::Existing(job) if job.id == id)
    );
    assert!(finish_one(&*again, &claim, &success(), 1).await.is_some());
}

async fn jobs_of_a_group_that_died_are_retried_alone_and_uncounted(kind: StoreKind) {
    let table = Table::new(kind).await;
    let store = &*table.store;
    for _ in 0..3 {
        store.enqueue(&new_job(), QueueBounds::NONE).await.unwrap();
    }
    let group = claim_up_to(store, 0, 10, 8).await;
    assert_eq!(group.len(), 3);
    assert_eq!(
        store
            .reap(Reap::Expired { now: 10 }, 10, 1)
            .await
            .unwrap()
            .len(),
        3
    );
    let ends: Vec<_> = group
        .iter()
        .map(|claim| (claim.clone(), success()))
        .collect();
    assert!(store.finish(&ends, 11).await.unwrap().is_empty(), "fenced");
    for claim in &group {
        let alone = claim_up_to(store, 20, 10, 8).await;
        assert_eq!(alone.len(), 1);
        assert_eq!((alone[0].id, alone[0].attempt), (claim.id, 1));
        assert!(alone[0].suspect && alone[0].lease_token != claim.lease_token);
    }
    // Alone, the one attempt that is allowed counts.
    let ended = store.reap(Reap::Expired { now: 30 }, 30, 1).await.unwrap();
    assert!(
        ended.iter().all(|(_, state)| state.name() == "failed"),
        "{ended:?}"
    );
}

async fn an_end_that_is_written_again_because_its_answer_was_lost_keeps_its_result(
    kind: StoreKind,
) {
    let table = Table::new(kind).await;
    table.add(new_job()).await;
    let claim = table.claim(0).await.unwrap();
    assert!(table.finish(&claim, &success(), 1).await.is_some());
    // The worker takes the job for lost and leaves the result to be removed.
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
    assert_eq!(store.orphans(&[]).await.unwrap(), Orphans::default());
    assert!(store.cached(&[]).await.unwrap().is_empty());
    assert!(table.finish(&claim, &success(), 1).await.is_some());
}

conformance! {
    of_no_jobs_nothing_is_asked,
    an_end_that_is_written_again_because_its_answer_was_lost_keeps_its_result,
    jobs_of_a_group_that_died_are_retried_alone_and_uncounted,
    a_job_comes_back_as_it_was_queued,
    jobs_are_claimed_oldest_first_and_each_once,
    a_job_ends_once_and_says_how,
    a_lease_ends_at_its_time_and_not_before,
    a_worker_that_lost_its_lease_changes_nothing,
    an_attempt_handed_back_does_not_count_but_still_fences,
    a_job_that_loses_every_worker_fails_after_the_allowed_attempts,
    cancelling_ends_a_queued_job_asks_a_running_one_and_leaves_an_ended_one,
    a_cancelled_job_never_goes_back_to_the_queue,
    only_an_ended_job_can_be_deleted_and_all_that_hung_on_it_goes,
    the_table_outlives_its_process,
}
