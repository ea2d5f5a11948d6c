//! Several nodes on PostgreSQL and S3: what only a build with the feature `cluster` has.

pub mod cable;
mod clocks;
mod database_away;
mod database_tls;
mod fairness;
pub mod faketime;
pub mod faulty_server;
mod folded_counts;
mod migrations;
mod nodes;
mod object_store;
pub mod old_tables;
pub mod pgbouncer;
mod pooler;
pub mod postgres;
mod relocation;
mod result_places;
pub mod seaweed;
mod store_objects;
mod store_plans;
mod store_snapshots;
