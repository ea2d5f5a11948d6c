//! Tests that database tables are created once, migrated once, and used only by compatible programs.

use railhead::jobs::store::postgres::doctor::examine;
use railhead::jobs::store::postgres::schema::{Migrated, migrate};
use sqlx::{Connection, PgConnection};

use crate::cluster::postgres::database;
use crate::cluster::{node, old_tables, said_by, tables};
use crate::support::{Service, case, railhead};

/// Starts five nodes at once. Each runs `migrate` first, as its unit file does. Returns the outputs of `migrate` and the nodes.
fn five_starts(url: &str) -> [(String, Service); 5] {
    let start = |number: usize| {
        let (done, said) = said_by(&mut railhead(), &["migrate", "--database-url", url]);
        assert!(done, "{said}");
        (said, node(url, ["serve", "worker"][number % 2], &[]))
    };
    std::thread::scope(|scope| {
        let starts: [_; 5] = std::array::from_fn(|number| scope.spawn(move || start(number)));
        starts.map(|start| start.join().unwrap())
    })
}

#[tokio::test(flavor = "multi_thread")]
async fn five_nodes_start_at_once_on_an_empty_and_on_an_old_database() {
    for (before, says) in [(None, "was created"), (Some(1), "was upgraded")] {
        let url = or_skip!(database().await);
        let mut connection = PgConnection::connect(&url).await.unwrap();
        if let Some(form) = before {
            old_tables::make(&mut connection, form).await;
            let key = "INSERT INTO api_keys (id, hash, tenant, created_at) VALUES ('k', sha256('h'), 'north', 0)";
            sqlx::query(key).execute(&mut connection).await.unwrap();
            let refused = examine(&url).await.unwrap_err().to_string();
            assert!(
                refused.contains("earlier version") && refused.contains("railhead migrate"),
                "{refused}"
            );
        }
        let nodes = tokio::task::block_in_place(|| five_starts(&url));
        let (did, found): (Vec<_>, Vec<_>) =
            nodes.iter().partition(|(said, _)| said.contains(says));
        assert_eq!(did.len(), 1, "{before:?}");
        assert!(found.iter().all(|(said, _)| said.contains("exists")));
        let keys = sqlx::query_scalar("SELECT COUNT(*) FROM api_keys");
        let keys: i64 = keys.fetch_one(&mut connection).await.unwrap();
        assert_eq!(keys, i64::from(before.is_some()));
        // Nodes 0, 2 and 4 answer requests; nodes 1 and 3 solve.
        let apis = [&nodes[0].1, &nodes[2].1, &nodes[4].1];
        for (number, api) in apis.iter().enumerate() {
            let id = api.submit(&case(&format!("of node {number}"))).await;
            apis[(number + 1) % 3].until(&id, "succeeded").await;
        }
    }
}

#[tokio::test]
async fn a_program_goes_on_beside_newer_tables_unless_they_say_that_it_cannot() {
    let url = or_skip!(tables().await);
    let start = || node(&url, "serve", &["--workers", "1"]);
    let before = start();
    let mut connection = PgConnection::connect(&url).await.unwrap();
    // Like a migration to the next version, this adds to a table in use.
    let next = "ALTER TABLE jobs ADD COLUMN later bigint NOT NULL DEFAULT 0; \
         CREATE TABLE later (id bigint); UPDATE deployment SET form = form + 1";
    sqlx::raw_sql(next).execute(&mut connection).await.unwrap();
    let job = before.submit(&case("beside")).await;
    before.until(&job, "succeeded").await;
    drop(before);
    let after = start();
    after.get(&format!("/v1/jobs/{job}/result")).await;
    assert_eq!(migrate(&url).await.unwrap(), Migrated::AlreadyCurrent);

    let contract = "UPDATE deployment SET readable_from = form";
    sqlx::raw_sql(contract)
        .execute(&mut connection)
        .await
        .unwrap();
    for refused in [migrate(&url).await.err(), examine(&url).await.err()] {
        let refused = refused.expect("refused").to_string();
        assert!(refused.contains("another version"), "{refused}");
    }
}
