//! Profiles as text files: columns, Simpack and MiniProf. The functions take the text of a file, never a path.
//!
//! All formats share one reader of lines ([`lines`]): it removes remarks, accepts all line ends, separators and decimal signs, and
//! reads rows of numbers. Columns and MiniProf find their points with [`table`], Simpack between its keywords.

pub mod columns;
pub mod format;
pub mod lines;
pub mod miniprof;
pub mod profile_file;
pub mod simpack;
pub mod table;
