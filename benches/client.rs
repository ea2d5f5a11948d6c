//! A client of the service with its own connection, and the refusals that it received.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use reqwest::{Method, RequestBuilder, Response};
use serde_json::Value;

/// Pause after a refusal.
const REFUSED: Duration = Duration::from_secs(1);

/// A client and its refusals: documented `429` and `503`, by status.
pub struct Client {
    client: reqwest::Client,
    url: String,
    /// Number of refusals by status.
    pub refused: BTreeMap<u16, usize>,
}

impl Client {
    /// Returns a client of the service at this address.
    pub fn new(url: &str) -> Client {
        let client = reqwest::Client::builder()
            .pool_max_idle_per_host(1)
            .tcp_nodelay(true)
            .build();
        Client {
            client: client.expect("a client"),
            url: url.to_owned(),
            refused: BTreeMap::new(),
        }
    }

    /// Sends a request that `shape` completes, again after each refusal. Its response must have one of the statuses.
    pub async fn send(
        &mut self,
        method: Method,
        path: &str,
        statuses: &[u16],
        shape: impl Fn(RequestBuilder) -> RequestBuilder,
    ) -> Response {
        loop {
            let request = self
                .client
                .request(method.clone(), format!("{}{path}", self.url));
            let answer = shape(request).send().await.expect("an answer");
            let status = answer.status().as_u16();
            if matches!(status, 429 | 503) {
                assert!(
                    answer.headers().contains_key("retry-after"),
                    "{status} without retry-after"
                );
                *self.refused.entry(status).or_default() += 1;
                tokio::time::sleep(REFUSED).await;
                continue;
            }
            assert!(
                statuses.contains(&status),
                "{method} {path}: {status} {}",
                answer.text().await.unwrap_or_default()
            );
            return answer;
        }
    }

    /// Returns the bytes of a response with status 200, and the seconds from the request to the last byte.
    pub async fn get(&mut self, path: &str) -> (Vec<u8>, f64) {
        let start = Instant::now();
        let answer = self
            .send(Method::GET, path, &[200], |request| request)
            .await;
        let bytes = answer.bytes().await.expect("a body").to_vec();
        (bytes, start.elapsed().as_secs_f64())
    }

    /// Returns the JSON response to a GET request.
    pub async fn json(&mut self, path: &str) -> Value {
        let (bytes, _) = self.get(path).await;
        serde_json::from_slice(&bytes).expect("JSON")
    }

    /// Sends JSON and returns the JSON response, which must have one of the statuses.
    pub async fn post(&mut self, path: &str, statuses: &[u16], body: &Value) -> Value {
        let answer = self.send(Method::POST, path, statuses, |request| request.json(body));
        answer.await.json().await.expect("JSON")
    }

    /// Waits for the results of a batch, whose cases must all have succeeded.
    pub async fn batch_results(&mut self, batch: &Value, cases: usize) {
        let path = batch["links"]["results"].as_str().expect("a link");
        let (text, _) = self.get(&format!("{path}?wait=600")).await;
        let text = String::from_utf8(text).expect("text");
        let succeeded = |line: &&str| line.contains("\"state\":\"succeeded\"");
        let succeeded = text.lines().filter(succeeded).count();
        assert_eq!((text.lines().count(), succeeded), (cases, cases));
    }

    /// Submits a case and returns the representation of its job.
    pub async fn submit(&mut self, case: &Value, prefer: Option<&str>) -> Value {
        let answer = self.send(Method::POST, "/v1/jobs", &[202, 200], |request| {
            let request = request.json(case);
            match prefer {
                Some(prefer) => request.header("prefer", prefer),
                None => request,
            }
        });
        answer.await.json().await.expect("JSON")
    }

    /// Returns a figure of `/metrics`, or 0 if it is absent.
    pub async fn metric(&mut self, name: &str) -> f64 {
        let (text, _) = self.get("/metrics").await;
        let text = String::from_utf8_lossy(&text).into_owned();
        let value = text
            .lines()
            .find_map(|line| line.strip_prefix(name)?.trim().parse().ok());
        value.unwrap_or(0.0)
    }
}

/// Returns the id of a job.
pub fn id_of(job: &Value) -> String {
    job["id"].as_str().expect("an id").to_owned()
}
