//! Does the service behave?

mod access;
mod api;
mod batches;
mod cache;
mod cli;
mod contract;
mod crash;
mod documents;
mod errors;
mod keys;
mod metrics;
mod requests;
mod results;
mod retention;
mod schema;
mod server;
mod shutdown;
mod storage;
mod store;
mod store_lists;
mod store_model;
mod support;
mod worker;
