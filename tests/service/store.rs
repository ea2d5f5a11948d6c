//! Does the job table keep its promises? One suite for every store.

use std::collections::{BTreeMap, HashSet};

use bytes::Bytes;
use railhead::contact::remark::entry::RemarkEntry;
use railhead::contact::remark::list::Remark;
use railhead::jobs::store::list::Filter;
use railhead::jobs::store::sqlite::database::SqliteStore;
use railhead::jobs::store::types::{
    Claim, ClaimKind, ClaimRequest, Deleted, Ending, Enqueued, NewJob, QueueBounds, ReleaseReason,
    Renewal, StoredResult,
};
use railhead::jobs::submit_options::SubmitOptions;
use railhead::jobs::{Failure, FailureKind, Job, State};
use tempfile::TempDir;
use uuid::Uuid;

use crate::store_keys::keyed;

const LEASE: i64 = 1_000;

pub struct Table {
    pub store: SqliteStore,
    pub folder: TempDir,
}

impl Table {
    pub async fn new() -> Table {
        let folder = tempfile::tempdir().unwrap();
        let store = SqliteStore::open(&folder.path().join("jobs.db"))
            .await
            .unwrap();
        Table { store, folder }
    }

    pub async fn add(&self, new: NewJob) -> Job {
        match self.store.enqueue(&new, QueueBounds::NONE).await.unwrap() {
            Enqueued::Created(job) => job,
            other => panic!("{other:?}"),
        }
    }

    /// Claims one job of any tenant.
    pub async fn claim(&self, now: i64) -> Option<Claim> {
        claim_up_to(&self.store, now, LEASE, 1).await.pop()
    }

    /// Extends one lease.
    async fn renew(&self, claim: &Claim, progress: f64, now: i64) -> Renewal {
        let renewals = self.store.renew(&[(claim, progress)], now + LEASE).await;
        renewals.unwrap()[0]
    }

    /// Ends one job; `None` if its lease was lost.
    pub async fn finish(&self, claim: &Claim, ending: &Ending, now: i64) -> Option<Job> {
        finish_one(&self.store, claim, ending, now).await
    }

    /// Hands one job back; its new state.
    async fn release(&self, claim: &Claim, now: i64) -> Option<State> {
        let why = ReleaseReason::NotBegun;
        let released = self
            .store
            .release(std::slice::from_ref(claim), why, now)
            .await;
        Some(released.unwrap().first()?.1)
    }

    /// The case of a job, and whether its cancellation was asked for.
    async fn case(&self, id: Uuid) -> Option<(Bytes, bool)> {
        let (case, cancelled) = self.store.cases(&[id]).await.unwrap().remove(&id)?;
        assert_eq!(case.template, None);
        Some((case.body, cancelled))
    }

    async fn state(&self, id: Uuid) -> State {
        self.store.get(id).await.unwrap().unwrap().state
    }
}

/// Claims at most so many small jobs of the first tenant that has any.
pub async fn claim_up_to(store: &SqliteStore, now: i64, lease_ms: i64, jobs: usize) -> Vec<Claim> {
    let tenants = store.queued_tenants().await.unwrap();
    for tenant in &tenants {
        let request = ClaimRequest {
            worker: "w",
            tenant,
            jobs,
            cost_us: 1_000_000,
            kind: ClaimKind::New,
            each_slice_us: None,
            workers: 1,
            lease_until: now + lease_ms,
            now,
            late_before: now,
            skip: &HashSet::new(),
        };
        let claims = store.claim(&request).await.unwrap();
        if !claims.is_empty() {
            return claims;
        }
    }
    Vec::new()
}

/// Ends one job; `None` if its lease was lost.
pub async fn finish_one(
    store: &SqliteStore,
    claim: &Claim,
    ending: &Ending,
    now: i64,
) -> Option<Job> {
    let ends = [(claim.clone(), ending.clone())];
    let ended = store.finish(&ends, now).await.unwrap();
    match ended.contains(&claim.id) {
        true => store.get(claim.id).await.unwrap(),
        false => None,
    }
}

pub fn new_job() -> NewJob {
    let id = Uuid::now_v7();
    NewJob {
        id,
        tenant: "anonymous".into(),
        created_at: i64::try_from(id.as_u128() >> 80).unwrap(),
        name: Some("a case".to_owned()),
        labels: BTreeMap::new(),
        method: "auto".to_owned(),
        body: Bytes::from_static(b"{}"),
        row: false,
        outputs: "[]".to_owned(),
        cost_us: 1000,
        slice_us: 1000,
        cache_key: None,
        source: None,
        idempotency: None,
        traceparent: None,
        options: SubmitOptions::default(),
    }
}

pub fn labelled(key: &str, value: &str) -> NewJob {
    NewJob {
        labels: BTreeMap::from([(key.to_owned(), value.to_owned())]),
        ..new_job()
    }
}

fn remark() -> RemarkEntry {
    Remark::GapRough {}.at_patch(0)
}

pub fn success() -> Ending {
    Ending::Succeeded {
        remarks: vec![remark()],
        result: StoredResult::Blob("results/1".to_owned(), 10),
        field_patches: 2,
    }
}

fn failure() -> Ending {
    Ending::Failed(Failure::new(FailureKind::Panic, "boom"))
}

#[tokio::test]
async fn a_job_comes_back_as_it_was_queued() {
    let table = Table::new().await;
    let new = NewJob {
        body: Bytes::from_static("{\"name\":\"Weiche ½\"}".as_bytes()),
        ..labelled("line", "A12")
    };
    let job = table.add(new.clone()).await;
    assert_eq!(table.store.get(new.id).await.unwrap(), Some(job.clone()));
    assert_eq!(job.state, State::Queued);
    assert_eq!((job.name, job.labels), (new.name, new.labels));
    assert_eq!(
        (job.created_at, job.started_at, job.ended_at),
        (new.created_at, None, None)
    );
    assert_eq!((job.attempt, job.failure), (0, None));
    assert_eq!(table.case(new.id).await, Some((new.body, false)));
    assert_eq!(table.store.get(Uuid::now_v7()).await.unwrap(), None);
    assert_eq!(table.case(Uuid::now_v7()).await, None);
}

#[tokio::test]
async fn jobs_are_claimed_oldest_first_and_each_once() {
    let table = Table::new().await;
    let mut ids = Vec::new();
    for _ in 0..60 {
        ids.push(table.add(new_job()).await.id);
    }
    let first = table.claim(0).await.unwrap();
    assert_eq!(
        (first.id, first.attempt, first.lease_number),
        (ids[0], 1, 1)
    );

    let claimers = (0..8).map(|_| {
        let store = table.store.clone();
        tokio::spawn(async move {
            let mut claimed = Vec::new();
            while let Some(claim) = claim_up_to(&store, 0, LEASE, 1).await.pop() {
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

#[tokio::test]
async fn a_job_ends_once_and_says_how() {
    let table = Table::new().await;
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
        let (_, stored) = table.store.result(claim.id).await.unwrap().unwrap();
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

#[tokio::test]
async fn a_lease_ends_at_its_time_and_not_before() {
    let table = Table::new().await;
    let id = table.add(new_job()).await.id;
    let claim = table.claim(100).await.unwrap();
    assert_eq!(table.store.reap(1_099, 1_099, 5).await.unwrap(), []);
    let renewed = table.renew(&claim, 0.25, 1_000).await;
    assert_eq!(
        renewed,
        Renewal::Held {
            cancel_requested: false
        }
    );
    assert_eq!(table.store.reap(1_999, 1_999, 5).await.unwrap(), []);
    assert_eq!(
        table.store.reap(2_000, 2_000, 5).await.unwrap(),
        [(id, State::Queued)]
    );
    let job = table.store.get(id).await.unwrap().unwrap();
    assert_eq!(
        (job.state, job.attempt, job.started_at),
        (State::Queued, 1, None)
    );
}

#[tokio::test]
async fn a_worker_that_lost_its_lease_changes_nothing() {
    let table = Table::new().await;
    let id = table.add(new_job()).await.id;
    let stale = table.claim(0).await.unwrap();
    table.store.reap(LEASE, LEASE, 5).await.unwrap();
    let queued = table.store.get(id).await.unwrap();
    for claimed_again in [false, true] {
        if claimed_again {
            assert_eq!(table.claim(LEASE).await.unwrap().attempt, 2);
        }
        let before = table.store.get(id).await.unwrap();
        assert_eq!(before == queued, !claimed_again);
        assert_eq!(table.renew(&stale, 0.9, LEASE).await, Renewal::Lost);
        assert_eq!(table.finish(&stale, &success(), LEASE).await, None);
        assert_eq!(table.release(&stale, LEASE).await, None);
        assert_eq!(table.store.get(id).await.unwrap(), before);
    }
}

#[tokio::test]
async fn an_attempt_handed_back_does_not_count_but_still_fences() {
    let table = Table::new().await;
    let id = table.add(new_job()).await.id;
    let first = table.claim(0).await.unwrap();
    assert_eq!(table.release(&first, 1).await, Some(State::Queued));
    let queued = table.store.get(id).await.unwrap().unwrap();
    assert_eq!((queued.attempt, queued.started_at), (0, None));

    let second = table.claim(2).await.unwrap();
    assert_eq!((second.attempt, second.lease_number), (1, 2));
    assert_eq!(table.finish(&first, &success(), 3).await, None);
    assert!(table.finish(&second, &success(), 3).await.is_some());
}

#[tokio::test]
async fn a_job_that_loses_every_worker_fails_after_the_allowed_attempts() {
    let table = Table::new().await;
    let id = table.add(new_job()).await.id;
    for attempt in 1..=3 {
        assert_eq!(table.claim(0).await.unwrap().attempt, attempt);
        let expected = if attempt < 3 {
            State::Queued
        } else {
            State::Failed
        };
        assert_eq!(
            table.store.reap(LEASE, 7_000, 3).await.unwrap(),
            [(id, expected)]
        );
    }
    let job = table.store.get(id).await.unwrap().unwrap();
    assert_eq!(job.failure.unwrap().kind, FailureKind::WorkerLost);
    assert_eq!((job.attempt, job.ended_at), (3, Some(7_000)));
    assert_eq!(table.claim(0).await, None);
}

#[tokio::test]
async fn cancelling_ends_a_queued_job_asks_a_running_one_and_leaves_an_ended_one() {
    let table = Table::new().await;
    let queued = table.add(new_job()).await;
    let cancelled = table.store.cancel(queued.id, 4).await.unwrap().unwrap();
    assert_eq!(
        (cancelled.state, cancelled.ended_at),
        (State::Cancelled, Some(4))
    );
    assert_eq!(table.claim(0).await, None);
    assert_eq!(
        table.store.cancel(queued.id, 5).await.unwrap(),
        Some(cancelled)
    );

    let running = table.add(new_job()).await.id;
    let claim = table.claim(0).await.unwrap();
    let asked = table.store.cancel(running, 6).await.unwrap().unwrap();
    assert_eq!((asked.state, asked.ended_at), (State::Running, None));
    assert_eq!(table.store.cancel(running, 7).await.unwrap(), Some(asked));
    assert!(table.case(running).await.unwrap().1);
    let renewed = table.renew(&claim, 0.5, 8).await;
    assert_eq!(
        renewed,
        Renewal::Held {
            cancel_requested: true
        }
    );
    let ended = table.finish(&claim, &success(), 9).await;
    assert_eq!(table.store.cancel(running, 10).await.unwrap(), ended);
    assert_eq!(table.store.cancel(Uuid::now_v7(), 0).await.unwrap(), None);
}

#[tokio::test]
async fn a_cancelled_job_never_goes_back_to_the_queue() {
    let table = Table::new().await;
    let lost = table.add(new_job()).await.id;
    table.claim(0).await.unwrap();
    table.store.cancel(lost, 1).await.unwrap();
    assert_eq!(
        table.store.reap(LEASE, LEASE, 1).await.unwrap(),
        [(lost, State::Cancelled)]
    );

    let released = table.add(new_job()).await.id;
    let claim = table.claim(0).await.unwrap();
    table.store.cancel(released, 1).await.unwrap();
    assert_eq!(table.release(&claim, 2).await, Some(State::Cancelled));
    for id in [lost, released] {
        let job = table.store.get(id).await.unwrap().unwrap();
        assert_eq!((job.state, job.failure), (State::Cancelled, None));
        assert!(job.ended_at.is_some());
    }
}

#[tokio::test]
async fn only_an_ended_job_can_be_deleted_and_all_that_hung_on_it_goes() {
    let table = Table::new().await;
    let new = NewJob {
        idempotency: Some(("k".to_owned(), [1; 32])),
        ..labelled("line", "A12")
    };
    let id = table.add(new).await.id;
    assert_eq!(
        table.store.delete(id).await.unwrap(),
        Deleted::NotEnded(State::Queued)
    );
    let claim = table.claim(0).await.unwrap();
    assert_eq!(
        table.store.delete(id).await.unwrap(),
        Deleted::NotEnded(State::Running)
    );
    table.finish(&claim, &success(), 1).await;
    assert_eq!(table.store.delete(id).await.unwrap(), Deleted::Done);
    assert_eq!(table.store.delete(id).await.unwrap(), Deleted::NotFound);

    assert_eq!(table.case(id).await, None);
    assert_eq!(
        table
            .store
            .by_key("anonymous", "k", &[1; 32])
            .await
            .unwrap(),
        None
    );
    let filter = Filter {
        label: Some(("line".to_owned(), "A12".to_owned())),
        ..Filter::default()
    };
    assert_eq!(
        table
            .store
            .list("anonymous", &filter, None, 10)
            .await
            .unwrap()
            .jobs,
        []
    );
    let released = table.store.released_blobs(&[], 10).await.unwrap();
    assert_eq!(released, ["results/1"], "its result is left to be removed");
    let released = table.store.released_blobs(&released, 10).await.unwrap();
    assert!(released.is_empty(), "what was removed is forgotten");
}

#[tokio::test]
async fn the_table_outlives_its_process() {
    let table = Table::new().await;
    let id = table.add(keyed("k", 1)).await.id;
    let claim = table.claim(0).await.unwrap();
    let before = table.store.get(id).await.unwrap();
    // Not closed: the second opening finds what a killed process would leave.
    let again = SqliteStore::open(&table.folder.path().join("jobs.db"))
        .await
        .unwrap();
    assert_eq!(again.get(id).await.unwrap(), before);
    assert!(
        matches!(again.enqueue(&keyed("k", 1), QueueBounds::NONE).await.unwrap(), Enqueued::Existing(job) if job.id == id)
    );
    assert!(finish_one(&again, &claim, &success(), 1).await.is_some());
}
