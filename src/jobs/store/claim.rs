//! How workers take jobs, keep them and give them back.

use uuid::Uuid;

use crate::jobs::model::kind::Queue;
use crate::jobs::store::submission::CacheKey;

/// The right to work on a job, until the lease runs out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Claim {
    /// The job.
    pub id: Uuid,
    /// Attempts counted so far, this one included.
    pub attempt: u32,
    /// The fencing token: random, the same for all jobs that were claimed together.
    pub lease_token: u64,
    /// The method asked for.
    pub method: String,
    /// W3C trace context of its submission, if its trace is collected.
    pub traceparent: Option<String>,
    /// What tells identical cases; `None` for a job that must be solved.
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
