//! Tests that a node refuses a result store other than that of its database, and that only results without a job are swept.

use std::path::Path;
use std::time::{Duration, SystemTime};

use railhead::jobs::options::{Database, NotifyMode};
use railhead::jobs::result_place::examine_results;
use railhead::jobs::result_place::url::ResultsPlace;
use railhead::jobs::{Jobs, Options};
use uuid::Uuid;

use crate::cluster::tables;
use crate::support::{case, files_below};

fn folder_place(folder: &Path, shared: bool) -> ResultsPlace {
    let url = format!("file://{}", folder.display());
    ResultsPlace {
        url: url.parse().unwrap(),
        shared,
    }
}

/// Returns options of a node that stores every result as a large one.
fn options(url: &str, data_dir: &Path, results: Option<ResultsPlace>) -> Options {
    Options {
        database: Some(Database {
            url: url.to_owned(),
            connections: 4,
            notify_mode: NotifyMode::Database,
        }),
        results,
        small_result_max_bytes: 0,
        ..Options::new(data_dir)
    }
}

async fn refusal(options: Options) -> String {
    let refused = Jobs::open(options).await;
    refused.expect_err("it is refused").to_string()
}

/// Solves one case on a node and shuts it down.
async fn solve_one(options: Options) {
    let jobs = Jobs::open(options).await.unwrap();
    jobs.start().unwrap();
    let job = jobs.submit(case("one"), None).await.unwrap();
    let job = jobs.wait(job.id, Duration::from_secs(60)).await.unwrap();
    assert_eq!(job.state.name(), "succeeded");
    jobs.shutdown(Duration::from_secs(5)).await;
}

#[tokio::test]
async fn a_node_is_refused_that_would_look_for_the_results_elsewhere() {
    let url = or_skip!(tables().await);
    let folders: [_; 4] = std::array::from_fn(|_| tempfile::tempdir().unwrap());
    let [data, place, elsewhere, embedded] = &folders;
    let shared = folder_place(place.path(), true);

    let said = refusal(options(
        &url,
        data.path(),
        Some(folder_place(place.path(), false)),
    ))
    .await;
    assert!(said.contains("--results-shared"), "{said}");
    let alone = Options {
        results: Some(shared.clone()),
        ..Options::new(embedded.path())
    };
    let said = refusal(alone).await;
    assert!(said.contains("--database-url"), "{said}");

    solve_one(options(&url, data.path(), Some(shared.clone()))).await;
    assert!(place.path().join("results").is_dir());
    let said = refusal(options(&url, data.path(), None)).await;
    assert!(
        said.contains("start the node with --results-url file://"),
        "{said}"
    );
    let other_place = folder_place(elsewhere.path(), true);
    let said = refusal(options(&url, data.path(), Some(other_place.clone()))).await;
    assert!(
        said.contains("the results of this database are in file://"),
        "{said}"
    );

    // Another database refuses the store of the first one, and a database that keeps its own results refuses another store.
    let second = tables().await.unwrap();
    let said = refusal(options(&second, data.path(), Some(shared.clone()))).await;
    assert!(said.contains("results of another database"), "{said}");
    solve_one(options(&second, data.path(), None)).await;
    let said = refusal(options(&second, data.path(), Some(other_place))).await;
    assert!(said.contains("in the database itself"), "{said}");

    // The store may be moved to another path. A missing store is refused.
    let looked = examine_results(&url, Some(&shared)).await.unwrap();
    assert!(!looked.wrong, "{looked:?}");
    let moved = elsewhere.path().join("moved");
    std::fs::rename(place.path(), &moved).unwrap();
    let said = refusal(options(&url, data.path(), Some(shared))).await;
    assert!(said.contains("railhead.json"), "{said}");
    solve_one(options(&url, data.path(), Some(folder_place(&moved, true)))).await;
}

#[tokio::test]
async fn only_old_results_that_no_job_refers_to_are_swept() {
    let url = or_skip!(tables().await);
    let (data, place) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let options = || options(&url, data.path(), Some(folder_place(place.path(), true)));
    solve_one(options()).await;
    let month = place.path().join("results/2026/11");
    let [old, young] = std::array::from_fn(|_| month.join(Uuid::now_v7().to_string()).join("7"));
    for key in [&old, &young] {
        std::fs::create_dir_all(key).unwrap();
        std::fs::write(key.join("solution.json"), "{}").unwrap();
    }
    let long_ago = SystemTime::now() - Duration::from_secs(2 * 24 * 3600);
    let mut kept = 0;
    for file in files_below(place.path()) {
        if !file.starts_with(&young) {
            let file = std::fs::File::options().write(true).open(file).unwrap();
            file.set_modified(long_ago).unwrap();
            kept += 1;
        }
    }
    let jobs = Jobs::open(options()).await.unwrap();
    assert_eq!(jobs.sweep_results().await.unwrap(), 1);
    assert!(!old.exists() && young.exists());
    // The marker and the result of the job remain.
    assert!(kept > 2);
    assert_eq!(files_below(place.path()).len(), kept);
    jobs.shutdown(Duration::ZERO).await;
}
