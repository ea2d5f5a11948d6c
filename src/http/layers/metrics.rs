//! Metrics of requests, by route, method and status, and of the process.

use std::sync::Arc;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use axum::extract::{MatchedPath, Request, State};
use axum::http::Method;
use axum::middleware::Next;
use axum::response::Response;
use prometheus_client::collector::Collector;
use prometheus_client::encoding::text::{encode, encode_registry};
use prometheus_client::encoding::{DescriptorEncoder, EncodeLabelSet, EncodeMetric};
use prometheus_client::metrics::counter::{ConstCounter, Counter};
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::ConstGauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::Registry;

use railhead_jobs::Jobs;

/// Upper bounds of the times to the head of a response, in s.
const REQUEST_SECONDS: [f64; 13] = [
    0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 1.0, 2.5, 10.0, 60.0,
];

/// Label of requests for paths that do not exist, of which clients could invent any number.
const UNMATCHED: &str = "unmatched";

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct RequestLabel {
    method: &'static str,
    route: String,
    status: u16,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct RouteLabel {
    method: &'static str,
    route: String,
}

/// Metrics of requests, and the registry of all metrics except those of jobs. Clones share them.
#[derive(Debug, Clone)]
pub struct Metrics {
    requests: Family<RequestLabel, Counter>,
    seconds: Family<RouteLabel, Histogram>,
    registry: Arc<Registry>,
    jobs: Jobs,
}

impl Metrics {
    /// Creates the metrics. `dropped_lines` returns the number of log lines that were dropped.
    #[must_use]
    pub fn new(jobs: &Jobs, dropped_lines: fn() -> u64) -> Metrics {
        let mut registry = Registry::with_prefix("railhead");
        let requests = Family::default();
        let seconds: Family<RouteLabel, Histogram> =
            Family::new_with_constructor(|| Histogram::new(REQUEST_SECONDS));
        registry.register(
            "http_requests",
            "Requests answered, by method, route and status",
            Family::clone(&requests),
        );
        registry.register(
            "http_request_seconds",
            "Time from a request to the head of its response, including waits that the client requested",
            Family::clone(&seconds),
        );
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        let started_at = now.map_or(0, |since| i64::try_from(since.as_secs()).unwrap_or(0));
        registry.register_collector(Box::new(Process {
            dropped_lines,
            started_at,
        }));
        Metrics {
            requests,
            seconds,
            registry: Arc::new(registry),
            jobs: jobs.clone(),
        }
    }

    /// Appends all metrics as OpenMetrics text, those of jobs first.
    ///
    /// # Errors
    /// Writing the text fails.
    pub fn write(&self, text: &mut String) -> std::fmt::Result {
        encode_registry(text, self.jobs.metrics())?;
        encode(text, &self.registry)
    }
}

/// Layer around all routes that counts requests.
pub(crate) async fn count(
    State(metrics): State<Metrics>,
    request: Request,
    next: Next,
) -> Response {
    let matched = request.extensions().get::<MatchedPath>();
    let route = matched.map_or(UNMATCHED, MatchedPath::as_str).to_owned();
    let method = known(request.method());
    let start = Instant::now();
    let response = next.run(request).await;
    let route = if response.status() == axum::http::StatusCode::METHOD_NOT_ALLOWED {
        UNMATCHED.to_owned()
    } else {
        route
    };
    metrics
        .requests
        .get_or_create(&RequestLabel {
            method,
            route: route.clone(),
            status: response.status().as_u16(),
        })
        .inc();
    metrics
        .seconds
        .get_or_create(&RouteLabel { method, route })
        .observe(start.elapsed().as_secs_f64());
    response
}

/// Returns the label of a method; clients could invent any number of methods.
fn known(method: &Method) -> &'static str {
    match *method {
        Method::GET => "GET",
        Method::HEAD => "HEAD",
        Method::POST => "POST",
        Method::DELETE => "DELETE",
        Method::OPTIONS => "OPTIONS",
        _ => "other",
    }
}

/// Metrics of the process, read when they are scraped.
#[derive(Debug)]
struct Process {
    /// Returns the number of log lines that were dropped.
    dropped_lines: fn() -> u64,
    /// Start of the process in seconds since 1970.
    started_at: i64,
}

impl Collector for Process {
    fn encode(&self, mut encoder: DescriptorEncoder<'_>) -> Result<(), std::fmt::Error> {
        let dropped = ConstCounter::new((self.dropped_lines)());
        let about = "Log lines dropped because they were not read";
        let metric =
            encoder.encode_descriptor("log_lines_dropped", about, None, dropped.metric_type())?;
        dropped.encode(metric)?;
        let figures = [
            (
                "process_resident_memory_bytes",
                "Memory of the process in bytes",
                resident_bytes(),
            ),
            (
                "process_open_fds",
                "Files and connections that are open",
                open_files(),
            ),
            (
                "process_start_time_seconds",
                "Start of the process, seconds since 1970",
                Some(self.started_at),
            ),
        ];
        for (name, about, value) in figures {
            let Some(value) = value else { continue };
            let gauge = ConstGauge::new(value);
            let metric = encoder.encode_descriptor(name, about, None, gauge.metric_type())?;
            gauge.encode(metric)?;
        }
        Ok(())
    }
}

/// Returns the resident memory in bytes; `None` on systems without `/proc`.
fn resident_bytes() -> Option<i64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kilobytes: i64 = line.trim().trim_end_matches(" kB").parse().ok()?;
    Some(kilobytes * 1024)
}

fn open_files() -> Option<i64> {
    let files = std::fs::read_dir("/proc/self/fd").ok()?.count();
    i64::try_from(files).ok()
}
