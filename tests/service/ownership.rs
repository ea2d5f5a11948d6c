//! Tests stored results that are removed while they are read, and results left behind by a killed process.

use std::path::{Path, PathBuf};
use std::time::Duration;

use railhead::jobs::State;
use serde_json::json;
use uuid::Uuid;

use crate::batches::results;
use crate::lab::Lab;
use crate::results::path_of;
use crate::server::{Server, Setup, link};
use crate::support::{case, files_below, loaded, pause};

/// Starts a service that stores every result in a folder. Returns it with the folder.
async fn in_folders() -> (Server, PathBuf) {
    let mut setup = Setup::new();
    setup.options.small_result_max_bytes = 0;
    let folder = setup.options.data_dir.join("results");
    (setup.start().await, folder)
}

#[tokio::test]
async fn reads_that_race_with_removal_are_answered_404_or_410_and_never_500() {
    let (server, _) = in_folders().await;
    for round in 0..6 {
        let path = path_of(&server.solve(&loaded(50_000 + round)).await);
        let reads = ["tractions", "result"].map(|part| format!("{path}/{part}"));
        let read = async |path: &str| {
            let mut seen = Vec::new();
            for _ in 0..20 {
                seen.push(server.get(path).await.status);
            }
            seen
        };
        let delete = async {
            tokio::time::sleep(Duration::from_millis(3) * round as u32).await;
            server.delete(&path).await.status
        };
        let (fields, result, deleted) = tokio::join!(read(&reads[0]), read(&reads[1]), delete);
        assert_eq!(deleted, 204);
        for status in fields.into_iter().chain(result) {
            assert!([200, 404, 410].contains(&status), "{status}");
        }
    }
}

#[tokio::test]
async fn a_result_whose_file_is_gone_costs_one_line_of_a_batch() {
    let (server, folder) = in_folders().await;
    let cases = [60_000, 60_001, 60_002].map(loaded);
    let batch = server.post("/v1/batches", &json!(cases)).await.json;
    let lines = results(&server, &batch, "?wait=60").await;
    let lost = lines[1]["id"].as_str().expect("an id");
    for file in files_below(&folder) {
        if file.to_string_lossy().contains(lost) {
            std::fs::remove_file(file).unwrap();
        }
    }
    let lines = results(&server, &batch, "").await;
    assert_eq!(lines.len(), 3);
    assert_eq!(
        lines[1]["error"]["type"], "/problems/internal",
        "{}",
        lines[1]
    );
    assert!(lines[0]["result"].is_object() && lines[2]["result"].is_object());
    let results = link(&batch, "results");
    let table = server.get(&format!("{results}?format=csv")).await;
    let rows: Vec<_> = table.text.lines().skip(1).collect();
    assert_eq!(rows.len(), 3, "{}", table.text);
    assert!(rows[1].ends_with("cannot be read"), "{}", rows[1]);
}

/// Returns the file of the only result in this folder.
fn only_solution(folder: &Path) -> PathBuf {
    let mut path = folder.to_owned();
    while path.is_dir() {
        path = if path.join("solution.json").exists() {
            path.join("solution.json")
        } else {
            let mut entries = std::fs::read_dir(&path).unwrap();
            entries.next().unwrap().unwrap().path()
        };
    }
    path
}

/// Copies a stored result as the result of another job. Returns the path of the copy.
fn copied(kept_file: &Path, of: Uuid, to: Uuid) -> PathBuf {
    let path = kept_file.to_str().unwrap();
    let copy = PathBuf::from(path.replace(&of.to_string(), &to.to_string()));
    std::fs::create_dir_all(copy.parent().unwrap()).unwrap();
    std::fs::copy(kept_file, &copy).unwrap();
    copy
}

async fn until_gone(file: &Path) {
    while file.parent().unwrap().exists() {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

#[tokio::test]
async fn results_without_a_job_are_swept_at_the_start() {
    let lab = Lab::idle(|options| options.small_result_max_bytes = 0).await;
    let kept = lab.submit(case("kept")).await;
    lab.jobs.worker("w").unwrap().step().await.unwrap();
    let kept_file = only_solution(&lab.folder.path().join("results"));
    let orphan = copied(&kept_file, kept, Uuid::now_v7());

    lab.jobs.start().unwrap();
    until_gone(orphan.parent().unwrap()).await;
    lab.jobs.shutdown(Duration::from_secs(10)).await;
    assert!(kept_file.exists());
}

#[tokio::test]
async fn a_result_of_an_earlier_attempt_is_swept_once_its_job_no_longer_runs() {
    let lab = Lab::idle(|options| options.small_result_max_bytes = 0).await;
    let kept = lab.submit(case("kept")).await;
    let mut worker = lab.jobs.worker("w").unwrap();
    worker.step().await.unwrap();
    let kept_file = only_solution(&lab.folder.path().join("results"));

    let again = lab.submit(case("long, again")).await;
    let attempt = tokio::spawn(async move { worker.step().await });
    while lab.gate.begun() < 2 {
        pause().await;
    }
    // The copy has the number of an earlier attempt.
    let earlier = copied(&kept_file, kept, again);
    let name = earlier.parent().unwrap().with_file_name("99");
    std::fs::rename(earlier.parent().unwrap(), &name).unwrap();
    let swept = async || lab.jobs.sweep_results().await.unwrap();
    assert_eq!(swept().await, 0, "it could be the running attempt's");

    lab.gate.set_open(true);
    attempt.await.unwrap().unwrap();
    assert_eq!(swept().await, 1);
    assert!(!name.exists());
    assert_eq!(lab.get(again).await.state, State::Succeeded);
    assert!(kept_file.exists());
}
