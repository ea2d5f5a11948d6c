//! Tests two API nodes and three workers while nodes are killed at random, PostgreSQL crashes, all nodes are replaced one by one, and the object
//! store sometimes fails. Every accepted job must end once, every API node must return its result, and a concurrent run must have an answer to each
//! of its rows.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use sqlx::PgPool;
use tokio::task::{JoinSet, block_in_place};
use tokio::time::sleep;

use crate::cluster::{Cluster, assert_ended_once, counted, tables, until_all_ended};
use crate::faulty_server::FaultyServer;
use crate::random::Random;
use crate::rows::SentRun;
use crate::support::{case, long_case};
use crate::{postgres, row, seaweed};

const CLIENTS: usize = 6;

/// Returns mostly small cases. Every twentieth takes a large part of a second and has a result that goes to the object store.
fn mixed(number: usize) -> Value {
    let name = format!("case {number}");
    if !number.is_multiple_of(20) {
        let mut case = case(&name);
        case["load"]["normal_force_n"] = json!(60_000 + 7 * number);
        return case;
    }
    let mut case = long_case(&name, 12);
    case["load"]["normal_force_n"] = json!(60_000 + 7 * number);
    case["outputs"] = json!(["resultants", "tractions"]);
    case
}

/// Submits `jobs` jobs, numbered from `from`. Returns their ids and the number of retries.
pub async fn submit(cluster: &Arc<Cluster>, from: usize, jobs: usize) -> (Vec<String>, usize) {
    let next = Arc::new(AtomicUsize::new(from));
    let mut clients = JoinSet::new();
    for _ in 0..CLIENTS {
        let (cluster, next) = (cluster.clone(), next.clone());
        clients.spawn(async move {
            let (mut ids, mut again) = (Vec::new(), 0);
            loop {
                let number = next.fetch_add(1, Ordering::Relaxed);
                if number >= from + jobs {
                    return (ids, again);
                }
                let key = format!("soak-{number}");
                let (id, tries) = cluster
                    .submit("/v1/jobs", &mixed(number), &key, number)
                    .await;
                ids.push(id);
                again += tries;
            }
        });
    }
    let all = clients.join_all().await;
    let again = all.iter().map(|(_, again)| again).sum();
    (all.into_iter().flat_map(|(ids, _)| ids).collect(), again)
}

/// Kills and restarts a random node repeatedly until stopped. Returns the number of kills.
async fn kill_at_random(cluster: Arc<Cluster>, nodes: Vec<usize>, stop: Arc<AtomicBool>) -> usize {
    let mut kills = 0;
    let mut random = Random(1);
    while !stop.load(Ordering::Relaxed) {
        sleep(Duration::from_secs_f64(random.between(1.5, 4.0))).await;
        let node = nodes[random.below(nodes.len())];
        block_in_place(|| cluster.kill(node));
        sleep(Duration::from_secs_f64(random.between(0.0, 1.5))).await;
        // A node does not start while PostgreSQL is unavailable. The start is retried.
        while !started(&cluster, node).await {}
        kills += 1;
    }
    kills
}

/// Starts a node and returns whether it succeeded.
async fn started(cluster: &Cluster, node: usize) -> bool {
    let tried = block_in_place(|| {
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| cluster.start(node)))
    });
    if tried.is_err() {
        sleep(Duration::from_millis(500)).await;
    }
    tried.is_ok()
}

/// Adds two API nodes and three workers with short leases.
fn add_nodes(cluster: &Cluster, url: &str) -> Vec<usize> {
    // A worker is killed every few seconds, and a chunk takes some seconds. By chance, the same chunk is hit several times.
    let flags = "--results-url s3://soak/results --lease-s 3 --attempts-max 20 --shutdown-grace-s 2 --drain-delay-s 0";
    let roles = ["serve", "serve", "worker", "worker", "worker"];
    roles.map(|role| cluster.add(role, url, flags)).to_vec()
}

pub async fn run(jobs: usize, rows: usize) {
    let (Some((url, pool)), Some(port)) = (tables().await, seaweed::server()) else {
        return;
    };
    let way = FaultyServer::to(port).await;
    way.faults.refused.store(25, Ordering::Relaxed);
    way.faults.cut.store(30, Ordering::Relaxed);
    let s3 = way.address.port();
    let cluster = Cluster::new(move |_| seaweed::railhead_at(s3));
    let all = add_nodes(&cluster, &url);

    // Kills at random times, and one crash of the database.
    let began = Instant::now();
    let (stop, first) = (Arc::new(AtomicBool::new(false)), jobs * 3 / 5);
    let killing = tokio::spawn(kill_at_random(cluster.clone(), all.clone(), stop.clone()));
    let crashing = tokio::spawn(async {
        sleep(Duration::from_secs(8)).await;
        postgres::crash();
    });
    let night = SentRun::send(&cluster, rows, "night").await;
    let (mut ids, again) = submit(&cluster, 0, first).await;
    crashing.await.expect("a crash");
    until_all_ended(&pool).await;
    stop.store(true, Ordering::Relaxed);
    let kills = killing.await.expect("kills");
    row(
        "jobs accepted while nodes were killed, submissions tried again, kills, crashes of PostgreSQL, seconds to the last end",
        format!(
            "{}, {again}, {kills}, 1, {:.0}",
            ids.len(),
            began.elapsed().as_secs_f64()
        ),
    );

    let before = ids.len();
    let later = SentRun::send(&cluster, rows / 5, "later").await;
    ids.extend(roll(&cluster, &pool, all, first, jobs - first).await);

    verify(&cluster, &pool, &ids, before).await;
    night.verify(&cluster, &pool).await;
    let attempts = later.verify(&cluster, &pool).await;
    assert_eq!(attempts, 1, "a rolling restart burns no attempt of a chunk");
    let made = way.faults.made.load(Ordering::Relaxed);
    row("faults of the object store", made);
}

/// Replaces all nodes one by one while jobs are submitted. Nobody waits for a lease, and no attempt counts.
async fn roll(
    cluster: &Arc<Cluster>,
    pool: &PgPool,
    nodes: Vec<usize>,
    first: usize,
    jobs: usize,
) -> Vec<String> {
    let began = Instant::now();
    let submitting = tokio::spawn({
        let cluster = cluster.clone();
        async move { submit(&cluster, first, jobs).await }
    });
    for node in nodes {
        sleep(Duration::from_secs(1)).await;
        block_in_place(|| cluster.stop(node));
        block_in_place(|| cluster.start(node));
    }
    let (ids, again) = submitting.await.expect("clients");
    until_all_ended(pool).await;
    let seconds = began.elapsed().as_secs_f64();
    row(
        "jobs accepted during a rolling restart, submissions tried again, seconds to the last end",
        format!("{}, {again}, {seconds:.0}", ids.len()),
    );
    ids
}

async fn verify(cluster: &Cluster, pool: &PgPool, ids: &[String], before: usize) {
    let distinct: std::collections::BTreeSet<_> = ids.iter().collect();
    assert_eq!(distinct.len(), ids.len(), "a job for each key");
    let states: Vec<(String, i64, i64)> = sqlx::query_as(
        "SELECT state, COUNT(*), MAX(attempt) FROM jobs WHERE batch_id IS NULL GROUP BY state",
    )
    .fetch_all(pool)
    .await
    .expect("states");
    row("states with jobs and most attempts", format!("{states:?}"));
    assert!(
        states.len() == 1 && states[0].0 == "succeeded",
        "{states:?}"
    );
    assert_eq!(states[0].1, i64::try_from(ids.len()).expect("a number"));
    assert_ended_once(pool).await;
    let ended = counted(pool, "SELECT COUNT(DISTINCT job) FROM soak_ends JOIN jobs ON jobs.id = job WHERE batch_id IS NULL").await;
    assert_eq!(ended, states[0].1, "every end was noted");
    let later: Vec<&String> = ids.iter().skip(before).collect();
    let counted_attempts: i64 =
        sqlx::query_scalar("SELECT COUNT(*) FROM jobs WHERE attempt > 1 AND id = ANY($1)")
            .bind(later.iter().map(ToString::to_string).collect::<Vec<_>>())
            .fetch_one(pool)
            .await
            .expect("attempts");
    row(
        "jobs of the rolling restart with more than one attempt",
        counted_attempts,
    );
    assert_eq!(counted_attempts, 0, "a rolling restart burns no attempt");
    let outside = counted(pool, "SELECT COUNT(*) FROM blobs WHERE key IS NOT NULL").await;
    let began = Instant::now();
    let some = ids.iter().step_by(5);
    for id in some.clone() {
        let path = format!("/v1/jobs/{id}/result");
        let result: Value = cluster.read_everywhere(&path).await.parse().expect("JSON");
        assert!(result["patches"].is_array(), "{path}");
    }
    row(
        "results in the object store; results read at both API nodes, seconds",
        format!(
            "{outside}; {}, {:.0}",
            some.len(),
            began.elapsed().as_secs_f64()
        ),
    );
    assert!(
        cluster.logged("panicked").is_empty(),
        "{:?}",
        cluster.logged("panicked")
    );
}
