//! Tests that a data folder is moved into a database completely, and that nothing is moved twice.

use std::collections::BTreeMap;

use reqwest::Method;
use serde_json::{Value, json};

use crate::cluster::postgres::database;
use crate::cluster::seaweed::{railhead_at, server};
use crate::cluster::{node, node_by, said_by, tables, until};
use crate::support::{Answer, Service, case, endless_case, loaded, long_case, railhead};

/// Options of a node that solves and that shuts down without a delay.
const SOLVES: [&str; 6] = ["--workers", "1", "--drain-delay-s", "0", "--lease-s", "30"];

/// Runs the program with these arguments. Returns whether it succeeded, and its output.
fn say(words: &[&str]) -> (bool, String) {
    said_by(&mut railhead(), words)
}

/// Asserts that the one large result of a store was moved.
fn assert_moved((moved, said): (bool, String)) {
    let counts = said.contains("large results\t1\n") && said.contains("missing\t0");
    assert!(moved && counts, "{said}");
}

fn assert_refused((moved, said): (bool, String), why: &str) {
    assert!(!moved && said.contains(why), "{said}");
}

/// Reads these paths as a client. Returns the JSON answers by path.
async fn read(service: &Service, paths: &[String]) -> BTreeMap<String, Value> {
    let mut answers = BTreeMap::new();
    for path in paths {
        answers.insert(path.clone(), service.get(path).await);
    }
    answers
}

/// Solves a small case, a large case and a batch. Returns the paths under which clients read them.
async fn fill(before: &Service) -> Vec<String> {
    let small = before.submit(&case("small")).await;
    let mut large = long_case("large", 12);
    large["outputs"] = json!(["resultants", "tractions"]);
    let large = before.submit(&large).await;
    let cases = json!([case("first"), case("second")]);
    let batch = before.post("/v1/batches", &cases).await.is(202).location();
    for id in [&small, &large] {
        before.until(id, "succeeded").await;
    }
    until("the batch ends", async || {
        before.get(&batch).await["states"]["succeeded"] == 2
    })
    .await;
    let mut paths = vec![batch];
    for id in [&small, &large] {
        paths.extend([format!("/v1/jobs/{id}"), format!("/v1/jobs/{id}/result")]);
    }
    paths
}

/// Asserts that moved results and jobs are used and that new jobs are solved.
async fn goes_on(after: &Service, running: &str) {
    // A moved result answers the same case, and new results get new keys.
    let again = after.post("/v1/jobs", &case("small")).await.is(202);
    assert_eq!(again.json["cached"], true, "{}", again.text);
    after.until(running, "running").await;
    let new = after.submit(&loaded(61_000)).await;
    after.until(&new, "succeeded").await;
    after.cancel(running).await;
    after.until(running, "cancelled").await;
}

/// Creates a key of the tenant `north` and returns its secret.
fn make_key(folder: &str) -> String {
    let (_, said) = say(&["keys", "create", "--tenant", "north", "--data-dir", folder]);
    let mut lines = said.lines();
    lines
        .find(|line| line.starts_with("rh_"))
        .unwrap()
        .to_owned()
}

#[tokio::test]
async fn a_data_folder_moves_into_a_database_with_all_that_is_in_it() {
    let url = or_skip!(database().await);
    let [from, place] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let folder = from.path().to_str().unwrap();
    let secret = make_key(folder);
    let before = Service::start(from.path(), &["--workers", "1", "--shutdown-grace-s", "0"]);
    let paths = fill(&before).await;
    let running = before.submit(&endless_case("running")).await;
    before.until(&running, "running").await;
    let known = read(&before, &paths).await;

    let results = format!("file://{}", place.path().display());
    let there = ["--results-url", &results, "--results-shared"];
    let words = ["move", "--data-dir", folder, "--database-url", &url];
    let words = [&words[..], &there].concat();
    assert!(say(&["migrate", "--database-url", &url]).0);
    assert_refused(say(&words), "in use");
    // After a power failure nobody has returned the running job to the queue.
    before.kill();
    let (moved, said) = say(&words);
    assert!(said.contains("jobs\t5\n"), "{said}");
    assert_moved((moved, said));
    assert_refused(say(&words), "jobs.db");

    let there = [&there[..], &["--cache", "true"]].concat();
    let after = node(&url, "serve", &there);
    assert_eq!(read(&after, &paths).await, known);
    assert_eq!(
        after.get(&format!("/v1/jobs/{running}")).await["state"],
        "queued"
    );
    let me = after.request(Method::GET, "/v1/me").bearer_auth(&secret);
    let me = Answer::to(me).await;
    assert_eq!(me.json["tenant"], "north", "{}", me.text);
    let worker = node(&url, "worker", &there);
    goes_on(&after, &running).await;
    drop(worker);

    // A database that has jobs is refused.
    let full = tempfile::tempdir().unwrap();
    drop(Service::start(full.path(), &["--workers", "1"]));
    let full = full.path().to_str().unwrap();
    let words = ["move", "--data-dir", full, "--database-url", &url];
    assert_refused(say(&words), "has jobs");
}

#[tokio::test]
async fn results_of_a_database_move_to_a_folder_from_there_to_a_bucket_and_to_another() {
    let (url, port) = (or_skip!(tables().await), or_skip!(server()));
    let place = tempfile::tempdir().unwrap();
    let folder = format!("file://{}", place.path().display());
    let mut service = node(&url, "serve", &SOLVES);
    let paths = fill(&service).await;
    let known = read(&service, &paths).await;
    let move_results = |url: &str, there: &[&str]| {
        let words = [&["move-results", "--database-url", url], there].concat();
        said_by(&mut railhead_at(port), &words)
    };
    let unshared = ["--results-url", &folder];
    assert_refused(move_results(&url, &unshared), "--results-shared");
    for there in [
        &["--results-url", &folder, "--results-shared"][..],
        &["--results-url", "s3://first/results"],
        &["--results-url", "s3://second/results"],
    ] {
        assert_refused(move_results(&url, there), "1 nodes");
        service.stop().await;
        assert_moved(move_results(&url, there));
        assert_refused(move_results(&url, there), "already");
        let flags = [&SOLVES[..], there].concat();
        service = node_by(railhead_at(port), &url, "serve", &flags);
        assert_eq!(read(&service, &paths).await, known);
    }
    let pool = sqlx::PgPool::connect(&url).await.unwrap();
    let left = sqlx::query_scalar("SELECT COUNT(*) FROM objects");
    let left: i64 = left.fetch_one(&pool).await.unwrap();
    assert_eq!(left, 0, "what was in the database is not kept twice");
    // A node that still names the previous bucket is refused.
    service.stop().await;
    let data = tempfile::tempdir().unwrap();
    let mut before = railhead_at(port);
    before.args(["serve", "--listen", "127.0.0.1:0", "--data-dir"]);
    before.arg(data.path()).args(["--database-url", &url]);
    let there = ["--results-url", "s3://first/results"];
    assert_refused(said_by(&mut before, &there), "s3://second/results");
    // The result store of a database cannot be used by another database.
    let other = tables().await.unwrap();
    node(&other, "serve", &SOLVES).stop().await;
    let there = ["--results-url", "s3://second/results"];
    assert_refused(move_results(&other, &there), "another database");
}
