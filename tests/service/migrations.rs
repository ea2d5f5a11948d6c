//! Are the tables of a database made once, brought forward once, and used only by programs that can?

use railhead::jobs::store::postgres::doctor::examine;
use railhead::jobs::store::postgres::schema::{Migrated, migrate};
use sqlx::{Connection, PgConnection};
use tokio::task::JoinSet;

use crate::postgres::database;
use crate::support::{Service, case};

/// The tables as the first version made them, with the row that says so.
const FIRST_FORM: &str = concat!(
    include_str!("../../src/jobs/store/postgres/schema.sql"),
    "INSERT INTO deployment (one, form) VALUES (1, 1);"
);

/// What five commands that run at once say.
async fn five(url: &str) -> Vec<Migrated> {
    let mut commands = JoinSet::new();
    for _ in 0..5 {
        let url = url.to_owned();
        commands.spawn(async move { migrate(&url).await.unwrap() });
    }
    commands.join_all().await
}

fn count(said: &[Migrated], what: Migrated) -> usize {
    said.iter().filter(|said| **said == what).count()
}

#[tokio::test]
async fn tables_are_made_once_and_old_ones_brought_forward_once_whoever_does_so_at_once() {
    let Some(url) = database().await else {
        return;
    };
    let said = five(&url).await;
    assert_eq!(
        (
            count(&said, Migrated::Made),
            count(&said, Migrated::WasThere)
        ),
        (1, 4)
    );

    let old = database().await.unwrap();
    let mut connection = PgConnection::connect(&old).await.unwrap();
    sqlx::raw_sql(FIRST_FORM)
        .execute(&mut connection)
        .await
        .unwrap();
    let key = "INSERT INTO api_keys (id, hash, tenant, created_at) VALUES ('k', 'h', 'north', 0)";
    sqlx::query(key).execute(&mut connection).await.unwrap();
    let refused = examine(&old).await.unwrap_err().to_string();
    assert!(
        refused.contains("earlier version") && refused.contains("railhead migrate"),
        "{refused}"
    );
    let said = five(&old).await;
    assert_eq!(
        (
            count(&said, Migrated::Advanced),
            count(&said, Migrated::WasThere)
        ),
        (1, 4)
    );
    examine(&old).await.unwrap();
    let kept: i64 = sqlx::query_scalar("SELECT COUNT(*) FROM api_keys")
        .fetch_one(&mut connection)
        .await
        .unwrap();
    assert_eq!(kept, 1);
}

#[tokio::test]
async fn a_program_goes_on_beside_newer_tables_unless_they_say_that_it_cannot() {
    let Some(url) = database().await else {
        return;
    };
    migrate(&url).await.unwrap();
    let folder = tempfile::tempdir().unwrap();
    let start = || Service::start(folder.path(), &["--database-url", &url, "--workers", "1"]);
    let before = start();
    let mut connection = PgConnection::connect(&url).await.unwrap();
    // What the next version does to a table in use: it adds.
    let next = "ALTER TABLE jobs ADD COLUMN later bigint NOT NULL DEFAULT 0; \
         CREATE TABLE later (id bigint); UPDATE deployment SET form = form + 1";
    sqlx::raw_sql(next).execute(&mut connection).await.unwrap();
    let job = before.submit(&case("beside")).await;
    before.until(&job, "succeeded").await;
    drop(before);
    let after = start();
    after.get(&format!("/v1/jobs/{job}/result")).await;
    assert_eq!(migrate(&url).await.unwrap(), Migrated::WasThere);

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
