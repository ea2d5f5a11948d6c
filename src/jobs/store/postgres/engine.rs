//! PostgreSQL as the shared statements see it.

use async_trait::async_trait;
use futures_util::TryStreamExt;
use railhead_macros::repeat_conflicts;
use sqlx::Transaction;
use sqlx::postgres::{PgArguments, PgConnection, PgPool, PgRow, Postgres};
use sqlx::query::Query;
use uuid::Uuid;

use crate::error::StoreError;
use crate::model::Queue;
use crate::store::postgres::answer::in_time;
use crate::store::postgres::connection::{ADMISSION, lock};
use crate::store::postgres::database::PostgresStore;
use crate::store::postgres::engine;
use crate::store::{ClaimRequest, Cluster, Result, Store};

pub(crate) use sqlx::{Row, query, query_scalar};

pub(crate) type Db = Postgres;
pub(crate) type QueryBuilder = sqlx::QueryBuilder<Postgres>;
pub(crate) type DbConnection = PgConnection;
pub(crate) type DbPool = PgPool;
pub(crate) type DbRow = PgRow;
pub(crate) type SqlStore = PostgresStore;

/// What stands before and behind the present by which leases are judged, a value or NULL.
pub(crate) const LEASE_NOW: (&str, &str) = (
    "COALESCE(",
    ", CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint))",
);

/// How often a call that gave way to another one is made again before its error counts.
const REPEATED: u32 = 4;

/// Begins a transaction.
pub(crate) async fn begin(pool: &DbPool) -> Result<Transaction<'static, Db>> {
    Ok(pool.begin().await?)
}

/// Begins a transaction that claims.
pub(crate) async fn begin_claim(pool: &DbPool) -> Result<Transaction<'static, Db>> {
    begin(pool).await
}

/// Passes each row of a statement on until `row` returns `false`.
pub(crate) async fn for_each(
    rows: Query<'_, Db, PgArguments>,
    readers: &DbPool,
    mut row: impl FnMut(&DbRow) -> Result<bool> + Send,
) -> Result<()> {
    let mut rows = rows.fetch(readers);
    while let Some(next) = rows.try_next().await? {
        if !row(&next)? {
            break;
        }
    }
    Ok(())
}

/// From here to the end of the transaction nobody else takes places in the queue or uses an idempotency key. What the one
/// before did is seen by the next statement.
pub(crate) async fn lock_admission(connection: &mut DbConnection) -> Result<()> {
    lock(connection, ADMISSION).await
}

/// Keeps jobs from being removed until the end of the transaction: another job is about to refer to their results.
pub(crate) async fn lock_jobs_for_share(connection: &mut DbConnection, ids: &[Uuid]) -> Result<()> {
    let ids: Vec<String> = ids.iter().map(Uuid::to_string).collect();
    sql!(fetch_all, connection,
        "SELECT id FROM jobs WHERE id = ANY($1) ORDER BY id FOR KEY SHARE";
        ids
    )?;
    Ok(())
}

/// Keeps others from counting the references to blobs until the end of the transaction. Of two who drop the last two
/// references at the same time, the later sees that the other one is gone.
pub(crate) async fn lock_blobs(connection: &mut DbConnection, ids: &[i64]) -> Result<()> {
    sql!(fetch_all, connection,
        "SELECT id FROM blobs WHERE id = ANY($1) ORDER BY id FOR UPDATE";
        ids
    )?;
    Ok(())
}

impl PostgresStore {
    /// Ids for new blobs. They are given here, not by the insertion: rows of one statement may come back in any order.
    pub(crate) async fn new_blob_ids(
        &self,
        connection: &mut DbConnection,
        number: usize,
    ) -> Result<Vec<i64>> {
        let ids = sql!(scalar fetch_all, connection,
            "SELECT nextval('blob_ids') FROM generate_series(1, CAST($1 AS bigint))";
            i64::try_from(number).unwrap_or(i64::MAX)
        )?;
        Ok(ids)
    }

    /// The first new jobs of a queue, locked.
    pub(crate) async fn first_new(
        &self,
        connection: &mut DbConnection,
        request: &ClaimRequest<'_>,
    ) -> Result<Vec<DbRow>> {
        self.claim_memory.peek(connection, request).await
    }

    /// The present by which leases are judged: none, so that the database's clock is asked; in tests the one that is given.
    pub(crate) fn lease_now(&self, now: i64) -> Option<i64> {
        self.given_clock.then_some(now)
    }

    /// The queues with jobs in them, if they were read a moment ago and one is long.
    pub(crate) fn known_queues(&self) -> Option<Vec<(Queue, u64)>> {
        self.claim_memory.queues()
    }

    pub(crate) fn remember_queues(&self, queues: &[(Queue, u64)]) {
        self.claim_memory.remember_queues(queues);
    }

    /// Jobs went back to the queue.
    pub(crate) fn requeued(&self) {
        self.claim_memory.forget_places();
    }

    /// Size of the database.
    pub(crate) async fn database_bytes(&self) -> Result<u64> {
        let bytes: i64 = sql!(scalar fetch_one, &self.readers,
            "SELECT pg_database_size(current_database())"
        )?;
        Ok(u64::try_from(bytes).unwrap_or(0))
    }
}

#[repeat_conflicts]
#[async_trait]
impl Store for PostgresStore {
    async fn ready(&self, write: bool) -> Result<()> {
        let statement = match write {
            true => "UPDATE deployment SET touched = touched + 1",
            false => "SELECT 1 FROM deployment",
        };
        sql!(execute, &self.writer, statement)?;
        Ok(())
    }

    fn cluster(&self) -> Option<&dyn Cluster> {
        Some(self)
    }

    #[once]
    async fn close(&self) {
        self.writer.close().await;
    }

    /// The server gives space back by itself.
    async fn compact(&self, _: i64, _: u32) -> Result<bool> {
        Ok(false)
    }
}

/// Makes a call, and makes it again if it was the one that had to give way to another transaction, or if a row that it was about
/// to remove was referred to meanwhile: in both cases nothing of it was done.
pub(crate) async fn again<T, F: Future<Output = Result<T>>>(call: impl Fn() -> F) -> Result<T> {
    for _ in 0..REPEATED {
        match in_time(call()).await {
            Err(error) if gave_way(&error) => tracing::debug!(%error, "made again"),
            answer => return answer,
        }
    }
    in_time(call()).await
}

fn gave_way(error: &StoreError) -> bool {
    const SERIALIZATION: &str = "40001";
    const DEADLOCK: &str = "40P01";
    const FOREIGN_KEY: &str = "23503";
    let StoreError::Failed(cause) = error else {
        return false;
    };
    let cause = cause.downcast_ref::<sqlx::Error>();
    let code = cause.and_then(|cause| cause.as_database_error()?.code());
    code.is_some_and(|code| [SERIALIZATION, DEADLOCK, FOREIGN_KEY].contains(&&*code))
}
