//! The real program as a service, and common cases and helpers.

use std::io::{BufRead, BufReader, Read};
use std::net::SocketAddr;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::time::Duration;

use railhead::contact::error::SolveError;
use railhead::contact::monitor::Monitor;
use railhead::jobs::clock::Clock;
use reqwest::header::{AUTHORIZATION, HeaderMap};
use reqwest::{Method, RequestBuilder};
use serde_json::{Value, json};
use tempfile::TempDir;

pub const DAY_MS: i64 = 24 * 3600 * 1000;

/// Returns a case of the handbook: a new wheel on the crown of a rail.
pub fn case(name: &str) -> Value {
    json!({
        "name": name,
        "labels": { "line": "A12" },
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 100_000 },
        "motion": { "creepage_x": 0.001, "creepage_y": 0.0, "spin_per_mm": 0.0004 },
        "solver": { "method": "boundary_element", "mesh": { "strips": 6, "cells": 6 } },
        "outputs": ["resultants", "zones", "tractions"]
    })
}

/// Returns a small case with this normal force. Cases with different forces have different digests.
pub fn loaded(newtons: usize) -> Value {
    let mut case = case("one of many");
    case["load"]["normal_force_n"] = json!(newtons);
    case
}

/// A response. `json` is null if the body is not JSON.
#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    pub headers: HeaderMap,
    pub bytes: Vec<u8>,
    /// The body as text. Bytes that are not UTF-8 are replaced.
    pub text: String,
    pub json: Value,
}

impl Answer {
    /// Sends a request and reads the whole response.
    pub async fn to(request: RequestBuilder) -> Answer {
        let response = request.send().await.expect("an answer");
        let (status, headers) = (response.status().as_u16(), response.headers().clone());
        let bytes = response.bytes().await.expect("a body").to_vec();
        Answer {
            status,
            json: serde_json::from_slice(&unpacked(&headers, &bytes)).unwrap_or(Value::Null),
            headers,
            text: String::from_utf8_lossy(&bytes).into_owned(),
            bytes,
        }
    }

    /// Returns the response after asserting its status.
    #[track_caller]
    pub fn is(self, status: u16) -> Answer {
        assert_eq!(self.status, status, "{}", self.text);
        self
    }

    /// Returns the path of the accepted work.
    pub fn location(&self) -> String {
        self.header("location").expect("a location").to_owned()
    }

    /// Returns the lines of the body as JSON.
    pub fn lines(&self) -> Vec<Value> {
        let lines = self.text.lines();
        lines.map(|line| line.parse().expect("JSON")).collect()
    }

    pub fn header(&self, name: &str) -> Option<&str> {
        self.headers.get(name).and_then(|value| value.to_str().ok())
    }
}

/// Returns a body without its content encoding.
pub fn unpacked(headers: &HeaderMap, bytes: &[u8]) -> Vec<u8> {
    let coding = headers.get("content-encoding");
    match coding.map(|coding| coding.to_str().expect("a coding")) {
        Some("zstd") => zstd::decode_all(bytes).expect("zstd"),
        Some("gzip") => {
            let mut out = Vec::new();
            let mut reader = flate2::read::GzDecoder::new(bytes);
            reader.read_to_end(&mut out).expect("gzip");
            out
        }
        Some(other) => panic!("{other} was not asked for"),
        None => bytes.to_vec(),
    }
}

/// The real program, serving on a free port. It is killed when dropped.
pub struct Service {
    child: Child,
    address: SocketAddr,
    log: Arc<Mutex<Vec<Value>>>,
    client: reqwest::Client,
    /// A data folder that is removed together with the service.
    _folder: Option<TempDir>,
}

impl Service {
    /// Starts `railhead serve` on a data folder and returns when it listens.
    pub fn start(data_dir: &Path, flags: &[&str]) -> Service {
        let mut program = railhead();
        Service::spawn(&mut program, "serve", (data_dir, None), flags)
    }

    /// Starts `railhead serve` on a new data folder.
    pub fn fresh(flags: &[&str]) -> (TempDir, Service) {
        let folder = tempfile::tempdir().unwrap();
        let service = Service::start(folder.path(), flags);
        (folder, service)
    }

    /// Starts a prepared `serve` or `worker` process with a data folder that is removed with it.
    #[cfg(feature = "cluster")]
    pub fn alone(program: &mut Command, role: &str, flags: &[&str]) -> Service {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().to_owned();
        Service::spawn(program, role, (&path, Some(folder)), flags)
    }

    /// Starts a prepared `serve` or `worker` process on a data folder.
    pub fn start_as(program: &mut Command, role: &str, data_dir: &Path, flags: &[&str]) -> Service {
        Service::spawn(program, role, (data_dir, None), flags)
    }

    fn spawn(
        program: &mut Command,
        role: &str,
        (data_dir, folder): (&Path, Option<TempDir>),
        flags: &[&str],
    ) -> Service {
        let mut child = program
            .args([role, "--log-format", "json"])
            .env("RAILHEAD_LISTEN", "127.0.0.1:0")
            .arg("--data-dir")
            .arg(data_dir)
            .args(flags)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let log = Arc::new(Mutex::new(Vec::new()));
        let (listening, address) = mpsc::channel();
        std::thread::spawn({
            let log = log.clone();
            move || {
                for line in lines.map_while(Result::ok) {
                    let event: Value =
                        serde_json::from_str(&line).unwrap_or_else(|_| json!({ "message": line }));
                    if event["message"] == "listening" {
                        let address = event["address"].as_str().unwrap().parse().unwrap();
                        let _ = listening.send(address);
                    }
                    log.lock().unwrap().push(event);
                }
            }
        });
        let address = address
            .recv_timeout(Duration::from_secs(60))
            .unwrap_or_else(|_| panic!("no `listening` in {:?}", log.lock().unwrap()));
        Service {
            child,
            address,
            log,
            client: reqwest::Client::new(),
            _folder: folder,
        }
    }

    /// Sends this API key with every request.
    #[must_use]
    pub fn with_key(mut self, key: &str) -> Service {
        let bearer = format!("Bearer {key}").parse().unwrap();
        let headers = HeaderMap::from_iter([(AUTHORIZATION, bearer)]);
        let client = reqwest::Client::builder().default_headers(headers);
        self.client = client.build().unwrap();
        self
    }

    /// Returns the address on which the service listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns the id of the process.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Returns a request to this service.
    pub fn request(&self, method: Method, path: &str) -> RequestBuilder {
        let url = format!("http://{}{path}", self.address);
        self.client.request(method, url)
    }

    /// Returns the JSON answer to a GET that must succeed.
    pub async fn get(&self, path: &str) -> Value {
        self.ask(path).await.is(200).json
    }

    /// Returns the answer to a GET.
    pub async fn ask(&self, path: &str) -> Answer {
        Answer::to(self.request(Method::GET, path)).await
    }

    /// Posts JSON and returns the answer.
    pub async fn post(&self, path: &str, body: &Value) -> Answer {
        Answer::to(self.request(Method::POST, path).json(body)).await
    }

    /// Cancels a job.
    pub async fn cancel(&self, id: &str) {
        let path = format!("/v1/jobs/{id}/cancel");
        let answer = Answer::to(self.request(Method::POST, &path)).await;
        assert!([200, 202].contains(&answer.status), "{}", answer.text);
    }

    /// Submits a case and returns the id of its job.
    pub async fn submit(&self, case: &Value) -> String {
        let job = self.post("/v1/jobs", case).await.is(202).json;
        job["id"].as_str().unwrap().to_owned()
    }

    /// Waits until a job is in a state, and returns it. Panics if it ends in another state.
    pub async fn until(&self, id: &str, state: &str) -> Value {
        let path = waiting(&format!("/v1/jobs/{id}"), state);
        loop {
            let job = self.get(&path).await;
            if job["state"] == state {
                return job;
            }
            let going_on = job["state"] == "queued" || job["state"] == "running";
            assert!(going_on, "{state} was expected: {job}");
            pause().await;
        }
    }

    /// Returns the number of log events with this message.
    pub fn logged(&self, message: &str) -> usize {
        let log = self.log.lock().unwrap();
        log.iter()
            .filter(|event| event["message"] == message)
            .count()
    }

    /// Waits until this number of log events have this message.
    pub async fn until_logged(&self, message: &str, count: usize) {
        while self.logged(message) < count {
            pause().await;
        }
    }

    /// Waits until the service is ready.
    pub async fn until_ready(&self) {
        while self.ask("/readyz").await.status != 200 {
            pause().await;
        }
    }

    /// Returns all log events so far as lines of JSON.
    pub fn log_text(&self) -> String {
        let log = self.log.lock().unwrap();
        log.iter().map(|event| format!("{event}\n")).collect()
    }

    /// Kills the process with SIGKILL.
    pub fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Sends a signal by name.
    pub fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        assert!(
            Command::new("kill")
                .args(["-s", name, &id])
                .status()
                .unwrap()
                .success()
        );
    }

    /// Shuts the service down and asserts that it succeeds.
    pub async fn stop(self) {
        self.signal("TERM");
        let status = tokio::task::spawn_blocking(|| self.wait());
        assert!(status.await.unwrap().success());
    }

    /// Waits until the process has ended by itself.
    pub fn wait(mut self) -> ExitStatus {
        self.child.wait().unwrap()
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        // The process may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A clock that a test sets.
#[derive(Clone, Default)]
pub struct Turned(Arc<AtomicI64>);

impl Turned {
    pub fn clock(&self) -> Clock {
        let (ahead, system) = (self.0.clone(), Clock::system());
        Clock::new(move || system.now_ms() + ahead.load(Ordering::SeqCst))
    }

    /// Sets how many milliseconds the clock is ahead of the system clock.
    pub fn set(&self, ahead_ms: i64) {
        self.0.store(ahead_ms, Ordering::SeqCst);
    }

    pub fn turn(&self, days: i64) {
        self.0.fetch_add(days * DAY_MS, Ordering::SeqCst);
    }
}

/// Ticks until the monitor requests a stop.
pub fn tick_forever(monitor: &dyn Monitor) -> SolveError {
    loop {
        if let ControlFlow::Break(stop) = monitor.tick(0.5) {
            return stop.into();
        }
        std::thread::yield_now();
    }
}

/// Reports why a test is skipped. Panics if the variable `CI` is set.
pub fn skip(reason: &str) {
    assert!(std::env::var_os("CI").is_none(), "not run: {reason}");
    eprintln!("SKIPPED: {reason}");
}

/// Returns the files below a folder, which need not exist.
pub fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let paths = entries.map(|entry| entry.unwrap().path());
    let files = paths.flat_map(|path| match path.is_dir() {
        true => files_below(&path),
        false => vec![path],
    });
    files.collect()
}

/// Returns the path of a piece of work, with a wait for its end if this state is a final one.
pub fn waiting(path: &str, state: &str) -> String {
    match ["queued", "running"].contains(&state) {
        true => path.to_owned(),
        false => format!("{path}?wait=60"),
    }
}

/// Waits between two requests of a polling loop.
pub async fn pause() {
    tokio::time::sleep(Duration::from_millis(5)).await;
}

/// Returns the real program without the variables `RAILHEAD_…` of the environment.
pub fn railhead() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_railhead"));
    for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("RAILHEAD_")) {
        command.env_remove(name);
    }
    command
}

/// Returns a case that keeps a worker busy for a good part of a second: several motions on a fine mesh.
pub fn long_case(name: &str, motions: u32) -> Value {
    let mut case = case(name);
    case["motion"] = json!({ "sweep": {
        "creepage_x": { "from": 0.0002, "to": 0.0008, "points": motions },
        "spin_per_mm": { "from": 0.0001, "to": 0.0003, "points": motions }
    } });
    case["solver"] = json!({ "method": "boundary_element", "mesh": { "strips": 16, "cells": 16 } });
    case["outputs"] = json!(["resultants", "zones"]);
    case
}

/// Returns a case whose result is stored outside the job table.
pub fn large_case(name: &str, motions: u32) -> Value {
    let mut case = long_case(name, motions);
    case["outputs"] = json!(["resultants", "tractions"]);
    case
}

/// Returns a case that never ends during a test: the maximal number of motions on a fine mesh.
pub fn endless_case(name: &str) -> Value {
    let mut case = long_case(name, 10_000);
    case["solver"]["mesh"] = json!({ "strips": 32, "cells": 32 });
    case
}
