//! Tests nodes whose clocks are up to 40 s off and are changed repeatedly: no lease is lost, no job ends twice, and a killed worker is detected as
//! soon as with correct clocks.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use sqlx::PgPool;
use tempfile::TempDir;
use tokio::task::block_in_place;
use tokio::time::sleep;

use crate::cluster::{Cluster, assert_ended_once, counted, tables, until, until_all_ended};
use crate::faketime::{library, set_ahead, with_clock};
use crate::nodes::submit;
use crate::row;
use crate::support::{endless_case, railhead};

const JOBS: usize = 2000;
const LEASE: Duration = Duration::from_secs(3);

/// Time limit to free a job: the lease, one round of the check for silent workers (a third of the lease), and one second for everything else.
const FREE_WITHIN: Duration = Duration::from_secs(5);

/// Roles, and the initial lead of their clocks in seconds.
const NODES: [(&str, i32); 4] = [
    ("serve", 0),
    ("serve", -10),
    ("worker", 40),
    ("worker", -40),
];

/// Time between changes of the clocks: longer and shorter than nodes take to detect a change.
const SET_EVERY: [Duration; 2] = [Duration::from_secs(7), Duration::from_secs(2)];

const RUNNING: &str = "SELECT COUNT(*) FROM jobs WHERE state = 'running'";

fn clock_of(folder: &TempDir, node: usize) -> std::path::PathBuf {
    folder.path().join(format!("clock-{node}"))
}

/// Changes all clocks except the first repeatedly until stopped. Returns the number of changes.
async fn set_clocks(folder: Arc<TempDir>, stop: Arc<AtomicBool>) -> usize {
    let mut rounds = 0;
    while !stop.load(Ordering::Relaxed) {
        sleep(SET_EVERY[rounds % 2]).await;
        for (node, (_, ahead)) in NODES.iter().enumerate().skip(1) {
            let ahead = [-1, 0, 1][rounds % 3] * ahead;
            set_ahead(&clock_of(&folder, node), ahead);
        }
        rounds += 1;
    }
    rounds
}

/// Starts an endless job for each worker and waits until all of them run.
async fn hold(cluster: &Cluster, pool: &PgPool) -> Vec<String> {
    let mut held = Vec::new();
    for number in 0..2 {
        let name = format!(
            "held-{}-{number}",
            counted(pool, "SELECT COUNT(*) FROM jobs").await
        );
        let (id, _) = cluster
            .submit("/v1/jobs", &endless_case(&name), &name, number)
            .await;
        held.push(id);
    }
    until("both run", async || counted(pool, RUNNING).await == 2).await;
    held
}

async fn cancel(cluster: &Cluster, ids: &[String]) {
    for id in ids {
        cluster.cancel(id).await;
    }
}

pub async fn run() {
    let (Some((url, pool)), Some(library)) = (tables().await, library()) else {
        return;
    };
    let folder = Arc::new(tempfile::tempdir().expect("a folder"));
    for (node, (_, ahead)) in NODES.iter().enumerate() {
        set_ahead(&clock_of(&folder, node), *ahead);
    }
    let cluster = Cluster::new({
        let folder = folder.clone();
        move |node| {
            let mut command = railhead();
            with_clock(&mut command, &library, &clock_of(&folder, node));
            command
        }
    });
    for (role, _) in NODES {
        cluster.add(role, &url, &format!("--lease-s {}", LEASE.as_secs()));
    }

    // Both workers hold a job for many leases, and many small jobs are processed, while the clocks are changed.
    let held = hold(&cluster, &pool).await;
    let (began, stop) = (Instant::now(), Arc::new(AtomicBool::new(false)));
    let setting = tokio::spawn(set_clocks(folder.clone(), stop.clone()));
    let (ids, again) = submit(&cluster, 0, JOBS).await;
    while began.elapsed() < 10 * LEASE {
        sleep(Duration::from_millis(100)).await;
    }
    cancel(&cluster, &held).await;
    until_all_ended(&pool).await;
    stop.store(true, Ordering::Relaxed);
    let rounds = setting.await.expect("clocks");
    row(
        "jobs, submissions tried again, rounds in which three clocks were set, seconds to the last end",
        format!(
            "{}, {again}, {rounds}, {:.0}",
            ids.len(),
            began.elapsed().as_secs_f64()
        ),
    );
    assert_eq!(again, 0, "no submission was retried");
    let more = "SELECT COUNT(*) FROM jobs WHERE attempt > 1";
    assert_eq!(counted(&pool, more).await, 0, "a lease was lost");
    let ended = "SELECT COUNT(*) FROM jobs WHERE state = 'succeeded'";
    assert_eq!(
        counted(&pool, ended).await,
        i64::try_from(JOBS).expect("few")
    );
    assert_ended_once(&pool).await;
    assert!(cluster.logged("lease expired").is_empty());
    freed(&cluster, &pool, &folder).await;
}

/// Measures how long the job of a killed worker is held, with its clock ahead and behind.
async fn freed(cluster: &Arc<Cluster>, pool: &PgPool, folder: &TempDir) {
    for (node, what) in [(2, "ahead"), (3, "behind")] {
        for node in [2, 3] {
            set_ahead(&clock_of(folder, node), NODES[node].1);
        }
        // By then the other worker has detected the change of its clock and still takes over jobs.
        let held = hold(cluster, pool).await;
        block_in_place(|| cluster.kill(node));
        let killed = Instant::now();
        until("its job is free", async || counted(pool, RUNNING).await < 2).await;
        let free = killed.elapsed();
        row(
            &format!(
                "seconds until the job of a killed worker was free whose clock was 40 s {what}"
            ),
            format!("{:.1}", free.as_secs_f64()),
        );
        assert!(free < FREE_WITHIN, "{free:?}");
        cancel(cluster, &held).await;
        until_all_ended(pool).await;
        block_in_place(|| cluster.start(node));
    }
}
