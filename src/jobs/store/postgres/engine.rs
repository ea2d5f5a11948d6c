//! The interface of PostgreSQL for the shared statements.

use async_trait::async_trait;
use futures_util::TryStreamExt;
use railhead_macros::repeat_conflicts;
use sqlx::postgres::{PgArguments, PgConnection, PgPool, PgRow, Postgres};
use sqlx::query::Query;
use sqlx::{AssertSqlSafe, Transaction};
use uuid::Uuid;

use crate::error::StoreError;
use crate::model::Queue;
use crate::store::postgres::connection::{ADMISSION, in_time, lock};
use crate::store::postgres::database::PostgresStore;
use crate::store::postgres::engine;
use crate::store::{ClaimRequest, Cluster, Result, Store};

pub(crate) use sqlx::{Row, query, query_scalar};

pub(crate) type Db = Postgres;
pub(crate) type DbConnection = PgConnection;
pub(crate) type DbPool = PgPool;
pub(crate) type DbRow = PgRow;
pub(crate) type SqlStore = PostgresStore;

/// Number of repetitions after a conflict before the error is returned.
const REPEATED: u32 = 4;

/// Spawns the task that stores submitted jobs.
pub(crate) fn spawn(task: impl Future<Output = ()> + Send + 'static) -> Result<()> {
    drop(tokio::spawn(task));
    Ok(())
}

/// Begins a transaction.
pub(crate) async fn begin(pool: &DbPool) -> Result<Transaction<'static, Db>> {
    Ok(pool.begin().await?)
}

/// Begins a transaction that claims.
pub(crate) async fn begin_claim(pool: &DbPool) -> Result<Transaction<'static, Db>> {
    begin(pool).await
}

/// A statement that was put together from literals.
pub(crate) fn built<'q>(text: String) -> Query<'q, Db, PgArguments> {
    query(AssertSqlSafe(text))
}

/// Appends the placeholder of a parameter.
pub(crate) fn push_placeholder(text: &mut String, number: usize) {
    text.push('$');
    text.push_str(&number.to_string());
}

/// Passes each row of a statement to `row` until that returns `false`.
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

/// Until the end of the transaction no other one takes places in the queue or uses idempotency keys. The next statement
/// sees the effect of the previous holder.
pub(crate) async fn lock_admission(connection: &mut DbConnection) -> Result<()> {
    lock(connection, ADMISSION).await
}

/// Prevents the removal of jobs until the end of the transaction, because other jobs are about to refer to their results.
pub(crate) async fn lock_jobs_for_share(connection: &mut DbConnection, ids: &[Uuid]) -> Result<()> {
    let ids: Vec<String> = ids.iter().map(Uuid::to_string).collect();
    sql!(fetch_all, connection,
        "SELECT id FROM jobs WHERE id = ANY($1) ORDER BY id FOR KEY SHARE";
        ids
    )?;
    Ok(())
}

/// Prevents changes of the references to blobs until the end of the transaction. Of two transactions that remove the last
/// two references, the second sees the effect of the first.
pub(crate) async fn lock_blobs(connection: &mut DbConnection, ids: &[i64]) -> Result<()> {
    sql!(fetch_all, connection,
        "SELECT id FROM blobs WHERE id = ANY($1) ORDER BY id FOR UPDATE";
        ids
    )?;
    Ok(())
}

impl PostgresStore {
    /// New ids of blobs. They are generated before the insertion, because its rows may be returned in any order.
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

    /// Selects and locks the first new jobs of a queue.
    pub(crate) async fn first_new(
        &self,
        connection: &mut DbConnection,
        request: &ClaimRequest<'_>,
    ) -> Result<Vec<DbRow>> {
        self.claim_memory.peek(connection, request).await
    }

    /// The current time by which leases are judged: `None` for the clock of the database; in tests the argument.
    pub(crate) fn lease_now(&self, now: i64) -> Option<i64> {
        self.given_clock.then_some(now)
    }

    /// The cached queues, if one of them is long.
    pub(crate) fn known_queues(&self) -> Option<Vec<(Queue, u64)>> {
        self.claim_memory.queues()
    }

    pub(crate) fn remember_queues(&self, queues: &[(Queue, u64)]) {
        self.claim_memory.remember_queues(queues);
    }

    /// Records that jobs returned to the queue.
    pub(crate) fn requeued(&self) {
        self.claim_memory.forget_places();
    }

    /// Size of the database in bytes.
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

    /// The server reclaims space by itself.
    async fn compact(&self, _: i64, _: u32) -> Result<bool> {
        Ok(false)
    }
}

/// Runs a call, and repeats it after a serialization failure, a deadlock, or a new reference to a row that it removes: in
/// these cases nothing was changed.
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
