//! The embedded job table: SQLite.

#[macro_use]
mod tokens;

pub(crate) mod connection;
pub mod database;
pub mod engine;
#[cfg(feature = "cluster")]
mod export;
pub mod schema;
#[path = "../sql/mod.rs"]
pub mod sql;

#[cfg(test)]
mod plans {
    //! Tests that statements use the intended indices.

    use tempfile::TempDir;
    use uuid::Uuid;

    use crate::model::{Kind, State};
    use crate::store::sqlite::connection::{Row, query};
    use crate::store::sqlite::database::SqliteStore;
    use crate::store::sqlite::sql::blobs::{self, KNOWN};
    use crate::store::sqlite::sql::claim::{
        self, CLAIM, NOTES, PEEK, PEEK_BEGUN, QUEUES, RENEW, RESULTS,
    };
    use crate::store::sqlite::sql::finish::{END_PAIRS, FINISH, SOURCE};
    use crate::store::sqlite::sql::upkeep::{
        BEFORE, COUNT, EXPIRED, FAIL_LATE, GROUP_RUNNING, LATE, OLDEST, REAP, RESULT_BYTES,
    };
    use crate::store::sqlite::sql::{batches, jobs};
    use crate::store::{Filter, Membership};

    /// A job table in a temporary folder.
    struct Opened(
        SqliteStore,
        #[expect(dead_code, reason = "removed at the end")] TempDir,
    );

    impl Opened {
        async fn new() -> Opened {
            let folder = tempfile::tempdir().unwrap();
            let store = SqliteStore::open(&folder.path().join("jobs.db")).await;
            Opened(store.unwrap(), folder)
        }

        /// The query plan of a statement.
        async fn plan(&self, statement: &str) -> Vec<String> {
            let mut explain = query(format!("EXPLAIN QUERY PLAN {statement}"));
            for _ in 0..20 {
                explain = explain.bind(0_i64);
            }
            let steps = explain.fetch_all(&self.0.writer).await.unwrap();
            let details = steps.iter().map(|row| row.try_get("detail").unwrap());
            details.collect()
        }
    }

    fn page(filter: &Filter, state: Option<State>, after: Option<Uuid>) -> String {
        let walk = jobs::Walk {
            tenant: "t",
            filter,
            state,
            after,
        };
        walk.page()
    }

    /// Asserts that some step contains `seek`, and that no step contains one of the others.
    fn assert_seeks(steps: &[String], seek: &str, others: &[&str]) {
        assert!(steps.iter().any(|step| step.contains(seek)), "{steps:?}");
        let other = |step: &String| others.iter().any(|other| step.contains(other));
        assert!(!steps.iter().any(other), "{steps:?}");
    }

    #[tokio::test]
    async fn the_list_of_batches_walks_its_index_without_sorting() {
        let store = Opened::new().await;
        let filter = Filter {
            labels: vec![("line".to_owned(), "A12".to_owned())],
            name: Some("x".to_owned()),
            ..Filter::of(Kind::Cases)
        };
        let steps = store.plan(&batches::page_text("id, name", &filter)).await;
        let seek = "batches_by_tenant (tenant=? AND kind=?";
        assert_seeks(&steps[..1], seek, &[]);
        assert_seeks(&steps, seek, &["TEMP B-TREE"]);
    }

    #[tokio::test]
    async fn references_to_a_blob_are_found_by_index() {
        let store = Opened::new().await;
        for (statement, seek) in [
            (blobs::RELEASE, "jobs_by_blob (blob_id=?"),
            (KNOWN, "blobs_by_key (key=?"),
        ] {
            let steps = store.plan(statement).await;
            assert_seeks(&steps, seek, &["SCAN jobs", "SCAN blobs"]);
        }
    }

    #[tokio::test]
    async fn slices_are_found_by_their_job_and_blobs_by_their_slice() {
        let store = Opened::new().await;
        // The last is the foreign key check when a blob is removed.
        let referring = "SELECT 1 FROM job_slices WHERE blob_id = 1";
        for (statement, seek) in [
            (NOTES, "PRIMARY KEY (job_id=?"),
            (RESULTS, "PRIMARY KEY (job_id=?"),
            (referring, "job_slices_by_blob (blob_id=?"),
        ] {
            let steps = store.plan(statement).await;
            assert_seeks(&steps[..1], seek, &[]);
            assert_seeks(&steps, seek, &["SCAN"]);
        }
    }

    #[tokio::test]
    async fn a_source_is_found_by_one_seek() {
        let store = Opened::new().await;
        let statement =
            format!("WITH asked (cache_key) AS (VALUES (x'00')) SELECT {SOURCE} FROM asked");
        let steps = store.plan(&statement).await;
        assert_seeks(&steps, "jobs_by_cache_key (cache_key=?)", &[]);
    }

    #[tokio::test]
    async fn the_claim_and_the_reaper_find_their_jobs_by_index() {
        let store = Opened::new().await;
        for (statement, seek) in [
            (QUEUES, "PRIMARY KEY (state=?"),
            (PEEK, "jobs_queued (tenant=? AND kind=?"),
            (PEEK_BEGUN, "jobs_begun (tenant=? AND kind=?"),
            (REAP, "jobs_by_state (state=?"),
            (GROUP_RUNNING, "jobs_by_state (state=?"),
        ] {
            let steps = store.plan(statement).await;
            assert_seeks(&steps, seek, &["SCAN j", "TEMP B-TREE"]);
        }
    }

    #[tokio::test]
    async fn claimed_jobs_are_found_by_their_ids() {
        let store = Opened::new().await;
        for statement in [CLAIM, RENEW, claim::RELEASE, FINISH, END_PAIRS] {
            let steps = store.plan(statement).await;
            assert_seeks(
                &steps,
                "PRIMARY KEY (id=?)",
                &["SCAN jobs", "jobs_by_state"],
            );
        }
    }

    #[tokio::test]
    async fn jobs_without_a_deadline_are_not_looked_at() {
        let store = Opened::new().await;
        for statement in [LATE, FAIL_LATE] {
            let steps = store.plan(statement).await;
            assert_seeks(&steps, "jobs_by_deadline (deadline", &["SCAN jobs"]);
        }
    }

    #[tokio::test]
    async fn the_sweep_looks_at_old_jobs_only() {
        let store = Opened::new().await;
        let steps = store.plan(EXPIRED).await;
        assert_eq!(steps[0], "SEARCH jobs USING PRIMARY KEY (id<?)");
        // Of a chunk, its run and the other chunks of the run that have not ended are read.
        let looks = steps.iter().filter(|step| step.starts_with("SEARCH"));
        assert_eq!(looks.count(), 3, "{steps:?}");
        let beside: Vec<String> = steps
            .iter()
            .filter(|step| step.contains("beside"))
            .cloned()
            .collect();
        assert_seeks(&beside, "(batch_id=? AND state=?", &[]);
        assert_seeks(&steps, "SEARCH", &["SCAN", "TEMP B-TREE"]);
    }

    #[tokio::test]
    async fn the_list_of_a_batch_walks_its_index_and_nothing_of_the_batch_of_another_tenant() {
        let store = Opened::new().await;
        for (state, after) in [(None, None), (Some(State::Queued), Some(Uuid::now_v7()))] {
            let filter = Filter {
                member: Some(Membership::Batch(Uuid::now_v7())),
                ..Filter::default()
            };
            let steps = store.plan(&page(&filter, state, after)).await;
            let seek = match state {
                None => "jobs_by_batch (batch_id=?",
                Some(_) => "jobs_by_batch_and_state (batch_id=? AND state=?",
            };
            assert!(steps[0].contains(seek), "{steps:?}");
            // The batch is found first, restricted to the tenant: nothing is read of a batch of another tenant.
            let owner = [
                "SCALAR SUBQUERY 1",
                "SEARCH batches USING PRIMARY KEY (id=?)",
            ];
            assert_eq!(steps[1..], owner, "{steps:?}");
        }
    }

    #[tokio::test]
    async fn a_label_within_a_batch_is_walked_no_further_than_the_batch_goes() {
        let store = Opened::new().await;
        for (state, after) in [(None, Some(Uuid::now_v7())), (Some(State::Failed), None)] {
            let filter = Filter {
                member: Some(Membership::Batch(Uuid::now_v7())),
                labels: vec![("line".to_owned(), "A12".to_owned())],
                ..Filter::default()
            };
            let steps = store.plan(&page(&filter, state, after)).await;
            assert_seeks(&steps[..1], "job_id>? AND job_id<?)", &[]);
            let ends = steps.iter().filter(|step| step.contains("(batch_id=?)"));
            assert_eq!(ends.count(), 2, "{steps:?}");
            assert_seeks(&steps, "SEARCH", &["SCAN", "TEMP B-TREE"]);
        }
    }

    #[tokio::test]
    async fn every_form_of_the_list_walks_an_index_without_sorting() {
        let store = Opened::new().await;
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
                        let steps = store.plan(&page(&filter, state, after)).await;
                        let seek = match (&label, state) {
                            (None, None) => "jobs_by_tenant (tenant=?",
                            (None, Some(_)) => "jobs_by_state (state=? AND tenant=?",
                            (Some(_), None) => "PRIMARY KEY (of_tenant=? AND key=? AND value=?",
                            (Some(_), Some(_)) => {
                                "job_labels_by_state (of_tenant=? AND key=? AND value=? AND state=?"
                            }
                        };
                        assert_seeks(&steps[..1], seek, &[]);
                        assert_seeks(&steps, seek, &["SCAN", "TEMP B-TREE"]);
                    }
                }
            }
        }
    }

    #[tokio::test]
    async fn the_list_of_jobs_submitted_alone_walks_its_index() {
        let store = Opened::new().await;
        for after in [None, Some(Uuid::now_v7())] {
            for updated_after in [None, Some(5)] {
                let filter = Filter {
                    member: Some(Membership::Alone),
                    updated_after,
                    ..Filter::default()
                };
                let steps = store.plan(&page(&filter, Some(State::Failed), after)).await;
                let seek = "jobs_alone (tenant=? AND kind=? AND state=?";
                assert_seeks(&steps, seek, &["TEMP B-TREE"]);
            }
        }
    }

    #[tokio::test]
    async fn figures_are_read_from_indices_alone() {
        let store = Opened::new().await;
        let steps = store.plan(RESULT_BYTES).await;
        assert!(steps[0].contains("COVERING INDEX"), "{steps:?}");
        let steps = store.plan(COUNT).await;
        assert_eq!(steps, ["SCAN job_counts"], "a row per state and tenant");
        let steps = store.plan(OLDEST).await;
        let seek = "jobs_queued (tenant=? AND kind=? AND rank>? AND rank<?";
        assert_seeks(&steps, seek, &["SCAN jobs", "TEMP B-TREE FOR ORDER"]);
    }

    #[tokio::test]
    async fn a_place_in_the_queue_is_read_from_an_index_alone() {
        let store = Opened::new().await;
        let steps = store.plan(BEFORE).await;
        assert_seeks(
            &steps,
            "COVERING INDEX jobs_queued (tenant=? AND kind=?",
            &[],
        );
    }
}
