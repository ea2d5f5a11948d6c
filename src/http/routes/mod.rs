//! The resources of the API, one file each. Handlers read a request, call `jobs` and answer.

pub mod batch_results;
pub mod batches;
pub mod cases;
pub mod events;
pub mod fields;
pub mod jobs;
pub mod plots;
pub mod point_fields;
pub mod resultants;
pub mod results;
pub mod service;
pub mod stored_fields;
pub mod zones;
