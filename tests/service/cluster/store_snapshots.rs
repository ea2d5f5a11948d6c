//! Tests that claims and ends cost no more while a transaction stays open, so that dead rows remain. The tests count work, not time.

use railhead::jobs::codec::result::EncodedResult;
use railhead::jobs::model::Queue;
use railhead::jobs::store::postgres::database::PostgresStore;
use railhead::jobs::store::{
    ClaimRequest, Claims, Ending, Ends, Lease, ReleaseReason, Store, StoredResult,
};
use sqlx::{Connection, PgConnection};

use crate::cluster::tables;
use crate::store::{self, queue_of};

const QUEUED: i64 = 9000;
const GROUP: usize = 32;
const GROUPS: usize = 128;

/// Inserts queued jobs with increasing ids, as submissions do.
const FILL: &str = "INSERT INTO jobs (id, tenant, state, labels, method, outputs, cost_us, slice_us, bypass_cache, rank, created_at, updated_at) \
     SELECT lpad(to_hex(n), 8, '0') || '-0000-7000-8000-000000000000', 'north', 'queued', '{}', 'auto', '[]', 3000, 3000, 1, 1, n, n \
     FROM generate_series(1, $1) AS n";

/// Returns how many entries of an index statements have read.
async fn read(connection: &mut PgConnection, index: &str) -> i64 {
    let read = "SELECT idx_tup_read FROM pg_stat_user_indexes WHERE indexrelname = $1";
    sqlx::query_scalar(read)
        .bind(index)
        .fetch_one(connection)
        .await
        .unwrap()
}

fn request(queue: &Queue) -> ClaimRequest<'_> {
    ClaimRequest {
        waiting: QUEUED.unsigned_abs(),
        lease: Lease { now: 0, ms: 30_000 },
        ..store::request(queue, GROUP, 0)
    }
}

fn success() -> Ending {
    Ending::Succeeded {
        remarks: Vec::new(),
        result: StoredResult::Inline(EncodedResult {
            solution: b"{}".as_slice().into(),
            fields: None,
        }),
        field_patches: 0,
    }
}

#[tokio::test]
async fn claims_and_ends_do_not_walk_over_dead_rows_and_miss_nothing_that_came_back() {
    let url = or_skip!(tables().await);
    let mut connection = PgConnection::connect(&url).await.unwrap();
    sqlx::query(FILL)
        .bind(QUEUED)
        .execute(&mut connection)
        .await
        .unwrap();
    sqlx::raw_sql("VACUUM ANALYZE jobs")
        .execute(&mut connection)
        .await
        .unwrap();
    let mut holder = PgConnection::connect(&url).await.unwrap();
    let hold = "BEGIN ISOLATION LEVEL REPEATABLE READ; SELECT COUNT(*) FROM nodes";
    sqlx::raw_sql(hold).execute(&mut holder).await.unwrap();

    let store = PostgresStore::open(&url, 2).await.unwrap();
    let ending = success();
    let mut seen = std::collections::BTreeSet::new();
    for group in 0..GROUPS {
        let claims = store.claim(&request(&queue_of("north"))).await.unwrap();
        assert_eq!(claims.len(), GROUP);
        if group == GROUPS / 2 {
            // The next claim begins with the released jobs.
            let back = Claims::release(&store, &claims, ReleaseReason::NotBegun, 0).await;
            assert_eq!(back.unwrap().len(), GROUP);
            let again = store.claim(&request(&queue_of("north"))).await.unwrap();
            assert_eq!(again[0].id, claims[0].id);
            Claims::release(&store, &again, ReleaseReason::NotBegun, 0)
                .await
                .unwrap();
            continue;
        }
        seen.extend(claims.iter().map(|claim| claim.id));
        let ends: Vec<_> = claims
            .into_iter()
            .map(|claim| (claim, ending.clone()))
            .collect();
        let ended = Ends::finish(&store, &ends, 0).await.unwrap();
        assert_eq!(ended.len(), GROUP);
    }
    assert_eq!(seen.len(), GROUP * (GROUPS - 1), "no job was claimed twice");
    // Sessions report their statistics when they end.
    store.close().await;
    let jobs = i64::try_from(GROUP * GROUPS).unwrap();
    let mut told = read(&mut connection, "jobs_queued").await;
    while told < jobs {
        tokio::time::sleep(std::time::Duration::from_millis(50)).await;
        told = read(&mut connection, "jobs_queued").await;
    }
    let running = read(&mut connection, "jobs_running").await;
    // Claims scan from the start of the index the first time, once every two seconds, and after jobs were released.
    assert!(
        told < 8 * jobs,
        "{told} entries of the queue for {jobs} jobs"
    );
    assert!(
        running < jobs,
        "{running} entries of running jobs for {jobs} jobs"
    );
}
