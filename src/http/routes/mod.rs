//! The resources of the API, one file each. Handlers read a request, call `jobs` and answer.

pub mod batch_lines;
pub mod batch_list;
pub mod batch_results;
pub mod batches;
pub mod cases;
pub mod damage;
pub mod event_stream;
pub mod events;
pub mod fields;
pub mod job_list;
pub mod jobs;
pub mod me;
pub mod next_page;
pub mod part_request;
pub mod plot_views;
pub mod plot_words;
pub mod plots;
pub mod point_fields;
pub mod prefer_wait;
pub mod resultants;
pub mod results;
pub mod service;
pub mod stored_fields;
pub mod subsurface;
pub mod tenant_events;
pub mod zones;
