//! What the jobs room counts for the operator. Labels have few values, all known beforehand: never an id, never a name
//! that a client chose.

use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::metrics::info::Info;
use prometheus_client::registry::{Metric, Registry};

use crate::contact::case::words::solver::MethodName;
use crate::contact::evaluate::many_answer::ManyAnswer;
use crate::contact::solution::words::answer::Solution;
use crate::jobs::model::{FailureKind, State};
use crate::jobs::store::Ending;

/// Upper bounds of solve times in s.
const SOLVE_SECONDS: [f64; 14] = [
    0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 1000.0,
];

/// Upper bounds of Newton iterations of one motion on one patch.
const ITERATIONS: [f64; 9] = [2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0, 200.0];

/// A label with its value.
type Label = [(&'static str, &'static str); 1];

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
    pub(crate) jobs: Family<Label, Gauge>,
    pub(crate) oldest_queued_seconds: Gauge<f64, std::sync::atomic::AtomicU64>,
    pub(crate) queue_cost_seconds: Gauge<f64, std::sync::atomic::AtomicU64>,
    pub(crate) database_bytes: Gauge,
    pub(crate) result_bytes: Gauge,
    pub(crate) operator_bytes: Gauge,
    solve_seconds: Family<Label, Histogram>,
    iterations: Family<Label, Histogram>,
    rows: Family<Label, Counter>,
    ended: Family<Label, Counter>,
    failures: Family<Label, Counter>,
    storage_failing: Gauge,
    pub(crate) abandoned: Gauge,
    pub(crate) workers: Gauge,
    working: Gauge,
    cache_hits: Counter,
    cache_misses: Counter,
    pub(crate) results_swept: Counter,
    pub(crate) store_requests: StoreRequests,
}

/// Requests to an object store, by method and by class of the answer: `2xx` to `5xx`, or `none` if there was none.
#[derive(Debug, Clone, Default)]
#[cfg_attr(
    not(feature = "cluster"),
    expect(dead_code, reason = "only clusters keep results in object stores")
)]
pub(crate) struct StoreRequests(Family<[(&'static str, String); 2], Counter>);

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
        let labels = [("method", method.to_owned()), ("status", status.to_owned())];
        self.0.get_or_create_owned(&labels).inc();
    }
}

/// Registers a metric and returns it.
fn registered<M: Metric + Clone>(registry: &mut Registry, name: &str, about: &str, metric: M) -> M {
    registry.register(name, about, metric.clone());
    metric
}

impl Metrics {
    /// Counters at zero, and the registry that shows them.
    #[expect(clippy::too_many_lines, reason = "one entry for each metric")]
    pub(crate) fn new() -> (Metrics, Registry) {
        let mut registry = Registry::with_prefix("railhead");
        let version = Info::new([("version", env!("CARGO_PKG_VERSION"))]);
        registry.register("build", "The running version", version);
        let all = &mut registry;
        let metrics = Metrics {
            jobs: registered(all, "jobs", "Jobs in the store by state", Family::default()),
            oldest_queued_seconds: registered(
                all,
                "queue_oldest_age_seconds",
                "Age of the oldest queued job; 0 if none is queued",
                Gauge::default(),
            ),
            queue_cost_seconds: registered(
                all,
                "queue_cost_seconds",
                "Expected solver seconds of all queued jobs, from the mean of up to 1000 of them",
                Gauge::default(),
            ),
            database_bytes: registered(
                all,
                "database_bytes",
                "Size of the job table with its write-ahead log",
                Gauge::default(),
            ),
            result_bytes: registered(
                all,
                "result_bytes",
                "Size of the results kept outside the job table",
                Gauge::default(),
            ),
            operator_bytes: registered(
                all,
                "operator_store_bytes",
                "Size of the operators of meshes that are kept in memory for the next cases",
                Gauge::default(),
            ),
            store_requests: StoreRequests(registered(
                all,
                "result_store_requests",
                "Requests to the object store of the results, repeated ones included, by the class of the answer",
                Family::default(),
            )),
            results_swept: registered(
                all,
                "results_swept",
                "Results without a job removed from outside the database",
                Counter::default(),
            ),
            rows: registered(
                all,
                "run_rows",
                "Rows of runs that were answered, by what became of them",
                Family::default(),
            ),
            storage_failing: registered(
                all,
                "storage_failing",
                "1 while the disk is full or cannot be written, or database or object store cannot be reached",
                Gauge::default(),
            ),
            abandoned: registered(
                all,
                "solver_threads_abandoned",
                "Solver threads that did not stop when they were told to and still run",
                Gauge::default(),
            ),
            workers: registered(
                all,
                "workers",
                "Workers, each with one solver at work at most",
                Gauge::default(),
            ),
            working: registered(
                all,
                "workers_busy",
                "Workers whose solver is at work",
                Gauge::default(),
            ),
            solve_seconds: registered(
                all,
                "solve_seconds",
                "Wall time of one case on a solver thread, by the method that gave the numbers",
                Family::new_with_constructor(|| Histogram::new(SOLVE_SECONDS)),
            ),
            iterations: registered(
                all,
                "newton_iterations",
                "Newton iterations of one motion on one patch",
                Family::new_with_constructor(|| Histogram::new(ITERATIONS)),
            ),
            ended: registered(
                all,
                "jobs_ended",
                "Jobs that ended, by state",
                Family::default(),
            ),
            cache_hits: registered(
                all,
                "cache_hits",
                "Cases answered with the result of an identical earlier one",
                Counter::default(),
            ),
            cache_misses: registered(
                all,
                "cache_misses",
                "Cases for which an earlier result was looked for in vain",
                Counter::default(),
            ),
            failures: registered(
                all,
                "job_failures",
                "Jobs that failed, by reason",
                Family::default(),
            ),
        };
        // A series that appears only with its first event hides that event from a rate.
        for state in State::ALL.into_iter().filter(|state| state.ended()) {
            drop(metrics.ended.get_or_create(&state_label(state)));
        }
        for kind in FailureKind::ALL {
            drop(metrics.failures.get_or_create(&reason_label(kind)));
        }
        (metrics, registry)
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

    /// Rows of a run were answered.
    pub(crate) fn rows_ended(&self, answer: &ManyAnswer) {
        for status in &answer.status {
            self.rows.get_or_create(&[("status", status.name())]).inc();
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
}

pub(crate) fn state_label(state: State) -> Label {
    [("state", state.name())]
}

fn reason_label(kind: FailureKind) -> Label {
    [("reason", kind.name())]
}
