//! Handlers of the resources of the API, one file per resource.

pub(super) mod batches;
pub(super) mod cases;
pub(super) mod evaluate;
pub(super) mod evolutions;
pub(super) mod fields;
pub(super) mod jobs;
pub(super) mod lists;
pub(super) mod parts;
pub(super) mod plots;
pub(super) mod profiles;
pub(super) mod results;
pub(super) mod runs;
pub(super) mod service;
pub(super) mod submission;
pub(super) mod wait;
pub(super) mod work;
