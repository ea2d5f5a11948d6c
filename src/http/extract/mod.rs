//! What a request says, read strictly: its body, its query, its ids and the form that the client accepts.

pub mod accept;
pub mod batch;
pub mod caller;
pub mod ids;
pub mod json;
pub mod json_weight;
pub mod query;
pub mod submit_options;
