//! Tests a migration of the tables under load on nodes of the previous version, which are then replaced one by one: no request must fail.
//!
//! Without a program of an earlier version, the present one takes its place, and the tables change as a next version might change them.

use std::path::PathBuf;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use railhead::jobs::store::postgres::schema::migrate;
use sqlx::PgPool;
use tokio::task::block_in_place;
use tokio::time::sleep;

use crate::cluster::{Cluster, assert_ended_once, counted, note_ends, until_all_ended};
use crate::nodes::submit;
use crate::support::railhead;
use crate::{postgres, row, without_settings};

const JOBS: usize = 3000;

/// Statements for objects that a version adds to tables in use: a column, an index, a table. Adding a table does not block writers.
const NEXT: [&str; 4] = [
    "SET lock_timeout = '2s'",
    "ALTER TABLE jobs ADD COLUMN later bigint NOT NULL DEFAULT 0; CREATE TABLE later (id bigint PRIMARY KEY)",
    "UPDATE deployment SET form = form + 1",
    "CREATE INDEX CONCURRENTLY jobs_later ON jobs (later) WHERE later > 0",
];

/// Returns the program of the previous version, or the present one.
fn before(old: Option<&PathBuf>) -> Command {
    old.map_or_else(railhead, |old| without_settings(Command::new(old)))
}

/// Migrates the tables. Retries if they are locked for too long.
async fn advance(url: &str, old: bool) {
    if old {
        migrate(url).await.expect("a migration");
        return;
    }
    let pool = PgPool::connect(url).await.expect("the database");
    let mut connection = pool.acquire().await.expect("a connection");
    for statement in NEXT {
        while let Err(error) = sqlx::raw_sql(statement).execute(&mut *connection).await {
            let code = error
                .as_database_error()
                .and_then(sqlx::error::DatabaseError::code);
            assert_eq!(code.as_deref(), Some("55P03"), "{error}");
        }
    }
}

async fn form(pool: &PgPool) -> i64 {
    counted(pool, "SELECT form FROM deployment").await
}

pub async fn run(old: Option<String>) {
    let Some(url) = postgres::database().await else {
        return;
    };
    let old = old.map(PathBuf::from);
    let made = before(old.as_ref())
        .args(["migrate", "--database-url", &url])
        .status();
    assert!(made.expect("the program").success());
    let pool = PgPool::connect(&url).await.expect("the database");
    note_ends(&pool).await;
    let is_new = Arc::new(AtomicBool::new(false));
    let cluster = Cluster::new({
        let (old, is_new) = (old.clone(), is_new.clone());
        move |_| match is_new.load(Ordering::Relaxed) {
            true => railhead(),
            false => before(old.as_ref()),
        }
    });
    for role in ["serve", "serve", "worker", "worker"] {
        let flags = "--lease-s 5 --shutdown-grace-s 2 --drain-delay-s 0";
        cluster.add(role, &url, flags);
    }
    let first_form = form(&pool).await;

    let began = Instant::now();
    let submitting = tokio::spawn({
        let cluster = cluster.clone();
        async move { submit(&cluster, 0, JOBS).await }
    });
    sleep(Duration::from_secs(3)).await;
    let advancing = Instant::now();
    advance(&url, old.is_some()).await;
    let advanced = advancing.elapsed();
    assert!(
        form(&pool).await > first_form,
        "the tables are of a later form"
    );
    sleep(Duration::from_secs(3)).await;
    assert!(!submitting.is_finished(), "more jobs are needed");
    // Workers first, then the API nodes.
    is_new.store(true, Ordering::Relaxed);
    for node in [2, 3, 0, 1] {
        block_in_place(|| cluster.stop(node));
        block_in_place(|| cluster.start(node));
    }
    let (ids, again) = submitting.await.expect("clients");
    until_all_ended(&pool).await;
    let jobs = i64::try_from(ids.len()).expect("few");
    row(
        "jobs, submissions tried again, forms of the tables, seconds in which they changed, seconds to the last end",
        format!(
            "{jobs}, {again}, {first_form} to {}, {:.2}, {:.0}",
            form(&pool).await,
            advanced.as_secs_f64(),
            began.elapsed().as_secs_f64()
        ),
    );
    verify(&cluster, &pool, jobs).await;
}

/// Requires that each job ended once, at its first attempt, and that no node logged a panic or an error.
async fn verify(cluster: &Cluster, pool: &PgPool, jobs: i64) {
    let ended = "SELECT COUNT(*) FROM jobs WHERE state = 'succeeded' AND attempt = 1";
    assert_eq!(counted(pool, ended).await, jobs, "at the first attempt");
    assert_ended_once(pool).await;
    assert_eq!(counted(pool, "SELECT COUNT(*) FROM jobs").await, jobs);
    for wrong in ["panicked", "\"ERROR\""] {
        assert!(
            cluster.logged(wrong).is_empty(),
            "{:?}",
            cluster.logged(wrong)
        );
    }
}
