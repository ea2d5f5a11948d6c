//! Is everything of a data folder there after it was moved into a database, and is nothing moved twice?

use std::collections::BTreeMap;
use std::process::Command;

use reqwest::Method;
use serde_json::{Value, json};

use crate::cluster::postgres::database;
use crate::cluster::seaweed::{railhead_at, server};
use crate::support::{Service, case, endless_case, long_case, railhead};

/// What the program says about a data folder and a database, and whether it succeeded.
fn say(words: &[&str]) -> (bool, String) {
    said_by(&mut railhead(), words)
}

fn said_by(program: &mut Command, words: &[&str]) -> (bool, String) {
    let done = program.args(words).output().unwrap();
    let said = [done.stdout, done.stderr].concat();
    (
        done.status.success(),
        String::from_utf8_lossy(&said).into_owned(),
    )
}

/// Answers to paths as a client sees them.
async fn read(service: &Service, paths: &[String]) -> BTreeMap<String, Value> {
    let mut answers = BTreeMap::new();
    for path in paths {
        answers.insert(path.clone(), service.get(path).await);
    }
    answers
}

/// Has a small and a large result and those of a batch; where they are read.
async fn fill(before: &Service) -> Vec<String> {
    let small = before.submit(&case("small")).await;
    let mut large = long_case("large", 12);
    large["outputs"] = json!(["resultants", "tractions"]);
    let large = before.submit(&large).await;
    let lines = [case("first"), case("second")]
        .map(|case| case.to_string())
        .join("\n");
    let batch = before
        .request(Method::POST, "/v1/batches")
        .header("Content-Type", "application/x-ndjson");
    let batch: Value = batch
        .body(lines)
        .send()
        .await
        .unwrap()
        .json()
        .await
        .unwrap();
    let batch = format!("/v1/batches/{}", batch["id"].as_str().unwrap());
    for id in [&small, &large] {
        before.until(id, "succeeded").await;
    }
    while before.get(&batch).await["states"]["succeeded"] != 2 {
        crate::support::pause().await;
    }
    let mut paths = vec![batch];
    for id in [&small, &large] {
        paths.extend([format!("/v1/jobs/{id}"), format!("/v1/jobs/{id}/result")]);
    }
    paths
}

/// Old results and old jobs are used, and new ones are made.
async fn goes_on(after: &Service, running: &str) {
    // A result that was moved answers the same case, and new results have keys of their own.
    let again = after
        .request(Method::POST, "/v1/jobs")
        .json(&case("small"))
        .send();
    let again: Value = again.await.unwrap().json().await.unwrap();
    assert_eq!(again["cached"], true, "{again}");
    after.until(running, "running").await;
    let mut new = case("new");
    new["load"]["normal_force_n"] = json!(61_000);
    let new = after.submit(&new).await;
    after.until(&new, "succeeded").await;
    let cancel = format!("/v1/jobs/{running}/cancel");
    after.request(Method::POST, &cancel).send().await.unwrap();
    after.until(running, "cancelled").await;
}

/// The secret of a key of the tenant `north`.
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
    let Some(url) = database().await else {
        return;
    };
    let [from, to, node, place] = [(); 4].map(|()| tempfile::tempdir().unwrap());
    let folder = from.path().to_str().unwrap();
    let secret = make_key(folder);
    let before = Service::start(from.path(), &["--workers", "1", "--shutdown-grace-s", "0"]);
    let paths = fill(&before).await;
    let running = before.submit(&endless_case("running")).await;
    before.until(&running, "running").await;
    let known = read(&before, &paths).await;

    let results = format!("file://{}", place.path().display());
    let mut words = vec!["move", "--data-dir", folder, "--database-url", &url];
    words.extend(["--results-url", &results, "--results-shared"]);
    assert!(say(&["migrate", "--database-url", &url]).0);
    let (moved, said) = say(&words);
    assert!(!moved && said.contains("in use"), "{said}");
    // As after a power cut: nobody has put the running job back.
    before.kill();
    let (moved, said) = say(&words);
    assert!(moved && said.contains("jobs\t5\n"), "{said}");
    assert!(
        said.contains("large results\t1\n") && said.contains("missing\t0"),
        "{said}"
    );
    let (moved, said) = say(&words);
    assert!(!moved && said.contains("jobs.db"), "{said}");

    let flags = [
        "--database-url",
        &url,
        "--workers",
        "0",
        "--results-url",
        &results,
        "--results-shared",
    ];
    let after = Service::start(node.path(), &flags);
    assert_eq!(read(&after, &paths).await, known);
    assert_eq!(
        after.get(&format!("/v1/jobs/{running}")).await["state"],
        "queued"
    );
    let me = after
        .request(Method::GET, "/v1/me")
        .bearer_auth(&secret)
        .send();
    let me: Value = me.await.unwrap().json().await.unwrap();
    assert_eq!(me["tenant"], "north", "{me}");
    let worker = Service::start_worker(to.path(), &[&flags[..3], &["1"], &flags[4..]].concat());
    goes_on(&after, &running).await;
    drop(worker);

    // Not into a database that has jobs.
    let full = tempfile::tempdir().unwrap();
    drop(Service::start(full.path(), &["--workers", "1"]));
    let (moved, said) = say(&[
        "move",
        "--data-dir",
        full.path().to_str().unwrap(),
        "--database-url",
        &url,
    ]);
    assert!(!moved && said.contains("has jobs"), "{said}");
}

/// Ends a service in good order, so that it is not counted as a living node.
fn stop(service: Service) {
    service.signal("TERM");
    assert!(service.wait().success());
}

#[tokio::test]
async fn results_of_a_database_move_to_another_place_and_from_there_to_a_third() {
    let Some(url) = database().await else {
        return;
    };
    let [node, first, second] = [(); 3].map(|()| tempfile::tempdir().unwrap());
    assert!(say(&["migrate", "--database-url", &url]).0);
    let places =
        [first, second].map(|folder| (format!("file://{}", folder.path().display()), folder));
    let flags = [
        "--database-url",
        &url,
        "--workers",
        "1",
        "--drain-delay-s",
        "0",
    ];
    let mut service = Service::start(node.path(), &flags);
    let paths = fill(&service).await;
    let known = read(&service, &paths).await;
    for (place, _) in &places {
        let words = [
            "move-results",
            "--database-url",
            &url,
            "--results-url",
            place,
        ];
        let (moved, said) = say(&words);
        assert!(!moved && said.contains("--results-shared"), "{said}");
        let words = [&words[..], &["--results-shared"]].concat();
        let (moved, said) = say(&words);
        assert!(!moved && said.contains("1 nodes"), "{said}");
        stop(service);
        let (moved, said) = say(&words);
        assert!(
            moved && said.contains("large results\t1\n") && said.contains("missing\t0"),
            "{said}"
        );
        let (moved, said) = say(&words);
        assert!(!moved && said.contains("already"), "{said}");
        let there = ["--results-url", place, "--results-shared"];
        service = Service::start(node.path(), &[&flags[..], &there].concat());
        assert_eq!(read(&service, &paths).await, known);
    }
    let pool = sqlx::PgPool::connect(&url).await.unwrap();
    let left: i64 = sqlx::query_scalar("SELECT COUNT(*) FROM objects")
        .fetch_one(&pool)
        .await
        .unwrap();
    assert_eq!(left, 0, "what was in the database is not kept twice");
    assert_refused_to_another(&places[1].0).await;
}

#[tokio::test]
async fn results_of_a_database_move_into_a_bucket_and_from_there_into_another() {
    let (Some(url), Some(port)) = (database().await, server()) else {
        return;
    };
    let node = tempfile::tempdir().unwrap();
    assert!(say(&["migrate", "--database-url", &url]).0);
    let at_database = ["--database-url", &url];
    let flags = [
        &at_database[..],
        &["--workers", "1", "--drain-delay-s", "0"],
    ]
    .concat();
    let mut service = Service::start(node.path(), &flags);
    let paths = fill(&service).await;
    let known = read(&service, &paths).await;
    for place in ["s3://first/results", "s3://second/results"] {
        stop(service);
        let there = ["--results-url", place];
        let words = [&["move-results"], &at_database[..], &there].concat();
        let (moved, said) = said_by(&mut railhead_at(port), &words);
        assert!(
            moved && said.contains("large results\t1\n") && said.contains("missing\t0"),
            "{said}"
        );
        let flags = [&flags[..], &there].concat();
        service = Service::start_as(&mut railhead_at(port), "serve", node.path(), &flags);
        assert_eq!(read(&service, &paths).await, known);
    }
    // A node that still names the bucket before is refused.
    stop(service);
    let mut before = railhead_at(port);
    before.args(["serve", "--listen", "127.0.0.1:0", "--data-dir"]);
    before.arg(node.path());
    let (started, said) = said_by(
        &mut before,
        &[&flags[..], &["--results-url", "s3://first/results"]].concat(),
    );
    assert!(!started && said.contains("s3://second/results"), "{said}");
}

/// The place of a database is not given to another one.
async fn assert_refused_to_another(place: &str) {
    let other = database().await.unwrap();
    assert!(say(&["migrate", "--database-url", &other]).0);
    let folder = tempfile::tempdir().unwrap();
    stop(Service::start(
        folder.path(),
        &[
            "--database-url",
            &other,
            "--workers",
            "0",
            "--drain-delay-s",
            "0",
        ],
    ));
    let words = [
        "move-results",
        "--database-url",
        &other,
        "--results-url",
        place,
    ];
    let (moved, said) = say(&[&words[..], &["--results-shared"]].concat());
    assert!(!moved && said.contains("another database"), "{said}");
}
