//! Results outside the table that no job refers to: what a process left behind that was killed before it could tell of them.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, mpsc};
use std::time::Duration;

use railhead::contact::solve;
use railhead::jobs::{Options, State};
use uuid::Uuid;

use crate::support::{case, open};

/// The file of the only result in this folder.
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

/// The same result once more, as that of this job.
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

fn in_folders(folder: &Path) -> Options {
    Options {
        small_result_max_bytes: 0,
        ..Options::new(folder)
    }
}

#[tokio::test]
async fn results_without_a_job_are_swept_at_the_start() {
    let folder = tempfile::tempdir().unwrap();
    let jobs = open(in_folders(folder.path()), solve).await;
    let kept = jobs.submit(case("kept"), None).await.unwrap().id;
    jobs.worker("w").unwrap().step().await.unwrap();
    let kept_file = only_solution(&folder.path().join("results"));
    let orphan = copied(&kept_file, kept, Uuid::now_v7());

    jobs.start().unwrap();
    until_gone(orphan.parent().unwrap()).await;
    jobs.shutdown(Duration::from_secs(10)).await;
    assert!(kept_file.exists());
}

#[tokio::test]
async fn a_result_of_an_earlier_attempt_is_swept_although_its_job_runs_again_when_it_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let (go_on, may_go_on) = mpsc::channel::<()>();
    let may_go_on = Mutex::new(may_go_on);
    let jobs = open(in_folders(folder.path()), move |case, monitor| {
        may_go_on.lock().unwrap().recv().unwrap();
        solve(case, monitor)
    })
    .await;
    go_on.send(()).unwrap();
    let kept = jobs.submit(case("kept"), None).await.unwrap().id;
    let mut worker = jobs.worker("w").unwrap();
    worker.step().await.unwrap();
    let kept_file = only_solution(&folder.path().join("results"));

    let again = jobs.submit(case("again"), None).await.unwrap().id;
    let attempt = tokio::spawn(async move { worker.step().await });
    while jobs.get(again).await.unwrap().state != State::Running {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    // The number of an attempt that is over.
    let earlier = copied(&kept_file, kept, again);
    let name = earlier.parent().unwrap().with_file_name("99");
    std::fs::rename(earlier.parent().unwrap(), &name).unwrap();
    jobs.start().unwrap();
    tokio::time::sleep(Duration::from_millis(200)).await;
    assert!(name.exists(), "it could be the running attempt's");

    go_on.send(()).unwrap();
    attempt.await.unwrap().unwrap();
    until_gone(&name.join("solution.json")).await;
    assert_eq!(jobs.get(again).await.unwrap().state, State::Succeeded);
    jobs.shutdown(Duration::from_secs(10)).await;
    assert!(kept_file.exists());
}
