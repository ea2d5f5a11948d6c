//! The answer, in the words that clients read.

pub mod assemble;
pub mod finish;
pub mod maintain;
pub mod words;
