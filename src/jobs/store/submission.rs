//! What is submitted, and what becomes of it: jobs, batches, the bounds of the queue.

use std::collections::BTreeMap;
use std::sync::Arc;

use bytes::Bytes;
use uuid::Uuid;

use crate::jobs::model::job::Job;
use crate::jobs::model::kind::Kind;
use crate::jobs::model::submit_options::SubmitOptions;

/// Equal for cases of one tenant that have the same answer.
pub type CacheKey = [u8; 16];

/// A job about to be queued.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NewJob {
    /// UUIDv7.
    pub id: Uuid,
    /// Whose it is.
    pub tenant: Arc<str>,
    /// [`Kind::Case`], or [`Kind::Rows`] for a chunk of a run.
    pub kind: Kind,
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
    /// Free text of the client.
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
