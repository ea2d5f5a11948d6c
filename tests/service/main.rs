//! Does the service behave?

mod api;
mod cli;
mod contract;
mod crash;
mod errors;
mod schema;
mod server;
mod shutdown;
mod store;
mod store_lists;
mod store_model;
mod support;
mod worker;
