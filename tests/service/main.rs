//! Does the service behave?

mod api;
mod contract;
mod errors;
mod schema;
mod server;
