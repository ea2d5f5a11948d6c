//! The forms the embedded job table has had, and how an old one becomes the newest.

use sqlx::SqlSafeStr;
use sqlx::migrate::{Migration, MigrationType, Migrator};
use sqlx::sqlite::SqlitePool;

use crate::jobs::error::JobsError;

/// The forms the job table has had; a new one is added at the end, an old one is never edited.
pub(super) fn migrations() -> Migrator {
    Migrator::with_migrations(forms())
}

fn forms() -> Vec<Migration> {
    let form = |number, name: &'static str, text: &'static str| {
        Migration::new(
            number,
            name.into(),
            MigrationType::Simple,
            text.into_sql_str(),
            false,
        )
    };
    vec![
        form(1, "jobs", include_str!("schema.sql")),
        form(2, "batches", include_str!("batches.sql")),
        form(3, "result bytes", include_str!("result_bytes.sql")),
        form(4, "reuse", include_str!("reuse.sql")),
        form(5, "tenants", include_str!("tenants.sql")),
        form(6, "tombstones", include_str!("tombstones.sql")),
        form(7, "order", include_str!("order.sql")),
        form(8, "trace", include_str!("trace.sql")),
    ]
}

/// Free pages can be given back only by a database that was made for it; one of an earlier version is rewritten once.
pub(super) async fn allow_shrinking(writer: &SqlitePool) -> Result<(), JobsError> {
    let mode: i64 = sqlx::query_scalar("PRAGMA auto_vacuum")
        .fetch_one(writer)
        .await?;
    if mode == 0 {
        tracing::info!("the job table is rewritten once, so that it can shrink");
        sqlx::raw_sql("PRAGMA auto_vacuum = INCREMENTAL; VACUUM")
            .execute(writer)
            .await?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions};
    use uuid::Uuid;

    use super::*;
    use crate::jobs::store::Enqueued;
    use crate::jobs::store::list::Filter;
    use crate::jobs::store::sqlite::SqliteStore;

    #[tokio::test]
    async fn a_table_of_the_first_version_is_brought_forward_with_its_jobs() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("jobs.db");
        let options = SqliteConnectOptions::new()
            .filename(&file)
            .create_if_missing(true)
            .journal_mode(SqliteJournalMode::Wal);
        let old = SqlitePoolOptions::new()
            .connect_with(options)
            .await
            .unwrap();
        let first = forms().into_iter().take(2).collect();
        Migrator::with_migrations(first).run(&old).await.unwrap();
        let id = Uuid::now_v7();
        let filled = format!(
            "INSERT INTO jobs (id, state, labels, method, created_at) VALUES ('{id}', 'succeeded', '{{\"line\":\"A12\"}}', 'auto', 5);
             INSERT INTO cases (job_id, body) VALUES ('{id}', x'7b7d');
             INSERT INTO job_labels (key, value, job_id) VALUES ('line', 'A12', '{id}');
             INSERT INTO idempotency_keys (key, digest, job_id) VALUES ('k', zeroblob(32), '{id}');
             INSERT INTO results (job_id, solution) VALUES ('{id}', x'7b7d');"
        );
        sqlx::raw_sql(sqlx::AssertSqlSafe(filled))
            .execute(&old)
            .await
            .unwrap();
        old.close().await;

        let store = SqliteStore::open(&file).await.unwrap();
        let job = store.get(id).await.unwrap().unwrap();
        assert_eq!((&*job.tenant, job.cached), ("anonymous", false));
        let label = Filter {
            label: Some(("line".to_owned(), "A12".to_owned())),
            ..Filter::default()
        };
        let page = store.list("anonymous", &label, None, 10).await.unwrap();
        assert_eq!(page.jobs, [job]);
        let by_key = store.by_key("anonymous", "k", &[0; 32]).await.unwrap();
        assert!(matches!(by_key, Some(Enqueued::Existing(job)) if job.id == id));
        assert!(store.small_result(id).await.unwrap().is_some());
        let mode: i64 = sqlx::query_scalar("PRAGMA auto_vacuum")
            .fetch_one(&store.writer)
            .await
            .unwrap();
        assert_eq!(mode, 2, "it can shrink");
        store.delete(id).await.unwrap();
        assert_eq!(
            store.by_key("anonymous", "k", &[0; 32]).await.unwrap(),
            None
        );
    }
}
