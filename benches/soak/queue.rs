//! Measures the job table in PostgreSQL alone: the cost of claims and ends with 10⁴ and with 10⁶ queued jobs, and during an open transaction that
//! needs all dead rows.

use std::sync::Arc;
use std::time::{Duration, Instant};

use railhead::jobs::State;
use railhead::jobs::store::postgres::database::PostgresStore;
use railhead::jobs::store::postgres::schema::migrate;
use railhead::jobs::store::{Cluster, Filter, Store};
use sqlx::{Connection, PgConnection, PgPool};
use tokio::task::JoinSet;

use crate::claims::{TENANT, Work, work};
use crate::machine::median;
use crate::simulation::Costs;
use crate::{postgres, row};

const GROUP: usize = 32;
const WORKERS: usize = 4;

/// Duration of the measurement of claims and ends.
const MEASURED: Duration = Duration::from_secs(10);

/// Time for which the old snapshot is held.
const HELD: Duration = Duration::from_secs(60);

/// Adds queued jobs after the existing ones. Their ids increase, as those of submissions do.
pub async fn fill(pool: &PgPool, from: i64, to: i64) {
    let statement = "INSERT INTO jobs (id, tenant, state, labels, method, outputs, cost_us, slice_us, bypass_cache, rank, created_at, updated_at) \
         SELECT lpad(to_hex(n), 8, '0') || '-0000-7000-8000-000000000000', $3, 'queued', '{}', 'auto', '[]', 3000, 3000, 1, 1, n, n \
         FROM generate_series($1, $2 - 1) AS n";
    sqlx::query(statement)
        .bind(from)
        .bind(to)
        .bind(TENANT)
        .execute(&mut *pool.acquire().await.expect("a connection"))
        .await
        .expect("queued jobs");
    sqlx::raw_sql("VACUUM ANALYZE jobs")
        .execute(pool)
        .await
        .expect("figures");
}

/// Measures claims and ends by several concurrent workers, in groups of 32.
async fn measure(store: &Arc<PostgresStore>, how_long: Duration) -> Work {
    measure_as(store, how_long, WORKERS, GROUP).await
}

/// Measures with this number of workers and of jobs in a group.
async fn measure_as(
    store: &Arc<PostgresStore>,
    how_long: Duration,
    workers_at_once: usize,
    group: usize,
) -> Work {
    let until = Instant::now() + how_long;
    let mut workers = JoinSet::new();
    // Nodes do this too.
    let folding = tokio::spawn({
        let store = store.clone();
        async move {
            loop {
                tokio::time::sleep(Duration::from_secs(2)).await;
                store.fold_counts().await.expect("counts");
            }
        }
    });
    for _ in 0..workers_at_once {
        workers.spawn(work(store.clone(), group, Some(until)));
    }
    let mut all = Work::default();
    let done = workers.join_all().await;
    folding.abort();
    done.into_iter().for_each(|one| all.add(one));
    all
}

struct Figures {
    per_job_ms: f64,
    claim_ms: f64,
    end_ms: f64,
}

fn figures(work: Work, how_long: Duration) -> Figures {
    let per_job_ms = how_long.as_secs_f64() * 1e3 / work.jobs as f64;
    Figures {
        per_job_ms,
        claim_ms: median(work.claims) * 1e3,
        end_ms: median(work.ends) * 1e3,
    }
}

impl std::fmt::Display for Figures {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let rate = 1e3 / self.per_job_ms;
        write!(
            f,
            "{rate:.0}/s, claim {:.1} ms, end {:.1} ms",
            self.claim_ms, self.end_ms
        )
    }
}

async fn open() -> Option<(Arc<PostgresStore>, PgPool, String)> {
    let url = postgres::database().await?;
    migrate(&url).await.expect("tables");
    let store = PostgresStore::open(&url, 12).await.expect("the database");
    let pool = PgPool::connect(&url).await.expect("the database");
    Some((Arc::new(store), pool, url))
}

/// Compares 10⁴ queued jobs, kept constant, with 10⁶.
pub async fn depth() {
    let Some((store, pool, _)) = open().await else {
        return;
    };
    let few = 10_000;
    fill(&pool, 0, few).await;
    // Submits as many jobs as end meanwhile, in small groups.
    let mut shallow = Work::default();
    let (mut next, mut rounds) = (few, 0);
    while rounds < 20 {
        let part = measure(&store, MEASURED / 20).await;
        let ended = i64::try_from(part.jobs).expect("a number");
        fill(&pool, next, next + ended).await;
        next += ended;
        shallow.add(part);
        rounds += 1;
    }
    let shallow = figures(shallow, MEASURED);
    row("10⁴ queued jobs, 4 workers, groups of 32", &shallow);
    let looks = look(&store).await;
    fill(&pool, next, 1_000_000).await;
    let deep = figures(measure(&store, MEASURED).await, MEASURED);
    row("10⁶ queued jobs", &deep);
    let deep_looks = look(&store).await;
    let against = |each: usize| {
        let (few, many) = (looks[each], deep_looks[each]);
        format!("{few:.2} and {many:.2} ms, {:.2} ×", many / few)
    };
    row(
        "10⁶ against 10⁴: list, list of queued jobs, figures of /metrics, use of a tenant",
        (0..4).map(against).collect::<Vec<_>>().join("; "),
    );
    row(
        "10⁶ against 10⁴: time per job, per claim, per end",
        format!(
            "{:.2} ×, {:.2} ×, {:.2} ×",
            deep.per_job_ms / shallow.per_job_ms,
            deep.claim_ms / shallow.claim_ms,
            deep.end_ms / shallow.end_ms
        ),
    );
}

/// Returns the median times in ms of typical queries of clients and operators: a page of a list, a page of queued jobs, figures, usage of a tenant.
async fn look(store: &Arc<PostgresStore>) -> [f64; 4] {
    let store: &dyn Store = &**store;
    let queued = Filter {
        states: vec![State::Queued],
        ..Filter::default()
    };
    let mut times: [Vec<f64>; 4] = Default::default();
    for _ in 0..40 {
        let mut began = Instant::now();
        let mut lap = |look: usize| {
            times[look].push(began.elapsed().as_secs_f64());
            began = Instant::now();
        };
        let page = store.list(TENANT, &Filter::default(), None, 50).await;
        page.expect("a list");
        lap(0);
        let page = store.list(TENANT, &queued, None, 50).await;
        page.expect("a list");
        lap(1);
        store.stats().await.expect("figures");
        lap(2);
        store.usage(TENANT).await.expect("use");
        lap(3);
    }
    times.map(|times| median(times) * 1e3)
}

/// Measures claims and ends per second by 8 workers, in groups of 32 with results of 4 kB, and the cost of each job for the server, with 3·10⁵
/// queued jobs.
pub async fn rate() {
    let Some((store, pool, _)) = open().await else {
        return;
    };
    fill(&pool, 0, 300_000).await;
    // The warm-up opens connections and prepares plans. After a checkpoint, each page is first written in full.
    measure_as(&store, MEASURED / 10, 8, GROUP).await;
    let before = (server_seconds(&pool).await, written(&pool).await);
    let work = measure_as(&store, MEASURED, 8, GROUP).await;
    let seconds = server_seconds(&pool).await - before.0;
    let bytes = written(&pool).await - before.1;
    let jobs = work.jobs as f64;
    row(
        "8 workers, groups of 32, results of 4 kB",
        figures(work, MEASURED),
    );
    let each = (bytes as f64 / jobs / 1e3, seconds * 1e3 / jobs);
    row(
        "of each job: written to the log of PostgreSQL, processor time of PostgreSQL",
        format!("{:.1} kB, {:.3} ms", each.0, each.1),
    );
}

/// Returns the bytes that the server has written to its write-ahead log.
async fn written(pool: &PgPool) -> i64 {
    let asked = sqlx::query_scalar("SELECT CAST(pg_current_wal_lsn() - '0/0' AS bigint)");
    asked.fetch_one(pool).await.expect("its log")
}

/// Returns the processor seconds of all processes of the server.
async fn server_seconds(pool: &PgPool) -> f64 {
    let processes: Vec<i32> = sqlx::query_scalar("SELECT pid FROM pg_stat_activity")
        .fetch_all(pool)
        .await
        .expect("its processes");
    let ticks = processes.iter().map(|process| {
        let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
        // After the name, which may contain any characters: the state, then ten numbers, then user and system time in hundredths of a second.
        let numbers = stat.rsplit(')').next().unwrap_or_default();
        let ticks = numbers.split_whitespace().skip(11).take(2);
        ticks
            .filter_map(|ticks| ticks.parse::<f64>().ok())
            .sum::<f64>()
    });
    ticks.sum::<f64>() / 100.0
}

/// Returns the cost of a claim and its end for the server, and of each further job of the claim.
pub async fn costs() -> Option<Costs> {
    let (store, pool, _) = open().await?;
    fill(&pool, 0, 300_000).await;
    let mut measured = Vec::new();
    for group in [1, 64] {
        // The warm-up opens connections and prepares plans.
        measure_as(&store, MEASURED / 10, 4, group).await;
        let before = server_seconds(&pool).await;
        let done = measure_as(&store, MEASURED, 4, group).await;
        let seconds = server_seconds(&pool).await - before;
        let server_us = seconds * 1e6 / done.claims.len() as f64;
        let pairs = done.claims.iter().zip(&done.ends);
        let times = pairs.map(|(claim, end)| claim + end).collect();
        measured.push((server_us, median(times) * 1e6));
    }
    let job_us = (measured[1].0 - measured[0].0) / 63.0;
    Some(Costs {
        group_us: (measured[0].0 - job_us).max(0.0),
        job_us,
        round_trip_us: (measured[0].1 - measured[0].0).max(0.0),
    })
}

/// Compares claims before an old snapshot is held with those in the last quarter of a minute with it.
pub async fn snapshot() {
    let Some((store, pool, url)) = open().await else {
        return;
    };
    fill(&pool, 0, 900_000).await;
    let before = figures(measure(&store, MEASURED).await, MEASURED);
    row("before the snapshot", &before);
    let mut holder = PgConnection::connect(&url).await.expect("the database");
    let begin = "BEGIN ISOLATION LEVEL REPEATABLE READ; SELECT COUNT(*) FROM nodes";
    sqlx::raw_sql(begin)
        .execute(&mut holder)
        .await
        .expect("a snapshot");
    let quarter = HELD / 4;
    let mut last = before.claim_ms;
    for number in 1..=4 {
        let held = figures(measure(&store, quarter).await, quarter);
        row(&format!("snapshot held, quarter minute {number}"), &held);
        last = held.claim_ms;
    }
    row(
        "claim after a minute against before",
        format!("{:.2} ×", last / before.claim_ms),
    );
}
