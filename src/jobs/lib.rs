//! Queue, workers and stored results of the service. [`Jobs`] is the interface for other crates.
//!
//! # From submission to expiry
//!
//! 1. **Check** ([`submit`]): references to stored [`profiles`] are resolved, and the [`engine`] checks the case. Cases of a [`batch`]
//!    are checked while they arrive, and staged in a file.
//! 2. **Idempotency key** ([`idempotency`], [`submit`]): a repeated key returns the existing job.
//! 3. **Insert** ([`store`]): one transaction checks key, cache, quota and bounds of the queue, and inserts the job. A case that the
//!    tenant has solved before becomes a job that has already succeeded. Concurrent single submissions share a transaction. From
//!    now on the job is durable.
//! 4. **Claim** ([`worker::pool`]): the [fair scheduler](attempts::fair_scheduler) selects a queue, and `Worker::step` claims a group of
//!    its jobs. A single job is a group of one. Each claim has a fencing token, which every later write contains.
//! 5. **Renew the lease** ([`worker::heartbeat`]): while the solver makes progress and while results are being stored. If the lease
//!    expires, the [reaper](maintenance) returns the job to the queue.
//! 6. **Skip the solve** ([`worker::record`]): jobs whose result is in the cache end with it. Equal jobs of the group wait for the first.
//! 7. **Solve** ([`worker::turn`], [`worker::solve`]): on a solver thread, outside transactions, one case after the other. A long sweep
//!    is divided into [slices](attempts::slices), each stored when it is solved, and yields to other jobs in between. While every worker
//!    runs a solve that does not yield, a spare worker serves short jobs.
//! 8. **Decide** ([`worker::record::disposition_of`]): the one place that decides the effect of an outcome on its job.
//! 9. **Store and finish** ([`worker::record`]): a large result is written to the [`blobs`] first, with a key that contains the fencing
//!    token. Then one transaction ends all jobs of the group and stores small results. Jobs that were not begun are released.
//! 10. **Announce** ([`follow`]): callers that wait for the job or follow it read it again.
//! 11. **Fetch** ([`results`]): the row first, then the blob. If the blob was removed in between, the job has expired.
//! 12. **Expire** ([`maintenance`]): jobs are removed after the retention time. The key of a blob without references is added to an outbox
//!     in the same transaction, and the collector removes the blob.
//!
//! [`lifecycle`] opens, starts and stops the service; [`shared`] is the state that handles and workers share.
//!
//! # Folders
//!
//! Each uses only those before it: [`model`] (data types), [`codec`] (stored form of results), [`store`] (job table), [`result_place`]
//! (location of large results), [`attempts`] (state of attempts), [`maintenance`], [`batch`], [`run`] (runs of rows) and [`worker`].
//! [`handle`] with [`Jobs`] comes after `attempts`.

#![warn(unreachable_pub)]
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod attempts;
pub mod backup;
pub mod batch;
pub mod blobs;
pub mod clock;
pub mod codec;
pub mod data_dir;
pub mod engine;
pub mod error;
pub mod follow;
pub mod handle;
pub mod idempotency;
pub mod keys;
pub mod lifecycle;
pub mod maintenance;
pub mod metrics;
pub mod model;
pub mod options;
pub mod profiles;
#[cfg(feature = "cluster")]
pub mod relocate;
pub mod result_place;
pub mod results;
pub mod run;
pub mod runtime_probe;
pub mod shared;
pub mod storage_fault;
pub mod storage_health;
pub mod store;
pub mod submit;
pub mod sync;
#[cfg(feature = "otlp")]
pub mod trace;
#[cfg(not(feature = "otlp"))]
#[path = "no_trace.rs"]
pub mod trace;
pub mod work;
pub mod worker;

pub use crate::error::JobsError;
pub use crate::error::StorageFault;
pub use crate::handle::{BATCH_PAGE_MAX, Jobs, PAGE_MAX};
pub use crate::model::{Failure, FailureKind, Job, QueuePlace, State};
pub use crate::options::Options;
pub use crate::store::{Filter, Membership, Page, Total};
