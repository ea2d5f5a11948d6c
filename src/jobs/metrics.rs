//! Prometheus metrics of jobs. Labels have few, fixed values: never ids or names chosen by clients.

use std::sync::atomic::AtomicU64;

use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::metrics::info::Info;
use prometheus_client::registry::Registry;

use crate::model::{FailureKind, State};
use crate::store::Ending;
use railhead_contact::case::words::solver::MethodName;
use railhead_contact::evaluate::answer::RowsAnswer;
use railhead_contact::solution::words::answer::Solution;

/// Upper bounds of solve times in s.
const SOLVE_SECONDS: [f64; 14] = [
    0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 1000.0,
];

/// Upper bounds of Newton iterations of one motion on one patch.
const ITERATIONS: [f64; 9] = [2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0, 200.0];

/// A label with its value.
type Label = [(&'static str, &'static str); 1];

/// Counts a busy worker until it is dropped.
#[derive(Debug)]
pub(crate) struct BusyWorker(Gauge);

impl Drop for BusyWorker {
    fn drop(&mut self) {
        self.0.dec();
    }
}

/// Declares the metrics, each with its name and help text.
macro_rules! metrics {
    ($($vis:vis $field:ident: $kind:ty = $make:expr, $name:literal $about:literal;)*) => {
        /// Metrics of one service; clones share them.
        #[derive(Debug, Clone)]
        pub(crate) struct Metrics {
            $($vis $field: $kind,)*
        }

        impl Metrics {
            fn registered(registry: &mut Registry) -> Metrics {
                $(
                    let $field: $kind = $make;
                    registry.register($name, $about, $field.clone());
                )*
                Metrics { $($field),* }
            }
        }
    };
}

metrics! {
    pub(crate) jobs: Family<Label, Gauge> = Family::default(), "jobs" "Jobs in the store by state";
    pub(crate) oldest_queued_seconds: Gauge<f64, AtomicU64> = Gauge::default(), "queue_oldest_age_seconds" "Age of the oldest queued job; 0 if none is queued";
    pub(crate) queue_cost_seconds: Gauge<f64, AtomicU64> = Gauge::default(), "queue_cost_seconds" "Expected solver seconds of all queued jobs, from the mean of up to 1000 of them";
    pub(crate) database_bytes: Gauge = Gauge::default(), "database_bytes" "Size of the job table with its write-ahead log";
    pub(crate) result_bytes: Gauge = Gauge::default(), "result_bytes" "Size of the results kept outside the job table";
    pub(crate) operator_bytes: Gauge = Gauge::default(), "operator_store_bytes" "Size of the mesh operators kept in memory for later cases";
    solve_seconds: Family<Label, Histogram> = Family::new_with_constructor(|| Histogram::new(SOLVE_SECONDS)), "solve_seconds" "Wall time of one case on a solver thread, by method";
    iterations: Family<Label, Histogram> = Family::new_with_constructor(|| Histogram::new(ITERATIONS)), "newton_iterations" "Newton iterations of one motion on one patch";
    rows: Family<Label, Counter> = Family::default(), "run_rows" "Rows of runs, by outcome";
    ended: Family<Label, Counter> = Family::default(), "jobs_ended" "Jobs that ended, by state";
    failures: Family<Label, Counter> = Family::default(), "job_failures" "Jobs that failed, by reason";
    storage_failing: Gauge = Gauge::default(), "storage_failing" "1 while the disk is full or cannot be written, or database or object store cannot be reached";
    pub(crate) abandoned: Gauge = Gauge::default(), "solver_threads_abandoned" "Solver threads that ignored a stop request and still run";
    pub(crate) workers: Gauge = Gauge::default(), "workers" "Number of workers";
    working: Gauge = Gauge::default(), "workers_busy" "Workers that are solving";
    cache_hits: Counter = Counter::default(), "cache_hits" "Cases answered with an identical earlier result";
    cache_misses: Counter = Counter::default(), "cache_misses" "Cases without an identical earlier result";
    pub(crate) results_swept: Counter = Counter::default(), "results_swept" "Results without a job that were removed outside the database";
    pub(crate) store_requests: StoreRequests = Family::default(), "result_store_requests" "Requests to the object store of the results, repeated ones included, by the class of the answer";
}

/// Requests to an object store, by method and by status class: `2xx` to `5xx`, or `none` without a response.
pub(crate) type StoreRequests = Family<[(&'static str, String); 2], Counter>;

/// Counts a request with the status of its response, if there was one.
#[cfg(feature = "cluster")]
pub(crate) fn count_request(requests: &StoreRequests, method: &str, status: Option<u16>) {
    let status = match status.map(|status| status / 100) {
        Some(2) => "2xx",
        Some(3) => "3xx",
        Some(4) => "4xx",
        Some(_) => "5xx",
        None => "none",
    };
    let labels = [("method", method.to_owned()), ("status", status.to_owned())];
    requests.get_or_create_owned(&labels).inc();
}

impl Metrics {
    /// Creates the metrics and their registry.
    pub(crate) fn new() -> (Metrics, Registry) {
        let mut registry = Registry::with_prefix("railhead");
        let version = Info::new([("version", env!("CARGO_PKG_VERSION"))]);
        registry.register("build", "The running version", version);
        let metrics = Metrics::registered(&mut registry);
        // A series that appears with its first event hides that event from a rate.
        for state in State::ALL.into_iter().filter(|state| state.ended()) {
            drop(metrics.ended.get_or_create(&state_label(state)));
        }
        for kind in FailureKind::ALL {
            drop(metrics.failures.get_or_create(&reason_label(kind)));
        }
        (metrics, registry)
    }

    /// Counts a busy worker until the guard is dropped.
    pub(crate) fn working(&self) -> BusyWorker {
        self.working.inc();
        BusyWorker(self.working.clone())
    }

    /// Records a case that was solved in `seconds`.
    pub(crate) fn solved(&self, asked: MethodName, solution: &Solution, seconds: f64) {
        let points = || solution.patches.iter().flat_map(|patch| &patch.points);
        let used = points().next().map_or(asked, |point| point.solver.method);
        let label = |method: MethodName| [("method", method.name())];
        let taken = self.solve_seconds.get_or_create_owned(&label(used));
        taken.observe(seconds);
        for point in points() {
            let method = label(point.solver.method);
            self.iterations
                .get_or_create(&method)
                .observe(f64::from(point.solver.iterations));
        }
    }

    /// Counts the rows of a chunk by status.
    pub(crate) fn rows_ended(&self, answer: &RowsAnswer) {
        for status in &answer.status {
            self.rows.get_or_create(&[("status", status.name())]).inc();
        }
    }

    /// Counts a job that ended in this way.
    pub(crate) fn ending(&self, ending: &Ending) {
        match ending {
            Ending::Succeeded { .. } | Ending::Cached { .. } => self.ended(State::Succeeded, 1),
            Ending::Cancelled => self.ended(State::Cancelled, 1),
            Ending::Failed { failure, .. } => self.failed(failure.kind),
        }
    }

    /// Counts a job that failed for this reason.
    pub(crate) fn failed(&self, kind: FailureKind) {
        self.ended(State::Failed, 1);
        self.failures.get_or_create(&reason_label(kind)).inc();
    }

    /// Counts jobs that ended in this state.
    pub(crate) fn ended(&self, state: State, jobs: u64) {
        self.ended.get_or_create(&state_label(state)).inc_by(jobs);
    }

    /// Counts lookups in the result cache.
    pub(crate) fn cache_lookup(&self, hits: u64, misses: u64) {
        self.cache_hits.inc_by(hits);
        self.cache_misses.inc_by(misses);
    }

    /// Sets whether storage rejects writes.
    pub(crate) fn storage_failing(&self, failing: bool) {
        self.storage_failing.set(i64::from(failing));
    }
}

pub(crate) fn state_label(state: State) -> Label {
    [("state", state.name())]
}

fn reason_label(kind: FailureKind) -> Label {
    [("reason", kind.name())]
}
