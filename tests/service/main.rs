//! Does the service behave?

mod cli;
mod crash;
mod shutdown;
mod standin;
mod store;
mod store_model;
mod support;
mod worker;
