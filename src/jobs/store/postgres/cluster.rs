//! Calls of nodes of a cluster.

use std::sync::Arc;

use async_trait::async_trait;
use object_store::ObjectStore;
use railhead_macros::repeat_conflicts;
use sqlx::Row;
use sqlx::{query, query_scalar};
use uuid::Uuid;

use crate::store::postgres::connection::{FOLD, LOCKS};
use crate::store::postgres::database::PostgresStore;
use crate::store::postgres::objects::PgObjects;
use crate::store::postgres::sql::rows::{count, read_id};
use crate::store::postgres::{engine, notifier};
use crate::store::{Cluster, Deployment, Node, Notification, Result};

const NOW: &str = "SELECT CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint)";

/// Time without a report after which a node counts as dead, in ms.
const DEAD_AFTER: i64 = 20_000;

/// Time without a report after which a node is removed, in ms.
const FORGOTTEN_AFTER: i64 = 600_000;

/// How long each report keeps a batch that is being filled, in ms; the schema has the same number.
const FILLED_WITHIN: i64 = 60_000;

/// Age at which a result without a job is an orphan, in ms: results are written shortly before their jobs end.
const SWEPT_AFTER: i64 = 24 * 3600 * 1000;

/// The key of a result is the folder of its objects.
const FOLDS: [&str; 2] = [
    "WITH gone AS (DELETE FROM job_counts RETURNING state, tenant, kind, number) \
     INSERT INTO job_counts (state, tenant, kind, number) \
     SELECT state, tenant, kind, CAST(SUM(number) AS bigint) FROM gone GROUP BY state, tenant, kind HAVING SUM(number) <> 0",
    "WITH gone AS (DELETE FROM stored_bytes RETURNING tenant, bytes) \
     INSERT INTO stored_bytes (tenant, bytes) \
     SELECT tenant, CAST(SUM(bytes) AS bigint) FROM gone GROUP BY tenant HAVING SUM(bytes) <> 0",
];

const SWEEP: &str = "DELETE FROM objects WHERE made_at < CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint) - $1 \
     AND NOT EXISTS (SELECT 1 FROM blobs WHERE blobs.key = regexp_replace(objects.path, '/[^/]+$', ''))";

#[repeat_conflicts]
#[async_trait]
impl Cluster for PostgresStore {
    async fn now(&self) -> Result<i64> {
        Ok(sql!(scalar fetch_one, &self.writer, NOW)?)
    }

    async fn beat(&self, node: &Node) -> Result<usize> {
        let now = self.now().await?;
        sql!(execute, &self.writer,
            "INSERT INTO nodes (id, version, workers, seen_at) VALUES ($1, $2, $3, $4) \
             ON CONFLICT (id) DO UPDATE SET workers = $3, seen_at = $4";
            node.id.to_string(), env!("CARGO_PKG_VERSION"), count(node.workers), now
        )?;
        sql!(execute, &self.writer, "DELETE FROM nodes WHERE seen_at < $1"; now - FORGOTTEN_AFTER)?;
        let workers: i64 = sql!(scalar fetch_one, &self.writer,
            "SELECT CAST(COALESCE(SUM(workers), 0) AS bigint) FROM nodes WHERE seen_at > $1";
            now - DEAD_AFTER
        )?;
        Ok(usize::try_from(workers).unwrap_or(0))
    }

    async fn leave(&self, node: Uuid) -> Result<()> {
        sql!(execute, &self.writer, "DELETE FROM nodes WHERE id = $1"; node.to_string())?;
        Ok(())
    }

    async fn cancel_requests(&self, running: &[Uuid]) -> Result<Vec<Uuid>> {
        let ids: Vec<String> = running.iter().map(Uuid::to_string).collect();
        let rows = sql!(fetch_all, &self.readers,
            "SELECT id FROM jobs WHERE id = ANY($1) AND state = 'running' AND cancel_requested = 1";
            ids
        )?;
        rows.iter().map(read_id).collect()
    }

    async fn keep_batches(&self, batches: &[Uuid]) -> Result<()> {
        let ids: Vec<String> = batches.iter().map(Uuid::to_string).collect();
        sql!(execute, &self.writer,
            "UPDATE batches SET filled_until = CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint) + $2 \
             WHERE id = ANY($1) AND complete = 0 AND dropped = 0";
            ids, FILLED_WITHIN
        )?;
        Ok(())
    }

    async fn sweep_objects(&self) -> Result<u64> {
        let swept = sqlx::query(SWEEP).bind(SWEPT_AFTER).execute(&self.writer);
        Ok(swept.await?.rows_affected())
    }

    // Another node may be summing up the counters.
    async fn fold_counts(&self) -> Result<()> {
        let mut transaction = self.writer.begin().await?;
        let free: bool = sql!(scalar fetch_one, &mut *transaction,
            "SELECT pg_try_advisory_xact_lock($1, $2)";
            LOCKS, FOLD
        )?;
        if free {
            for statement in FOLDS {
                sql!(execute, &mut *transaction, statement)?;
            }
        }
        transaction.commit().await?;
        Ok(())
    }

    async fn deployment(&self) -> Result<Deployment> {
        let row = sql!(fetch_one, &self.writer,
            "SELECT id, results_place, EXISTS (SELECT 1 FROM blobs WHERE key IS NOT NULL) AS has_results, \
             (SELECT COUNT(*) FROM nodes WHERE seen_at > CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint) - $1) AS nodes \
             FROM deployment";
            DEAD_AFTER
        )?;
        Ok(Deployment {
            id: row.try_get("id")?,
            results_place: row.try_get("results_place")?,
            has_results: row.try_get("has_results")?,
            nodes: row.try_get::<i64, _>("nodes")?.unsigned_abs(),
        })
    }

    async fn place_results(&self, before: Option<&str>, place: &str) -> Result<bool> {
        let written = sql!(execute, &self.writer,
            "UPDATE deployment SET results_place = $2 WHERE results_place IS NOT DISTINCT FROM $1";
            before, place
        )?;
        Ok(written.rows_affected() > 0)
    }

    async fn take_sweep(&self) -> Result<bool> {
        let taken = sql!(execute, &self.writer,
            "WITH clock AS (SELECT CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint) AS now) \
             UPDATE deployment SET swept_at = clock.now FROM clock WHERE swept_at <= clock.now - $1";
            SWEPT_AFTER
        )?;
        Ok(taken.rows_affected() > 0)
    }

    fn objects(&self) -> Arc<dyn ObjectStore> {
        Arc::new(PgObjects::new(self.writer.clone()))
    }

    fn publish(&self, notification: Notification) {
        if self.listens_at.is_some() {
            self.notifier.publish(notification);
        }
    }

    #[once]
    async fn listen(&self, heard: &(dyn Fn(Notification) + Send + Sync)) -> Result<()> {
        match &self.listens_at {
            Some(options) => notifier::listen(options.clone(), heard).await,
            None => std::future::pending().await,
        }
    }
}

impl PostgresStore {
    /// The keys of all results outside the table, sorted.
    pub(crate) async fn result_keys(&self) -> Result<Vec<String>> {
        let keys = "SELECT DISTINCT key FROM blobs WHERE key IS NOT NULL ORDER BY key";
        let mut connection = self.writer.acquire().await?;
        // For a command of the operator, which may take long.
        sqlx::raw_sql("SET statement_timeout = 0")
            .execute(&mut *connection)
            .await?;
        Ok(sql!(scalar fetch_all, &mut *connection, keys)?)
    }

    /// Removes all large results from the database.
    pub(crate) async fn remove_objects(&self) -> Result<()> {
        sqlx::raw_sql("TRUNCATE objects")
            .execute(&self.writer)
            .await?;
        Ok(())
    }
}
