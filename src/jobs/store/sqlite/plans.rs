//! Do the statements take the indices that were made for them?

use uuid::Uuid;

use crate::jobs::model::job::State;
use crate::jobs::model::kind::Kind;
use crate::jobs::store::list::{Filter, Membership};
use crate::jobs::store::sqlite::connection::{Row, query};
use crate::jobs::store::sqlite::database::SqliteStore;
use crate::jobs::store::sqlite::engine::{CLAIM_BEGUN, CLAIM_NEW};
use crate::jobs::store::sqlite::sql::cached::SOURCE;
use crate::jobs::store::sqlite::sql::claim::QUEUES;
use crate::jobs::store::sqlite::sql::slices::{NOTES, RESULTS};
use crate::jobs::store::sqlite::sql::stats::{BEFORE, COUNT, OLDEST, RESULT_BYTES};
use crate::jobs::store::sqlite::sql::upkeep::EXPIRED;
use crate::jobs::store::sqlite::sql::upkeep::{FAIL_LATE, LATE};
use crate::jobs::store::sqlite::sql::upkeep::{REAP, REAP_BYSTANDERS};
use crate::jobs::store::sqlite::sql::{batch_lists, lists};

#[tokio::test]
async fn the_list_of_batches_walks_its_index_without_sorting() {
    let folder = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(&folder.path().join("jobs.db"))
        .await
        .unwrap();
    for after in [None, Some(Uuid::now_v7())] {
        let filter = Filter {
            labels: vec![("line".to_owned(), "A12".to_owned())],
            name: Some("x".to_owned()),
            ..Filter::of(Kind::Cases)
        };
        let query = batch_lists::page_query("t", &filter, after);
        let steps = plan(&store, query.sql()).await;
        assert!(
            steps[0].contains("batches_by_tenant (tenant=? AND kind=?"),
            "{steps:?}"
        );
        let sorts = |step: &String| step.contains("TEMP B-TREE");
        assert!(!steps.iter().any(sorts), "{steps:?}");
    }
}

#[tokio::test]
async fn references_to_a_blob_are_found_by_index() {
    let folder = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(&folder.path().join("jobs.db"))
        .await
        .unwrap();
    let free = "DELETE FROM blobs WHERE id IN (1, 2) AND NOT EXISTS (SELECT 1 FROM jobs WHERE jobs.blob_id = blobs.id) \
        AND NOT EXISTS (SELECT 1 FROM job_slices WHERE job_slices.blob_id = blobs.id)";
    let known = "SELECT key FROM blobs WHERE key IN ('a', 'b')";
    for (statement, seek) in [
        (free, "jobs_by_blob (blob_id=?"),
        (known, "blobs_by_key (key=?"),
    ] {
        let steps = plan(&store, statement).await;
        assert!(steps.iter().any(|step| step.contains(seek)), "{steps:?}");
        assert!(
            !steps.iter().any(|step| step.starts_with("SCAN")),
            "{steps:?}"
        );
    }
}

#[tokio::test]
async fn slices_are_found_by_their_job_and_blobs_by_their_slice() {
    let folder = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(&folder.path().join("jobs.db"))
        .await
        .unwrap();
    // The last is what the database asks itself when a blob goes.
    let referring = "SELECT 1 FROM job_slices WHERE blob_id = 1";
    for (statement, seek) in [
        (NOTES, "PRIMARY KEY (job_id=?"),
        (RESULTS, "PRIMARY KEY (job_id=?"),
        (referring, "job_slices_by_blob (blob_id=?"),
    ] {
        let steps = plan(&store, statement).await;
        assert!(steps[0].contains(seek), "{steps:?}");
        assert!(
            !steps.iter().any(|step| step.starts_with("SCAN")),
            "{steps:?}"
        );
    }
}

#[tokio::test]
async fn a_source_is_found_by_one_seek() {
    let folder = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(&folder.path().join("jobs.db"))
        .await
        .unwrap();
    let statement =
        format!("WITH asked (cache_key) AS (VALUES (x'00')) SELECT {SOURCE} FROM asked");
    let steps = plan(&store, &statement).await;
    assert!(
        steps
            .iter()
            .any(|step| step.contains("jobs_by_cache_key (cache_key=?)")),
        "{steps:?}"
    );
}

#[tokio::test]
async fn the_claim_and_the_reaper_find_their_jobs_by_index() {
    let folder = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(&folder.path().join("jobs.db"))
        .await
        .unwrap();
    let bystanders = REAP_BYSTANDERS;
    for (statement, seek) in [
        (QUEUES, "PRIMARY KEY (state=?"),
        (CLAIM_NEW, "PRIMARY KEY (state=? AND tenant=? AND kind=?"),
        (CLAIM_NEW, "jobs_queued (tenant=? AND kind=?"),
        (CLAIM_BEGUN, "jobs_begun (tenant=? AND kind=?"),
        (REAP, "jobs_by_state (state=?"),
        (bystanders, "jobs_by_state (state=?"),
    ] {
        let steps = plan(&store, statement).await;
        assert!(steps.iter().any(|step| step.contains(seek)), "{steps:?}");
        assert!(
            !steps
                .iter()
                .any(|step| step.starts_with("SCAN j") || step.contains("TEMP B-TREE")),
            "{steps:?}"
        );
    }
}

#[tokio::test]
async fn jobs_without_a_deadline_are_not_looked_at() {
    let folder = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(&folder.path().join("jobs.db"))
        .await
        .unwrap();
    for statement in [LATE, FAIL_LATE] {
        let steps = plan(&store, statement).await;
        let seeks = |step: &String| step.contains("jobs_by_deadline (deadline");
        assert!(steps.iter().any(seeks), "{steps:?}");
        assert!(
            !steps.iter().any(|step| step.starts_with("SCAN jobs")),
            "{steps:?}"
        );
    }
}

#[tokio::test]
async fn the_sweep_looks_at_old_jobs_only() {
    let folder = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(&folder.path().join("jobs.db"))
        .await
        .unwrap();
    let steps = plan(&store, EXPIRED).await;
    assert_eq!(steps[0], "SEARCH jobs USING PRIMARY KEY (id<?)");
    // Of a chunk, its run and its neighbours that have not ended are looked at.
    let looks = steps.iter().filter(|step| step.starts_with("SEARCH"));
    assert_eq!(looks.count(), 3, "{steps:?}");
    assert!(
        steps
            .iter()
            .any(|step| step.contains("beside") && step.contains("(batch_id=? AND state=?")),
        "{steps:?}"
    );
    assert!(
        !steps
            .iter()
            .any(|step| step.starts_with("SCAN") || step.contains("TEMP B-TREE")),
        "{steps:?}"
    );
}

/// The steps SQLite takes for a statement.
pub(crate) async fn plan(store: &SqliteStore, statement: &str) -> Vec<String> {
    // The plan does not depend on the values.
    let parameters = vec![0_i64; 20];
    let mut explain = query(format!("EXPLAIN QUERY PLAN {statement}"));
    for value in parameters {
        explain = explain.bind(value);
    }
    let steps = explain.fetch_all(&store.writer).await.unwrap();
    let details = steps.iter().map(|row| row.try_get("detail").unwrap());
    details.collect()
}

#[tokio::test]
async fn the_list_of_a_batch_walks_its_index_and_nothing_of_the_batch_of_another_tenant() {
    let folder = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(&folder.path().join("jobs.db"))
        .await
        .unwrap();
    for (state, after) in [(None, None), (Some(State::Queued), Some(Uuid::now_v7()))] {
        let filter = Filter {
            member: Some(Membership::Batch(Uuid::now_v7())),
            ..Filter::default()
        };
        let query = lists::page_query("t", &filter, state, after, 50);
        let steps = plan(&store, query.sql()).await;
        let seek = match state {
            None => "jobs_by_batch (batch_id=?",
            Some(_) => "jobs_by_batch_and_state (batch_id=? AND state=?",
        };
        assert!(steps[0].contains(seek), "{steps:?}");
        // The batch is sought first, among those of the tenant: of another tenant's nothing is walked.
        let owner = [
            "SCALAR SUBQUERY 1",
            "SEARCH batches USING PRIMARY KEY (id=?)",
        ];
        assert_eq!(steps[1..], owner, "{steps:?}");
    }
}

#[tokio::test]
async fn a_label_within_a_batch_is_walked_no_further_than_the_batch_goes() {
    let folder = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(&folder.path().join("jobs.db"))
        .await
        .unwrap();
    for (state, after) in [(None, Some(Uuid::now_v7())), (Some(State::Failed), None)] {
        let filter = Filter {
            member: Some(Membership::Batch(Uuid::now_v7())),
            labels: vec![("line".to_owned(), "A12".to_owned())],
            ..Filter::default()
        };
        let query = lists::page_query("t", &filter, state, after, 50);
        let steps = plan(&store, query.sql()).await;
        assert!(steps[0].contains("job_id>? AND job_id<?)"), "{steps:?}");
        let ends = steps.iter().filter(|step| step.contains("(batch_id=?)"));
        assert_eq!(ends.count(), 2, "{steps:?}");
        let scans = |step: &String| step.starts_with("SCAN") || step.contains("TEMP B-TREE");
        assert!(!steps.iter().any(scans), "{steps:?}");
    }
}

#[tokio::test]
async fn every_form_of_the_list_walks_an_index_without_sorting() {
    let folder = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(&folder.path().join("jobs.db"))
        .await
        .unwrap();
    let label = Some(("line".to_owned(), "A12".to_owned()));
    for state in [None, Some(State::Queued)] {
        for label in [None, label.clone()] {
            for window in [None, Some(1_000_000)] {
                for after in [None, Some(Uuid::now_v7())] {
                    let filter = Filter {
                        labels: label.clone().into_iter().collect(),
                        created_after: window,
                        created_before: window.map(|time| time + 5),
                        ..Filter::default()
                    };
                    let query = lists::page_query("t", &filter, state, after, 50);
                    let steps = plan(&store, query.sql()).await;
                    assert!(
                        !steps.iter().any(|step| step.contains("TEMP B-TREE")),
                        "{filter:?}: {steps:?}"
                    );
                    assert!(
                        !steps.iter().any(|step| step.starts_with("SCAN")),
                        "{filter:?}: {steps:?}"
                    );
                    let seek = match (&label, state) {
                        (None, None) => "jobs_by_tenant (tenant=?",
                        (None, Some(_)) => "jobs_by_state (state=? AND tenant=?",
                        (Some(_), None) => "PRIMARY KEY (of_tenant=? AND key=? AND value=?",
                        (Some(_), Some(_)) => {
                            "job_labels_by_state (of_tenant=? AND key=? AND value=? AND state=?"
                        }
                    };
                    assert!(steps[0].contains(seek), "{steps:?}");
                }
            }
        }
    }
}

#[tokio::test]
async fn the_list_of_jobs_submitted_alone_walks_its_index() {
    let folder = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(&folder.path().join("jobs.db"))
        .await
        .unwrap();
    for after in [None, Some(Uuid::now_v7())] {
        for updated_after in [None, Some(5)] {
            let filter = Filter {
                member: Some(Membership::Alone),
                updated_after,
                ..Filter::default()
            };
            let query = lists::page_query("t", &filter, Some(State::Failed), after, 50);
            let steps = plan(&store, query.sql()).await;
            let seeks =
                |step: &String| step.contains("jobs_alone (tenant=? AND kind=? AND state=?");
            assert!(steps.iter().any(seeks), "{steps:?}");
            let sorts = |step: &String| step.contains("TEMP B-TREE");
            assert!(!steps.iter().any(sorts), "{steps:?}");
        }
    }
}

#[tokio::test]
async fn figures_are_read_from_indices_alone() {
    let folder = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(&folder.path().join("jobs.db"))
        .await
        .unwrap();
    let steps = plan(&store, RESULT_BYTES).await;
    assert!(steps[0].contains("COVERING INDEX"), "{steps:?}");
    let steps = plan(&store, COUNT).await;
    assert_eq!(steps, ["SCAN job_counts"], "a row per state and tenant");
    let steps = plan(&store, OLDEST).await;
    let seeks =
        |step: &String| step.contains("jobs_queued (tenant=? AND kind=? AND rank>? AND rank<?");
    assert!(steps.iter().any(seeks), "{steps:?}");
    let walks =
        |step: &String| step.contains("SCAN jobs") || step.contains("TEMP B-TREE FOR ORDER");
    assert!(!steps.iter().any(walks), "{steps:?}");
}

#[tokio::test]
async fn a_place_in_the_queue_is_read_from_an_index_alone() {
    let folder = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(&folder.path().join("jobs.db"))
        .await
        .unwrap();
    let steps = plan(&store, BEFORE).await;
    let seeks = |step: &String| step.contains("COVERING INDEX jobs_queued (tenant=? AND kind=?");
    assert!(steps.iter().any(seeks), "{steps:?}");
}
