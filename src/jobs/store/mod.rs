//! What a job table must promise: the words its calls are made of. One database is one file here.
//!
//! Every call takes the current time as an argument (epoch milliseconds), so that tests need no clock. Every write
//! after a claim names the claim's lease number; a write whose lease number is no longer the job's changes nothing
//! and says so. The lease number only grows, also when an attempt is handed back uncounted.

pub mod list;
pub mod sqlite;

use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;

use bytes::Bytes;
use uuid::Uuid;

use crate::contact::remark::entry::RemarkEntry;
use crate::jobs::job::{Failure, Job, State};
use crate::jobs::results::Encoded;
use crate::jobs::sweep::SliceNote;
use crate::jobs::wishes::Wishes;

/// Equal for cases of one tenant that have the same answer.
pub type ReuseKey = [u8; 16];

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
    pub reuse_key: Option<ReuseKey>,
    /// A succeeded job whose result this one gets, instead of being queued, and the time at which it ends so.
    pub source: Option<(Uuid, i64)>,
    /// The client's idempotency key with the digest of case and options; not used inside a batch.
    pub idempotency: Option<(String, [u8; 32])>,
    /// W3C trace context of its submission, if its trace is collected.
    pub traceparent: Option<Arc<str>>,
    /// What else the client wishes.
    pub wishes: Wishes,
}

impl NewJob {
    /// When the job must have ended.
    #[must_use]
    pub fn deadline(&self) -> Option<i64> {
        let within = i64::try_from(self.wishes.ends_within?.as_millis()).unwrap_or(i64::MAX);
        Some(self.created_at.saturating_add(within))
    }
}

/// Bounds of the queue: of queued jobs together with the places reserved for batches under way.
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
pub enum Begun {
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
    pub reuse_key: Option<ReuseKey>,
    /// It ran together with others when their process died, and comes alone.
    pub suspect: bool,
    /// Slices that are solved and stored.
    pub slices: u32,
}

/// A solved slice about to be stored.
#[derive(Debug, Clone, PartialEq)]
pub struct NewSlice {
    /// What is known of it.
    pub note: SliceNote,
    /// Its part of the answer.
    pub result: Placed,
    /// Part of the job that is done with it, 0 to 1.
    pub done: f64,
    /// Expected solve time of the rest in µs.
    pub rest_us: u64,
}

/// Which of the queued jobs a worker asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
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
    pub which: Which,
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
pub enum Release {
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
        result: Placed,
        /// Patches with stored fields.
        field_patches: u32,
    },
    /// There is no answer.
    Failed(Failure),
    /// The client no longer wanted it.
    Cancelled,
}

impl Ending {
    /// The state of the job that ended so.
    #[must_use]
    pub fn state(&self) -> State {
        match self {
            Ending::Succeeded { .. } => State::Succeeded,
            Ending::Failed(_) => State::Failed,
            Ending::Cancelled => State::Cancelled,
        }
    }
}

/// Where a result is kept once its job has ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Placed {
    /// Under this key, where it already lies, with its size in bytes.
    Folder(String, u64),
    /// In the database, written together with the end of the job: a small one.
    Table(Encoded),
}

impl Placed {
    /// A result that was read from the database.
    pub(super) fn read(solution: Vec<u8>, fields: Option<Vec<u8>>) -> Placed {
        Placed::Table(Encoded {
            solution: solution.into(),
            fields: fields.map(Bytes::from),
        })
    }

    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        match self {
            Placed::Folder(_, bytes) => *bytes,
            Placed::Table(result) => result.bytes() as u64,
        }
    }
}

/// Where a result lies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredResult {
    /// The job.
    pub job: Uuid,
    /// Key of a large result; `None` if it lies in the database.
    pub key: Option<String>,
    /// Patches with stored fields; 0 if there is no fields object.
    pub field_patches: usize,
    /// The outputs the case asks for, as the JSON list of their names.
    pub outputs: String,
}

/// What became of a wish to delete a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Deleted {
    /// The row and all that hung on it are gone.
    Done,
    /// It has not ended.
    NotEnded(State),
    /// There was none.
    NotFound,
}
