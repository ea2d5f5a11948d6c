//! Measures claims and ends on a job table shared by several nodes, on the PostgreSQL whose URL is in `RAILHEAD_TEST_POSTGRES`.

use std::sync::Arc;
use std::time::Instant;

use railhead::jobs::store::Store;
use railhead::jobs::store::postgres::database::PostgresStore;
use railhead::jobs::store::postgres::schema::migrate;
use tokio::task::JoinSet;

use crate::Row;
use crate::claims::{Work, work};
use crate::table::fill;

const QUEUED: usize = 20_000;
const GROUP: usize = 32;

/// Claims groups of 32 jobs and ends them with results of 4 kB, with 1 and with 8 workers, until the queue is empty.
pub async fn ends() -> Vec<Row> {
    let name = "shared: jobs claimed and ended per second, groups of 32, results of 4 kB, 1 worker; 8 workers";
    let Ok(url) = std::env::var("RAILHEAD_TEST_POSTGRES") else {
        return vec![Row::plain(
            name,
            "RAILHEAD_TEST_POSTGRES is not set".to_owned(),
        )];
    };
    migrate(&url).await.expect("tables");
    let store = PostgresStore::open(&url, 12).await.expect("the database");
    let store: Arc<dyn Store> = Arc::new(store);
    let mut rates = Vec::new();
    for workers in [1, 8] {
        fill(&*store, QUEUED).await;
        let start = Instant::now();
        let works: JoinSet<_> = (0..workers)
            .map(|_| work(store.clone(), GROUP, None))
            .collect();
        let mut all = Work::default();
        for one in works.join_all().await {
            all.add(one);
        }
        let rate = all.jobs as f64 / start.elapsed().as_secs_f64();
        rates.push(format!("{rate:.0}"));
    }
    vec![Row::plain(name, rates.join("; "))]
}
