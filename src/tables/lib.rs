//! Reads and writes tables: columns of numbers and texts.
//!
//! | module | contents |
//! |---|---|
//! | [`table`] | a table in memory |
//! | [`titles`] | titles of columns: pointers, short names, quantities with units |
//! | [`read`] | reads tables in any format, some rows at a time |
//! | [`write`](mod@write) | writes tables of rows in any format |
//! | [`cells`] | values per cell or on a grid of samples |
//! | [`arrow`], [`csv`], [`npz`], [`parquet`], [`vtk`] | one format each; [`text`] reads CSV and NDJSON |
//! | [`strict_json`] | JSON without repeated members |

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

/// Calls a library that may panic on damaged bytes; `None` if it panics.
fn guarded<T>(read: impl FnOnce() -> T) -> Option<T> {
    catch_unwind(AssertUnwindSafe(read)).ok()
}

/// Error for bytes on which a library panicked.
const DAMAGED: &str = "the bytes are damaged";
