//! Claims and ends of jobs, as workers make them.

use std::sync::Arc;
use std::time::Instant;

use railhead::jobs::codec::result::EncodedResult;
use railhead::jobs::model::{Kind, Queue};
use railhead::jobs::store::{ClaimKind, ClaimRequest, Ending, Lease, Store, StoredResult};

use crate::random::Random;

pub const TENANT: &str = "north";
const RESULT_BYTES: usize = 4096;

/// Returns the queue of the tenant.
pub fn queue() -> Queue {
    Queue {
        tenant: TENANT.into(),
        kind: Kind::Case,
    }
}

/// Returns a request for this number of new jobs.
pub fn request(queue: &Queue, jobs: usize) -> ClaimRequest<'_> {
    ClaimRequest {
        worker: "w",
        queue,
        kind: ClaimKind::New,
        jobs,
        cost_us: u64::MAX,
        each_slice_us: None,
        suspects: true,
        waiting: 0,
        lease: Lease { now: 0, ms: 30_000 },
        now: 0,
        late_before: 0,
    }
}

/// Number of ended jobs, and the seconds of each claim and of each end.
#[derive(Default)]
pub struct Work {
    pub jobs: usize,
    pub claims: Vec<f64>,
    pub ends: Vec<f64>,
}

impl Work {
    /// Adds the work of another worker or period.
    pub fn add(&mut self, mut other: Work) {
        self.jobs += other.jobs;
        self.claims.append(&mut other.claims);
        self.ends.append(&mut other.ends);
    }
}

/// Claims groups of jobs and ends them with results of 4 kB until `until`, or until no job is queued.
pub async fn work(store: Arc<dyn Store>, group: usize, until: Option<Instant>) -> Work {
    let result = EncodedResult {
        solution: solution().into(),
        fields: None,
    };
    let ending = Ending::Succeeded {
        remarks: Vec::new(),
        result: StoredResult::Inline(result),
        field_patches: 0,
    };
    let queue = queue();
    let request = request(&queue, group);
    let mut done = Work::default();
    while until.is_none_or(|until| Instant::now() < until) {
        let began = Instant::now();
        let claims = store.claim(&request).await.expect("a claim");
        if claims.is_empty() {
            assert!(until.is_none(), "more jobs are needed");
            break;
        }
        done.claims.push(began.elapsed().as_secs_f64());
        let ends = claims.into_iter().map(|claim| (claim, ending.clone()));
        let ends: Vec<_> = ends.collect();
        let began = Instant::now();
        done.jobs += store.finish(&ends, 0).await.expect("an end").len();
        done.ends.push(began.elapsed().as_secs_f64());
    }
    done
}

/// Returns a text of numbers like a solution, which hardly compresses.
fn solution() -> Vec<u8> {
    let mut random = Random(1);
    let mut text = Vec::new();
    while text.len() < RESULT_BYTES {
        text.extend(format!("{},", random.part()).bytes());
    }
    text.truncate(RESULT_BYTES);
    text
}
