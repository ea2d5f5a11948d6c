//! Several nodes on one database, as real processes: does each job end once, and is it seen everywhere, whoever dies?

use std::collections::BTreeSet;
use std::process::Command;
use std::time::{Duration, Instant};

use reqwest::Method;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::cluster::cable::Cable;
use crate::cluster::postgres;
use crate::support::{Service, case, endless_case, long_case, pause, railhead};

/// Ends of a guard: something hangs.
const WITHIN: Duration = Duration::from_secs(90);

/// Nodes on one database. Each has a folder of its own.
struct Nodes {
    url: String,
    folders: Vec<TempDir>,
}

impl Nodes {
    /// An empty database with the job table in it.
    async fn new() -> Option<Nodes> {
        let url = postgres::database().await?;
        let made = railhead_with(&url, &["migrate"]);
        assert!(made.contains("was made"), "{made}");
        Some(Nodes {
            url,
            folders: Vec::new(),
        })
    }

    fn start(&mut self, worker: bool, flags: &[&str]) -> Service {
        let folder = tempfile::tempdir().unwrap();
        let mut all = vec!["--database-url", &self.url, "--lease-s", "2"];
        if !flags.contains(&"--cache") {
            all.extend(["--cache", "false"]);
        }
        all.extend(flags);
        let service = match worker {
            true => Service::start_worker(folder.path(), &all),
            false => Service::start(folder.path(), &all),
        };
        self.folders.push(folder);
        service
    }

    fn api(&mut self) -> Service {
        self.start(false, &["--workers", "0"])
    }

    fn worker(&mut self) -> Service {
        self.start(true, &["--workers", "1"])
    }
}

/// What the program says about a database.
fn railhead_with(url: &str, words: &[&str]) -> String {
    let done = railhead()
        .args(words)
        .env("RAILHEAD_DATABASE_URL", url)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&done.stdout).into_owned();
    let error = String::from_utf8_lossy(&done.stderr).into_owned();
    format!("{said}{error}")
}

async fn in_state(service: &Service, state: &str) -> Vec<Value> {
    let list = service
        .get(&format!("/v1/jobs?limit=1000&state={state}"))
        .await;
    list["jobs"].as_array().unwrap().clone()
}

async fn until(what: &str, mut done: impl AsyncFnMut() -> bool) {
    let since = Instant::now();
    while !done().await {
        assert!(since.elapsed() < WITHIN, "{what}");
        pause().await;
    }
}

fn has_log(service: &Service, text: &str) -> bool {
    service.log_text().contains(text)
}

/// The path of a batch of 60 cases with a key, and whether it was there.
async fn send_batch(service: &Service) -> (String, bool) {
    let lines: Vec<String> = (0..60)
        .map(|n| case(&format!("line {n}")).to_string())
        .collect();
    let answer = service
        .request(Method::POST, "/v1/batches")
        .header("Content-Type", "application/x-ndjson")
        .header("Idempotency-Key", "one-batch")
        .body(lines.join("\n"))
        .send()
        .await
        .unwrap();
    assert!(answer.status().is_success(), "{}", answer.status());
    let replayed = answer.headers().contains_key("Idempotency-Replayed");
    let batch: Value = answer.json().await.unwrap();
    let path = format!("/v1/batches/{}", batch["id"].as_str().unwrap());
    (path, replayed)
}

#[tokio::test]
async fn each_job_ends_once_and_is_read_everywhere_although_a_worker_and_an_api_node_are_killed() {
    let Some(mut nodes) = Nodes::new().await else {
        return;
    };
    let (first, second) = (nodes.api(), nodes.api());
    let (doomed, survivor) = (nodes.worker(), nodes.worker());
    let mut ids = BTreeSet::new();
    for number in 0..24 {
        let api = if number % 2 == 0 { &first } else { &second };
        let motions = if number % 6 == 0 { 40 } else { 2 };
        let case = long_case(&format!("case {number}"), motions);
        ids.insert(api.submit(&case).await);
    }
    // A batch is taken by one node and solved by all.
    let (batch, replayed) = send_batch(&second).await;
    assert!(!replayed);

    until("both workers solve", async || {
        in_state(&second, "running").await.len() > 1
            && !in_state(&second, "succeeded").await.is_empty()
    })
    .await;
    doomed.kill();
    first.kill();
    let third = nodes.api();
    until("all jobs end", async || {
        // One look: between two of them a job could go back to the queue and be in neither.
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
    // The key of the batch is known to all.
    assert_eq!(send_batch(&third).await, (batch, true));
    assert_eq!(in_state(&third, "succeeded").await.len(), ids.len() + 60);
    assert!(!has_log(&survivor, "panicked"));
    let said = railhead_with(&nodes.url, &["doctor"]);
    assert!(said.contains("ok\tnodes seen within 20 s"), "{said}");
}

#[tokio::test]
async fn a_job_is_cancelled_and_waited_for_at_a_node_that_does_not_solve_it() {
    let Some(mut nodes) = Nodes::new().await else {
        return;
    };
    let (one, other) = (nodes.api(), nodes.api());
    let worker = nodes.worker();
    let endless = one.submit(&endless_case("endless")).await;
    one.until(&endless, "running").await;
    // A client waits at one node for the end that is requested at the other.
    let waiting = one
        .request(Method::GET, &format!("/v1/jobs/{endless}"))
        .header("Prefer", "wait=30")
        .send();
    let cancel = other
        .request(Method::POST, &format!("/v1/jobs/{endless}/cancel"))
        .send();
    let (waited, cancelled) = tokio::join!(waiting, cancel);
    assert_eq!(cancelled.unwrap().status(), 202);
    let waited: Value = waited.unwrap().json().await.unwrap();
    assert_eq!(waited["state"], "cancelled", "{waited}");

    // A key that is made by the command opens every node.
    let secret = railhead_with(&nodes.url, &["keys", "create", "--tenant", "depot"]);
    let secret = secret.lines().next().unwrap().to_owned();
    let answer = other
        .request(Method::GET, "/v1/me")
        .bearer_auth(&secret)
        .send()
        .await
        .unwrap();
    let me: Value = answer.json().await.unwrap();
    assert_eq!(me["tenant"], "depot", "{me}");

    // An orderly end hands a running job back without counting the attempt.
    let endless = one.submit(&endless_case("endless")).await;
    one.until(&endless, "running").await;
    worker.signal("TERM");
    assert!(worker.wait().success());
    let job = one.until(&endless, "queued").await;
    assert_eq!(job["attempt"], 0, "{job}");
}

/// Reads a stream of events until one of them passes.
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
    let Some(mut nodes) = Nodes::new().await else {
        return;
    };
    let flags = ["--workers", "0", "--cache", "true"];
    let (one, other) = (nodes.start(false, &flags), nodes.start(false, &flags));
    let _worker = nodes.start(true, &["--workers", "1", "--cache", "true"]);
    let watched = one.submit(&endless_case("watched")).await;
    let events = other.request(Method::GET, &format!("/v1/jobs/{watched}/events"));
    let mut events = events.send().await.unwrap();
    until_event(&mut events, |job| job["progress"].as_f64() > Some(0.0)).await;
    let cancel = format!("/v1/jobs/{watched}/cancel");
    one.request(Method::POST, &cancel).send().await.unwrap();
    until_event(&mut events, |job| job["state"] == "cancelled").await;

    let solved = one.submit(&case("solved once")).await;
    one.until(&solved, "succeeded").await;
    let again = other.request(Method::POST, "/v1/jobs").json(&case("again"));
    let again: Value = again.send().await.unwrap().json().await.unwrap();
    assert_eq!(again["cached"], true, "{again}");
}

#[tokio::test]
async fn a_worker_that_stood_still_for_longer_than_its_lease_changes_nothing() {
    let Some(mut nodes) = Nodes::new().await else {
        return;
    };
    let api = nodes.api();
    let paused = nodes.worker();
    let id = api.submit(&long_case("taken over", 60)).await;
    let path = format!("/v1/jobs/{id}");
    api.until(&id, "running").await;
    paused.signal("STOP");
    let other = nodes.worker();
    let job = api.until(&id, "succeeded").await;
    let result = api.get(&format!("{path}/result")).await;
    other.signal("TERM");
    assert!(other.wait().success());
    paused.signal("CONT");
    // It works on: with what it held it is done.
    let next = api.submit(&case("next")).await;
    api.until(&next, "succeeded").await;
    assert_eq!(api.get(&path).await, job);
    assert_eq!(api.get(&format!("{path}/result")).await, result);
}

#[tokio::test(flavor = "multi_thread")]
async fn rows_of_a_worker_that_was_cut_off_inside_a_transaction_are_free_soon() {
    let Some(mut nodes) = Nodes::new().await else {
        return;
    };
    // The first claim takes a second; a sequence counts those that are rolled back, too.
    let slow = "CREATE SEQUENCE claims; CREATE FUNCTION slow() RETURNS trigger LANGUAGE plpgsql AS $$ \
         BEGIN IF nextval('claims') = 1 THEN PERFORM pg_sleep(1); END IF; RETURN NULL; END $$; \
         CREATE TRIGGER slow AFTER UPDATE ON jobs FOR EACH ROW \
         WHEN (NEW.state = 'running' AND OLD.state = 'queued') EXECUTE FUNCTION slow()";
    let pool = sqlx::PgPool::connect(&nodes.url).await.unwrap();
    sqlx::raw_sql(slow).execute(&pool).await.unwrap();
    let direct = nodes.url.clone();
    let (with_port, port) = postgres::at_port(&direct);
    let cable = Cable::to(port).await;
    let api = nodes.api();
    nodes.url = with_port(cable.address.port());
    let _cut_off = nodes.worker();
    nodes.url.clone_from(&direct);
    let id = api.submit(&case("claimed twice")).await;
    let sleeping = "SELECT COUNT(*) FROM pg_stat_activity WHERE datname = current_database() AND wait_event = 'PgSleep'";
    until("the claim is under way", async || {
        let count: i64 = sqlx::query_scalar(sleeping).fetch_one(&pool).await.unwrap();
        count > 0
    })
    .await;
    cable.swallow();
    let _other = nodes.worker();
    let since = Instant::now();
    let job = api.until(&id, "succeeded").await;
    assert_eq!(job["attempt"], 1, "the first claim never happened: {job}");
    assert!(since.elapsed() < WITHIN);
}

#[tokio::test]
async fn a_node_says_what_is_wrong_with_its_database() {
    let Some(url) = postgres::database().await else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let serve = |words: &[&str]| {
        let mut command: Command = railhead();
        command.args(words).arg("--data-dir").arg(folder.path());
        let done = command.args(["--listen", "127.0.0.1:0"]).output().unwrap();
        assert!(!done.status.success());
        String::from_utf8_lossy(&done.stderr).into_owned()
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
    // Several may make the tables at once; one of them does.
    let makers: Vec<_> = (0..4)
        .map(|_| {
            let mut command = railhead();
            command.arg("migrate").env("RAILHEAD_DATABASE_URL", &url);
            command.stdout(std::process::Stdio::piped());
            command.spawn().unwrap()
        })
        .collect();
    let made = makers.into_iter().map(|maker| {
        let done = maker.wait_with_output().unwrap();
        assert!(done.status.success());
        String::from_utf8_lossy(&done.stdout).contains("was made")
    });
    assert_eq!(made.filter(|made| *made).count(), 1);
    let configured = railhead()
        .args(["config", "--database-url", "postgres://u:hush@h/d"])
        .output()
        .unwrap();
    let configured = String::from_utf8_lossy(&configured.stdout).into_owned();
    assert!(!configured.contains("hush"), "{configured}");
    assert_eq!(json!(configured.contains("database-url")), json!(true));
}
