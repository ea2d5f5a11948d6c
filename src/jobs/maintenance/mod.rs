//! What runs beside the workers: leases, deadlines, retention, blobs.

pub mod blob_collector;
pub mod deadlines;
pub mod nodes;
pub mod reaper;
pub mod recovery;
pub mod retention;
