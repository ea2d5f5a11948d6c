//! Connections to SQLite, with an interface like that of `sqlx`, which the shared SQL uses for every database.
//!
//! A statement runs on the calling thread, because reading a cached page takes microseconds, less than waking another
//! thread. Commits, which may wait for the disk, are announced to the runtime as blocking.

use std::borrow::Cow;
use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use rusqlite::types::{FromSql, ToSqlOutput, Value};
use rusqlite::{ErrorCode, Statement, ToSql};
use tokio::runtime::{Handle, RuntimeFlavor};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::error::{StorageFault, StoreError};
use crate::store::Result;
use crate::sync::lock;

/// How long a statement waits for a lock of another process.
const LOCK_TIMEOUT: Duration = Duration::from_secs(10);

/// Interval between two attempts to get that lock.
const LOCK_RETRY: Duration = Duration::from_millis(5);

/// Number of prepared statements that a connection caches.
const PREPARED: usize = 100;

/// Longer statements, such as insertions of many rows, are not cached.
const PREPARED_TEXT_MAX: usize = 4096;

/// Commits neither wait for the disk nor checkpoint the log.
const RELAX: &str = "PRAGMA synchronous = NORMAL; PRAGMA wal_autocheckpoint = 0";

/// Restores the default settings.
const TIGHTEN: &str = "PRAGMA synchronous = FULL; PRAGMA wal_autocheckpoint = 1000";

/// Opens a connection.
type Open = Box<dyn Fn() -> rusqlite::Result<rusqlite::Connection> + Send + Sync>;

/// A pool of connections, which are assigned in the order of requests.
#[derive(Clone)]
pub(crate) struct Pool(Arc<Shared>);

struct Shared {
    free: Arc<Semaphore>,
    connections: Mutex<Vec<rusqlite::Connection>>,
    open: Open,
    size: u32,
}

impl std::fmt::Debug for Pool {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Pool").finish_non_exhaustive()
    }
}

impl Pool {
    /// Creates a pool of up to `size` connections and opens the first; the others are opened on demand.
    pub(crate) fn open(size: u32, open: Open) -> Result<Pool> {
        let pool = Shared {
            free: Arc::new(Semaphore::new(size as usize)),
            connections: Mutex::default(),
            open,
            size,
        };
        let first = pool.connect()?;
        lock(&pool.connections).push(first);
        Ok(Pool(Arc::new(pool)))
    }

    /// Acquires a connection once one is free.
    pub(crate) async fn acquire(&self) -> Result<Pooled> {
        let permit = self.0.free.clone().acquire_owned().await;
        let permit = permit.map_err(|_| closed())?;
        let kept = lock(&self.0.connections).pop();
        let connection = match kept {
            Some(connection) => connection,
            None => self.0.connect()?,
        };
        Ok(Pooled {
            connection: Connection(Some(connection)),
            pool: self.0.clone(),
            relaxed: false,
            _permit: permit,
        })
    }

    /// Begins a write transaction. A read transaction that is upgraded would fail if there is another writer. The commit of
    /// a `relaxed` one does not wait for the disk: it survives the process, not a power cut.
    pub(crate) async fn begin(&self, relaxed: bool) -> Result<Pooled> {
        let mut connection = self.acquire().await?;
        if relaxed {
            connection.batch(RELAX)?;
            connection.relaxed = true;
        }
        let begin = |connection: &rusqlite::Connection| connection.execute_batch("BEGIN IMMEDIATE");
        unlocked(&mut connection, begin).await?;
        Ok(connection)
    }

    /// Closes every connection after its use.
    pub(crate) async fn close(&self) {
        let _all = self.0.free.acquire_many(self.0.size).await;
        self.0.free.close();
        let connections = std::mem::take(&mut *lock(&self.0.connections));
        blocking(|| drop(connections));
    }
}

impl Shared {
    fn connect(&self) -> Result<rusqlite::Connection> {
        let connection = blocking(|| (self.open)())?;
        connection.set_prepared_statement_cache_capacity(PREPARED);
        Ok(connection)
    }
}

fn closed() -> StoreError {
    StoreError::away(StorageFault::Unwritable, "the job table is closed")
}

/// A connection in use, or a write transaction on it. Dropped without a commit, the transaction changes nothing.
pub(crate) struct Pooled {
    connection: Connection,
    pool: Arc<Shared>,
    /// Whether commits do not wait for the disk.
    relaxed: bool,
    _permit: OwnedSemaphorePermit,
}

impl Pooled {
    /// Commits the transaction.
    pub(crate) async fn commit(mut self) -> Result<()> {
        let relaxed = self.relaxed;
        self.with(|connection| match relaxed {
            true => connection.execute_batch("COMMIT"),
            false => blocking(|| connection.execute_batch("COMMIT")),
        })
    }
}

impl Deref for Pooled {
    type Target = Connection;

    fn deref(&self) -> &Connection {
        &self.connection
    }
}

impl DerefMut for Pooled {
    fn deref_mut(&mut self) -> &mut Connection {
        &mut self.connection
    }
}

impl Drop for Pooled {
    fn drop(&mut self) {
        if let Some(connection) = self.connection.0.take() {
            if !connection.is_autocommit() {
                // A full disk can leave a connection inside a transaction forever; such a connection is closed.
                let _ = connection.execute_batch("ROLLBACK");
            }
            let strict = !self.relaxed || connection.execute_batch(TIGHTEN).is_ok();
            if connection.is_autocommit() && strict {
                lock(&self.pool.connections).push(connection);
            }
        }
    }
}

/// A connection, until it returns to its pool.
pub(crate) struct Connection(Option<rusqlite::Connection>);

impl Connection {
    fn with<T>(
        &mut self,
        call: impl FnOnce(&rusqlite::Connection) -> rusqlite::Result<T>,
    ) -> Result<T> {
        Ok(call(self.0.as_ref().ok_or_else(closed)?)?)
    }

    /// Runs several statements without parameters.
    pub(crate) fn batch(&mut self, statements: &str) -> Result<()> {
        self.with(|connection| connection.execute_batch(statements))
    }
}

/// A connection, or a pool that provides one for a single statement.
pub(crate) trait Executor: Send {
    /// Runs a statement; `long` if it may wait for the disk or read many rows.
    fn run<T: Send>(
        self,
        long: bool,
        call: impl FnMut(&rusqlite::Connection) -> rusqlite::Result<T> + Send,
    ) -> impl Future<Output = Result<T>> + Send;
}

impl Executor for &mut Connection {
    async fn run<T: Send>(
        self,
        _: bool,
        call: impl FnMut(&rusqlite::Connection) -> rusqlite::Result<T> + Send,
    ) -> Result<T> {
        self.with(call)
    }
}

impl Executor for &Pool {
    async fn run<T: Send>(
        self,
        long: bool,
        mut call: impl FnMut(&rusqlite::Connection) -> rusqlite::Result<T> + Send,
    ) -> Result<T> {
        let mut connection = self.acquire().await?;
        unlocked(&mut connection, |connection| match long {
            true => blocking(|| call(connection)),
            false => call(connection),
        })
        .await
    }
}

/// Runs a call outside a transaction; repeats it for a while if another process holds a lock.
async fn unlocked<T: Send>(
    connection: &mut Connection,
    mut call: impl FnMut(&rusqlite::Connection) -> rusqlite::Result<T> + Send,
) -> Result<T> {
    let start = Instant::now();
    loop {
        let done = connection.with(|connection| match call(connection) {
            Err(error) if error.sqlite_error_code() == Some(ErrorCode::DatabaseBusy) => {
                Ok(Err(error))
            }
            done => done.map(Ok),
        })?;
        match done {
            Ok(done) => return Ok(done),
            Err(locked) if start.elapsed() > LOCK_TIMEOUT => return Err(locked.into()),
            Err(_) => tokio::time::sleep(LOCK_RETRY).await,
        }
    }
}

/// Runs a call that may wait for the disk, while another thread of the runtime takes over the tasks of this one.
fn blocking<T>(call: impl FnOnce() -> T) -> T {
    match Handle::try_current().map(|runtime| runtime.runtime_flavor()) {
        Ok(RuntimeFlavor::MultiThread) => tokio::task::block_in_place(call),
        _ => call(),
    }
}

/// A statement with its parameters.
pub(crate) struct Query {
    text: Cow<'static, str>,
    values: Vec<Value>,
}

/// A statement whose parameters are `$1`, `$2` and so on.
pub(crate) fn query(text: impl Into<Cow<'static, str>>) -> Query {
    Query {
        text: text.into(),
        values: Vec::new(),
    }
}

/// A statement whose rows have one column.
pub(crate) fn query_scalar(text: impl Into<Cow<'static, str>>) -> ScalarQuery {
    ScalarQuery(query(text))
}

fn value(value: impl ToSql) -> Value {
    match value.to_sql() {
        Ok(ToSqlOutput::Owned(value)) => value,
        Ok(ToSqlOutput::Borrowed(value)) => value.try_into().unwrap_or(Value::Null),
        // Numbers, texts and bytes are always borrowed or owned.
        _ => Value::Null,
    }
}

impl Query {
    /// Binds the next parameter.
    pub(crate) fn bind(mut self, parameter: impl ToSql) -> Query {
        self.values.push(value(parameter));
        self
    }

    /// Runs the statement; returns the number of changed rows.
    pub(crate) async fn execute(self, executor: impl Executor) -> Result<Done> {
        let mut none = |_| true;
        let changed = executor.run(true, |connection| {
            self.step(connection, &mut none)?;
            Ok(connection.changes())
        });
        Ok(Done(changed.await?))
    }

    pub(crate) async fn fetch_all(self, executor: impl Executor) -> Result<Vec<SqliteRow>> {
        executor
            .run(true, |connection| {
                let mut rows = Vec::new();
                self.step(connection, &mut |row| {
                    rows.push(row);
                    true
                })?;
                Ok(rows)
            })
            .await
    }

    /// The first row of a statement with few rows, which runs to its end.
    pub(crate) async fn fetch_optional(self, executor: impl Executor) -> Result<Option<SqliteRow>> {
        executor
            .run(false, |connection| {
                let mut first = None;
                self.step(connection, &mut |row| {
                    first.get_or_insert(row);
                    true
                })?;
                Ok(first)
            })
            .await
    }

    pub(crate) async fn fetch_one(self, executor: impl Executor) -> Result<SqliteRow> {
        let none = || StoreError::Corrupt("a statement has no row".to_owned());
        let rows = self.fetch_all(executor).await?;
        rows.into_iter().next().ok_or_else(none)
    }

    /// Passes each row to `row` until that returns `false`.
    pub(crate) async fn for_each(
        self,
        executor: impl Executor,
        mut row: impl FnMut(&SqliteRow) -> Result<bool> + Send,
    ) -> Result<()> {
        let read = |connection: &rusqlite::Connection| {
            let mut done = Ok(());
            self.step(connection, &mut |next| {
                row(&next).unwrap_or_else(|error| {
                    done = Err(error);
                    false
                })
            })?;
            Ok(done)
        };
        executor.run(true, read).await?
    }

    fn step(
        &self,
        connection: &rusqlite::Connection,
        row: &mut dyn FnMut(SqliteRow) -> bool,
    ) -> rusqlite::Result<()> {
        if self.text.len() > PREPARED_TEXT_MAX {
            return self.step_prepared(&mut connection.prepare(&self.text)?, row);
        }
        self.step_prepared(&mut *connection.prepare_cached(&self.text)?, row)
    }

    fn step_prepared(
        &self,
        statement: &mut Statement<'_>,
        row: &mut dyn FnMut(SqliteRow) -> bool,
    ) -> rusqlite::Result<()> {
        for place in 1..=statement.parameter_count() {
            let number = statement
                .parameter_name(place)
                .and_then(|name| name.strip_prefix('$')?.parse::<usize>().ok())
                .unwrap_or(place);
            statement.raw_bind_parameter(place, &self.values[number - 1])?;
        }
        let names = statement.column_names().into_iter().map(str::to_owned);
        let names: Arc<[String]> = names.collect();
        let mut rows = statement.raw_query();
        while let Some(next) = rows.next()? {
            let values = (0..names.len()).map(|place| next.get(place));
            let values = values.collect::<rusqlite::Result<Vec<Value>>>()?;
            let names = names.clone();
            if !row(SqliteRow { names, values }) {
                break;
            }
        }
        Ok(())
    }
}

/// Result of a statement without rows.
pub(crate) struct Done(u64);

impl Done {
    pub(crate) fn rows_affected(&self) -> u64 {
        self.0
    }
}

/// A statement whose rows have one column.
pub(crate) struct ScalarQuery(Query);

impl ScalarQuery {
    /// Binds the next parameter.
    pub(crate) fn bind(self, parameter: impl ToSql) -> ScalarQuery {
        ScalarQuery(self.0.bind(parameter))
    }

    pub(crate) async fn fetch_one<T: FromSql>(self, executor: impl Executor) -> Result<T> {
        self.0.fetch_one(executor).await?.value(0, "0")
    }

    pub(crate) async fn fetch_all<T: FromSql>(self, executor: impl Executor) -> Result<Vec<T>> {
        let rows = self.0.fetch_all(executor).await?;
        rows.iter().map(|row| row.value(0, "0")).collect()
    }
}

/// A row with its column names.
#[derive(Debug)]
pub(crate) struct SqliteRow {
    names: Arc<[String]>,
    values: Vec<Value>,
}

/// Access to the columns of a row.
pub(crate) trait Row {
    /// The value of a column.
    fn try_get<T: FromSql, C: AsRef<str>>(&self, column: C) -> Result<T>;
}

impl Row for SqliteRow {
    fn try_get<T: FromSql, C: AsRef<str>>(&self, column: C) -> Result<T> {
        let column = column.as_ref();
        let index = self.names.iter().position(|name| name == column);
        self.value(index.unwrap_or(self.values.len()), column)
    }
}

impl SqliteRow {
    fn value<T: FromSql>(&self, index: usize, column: &str) -> Result<T> {
        let value = self.values.get(index);
        let read = value.and_then(|value| T::column_result(value.into()).ok());
        read.ok_or_else(|| {
            let kind = std::any::type_name::<T>();
            StoreError::Corrupt(format!("column {column:?} is no {kind}"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::Store;
    use crate::store::sqlite::database::SqliteStore;

    async fn bury(transaction: &mut Pooled, id: &str) -> Result<Done> {
        let insert = query("INSERT INTO tombstones (id, tenant, gone_at) VALUES ($2, $1, 0)");
        insert.bind("t").bind(id).execute(&mut **transaction).await
    }

    async fn buried(store: &SqliteStore) -> Vec<String> {
        let ids = query_scalar("SELECT id FROM tombstones ORDER BY id");
        ids.fetch_all(&store.readers).await.unwrap()
    }

    #[tokio::test]
    async fn a_transaction_that_is_dropped_or_fails_changes_nothing_and_holds_nobody_up() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("jobs.db");
        let store = SqliteStore::open(&file).await.unwrap();
        let mut kept = store.writer.begin(false).await.unwrap();
        assert_eq!(bury(&mut kept, "a").await.unwrap().rows_affected(), 1);
        bury(&mut kept, "b").await.unwrap();
        kept.commit().await.unwrap();

        let mut dropped = store.writer.begin(false).await.unwrap();
        bury(&mut dropped, "c").await.unwrap();
        drop(dropped);
        let mut fails = store.writer.begin(false).await.unwrap();
        bury(&mut fails, "d").await.unwrap();
        assert!(bury(&mut fails, "a").await.is_err());
        drop(fails);
        let mut last = store.writer.begin(false).await.unwrap();
        bury(&mut last, "e").await.unwrap();
        last.commit().await.unwrap();
        assert_eq!(buried(&store).await, ["a", "b", "e"]);
        store.close().await;
        assert!(store.writer.begin(false).await.is_err());
    }

    #[tokio::test]
    async fn only_a_relaxed_transaction_does_not_wait_for_the_disk() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("jobs.db");
        let store = SqliteStore::open(&file).await.unwrap();
        let mode = async |connection: &mut Connection| {
            let mode = query_scalar("PRAGMA synchronous");
            mode.fetch_one::<i64>(connection).await.unwrap()
        };
        for commits in [true, false] {
            let mut relaxed = store.writer.begin(true).await.unwrap();
            let id = if commits { "a" } else { "b" };
            bury(&mut relaxed, id).await.unwrap();
            assert_eq!(mode(&mut relaxed).await, 1);
            match commits {
                true => relaxed.commit().await.unwrap(),
                false => drop(relaxed),
            }
            let mut next = store.writer.begin(false).await.unwrap();
            assert_eq!(mode(&mut next).await, 2, "FULL");
        }
        assert_eq!(buried(&store).await, ["a"]);
    }

    #[tokio::test]
    async fn a_lock_of_another_process_is_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("jobs.db");
        let store = SqliteStore::open(&file).await.unwrap();
        let other = rusqlite::Connection::open(&file).unwrap();
        other.execute_batch("BEGIN IMMEDIATE").unwrap();
        let write = async {
            let mut transaction = store.writer.begin(false).await.unwrap();
            bury(&mut transaction, "a").await.unwrap();
            transaction.commit().await.unwrap();
        };
        let leave = async {
            tokio::time::sleep(5 * LOCK_RETRY).await;
            other.execute_batch("ROLLBACK").unwrap();
        };
        tokio::join!(write, leave);
        assert_eq!(buried(&store).await, ["a"]);
    }
}
