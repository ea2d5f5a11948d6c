//! The types that the calls of a store take and return.

use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use uuid::Uuid;

use crate::contact::remark::entry::RemarkEntry;
use crate::jobs::codec::result::EncodedResult;
use crate::jobs::model::{Failure, Job, State};
use crate::jobs::submit_options::SubmitOptions;

/// Equal for cases of one tenant that have the same answer.
pub type CacheKey = [u8; 16];

/// A job about to be queued.
#[derive(Debug, Clone, PartialEq)]
pub struct NewJob {
    /// UUIDv7.
    pub id: Uuid,
    /// Whose it is.
    pub tenant: Arc<str>,
    /// Time of submission.
    pub created_at: i64,
    /// Free text of the client.
    pub name: Option<String>,
    /// Labels of the client.
    pub labels: BTreeMap<String, String>,
    /// The method asked for, for the logs.
    pub method: String,
    /// The case as submitted, as JSON text; of a row of a table what it puts into the template of its batch.
    pub body: Bytes,
    /// It is such a row.
    pub row: bool,
    /// The outputs the case asks for, as the JSON list of their names.
    pub outputs: String,
    /// Expected solve time in µs; small jobs are claimed in groups.
    pub cost_us: u32,
    /// That of its longest slice.
    pub slice_us: u32,
    /// What tells later identical cases that this job's result is theirs too.
    pub cache_key: Option<CacheKey>,
    /// A succeeded job whose result this one gets, instead of being queued, and the time at which it ends so.
    pub source: Option<(Uuid, i64)>,
    /// The client's idempotency key with the digest of case and options; not used inside a batch.
    pub idempotency: Option<(String, [u8; 32])>,
    /// W3C trace context of its submission, if its trace is collected.
    pub traceparent: Option<Arc<str>>,
    /// Options of the submission.
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
    /// Of one tenant.
    pub tenant: u64,
}

impl QueueBounds {
    /// No bound.
    pub const NONE: QueueBounds = QueueBounds {
        all: u64::MAX,
        tenant: u64::MAX,
    };
}

/// Which bound has no place left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// That of the tenant.
    Quota,
    /// That of the queue.
    Queue,
}

/// A batch about to be filled.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewBatch {
    /// UUIDv7; that of its reservation, if it has one.
    pub id: Uuid,
    /// Whose it is.
    pub tenant: Arc<str>,
    /// Time of submission.
    pub created_at: i64,
    /// Number of jobs it will have.
    pub count: u32,
    /// Number of cases that were refused.
    pub rejected: u32,
    /// The case that its rows fill, if it is a table.
    pub template: Option<Bytes>,
    /// The client's idempotency key with the digest of all cases and options.
    pub idempotency: Option<(String, [u8; 32])>,
}

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

/// A case as it is stored.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredCase {
    /// The case that the body fills; none if the body is the case.
    pub template: Option<Bytes>,
    /// JSON text.
    pub body: Bytes,
}

/// The right to work on a job, until the lease runs out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Claim {
    /// The job.
    pub id: Uuid,
    /// Attempts counted so far, this one included.
    pub attempt: u32,
    /// The fencing token: number of claims ever made of this job.
    pub lease_number: u64,
    /// The method asked for.
    pub method: String,
    /// W3C trace context of its submission, if its trace is collected.
    pub traceparent: Option<String>,
    /// What tells identical cases; `None` for a job that must be solved.
    pub cache_key: Option<CacheKey>,
    /// It ran together with others when their process died, and comes alone.
    pub suspect: bool,
    /// Slices that are solved and stored.
    pub slices: u32,
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
    /// Whose turn it is.
    pub tenant: &'a str,
    /// Which of the tenant's jobs.
    pub kind: ClaimKind,
    /// Most jobs.
    pub jobs: usize,
    /// Largest sum of the expected solve times in µs; one job may be above it.
    pub cost_us: u64,
    /// Largest expected solve time of one slice of each job in µs, if there is such a bound.
    pub each_slice_us: Option<u64>,
    /// Workers among which the queue is shared.
    pub workers: usize,
    /// End of the lease, by the clock of this process.
    pub lease_until: i64,
    /// The present, epoch milliseconds.
    pub now: i64,
    /// Jobs with a deadline before this time are left to whoever ends them.
    pub late_before: i64,
    /// Batches whose jobs are left alone.
    pub skip: &'a HashSet<Uuid>,
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
    Failed(Failure),
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
            Ending::Failed(_) => State::Failed,
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
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stats {
    /// Number of jobs in each state; every state is there.
    pub jobs: BTreeMap<State, u64>,
    /// Time of submission of the oldest queued job, epoch milliseconds.
    pub oldest_queued_at: Option<i64>,
    /// Size of the database file and its write-ahead log.
    pub database_bytes: u64,
    /// Size of the results outside the table.
    pub result_bytes: u64,
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

/// Which running jobs are taken from their workers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reap {
    /// Those whose lease ended at or before this time.
    Expired {
        /// By the clock that leases are measured with.
        lease_until: i64,
    },
    /// All of them: the one process that runs jobs of this table has died.
    Dead,
}

/// Jobs whose deadline has passed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Overdue {
    /// Those that were queued and have been ended.
    pub ended: Vec<Uuid>,
    /// Those that are running.
    pub running: Vec<Uuid>,
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
