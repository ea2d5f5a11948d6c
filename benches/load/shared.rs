//! Measures claims and ends on a job table shared by several nodes, on the PostgreSQL whose URL is in `RAILHEAD_TEST_POSTGRES`.

use std::sync::Arc;
use std::time::Instant;

use railhead::jobs::codec::result::EncodedResult;
use railhead::jobs::model::{Kind, Queue};
use railhead::jobs::store::postgres::database::PostgresStore;
use railhead::jobs::store::postgres::schema::migrate;
use railhead::jobs::store::{ClaimKind, ClaimRequest, Ending, Lease, Store, StoredResult};

use crate::Row;
use crate::table::{TENANT, fill};

const QUEUED: usize = 20_000;
const GROUP: usize = 32;
const RESULT_BYTES: usize = 4096;

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
        let workers: Vec<_> = (0..workers)
            .map(|_| tokio::spawn(work(store.clone())))
            .collect();
        let mut ended = 0;
        for worker in workers {
            ended += worker.await.expect("a worker");
        }
        #[expect(clippy::cast_precision_loss, reason = "few jobs")]
        rates.push(format!(
            "{:.0}",
            ended as f64 / start.elapsed().as_secs_f64()
        ));
    }
    vec![Row::plain(name, rates.join("; "))]
}

async fn work(store: Arc<dyn Store>) -> usize {
    let result = EncodedResult {
        solution: vec![b'x'; RESULT_BYTES].into(),
        fields: None,
    };
    let ending = Ending::Succeeded {
        remarks: Vec::new(),
        result: StoredResult::Inline(result),
        field_patches: 0,
    };
    let queue = Queue {
        tenant: TENANT.into(),
        kind: Kind::Case,
    };
    let request = ClaimRequest {
        worker: "w",
        queue: &queue,
        kind: ClaimKind::New,
        jobs: GROUP,
        cost_us: u64::MAX,
        each_slice_us: None,
        suspects: true,
        waiting: 0,
        lease: Lease { now: 0, ms: 30_000 },
        now: 0,
        late_before: 0,
    };
    let mut ended = 0;
    loop {
        let claims = store.claim(&request).await.expect("a claim");
        if claims.is_empty() {
            return ended;
        }
        let ends: Vec<_> = claims
            .into_iter()
            .map(|claim| (claim, ending.clone()))
            .collect();
        ended += store.finish(&ends, 0).await.expect("an end").len();
    }
}
