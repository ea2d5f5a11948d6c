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
use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt::Debug;
use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use bytes::Bytes;
use object_store::ObjectStore;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use crate::codec::result::EncodedResult;
use crate::error::StoreError;
use crate::model::{
    Batch, BatchItem, Failure, Job, Key, Kind, Queue, RunRecord, State, SubmitOptions,
};
use railhead_contact::remark::entry::RemarkEntry;

/// Runs a statement on a connection with a value for each of its parameters, and takes its rows as `execute`, `fetch_all` or the like do;
/// `scalar` takes those of one column.
macro_rules! sql {
    ($take:ident, $connection:expr, $text:expr $(; $($value:expr),+)?) => {
        query($text)$($(.bind($value))+)?.$take($connection).await
    };
    (scalar $take:ident, $connection:expr, $text:expr $(; $($value:expr),+)?) => {
        query_scalar($text)$($(.bind($value))+)?.$take($connection).await
    };
}

/// Binds the values of a row of `VALUES`.
macro_rules! values {
    ($row:ident; $($value:expr),+) => {
        $row$(.push_bind($value))+
    };
}

#[cfg(feature = "cluster")]
pub mod postgres;
mod sql_errors;
pub mod sqlite;

/// The result of a call of a store; a failed call changes nothing.
pub type Result<T, E = StoreError> = std::result::Result<T, E>;

/// A job table, which also keeps API keys.
#[async_trait]
pub trait Store:
    SubmitJobs
    + Batches
    + ClientJobs
    + Profiles
    + Claims
    + Ends
    + Upkeep
    + ResultKeys
    + KeyStore
    + Debug
{
    /// Makes a round trip; with `write` the round trip writes, although it changes nothing.
    async fn ready(&self, write: bool) -> Result<()>;

    /// What the store can do beside, if several processes may use it at once.
    fn cluster(&self) -> Option<&dyn Cluster>;

    /// Closes every connection. Later calls fail.
    async fn close(&self);

    /// Gives up to `step` free pages back to the file system if there are more than `spare`; says whether it did.
    async fn compact(&self, spare: i64, step: u32) -> Result<bool>;
}

/// Submission of single jobs.
#[async_trait]
pub trait SubmitJobs: Send + Sync {
    /// Inserts a job if the bounds leave it a place, or finds the job for which its idempotency key stands. A job with a
    /// cached result ends at once and needs no place; if its source has gone meanwhile, the job is queued. A caller that
    /// stops waiting does not stop the call.
    async fn enqueue(&self, new: &NewJob, bounds: QueueBounds) -> Result<Enqueued>;

    /// Frees an idempotency key of a tenant.
    async fn forget_key(&self, tenant: &str, key: &str) -> Result<()>;

    /// The job for which an idempotency key of a tenant stands, or the conflict if it stands for another digest.
    async fn job_by_key(
        &self,
        tenant: &str,
        key: &str,
        digest: &[u8; 32],
    ) -> Result<Option<Enqueued>>;
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
    ) -> Result<Result<u32, Refusal>>;

    /// What [`Batches::begin_batch`] would answer because of the idempotency key; `None` if the key is free.
    async fn batch_by_key(
        &self,
        new: &NewBatch,
        filled_here: FilledHere<'_>,
    ) -> Result<Option<BatchBegun>>;

    /// Begins to fill a batch, or finds the one for which its idempotency key stands. Afterwards exactly the places of its
    /// jobs are reserved. A key of an unfinished batch that no process fills is free.
    async fn begin_batch(
        &self,
        new: &NewBatch,
        filled_here: FilledHere<'_>,
        bounds: QueueBounds,
    ) -> Result<BatchBegun>;

    /// Inserts jobs of a batch, with their indices in it, on its reserved places. Returns those that ended at once with a
    /// cached result.
    async fn fill_batch(&self, batch: Uuid, jobs: &[(u32, NewJob)]) -> Result<Vec<Uuid>>;

    /// Acknowledges a batch: from now on it is found, and survives the process.
    async fn complete_batch(&self, batch: Uuid) -> Result<()>;

    /// Removes up to `limit` jobs of a batch that was never acknowledged, and the batch after the last of them; `true` once
    /// nothing is left. The first call frees its places and its key.
    async fn drop_batch(&self, batch: Uuid, limit: u32) -> Result<bool>;

    /// The batches that are not acknowledged.
    async fn unfinished_batches(&self) -> Result<Vec<Uuid>>;

    /// Cancels up to `limit` jobs of a batch; returns those that changed.
    async fn cancel_batch(
        &self,
        tenant: &str,
        id: Uuid,
        limit: u32,
        now: i64,
    ) -> Result<Vec<(Uuid, State)>>;

    /// Removes up to `limit` ended jobs of a batch, and the batch with its last job; `true` once no ended job is left.
    async fn delete_batch(&self, tenant: &str, id: Uuid, limit: u32) -> Result<bool>;

    /// The jobs of a batch after the job `after`, in the order in which they were sent, at most `limit`; small solutions are read with
    /// them, and none after those of `bytes` together.
    async fn batch_items(
        &self,
        tenant: &str,
        id: Uuid,
        after: Option<Uuid>,
        limit: u32,
        bytes: usize,
    ) -> Result<Vec<BatchItem>>;

    /// The keys of the labels of the jobs of a batch, sorted, the first `limit`.
    async fn batch_label_keys(&self, tenant: &str, id: Uuid, limit: u32) -> Result<Vec<String>>;

    /// One page of the acknowledged batches of a tenant with their counts, newest first, from the first one older than `after`.
    async fn batches(
        &self,
        tenant: &str,
        filter: &Filter,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Page<Batch>>;

    /// An acknowledged batch or run with its counts.
    async fn batch(&self, tenant: &str, kind: Kind, id: Uuid) -> Result<Option<Batch>>;

    /// The template of an acknowledged batch that is a run, and how far its chunks are.
    async fn run(&self, tenant: &str, id: Uuid) -> Result<Option<RunRecord>>;
}

/// Reads, lists and cancels jobs for clients.
#[async_trait]
pub trait ClientJobs: Send + Sync {
    /// Cancels a queued job at once, and marks a running one as to be cancelled; an ended one stays as it is. Returns the
    /// job as it then is.
    async fn cancel(&self, tenant: &str, id: Uuid, now: i64) -> Result<Option<Job>>;

    /// Removes an ended job with all that hangs on it; its blob goes with the last reference to it.
    async fn delete(&self, tenant: &str, id: Uuid) -> Result<Deleted>;

    /// A job.
    async fn job(&self, tenant: &str, id: Uuid) -> Result<Option<Job>>;

    /// A job with its result: a small one itself, a large one by the key of its blob.
    async fn result(&self, tenant: &str, id: Uuid) -> Result<Option<(Job, Option<ResultRef>)>>;

    /// The case of a job as it was submitted.
    async fn case(&self, tenant: &str, id: Uuid) -> Result<Option<StoredCase>>;

    /// One page of the jobs of a tenant, newest first, from the first job older than `after`. It reads no more rows than it
    /// returns, up to a constant.
    async fn list(
        &self,
        tenant: &str,
        filter: &Filter,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Page<Job>>;

    /// Jobs of a tenant that changed, progress aside, in the order of the time of their last change and of their ids: those
    /// that changed later than `since`, and of those that changed at that time the ones after the job `after`, or all of them.
    async fn changes(
        &self,
        tenant: &str,
        since: i64,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Vec<Change>>;
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
    ) -> Result<ProfileKept>;

    /// A cross-section of a tenant by its digest.
    async fn profile(&self, tenant: &str, digest: &str) -> Result<Option<StoredProfile>>;

    /// One page of the cross-sections of a tenant, newest first.
    async fn profiles(
        &self,
        tenant: &str,
        after: Option<&ProfileCursor>,
        limit: u32,
    ) -> Result<Page<ProfileEntry>>;

    /// Removes a cross-section of a tenant; `false` if there was none.
    async fn delete_profile(&self, tenant: &str, digest: &str) -> Result<bool>;
}

/// Claims of queued jobs, and what workers do while they hold a lease.
#[async_trait]
pub trait Claims: Send + Sync {
    /// Queues with jobs in them, and how many.
    async fn queues(&self) -> Result<Vec<(Queue, u64)>>;

    /// Claims the first job of a queue, by priority and then by age, together with those behind it that are small
    /// enough, in their order. A suspect comes alone, and no job of a batch that is not acknowledged.
    async fn claim(&self, request: &ClaimRequest<'_>) -> Result<Vec<Claim>>;

    /// The cases of claimed jobs, with what has happened to them meanwhile.
    async fn claimed_cases(&self, ids: &[Uuid]) -> Result<HashMap<Uuid, ClaimedCase>>;

    /// Extends leases and stores progress; the answers are in the order of the claims.
    async fn renew(&self, claims: &[(&Claim, f64)], lease: Lease) -> Result<Vec<Renewal>>;

    /// Gives claimed jobs back to the queue without counting their attempts; those that the client has cancelled end.
    /// Returns those that were still held, with their new states.
    async fn release(
        &self,
        claims: &[Claim],
        why: ReleaseReason,
        now: i64,
    ) -> Result<Vec<(Uuid, State)>>;

    /// Stores a solved slice in place of what there was from its number on; `false` if the lease is lost. Attempts are
    /// counted from the last slice. The same call again changes nothing.
    async fn add_slice(&self, claim: &Claim, slice: &NewSlice) -> Result<bool>;

    /// The stored slices of a job in their order. Whatever ends a job removes its slices.
    async fn slices(&self, id: Uuid) -> Result<Vec<SliceRecord>>;

    /// The parts of the answer that the slices of a job are, in their order.
    async fn slice_results(&self, id: Uuid) -> Result<Vec<StoredResult>>;
}

/// Ends of claimed jobs.
#[async_trait]
pub trait Ends: Send + Sync {
    /// Ends claimed jobs, all in one transaction; returns those that ended. Of the others the lease is lost, or the source
    /// of their cached result has gone.
    async fn finish(&self, ends: &[(Claim, Ending)], now: i64) -> Result<HashSet<Uuid>>;

    /// For each of these keys that a succeeded job carries, one such job.
    async fn cached(&self, keys: &[CacheKey]) -> Result<HashMap<CacheKey, Uuid>>;
}

/// Takes jobs from workers that no longer answer, removes what has expired, and counts what there is.
#[async_trait]
pub trait Upkeep: Send + Sync {
    /// Takes running jobs from their workers: to `cancelled` if the client asked for that, to `failed` if `attempts_max` are
    /// used up, else back to the queue. An attempt counts only for a job that was solved alone; the others come alone
    /// next time. Returns them with their new states.
    async fn reap(&self, which: Reap, now: i64, attempts_max: u32) -> Result<Vec<(Uuid, State)>>;

    /// Ends some of the queued jobs whose deadline has passed with this failure, and names the running ones. To be called
    /// again until it ends none.
    async fn pass_deadlines(&self, failure: &Failure, moment: Moment) -> Result<Overdue>;

    /// Removes expired jobs and leaves tombstones, removes empty batches of that age, and old tombstones. Returns the number
    /// of jobs removed.
    async fn expire(&self, rule: RetentionRule) -> Result<u64>;

    /// Was there a job or a batch of this tenant that has expired?
    async fn has_expired(&self, tenant: &str, id: Uuid) -> Result<bool>;

    /// What a tenant has; the bytes that its unfinished batches stand for are not known here.
    async fn usage(&self, tenant: &str) -> Result<Usage>;

    /// Counts and sizes, read from indices alone.
    async fn stats(&self) -> Result<Stats>;

    /// Counts the jobs of the same tenant that come before a queued job, at most `limit` of them.
    async fn queued_before(&self, job: &Job, limit: u32) -> Result<QueueAhead>;
}

/// Keys of large results.
#[async_trait]
pub trait ResultKeys: Send + Sync {
    /// Keys of large results that nobody refers to any more, at most `limit`; those in `done` are forgotten first.
    async fn released_blobs(&self, done: &[String], limit: u32) -> Result<Vec<String>>;

    /// Leaves a large result that was written and that no job will refer to, to be removed.
    async fn abandon_blob(&self, key: &str) -> Result<()>;

    /// The keys of those of these large results that no job refers to. The results of a running job are left out: this attempt may have
    /// written them and refer to them when it ends.
    async fn orphans(&self, results: &[(Uuid, String)]) -> Result<Vec<String>>;
}

/// API keys.
#[async_trait]
pub trait KeyStore: Send + Sync {
    /// Stores a key. It fails if there is one with the same id.
    async fn add_key(&self, key: &Key) -> Result<()>;

    /// A key by its id.
    async fn key(&self, id: &str) -> Result<Option<Key>>;

    /// All keys, oldest first, with the revoked ones.
    async fn keys(&self) -> Result<Vec<Key>>;

    /// Revokes a key; `None` if there is none. A key that was revoked before keeps its time.
    async fn revoke_key(&self, id: &str, now: i64) -> Result<Option<Key>>;
}

/// The right to work on a job, until the lease runs out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Claim {
    /// The job.
    pub id: Uuid,
    /// Attempts counted so far, this one included.
    pub attempt: u32,
    /// The fencing token: random, the same for all jobs that were claimed together.
    pub lease_token: u64,
    /// The requested method.
    pub method: String,
    /// W3C trace context of its submission, if its trace is collected.
    pub traceparent: Option<String>,
    /// The key of identical cases in the result cache; `None` for a job that must be solved.
    pub cache_key: Option<CacheKey>,
    /// It ran together with others when their process died: it comes alone.
    pub suspect: bool,
    /// Slices that are solved and stored.
    pub slices: u32,
}

/// How long a job is a worker's from now on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lease {
    /// The present by the steady clock of this process, in ms. A store that several processes share has a clock of its own
    /// and takes that one.
    pub now: i64,
    /// Length in ms.
    pub ms: i64,
}

/// Which of the queued jobs a worker asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClaimKind {
    /// Those of which nothing is solved.
    New,
    /// One of which some slices are solved.
    Begun,
}

/// What a worker asks for.
#[derive(Debug, Clone, Copy)]
pub struct ClaimRequest<'a> {
    /// Name of the worker.
    pub worker: &'a str,
    /// The queue whose turn it is.
    pub queue: &'a Queue,
    /// Which of its jobs.
    pub kind: ClaimKind,
    /// Most jobs; of begun ones there is one.
    pub jobs: usize,
    /// Largest sum of the expected solve times in µs; one job may be above it.
    pub cost_us: u64,
    /// Largest expected solve time of one slice of each job in µs, if there is such a bound.
    pub each_slice_us: Option<u64>,
    /// Also jobs that may have killed a process.
    pub suspects: bool,
    /// Jobs in the queue, when that was asked last.
    pub waiting: u64,
    /// The lease that begins.
    pub lease: Lease,
    /// The present, epoch milliseconds.
    pub now: i64,
    /// Jobs with a deadline before this time are left to whoever ends them.
    pub late_before: i64,
}

/// Why jobs go back to the queue; none of these counts as an attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReleaseReason {
    /// They were not begun, they had their slice, or the service stops.
    NotBegun,
    /// They were to share an answer that did not come: solved next time.
    SolveItself,
    /// A slice of them takes longer than was thought, at least this long.
    Long {
        /// Its expected solve time from now on, in µs.
        slice_us: u64,
    },
}

/// The answer to a heartbeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Renewal {
    /// The lease is extended.
    Held {
        /// The client asked to cancel.
        cancel_requested: bool,
    },
    /// The job was given away or has ended: stop and discard.
    Lost,
}

/// Which running jobs are taken from their workers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reap {
    /// Those whose lease has run out.
    Expired {
        /// The present, as [`Lease::now`].
        now: i64,
    },
    /// All of them: the one process that runs jobs of this table has died.
    Dead,
}

/// What comes before a queued job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QueueAhead {
    /// Jobs of its tenant.
    pub jobs: u64,
    /// Their expected solve time in µs.
    pub cost_us: u64,
    /// Tenants with queued jobs, its own included.
    pub tenants: usize,
}

/// A hint to other processes that something happened. A process that misses one finds out by polling, a little later.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Notification {
    /// There is something to be claimed.
    Work,
    /// This job has ended.
    Ended(Uuid),
    /// This job is to be cancelled; its worker does so.
    Cancel(Uuid),
}

/// Where nodes receive each other's notifications. What is missed is found by polling, up to a second later.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum NotifyMode {
    /// At the URL of the database.
    #[default]
    Database,
    /// At another URL of the same database: a pooler that gives each transaction another session passes none on.
    Direct(String),
    /// Nowhere.
    Off,
}

/// A node as it shows itself to the others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Node {
    /// Random, new with every start.
    pub id: Uuid,
    /// Jobs that it solves at the same time.
    pub workers: usize,
}

/// What a node learns when it shows itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClusterView {
    /// Nodes that have shown themselves lately.
    pub nodes: usize,
    /// Their workers.
    pub workers: usize,
}

/// Identity of a database, location of its large results, and number of its live nodes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Deployment {
    /// Random, given when the tables were made.
    pub id: String,
    /// URL of the place of large results; empty: they are in the database; `None`: not decided.
    pub results_place: Option<String>,
    /// There are large results.
    pub has_results: bool,
    /// Nodes that have shown themselves lately.
    pub nodes: u64,
}

impl Deployment {
    /// The place of the results can no longer be changed.
    #[must_use]
    pub fn in_use(&self) -> bool {
        self.results_place.is_some() && (self.has_results || self.nodes > 0)
    }
}

/// Calls of a store that several processes use at once.
#[async_trait]
pub trait Cluster: Send + Sync + Debug {
    /// The clock of the store, epoch milliseconds.
    async fn now(&self) -> Result<i64>;

    /// Records that a node is alive and returns its view of the cluster.
    async fn beat(&self, node: &Node) -> Result<ClusterView>;

    /// The node is no more.
    async fn leave(&self, node: Uuid) -> Result<()>;

    /// Those of these running jobs that are to be cancelled.
    async fn cancel_requests(&self, running: &[Uuid]) -> Result<Vec<Uuid>>;

    /// Shows that these batches are still received or filled. A batch of which nobody has shown that for a minute is
    /// [unfinished](crate::store::Batches::unfinished_batches).
    async fn keep_batches(&self, batches: &[Uuid]) -> Result<()>;

    /// Removes large results that were written long ago and that no job refers to: what a node left that was killed between the
    /// two. Returns their number.
    async fn sweep_objects(&self) -> Result<u64>;

    /// Brings what the database counts into a short form.
    async fn fold_counts(&self) -> Result<()>;

    /// Identity of the database, location of its large results, and number of its live nodes.
    async fn deployment(&self) -> Result<Deployment>;

    /// Replaces the recorded location of the results if it is still the expected one; returns whether it was.
    async fn place_results(&self, before: Option<&str>, place: &str) -> Result<bool>;

    /// Claims the daily sweep of results outside the database; returns whether the claim succeeded.
    async fn take_sweep(&self) -> Result<bool>;

    /// Where large results are kept that are in the database.
    fn objects(&self) -> Arc<dyn ObjectStore>;

    /// Queues a notification, which is sent together with others. Never blocks.
    fn publish(&self, notification: Notification);

    /// Listens to the notifications of all nodes until the connection fails; for ever with [`NotifyMode::Off`].
    async fn listen(&self, heard: &(dyn Fn(Notification) + Send + Sync)) -> Result<()>;
}

/// A solved slice about to be stored.
#[derive(Debug, Clone, PartialEq)]
pub struct NewSlice {
    /// What is known of it.
    pub note: SliceRecord,
    /// Its part of the answer.
    pub result: StoredResult,
    /// Part of the job that is done with it, 0 to 1.
    pub done: f64,
    /// Expected solve time of the rest in µs.
    pub rest_us: u64,
}

/// How an attempt ends.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// The result is stored.
    Succeeded {
        /// Remarks of the solution.
        remarks: Vec<RemarkEntry>,
        /// Where the result is kept.
        result: StoredResult,
        /// Patches with stored fields.
        field_patches: u32,
    },
    /// There is no answer.
    Failed {
        /// Why.
        failure: Failure,
        /// Remarks of the check, which may explain the failure.
        remarks: Vec<RemarkEntry>,
    },
    /// The client no longer wanted it.
    Cancelled,
    /// It gets the result of this succeeded job; the attempt does not count.
    Cached {
        /// Whose result it gets.
        source: Uuid,
    },
}

impl Ending {
    /// The state of the job that ended so.
    #[must_use]
    pub fn state(&self) -> State {
        match self {
            Ending::Succeeded { .. } | Ending::Cached { .. } => State::Succeeded,
            Ending::Failed { .. } => State::Failed,
            Ending::Cancelled => State::Cancelled,
        }
    }
}

/// Where a result is kept once its job has ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StoredResult {
    /// Under this key, where it already lies, with its size in bytes.
    Blob(String, u64),
    /// In the database, written together with the end of the job: a small one.
    Inline(EncodedResult),
}

impl StoredResult {
    /// A small result as the database has it.
    pub(crate) fn inline(solution: Vec<u8>, fields: Option<Vec<u8>>) -> StoredResult {
        StoredResult::Inline(EncodedResult {
            solution: solution.into(),
            fields: fields.map(Bytes::from),
        })
    }

    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        match self {
            StoredResult::Blob(_, bytes) => *bytes,
            StoredResult::Inline(result) => result.bytes() as u64,
        }
    }
}

/// A result with what is needed to show it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResultRef {
    /// Where it is, or itself.
    pub result: StoredResult,
    /// Patches with stored fields; 0 if there is no fields object.
    pub field_patches: usize,
    /// The outputs the case asks for, as the JSON list of their names.
    pub outputs: String,
}

/// What is known of a stored slice of a sweep.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SliceRecord {
    /// Place among the slices of the case, from 0.
    pub number: u32,
    /// Motions of the case up to its end.
    pub motions: u32,
    /// Digest of the case as the solver that solved it knew it; of another digest it is of no use.
    pub digest: String,
    /// Solver time of the job up to its end.
    pub spent: Duration,
}

/// Where the jobs of a list belong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Membership {
    /// To this batch.
    Batch(Uuid),
    /// To no batch: each was submitted alone.
    Alone,
}

/// Which work of a kind to list; everything left out does not restrict. Lists of batches and runs know no states, memberships and times of
/// changes.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Filter {
    /// The kind of the work.
    pub kind: Kind,
    /// Only jobs in one of these states; any if there is none.
    pub states: Vec<State>,
    /// Only jobs of one batch, or of none.
    pub member: Option<Membership>,
    /// Only work that carry each of these labels with its value.
    pub labels: Vec<(String, String)>,
    /// Only work whose name contains this text; ASCII letters match in either case.
    pub name: Option<String>,
    /// Only work submitted at or after this time (epoch milliseconds).
    pub created_after: Option<i64>,
    /// Only work submitted before this time (epoch milliseconds). Together with `created_after`: a half-open window.
    pub created_before: Option<i64>,
    /// Only jobs that changed at or after this time (epoch milliseconds), progress aside.
    pub updated_after: Option<i64>,
}

/// One page of a list. It may have fewer entries than asked for although more follow: where many have to be looked at to find
/// some, a page ends after a bounded number of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Page<T> {
    /// The entries, newest first.
    pub entries: Vec<T>,
    /// Where the next page begins; absent on the last page.
    pub next_cursor: Option<String>,
    /// Number of entries of the whole list.
    pub total: Total,
}

impl<T> Page<T> {
    /// The same page with other entries.
    #[must_use]
    pub fn map<U>(self, entry: impl FnMut(T) -> U) -> Page<U> {
        Page {
            entries: self.entries.into_iter().map(entry).collect(),
            next_cursor: self.next_cursor,
            total: self.total,
        }
    }
}

/// Number of entries of a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Total {
    /// So many.
    Exactly(u64),
    /// So many were counted, there may be more.
    AtLeast(u64),
}

/// A job that changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// The job.
    pub id: Uuid,
    /// Its batch.
    pub batch: Option<Uuid>,
    /// [`Kind::Case`], or [`Kind::Rows`] for a chunk of a run.
    pub kind: Kind,
    /// When, epoch milliseconds.
    pub at: i64,
}

impl Filter {
    /// All work of a kind.
    #[must_use]
    pub fn of(kind: Kind) -> Filter {
        Filter {
            kind,
            ..Filter::default()
        }
    }

    /// The cursor that continues this list after the entry `last`: 40 characters of `[0-9a-f]`.
    #[must_use]
    pub fn cursor_after(&self, last: Uuid) -> String {
        format!("{}{}", last.simple(), self.digest())
    }

    /// The entry after which `text` continues; `None` if it is not a cursor of this very filter.
    #[must_use]
    pub fn read_cursor(&self, text: &str) -> Option<Uuid> {
        let (id, digest) = text.split_at_checked(32)?;
        if digest != self.digest() {
            return None;
        }
        let read = Uuid::try_parse(id).ok()?;
        // Only our own spelling is a cursor: the parser would also take capital letters.
        (read.simple().to_string() == id).then_some(read)
    }

    /// Whether jobs themselves have to be read, because no index knows all that is asked for.
    pub(crate) fn reads_jobs(&self) -> bool {
        self.labels.len() > 1
            || self.name.is_some()
            || self.updated_after.is_some()
            || (self.alone() && !self.labels.is_empty())
    }

    /// Whether only jobs of no batch are listed.
    pub(crate) fn alone(&self) -> bool {
        self.member == Some(Membership::Alone)
    }

    /// The batch whose jobs are listed.
    pub(crate) fn batch(&self) -> Option<Uuid> {
        match self.member {
            Some(Membership::Batch(id)) => Some(id),
            Some(Membership::Alone) | None => None,
        }
    }

    /// Smallest id a job of the filter can have: UUIDv7 begins with 48 bits of milliseconds.
    pub(crate) fn id_from(&self) -> Option<Uuid> {
        self.created_after.map(first_id_at)
    }

    /// Smallest id that is too young for the filter.
    pub(crate) fn id_before(&self) -> Option<Uuid> {
        self.created_before.map(first_id_at)
    }

    /// Eight hexadecimal digits of a digest of the filter.
    fn digest(&self) -> String {
        // Quotes say where a text ends.
        let digest = blake3::hash(format!("{self:?}").as_bytes());
        digest.to_hex()[..8].to_owned()
    }
}

/// The smallest UUID whose leading 48 bits are the given time; times outside 48 bits are clamped.
pub(crate) fn first_id_at(epoch_ms: i64) -> Uuid {
    let millis = u128::try_from(epoch_ms.clamp(0, (1 << 48) - 1)).unwrap_or(0);
    Uuid::from_u128(millis << 80)
}

/// A kept cross-section.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredProfile {
    /// Digest of its JSON value, 64 hexadecimal digits.
    pub digest: String,
    /// Its JSON text.
    pub body: Bytes,
    /// When it was first sent, epoch milliseconds.
    pub created_at: i64,
}

/// What became of a cross-section that was to be kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ProfileKept {
    /// It is kept.
    Added,
    /// It was kept already.
    Existing(StoredProfile),
    /// There is no room for it.
    Full,
}

/// The entry of a stored cross-section in a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProfileEntry {
    /// Its digest.
    pub digest: String,
    /// Its size.
    pub bytes: u64,
    /// When it was first sent, epoch milliseconds.
    pub created_at: i64,
}

/// The last entry of a page: its time in ms and the first digits of its digest. As text 40 characters of `[0-9a-f]`, as the cursors of other lists.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProfileCursor(pub i64, pub String);

impl ProfileCursor {
    /// The cursor behind this entry.
    #[must_use]
    pub fn after(entry: &ProfileEntry) -> ProfileCursor {
        let digits = entry.digest.chars().take(28);
        ProfileCursor(entry.created_at, digits.collect())
    }

    /// The cursor that a text is.
    #[must_use]
    pub fn read(text: &str) -> Option<ProfileCursor> {
        let (time, digest) = text.split_at_checked(12)?;
        let time = i64::from_str_radix(time, 16).ok()?;
        let cursor = ProfileCursor(time, digest.to_owned());
        (digest.len() == 28 && cursor.to_string() == text).then_some(cursor)
    }
}

impl std::fmt::Display for ProfileCursor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:012x}{}", self.0, self.1)
    }
}

/// The answer to a call that deletes a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Deleted {
    /// The row and all that hung on it are gone.
    Done,
    /// It has not ended.
    NotEnded(State),
    /// There was none.
    NotFound,
}

/// The present, and what became of the clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moment {
    /// Epoch milliseconds.
    pub now: i64,
    /// What was submitted before this time is judged by the next.
    pub set_at: i64,
    /// The present of a clock that was not set.
    pub unset: i64,
}

/// What is to be removed. Times are epoch milliseconds.
#[derive(Debug, Clone, Copy)]
pub struct RetentionRule {
    /// The present.
    pub now: i64,
    /// Jobs that ended at this time or before have expired.
    pub ended_before: i64,
    /// Ids of what was removed at this time or before are forgotten.
    pub forget_before: i64,
    /// Most jobs to remove.
    pub jobs: u32,
}

/// Statistics of a job table.
#[derive(Debug, Clone, PartialEq)]
pub struct Stats {
    /// Number of jobs in each state; every state is there.
    pub jobs: BTreeMap<State, u64>,
    /// Time of submission of the oldest queued job, epoch milliseconds.
    pub oldest_queued_at: Option<i64>,
    /// Mean expected solve time of queued jobs in µs; of a long queue, of some of them.
    pub mean_cost_us: f64,
    /// Size of the database file and its write-ahead log.
    pub database_bytes: u64,
    /// Size of the results outside the table.
    pub result_bytes: u64,
}

/// What a tenant has in a job table.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Usage {
    /// Number of jobs and of chunks of runs in each state; a state may be missing.
    pub jobs: BTreeMap<State, u64>,
    /// Places in the queue that are reserved for batches that are being received.
    pub reserved: u64,
    /// Bytes that these stand for.
    pub staged_bytes: u64,
    /// Bytes of cases, templates and results that are stored.
    pub stored_bytes: u64,
}

/// Jobs whose deadline has passed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Overdue {
    /// Those that were queued and have been ended.
    pub ended: Vec<Uuid>,
    /// Those that are running.
    pub running: Vec<Uuid>,
}

/// Equal for cases of one tenant that have the same answer.
pub type CacheKey = [u8; 16];

/// A job about to be queued. One of a batch is written to a file while the batch arrives, with what is known of it by then.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct NewJob {
    /// UUIDv7.
    #[serde(skip)]
    pub id: Uuid,
    /// Whose it is.
    #[serde(skip)]
    pub tenant: Arc<str>,
    /// [`Kind::Case`], or [`Kind::Rows`] for a chunk of a run.
    #[serde(skip)]
    pub kind: Kind,
    /// Time of submission.
    #[serde(skip)]
    pub created_at: i64,
    /// Free text given by the client.
    pub name: Option<String>,
    /// Labels of the client.
    pub labels: BTreeMap<String, String>,
    /// The method asked for, for the logs.
    pub method: String,
    /// The case as submitted, as JSON text; of a row of a table what it puts into the template of its batch.
    #[serde(skip)]
    pub body: Bytes,
    /// It is such a row.
    pub row: bool,
    /// The outputs the case asks for, as the JSON list of their names.
    pub outputs: String,
    /// Expected solve time in µs; small jobs are claimed in groups.
    pub cost_us: u32,
    /// That of its longest slice.
    pub slice_us: u32,
    /// The key under which later identical cases find the result of this job.
    pub cache_key: Option<CacheKey>,
    /// A succeeded job whose result this one gets, instead of being queued, and the time at which it ends so.
    #[serde(skip)]
    pub source: Option<(Uuid, i64)>,
    /// The client's idempotency key with the digest of case and options; not used inside a batch.
    #[serde(skip)]
    pub idempotency: Option<(String, [u8; 32])>,
    /// W3C trace context of its submission, if its trace is collected.
    #[serde(skip)]
    pub traceparent: Option<Arc<str>>,
    /// Options of the submission.
    #[serde(skip)]
    pub options: SubmitOptions,
}

impl NewJob {
    /// When the job must have ended.
    #[must_use]
    pub fn deadline(&self) -> Option<i64> {
        let within = i64::try_from(self.options.ends_within?.as_millis()).unwrap_or(i64::MAX);
        Some(self.created_at.saturating_add(within))
    }
}

/// Bounds of the queue: of queued jobs together with the places reserved for batches that are being filled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QueueBounds {
    /// Of all tenants.
    pub all: u64,
    /// Of one tenant, the chunks of its runs included.
    pub tenant: u64,
    /// Bytes that one tenant may have stored, if they are bounded.
    pub stored: Option<u64>,
}

impl QueueBounds {
    /// No bound.
    pub const NONE: QueueBounds = QueueBounds {
        all: u64::MAX,
        tenant: u64::MAX,
        stored: None,
    };
}

/// Which bound is reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// That of the tenant.
    Quota,
    /// That of the queue.
    Queue,
    /// That of the bytes that the tenant has stored.
    Stored,
}

/// A batch about to be filled.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewBatch {
    /// UUIDv7; that of its reservation, if it has one.
    pub id: Uuid,
    /// Whose it is.
    pub tenant: Arc<str>,
    /// [`Kind::Cases`] or [`Kind::Rows`].
    pub kind: Kind,
    /// Time of submission.
    pub created_at: i64,
    /// Number of jobs it will have.
    pub count: u32,
    /// Number of cases that were refused.
    pub rejected: u32,
    /// Free text given by the client.
    pub name: Option<String>,
    /// Labels of the client.
    pub labels: BTreeMap<String, String>,
    /// The case that its rows fill, if it is a table.
    pub template: Option<Bytes>,
    /// Of a run: its own part of what its chunks share.
    pub head: Option<Bytes>,
    /// Bytes of its cases as they will be stored.
    pub bytes: u64,
    /// The client's idempotency key with the digest of all cases and options.
    pub idempotency: Option<(String, [u8; 32])>,
}

/// Whether this process receives or fills a batch at the moment of the call. It is called within the transaction that decides what an
/// idempotency key stands for: a batch that began while the transaction waited for the writer counts too.
pub type FilledHere<'a> = &'a (dyn Fn(Uuid) -> bool + Sync);

/// What became of an attempt to begin a batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BatchBegun {
    /// The batch can be filled.
    Created,
    /// The idempotency key already stands for this batch, with the same cases.
    Existing(Uuid),
    /// The idempotency key stands for a batch that is being filled at this moment.
    Unfinished,
    /// The idempotency key already stands for other cases or options.
    Conflict,
    /// There is no room; nothing was stored.
    Refused(Refusal),
}

/// What became of an attempt to queue a job.
#[derive(Debug, Clone, PartialEq)]
pub enum Enqueued {
    /// The job is queued, or has ended with the result of its source.
    Created(Job),
    /// The idempotency key already stands for this job, with the same case.
    Existing(Job),
    /// The idempotency key already stands for another case, or for other options.
    Conflict,
    /// There is no room; nothing was stored.
    Refused(Refusal),
}

/// The case of a claimed job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ClaimedCase {
    /// The case.
    pub case: StoredCase,
    /// The client asked to cancel the job.
    pub cancel_requested: bool,
    /// A succeeded job with the same answer, if the job may end with that.
    pub source: Option<Uuid>,
}

/// A case as it is stored.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredCase {
    /// [`Kind::Case`], or [`Kind::Rows`] for a chunk of a run.
    pub kind: Kind,
    /// The case that the body fills; none if the body is the case.
    pub template: Option<Bytes>,
    /// Of a chunk of a run: the run's own part of what its chunks share.
    pub head: Option<Bytes>,
    /// JSON text.
    pub body: Bytes,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cursor_leads_back_to_its_job_and_to_no_other_filter() {
        let filter = Filter {
            states: vec![State::Queued],
            ..Filter::default()
        };
        let id = Uuid::now_v7();
        let cursor = filter.cursor_after(id);
        assert!(cursor.chars().all(|c| c.is_ascii_alphanumeric()));
        assert_eq!(filter.read_cursor(&cursor), Some(id));
        assert_eq!(Filter::default().read_cursor(&cursor), None);
        for wrong in [
            "",
            "é",
            &cursor[1..],
            &cursor.to_uppercase(),
            &format!("{cursor}0"),
        ] {
            assert_eq!(filter.read_cursor(wrong), None, "{wrong:?}");
        }
    }

    #[test]
    fn parts_of_a_filter_do_not_run_into_each_other() {
        let with = |key: &str, value: &str| Filter {
            labels: vec![(key.to_owned(), value.to_owned())],
            ..Filter::default()
        };
        assert_ne!(with("ab", "c").digest(), with("a", "bc").digest());
    }

    #[test]
    fn the_first_id_of_a_millisecond_is_not_above_any_id_of_it() {
        let id = Uuid::now_v7();
        let time = i64::try_from(id.as_u128() >> 80).unwrap();
        assert!(first_id_at(time) <= id && id < first_id_at(time + 1));
        assert!(first_id_at(-5) <= id && id < first_id_at(i64::MAX));
    }
}
