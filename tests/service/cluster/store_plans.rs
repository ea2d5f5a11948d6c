//! Tests that statements on a long queue in PostgreSQL read few rows. The server logs the plan of every statement with the actual rows of each
//! step.

use std::sync::Arc;

use railhead::jobs::model::{Kind, Queue};
use railhead::jobs::store::postgres::database::PostgresStore;
use railhead::jobs::store::{
    Claim, ClaimKind, ClaimRequest, Enqueued, Filter, Lease, Membership, Moment, NewJob,
    QueueBounds, Reap, ReleaseReason, RetentionRule, Store,
};
use railhead::jobs::{Failure, FailureKind, State};
use serde_json::Value;
use sqlx::PgPool;
use uuid::Uuid;

use crate::cluster::postgres::{log_lines, with_parameter};
use crate::cluster::tables;
use crate::store::{self, new_job, queue_of, success};

const TENANT: &str = "north";
const GROUP: usize = 32;

/// The maximal number of rows that one step of a plan may read. Most statements read some tens of rows; lists count up to 1000 jobs.
const ROWS_MAX: f64 = 1500.0;

/// Inserts queued jobs with increasing ids, as submissions do. Every tenth job belongs to another tenant, every hundredth has a deadline.
const FILL: &str = "INSERT INTO jobs (id, tenant, state, labels, method, outputs, cost_us, slice_us, bypass_cache, rank, created_at, updated_at, deadline) \
     SELECT lpad(to_hex(n), 8, '0') || '-0000-7000-8000-000000000000', CASE WHEN n % 10 = 0 THEN 'south' ELSE 'north' END, 'queued', \
     '{}', 'auto', '[]', 3000, 3000, 1, 1, n, n, CASE WHEN n % 100 = 0 THEN 9000000000000 END FROM generate_series(1, $1) AS n";

/// Logs the plan of every statement of a session with the actual rows. Only a superuser may set this.
const EXPLAINED: &str = "options=-c%20session_preload_libraries%3Dauto_explain%20-c%20auto_explain.log_min_duration%3D0%20\
     -c%20auto_explain.log_analyze%3Don%20-c%20auto_explain.log_timing%3Doff%20-c%20auto_explain.log_format%3Djson";

fn request(queue: &Queue, kind: ClaimKind) -> ClaimRequest<'_> {
    ClaimRequest {
        kind,
        waiting: 10_000,
        lease: Lease { now: 0, ms: 60_000 },
        ..store::request(queue, GROUP, 1)
    }
}

/// Makes the calls that nodes and clients repeat.
async fn use_store(store: &Arc<dyn Store>) {
    let queue = queue_of(TENANT);
    let mut claims: Vec<Claim> = Vec::new();
    for _ in 0..4 {
        let group = store.claim(&request(&queue, ClaimKind::New)).await.unwrap();
        assert_eq!(group.len(), GROUP);
        claims.extend(group);
    }
    assert!(
        store
            .claim(&request(&queue, ClaimKind::Begun))
            .await
            .unwrap()
            .is_empty()
    );
    let held: Vec<_> = claims.iter().map(|claim| (claim, 0.5)).collect();
    store
        .renew(&held, Lease { now: 0, ms: 60_000 })
        .await
        .unwrap();
    let ids: Vec<_> = claims.iter().map(|claim| claim.id).collect();
    store.claimed_cases(&ids[..GROUP]).await.unwrap();
    let ends: Vec<_> = claims[..GROUP]
        .iter()
        .map(|claim| (claim.clone(), success()))
        .collect();
    assert_eq!(store.finish(&ends, 2).await.unwrap().len(), GROUP);
    store
        .release(&claims[GROUP..GROUP + 4], ReleaseReason::NotBegun, 2)
        .await
        .unwrap();
    store.cancel(TENANT, claims[GROUP + 4].id, 2).await.unwrap();
    store
        .cluster()
        .unwrap()
        .cancel_requests(&ids)
        .await
        .unwrap();
    maintain(store).await;
    read_lists(store, ids[0]).await;
    store.delete(TENANT, ids[0]).await.unwrap();
}

/// Makes the maintenance calls of a node and the common requests of clients.
async fn maintain(store: &Arc<dyn Store>) {
    store.reap(Reap::Expired { now: 1 }, 2, 5).await.unwrap();
    let failure = Failure::new(FailureKind::DeadlinePassed, "late");
    let moment = Moment {
        now: 2,
        set_at: 0,
        unset: 2,
    };
    store.pass_deadlines(&failure, moment).await.unwrap();
    let rule = RetentionRule {
        now: 2,
        ended_before: 1,
        forget_before: 0,
        jobs: 500,
    };
    store.expire(rule).await.unwrap();
    let new = NewJob {
        tenant: TENANT.into(),
        idempotency: Some(("key".to_owned(), [1; 32])),
        ..new_job()
    };
    let added = store
        .enqueue(
            &new,
            QueueBounds {
                all: 2_000_000,
                tenant: 2_000_000,
                stored: None,
            },
        )
        .await
        .unwrap();
    assert!(matches!(added, Enqueued::Created(_)), "{added:?}");
    store.queues().await.unwrap();
    store.stats().await.unwrap();
    store.usage(TENANT).await.unwrap();
    store.ready(true).await.unwrap();
}

async fn read_lists(store: &Arc<dyn Store>, id: Uuid) {
    store.job(TENANT, id).await.unwrap();
    for states in [
        vec![],
        vec![State::Queued],
        vec![State::Succeeded],
        vec![State::Failed],
    ] {
        for after in [None, Some(id)] {
            for member in [None, Some(Membership::Alone)] {
                let filter = Filter {
                    states: states.clone(),
                    member,
                    ..Filter::default()
                };
                store.list(TENANT, &filter, after, 50).await.unwrap();
            }
        }
    }
    let labelled = Filter {
        labels: vec![("line".to_owned(), "A12".to_owned())],
        ..Filter::default()
    };
    store.list(TENANT, &labelled, None, 50).await.unwrap();
    store
        .batches(TENANT, &Filter::of(Kind::Cases), None, 50)
        .await
        .unwrap();
}

/// Collects the faults of a step of a plan and of the steps below it.
fn faults(step: &Value, faults: &mut Vec<String>) {
    let number = |key: &str| step[key].as_f64().unwrap_or(0.0);
    let removed = number("Rows Removed by Filter") + number("Rows Removed by Index Recheck");
    let rows = (number("Actual Rows") + removed) * number("Actual Loops");
    let (kind, relation) = (
        step["Node Type"].as_str().unwrap_or(""),
        step["Relation Name"].as_str(),
    );
    if rows > ROWS_MAX {
        faults.push(format!("{kind} of {relation:?}: {rows} rows"));
    }
    if kind == "Seq Scan" && relation == Some("jobs") {
        faults.push("walks all jobs".to_owned());
    }
    for below in step["Plans"].as_array().into_iter().flatten() {
        self::faults(below, faults);
    }
}

/// Fills a queue, makes the calls and checks the plans of all statements. Returns the number of plans.
pub async fn look_at_plans(queued: i64) -> Option<usize> {
    let url = tables().await?;
    let pool = PgPool::connect(&url).await.unwrap();
    sqlx::query(FILL).bind(queued).execute(&pool).await.unwrap();
    sqlx::raw_sql("VACUUM ANALYZE")
        .execute(&pool)
        .await
        .unwrap();
    let before = log_lines()?.len();
    let store = PostgresStore::open(&with_parameter(&url, EXPLAINED), 2)
        .await
        .unwrap();
    let store: Arc<dyn Store> = Arc::new(store.with_given_clock());
    use_store(&store).await;
    store.close().await;
    let lines = log_lines()?;
    let mut lines = lines[before.min(lines.len())..].iter().peekable();
    let (mut seen, mut wrong) = (0, Vec::new());
    while let Some(line) = lines.next() {
        if !line.ends_with("plan:") {
            continue;
        }
        let mut text = String::new();
        while let Some(more) = lines.next_if(|line| line.starts_with('\t')) {
            text.push_str(more);
        }
        let explained: Value = serde_json::from_str(&text).expect("a plan");
        let mut found = Vec::new();
        faults(&explained["Plan"], &mut found);
        if !found.is_empty() {
            wrong.push(format!("{found:?}: {}", explained["Query Text"]));
        }
        seen += 1;
    }
    assert!(wrong.is_empty(), "{queued} queued: {wrong:#?}");
    assert!(seen > 40, "{seen} plans");
    Some(seen)
}

#[tokio::test]
async fn no_statement_walks_a_long_queue() {
    // A million rows take half a minute: RAILHEAD_TEST_QUEUED=1000000 cargo test --test service -- store_plans
    let queued = std::env::var("RAILHEAD_TEST_QUEUED");
    let queued = queued.map_or(20_000, |queued| queued.parse().expect("a number"));
    look_at_plans(queued).await;
}
