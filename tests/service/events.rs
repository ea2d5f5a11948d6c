//! Tests server-sent events: every state is sent once, streams can be resumed, and streams end.

use std::time::Duration;

use futures_util::StreamExt;
use reqwest::Response;
use serde_json::{Value, json};
use tokio::time::timeout;

use crate::results::path_of;
use crate::server::{Server, Setup, example, link};
use crate::support::{Service, case, endless_case, tick_forever};

const AT_MOST: Duration = Duration::from_secs(60);

/// A server-sent event.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    pub name: String,
    pub id: String,
    pub data: Value,
}

/// A reader of the events of one response.
pub struct Reader {
    response: Response,
    text: String,
}

impl Reader {
    pub async fn open(server: &Server, path: &str, last: Option<&str>) -> Reader {
        let url = format!("http://{}{path}", server.address);
        Reader::get(&url, last).await
    }

    async fn get(url: &str, last: Option<&str>) -> Reader {
        let mut request = reqwest::Client::new().get(url);
        if let Some(last) = last {
            request = request.header("last-event-id", last);
        }
        let response = request.send().await.expect("an answer");
        Reader {
            response,
            text: String::new(),
        }
    }

    /// Returns the next event, or `None` at the end of the stream.
    pub async fn next(&mut self) -> Option<Event> {
        loop {
            if let Some((block, rest)) = self.text.split_once("\n\n") {
                let field = |name: &str| {
                    let mut lines = block.lines();
                    lines.find_map(|line| line.strip_prefix(name)?.strip_prefix(": "))
                };
                let event = field("data").map(|data| Event {
                    name: field("event").expect("a name").to_owned(),
                    id: field("id").expect("an id").to_owned(),
                    data: serde_json::from_str(data).expect("JSON"),
                });
                self.text = rest.to_owned();
                match event {
                    Some(event) => return Some(event),
                    None => continue,
                }
            }
            let piece = timeout(AT_MOST, self.response.chunk());
            let piece = piece.await.expect("an event in time").ok().flatten()?;
            self.text.push_str(&String::from_utf8_lossy(&piece));
        }
    }

    /// Reads events until one with this id satisfies a condition, and returns it.
    pub async fn until(&mut self, id: &Value, is: impl Fn(&Value) -> bool) -> Event {
        loop {
            let event = self.next().await.expect("an event");
            if event.data["id"] == *id && is(&event.data) {
                return event;
            }
        }
    }

    async fn all(mut self) -> Vec<Event> {
        let mut events = Vec::new();
        while let Some(event) = self.next().await {
            events.push(event);
        }
        events
    }
}

#[tokio::test]
async fn ended_job_has_one_event_and_then_none() {
    let server = Server::start().await;
    let path = format!(
        "{}/events",
        path_of(&server.solve(&example("spin.case.json")).await)
    );
    let reader = Reader::open(&server, &path, None).await;
    let kind = reader.response.headers()["content-type"]
        .to_str()
        .expect("a type")
        .to_owned();
    assert_eq!(kind, "text/event-stream");
    assert_eq!(reader.response.headers()["cache-control"], "no-cache");
    let events = reader.all().await;
    assert_eq!(events.len(), 1, "{events:?}");
    assert_eq!(events[0].data["state"], "succeeded");
    assert_eq!(events[0].data["version"].to_string(), events[0].id);
    let seen = Reader::open(&server, &path, Some(&events[0].id)).await;
    assert_eq!(seen.response.status(), 204, "an EventSource stops at 204");
    let older = Reader::open(&server, &path, Some("1")).await.all().await;
    assert_eq!(older, events);
}

#[tokio::test]
async fn states_come_in_order_and_the_stream_closes_after_the_last() {
    let server = Setup::new()
        .solving(|_, monitor| Err(tick_forever(monitor)))
        .start()
        .await;
    let path = server.submit(&case("to be cancelled")).await;
    let mut reader = Reader::open(&server, &format!("{path}/events"), None).await;
    let mut states = Vec::new();
    let mut versions = Vec::new();
    while let Some(event) = reader.next().await {
        assert_eq!(event.name, "state");
        versions.push(event.data["version"].as_u64().expect("a version"));
        let state = event.data["state"].as_str().expect("a state").to_owned();
        if state == "running" && !states.contains(&state) {
            server.cancel(&path).await;
        }
        states.push(state);
    }
    states.dedup();
    let expected = [
        vec!["queued", "running", "cancelled"],
        vec!["running", "cancelled"],
    ];
    assert!(
        expected.iter().any(|expected| states == *expected),
        "{states:?}"
    );
    assert!(versions.is_sorted_by(|a, b| a < b), "{versions:?}");
}

#[tokio::test]
async fn batch_is_followed_by_its_counts() {
    let server = Server::start().await;
    let cases = vec![example("spin.case.json"); 40];
    let batch = server.post("/v1/batches", &json!(cases)).await.json;
    let path = link(&batch, "events").to_owned();
    let events = Reader::open(&server, &path, None).await.all().await;
    let last = events.last().expect("an event");
    assert_eq!(
        (&last.data["ended"], &last.data["states"]["succeeded"]),
        (&json!(true), &json!(40))
    );
    let progress: Vec<f64> = events
        .iter()
        .map(|event| event.data["progress"].as_f64().expect("a number"))
        .collect();
    assert!(progress.is_sorted(), "{progress:?}");
    let seen = Reader::open(&server, &path, Some(&last.id)).await;
    assert_eq!(seen.response.status(), 204);
}

#[tokio::test]
async fn draining_closes_the_streams() {
    let server = Server::idle().await;
    let path = server.submit(&example("spin.case.json")).await;
    let batch = server
        .post("/v1/batches", &json!([example("spin.case.json")]))
        .await
        .json;
    let mut job = Reader::open(&server, &format!("{path}/events"), None).await;
    let batch = format!("{}/events", path_of(&batch));
    let mut batch = Reader::open(&server, &batch, None).await;
    assert_eq!(job.next().await.expect("the first").data["state"], "queued");
    assert_eq!(
        batch.next().await.expect("the first").data["states"]["queued"],
        1
    );
    server.jobs.drain();
    assert_eq!((job.next().await, batch.next().await), (None, None));
}

#[tokio::test]
async fn last_event_id_is_good_after_a_restart() {
    let (folder, service) = Service::fresh(&["--workers", "1"]);
    let id = service.submit(&endless_case("long")).await;
    let url = |service: &Service| format!("http://{}/v1/jobs/{id}/events", service.address());
    let mut reader = Reader::get(&url(&service), None).await;
    let mut seen = reader.next().await.expect("an event");
    while seen.data["state"] != "running" {
        seen = reader.next().await.expect("an event");
    }
    service.kill();
    assert_eq!(reader.next().await, None, "the connection is gone");
    let service = Service::start(folder.path(), &["--workers", "1"]);
    let mut reader = Reader::get(&url(&service), Some(&seen.id)).await;
    let next = reader.next().await.expect("a later event");
    let version = |event: &Event| event.data["version"].as_u64().expect("a version");
    assert!(version(&next) > version(&seen), "{next:?} after {seen:?}");
    service.cancel(&id).await;
    let mut last = next;
    while let Some(event) = reader.next().await {
        last = event;
    }
    assert_eq!(last.data["state"], "cancelled");
}

#[tokio::test]
async fn comments_keep_a_quiet_stream_alive() {
    let server = Server::idle().await;
    let path = server.submit(&example("spin.case.json")).await;
    let reader = Reader::open(&server, &format!("{path}/events"), None).await;
    // Only the first event is sent. The stream then stays open without further data.
    let mut pieces = reader.response.bytes_stream();
    let first = pieces.next().await.expect("a piece").expect("bytes");
    assert!(String::from_utf8_lossy(&first).contains("retry: 1000"));
    let quiet = tokio::time::timeout(Duration::from_millis(200), pieces.next()).await;
    assert!(quiet.is_err(), "{quiet:?}");
}
