//! Does the service behave?

mod api;
mod batch_deletion;
mod batch_tables;
mod batches;
mod caching;
mod cli;
mod contract;
mod crash;
mod documents;
mod errors;
mod events;
mod formats;
mod guides;
mod pictures;
mod profiles;
mod requests;
mod results;
mod schema;
mod server;
mod shutdown;
mod store;
mod store_lists;
mod store_model;
mod support;
mod vtk;
mod worker;
