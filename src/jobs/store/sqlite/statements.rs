//! Statements that are sent to SQLite together, as one transaction.
//!
//! SQLite runs on a thread of its own, and every exchange with it wakes two threads. A transaction is therefore one exchange where no
//! statement depends on the rows of another one.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use futures_util::TryStreamExt;
use sqlx::pool::PoolConnection;
use sqlx::sqlite::{Sqlite, SqliteConnection, SqlitePool, SqliteRow};
use sqlx::{Either, Executor, QueryBuilder};

use crate::jobs::store_error::StoreError;

/// The connection that writes.
#[derive(Debug, Clone)]
pub(crate) struct Writer {
    pub(crate) pool: SqlitePool,
    /// A transaction was begun and its end is not known: the connection is replaced before its next use, which rolls it back.
    pub(crate) interrupted: Arc<AtomicBool>,
}

/// A transaction whose statements are collected until their rows are needed. Dropped without a commit, it changes nothing.
pub(crate) struct Statements {
    connection: PoolConnection<Sqlite>,
    interrupted: Arc<AtomicBool>,
    collected: QueryBuilder<Sqlite>,
    /// `BEGIN` was collected or sent.
    open: bool,
    /// Results that are to come before those of the collected statements.
    begins: usize,
}

impl Statements {
    /// Between two statements of a transaction nobody else writes.
    pub(crate) const EXCLUSIVE: bool = true;

    /// Takes the connection that writes; nobody else has it until the end of the transaction.
    pub(crate) async fn begin(writer: &Writer) -> Result<Statements, StoreError> {
        Ok(Statements {
            connection: writer.pool.acquire().await?,
            interrupted: writer.interrupted.clone(),
            collected: QueryBuilder::new(""),
            open: false,
            begins: 0,
        })
    }

    /// Begins the next statement.
    pub(crate) fn next(&mut self) -> &mut QueryBuilder<Sqlite> {
        if !self.open {
            self.collected.push("BEGIN IMMEDIATE");
            (self.open, self.begins) = (true, 1);
        }
        self.separate()
    }

    fn separate(&mut self) -> &mut QueryBuilder<Sqlite> {
        if !self.collected.sql().as_str().is_empty() {
            self.collected.push("; ");
        }
        &mut self.collected
    }

    /// Sends what was collected; the rows of each statement.
    pub(crate) async fn send(&mut self) -> Result<Vec<Vec<SqliteRow>>, StoreError> {
        if self.collected.sql().as_str().is_empty() {
            return Ok(Vec::new());
        }
        let mut query = std::mem::replace(&mut self.collected, QueryBuilder::new(""));
        if self.open {
            self.interrupted.store(true, Ordering::Release);
        }
        let mut results = (&mut *self.connection).fetch_many(query.build());
        let (mut all, mut rows) = (Vec::new(), Vec::new());
        while let Some(result) = results.try_next().await? {
            match result {
                Either::Left(_) => all.push(std::mem::take(&mut rows)),
                Either::Right(row) => rows.push(row),
            }
        }
        drop(results);
        all.drain(..std::mem::take(&mut self.begins));
        Ok(all)
    }

    /// Sends what was collected and ends the transaction; the rows of each statement that was sent with it.
    pub(crate) async fn commit(mut self) -> Result<Vec<Vec<SqliteRow>>, StoreError> {
        if self.open {
            self.separate().push("COMMIT");
        }
        let mut all = self.send().await?;
        if self.open {
            all.pop();
        }
        self.interrupted.store(false, Ordering::Release);
        Ok(all)
    }

    /// The connection, for statements inside the transaction once it was begun and what was collected was sent.
    pub(crate) fn connection(&mut self) -> &mut SqliteConnection {
        &mut self.connection
    }
}

#[cfg(test)]
mod tests {
    use sqlx::Row;

    use super::*;
    use crate::jobs::store::sqlite::database::SqliteStore;

    fn bury(statements: &mut Statements, id: &str) {
        let insert = statements.next();
        insert.push("INSERT INTO tombstones (id, tenant, gone_at) VALUES (");
        insert
            .push_bind(id.to_owned())
            .push(", 't', 0) RETURNING id");
    }

    async fn buried(store: &SqliteStore) -> Vec<String> {
        let ids = sqlx::query_scalar("SELECT id FROM tombstones ORDER BY id");
        ids.fetch_all(&store.readers).await.unwrap()
    }

    #[tokio::test]
    async fn a_transaction_that_is_dropped_or_fails_changes_nothing_and_holds_nobody_up() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("jobs.db");
        let store = SqliteStore::open(&file).await.unwrap();
        let mut kept = Statements::begin(&store.writer()).await.unwrap();
        bury(&mut kept, "a");
        bury(&mut kept, "b");
        let rows = kept.commit().await.unwrap();
        let ids: Vec<&str> = rows.iter().map(|rows| rows[0].get("id")).collect();
        assert_eq!(ids, ["a", "b"]);

        let mut dropped = Statements::begin(&store.writer()).await.unwrap();
        bury(&mut dropped, "c");
        assert_eq!(dropped.send().await.unwrap().len(), 1);
        drop(dropped);
        let mut fails = Statements::begin(&store.writer()).await.unwrap();
        bury(&mut fails, "d");
        bury(&mut fails, "a");
        fails.commit().await.unwrap_err();
        let mut last = Statements::begin(&store.writer()).await.unwrap();
        bury(&mut last, "e");
        last.commit().await.unwrap();
        assert_eq!(buried(&store).await, ["a", "b", "e"]);
    }
}
