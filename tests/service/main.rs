//! Does the service behave?

mod cli;
mod contract;
mod crash;
mod shutdown;
mod store;
mod store_model;
mod support;
mod worker;
