//! railhead: a rolling-contact stress service.
//!
//! Five crates, each of which uses only those before it:
//!
//! | crate | responsibility |
//! |---|---|
//! | [`contact`] | the physics: synchronous arithmetic without clock, files or network |
//! | [`tables`] | columns in and out |
//! | [`jobs`] | queue, workers, stored results |
//! | [`http`] | requests and responses |
//! | this one | [`cli`]: commands and settings; [`telemetry`] writes the log, [`otlp`] sends spans |
//!
//! The page of [`contact`] follows a case from its JSON to its solution, the page of [`jobs`] a job from submission to expiry, and the page of
//! [`http`] a request.

#![warn(unreachable_pub)]
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod cli;
#[cfg(feature = "otlp")]
pub mod otlp;
#[cfg(not(feature = "otlp"))]
#[path = "no_otlp.rs"]
pub mod otlp;
pub mod telemetry;

pub use railhead_contact as contact;
pub use railhead_http as http;
pub use railhead_jobs as jobs;
pub use railhead_tables as tables;
