//! Tests the job counts per state, tenant and kind. A count is the sum of rows that are merged from time to time.

use railhead::jobs::store::Store;
use railhead::jobs::store::postgres::database::PostgresStore;
use sqlx::{Connection, PgConnection};

use crate::cluster::tables;

const FILL: &str = "INSERT INTO jobs (id, tenant, kind, state, labels, method, outputs, cost_us, slice_us, bypass_cache, rank, created_at, updated_at) \
     SELECT gen_random_uuid(), $1, $2, 'queued', '{}', 'auto', '[]', 3000, 3000, 1, 1, n, n FROM generate_series(1, $3) AS n";

const SUMS: &str = "SELECT tenant, kind, CAST(SUM(number) AS bigint) FROM job_counts GROUP BY tenant, kind \
     ORDER BY tenant, kind";

#[tokio::test]
async fn adding_up_the_counts_keeps_their_sums_and_leaves_one_row_of_each() {
    let url = or_skip!(tables().await);
    let mut connection = PgConnection::connect(&url).await.unwrap();
    for (tenant, kind, number) in [
        ("north", "case", 2),
        ("north", "case", 3),
        ("north", "rows", 4),
        ("south", "rows", 1),
        ("south", "rows", 1),
    ] {
        let fill = sqlx::query(FILL).bind(tenant).bind(kind).bind(number);
        fill.execute(&mut connection).await.unwrap();
    }
    let store = PostgresStore::open(&url, 2).await.unwrap();
    store.cluster().unwrap().fold_counts().await.unwrap();
    let sums: Vec<(String, String, i64)> = sqlx::query_as(SUMS)
        .fetch_all(&mut connection)
        .await
        .unwrap();
    let expected = [
        ("north", "case", 5),
        ("north", "rows", 4),
        ("south", "rows", 2),
    ];
    assert_eq!(
        sums,
        expected.map(|(tenant, kind, number)| (tenant.to_owned(), kind.to_owned(), number))
    );
    let rows: i64 = sqlx::query_scalar("SELECT COUNT(*) FROM job_counts")
        .fetch_one(&mut connection)
        .await
        .unwrap();
    assert_eq!(rows, 3);
}
