//! `railhead doctor`: checks of a shared database.

use sqlx::postgres::PgPool;
use sqlx::query_scalar;

use crate::error::JobsError;
use crate::store::postgres::connection::connect;
use crate::store::postgres::schema::require;

/// Oldest supported version of the server, in its own notation.
const VERSION_MIN: i64 = 150_000;

/// A larger clock offset is a problem, in ms.
const OFFSET_MAX: i64 = 5_000;

/// A transaction that is open for longer prevents the removal of dead rows, in s.
const TRANSACTION_MAX: i64 = 300;

/// More dead rows of the job table than this slow down claims.
const DEAD_ROWS_MAX: i64 = 200_000;

/// Result of one check.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// Subject.
    pub about: &'static str,
    /// Finding.
    pub says: String,
    /// Whether it is a problem.
    pub wrong: bool,
}

/// Subject, statement and criterion of a check.
type Question = (&'static str, &'static str, fn(i64) -> bool);

macro_rules! questions {
    ($($about:literal $statement:literal $wrong:expr;)*) => {
        [$(($about, $statement, $wrong)),*]
    };
}

const NUMBERS: [Question; 10] = questions! {
    "server version"
        "SELECT CAST(current_setting('server_version_num') AS bigint)"
        |version| version < VERSION_MIN;
    "server is read-only (1: it is a standby)"
        "SELECT CASE WHEN pg_is_in_recovery() THEN 1::bigint ELSE 0 END"
        |standby| standby > 0;
    "commits are on the disk when they are answered (0: they may be lost)"
        "SELECT CASE WHEN current_setting('synchronous_commit') = 'off' OR current_setting('fsync') = 'off' THEN 0::bigint ELSE 1 END"
        |durable| durable == 0;
    // Behind a pooler that drops the session options, the settings of the role apply.
    "seconds after which a session that was left inside a transaction is ended (0: never)"
        "SELECT setting::bigint / 1000 FROM pg_settings WHERE name = 'idle_in_transaction_session_timeout'"
        |seconds| seconds == 0;
    "nodes seen within 20 s"
        "SELECT COUNT(*) FROM nodes WHERE seen_at > CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint) - 20000"
        |_| false;
    "queued jobs"
        "SELECT CAST(COALESCE(SUM(number), 0) AS bigint) FROM job_counts WHERE state = 'queued'"
        |_| false;
    "running jobs whose lease ran out more than 2 min ago"
        "SELECT COUNT(*) FROM jobs WHERE state = 'running' AND lease_until < CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint) - 120000"
        |stuck| stuck > 0;
    "seconds for which the oldest transaction is open"
        "SELECT CAST(COALESCE(MAX(extract(epoch FROM clock_timestamp() - xact_start)), 0) AS bigint) FROM pg_stat_activity WHERE pid <> pg_backend_pid() AND backend_type = 'client backend'"
        |seconds| seconds > TRANSACTION_MAX;
    "dead rows of the job table"
        "SELECT CAST(COALESCE(MAX(n_dead_tup), 0) AS bigint) FROM pg_stat_user_tables WHERE relid = to_regclass('jobs')"
        |rows| rows > DEAD_ROWS_MAX;
    "indices that are not valid"
        "SELECT COUNT(*) FROM pg_index JOIN pg_class ON pg_class.oid = indexrelid WHERE NOT indisvalid AND relnamespace = CAST(current_schema() AS regnamespace)"
        |invalid| invalid > 0;
};

/// Checks a database with a job table; changes nothing.
///
/// # Errors
/// [`JobsError::NotMigrated`], [`JobsError::UnsupportedSchema`], or it cannot be reached.
pub async fn examine(url: &str) -> Result<Vec<Finding>, JobsError> {
    let (_, pool) = connect(url, 1).await?;
    let findings = ask(&pool).await;
    pool.close().await;
    findings
}

async fn ask(pool: &PgPool) -> Result<Vec<Finding>, JobsError> {
    require(pool).await?;
    let mut findings = vec![clock(pool).await?];
    for (about, statement, wrong) in NUMBERS {
        let number: i64 = sql!(scalar fetch_one, pool, statement)?;
        findings.push(Finding {
            about,
            says: number.to_string(),
            wrong: wrong(number),
        });
    }
    Ok(findings)
}

async fn clock(pool: &PgPool) -> Result<Finding, JobsError> {
    let here = || jiff::Timestamp::now().as_millisecond();
    let asked = here();
    let there: i64 = sql!(scalar fetch_one, pool,
        "SELECT CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint)"
    )?;
    let offset = there - i64::midpoint(asked, here());
    Ok(Finding {
        about: "ms by which the clock of the database is ahead of that of this machine",
        says: offset.to_string(),
        wrong: offset.abs() > OFFSET_MAX,
    })
}
