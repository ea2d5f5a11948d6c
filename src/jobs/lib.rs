//! Queue, workers and stored results of the service. [`Jobs`] is the interface for other crates.
//!
//! # The way of a job
//!
//! 1. **Check** ([`submit`]): stored [`profiles`] that the JSON names are put in place, and the [`engine`] turns it into a checked
//!    case, off the threads that answer requests. Cases of a [`batch`] are checked while they arrive and
//!    staged in a file, within the bounds of [`staged_bytes`].
//! 2. **Key and cache** ([`idempotency`], [`result_cache`]): a repeated idempotency key gives the job that it made; a
//!    case that the tenant had solved before gives a job that has already succeeded with the same result.
//! 3. **Insert** ([`store`]): one transaction decides key, quota and queue bound and inserts the job. Single
//!    submissions that arrive together share it. From here on the job survives the process.
//! 4. **Claim** ([`worker::pool`]): a worker, whose loop is `Worker::step`, asks whose [turn](attempts::fair_scheduler) it is and claims a group of that
//!    tenant's jobs. A single job is a group of one. Each claim has a
//!    fencing token, which every later write names.
//! 5. **Keep the lease** ([`worker::heartbeat`]): from the claim until the end is written. A lease is renewed while the
//!    solver ticks and while results are being stored; otherwise it runs out and the
//!    [reaper](maintenance) takes the job back.
//! 6. **Settle without solving** ([`worker::record`]): jobs with a known answer end with it; equal jobs of the group wait
//!    for the first of them.
//! 7. **Solve** ([`worker::turn`], [`worker::solve`]): on a thread, outside any transaction, one case after the other. A
//!    long sweep is cut into [slices](attempts::slices), each stored when it is solved, between which others have their turn. While
//!    every worker is at a solve without a cut, a spare one serves short jobs.
//! 8. **Judge** ([`worker::record::disposition_of`]): the one place that decides what an outcome means for the job.
//! 9. **Store and finish** ([`worker::record`]): a large result goes to the [`blobs`] first, under a key with the fencing
//!    token; then one transaction writes all ends of the group, small results included. What was not begun is released.
//! 10. **Tell** ([`work`]): those who wait for a job or follow it read it again.
//! 11. **Fetch** ([`results`]): the row first, then the blob; what has gone in between is answered as expired.
//! 12. **Expire** ([`maintenance`]): rows go after their retention time; a blob
//!     whose last reference goes enters an outbox in the same transaction, and the collector deletes it.
//!
//! [`lifecycle`] opens, starts and stops all this; [`shared`] holds what all handles and workers use.
//!
//! # The folders
//!
//! Each uses only those before it: [`model`] (jobs, batches, keys and submissions), [`codec`] (results and fields as bytes),
//! [`store`] (the job table), [`result_place`] (where results lie), [`attempts`] (one attempt at a job), [`keys`],
//! [`maintenance`], [`batch`], [`run`] (batches of rows) and [`worker`]. [`handle`] with [`Jobs`] stands behind `attempts`.

#![warn(unreachable_pub)]
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod attempts;
pub mod backup;
pub mod batch;
pub mod blobs;
pub mod clock;
pub mod codec;
pub mod disk_reserve;
pub mod engine;
pub mod error;
pub mod expiry;
pub mod handle;
pub mod idempotency;
pub mod keys;
pub mod lifecycle;
pub mod maintenance;
pub mod metrics;
pub mod metrics_refresh;
pub mod model;
pub mod open_store;
pub mod options;
pub mod profiles;
pub mod recent_reads;
#[cfg(feature = "cluster")]
pub mod relocate;
pub mod result_cache;
pub mod result_place;
pub mod results;
pub mod run;
pub mod runtime_probe;
pub mod shared;
pub mod staged_bytes;
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
