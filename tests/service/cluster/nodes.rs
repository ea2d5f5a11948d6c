//! Tests several nodes on one database, as real processes: each job ends once and is visible on all nodes, even if a node is killed.

use std::collections::BTreeSet;

use reqwest::Method;
use serde_json::Value;

use crate::cluster::cable::Cable;
use crate::cluster::{WITHIN, node, postgres, said_by, tables, until};
use crate::support::{Answer, Service, case, endless_case, long_case, railhead};

/// Runs the program with this database. Returns its output.
fn railhead_with(url: &str, words: &[&str]) -> String {
    said_by(railhead().env("RAILHEAD_DATABASE_URL", url), words).1
}

async fn in_state(service: &Service, state: &str) -> Vec<Value> {
    let list = service
        .get(&format!("/v1/jobs?limit=1000&state={state}"))
        .await;
    list["jobs"].as_array().unwrap().clone()
}

/// Sends a batch of 60 cases with an idempotency key. Returns its path, and whether the answer was a replay.
pub async fn send_batch(service: &Service) -> (String, bool) {
    let cases: Vec<Value> = (0..60).map(|n| case(&format!("line {n}"))).collect();
    let request = service.request(Method::POST, "/v1/batches").json(&cases);
    let answer = Answer::to(request.header("Idempotency-Key", "one-batch")).await;
    let replayed = answer.header("Idempotency-Replayed").is_some();
    (answer.location(), replayed)
}

#[tokio::test]
async fn each_job_ends_once_and_is_read_everywhere_although_a_worker_and_an_api_node_are_killed() {
    let url = or_skip!(tables().await);
    let (first, second) = (node(&url, "serve", &[]), node(&url, "serve", &[]));
    let (doomed, survivor) = (node(&url, "worker", &[]), node(&url, "worker", &[]));
    let mut ids = BTreeSet::new();
    for number in 0..24 {
        let api = if number % 2 == 0 { &first } else { &second };
        let motions = if number % 6 == 0 { 40 } else { 2 };
        let case = long_case(&format!("case {number}"), motions);
        ids.insert(api.submit(&case).await);
    }
    // One node accepts the batch and all workers solve it.
    let (batch, replayed) = send_batch(&second).await;
    assert!(!replayed);

    until("both workers solve", async || {
        in_state(&second, "running").await.len() > 1
            && !in_state(&second, "succeeded").await.is_empty()
    })
    .await;
    doomed.kill();
    first.kill();
    let third = node(&url, "serve", &[]);
    until("all jobs end", async || {
        // The states are read in one request. Between two requests a job could return to the queue and be missed in both.
        in_state(&second, "succeeded").await.len() == ids.len() + 60
    })
    .await;

    for id in &ids {
        let mut results = Vec::new();
        for api in [&second, &third] {
            let job = api.get(&format!("/v1/jobs/{id}")).await;
            assert_eq!(job["state"], "succeeded", "{job}");
            results.push(api.get(&format!("/v1/jobs/{id}/result")).await);
        }
        assert_eq!(results[0], results[1]);
        assert!(results[0]["patches"].is_array(), "job {id}");
    }
    for api in [&second, &third] {
        let batch = api.get(&batch).await;
        assert_eq!(batch["states"]["succeeded"], 60, "{batch}");
    }
    // All nodes know the idempotency key of the batch.
    assert_eq!(send_batch(&third).await, (batch, true));
    assert_eq!(in_state(&third, "succeeded").await.len(), ids.len() + 60);
    assert!(!survivor.log_text().contains("panicked"));
    let said = railhead_with(&url, &["doctor"]);
    assert!(said.contains("ok\tnodes seen within 20 s"), "{said}");
}

#[tokio::test]
async fn a_job_is_cancelled_and_waited_for_at_a_node_that_does_not_solve_it() {
    let url = or_skip!(tables().await);
    let (one, other) = (node(&url, "serve", &[]), node(&url, "serve", &[]));
    let worker = node(&url, "worker", &[]);
    let endless = one.submit(&endless_case("endless")).await;
    one.until(&endless, "running").await;
    // A client waits at one node for a cancellation that is requested at the other.
    let waiting = one.request(Method::GET, &format!("/v1/jobs/{endless}"));
    let waiting = Answer::to(waiting.header("Prefer", "wait=30"));
    let (waited, ()) = tokio::join!(waiting, other.cancel(&endless));
    assert_eq!(waited.json["state"], "cancelled", "{}", waited.text);

    // A key created by the command is valid on every node.
    let secret = railhead_with(&url, &["keys", "create", "--tenant", "depot"]);
    let secret = secret.lines().next().unwrap();
    let me = other.request(Method::GET, "/v1/me").bearer_auth(secret);
    let me = Answer::to(me).await;
    assert_eq!(me.json["tenant"], "depot", "{}", me.text);

    // After an orderly shutdown a running job returns to the queue, and its attempt is not counted.
    let endless = one.submit(&endless_case("endless")).await;
    one.until(&endless, "running").await;
    worker.stop().await;
    let job = one.until(&endless, "queued").await;
    assert_eq!(job["attempt"], 0, "{job}");
}

/// Reads a stream of events until one satisfies the condition, and returns its data.
async fn until_event(stream: &mut reqwest::Response, passes: impl Fn(&Value) -> bool) -> Value {
    let mut text = String::new();
    loop {
        let piece = tokio::time::timeout(WITHIN, stream.chunk()).await;
        let piece = piece.expect("events come").unwrap().expect("more events");
        text += std::str::from_utf8(&piece).unwrap();
        while let Some((event, rest)) = text.split_once("\n\n") {
            let data = event.lines().find_map(|line| line.strip_prefix("data: "));
            let data: Option<Value> = data.map(|data| serde_json::from_str(data).unwrap());
            text = rest.to_owned();
            if let Some(data) = data.filter(&passes) {
                return data;
            }
        }
    }
}

#[tokio::test]
async fn progress_and_events_are_seen_and_results_used_again_at_every_node() {
    let url = or_skip!(tables().await);
    let start = |role: &str| node(&url, role, &["--cache", "true"]);
    let (one, other, _worker) = (start("serve"), start("serve"), start("worker"));
    let watched = one.submit(&endless_case("watched")).await;
    let events = other.request(Method::GET, &format!("/v1/jobs/{watched}/events"));
    let mut events = events.send().await.unwrap();
    until_event(&mut events, |job| job["progress"].as_f64() > Some(0.0)).await;
    one.cancel(&watched).await;
    until_event(&mut events, |job| job["state"] == "cancelled").await;

    let solved = one.submit(&case("solved once")).await;
    one.until(&solved, "succeeded").await;
    let again = other.post("/v1/jobs", &case("again")).await.is(202);
    assert_eq!(again.json["cached"], true, "{}", again.text);
}

#[tokio::test]
async fn a_worker_that_stood_still_for_longer_than_its_lease_changes_nothing() {
    let url = or_skip!(tables().await);
    let api = node(&url, "serve", &[]);
    let paused = node(&url, "worker", &[]);
    let id = api.submit(&long_case("taken over", 1_000)).await;
    let path = format!("/v1/jobs/{id}");
    api.until(&id, "running").await;
    paused.signal("STOP");
    let other = node(&url, "worker", &[]);
    let job = api.until(&id, "succeeded").await;
    let result = api.get(&format!("{path}/result")).await;
    other.stop().await;
    paused.signal("CONT");
    // The worker continues with other jobs. The job that it held is lost to it.
    let next = api.submit(&case("next")).await;
    api.until(&next, "succeeded").await;
    assert_eq!(api.get(&path).await, job);
    assert_eq!(api.get(&format!("{path}/result")).await, result);
}

#[tokio::test(flavor = "multi_thread")]
async fn rows_of_a_worker_that_was_cut_off_inside_a_transaction_are_free_soon() {
    let url = or_skip!(tables().await);
    // The first claim takes a second. A sequence counts it even if it is rolled back.
    let slow = "CREATE SEQUENCE claims; CREATE FUNCTION slow() RETURNS trigger LANGUAGE plpgsql AS $$ \
         BEGIN IF nextval('claims') = 1 THEN PERFORM pg_sleep(1); END IF; RETURN NULL; END $$; \
         CREATE TRIGGER slow AFTER UPDATE ON jobs FOR EACH ROW \
         WHEN (NEW.state = 'running' AND OLD.state = 'queued') EXECUTE FUNCTION slow()";
    let pool = sqlx::PgPool::connect(&url).await.unwrap();
    sqlx::raw_sql(slow).execute(&pool).await.unwrap();
    let (with_port, port) = postgres::at_port(&url);
    let cable = Cable::to(port).await;
    let api = node(&url, "serve", &[]);
    let _cut_off = node(&with_port(cable.address.port()), "worker", &[]);
    let id = api.submit(&case("claimed twice")).await;
    let sleeping = "SELECT COUNT(*) FROM pg_stat_activity WHERE datname = current_database() AND wait_event = 'PgSleep'";
    until("the claim is under way", async || {
        let count: i64 = sqlx::query_scalar(sleeping).fetch_one(&pool).await.unwrap();
        count > 0
    })
    .await;
    cable.swallow();
    let _other = node(&url, "worker", &[]);
    let ended = tokio::time::timeout(WITHIN, api.until(&id, "succeeded"));
    let job = ended.await.expect("the rows are free soon");
    assert_eq!(job["attempt"], 1, "the first claim never happened: {job}");
}

#[tokio::test]
async fn a_node_says_what_is_wrong_with_its_database() {
    let url = or_skip!(postgres::database().await);
    let folder = tempfile::tempdir().unwrap();
    let serve = |words: &[&str]| {
        let mut command = railhead();
        command.args(words).arg("--data-dir").arg(folder.path());
        let (done, said) = said_by(&mut command, &["--listen", "127.0.0.1:0"]);
        assert!(!done);
        said
    };
    let said = serve(&["serve", "--database-url", &url]);
    assert!(said.contains("railhead migrate"), "{said}");
    let said = serve(&["serve", "--workers", "0"]);
    assert!(said.contains("--database-url"), "{said}");
    let said = serve(&["worker"]);
    assert!(said.contains("--database-url"), "{said}");
    let nowhere = "postgres://u:hush@127.0.0.1:1/d";
    let said = serve(&["serve", "--database-url", nowhere]);
    assert!(said.contains("refused") && !said.contains("hush"), "{said}");
    let said = serve(&["serve", "--database-url", "nonsense"]);
    assert!(said.contains("postgres://"), "{said}");
    std::fs::write(folder.path().join("jobs.db"), "").unwrap();
    let said = serve(&["serve", "--database-url", &url]);
    assert!(said.contains("--data-dir"), "{said}");
    let words = ["config", "--database-url", "postgres://u:hush@h/d"];
    let (_, configured) = said_by(&mut railhead(), &words);
    assert!(!configured.contains("hush"), "{configured}");
    assert!(configured.contains("database-url"), "{configured}");
}
