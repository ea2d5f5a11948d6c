//! What a request contains, read strictly: caller, ids, query, body, and the formats that the client accepts.

pub mod accept;
pub mod batch;
pub mod body_reader;
pub mod caller;
pub mod ids;
pub mod json;
pub mod json_weight;
pub mod labels;
pub mod multipart;
pub mod query;
pub mod rows;
pub mod run_body;
pub mod submit_options;
pub mod tables;
pub mod titles;
