//! Tables of the service: columns of numbers and texts, read and written.
//!
//! | module | contents |
//! |---|---|
//! | [`table`] | a table in memory |
//! | [`titles`] | what the titles of columns mean: pointers, short names, quantities with units |
//! | [`read`] | tables of clients in any form, some rows at a time |
//! | [`write`](mod@write) | tables of rows in any form |
//! | [`cells`] | values per cell or on a grid of samples |
//! | [`arrow`], [`csv`], [`npz`], [`parquet`], [`vtk`] | one form each; [`text`] reads CSV and NDJSON |

#![warn(unreachable_pub)]
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod arrow;
pub mod cells;
pub mod csv;
pub mod error;
pub mod npz;
pub mod parquet;
pub mod read;
pub mod strict_json;
pub mod table;
pub mod text;
pub mod titles;
pub mod vtk;
pub mod write;

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Calls a library that may panic at damaged bytes; `None` if it panics.
fn guarded<T>(read: impl FnOnce() -> T) -> Option<T> {
    catch_unwind(AssertUnwindSafe(read)).ok()
}

/// Reason for bytes at which a library panicked.
const DAMAGED: &str = "the bytes are damaged";
