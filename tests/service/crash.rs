//! Does a job that was acknowledged survive the death of the process?

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use reqwest::Method;
use serde_json::Value;

use crate::server::Answer;
use crate::support::{Service, long_case, pause};

const JOBS: usize = 50;
/// Motions per job: enough to be met while running.
const MOTIONS: u32 = 60;

async fn count(service: &Service, state: &str) -> usize {
    let list = service
        .get(&format!("/v1/jobs?limit=1000&state={state}"))
        .await;
    list["jobs"].as_array().unwrap().len()
}

/// Waits until so many jobs have succeeded while another is running.
async fn until_busy(service: &Service, succeeded: usize) {
    while count(service, "succeeded").await < succeeded || count(service, "running").await == 0 {
        assert!(count(service, "failed").await == 0, "no job may fail");
        pause().await;
    }
}

/// The succeeded jobs as the API shows them, by id.
async fn succeeded(service: &Service) -> BTreeMap<String, Value> {
    let list = service.get("/v1/jobs?limit=1000&state=succeeded").await;
    let jobs = list["jobs"].as_array().unwrap().iter();
    jobs.map(|job| (job["id"].as_str().unwrap().to_owned(), job.clone()))
        .collect()
}

/// The folders below `results` that hold a solution, one entry per job and attempt.
fn stored_solutions(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    // There is no folder as long as every result is small.
    for entry in std::fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(stored_solutions(&path));
        } else if path.file_name().unwrap() == "solution.json" {
            let job = path
                .parent()
                .unwrap()
                .parent()
                .unwrap()
                .file_name()
                .unwrap();
            found.push(job.to_str().unwrap().to_owned());
        }
    }
    found
}

#[tokio::test]
async fn every_acknowledged_job_succeeds_once_although_the_process_is_killed_twice() {
    let folder = tempfile::tempdir().unwrap();
    // The cases are alike; each shall be solved.
    let flags = ["--workers", "2", "--cache", "false"];
    let service = Service::start(folder.path(), &flags);
    let mut ids = BTreeSet::new();
    for number in 0..JOBS {
        ids.insert(
            service
                .submit(&long_case(&format!("case {number}"), MOTIONS))
                .await,
        );
    }
    assert_eq!(ids.len(), JOBS);

    until_busy(&service, 3).await;
    let before_first = succeeded(&service).await;
    let mut met = count(&service, "running").await;
    service.kill();

    let service = Service::start(folder.path(), &flags);
    until_busy(&service, before_first.len() + 3).await;
    let before_second = succeeded(&service).await;
    met += count(&service, "running").await;
    service.kill();

    let service = Service::start(folder.path(), &flags);
    while count(&service, "succeeded").await < JOBS {
        assert_eq!(count(&service, "failed").await, 0);
        pause().await;
    }
    let after = succeeded(&service).await;
    assert_eq!(after.keys().cloned().collect::<BTreeSet<_>>(), ids);
    for earlier in [before_first, before_second] {
        for (id, job) in earlier {
            assert_eq!(after[&id], job, "what had succeeded was not touched again");
        }
    }
    // Attempts do not tell: what died together is tried again uncounted.
    assert!(met > 0, "the kills met running jobs");

    for id in &ids {
        let result = service.get(&format!("/v1/jobs/{id}/result")).await;
        assert_eq!(result["total"].as_array().unwrap().len(), MOTIONS as usize);
        assert!(result["total"][0]["force_x_n"].as_f64().unwrap() != 0.0);
    }
    // Results that are not small lie in folders. What an attempt that died has written is removed within seconds.
    loop {
        let stored = stored_solutions(&folder.path().join("results"));
        let distinct: BTreeSet<_> = stored.iter().cloned().collect();
        if stored.len() == distinct.len() {
            assert!(distinct.is_subset(&ids));
            return;
        }
        pause().await;
    }
}

#[tokio::test]
async fn an_idempotency_key_outlives_the_process() {
    let folder = tempfile::tempdir().unwrap();
    let case = long_case("once", 2);
    let mut ids = BTreeSet::new();
    for _ in 0..2 {
        let service = Service::start(folder.path(), &[]);
        let submit = service.request(Method::POST, "/v1/jobs");
        let submit = submit.header("Idempotency-Key", "k1").json(&case);
        let job = Answer::to(submit).await.is(202).json;
        ids.insert(job["id"].as_str().unwrap().to_owned());
        service.kill();
    }
    assert_eq!(ids.len(), 1);
}
