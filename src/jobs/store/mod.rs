//! The job table: [`Store`] and the data types of its calls. Each database has a folder with an implementation.
//!
//! Guarantees of every call:
//!
//! - It is one transaction: if it fails, nothing changed. A successful write survives the death of the process, and all writes
//!   but claims survive a power cut.
//! - A call for a tenant names the tenant in its statement. Objects of another tenant are treated as missing.
//! - The current time is an argument (epoch milliseconds), so that tests need no clock. Leases are measured with a steady
//!   clock, which is never set.
//! - A write after a claim contains the fencing token of the claim ([`Claim::lease_token`]). If the job was taken away or
//!   has ended, the write changes nothing and reports that. Tokens are random, so that a database restored from a backup
//!   issues none twice.
//! - States change only as [`State::may_become`] allows.
//! - Work on many rows is limited per call, so that other writers are not blocked.
//! - Errors are [`StoreError`], classified by what the caller can do.
//!
//! `tests/service/store*.rs` test these guarantees for every store.
use std::collections::BTreeMap;
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
use crate::model::{Failure, Job, Kind, Queue, State, SubmitOptions};
use railhead_contact::remark::entry::RemarkEntry;

/// Runs a statement on a connection with a value for each parameter. The first argument is the method that fetches the
/// rows; `scalar` before it reads rows of one column, and `built` runs a statement that is a `String`.
macro_rules! sql {
    ($take:ident, $connection:expr, $text:expr $(; $($value:expr),+)?) => {
        query($text)$($(.bind($value))+)?.$take($connection).await
    };
    (built $take:ident, $connection:expr, $text:expr $(; $($value:expr),+)?) => {
        built($text)$($(.bind($value))+)?.$take($connection).await
    };
    (scalar $take:ident, $connection:expr, $text:expr $(; $($value:expr),+)?) => {
        query_scalar($text)$($(.bind($value))+)?.$take($connection).await
    };
}

/// Binds the next parameters of a statement.
macro_rules! bind {
    ($query:ident; $($value:expr),+) => {
        $query = $query$(.bind($value))+
    };
}

/// Defines macros for parts of the shared statements, which expand to a literal.
macro_rules! words {
    ($($(#[doc = $about:literal])+ $name:ident = $text:expr;)*) => {
        $($(#[doc = $about])+ macro_rules! $name { () => { $text } })*
    };
}

pub mod open;
#[cfg(feature = "cluster")]
pub mod postgres;
mod sql_errors;
pub mod sqlite;

pub use sqlite::sql::{
    batches::Batches, blobs::ResultKeys, claim::Claims, finish::Ends, jobs::ClientJobs,
    keys::KeyStore, keys::Profiles, submit::SubmitJobs, upkeep::Upkeep,
};

/// The result of a call of a store; a failed call changes nothing.
pub type Result<T, E = StoreError> = std::result::Result<T, E>;

/// A job table, which also stores API keys and profiles.
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
    /// Makes a round trip; with `write` the round trip includes a write without effect.
    async fn ready(&self, write: bool) -> Result<()>;

    /// The additional calls of a store that several processes may share.
    fn cluster(&self) -> Option<&dyn Cluster>;

    /// Closes every connection. Later calls fail.
    async fn close(&self);

    /// Returns up to `step` free pages to the file system if there are more than `spare`; returns whether it did.
    async fn compact(&self, spare: i64, step: u32) -> Result<bool>;
}

/// A claimed job with the fencing token of its lease.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Claim {
    /// The job.
    pub id: Uuid,
    /// Number of attempts, including this one.
    pub attempt: u32,
    /// The fencing token: random, the same for all jobs of a group.
    pub lease_token: u64,
    /// The requested method.
    pub method: String,
    /// W3C trace context of the submission, if its trace is recorded.
    pub traceparent: Option<String>,
    /// Key of the result cache; `None` for a job that must be solved.
    pub cache_key: Option<CacheKey>,
    /// Whether the job ran in a group when its process crashed; it is claimed alone.
    pub suspect: bool,
    /// Number of stored slices.
    pub slices: u32,
}

/// Begin and length of a lease.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lease {
    /// The current time of the steady clock of this process, in ms. A shared store uses its own clock instead.
    pub now: i64,
    /// Length in ms.
    pub ms: i64,
}

/// Selection of queued jobs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClaimKind {
    /// Jobs without stored slices.
    New,
    /// Jobs with stored slices.
    Begun,
}

/// Arguments of a claim.
#[derive(Debug, Clone, Copy)]
pub struct ClaimRequest<'a> {
    /// Name of the worker.
    pub worker: &'a str,
    /// The queue.
    pub queue: &'a Queue,
    /// The kind of jobs to claim.
    pub kind: ClaimKind,
    /// Maximum number of jobs; begun jobs are claimed one at a time.
    pub jobs: usize,
    /// Maximum sum of the expected solve times in µs; a single job may exceed it.
    pub cost_us: u64,
    /// Maximum expected solve time of one slice of each job in µs, if bounded.
    pub each_slice_us: Option<u64>,
    /// Whether to include suspects.
    pub suspects: bool,
    /// Number of jobs in the queue, as last read.
    pub waiting: u64,
    /// The lease to be granted.
    pub lease: Lease,
    /// The current time, epoch milliseconds.
    pub now: i64,
    /// Jobs with a deadline before this time are skipped.
    pub late_before: i64,
}

/// Why jobs return to the queue without counting the attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReleaseReason {
    /// They were not begun, their time slice is over, or the service stops.
    NotBegun,
    /// The result that they were to share is missing; they will be solved.
    SolveItself,
    /// A slice takes longer than expected.
    Long {
        /// New expected solve time of a slice, in µs.
        slice_us: u64,
    },
}

/// The running jobs that are taken from their workers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reap {
    /// Jobs whose lease has expired.
    Expired {
        /// The current time, as [`Lease::now`].
        now: i64,
    },
    /// All running jobs, because the only process that uses this table has crashed.
    Dead,
}

/// Jobs before a queued job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QueueAhead {
    /// Number of jobs of the same tenant.
    pub jobs: u64,
    /// Their expected solve time in µs.
    pub cost_us: u64,
    /// Number of tenants with queued jobs, including its own.
    pub tenants: usize,
}

/// A hint to other processes. A process that misses one finds the change by polling.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Notification {
    /// There is a job to claim.
    Work,
    /// This job has ended.
    Ended(Uuid),
    /// This running job was cancelled.
    Cancel(Uuid),
}

/// Source of the notifications of other nodes. Missed notifications are replaced by polling within a second.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum NotifyMode {
    /// The connection URL of the database.
    #[default]
    Database,
    /// Another URL of the same database, for example without a pooler that assigns sessions per transaction.
    Direct(String),
    /// No notifications.
    Off,
}

/// A node of a cluster.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Node {
    /// Random id, new at every start.
    pub id: Uuid,
    /// Number of workers.
    pub workers: usize,
}

/// Identity of a database, location of its large results, and number of its live nodes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Deployment {
    /// Random id, assigned when the tables were created.
    pub id: String,
    /// URL of the location of large results; empty: in the database; `None`: not determined yet.
    pub results_place: Option<String>,
    /// Whether there are large results.
    pub has_results: bool,
    /// Number of live nodes.
    pub nodes: u64,
}

impl Deployment {
    /// Whether the location of the results is fixed.
    #[must_use]
    pub fn in_use(&self) -> bool {
        self.results_place.is_some() && (self.has_results || self.nodes > 0)
    }
}

/// Calls of a store that several processes share.
#[async_trait]
pub trait Cluster: Send + Sync + Debug {
    /// The clock of the store, epoch milliseconds.
    async fn now(&self) -> Result<i64>;

    /// Records that a node is alive and returns the number of workers of all live nodes.
    async fn beat(&self, node: &Node) -> Result<usize>;

    /// Removes a node.
    async fn leave(&self, node: Uuid) -> Result<()>;

    /// Selects the jobs among `running` that were cancelled.
    async fn cancel_requests(&self, running: &[Uuid]) -> Result<Vec<Uuid>>;

    /// Records that these batches are being received or filled. Batches without such a record for a minute are
    /// [unfinished](crate::store::Batches::unfinished_batches).
    async fn keep_batches(&self, batches: &[Uuid]) -> Result<()>;

    /// Removes orphans among the large results in the database; returns their number.
    async fn sweep_objects(&self) -> Result<u64>;

    /// Sums up the counters that the database keeps as differences.
    async fn fold_counts(&self) -> Result<()>;

    /// Identity of the database, location of its large results, and number of its live nodes.
    async fn deployment(&self) -> Result<Deployment>;

    /// Replaces the recorded location of the results if it is still the expected one; returns whether it was.
    async fn place_results(&self, before: Option<&str>, place: &str) -> Result<bool>;

    /// Claims the daily sweep of results outside the database; returns whether the claim succeeded.
    async fn take_sweep(&self) -> Result<bool>;

    /// The store of large results in the database.
    fn objects(&self) -> Arc<dyn ObjectStore>;

    /// Queues a notification, which is sent together with others. Never blocks.
    fn publish(&self, notification: Notification);

    /// Receives the notifications of all nodes until the connection fails; never returns with [`NotifyMode::Off`].
    async fn listen(&self, heard: &(dyn Fn(Notification) + Send + Sync)) -> Result<()>;
}

/// A solved slice to be stored.
#[derive(Debug, Clone, PartialEq)]
pub struct NewSlice {
    /// Its record.
    pub note: SliceRecord,
    /// Its part of the result.
    pub result: StoredResult,
    /// Fraction of the job that is done with it, from 0 to 1.
    pub done: f64,
    /// Expected solve time of the remaining slices in µs.
    pub rest_us: u64,
}

/// How an attempt ends a job.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// The job has a result.
    Succeeded {
        /// Remarks of the solution.
        remarks: Vec<RemarkEntry>,
        /// The stored result.
        result: StoredResult,
        /// Number of patches with stored fields.
        field_patches: u32,
    },
    /// The job has no result.
    Failed {
        /// Reason.
        failure: Failure,
        /// Remarks of the check, which may explain the failure.
        remarks: Vec<RemarkEntry>,
    },
    /// The client cancelled the job.
    Cancelled,
    /// The job gets the result of another succeeded job; the attempt does not count.
    Cached {
        /// The other job.
        source: Uuid,
    },
}

impl Ending {
    /// The final state.
    #[must_use]
    pub fn state(&self) -> State {
        match self {
            Ending::Succeeded { .. } | Ending::Cached { .. } => State::Succeeded,
            Ending::Failed { .. } => State::Failed,
            Ending::Cancelled => State::Cancelled,
        }
    }
}

/// A stored result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StoredResult {
    /// A large result outside the table: its key, and its size in bytes.
    Blob(String, u64),
    /// A small result in the table, written together with the end of the job.
    Inline(EncodedResult),
}

impl StoredResult {
    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        match self {
            StoredResult::Blob(_, bytes) => *bytes,
            StoredResult::Inline(result) => result.bytes() as u64,
        }
    }
}

/// A result with the data needed to read it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResultRef {
    /// The result.
    pub result: StoredResult,
    /// Number of patches with stored fields; 0 without fields.
    pub field_patches: usize,
    /// The requested outputs as a JSON list of names.
    pub outputs: String,
}

/// The record of a stored slice.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SliceRecord {
    /// Index of the slice, from 0.
    pub number: u32,
    /// Number of motions of the case up to its end.
    pub motions: u32,
    /// Digest of the case and the solver revision; slices with another digest cannot be used.
    pub digest: String,
    /// Solver time of the job up to its end.
    pub spent: Duration,
}

/// Membership of listed jobs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Membership {
    /// Jobs of this batch.
    Batch(Uuid),
    /// Jobs that were submitted alone.
    Alone,
}

/// Filter of a list; absent members do not restrict. States, membership and time of change apply to jobs only.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Filter {
    /// Kind of the work.
    pub kind: Kind,
    /// States of the jobs; empty: any state.
    pub states: Vec<State>,
    /// Membership of the jobs.
    pub member: Option<Membership>,
    /// Labels that the work must carry.
    pub labels: Vec<(String, String)>,
    /// Text that the name must contain; ASCII letters match in either case.
    pub name: Option<String>,
    /// Earliest time of submission, epoch milliseconds.
    pub created_after: Option<i64>,
    /// End of the interval of submission, exclusive, epoch milliseconds.
    pub created_before: Option<i64>,
    /// Earliest time of the last change of a job, not counting progress, epoch milliseconds.
    pub updated_after: Option<i64>,
}

/// One page of a list. It may have fewer entries than requested although more follow, because the number of rows examined
/// per page is bounded.
#[derive(Debug, Clone, PartialEq)]
pub struct Page<T> {
    /// The entries, newest first.
    pub entries: Vec<T>,
    /// Cursor of the next page; `None` on the last page.
    pub next_cursor: Option<String>,
    /// Number of entries of the whole list.
    pub total: Total,
}

impl<T> Page<T> {
    /// Converts the entries.
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
    /// The exact number.
    Exactly(u64),
    /// A lower bound.
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
    /// Time of the change, epoch milliseconds.
    pub at: i64,
}

impl Filter {
    /// A filter for all work of a kind.
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

    /// The entry after which a cursor continues; `None` if `text` is no cursor of this filter.
    #[must_use]
    pub fn read_cursor(&self, text: &str) -> Option<Uuid> {
        let (id, digest) = text.split_at_checked(32)?;
        if digest != self.digest() {
            return None;
        }
        let read = Uuid::try_parse(id).ok()?;
        // The parser also accepts upper case, which is no cursor.
        (read.simple().to_string() == id).then_some(read)
    }

    /// Whether rows of jobs have to be read because no index covers the filter.
    pub(crate) fn reads_jobs(&self) -> bool {
        self.labels.len() > 1
            || self.name.is_some()
            || self.updated_after.is_some()
            || (self.alone() && !self.labels.is_empty())
    }

    /// Whether only jobs without a batch are listed.
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

    /// Smallest possible id of an entry: UUIDv7 begins with 48 bits of milliseconds.
    pub(crate) fn first_id(&self) -> String {
        first_id_at(self.created_after.unwrap_or(0)).to_string()
    }

    /// Greatest possible id of an entry that follows the entry `after` in the list.
    pub(crate) fn last_id(&self, after: Option<Uuid>) -> String {
        let before = self
            .created_before
            .map(first_id_at)
            .into_iter()
            .chain(after)
            .min();
        let last = |before: Uuid| Uuid::from_u128(before.as_u128().saturating_sub(1));
        before.map_or(Uuid::max(), last).to_string()
    }

    /// The text that the name must contain, in lower case.
    pub(crate) fn lower_name(&self) -> Option<String> {
        self.name.as_ref().map(|name| name.to_ascii_lowercase())
    }

    /// Eight hexadecimal digits of a digest of the filter.
    fn digest(&self) -> String {
        // Quotes separate the texts.
        let digest = blake3::hash(format!("{self:?}").as_bytes());
        digest.to_hex()[..8].to_owned()
    }
}

/// The smallest UUID whose leading 48 bits are the given time; times outside 48 bits are clamped.
pub(crate) fn first_id_at(epoch_ms: i64) -> Uuid {
    let millis = u128::try_from(epoch_ms.clamp(0, (1 << 48) - 1)).unwrap_or(0);
    Uuid::from_u128(millis << 80)
}

/// A stored profile.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredProfile {
    /// Digest of its JSON value, 64 hexadecimal digits.
    pub digest: String,
    /// Its JSON text.
    pub body: Bytes,
    /// Time at which it was stored, epoch milliseconds.
    pub created_at: i64,
}

/// Result of [`Profiles::add_profile`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ProfileKept {
    /// The profile was stored.
    Added,
    /// The profile existed.
    Existing(StoredProfile),
    /// The size limit is reached.
    Full,
}

/// The entry of a stored profile in a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProfileEntry {
    /// Its digest.
    pub digest: String,
    /// Its size in bytes.
    pub bytes: u64,
    /// Time at which it was stored, epoch milliseconds.
    pub created_at: i64,
}

/// The cursor of a list of profiles: time in ms and first digits of the digest of the last entry. Its text has 40
/// characters of `[0-9a-f]`, as other cursors.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProfileCursor(pub i64, pub String);

impl ProfileCursor {
    /// The cursor after this entry.
    #[must_use]
    pub fn after(entry: &ProfileEntry) -> ProfileCursor {
        let digits = entry.digest.chars().take(28);
        ProfileCursor(entry.created_at, digits.collect())
    }

    /// Parses a cursor.
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

/// The current time, and the last jump of the wall clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moment {
    /// The current time, epoch milliseconds.
    pub now: i64,
    /// Time of the jump; jobs submitted before it are compared with `unset`.
    pub set_at: i64,
    /// The current time without the jump.
    pub unset: i64,
}

/// Expiry of jobs. Times are epoch milliseconds.
#[derive(Debug, Clone, Copy)]
pub struct RetentionRule {
    /// The current time.
    pub now: i64,
    /// Jobs that ended at this time or before have expired.
    pub ended_before: i64,
    /// Tombstones from this time or before are removed.
    pub forget_before: i64,
    /// Maximum number of jobs to remove.
    pub jobs: u32,
}

/// Statistics of a job table.
#[derive(Debug, Clone, PartialEq)]
pub struct Stats {
    /// Number of jobs by state; contains every state.
    pub jobs: BTreeMap<State, u64>,
    /// Time of submission of the oldest queued job, epoch milliseconds.
    pub oldest_queued_at: Option<i64>,
    /// Mean expected solve time of queued jobs in µs, from a sample of a long queue.
    pub mean_cost_us: f64,
    /// Size of the database file and its write-ahead log.
    pub database_bytes: u64,
    /// Size of the results outside the table in bytes.
    pub result_bytes: u64,
}

/// Usage of a job table by a tenant.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Usage {
    /// Number of jobs and of chunks of runs by state; a state may be missing.
    pub jobs: BTreeMap<State, u64>,
    /// Number of places in the queue that are reserved for batches that are being filled.
    pub reserved: u64,
    /// Number of staged bytes of batches that are being received.
    pub staged_bytes: u64,
    /// Number of bytes of stored cases, templates and results.
    pub stored_bytes: u64,
}

/// Jobs whose deadline has passed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Overdue {
    /// Jobs that were queued and have been ended.
    pub ended: Vec<Uuid>,
    /// Jobs that are running.
    pub running: Vec<Uuid>,
}

/// Key of the result cache: equal for cases of one tenant that have the same result.
pub type CacheKey = [u8; 16];

/// A job to be queued. For a job of a batch, the members without `skip` are staged in a file.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct NewJob {
    /// UUIDv7.
    #[serde(skip)]
    pub id: Uuid,
    /// The tenant that owns the job.
    #[serde(skip)]
    pub tenant: Arc<str>,
    /// [`Kind::Case`], or [`Kind::Rows`] for a chunk of a run.
    #[serde(skip)]
    pub kind: Kind,
    /// Time of submission.
    #[serde(skip)]
    pub created_at: i64,
    /// Name given by the client.
    pub name: Option<String>,
    /// Labels given by the client.
    pub labels: BTreeMap<String, String>,
    /// The requested method, for the logs.
    pub method: String,
    /// The case as JSON text; for a row of a table, its values for the template of the batch.
    #[serde(skip)]
    pub body: Bytes,
    /// Whether the body is such a row.
    pub row: bool,
    /// The requested outputs as a JSON list of names.
    pub outputs: String,
    /// Expected solve time in µs; small jobs are claimed in groups.
    pub cost_us: u32,
    /// Expected solve time of the longest slice in µs.
    pub slice_us: u32,
    /// Key under which later identical cases find the result.
    pub cache_key: Option<CacheKey>,
    /// The idempotency key with the digest of case and options; not used in a batch.
    #[serde(skip)]
    pub idempotency: Option<(String, [u8; 32])>,
    /// W3C trace context of the submission, if its trace is recorded.
    #[serde(skip)]
    pub traceparent: Option<Arc<str>>,
    /// Options of the submission.
    #[serde(skip)]
    pub options: SubmitOptions,
}

impl NewJob {
    /// The key under which the result of an earlier job may be found.
    pub(crate) fn lookup_key(&self) -> Option<CacheKey> {
        self.cache_key.filter(|_| !self.options.bypass_cache)
    }

    /// The deadline of the job, epoch milliseconds.
    #[must_use]
    pub fn deadline(&self) -> Option<i64> {
        let within = i64::try_from(self.options.ends_within?.as_millis()).unwrap_or(i64::MAX);
        Some(self.created_at.saturating_add(within))
    }
}

/// Bounds of the queue. Reserved places of batches count as queued jobs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QueueBounds {
    /// Maximum number of queued jobs.
    pub all: u64,
    /// Maximum number of queued jobs of one tenant, including chunks of runs.
    pub tenant: u64,
    /// Maximum number of stored bytes of one tenant, if bounded.
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

/// The bound that is reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Queued jobs of the tenant.
    Quota,
    /// Queued jobs of all tenants.
    Queue,
    /// Stored bytes of the tenant.
    Stored,
}

/// A batch to be filled.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct NewBatch {
    /// UUIDv7.
    pub id: Uuid,
    /// The tenant that owns the batch.
    pub tenant: Arc<str>,
    /// [`Kind::Cases`] or [`Kind::Rows`].
    pub kind: Kind,
    /// Time of submission.
    pub created_at: i64,
    /// Number of its jobs.
    pub count: u32,
    /// Number of invalid cases that were skipped.
    pub rejected: u32,
    /// Name given by the client.
    pub name: Option<String>,
    /// Labels given by the client.
    pub labels: BTreeMap<String, String>,
    /// The template that its rows fill, if it is a table.
    pub template: Option<Bytes>,
    /// The part of the head that is specific to a run.
    pub head: Option<Bytes>,
    /// Number of bytes of its cases as stored.
    pub bytes: u64,
    /// The idempotency key with the digest of all cases and options.
    pub idempotency: Option<(String, [u8; 32])>,
}

/// Returns whether this process currently receives or fills a batch. It is called in the transaction that evaluates an
/// idempotency key, so that a batch that began while the transaction waited for the writer counts too.
pub type FilledHere<'a> = &'a (dyn Fn(Uuid) -> bool + Sync);

/// Result of [`Batches::begin_batch`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BatchBegun {
    /// The batch can be filled.
    Created,
    /// The idempotency key belongs to this batch, which has the same cases.
    Existing(Uuid),
    /// The idempotency key belongs to a batch that is being filled.
    Unfinished,
    /// The idempotency key belongs to other cases or options.
    Conflict,
    /// A bound is reached; nothing was stored.
    Refused(Refusal),
}

/// Result of [`SubmitJobs::enqueue`].
#[derive(Debug, Clone, PartialEq)]
pub enum Enqueued {
    /// The job is queued, or has ended with the result of its source.
    Created(Job),
    /// The idempotency key belongs to this job, which has the same case.
    Existing(Job),
    /// The idempotency key belongs to another case or other options.
    Conflict,
    /// A bound is reached; nothing was stored.
    Refused(Refusal),
}

/// The case of a claimed job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ClaimedCase {
    /// The case.
    pub case: StoredCase,
    /// Whether the job was cancelled.
    pub cancel_requested: bool,
    /// A succeeded job with the same cache key, if the job may end with its result.
    pub source: Option<Uuid>,
}

/// A stored case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredCase {
    /// [`Kind::Case`], or [`Kind::Rows`] for a chunk of a run.
    pub kind: Kind,
    /// The template that the body fills; `None` if the body is the case.
    pub template: Option<Bytes>,
    /// The part of the head that is specific to a run, for a chunk.
    pub head: Option<Bytes>,
    /// The case as JSON text, the values of a row, or a chunk of a run.
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
