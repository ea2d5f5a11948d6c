//! The real program on a separate data folder, with keys of two tenants.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use reqwest::{Method, RequestBuilder};
use serde_json::Value;
use tempfile::TempDir;

use crate::process::{self, railhead};

/// A running service with two tenants.
pub struct Service {
    pub process: process::Service,
    /// Key of the attacking tenant.
    pub attacker: String,
    /// Key of the tenant that must not be affected.
    pub other: String,
    client: reqwest::Client,
}

/// A response with its time in s.
#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    pub text: String,
    pub seconds: f64,
}

impl Service {
    /// Starts `railhead serve` with one worker and returns when it listens.
    pub fn start(flags: &[&str]) -> Service {
        Service::with_keys(process::Service::start(1, flags))
    }

    /// Starts `railhead serve` with one worker on a data folder.
    pub fn start_on(folder: TempDir, data: PathBuf, flags: &[&str]) -> Service {
        let place = (folder, data);
        Service::with_keys(process::Service::start_on(railhead(), place, 1, flags))
    }

    fn with_keys(process: process::Service) -> Service {
        let [attacker, other] = ["attacker", "other"].map(|tenant| make_key(&process.data, tenant));
        Service {
            process,
            attacker,
            other,
            client: reqwest::Client::new(),
        }
    }

    /// Sends a request with a key, completed by `shape`.
    pub async fn send(
        &self,
        key: &str,
        method: Method,
        path: &str,
        shape: impl FnOnce(RequestBuilder) -> RequestBuilder,
    ) -> Answer {
        let start = Instant::now();
        let url = format!("{}{path}", self.process.url);
        let request = self.client.request(method, url).bearer_auth(key);
        let answer = shape(request).send().await.expect("an answer");
        let status = answer.status().as_u16();
        let text = answer.text().await.expect("a body");
        let seconds = start.elapsed().as_secs_f64();
        Answer {
            status,
            text,
            seconds,
        }
    }

    /// Sends a GET request with a key.
    pub async fn get(&self, key: &str, path: &str) -> Answer {
        self.send(key, Method::GET, path, |request| request).await
    }

    /// Sends a body of this type with a key.
    pub async fn post(
        &self,
        key: &str,
        path: &str,
        media_type: &str,
        body: impl Into<reqwest::Body>,
    ) -> Answer {
        self.send(key, Method::POST, path, |request| {
            request.header("content-type", media_type).body(body)
        })
        .await
    }

    /// Submits a case, waits until it is solved, and returns the id of its job.
    pub async fn solved(&self, key: &str, case: &Value) -> String {
        let path = self.make_as(key, "/v1/jobs", "application/json", case.to_string());
        let path = path.await;
        self.ended(key, &path).await;
        path.rsplit('/').next().expect("an id").to_owned()
    }

    /// Submits a body as the attacker. It must be accepted. Returns the path of the created resource.
    pub async fn make(&self, path: &str, media_type: &str, body: String) -> String {
        self.make_as(&self.attacker, path, media_type, body).await
    }

    async fn make_as(&self, key: &str, path: &str, media_type: &str, body: String) -> String {
        let answer = self.post(key, path, media_type, body).await;
        assert_eq!(answer.status, 202, "{}", answer.text);
        let id = answer.json()["id"].as_str().expect("an id").to_owned();
        format!("{}/{id}", path.split('?').next().unwrap_or(path))
    }

    /// Waits until a job, a batch or a run has ended, and returns its last representation.
    pub async fn ended(&self, key: &str, path: &str) -> Value {
        loop {
            let answer = self.get(key, path).await;
            assert_eq!(answer.status, 200, "{}", answer.text);
            let about = answer.json();
            if about["ended_at"].is_string() {
                return about;
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    }

    /// Revokes a key while the service runs.
    pub fn revoke(&self, key: &str) {
        let id = key.split('_').nth(1).expect("an id");
        let revoked = railhead()
            .args(["keys", "revoke", id, "--data-dir"])
            .arg(&self.process.data)
            .output();
        assert!(revoked.expect("the program").status.success());
    }

    /// Returns the processor time of the process so far in s.
    pub fn processor_s(&self) -> f64 {
        self.process.usage().processor_s
    }
}

impl Answer {
    /// Returns the body as JSON.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.text).unwrap_or(Value::Null)
    }
}

/// Creates a key for a tenant while the service runs.
pub fn make_key(data: &Path, tenant: &str) -> String {
    let made = railhead()
        .args(["keys", "create", "--tenant", tenant, "--data-dir"])
        .arg(data)
        .output();
    let made = made.expect("the program");
    assert!(
        made.status.success(),
        "{}",
        String::from_utf8_lossy(&made.stderr)
    );
    String::from_utf8(made.stdout)
        .expect("a key")
        .trim()
        .to_owned()
}
