//! Is a damaged job table noticed, and said so?

use railhead::jobs::{Jobs, JobsError, Options};

use crate::batches::small;
use crate::errors::assert_problem;
use crate::support::{Service, open};

#[tokio::test]
async fn a_table_that_was_damaged_is_refused_after_an_unclean_end() {
    let folder = tempfile::tempdir().unwrap();
    let jobs = open(Options::new(folder.path()), railhead::contact::solve).await;
    for number in 0..200 {
        jobs.submit(small(&number.to_string()), None).await.unwrap();
    }
    jobs.shutdown(std::time::Duration::ZERO).await;
    let file = folder.path().join("jobs.db");
    let mut bytes = std::fs::read(&file).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle..middle + 8192].fill(0xA5);
    std::fs::write(&file, bytes).unwrap();
    // As after a kill: nothing says that the table was closed.
    std::fs::remove_file(folder.path().join("closed")).unwrap();
    match Jobs::open(Options::new(folder.path())).await {
        Err(JobsError::TableDamaged(_)) => {}
        Err(JobsError::Store(error)) => {
            assert!(error.to_string().contains("malformed"), "{error}");
        }
        other => panic!("{other:?}"),
    }
}

#[tokio::test]
async fn a_table_that_is_damaged_under_a_service_is_told_by_probes_metrics_and_refusals() {
    let folder = tempfile::tempdir().unwrap();
    let jobs = open(Options::new(folder.path()), railhead::contact::solve).await;
    for number in 0..400 {
        jobs.submit(small(&number.to_string()), None).await.unwrap();
    }
    jobs.shutdown(std::time::Duration::ZERO).await;
    // After an orderly end nobody looks for damage at the start: it is met while the service runs. What the tables begin with
    // lies in front.
    let file = folder.path().join("jobs.db");
    let mut bytes = std::fs::read(&file).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle..].fill(0xA5);
    std::fs::write(&file, bytes).unwrap();
    let service = Service::start(folder.path(), &["--cache", "false"]);
    let mut refusal = None;
    for _ in 0..50 {
        let answer = service.post("/v1/jobs", &small("more")).await;
        if answer.status != 202 {
            refusal = Some(answer);
            break;
        }
    }
    let refusal = refusal.expect("a damaged table takes no jobs");
    assert_problem(&refusal, 503, "storage-unwritable", "");
    assert!(refusal.header("retry-after").is_some());
    let metrics = service.ask("/metrics").await.is(200).text;
    let failing = "\nrailhead_storage_failing 1\n";
    assert!(metrics.contains(failing), "{metrics}");
    service.ask("/healthz").await.is(200);
    service.ask("/readyz").await.is(503);
}
