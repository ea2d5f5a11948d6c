//! Common parts of the tests of stores, which are in `store_*.rs`.
//!
//! Each test takes the kind of store to open, and `conformance!` runs it with every kind. A new store needs one more kind and one more module in
//! the macro.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use bytes::Bytes;
use railhead::contact::remark::entry::RemarkEntry;
use railhead::contact::remark::list::Remark;
use railhead::jobs::model::{Kind, Queue, SubmitOptions};
use railhead::jobs::store::{
    BatchBegun, Claim, ClaimKind, ClaimRequest, Ending, Enqueued, Filter, Lease, NewBatch, NewJob,
    Page, QueueBounds, ReleaseReason, Store, StoredResult,
};
use railhead::jobs::{Failure, FailureKind, Job, State};
use tempfile::TempDir;
use uuid::Uuid;

#[cfg(feature = "cluster")]
use railhead::jobs::store::postgres::database::PostgresStore;

pub const LEASE: i64 = 1_000;

/// The kinds of stores.
#[derive(Debug, Clone, Copy)]
pub enum StoreKind {
    Sqlite,
    #[cfg(feature = "cluster")]
    Postgres,
}

/// Runs these tests with every store.
macro_rules! conformance {
    ($($name:ident),* $(,)?) => {
        mod sqlite {
            $(#[tokio::test]
            async fn $name() {
                super::$name(crate::store::StoreKind::Sqlite).await;
            })*
        }
        #[cfg(feature = "cluster")]
        mod postgres {
            $(#[tokio::test]
            async fn $name() {
                if crate::cluster::postgres::server().is_some() {
                    super::$name(crate::store::StoreKind::Postgres).await;
                }
            })*
        }
    };
}
pub(crate) use conformance;

/// A store that is empty at first.
pub struct Table {
    pub store: Arc<dyn Store>,
    pub folder: TempDir,
    pub kind: StoreKind,
    /// The URL of the database, if the store is on a server.
    pub url: Option<String>,
}

impl Table {
    pub async fn new(kind: StoreKind) -> Table {
        let folder = tempfile::tempdir().unwrap();
        let url = match kind {
            StoreKind::Sqlite => None,
            #[cfg(feature = "cluster")]
            StoreKind::Postgres => crate::cluster::postgres::schema().await,
        };
        let store = open_store(kind, folder.path(), url.as_deref()).await;
        Table {
            store,
            folder,
            kind,
            url,
        }
    }

    /// Opens the store again, as another process does.
    pub async fn open_again(&self) -> Arc<dyn Store> {
        open_store(self.kind, self.folder.path(), self.url.as_deref()).await
    }

    pub async fn add(&self, new: NewJob) -> Job {
        match self.store.enqueue(&new, QueueBounds::NONE).await.unwrap() {
            Enqueued::Created(job) => job,
            other => panic!("{other:?}"),
        }
    }

    /// Claims one job of any tenant.
    pub async fn claim(&self, now: i64) -> Option<Claim> {
        claim_up_to(&*self.store, now, LEASE, 1).await.pop()
    }

    /// Ends one job and returns it, or `None` if its lease was lost.
    pub async fn finish(&self, claim: &Claim, ending: &Ending, now: i64) -> Option<Job> {
        finish_one(&*self.store, claim, ending, now).await
    }

    /// Releases one job and returns its new state.
    pub async fn release(&self, claim: &Claim, now: i64) -> Option<State> {
        let why = ReleaseReason::NotBegun;
        let released = self
            .store
            .release(std::slice::from_ref(claim), why, now)
            .await;
        Some(released.unwrap().first()?.1)
    }

    /// Returns the case of a job and whether its cancellation was requested.
    pub async fn case(&self, id: Uuid) -> Option<(Bytes, bool)> {
        let claimed = self.store.claimed_cases(&[id]).await.unwrap().remove(&id)?;
        let (case, cancelled) = (claimed.case, claimed.cancel_requested);
        assert_eq!(case.template, None);
        Some((case.body, cancelled))
    }

    /// Returns a job of the tenant `anonymous`.
    pub async fn job(&self, id: Uuid) -> Option<Job> {
        self.store.job("anonymous", id).await.unwrap()
    }

    pub async fn cancel(&self, id: Uuid, now: i64) -> Option<Job> {
        self.store.cancel("anonymous", id, now).await.unwrap()
    }

    pub async fn delete(&self, id: Uuid) -> bool {
        self.store.delete("anonymous", id).await.unwrap()
    }

    pub async fn list(&self, filter: &Filter, after: Option<Uuid>, limit: u32) -> Page<Job> {
        let page = self.store.list("anonymous", filter, after, limit);
        page.await.unwrap()
    }

    pub async fn job_by_key(&self, key: &str, digest: &[u8; 32]) -> Option<Enqueued> {
        let found = self.store.job_by_key("anonymous", key, digest);
        found.await.unwrap()
    }

    pub async fn released_blobs(&self, done: &[String], limit: u32) -> Vec<String> {
        self.store.released_blobs(done, limit).await.unwrap()
    }
}

#[cfg_attr(
    not(feature = "cluster"),
    expect(unused_variables, reason = "only a server has a URL")
)]
async fn open_store(kind: StoreKind, folder: &Path, url: Option<&str>) -> Arc<dyn Store> {
    match kind {
        StoreKind::Sqlite => open_beside(folder).await,
        #[cfg(feature = "cluster")]
        StoreKind::Postgres => {
            let store = PostgresStore::open(url.expect("a server"), 8)
                .await
                .unwrap();
            Arc::new(store.with_given_clock())
        }
    }
}

/// Opens the store of a data folder while the service uses it.
pub async fn open_beside(folder: &Path) -> Arc<dyn Store> {
    railhead::jobs::store::open::open_beside(folder)
        .await
        .unwrap()
}

/// Returns the queue of the single jobs of a tenant.
pub fn queue_of(tenant: &str) -> Queue {
    Queue {
        tenant: tenant.into(),
        kind: Kind::Case,
    }
}

/// Returns a claim of at most `jobs` small jobs that have not begun.
pub fn request(queue: &Queue, jobs: usize, now: i64) -> ClaimRequest<'_> {
    ClaimRequest {
        worker: "w",
        queue,
        jobs,
        cost_us: 1_000_000,
        kind: ClaimKind::New,
        each_slice_us: None,
        suspects: true,
        waiting: 0,
        lease: Lease { now, ms: LEASE },
        now,
        late_before: now,
    }
}

/// Creates an empty batch without an idempotency key and adds its cases.
pub async fn begin(store: &dyn Store, new: &NewBatch, jobs: impl IntoIterator<Item = NewJob>) {
    let begun = store.begin_batch(new, &|_| false, QueueBounds::NONE).await;
    assert_eq!(begun.unwrap(), BatchBegun::Created);
    let jobs: Vec<_> = (0..).zip(jobs).collect();
    for some in jobs.chunks(1000) {
        store.fill_batch(new.id, some).await.unwrap();
    }
}

pub fn ids(jobs: &[Job]) -> Vec<Uuid> {
    jobs.iter().map(|job| job.id).collect()
}

/// Claims at most `jobs` small jobs of the first queue that has any.
pub async fn claim_up_to(store: &dyn Store, now: i64, lease_ms: i64, jobs: usize) -> Vec<Claim> {
    let queues = store.queues().await.unwrap();
    for (queue, _) in &queues {
        let request = ClaimRequest {
            lease: Lease { now, ms: lease_ms },
            ..request(queue, jobs, now)
        };
        let claims = store.claim(&request).await.unwrap();
        if !claims.is_empty() {
            return claims;
        }
    }
    Vec::new()
}

/// Ends one job and returns it, or `None` if its lease was lost.
pub async fn finish_one(
    store: &dyn Store,
    claim: &Claim,
    ending: &Ending,
    now: i64,
) -> Option<Job> {
    let ends = [(claim.clone(), ending.clone())];
    let ended = store.finish(&ends, now).await.unwrap();
    match ended.contains(&claim.id) {
        true => store.job("anonymous", claim.id).await.unwrap(),
        false => None,
    }
}

pub fn new_job() -> NewJob {
    let id = Uuid::now_v7();
    NewJob {
        id,
        tenant: "anonymous".into(),
        kind: Kind::Case,
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
        idempotency: None,
        traceparent: None,
        options: SubmitOptions::default(),
    }
}

pub fn new_batch(tenant: &str, count: u32) -> NewBatch {
    NewBatch {
        id: Uuid::now_v7(),
        tenant: tenant.into(),
        kind: Kind::Cases,
        created_at: 0,
        count,
        rejected: 0,
        name: None,
        labels: BTreeMap::new(),
        template: None,
        head: None,
        bytes: 0,
        idempotency: None,
    }
}

pub fn labelled(key: &str, value: &str) -> NewJob {
    NewJob {
        labels: BTreeMap::from([(key.to_owned(), value.to_owned())]),
        ..new_job()
    }
}

pub fn remark() -> RemarkEntry {
    Remark::GapRough {}.at_patch(0)
}

pub fn success() -> Ending {
    Ending::Succeeded {
        remarks: vec![remark()],
        result: StoredResult::Blob("results/1".to_owned(), 10),
        field_patches: 2,
    }
}

pub fn failure() -> Ending {
    Ending::Failed {
        failure: Failure::new(FailureKind::Panic, "boom"),
        remarks: vec![remark()],
    }
}
