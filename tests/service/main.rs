//! Tests of the service and of the program.

/// Unwraps a resource that a test needs. Returns from the test if it is missing, which has been reported.
macro_rules! or_skip {
    ($needed:expr) => {{
        let Some(there) = $needed else { return };
        there
    }};
}

mod access;
mod admission;
mod batch_columns;
mod batch_memory;
mod batch_tables;
mod batches;
mod bound_keys;
mod cache;
mod caching;
mod check_case;
mod cli;
mod clients;
#[cfg(feature = "cluster")]
mod cluster;
mod columns;
mod contract;
mod cost;
mod crowds;
mod csv_table;
mod damage;
mod dashboard;
mod documents;
mod errors;
mod evaluate;
mod events;
mod evolutions;
mod faults;
mod formats;
mod fuzzed;
mod guarded;
mod guides;
#[cfg(target_os = "linux")]
mod held_solver;
mod http2;
mod kept_profiles;
mod keys;
mod lab;
mod leases;
mod maintenance;
mod malformed;
mod manners;
mod metrics;
mod model;
mod old_folders;
mod order;
mod ownership;
mod page;
mod pictures;
mod profile_files;
mod requests;
mod results;
mod retention;
mod revoked;
mod runs;
mod same_answers;
mod schema;
mod schemathesis;
mod server;
mod shares;
mod shutdown;
mod slow_clients;
mod storage;
mod store;
mod store_back;
mod store_expiry;
mod store_jobs;
mod store_lists;
mod store_model;
mod store_moves;
mod store_races;
mod store_searches;
mod store_slices;
mod store_turns;
mod stored_bytes;
mod support;
mod sweeps;
mod table_forms;
mod tables_in_turn;
#[cfg(feature = "otlp")]
mod traces;
mod turns;
mod under_load;
mod uploads;
mod vtk;
mod worker;
