//! A service in this process, on a port of its own with a data folder of its own, and a client for it.

use std::io::Read;
use std::net::SocketAddr;
use std::path::Path;

use railhead::contact::error::SolveError;
use railhead::contact::monitor::Monitor;
use railhead::contact::problem::checked_case::CheckedCase;
use railhead::contact::solution::words::answer::{Fields, Solution};
use railhead::http::{HttpOptions, router};
use railhead::jobs::engine::Engine;
use railhead::jobs::{Jobs, Options};
use reqwest::header::HeaderMap;
use reqwest::{Method, RequestBuilder};
use serde_json::Value;
use tempfile::TempDir;
use tokio_util::sync::CancellationToken;

use crate::schema::assert_documented;

/// A running service. It ends with the test's runtime.
pub struct Server {
    pub jobs: Jobs,
    pub address: SocketAddr,
    client: reqwest::Client,
    _folder: TempDir,
}

/// What to start.
pub struct Setup {
    pub options: Options,
    pub http: HttpOptions,
    pub recipe: Engine,
    /// Without workers every job stays queued.
    pub working: bool,
    folder: TempDir,
}

/// An answer. `json` is null where the body is not JSON.
#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    pub headers: HeaderMap,
    pub bytes: Vec<u8>,
    /// The body as text; what is not UTF-8 is replaced.
    pub text: String,
    pub json: Value,
}

impl Setup {
    /// The defaults: real physics, one worker.
    pub fn new() -> Setup {
        let folder = tempfile::tempdir().expect("a temporary folder");
        Setup {
            options: Options::new(folder.path()),
            http: HttpOptions::default(),
            recipe: Engine::contact(),
            working: true,
            folder,
        }
    }

    /// Replaces the solver, for failures that the real one cannot be made to have.
    pub fn solving(
        mut self,
        solve: impl Fn(&CheckedCase, &dyn Monitor) -> Result<(Solution, Fields), SolveError>
        + Send
        + Sync
        + 'static,
    ) -> Setup {
        self.recipe = self.recipe.solving(solve);
        self
    }

    pub async fn start(self) -> Server {
        let jobs = Jobs::open_with(self.options, self.recipe)
            .await
            .expect("the data folder opens");
        if self.working {
            jobs.start().expect("workers start");
        }
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0")
            .await
            .expect("a free port");
        let address = listener.local_addr().expect("an address");
        let service = router(jobs.clone(), self.http.clone());
        let never = CancellationToken::new();
        tokio::spawn(railhead::http::serve(listener, service, self.http, never));
        Server {
            jobs,
            address,
            client: reqwest::Client::builder()
                .redirect(reqwest::redirect::Policy::none())
                .build()
                .expect("a client"),
            _folder: self.folder,
        }
    }
}

impl Server {
    /// A service with real physics and one worker.
    pub async fn start() -> Server {
        Setup::new().start().await
    }

    /// Services like [`Server::start`]: one on the embedded store and, where there is PostgreSQL, one on a database.
    pub async fn on_every_store() -> Vec<Server> {
        let embedded = Server::start().await;
        #[cfg(feature = "cluster")]
        if let Some(url) = crate::cluster::postgres::schema().await {
            let mut setup = Setup::new();
            setup.options.database = Some(railhead::jobs::options::Database {
                url,
                connections: 4,
                notify_mode: railhead::jobs::options::NotifyMode::Database,
            });
            return vec![embedded, setup.start().await];
        }
        vec![embedded]
    }

    /// A service that takes jobs and never solves them.
    pub async fn idle() -> Server {
        let mut setup = Setup::new();
        setup.working = false;
        setup.start().await
    }

    /// Sends a request as `shape` completes it, and checks the answer against the contract.
    pub async fn send(
        &self,
        method: Method,
        path: &str,
        shape: impl FnOnce(RequestBuilder) -> RequestBuilder,
    ) -> Answer {
        let request = self
            .client
            .request(method.clone(), format!("http://{}{path}", self.address));
        let response = shape(request).send().await.expect("an answer");
        let status = response.status().as_u16();
        let headers = response.headers().clone();
        let bytes = response.bytes().await.expect("a body").to_vec();
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let answer = Answer {
            status,
            json: serde_json::from_slice(&unpacked(&headers, &bytes)).unwrap_or(Value::Null),
            headers,
            bytes,
            text,
        };
        assert_documented(
            method.as_str(),
            path,
            status,
            answer.header("content-type"),
            &answer.json,
        );
        answer
    }

    pub async fn get(&self, path: &str) -> Answer {
        self.send(Method::GET, path, |request| request).await
    }

    pub async fn delete(&self, path: &str) -> Answer {
        self.send(Method::DELETE, path, |request| request).await
    }

    pub async fn post(&self, path: &str, body: &Value) -> Answer {
        self.send(Method::POST, path, |request| request.json(body))
            .await
    }

    /// Submits a case without waiting; answers the path of the job.
    pub async fn submit(&self, case: &Value) -> String {
        let answer = self.post("/v1/jobs", case).await;
        assert_eq!(answer.status, 202, "{}", answer.text);
        answer.header("location").expect("a location").to_owned()
    }

    /// Submits a case and waits for its end; answers the job.
    pub async fn solve(&self, case: &Value) -> Value {
        let waiting = |request: RequestBuilder| request.header("prefer", "wait=60").json(case);
        let answer = self.send(Method::POST, "/v1/jobs", waiting).await;
        assert_eq!(answer.status, 200, "{}", answer.text);
        answer.json
    }
}

impl Answer {
    pub fn header(&self, name: &str) -> Option<&str> {
        self.headers.get(name).and_then(|value| value.to_str().ok())
    }
}

/// A body as it was before it was packed.
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

/// The text of a file in `api/examples`.
pub fn example_text(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("api/examples")
        .join(file);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A file in `api/examples`.
pub fn example(file: &str) -> Value {
    serde_json::from_str(&example_text(file)).expect("an example is JSON")
}
