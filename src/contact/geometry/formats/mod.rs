//! Profiles as text files: columns, Simpack and MiniProf. The functions take the text of a file, never a path.

pub mod columns;
pub mod format;
pub mod miniprof;
pub mod profile_file;
pub mod simpack;
