//! The answer that clients read, and its assembly.

pub mod assemble;
pub mod finish;
pub mod maintain;
pub mod words;
