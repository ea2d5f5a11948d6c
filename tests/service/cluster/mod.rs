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

use std::process::Command;
use std::time::{Duration, Instant};

use crate::support::{Service, pause, railhead};

/// Time after which a guard reports that a test hangs.
const WITHIN: Duration = Duration::from_secs(90);

/// A database of its own with the tables of the service.
async fn tables() -> Option<String> {
    let url = postgres::database().await?;
    let migrated = railhead::jobs::store::postgres::schema::migrate(&url).await;
    migrated.expect("tables");
    Some(url)
}

/// A node on a database, with short leases and results that are solved anew; no workers in `serve` and one in `worker`. Flags have the
/// last word.
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

/// Waits for something, which has to come.
async fn until(what: &str, mut done: impl AsyncFnMut() -> bool) {
    let since = Instant::now();
    while !done().await {
        assert!(since.elapsed() < WITHIN, "{what}");
        pause().await;
    }
}

/// Runs a program. Returns its output and whether it succeeded.
fn said_by(program: &mut Command, words: &[&str]) -> (bool, String) {
    let done = program.args(words).output().unwrap();
    let said = [done.stdout, done.stderr].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    (done.status.success(), said)
}
