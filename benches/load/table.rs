//! Measures the job table alone, in this process: the cost of a claim for one and for many workers, and lists that match nothing among 200 000 jobs.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use bytes::Bytes;
use railhead::jobs::State;
use railhead::jobs::model::{Kind, SubmitOptions};
use railhead::jobs::store::sqlite::database::SqliteStore;
use railhead::jobs::store::{
    ClaimRequest, Filter, Lease, Membership, NewBatch, NewJob, QueueBounds, ReleaseReason, Store,
};
use uuid::Uuid;

use crate::claims::{TENANT, queue, request};
use crate::machine::median;
use crate::{Row, times};

const QUEUED: usize = 20_000;
const CLAIMS: usize = 200;
const LISTED: usize = 200_000;
const LISTS: usize = 50;
const CHUNK: usize = 1000;

/// Measures the claim of one group.
pub async fn claims() -> Vec<Row> {
    let folder = tempfile::tempdir().expect("a folder");
    let store = open(folder.path()).await;
    fill(&*store, QUEUED).await;
    let mut taken = Vec::new();
    let queue = queue();
    for number in 0..CLAIMS {
        let request = ClaimRequest {
            cost_us: 200_000,
            waiting: 20_000,
            lease: Lease {
                now: 0,
                ms: i64::MAX,
            },
            now: i64::try_from(number).unwrap_or(0),
            ..request(&queue, 256)
        };
        let start = Instant::now();
        let claims = store.claim(&request).await.expect("a claim");
        taken.push(start.elapsed().as_secs_f64());
        assert!(!claims.is_empty());
        let released = store.release(&claims, ReleaseReason::NotBegun, 0).await;
        assert_eq!(released.expect("a release").len(), claims.len());
    }
    vec![Row::plain(
        "claims: median, p99 of a claim among 20 000 jobs",
        times(&taken),
    )]
}

/// Measures lists whose filters match nothing, and one that fills its page.
pub async fn lists() -> Vec<Row> {
    let folder = tempfile::tempdir().expect("a folder");
    let store = open(folder.path()).await;
    let batch = fill(&*store, LISTED).await;
    let filters = filters(batch);
    let mut rows = Vec::new();
    for (name, filter, expected) in filters {
        let mut seconds = Vec::new();
        for _ in 0..LISTS {
            let start = Instant::now();
            let page = store.list(TENANT, &filter, None, 50).await.expect("a page");
            seconds.push(start.elapsed().as_secs_f64());
            assert_eq!(page.entries.len(), expected, "{name}");
        }
        rows.push(Row::judged(
            &format!("lists: median, p99 among 200 000 jobs: {name}"),
            times(&seconds),
            "median ≤ 5 ms",
            median(seconds) <= 0.005,
        ));
    }
    rows
}

/// Returns filters with the number of jobs that they match on a page of 50.
fn filters(batch: Uuid) -> [(&'static str, Filter, usize); 7] {
    let label = vec![("run".to_owned(), "big".to_owned())];
    let failed = vec![State::Failed];
    let of = |batch: Uuid| Some(Membership::Batch(batch));
    let all = Filter::default();
    let failing = Filter {
        states: failed,
        ..all.clone()
    };
    let labelled = Filter {
        labels: label,
        ..failing.clone()
    };
    let within = |filter: &Filter, batch: Uuid| Filter {
        member: of(batch),
        ..filter.clone()
    };
    let other = Filter {
        states: Vec::new(),
        ..within(&labelled, Uuid::now_v7())
    };
    let old = Filter {
        created_before: Some(1),
        ..all.clone()
    };
    [
        ("nothing asked, a full page", all, 50),
        ("batch and state", within(&failing, batch), 0),
        ("label, batch and state", within(&labelled, batch), 0),
        ("label and another batch", other, 0),
        ("state", failing, 0),
        ("label and state", labelled, 0),
        ("a time long ago", old, 0),
    ]
}

async fn open(folder: &Path) -> Arc<dyn Store> {
    let store = SqliteStore::open(&folder.join("jobs.db")).await;
    Arc::new(store.expect("a table"))
}

/// Queues `jobs` small jobs with one label as a batch.
pub async fn fill(store: &dyn Store, jobs: usize) -> Uuid {
    let batch = NewBatch {
        id: Uuid::now_v7(),
        tenant: TENANT.into(),
        kind: Kind::Cases,
        created_at: 0,
        count: u32::try_from(jobs).expect("a count"),
        rejected: 0,
        name: None,
        labels: Default::default(),
        template: None,
        head: None,
        bytes: 0,
        idempotency: None,
    };
    let id = batch.id;
    let nobody = |_: Uuid| false;
    let begun = store.begin_batch(&batch, &nobody, QueueBounds::NONE);
    begun.await.expect("a batch");
    for start in (0..jobs).step_by(CHUNK) {
        let some: Vec<_> = (start..start + CHUNK)
            .map(|index| (u32::try_from(index).expect("an index"), job()))
            .collect();
        store.fill_batch(id, &some).await.expect("jobs");
    }
    store.complete_batch(id).await.expect("the batch");
    id
}

fn job() -> NewJob {
    NewJob {
        id: Uuid::now_v7(),
        tenant: TENANT.into(),
        kind: Kind::Case,
        created_at: 0,
        name: None,
        labels: BTreeMap::from([("run".to_owned(), "big".to_owned())]),
        method: "auto".to_owned(),
        body: Bytes::from_static(b"{}"),
        row: false,
        outputs: "[]".to_owned(),
        cost_us: 1000,
        slice_us: 1000,
        cache_key: None,
        idempotency: None,
        traceparent: None,
        options: SubmitOptions::default(),
    }
}
