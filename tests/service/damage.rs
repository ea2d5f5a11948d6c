//! Tests that a damaged job table is detected and reported.

use railhead::jobs::{Jobs, JobsError};

use crate::batches::small;
use crate::errors::assert_problem;
use crate::lab::Lab;
use crate::support::Service;

/// Creates a data folder with this many jobs, shuts down in an orderly way, and overwrites this many bytes from the middle of the table on.
async fn damaged(jobs: usize, bytes: usize) -> Lab {
    let lab = Lab::idle(|_| {}).await;
    for number in 0..jobs {
        lab.submit(small(&number.to_string())).await;
    }
    lab.jobs.shutdown(std::time::Duration::ZERO).await;
    let file = lab.folder.path().join("jobs.db");
    let mut table = std::fs::read(&file).unwrap();
    let middle = table.len() / 2;
    let end = middle.saturating_add(bytes).min(table.len());
    table[middle..end].fill(0xA5);
    std::fs::write(&file, table).unwrap();
    lab
}

#[tokio::test]
async fn a_table_that_was_damaged_is_refused_after_an_unclean_end() {
    let lab = damaged(200, 8192).await;
    // Without this file the table counts as not closed, as after a kill.
    std::fs::remove_file(lab.folder.path().join("closed")).unwrap();
    match Jobs::open(lab.options).await {
        Err(JobsError::TableDamaged(_)) => {}
        Err(JobsError::Store(error)) => {
            assert!(error.to_string().contains("malformed"), "{error}");
        }
        other => panic!("{other:?}"),
    }
}

#[tokio::test]
async fn a_table_that_is_damaged_under_a_service_is_told_by_probes_metrics_and_refusals() {
    // After an orderly shutdown the start does not check for damage, so the service finds it while running. The beginning of the file is intact.
    let lab = damaged(400, usize::MAX).await;
    let service = Service::start(lab.folder.path(), &["--cache", "false"]);
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
