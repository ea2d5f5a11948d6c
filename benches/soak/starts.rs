//! Tests five nodes that start at once, each migrating the tables first, on databases of every age with many jobs. The tables must be migrated once,
//! and all nodes must work afterwards.

use std::path::Path;
use std::time::Instant;

use sqlx::{Connection, PgConnection, PgPool};
use tokio::task::block_in_place;

use crate::queue::fill;
use crate::support::{Service, case, railhead};
use crate::{old_tables, postgres, row};

/// Number of jobs that are already in the tables.
const JOBS: i64 = 100_000;

/// Migrates the tables, then starts the node. Returns the output of the migration as well.
fn start(url: &str, number: usize) -> (String, Service) {
    let mut migrate = railhead();
    let done = migrate.args(["migrate", "--database-url", url]).output();
    let done = done.expect("the program");
    assert!(done.status.success(), "{done:?}");
    let (role, workers) = [("serve", "0"), ("worker", "1")][number % 2];
    let flags = ["--database-url", url, "--workers", workers];
    let said = String::from_utf8_lossy(&done.stdout).into_owned();
    (said, Service::alone(&mut railhead(), role, &flags))
}

/// Checks that nodes 0, 2 and 4 answer requests: each submitted job is read at the next of these nodes.
async fn work(nodes: &[(String, Service)]) {
    for number in [0, 2, 4] {
        let (one, other) = (&nodes[number].1, &nodes[(number + 2) % 6].1);
        let mut urgent = case(&format!("of node {number}"));
        urgent["load"]["normal_force_n"] = (50_000 + number).into();
        let job = one
            .post("/v1/jobs?priority=high", &urgent)
            .await
            .is(202)
            .json;
        let id = job["id"].as_str().expect("an id");
        other.until(id, "succeeded").await;
    }
}

/// Returns the schema version that the present program makes.
fn newest() -> u32 {
    let steps = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/jobs/store/postgres/steps");
    let names = std::fs::read_dir(steps).expect("the steps");
    let forms = names.map(|name| {
        let path = name.expect("a step").path();
        let form = path
            .file_stem()
            .and_then(|name| name.to_str()?.parse().ok());
        form.expect("a number")
    });
    forms.max().expect("a step")
}

pub async fn run() {
    for form in 0..newest() {
        let Some(url) = postgres::database().await else {
            return;
        };
        if form > 0 {
            let mut connection = PgConnection::connect(&url).await.expect("the database");
            old_tables::make(&mut connection, form).await;
            let pool = PgPool::connect(&url).await.expect("the database");
            fill(&pool, 0, JOBS).await;
        }
        let began = Instant::now();
        let nodes: Vec<_> = block_in_place(|| {
            std::thread::scope(|scope| {
                let url = &url;
                let starts: Vec<_> = (0..5)
                    .map(|number| scope.spawn(move || start(url, number)))
                    .collect();
                starts
                    .into_iter()
                    .map(|start| start.join().expect("a node"))
                    .collect()
            })
        });
        let seconds = began.elapsed().as_secs_f64();
        let did = nodes.iter().filter(|(said, _)| !said.contains("exists"));
        assert_eq!(did.count(), 1, "one makes or changes the tables");
        work(&nodes).await;
        let before = match form {
            0 => "an empty database".to_owned(),
            form => format!("form {form} with {JOBS} jobs"),
        };
        row(
            &format!("seconds until five nodes were ready on {before}"),
            format!("{seconds:.1}"),
        );
    }
}
