//! What a database knows of itself and of the place of its results.

use sqlx::Row;

use crate::jobs::store::cluster::Deployment;
use crate::jobs::store::postgres::database::PostgresStore;
use crate::jobs::store_error::StoreError;

impl PostgresStore {
    /// What the database knows; a node counts as living that was seen within `living_ms`.
    pub(crate) async fn read_deployment(&self, living_ms: i64) -> Result<Deployment, StoreError> {
        let row = sqlx::query(
            "SELECT id, results_place, EXISTS (SELECT 1 FROM blobs WHERE key IS NOT NULL) AS has_results, \
             (SELECT COUNT(*) FROM nodes WHERE seen_at > CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint) - $1) AS nodes \
             FROM deployment",
        )
        .bind(living_ms)
        .fetch_one(&self.writer)
        .await?;
        Ok(Deployment {
            id: row.try_get("id")?,
            results_place: row.try_get("results_place")?,
            has_results: row.try_get("has_results")?,
            nodes: row.try_get::<i64, _>("nodes")?.unsigned_abs(),
        })
    }

    /// Notes the place of the results if it is still what it was; says whether it was.
    pub(crate) async fn write_results_place(
        &self,
        before: Option<&str>,
        place: &str,
    ) -> Result<bool, StoreError> {
        let written = sqlx::query(
            "UPDATE deployment SET results_place = $2 WHERE results_place IS NOT DISTINCT FROM $1",
        )
        .bind(before)
        .bind(place)
        .execute(&self.writer)
        .await?;
        Ok(written.rows_affected() > 0)
    }

    /// Takes the turn to sweep the place of the results, if the last sweep began long enough ago.
    pub(crate) async fn claim_sweep(&self, every_ms: i64) -> Result<bool, StoreError> {
        let taken = sqlx::query(
            "WITH clock AS (SELECT CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint) AS now) \
             UPDATE deployment SET swept_at = clock.now FROM clock WHERE swept_at <= clock.now - $1",
        )
        .bind(every_ms)
        .execute(&self.writer)
        .await?;
        Ok(taken.rows_affected() > 0)
    }

    /// The keys of all results outside the table, each once, in order.
    pub(crate) async fn result_keys(&self) -> Result<Vec<String>, StoreError> {
        let keys = "SELECT DISTINCT key FROM blobs WHERE key IS NOT NULL ORDER BY key";
        let mut connection = self.writer.acquire().await?;
        // For a command of the operator, which may take its time.
        sqlx::raw_sql("SET statement_timeout = 0")
            .execute(&mut *connection)
            .await?;
        Ok(sqlx::query_scalar(keys).fetch_all(&mut *connection).await?)
    }

    /// Removes all large results that are in the database.
    pub(crate) async fn remove_objects(&self) -> Result<(), StoreError> {
        sqlx::raw_sql("TRUNCATE objects")
            .execute(&self.writer)
            .await?;
        Ok(())
    }
}
