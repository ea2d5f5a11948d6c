//! What a job table must promise: [`Store`]. One database is one folder here.
//!
//! Promises of every call:
//!
//! - It is one transaction: if it fails, it changed nothing. What has returned survives the death of the process.
//! - A call on behalf of a tenant names the tenant in its statement. What belongs to another tenant is treated like what
//!   does not exist.
//! - The present is an argument (epoch milliseconds), so that tests need no clock. Leases are measured with a clock of
//!   their own, which nobody sets.
//! - A write after a claim names the fencing token of the claim ([`Claim::lease_token`]). Once the job has been given away
//!   or has ended the write changes nothing and says so. Tokens are random: a database that was set back in time gives none
//!   out twice.
//! - States change only as [`State::may_become`] allows.
//! - Work on many rows comes in portions with a limit, so that other writers are not held up.
//! - Errors are [`StoreError`], sorted by what the caller can do.
//!
//! `tests/service/store*.rs` hold every store to this.

pub mod claim;
pub mod cluster;
pub mod ending;
pub mod list;
#[cfg(feature = "cluster")]
pub(crate) mod portion;
#[cfg(feature = "cluster")]
pub mod postgres;
pub mod profile;
pub mod retention;
mod sql_errors;
pub mod sqlite;
pub mod submission;

use std::collections::{HashMap, HashSet};
use std::fmt::Debug;

use async_trait::async_trait;
use uuid::Uuid;

use crate::jobs::model::batch::{Batch, BatchItem, RunRecord};
use crate::jobs::model::job::{Failure, Job, State};
use crate::jobs::model::key::Key;
use crate::jobs::model::kind::{Kind, Queue};
use crate::jobs::store::claim::{
    Claim, ClaimRequest, Lease, QueueAhead, Reap, ReleaseReason, Renewal,
};
use crate::jobs::store::cluster::Cluster;
use crate::jobs::store::ending::{Ending, NewSlice, ResultRef, SliceRecord, StoredResult};
use crate::jobs::store::list::{Change, Filter, Page};
use crate::jobs::store::profile::{ProfileCursor, ProfileEntry, ProfileKept, StoredProfile};
use crate::jobs::store::retention::{Deleted, Moment, Overdue, RetentionRule, Stats, Usage};
use crate::jobs::store::submission::{
    BatchBegun, CacheKey, ClaimedCase, Enqueued, FilledHere, NewBatch, NewJob, QueueBounds,
    Refusal, StoredCase,
};
use crate::jobs::store_error::StoreError;

/// A job table, which also keeps API keys.
#[async_trait]
pub trait Store:
    SubmitJobs
    + Batches
    + BatchLists
    + ClientJobs
    + JobLists
    + Profiles
    + Claims
    + Leases
    + Slices
    + Ends
    + Upkeep
    + ResultKeys
    + Statistics
    + KeyStore
    + Debug
{
    /// Makes a round trip; with `write` the round trip writes, although it changes nothing.
    async fn ready(&self, write: bool) -> Result<(), StoreError>;

    /// What the store can do beside, if several processes may use it at once.
    fn cluster(&self) -> Option<&dyn Cluster>;

    /// Closes every connection. Later calls fail.
    async fn close(&self);

    /// Gives up to `step` free pages back to the file system if there are more than `spare`; says whether it did.
    async fn compact(&self, spare: i64, step: u32) -> Result<bool, StoreError>;
}

/// Submission of single jobs.
#[async_trait]
pub trait SubmitJobs: Send + Sync {
    /// Inserts a job if the bounds leave it a place, or finds the job for which its idempotency key stands. A job with a
    /// cached result ends at once and needs no place; if its source has gone meanwhile, the job is queued. A caller that
    /// stops waiting does not stop the call.
    async fn enqueue(&self, new: &NewJob, bounds: QueueBounds) -> Result<Enqueued, StoreError>;

    /// Frees an idempotency key of a tenant.
    async fn forget_key(&self, tenant: &str, key: &str) -> Result<(), StoreError>;

    /// The job for which an idempotency key of a tenant stands, or the conflict if it stands for another digest.
    async fn job_by_key(
        &self,
        tenant: &str,
        key: &str,
        digest: &[u8; 32],
    ) -> Result<Option<Enqueued>, StoreError>;
}

/// Batches and runs: filled piece by piece, acknowledged once they are complete, read and removed as a whole.
#[async_trait]
pub trait Batches: Send + Sync {
    /// Reserves up to `most` more places in the queue for a batch that is being received; returns how many.
    async fn reserve(
        &self,
        batch: Uuid,
        tenant: &str,
        most: u32,
        bounds: QueueBounds,
    ) -> Result<Result<u32, Refusal>, StoreError>;

    /// What [`Batches::begin_batch`] would answer because of the idempotency key; `None` if the key is free.
    async fn batch_by_key(
        &self,
        new: &NewBatch,
        filled_here: FilledHere<'_>,
    ) -> Result<Option<BatchBegun>, StoreError>;

    /// Begins to fill a batch, or finds the one for which its idempotency key stands. Afterwards exactly the places of its
    /// jobs are reserved. A key of an unfinished batch that no process fills is free.
    async fn begin_batch(
        &self,
        new: &NewBatch,
        filled_here: FilledHere<'_>,
        bounds: QueueBounds,
    ) -> Result<BatchBegun, StoreError>;

    /// Inserts jobs of a batch, with their indices in it, on its reserved places. Returns those that ended at once with a
    /// cached result.
    async fn fill_batch(
        &self,
        batch: Uuid,
        jobs: &[(u32, NewJob)],
    ) -> Result<Vec<Uuid>, StoreError>;

    /// Acknowledges a batch: from now on it is found, and survives the process.
    async fn complete_batch(&self, batch: Uuid) -> Result<(), StoreError>;

    /// Removes up to `limit` jobs of a batch that was never acknowledged, and the batch after the last of them; `true` once
    /// nothing is left. The first call frees its places and its key.
    async fn drop_batch(&self, batch: Uuid, limit: u32) -> Result<bool, StoreError>;

    /// The batches that are not acknowledged.
    async fn unfinished_batches(&self) -> Result<Vec<Uuid>, StoreError>;

    /// Cancels up to `limit` jobs of a batch; returns those that changed.
    async fn cancel_batch(
        &self,
        tenant: &str,
        id: Uuid,
        limit: u32,
        now: i64,
    ) -> Result<Vec<(Uuid, State)>, StoreError>;

    /// Removes up to `limit` ended jobs of a batch, and the batch with its last job; `true` once no ended job is left.
    async fn delete_batch(&self, tenant: &str, id: Uuid, limit: u32) -> Result<bool, StoreError>;

    /// The jobs of a batch after the job `after`, in the order in which they were sent, at most `limit`; small solutions are read with
    /// them, and none after those of `bytes` together.
    async fn batch_items(
        &self,
        tenant: &str,
        id: Uuid,
        after: Option<Uuid>,
        limit: u32,
        bytes: usize,
    ) -> Result<Vec<BatchItem>, StoreError>;

    /// The keys of the labels of the jobs of a batch, sorted, the first `limit`.
    async fn batch_label_keys(
        &self,
        tenant: &str,
        id: Uuid,
        limit: u32,
    ) -> Result<Vec<String>, StoreError>;
}

/// Batches and runs with the counts of their jobs.
#[async_trait]
pub trait BatchLists: Send + Sync {
    /// One page of the acknowledged batches of a tenant with their counts, newest first, from the first one older than `after`.
    async fn batches(
        &self,
        tenant: &str,
        filter: &Filter,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Page<Batch>, StoreError>;

    /// An acknowledged batch or run with its counts.
    async fn batch(&self, tenant: &str, kind: Kind, id: Uuid) -> Result<Option<Batch>, StoreError>;

    /// The template of an acknowledged batch that is a run, and how far its chunks are.
    async fn run(&self, tenant: &str, id: Uuid) -> Result<Option<RunRecord>, StoreError>;
}

/// What clients ask of one job.
#[async_trait]
pub trait ClientJobs: Send + Sync {
    /// Cancels a queued job at once, and marks a running one as to be cancelled; an ended one stays as it is. Returns the
    /// job as it then is.
    async fn cancel(&self, tenant: &str, id: Uuid, now: i64) -> Result<Option<Job>, StoreError>;

    /// Removes an ended job with all that hangs on it; its blob goes with the last reference to it.
    async fn delete(&self, tenant: &str, id: Uuid) -> Result<Deleted, StoreError>;

    /// A job.
    async fn job(&self, tenant: &str, id: Uuid) -> Result<Option<Job>, StoreError>;

    /// A job with its result: a small one itself, a large one by the key of its blob.
    async fn result(
        &self,
        tenant: &str,
        id: Uuid,
    ) -> Result<Option<(Job, Option<ResultRef>)>, StoreError>;

    /// The case of a job as it was submitted.
    async fn case(&self, tenant: &str, id: Uuid) -> Result<Option<StoredCase>, StoreError>;
}

/// Lists of jobs, and what changed lately.
#[async_trait]
pub trait JobLists: Send + Sync {
    /// One page of the jobs of a tenant, newest first, from the first job older than `after`. It reads no more rows than it
    /// returns, up to a constant.
    async fn list(
        &self,
        tenant: &str,
        filter: &Filter,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Page<Job>, StoreError>;

    /// Jobs of a tenant that changed, progress aside, in the order of the time of their last change and of their ids: those
    /// that changed later than `since`, and of those that changed at that time the ones after the job `after`, or all of them.
    async fn changes(
        &self,
        tenant: &str,
        since: i64,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Vec<Change>, StoreError>;
}

/// Cross-sections that tenants keep.
#[async_trait]
pub trait Profiles: Send + Sync {
    /// Keeps a cross-section for a tenant, unless it has it already, or would keep more than `max_bytes` with it.
    async fn add_profile(
        &self,
        tenant: &str,
        new: &StoredProfile,
        max_bytes: u64,
    ) -> Result<ProfileKept, StoreError>;

    /// A cross-section of a tenant by its digest.
    async fn profile(
        &self,
        tenant: &str,
        digest: &str,
    ) -> Result<Option<StoredProfile>, StoreError>;

    /// One page of the cross-sections of a tenant, newest first.
    async fn profiles(
        &self,
        tenant: &str,
        after: Option<&ProfileCursor>,
        limit: u32,
    ) -> Result<Page<ProfileEntry>, StoreError>;

    /// Removes a cross-section of a tenant; `false` if there was none.
    async fn delete_profile(&self, tenant: &str, digest: &str) -> Result<bool, StoreError>;
}

/// Claims of queued jobs.
#[async_trait]
pub trait Claims: Send + Sync {
    /// Queues with jobs in them, and how many.
    async fn queues(&self) -> Result<Vec<(Queue, u64)>, StoreError>;

    /// Claims the first job of a queue, by priority and then by age, together with those behind it that are small
    /// enough, in their order. A suspect comes alone, and no job of a batch that is not acknowledged.
    async fn claim(&self, request: &ClaimRequest<'_>) -> Result<Vec<Claim>, StoreError>;
}

/// What workers do while they hold a lease.
#[async_trait]
pub trait Leases: Send + Sync {
    /// The cases of claimed jobs, with what has happened to them meanwhile.
    async fn claimed_cases(&self, ids: &[Uuid]) -> Result<HashMap<Uuid, ClaimedCase>, StoreError>;

    /// Extends leases and stores progress; the answers are in the order of the claims.
    async fn renew(
        &self,
        claims: &[(&Claim, f64)],
        lease: Lease,
    ) -> Result<Vec<Renewal>, StoreError>;

    /// Gives claimed jobs back to the queue without counting their attempts; those that the client has cancelled end.
    /// Returns those that were still held, with their new states.
    async fn release(
        &self,
        claims: &[Claim],
        why: ReleaseReason,
        now: i64,
    ) -> Result<Vec<(Uuid, State)>, StoreError>;
}

/// Solved slices of jobs that are not solved whole.
#[async_trait]
pub trait Slices: Send + Sync {
    /// Stores a solved slice in place of what there was from its number on; `false` if the lease is lost. Attempts are
    /// counted from the last slice. The same call again changes nothing.
    async fn add_slice(&self, claim: &Claim, slice: &NewSlice) -> Result<bool, StoreError>;

    /// The stored slices of a job in their order. Whatever ends a job removes its slices.
    async fn slices(&self, id: Uuid) -> Result<Vec<SliceRecord>, StoreError>;

    /// The parts of the answer that the slices of a job are, in their order.
    async fn slice_results(&self, id: Uuid) -> Result<Vec<StoredResult>, StoreError>;
}

/// Ends of claimed jobs.
#[async_trait]
pub trait Ends: Send + Sync {
    /// Ends claimed jobs, all in one transaction; returns those that ended. Of the others the lease is lost, or the source
    /// of their cached result has gone.
    async fn finish(&self, ends: &[(Claim, Ending)], now: i64)
    -> Result<HashSet<Uuid>, StoreError>;

    /// For each of these keys that a succeeded job carries, one such job.
    async fn cached(&self, keys: &[CacheKey]) -> Result<HashMap<CacheKey, Uuid>, StoreError>;
}

/// What ends or goes by itself.
#[async_trait]
pub trait Upkeep: Send + Sync {
    /// Takes running jobs from their workers: to `cancelled` if the client asked for that, to `failed` if `attempts_max` are
    /// used up, else back to the queue. An attempt counts only for a job that was solved alone; the others come alone
    /// next time. Returns them with their new states.
    async fn reap(
        &self,
        which: Reap,
        now: i64,
        attempts_max: u32,
    ) -> Result<Vec<(Uuid, State)>, StoreError>;

    /// Ends some of the queued jobs whose deadline has passed with this failure, and names the running ones. To be called
    /// again until it ends none.
    async fn pass_deadlines(
        &self,
        failure: &Failure,
        moment: Moment,
    ) -> Result<Overdue, StoreError>;

    /// Removes expired jobs and leaves tombstones, removes empty batches of that age, and old tombstones. Returns the number
    /// of jobs removed.
    async fn expire(&self, rule: RetentionRule) -> Result<u64, StoreError>;

    /// Was there a job or a batch of this tenant that has expired?
    async fn has_expired(&self, tenant: &str, id: Uuid) -> Result<bool, StoreError>;
}

/// Keys of large results.
#[async_trait]
pub trait ResultKeys: Send + Sync {
    /// Keys of large results that nobody refers to any more, at most `limit`; those in `done` are forgotten first.
    async fn released_blobs(&self, done: &[String], limit: u32) -> Result<Vec<String>, StoreError>;

    /// Leaves a large result that was written and that no job will refer to, to be removed.
    async fn abandon_blob(&self, key: &str) -> Result<(), StoreError>;

    /// Which of these large results no job refers to.
    async fn orphans(&self, results: &[(Uuid, String)]) -> Result<Orphans, StoreError>;
}

/// Counts and sizes.
#[async_trait]
pub trait Statistics: Send + Sync {
    /// What a tenant has; the bytes that its unfinished batches stand for are not known here.
    async fn usage(&self, tenant: &str) -> Result<Usage, StoreError>;

    /// Counts and sizes, read from indices alone.
    async fn stats(&self) -> Result<Stats, StoreError>;

    /// What comes before a queued job among the jobs of its tenant, counted no further than `limit` jobs.
    async fn queued_before(&self, job: &Job, limit: u32) -> Result<QueueAhead, StoreError>;
}

/// API keys.
#[async_trait]
pub trait KeyStore: Send + Sync {
    /// Stores a key. It fails if there is one with the same id.
    async fn add_key(&self, key: &Key) -> Result<(), StoreError>;

    /// A key by its id.
    async fn key(&self, id: &str) -> Result<Option<Key>, StoreError>;

    /// All keys, oldest first, with the revoked ones.
    async fn keys(&self) -> Result<Vec<Key>, StoreError>;

    /// Revokes a key; `None` if there is none. A key that was revoked before keeps its time.
    async fn revoke_key(&self, id: &str, now: i64) -> Result<Option<Key>, StoreError>;
}

/// Large results that no job refers to.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Orphans {
    /// Keys of those that none will refer to.
    pub certain: Vec<String>,
    /// Those whose job is running, with its id: this attempt may have written them and refer to them when it ends, or an earlier
    /// one may have left them behind.
    pub undecided: Vec<(Uuid, String)>,
}
