//! The stored forms of solutions and fields.

pub mod arrow;
pub mod encode;
pub mod fields;
pub mod parquet;
pub mod result;
pub mod table;

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Reads bytes of a client with a library that may panic at damaged ones; nothing if it did.
pub(crate) fn guarded<T>(read: impl FnOnce() -> T) -> Option<T> {
    catch_unwind(AssertUnwindSafe(read)).ok()
}

/// What is wrong with bytes at which a library panicked.
const DAMAGED: &str = "the bytes are damaged";
