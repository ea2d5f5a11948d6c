//! Calls of nodes of a cluster, and notifications between them (`NOTIFY`).
//!
//! Notifications are sent after the commit, outside its transaction, because a transaction
//! that notifies serialises the commits of the whole server.

use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use object_store::ObjectStore;
use sqlx::postgres::{PgConnectOptions, PgListener, PgPool};
use sqlx::{Row, query, query_scalar};
use tokio::sync::mpsc;
use tokio::time::timeout;
use uuid::Uuid;

use crate::store::postgres::database::{FOLD, LOCKS, PostgresStore, in_time};
use crate::store::postgres::engine;
use crate::store::postgres::objects::PgObjects;
use crate::store::postgres::sql::rows::{count, read_id};
use crate::store::{Cluster, Deployment, Node, Notification, Result};
use railhead_macros::repeat_conflicts;

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
            sql!(
                execute,
                &mut *transaction,
                "WITH gone AS (DELETE FROM job_counts RETURNING state, tenant, kind, number) \
                 INSERT INTO job_counts (state, tenant, kind, number) \
                 SELECT state, tenant, kind, CAST(SUM(number) AS bigint) FROM gone GROUP BY state, tenant, kind HAVING SUM(number) <> 0"
            )?;
            sql!(
                execute,
                &mut *transaction,
                "WITH gone AS (DELETE FROM stored_bytes RETURNING tenant, bytes) \
                 INSERT INTO stored_bytes (tenant, bytes) \
                 SELECT tenant, CAST(SUM(bytes) AS bigint) FROM gone GROUP BY tenant HAVING SUM(bytes) <> 0"
            )?;
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
            Some(options) => listen(options.clone(), heard).await,
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

/// The channel of all nodes.
const CHANNEL: &str = "railhead";

/// Minimum interval between two notifications of a node.
const PAUSE: Duration = Duration::from_millis(10);

/// Maximum number of notifications in one `NOTIFY`, whose payload is limited to 8000 bytes.
const BATCH_MAX: usize = 200;

/// Time without a notification after which the connection is checked, because a dead connection is silent.
const SILENT_FOR: Duration = Duration::from_secs(10);

/// Maximum number of pending notifications; further ones are dropped, and other nodes find the change by polling.
const WAITING: usize = 10_000;

/// A handle to the task that sends notifications; the task ends with its last handle.
#[derive(Debug, Clone)]
pub(crate) struct Notifier(mpsc::Sender<Notification>);

impl Notifier {
    /// Starts the task.
    pub(crate) fn start(pool: PgPool) -> Notifier {
        let (sender, waiting) = mpsc::channel(WAITING);
        tokio::spawn(send_all(pool, waiting));
        Notifier(sender)
    }

    /// Sends a notification soon, unless too many are pending.
    pub(crate) fn publish(&self, notification: Notification) {
        // Nodes that miss a notification poll a moment later.
        let _ = self.0.try_send(notification);
    }
}

async fn send_all(pool: PgPool, mut waiting: mpsc::Receiver<Notification>) {
    let mut notifications = Vec::with_capacity(BATCH_MAX);
    while waiting.recv_many(&mut notifications, BATCH_MAX).await > 0 {
        let text = text_of(&notifications);
        notifications.clear();
        let sent = sqlx::query("SELECT pg_notify($1, $2)")
            .bind(CHANNEL)
            .bind(text)
            .execute(&pool);
        let sent = in_time(async { Ok(sent.await?) }).await;
        if let Err(error) = sent {
            tracing::debug!(%error, "a notification could not be sent");
        }
        tokio::time::sleep(PAUSE).await;
    }
}

/// The payload: `w`, `e` with an id, or `c` with an id; `w` only once.
fn text_of(notifications: &[Notification]) -> String {
    let mut words = Vec::with_capacity(notifications.len());
    if notifications.contains(&Notification::Work) {
        words.push("w".to_owned());
    }
    words.extend(
        notifications
            .iter()
            .filter_map(|notification| match notification {
                Notification::Work => None,
                Notification::Ended(id) => Some(format!("e{}", id.simple())),
                Notification::Cancel(id) => Some(format!("c{}", id.simple())),
            }),
    );
    words.join(" ")
}

/// Parses a word of a payload; `None` for words of later versions.
fn read_word(word: &str) -> Option<Notification> {
    let id = || Uuid::try_parse(word.get(1..)?).ok();
    match word.get(..1)? {
        "w" => Some(Notification::Work),
        "e" => id().map(Notification::Ended),
        "c" => id().map(Notification::Cancel),
        _ => None,
    }
}

/// Passes the notifications of all nodes to `heard` until the connection fails.
pub(crate) async fn listen(
    options: PgConnectOptions,
    heard: &(dyn Fn(Notification) + Send + Sync),
) -> Result<()> {
    let mut listener = in_time(async {
        let pool = sqlx::postgres::PgPoolOptions::new()
            .max_connections(1)
            .connect_with(options)
            .await?;
        let mut listener = PgListener::connect_with(&pool).await?;
        listener.listen(CHANNEL).await?;
        Ok(listener)
    })
    .await?;
    loop {
        let notification = match timeout(SILENT_FOR, listener.try_recv()).await {
            Ok(Ok(Some(notification))) => notification,
            // The connection was restored; changes in between are found by polling.
            Ok(Ok(None)) => continue,
            Ok(Err(error)) => return Err(error.into()),
            Err(_) => {
                let asked = sqlx::query("SELECT 1").execute(&mut listener);
                in_time(async { Ok(asked.await?) }).await?;
                continue;
            }
        };
        notification
            .payload()
            .split(' ')
            .filter_map(read_word)
            .for_each(heard);
    }
}

#[cfg(test)]
mod notifier_tests {
    use super::*;

    #[test]
    fn what_is_rung_is_heard_and_fits_into_a_notification() {
        let (one, other) = (Uuid::now_v7(), Uuid::now_v7());
        let notifications = [
            Notification::Ended(one),
            Notification::Work,
            Notification::Cancel(other),
            Notification::Work,
        ];
        let heard: Vec<_> = text_of(&notifications)
            .split(' ')
            .filter_map(read_word)
            .collect();
        assert_eq!(
            heard,
            [
                Notification::Work,
                Notification::Ended(one),
                Notification::Cancel(other)
            ]
        );
        assert_eq!(read_word("z1"), None);
        assert_eq!(read_word(""), None);
        assert!(text_of(&[Notification::Ended(one); BATCH_MAX]).len() < 8000);
    }
}
