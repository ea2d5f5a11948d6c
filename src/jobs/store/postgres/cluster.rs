//! Calls by which nodes learn of each other.

use std::sync::Arc;

use async_trait::async_trait;
use object_store::ObjectStore;
use uuid::Uuid;

use crate::jobs::store::cluster::{Cluster, ClusterView, Deployment, Node, Notification};
use crate::jobs::store::postgres::answer::in_time;
use crate::jobs::store::postgres::database::PostgresStore;
use crate::jobs::store::postgres::engine::fold_counts;
use crate::jobs::store::postgres::notifier;
use crate::jobs::store::postgres::objects::PgObjects;
use crate::jobs::store::postgres::sql::rows::{count, read_id, read_small};
use crate::jobs::store_error::StoreError;

const NOW: &str = "SELECT CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint)";

/// A node that was not seen for so long is not counted, in ms.
const DEAD_AFTER: i64 = 20_000;

/// A node that was not seen for so long is forgotten, in ms.
const FORGOTTEN_AFTER: i64 = 600_000;

/// How long a batch is kept for whoever fills it, from each sign of life on, in ms; as in the schema.
const FILLED_WITHIN: i64 = 60_000;

/// A result that no job refers to after so long has lost its job, in ms: results are written just before their jobs end.
const SWEPT_AFTER: i64 = 24 * 3600 * 1000;

/// The key of a result is the folder of its objects.
const SWEEP: &str = "DELETE FROM objects WHERE made_at < CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint) - $1 \
     AND NOT EXISTS (SELECT 1 FROM blobs WHERE blobs.key = regexp_replace(objects.path, '/[^/]+$', ''))";

#[async_trait]
impl Cluster for PostgresStore {
    async fn now(&self) -> Result<i64, StoreError> {
        in_time(self.read_clock()).await
    }

    async fn beat(&self, node: &Node) -> Result<ClusterView, StoreError> {
        in_time(self.show(node)).await
    }

    async fn leave(&self, node: Uuid) -> Result<(), StoreError> {
        in_time(self.forget(node)).await
    }

    async fn cancel_requests(&self, running: &[Uuid]) -> Result<Vec<Uuid>, StoreError> {
        in_time(self.read_cancel_requests(running)).await
    }

    async fn keep_batches(&self, batches: &[Uuid]) -> Result<(), StoreError> {
        in_time(self.renew_batches(batches)).await
    }

    async fn sweep_objects(&self) -> Result<u64, StoreError> {
        in_time(self.sweep()).await
    }

    async fn fold_counts(&self) -> Result<(), StoreError> {
        in_time(fold_counts(&self.writer)).await
    }

    async fn deployment(&self) -> Result<Deployment, StoreError> {
        in_time(self.read_deployment(DEAD_AFTER)).await
    }

    async fn place_results(&self, before: Option<&str>, place: &str) -> Result<bool, StoreError> {
        in_time(self.write_results_place(before, place)).await
    }

    async fn take_sweep(&self) -> Result<bool, StoreError> {
        in_time(self.claim_sweep(SWEPT_AFTER)).await
    }

    fn objects(&self) -> Arc<dyn ObjectStore> {
        Arc::new(PgObjects::new(self.writer.clone()))
    }

    fn publish(&self, notification: Notification) {
        if self.listens_at.is_some() {
            self.notifier.publish(notification);
        }
    }

    async fn listen(&self, heard: &(dyn Fn(Notification) + Send + Sync)) -> Result<(), StoreError> {
        match &self.listens_at {
            Some(options) => notifier::listen(options.clone(), heard).await,
            None => std::future::pending().await,
        }
    }
}

impl PostgresStore {
    async fn read_clock(&self) -> Result<i64, StoreError> {
        Ok(sqlx::query_scalar(NOW).fetch_one(&self.writer).await?)
    }

    async fn show(&self, node: &Node) -> Result<ClusterView, StoreError> {
        let now = self.read_clock().await?;
        sqlx::query(
            "INSERT INTO nodes (id, version, workers, seen_at) VALUES ($1, $2, $3, $4) \
             ON CONFLICT (id) DO UPDATE SET workers = $3, seen_at = $4",
        )
        .bind(node.id.to_string())
        .bind(env!("CARGO_PKG_VERSION"))
        .bind(count(node.workers))
        .bind(now)
        .execute(&self.writer)
        .await?;
        sqlx::query("DELETE FROM nodes WHERE seen_at < $1")
            .bind(now - FORGOTTEN_AFTER)
            .execute(&self.writer)
            .await?;
        let living = sqlx::query(
            "SELECT COUNT(*) AS nodes, CAST(COALESCE(SUM(workers), 0) AS bigint) AS workers FROM nodes WHERE seen_at > $1",
        )
        .bind(now - DEAD_AFTER)
        .fetch_one(&self.writer)
        .await?;
        Ok(ClusterView {
            nodes: read_small(&living, "nodes")?,
            workers: read_small(&living, "workers")?,
        })
    }

    async fn forget(&self, node: Uuid) -> Result<(), StoreError> {
        sqlx::query("DELETE FROM nodes WHERE id = $1")
            .bind(node.to_string())
            .execute(&self.writer)
            .await?;
        Ok(())
    }

    async fn read_cancel_requests(&self, running: &[Uuid]) -> Result<Vec<Uuid>, StoreError> {
        let ids: Vec<String> = running.iter().map(Uuid::to_string).collect();
        let rows = sqlx::query(
            "SELECT id FROM jobs WHERE id = ANY($1) AND state = 'running' AND cancel_requested = 1",
        )
        .bind(ids)
        .fetch_all(&self.readers)
        .await?;
        rows.iter().map(read_id).collect()
    }

    async fn renew_batches(&self, batches: &[Uuid]) -> Result<(), StoreError> {
        let ids: Vec<String> = batches.iter().map(Uuid::to_string).collect();
        sqlx::query(
            "UPDATE batches SET filled_until = CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint) + $2 \
             WHERE id = ANY($1) AND complete = 0 AND dropped = 0",
        )
        .bind(ids)
        .bind(FILLED_WITHIN)
        .execute(&self.writer)
        .await?;
        Ok(())
    }

    async fn sweep(&self) -> Result<u64, StoreError> {
        let swept = sqlx::query(SWEEP).bind(SWEPT_AFTER).execute(&self.writer);
        Ok(swept.await?.rows_affected())
    }
}
