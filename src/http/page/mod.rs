//! The page at `/`: files that a browser runs, which ask the public API alone. There is no step between the files in `web` and what
//! is answered.

pub(super) mod answers;
pub(super) mod files;
