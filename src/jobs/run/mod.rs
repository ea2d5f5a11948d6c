//! Runs: one case with columns of values, many rows as one piece of work.
//!
//! A run is kept as a batch whose jobs are chunks of rows, in a [lane](crate::jobs::model::lane) of its tenant, so that the claim, the lease, the retries, cancellation
//! and retention are those of jobs. The template of the batch is the [`head`] of the run; the case of each of its jobs is a [`chunk`] of
//! rows, its result a Parquet file of answers. Where it is cut depends on the rows alone.

pub mod chunk;
pub mod control;
pub mod draft;
pub mod head;
pub mod model;
pub mod results;
