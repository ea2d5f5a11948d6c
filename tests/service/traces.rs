//! Tests traces: each job has one trace, from its submission to its stored result, also across processes.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};

use axum::Router;
use axum::body::Bytes;
use axum::extract::State;
use axum::routing::post;
use opentelemetry_proto::tonic::collector::trace::v1::ExportTraceServiceRequest;
use opentelemetry_proto::tonic::trace::v1::Span;
use opentelemetry_proto::tonic::trace::v1::status::StatusCode;
use prost::Message;
use reqwest::Method;
use serde_json::{Value, json};

use crate::server::link;
use crate::support::{Answer, Service, case, endless_case, loaded};

/// A collector of spans by OTLP over HTTP.
struct Collector {
    address: SocketAddr,
    spans: Arc<Mutex<Vec<Span>>>,
}

impl Collector {
    async fn start() -> Collector {
        async fn collect(State(spans): State<Arc<Mutex<Vec<Span>>>>, body: Bytes) {
            let export = ExportTraceServiceRequest::decode(body).expect("OTLP");
            for resource in export.resource_spans {
                let scopes = resource.scope_spans.into_iter();
                let new = scopes.flat_map(|scope| scope.spans);
                spans.lock().unwrap().extend(new);
            }
        }
        let spans = Arc::new(Mutex::new(Vec::new()));
        let router = Router::new()
            .route("/v1/traces", post(collect))
            .with_state(spans.clone());
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        tokio::spawn(async move { axum::serve(listener, router).await });
        Collector { address, spans }
    }

    fn endpoint(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Returns the spans of a trace: first those of requests, then those of a job in the order of its life. (`queue` begins at the creation time of
    /// the job in whole milliseconds, which may precede the request.)
    fn trace(&self, id: &str) -> Vec<Span> {
        let spans = self.spans.lock().unwrap();
        let mut found: Vec<Span> = spans
            .iter()
            .filter(|span| hex(&span.trace_id) == id)
            .cloned()
            .collect();
        let life = ["submit", "queue", "solve", "store"];
        found.sort_by_key(|span| life.iter().position(|name| *name == span.name));
        found
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn names(spans: &[Span]) -> Vec<&str> {
    spans.iter().map(|span| span.name.as_str()).collect()
}

/// Returns the value of an attribute as text.
fn told(span: &Span, key: &str) -> String {
    use opentelemetry_proto::tonic::common::v1::any_value::Value as Told;
    let attribute = span.attributes.iter().find(|pair| pair.key == key);
    let value = attribute.and_then(|pair| pair.value.as_ref()?.value.clone());
    match value {
        Some(Told::StringValue(text)) => text,
        Some(Told::IntValue(number)) => number.to_string(),
        Some(Told::BoolValue(truth)) => truth.to_string(),
        other => panic!("{key} of {}: {other:?}", span.name),
    }
}

/// Sends a body inside a trace. The flags tell whether the trace is sampled.
async fn send(service: &Service, path: &str, body: &Value, trace: &str, flags: &str) -> Value {
    let request = service.request(Method::POST, path).json(body);
    let parent = format!("00-{trace}-00f067aa0ba902b7-{flags}");
    let request = request.header("traceparent", parent);
    Answer::to(request).await.json
}

const TRACE: &str = "4bf92f3577b34da6a3ce929d0e0e4736";
const OTHER: &str = "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa";

#[tokio::test]
async fn a_job_is_one_trace_from_its_submission_to_its_stored_result() {
    let collector = Collector::start().await;
    let (_folder, service) = Service::fresh(&["--otlp-endpoint", &collector.endpoint()]);
    let job = send(&service, "/v1/jobs?wait=60", &case("traced"), TRACE, "01").await;
    assert_eq!(job["state"], "succeeded");
    send(&service, "/v1/jobs?wait=60", &loaded(90_000), OTHER, "00").await;
    assert!(
        service.log_text().contains(TRACE),
        "the log names the trace"
    );
    service.stop().await;

    let spans = collector.trace(TRACE);
    let request = "POST /v1/jobs";
    assert_eq!(
        names(&spans),
        [request, "submit", "queue", "solve", "store"]
    );
    let parent = |place: usize| hex(&spans[place].parent_span_id);
    assert_eq!(parent(0), "00f067aa0ba902b7", "the client's span");
    assert_eq!(parent(1), hex(&spans[0].span_id));
    for span in &spans[2..] {
        assert_eq!(span.parent_span_id, spans[1].span_id, "{}", span.name);
        assert_eq!(told(span, "railhead.job.attempt"), "1");
    }
    for span in &spans[1..] {
        assert_eq!(told(span, "railhead.job.id"), job["id"].as_str().unwrap());
        assert!(span.start_time_unix_nano <= span.end_time_unix_nano);
    }
    let [queue, solve, store] = &spans[2..] else {
        unreachable!("five spans were counted")
    };
    assert!(queue.end_time_unix_nano <= solve.start_time_unix_nano);
    assert!(solve.end_time_unix_nano <= store.start_time_unix_nano);
    assert_eq!(told(solve, "railhead.method"), "boundary_element");
    assert_eq!(told(store, "railhead.job.state"), "succeeded");
    assert_eq!(told(&spans[0], "http.response.status_code"), "200");
    assert_eq!(
        collector.trace(OTHER),
        [],
        "the client did not want this trace"
    );
}

#[tokio::test]
async fn cases_of_a_batch_belong_to_its_trace() {
    let collector = Collector::start().await;
    let (_folder, service) = Service::fresh(&["--otlp-endpoint", &collector.endpoint()]);
    let mut unsolvable = case("runs out of time");
    unsolvable["solver"]["time_limit_s"] = json!(1e-9);
    let cases = json!([case("first"), unsolvable]);
    let batch = send(&service, "/v1/batches", &cases, TRACE, "01").await;
    let results = link(&batch, "results");
    let results = service.ask(&format!("{results}?wait=60")).await.text;
    assert_eq!(results.lines().count(), 2, "{results}");
    service.stop().await;

    let spans = collector.trace(TRACE);
    for (name, count) in [("submit", 1), ("queue", 2), ("solve", 2), ("store", 2)] {
        let found = spans.iter().filter(|span| span.name == name);
        assert_eq!(found.count(), count, "{name}: {:?}", names(&spans));
    }
    let states = spans.iter().filter(|span| span.name == "store");
    let mut states: Vec<_> = states
        .map(|span| told(span, "railhead.job.state"))
        .collect();
    states.sort();
    assert_eq!(states, ["failed", "succeeded"]);
    let failed = spans.iter().filter(|span| {
        let status = span
            .status
            .as_ref()
            .map(opentelemetry_proto::tonic::trace::v1::Status::code);
        span.name == "solve" && status == Some(StatusCode::Error)
    });
    assert_eq!(failed.count(), 1);
}

#[tokio::test]
async fn a_trace_goes_on_in_the_process_that_solves_the_job() {
    let collector = Collector::start().await;
    let folder = tempfile::tempdir().unwrap();
    let collected = ["--workers", "1", "--otlp-endpoint", &collector.endpoint()];
    let submit = async |service: &Service, case: &Value, trace: &str| {
        let job = send(service, "/v1/jobs", case, trace, "01").await;
        job["id"].as_str().unwrap().to_owned()
    };
    let service = Service::start(folder.path(), &["--workers", "1"]);
    let ahead = service
        .submit(&endless_case("in front of the others"))
        .await;
    let untraced = submit(&service, &case("while nobody collected"), OTHER).await;
    service.kill();
    let service = Service::start(folder.path(), &collected);
    let traced = submit(&service, &loaded(90_000), TRACE).await;
    service.kill();

    let service = Service::start(folder.path(), &collected);
    service.cancel(&ahead).await;
    service.until(&untraced, "succeeded").await;
    service.until(&traced, "succeeded").await;
    service.stop().await;
    // The spans of the killed process are lost.
    let spans = collector.trace(TRACE);
    let last = &spans[spans.len().saturating_sub(3)..];
    assert_eq!(names(last), ["queue", "solve", "store"]);
    assert!(
        last.iter()
            .all(|span| told(span, "railhead.job.id") == traced)
    );
    assert_eq!(
        collector.trace(OTHER),
        [],
        "nobody collected when it was submitted"
    );
}

#[tokio::test]
async fn a_collector_that_is_not_there_holds_up_nothing() {
    let folder = tempfile::tempdir().unwrap();
    // Port 9 is closed, or discards what it receives without an answer.
    let service = Service::start(folder.path(), &["--otlp-endpoint", "http://127.0.0.1:9"]);
    let job = send(
        &service,
        "/v1/jobs?wait=60",
        &case("traced in vain"),
        TRACE,
        "01",
    )
    .await;
    assert_eq!(job["state"], "succeeded");
    service.stop().await;
}
