//! The job table in PostgreSQL by itself: what claims and ends cost with 10⁴ and with 10⁶ queued jobs, and while somebody keeps a
//! transaction open that needs all dead rows.

use std::sync::Arc;
use std::time::{Duration, Instant};

use railhead::jobs::codec::result::EncodedResult;
use railhead::jobs::store::Store;
use railhead::jobs::store::claim::{ClaimKind, ClaimRequest, Lease};
use railhead::jobs::store::cluster::Cluster;
use railhead::jobs::store::ending::{Ending, StoredResult};
use railhead::jobs::store::postgres::database::PostgresStore;
use railhead::jobs::store::postgres::schema::migrate;
use sqlx::{Connection, PgConnection, PgPool};
use tokio::task::JoinSet;

use crate::{postgres, row};

const TENANT: &str = "north";
const GROUP: usize = 32;
const WORKERS: usize = 4;
const RESULT_BYTES: usize = 4096;

/// How long claims and ends are measured.
const MEASURED: Duration = Duration::from_secs(10);

/// How long the old snapshot is held.
const HELD: Duration = Duration::from_secs(60);

/// Adds queued jobs behind those that are there; their ids grow, as those of submissions do.
async fn fill(pool: &PgPool, from: i64, to: i64) {
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

/// What the workers did in some time: jobs, and the seconds of each claim with its end.
#[derive(Default)]
struct Work {
    jobs: usize,
    claims: Vec<f64>,
    ends: Vec<f64>,
}

async fn work(store: Arc<PostgresStore>, until: Instant) -> Work {
    let result = EncodedResult {
        solution: vec![b'x'; RESULT_BYTES].into(),
        fields: None,
    };
    let ending = Ending::Succeeded {
        remarks: Vec::new(),
        result: StoredResult::Inline(result),
        field_patches: 0,
    };
    let request = ClaimRequest {
        worker: "w",
        tenant: TENANT,
        kind: ClaimKind::New,
        jobs: GROUP,
        cost_us: u64::MAX,
        each_slice_us: None,
        workers: 1,
        lease: Lease { now: 0, ms: 30_000 },
        now: 0,
        late_before: 0,
    };
    let mut done = Work::default();
    while Instant::now() < until {
        let began = Instant::now();
        let claims = store.claim(&request).await.expect("a claim");
        done.claims.push(began.elapsed().as_secs_f64());
        assert!(!claims.is_empty(), "more jobs are needed");
        let ends: Vec<_> = claims
            .into_iter()
            .map(|claim| (claim, ending.clone()))
            .collect();
        let began = Instant::now();
        done.jobs += Store::finish(&*store, &ends, 0)
            .await
            .expect("an end")
            .len();
        done.ends.push(began.elapsed().as_secs_f64());
    }
    done
}

/// Claims and ends by several workers at once.
async fn measure(store: &Arc<PostgresStore>, how_long: Duration) -> Work {
    let until = Instant::now() + how_long;
    let mut workers = JoinSet::new();
    // As nodes do.
    let folding = tokio::spawn({
        let store = store.clone();
        async move {
            loop {
                tokio::time::sleep(Duration::from_secs(2)).await;
                store.fold_counts().await.expect("counts");
            }
        }
    });
    for _ in 0..WORKERS {
        workers.spawn(work(store.clone(), until));
    }
    let mut all = Work::default();
    let done = workers.join_all().await;
    folding.abort();
    for mut one in done {
        all.jobs += one.jobs;
        all.claims.append(&mut one.claims);
        all.ends.append(&mut one.ends);
    }
    all
}

fn median(seconds: &mut [f64]) -> f64 {
    seconds.sort_by(f64::total_cmp);
    seconds[seconds.len() / 2]
}

struct Figures {
    per_job_ms: f64,
    claim_ms: f64,
    end_ms: f64,
}

fn figures(mut work: Work, how_long: Duration) -> Figures {
    #[expect(clippy::cast_precision_loss, reason = "few jobs")]
    let per_job_ms = how_long.as_secs_f64() * 1e3 / work.jobs as f64;
    Figures {
        per_job_ms,
        claim_ms: median(&mut work.claims) * 1e3,
        end_ms: median(&mut work.ends) * 1e3,
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
    let store = PostgresStore::open(&url, 8).await.expect("the database");
    let pool = PgPool::connect(&url).await.expect("the database");
    Some((Arc::new(store), pool, url))
}

/// 10⁴ queued jobs, kept full, against 10⁶.
pub async fn depth() {
    let Some((store, pool, _)) = open().await else {
        return;
    };
    let few = 10_000;
    fill(&pool, 0, few).await;
    // As many again as are ended meanwhile, in short pieces.
    let mut shallow = Work::default();
    let (mut next, mut rounds) = (few, 0);
    while rounds < 20 {
        let mut part = measure(&store, MEASURED / 20).await;
        let ended = i64::try_from(part.jobs).expect("a number");
        fill(&pool, next, next + ended).await;
        next += ended;
        shallow.jobs += part.jobs;
        shallow.claims.append(&mut part.claims);
        shallow.ends.append(&mut part.ends);
        rounds += 1;
    }
    let shallow = figures(shallow, MEASURED);
    row("10⁴ queued jobs, 4 workers, groups of 32", &shallow);
    fill(&pool, next, 1_000_000).await;
    let deep = figures(measure(&store, MEASURED).await, MEASURED);
    row("10⁶ queued jobs", &deep);
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

/// Claims before, and in the last quarter of a minute in which somebody holds an old snapshot.
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
