//! The real program on a separate data folder, with keys of two tenants.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use reqwest::{Method, RequestBuilder};
use serde_json::Value;

/// Maximum time until the program listens.
const STARTS_WITHIN: Duration = Duration::from_secs(20);
/// Unit in which Linux gives process times.
const TICKS_PER_SECOND: f64 = 100.0;

/// A running service, which is killed on drop.
pub struct Service {
    child: Child,
    /// Address and port on which it listens.
    pub address: String,
    /// Its data folder.
    pub data: PathBuf,
    /// Key of the attacking tenant.
    pub attacker: String,
    /// Key of the tenant that must not be affected.
    pub other: String,
    client: reqwest::Client,
    _folder: tempfile::TempDir,
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
        let folder = tempfile::tempdir().expect("a folder");
        let data = folder.path().join("data");
        Service::start_on(folder, data, flags)
    }

    /// Starts `railhead serve` on an existing data folder.
    pub fn start_on(folder: tempfile::TempDir, data: PathBuf, flags: &[&str]) -> Service {
        let log = folder.path().join("log");
        let child = program()
            .args(["serve", "--listen", "127.0.0.1:0", "--log-format", "json"])
            .args(["--workers", "1", "--data-dir"])
            .arg(&data)
            .args(flags)
            .stderr(Stdio::from(File::create(&log).expect("a log")))
            .spawn()
            .expect("a service");
        let address = listening(&log);
        let [attacker, other] = ["attacker", "other"].map(|tenant| make_key(&data, tenant));
        Service {
            child,
            address,
            data,
            attacker,
            other,
            client: reqwest::Client::new(),
            _folder: folder,
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
        let url = format!("http://{}{path}", self.address);
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

    /// Submits a case and returns the id of its job.
    pub async fn submit(&self, key: &str, case: &Value) -> String {
        let answer = self
            .post(key, "/v1/jobs", "application/json", case.to_string())
            .await;
        assert_eq!(answer.status, 202, "{}", answer.text);
        answer.json()["id"].as_str().expect("an id").to_owned()
    }

    /// Submits a body that must be accepted, and returns the path of the created resource.
    pub async fn make(&self, path: &str, media_type: &str, body: String) -> String {
        let answer = self.post(&self.attacker, path, media_type, body).await;
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
        let revoked = program()
            .args(["keys", "revoke", id, "--data-dir"])
            .arg(&self.data)
            .output();
        assert!(revoked.expect("the program").status.success());
    }

    /// Returns the processor time of the process so far in s.
    pub fn processor_s(&self) -> f64 {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.child.id()));
        let stat = stat.expect("the process lives");
        // Fields 14 and 15. The second field, a name, may contain spaces and ends with a parenthesis.
        let ticks = stat.rsplit(')').next().expect("its fields").split(' ');
        let ticks = ticks.skip(12).take(2).map(str::parse::<f64>);
        ticks.sum::<Result<f64, _>>().expect("ticks") / TICKS_PER_SECOND
    }
}

impl Answer {
    /// Returns the body as JSON.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.text).unwrap_or(Value::Null)
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns the real program without `RAILHEAD_` variables of the environment.
fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_railhead"));
    for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("RAILHEAD_")) {
        command.env_remove(name);
    }
    command
}

/// Creates a key for a tenant while the service runs.
pub fn make_key(data: &Path, tenant: &str) -> String {
    let made = program()
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

/// Returns the address in the log event `listening`.
fn listening(log: &Path) -> String {
    let start = Instant::now();
    while start.elapsed() < STARTS_WITHIN {
        let text = std::fs::read_to_string(log).expect("the log");
        let events = text
            .lines()
            .filter_map(|line| serde_json::from_str::<Value>(line).ok());
        for event in events {
            if event["message"] == "listening" {
                return event["address"].as_str().expect("an address").to_owned();
            }
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!(
        "the service does not listen: {}",
        std::fs::read_to_string(log).unwrap_or_default()
    );
}
