//! Runs: one case with columns of values, many rows as one piece of work.
//!
//! A run is a batch of the kind [`Rows`](crate::model::Kind::Rows), whose jobs are chunks of rows. Claims, leases, retries,
//! cancellation and retention are those of all batches.

pub mod draft;
pub mod model;
pub mod results;
