//! What the jobs room counts for the operator. Labels have few values, all known beforehand: never an id, never a name
//! that a client chose.

use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::metrics::info::Info;
use prometheus_client::registry::Registry;

use crate::contact::case::words::solver::MethodName;
use crate::contact::evaluate::many_answer::ManyAnswer;
use crate::contact::solution::words::answer::Solution;
use crate::jobs::model::job::{FailureKind, State};
use crate::jobs::store::ending::Ending;

/// Upper bounds of solve times in s.
const SOLVE_SECONDS: [f64; 14] = [
    0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 1000.0,
];

/// Upper bounds of Newton iterations of one motion on one patch.
const ITERATIONS: [f64; 9] = [2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0, 200.0];

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(crate) struct StateLabel {
    state: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct MethodLabel {
    method: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct ReasonLabel {
    reason: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct StatusLabel {
    status: &'static str,
}

/// A solver at work.
#[derive(Debug)]
pub(crate) struct BusyWorker(Gauge);

impl Drop for BusyWorker {
    fn drop(&mut self) {
        self.0.dec();
    }
}

/// Counters of one service; clones share them.
#[derive(Debug, Clone)]
pub(crate) struct Metrics {
    pub(crate) jobs: Family<StateLabel, Gauge>,
    pub(crate) oldest_queued_seconds: Gauge<f64, std::sync::atomic::AtomicU64>,
    pub(crate) queue_cost_seconds: Gauge<f64, std::sync::atomic::AtomicU64>,
    pub(crate) database_bytes: Gauge,
    pub(crate) result_bytes: Gauge,
    pub(crate) operator_bytes: Gauge,
    solve_seconds: Family<MethodLabel, Histogram>,
    iterations: Family<MethodLabel, Histogram>,
    rows: Family<StatusLabel, Counter>,
    ended: Family<StateLabel, Counter>,
    failures: Family<ReasonLabel, Counter>,
    storage_failing: Gauge,
    pub(crate) parked: Gauge,
    pub(crate) abandoned: Gauge,
    pub(crate) workers: Gauge,
    working: Gauge,
    cache_hits: Counter,
    cache_misses: Counter,
    pub(crate) results_swept: Counter,
    pub(crate) store_requests: StoreRequests,
}

/// Requests to an object store.
#[derive(Debug, Clone, Default)]
pub(crate) struct StoreRequests(Family<RequestLabel, Counter>);

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct RequestLabel {
    method: String,
    /// `2xx` to `5xx`, or `none` if there was no answer.
    status: &'static str,
}

impl StoreRequests {
    /// A request was answered with this status, or not at all.
    #[cfg(feature = "cluster")]
    pub(crate) fn count(&self, method: &str, status: Option<u16>) {
        let status = match status.map(|status| status / 100) {
            Some(2) => "2xx",
            Some(3) => "3xx",
            Some(4) => "4xx",
            Some(_) => "5xx",
            None => "none",
        };
        let label = RequestLabel {
            method: method.to_owned(),
            status,
        };
        self.0.get_or_create(&label).inc();
    }
}

impl Metrics {
    pub(crate) fn new() -> Metrics {
        let metrics = Metrics {
            jobs: Family::default(),
            oldest_queued_seconds: Gauge::default(),
            queue_cost_seconds: Gauge::default(),
            database_bytes: Gauge::default(),
            result_bytes: Gauge::default(),
            operator_bytes: Gauge::default(),
            solve_seconds: Family::new_with_constructor(|| Histogram::new(SOLVE_SECONDS)),
            iterations: Family::new_with_constructor(|| Histogram::new(ITERATIONS)),
            rows: Family::default(),
            ended: Family::default(),
            failures: Family::default(),
            storage_failing: Gauge::default(),
            parked: Gauge::default(),
            abandoned: Gauge::default(),
            workers: Gauge::default(),
            working: Gauge::default(),
            cache_hits: Counter::default(),
            cache_misses: Counter::default(),
            results_swept: Counter::default(),
            store_requests: StoreRequests::default(),
        };
        // A series that appears only with its first event hides that event from a rate.
        for state in State::ALL.into_iter().filter(|state| state.ended()) {
            drop(metrics.ended.get_or_create(&state_label(state)));
        }
        for kind in FailureKind::ALL {
            drop(metrics.failures.get_or_create(&reason_label(kind)));
        }
        metrics
    }

    /// A solver is at work as long as this is held.
    pub(crate) fn working(&self) -> BusyWorker {
        self.working.inc();
        BusyWorker(self.working.clone())
    }

    /// A case was solved in `seconds`.
    pub(crate) fn solved(&self, asked: MethodName, solution: &Solution, seconds: f64) {
        let points = || solution.patches.iter().flat_map(|patch| &patch.points);
        let used = points().next().map_or(asked, |point| point.solver.method);
        let used = MethodLabel {
            method: used.name(),
        };
        self.solve_seconds.get_or_create(&used).observe(seconds);
        for point in points() {
            let method = MethodLabel {
                method: point.solver.method.name(),
            };
            self.iterations
                .get_or_create(&method)
                .observe(f64::from(point.solver.iterations));
        }
    }

    /// Rows of a run were answered.
    pub(crate) fn rows_ended(&self, answer: &ManyAnswer) {
        for status in &answer.status {
            let status = StatusLabel {
                status: status.name(),
            };
            self.rows.get_or_create(&status).inc();
        }
    }

    /// A job ended in this way.
    pub(crate) fn ending(&self, ending: &Ending) {
        match ending {
            Ending::Succeeded { .. } | Ending::Cached { .. } => self.ended(State::Succeeded, 1),
            Ending::Cancelled => self.ended(State::Cancelled, 1),
            Ending::Failed(failure) => self.failed(failure.kind),
        }
    }

    /// A job failed for this reason.
    pub(crate) fn failed(&self, kind: FailureKind) {
        self.ended(State::Failed, 1);
        self.failures.get_or_create(&reason_label(kind)).inc();
    }

    /// Jobs ended in this state.
    pub(crate) fn ended(&self, state: State, jobs: u64) {
        self.ended.get_or_create(&state_label(state)).inc_by(jobs);
    }

    /// Cached results were asked for.
    pub(crate) fn cache_lookup(&self, hits: u64, misses: u64) {
        self.cache_hits.inc_by(hits);
        self.cache_misses.inc_by(misses);
    }

    /// The disk takes data, or does not.
    pub(crate) fn storage_failing(&self, failing: bool) {
        self.storage_failing.set(i64::from(failing));
    }

    pub(crate) fn register(&self, registry: &mut Registry) {
        registry.register(
            "build",
            "The running version",
            Info::new([("version", env!("CARGO_PKG_VERSION"))]),
        );
        registry.register("jobs", "Jobs in the store by state", self.jobs.clone());
        registry.register(
            "queue_oldest_age_seconds",
            "Age of the oldest queued job; 0 if none is queued",
            self.oldest_queued_seconds.clone(),
        );
        registry.register(
            "queue_cost_seconds",
            "Expected solver seconds of all queued jobs, from the mean of up to 1000 of them",
            self.queue_cost_seconds.clone(),
        );
        registry.register(
            "database_bytes",
            "Size of the job table with its write-ahead log",
            self.database_bytes.clone(),
        );
        registry.register(
            "result_bytes",
            "Size of the results kept outside the job table",
            self.result_bytes.clone(),
        );
        registry.register(
            "operator_store_bytes",
            "Size of the operators of meshes that are kept in memory for the next cases",
            self.operator_bytes.clone(),
        );
        registry.register(
            "result_store_requests",
            "Requests to the object store of the results, repeated ones included, by the class of the answer",
            self.store_requests.0.clone(),
        );
        registry.register(
            "results_swept",
            "Results without a job removed from outside the database",
            self.results_swept.clone(),
        );
        registry.register(
            "run_rows",
            "Rows of runs that were answered, by what became of them",
            self.rows.clone(),
        );
        registry.register(
            "storage_failing",
            "1 while the disk is full or cannot be written, or database or object store cannot be reached",
            self.storage_failing.clone(),
        );
        registry.register(
            "solves_waiting",
            "Solves that wait for their next turn, with all that they have in memory",
            self.parked.clone(),
        );
        registry.register(
            "solver_threads_abandoned",
            "Solver threads that did not stop when they were told to and still run",
            self.abandoned.clone(),
        );
        self.register_solves(registry);
    }

    fn register_solves(&self, registry: &mut Registry) {
        registry.register(
            "workers",
            "Workers, each with one solver at work at most",
            self.workers.clone(),
        );
        registry.register(
            "workers_busy",
            "Workers whose solver is at work",
            self.working.clone(),
        );
        registry.register(
            "solve_seconds",
            "Wall time of one case on a solver thread, by the method that gave the numbers",
            self.solve_seconds.clone(),
        );
        registry.register(
            "newton_iterations",
            "Newton iterations of one motion on one patch",
            self.iterations.clone(),
        );
        registry.register(
            "jobs_ended",
            "Jobs that ended, by state",
            self.ended.clone(),
        );
        registry.register(
            "cache_hits",
            "Cases answered with the result of an identical earlier one",
            self.cache_hits.clone(),
        );
        registry.register(
            "cache_misses",
            "Cases for which an earlier result was looked for in vain",
            self.cache_misses.clone(),
        );
        registry.register(
            "job_failures",
            "Jobs that failed, by reason",
            self.failures.clone(),
        );
    }
}

pub(crate) fn state_label(state: State) -> StateLabel {
    StateLabel {
        state: state.name(),
    }
}

fn reason_label(kind: FailureKind) -> ReasonLabel {
    ReasonLabel {
        reason: kind.name(),
    }
}
