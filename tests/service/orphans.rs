//! Tests orphaned results, which a killed process left behind.

use std::path::{Path, PathBuf};
use std::time::Duration;

use railhead::jobs::State;
use uuid::Uuid;

use crate::lab::Lab;
use crate::support::{case, pause};

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
