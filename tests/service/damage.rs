//! Is a damaged job table noticed, and said so?

use railhead::jobs::{Jobs, JobsError, Options};

use crate::batches::small;
use crate::support::open;

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
        Err(JobsError::Database(error)) => {
            assert!(error.to_string().contains("malformed"), "{error}")
        }
        other => panic!("{other:?}"),
    }
}
