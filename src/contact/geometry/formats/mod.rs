//! Profiles as text files: columns, Simpack and MiniProf. Text comes in, never a path.

pub mod columns;
pub mod format;
pub mod miniprof;
pub mod profile_file;
pub mod simpack;
