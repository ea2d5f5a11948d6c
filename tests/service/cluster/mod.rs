//! Tests of several nodes on PostgreSQL and S3, for builds with the feature `cluster`.

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

use std::process::Command;
use std::time::{Duration, Instant};

use crate::support::{Service, pause, railhead};

/// Timeout of a test that hangs.
const WITHIN: Duration = Duration::from_secs(90);

/// Creates a database with the tables of the service. Returns its URL.
async fn tables() -> Option<String> {
    let url = postgres::database().await?;
    let migrated = railhead::jobs::store::postgres::schema::migrate(&url).await;
    migrated.expect("tables");
    Some(url)
}

/// Starts a node on a database, with short leases and without the cache. `serve` has no workers and `worker` has one. `flags` override these
/// settings.
fn node(url: &str, role: &str, flags: &[&str]) -> Service {
    node_by(railhead(), url, role, flags)
}

fn node_by(mut program: Command, url: &str, role: &str, flags: &[&str]) -> Service {
    let workers = if role == "worker" { "1" } else { "0" };
    program.env("RAILHEAD_DATABASE_URL", url);
    program.env("RAILHEAD_WORKERS", workers);
    program.envs([("RAILHEAD_CACHE", "false"), ("RAILHEAD_LEASE_S", "2")]);
    Service::alone(&mut program, role, flags)
}

/// Waits until `done` returns true. Panics after a timeout.
async fn until(what: &str, mut done: impl AsyncFnMut() -> bool) {
    let since = Instant::now();
    while !done().await {
        assert!(since.elapsed() < WITHIN, "{what}");
        pause().await;
    }
}

/// Runs a program. Returns whether it succeeded, and its output.
fn said_by(program: &mut Command, words: &[&str]) -> (bool, String) {
    let done = program.args(words).output().unwrap();
    let said = [done.stdout, done.stderr].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    (done.status.success(), said)
}
