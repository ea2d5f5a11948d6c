//! A service in this process, with its own port and data folder, and a client.

use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;

use railhead::contact::error::SolveError;
use railhead::contact::monitor::Monitor;
use railhead::contact::problem::checked_case::CheckedCase;
use railhead::contact::solution::words::answer::{Fields, Solution};
use railhead::http::{HttpOptions, router};
use railhead::jobs::engine::Engine;
use railhead::jobs::{Jobs, Options};
use reqwest::{Body, Method, RequestBuilder};
use serde_json::Value;
use tempfile::TempDir;
use tokio_util::sync::CancellationToken;

use crate::schema::assert_documented;
pub use crate::support::{Answer, unpacked};
use crate::support::{pause, waiting};

/// A running service. It ends with the runtime of the test.
pub struct Server {
    pub jobs: Jobs,
    pub address: SocketAddr,
    client: reqwest::Client,
    _folder: TempDir,
}

/// The options of a service.
pub struct Setup {
    pub options: Options,
    pub http: HttpOptions,
    pub recipe: Engine,
    /// Whether the service has workers. Without workers every job stays queued.
    pub working: bool,
    folder: TempDir,
}

impl Setup {
    /// Returns the defaults: real physics and one worker. Checks estimate times by formulas only.
    pub fn new() -> Setup {
        let folder = tempfile::tempdir().expect("a temporary folder");
        Setup {
            options: Options::new(folder.path()),
            http: HttpOptions {
                check_trial: Duration::ZERO,
                ..HttpOptions::default()
            },
            recipe: Engine::contact(),
            working: true,
            folder,
        }
    }

    /// Returns the setup of a service without workers, in which jobs stay queued.
    pub fn idle() -> Setup {
        Setup {
            working: false,
            ..Setup::new()
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
    /// Starts a service with real physics and one worker.
    pub async fn start() -> Server {
        Setup::new().start().await
    }

    /// Starts services like [`Server::start`]: one on the embedded store and, if PostgreSQL is available, one on a database.
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

    /// Starts a service like [`Server::start`] with changed options.
    pub async fn with(change: impl FnOnce(&mut Setup)) -> Server {
        let mut setup = Setup::new();
        change(&mut setup);
        setup.start().await
    }

    /// Starts a service like [`Server::idle`] with changed options.
    pub async fn idle_with(change: impl FnOnce(&mut Setup)) -> Server {
        let own = |setup: &mut Setup| {
            setup.working = false;
            change(setup);
        };
        Server::with(own).await
    }

    /// Starts a service that accepts jobs and never solves them.
    pub async fn idle() -> Server {
        Setup::idle().start().await
    }

    /// Sends a request that `shape` completes, and checks the answer against the contract.
    pub async fn send(
        &self,
        method: Method,
        path: &str,
        shape: impl FnOnce(RequestBuilder) -> RequestBuilder,
    ) -> Answer {
        let request = self
            .client
            .request(method.clone(), format!("http://{}{path}", self.address));
        let answer = Answer::to(shape(request)).await;
        let (form, json) = (answer.header("content-type"), &answer.json);
        assert_documented(method.as_str(), path, answer.status, form, json);
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

    /// Returns the JSON answer to a GET that must succeed.
    pub async fn read(&self, path: &str) -> Value {
        self.get(path).await.is(200).json
    }

    /// Sends a GET with one more header.
    pub async fn get_with(&self, path: &str, name: &str, value: &str) -> Answer {
        self.send(Method::GET, path, |request| request.header(name, value))
            .await
    }

    /// Sends JSON with one more header.
    pub async fn post_with(&self, path: &str, name: &str, value: &str, body: &Value) -> Answer {
        let shape = |request: RequestBuilder| request.header(name, value).json(body);
        self.send(Method::POST, path, shape).await
    }

    /// Sends a body with this media type.
    pub async fn post_as(&self, path: &str, form: &str, body: impl Into<Body>) -> Answer {
        let shape = |request: RequestBuilder| request.header("content-type", form).body(body);
        self.send(Method::POST, path, shape).await
    }

    /// Cancels a job, a batch, a run or an evolution.
    pub async fn cancel(&self, path: &str) -> Answer {
        self.send(Method::POST, &format!("{path}/cancel"), |request| request)
            .await
    }

    /// Waits until the job, batch or run at a path is in a state, and returns it.
    pub async fn until(&self, path: &str, state: &str) -> Value {
        let path = waiting(path, state);
        loop {
            let work = self.read(&path).await;
            if work["state"] == state {
                return work;
            }
            assert!(work["ended_at"].is_null(), "{state} was expected: {work}");
            pause().await;
        }
    }

    /// Submits a case as the template of tables. Returns the id of the job.
    pub async fn keep(&self, template: &Value) -> String {
        self.submit(template).await["/v1/jobs/".len()..].to_owned()
    }

    /// Submits a case without waiting. Returns the path of the job.
    pub async fn submit(&self, case: &Value) -> String {
        self.post("/v1/jobs", case).await.is(202).location()
    }

    /// Submits a case and waits for its end. Returns the job.
    pub async fn solve(&self, case: &Value) -> Value {
        let answer = self.post_with("/v1/jobs", "prefer", "wait=60", case).await;
        answer.is(200).json
    }
}

/// Returns the text of a file in `api/examples`.
pub fn example_text(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("api/examples")
        .join(file);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Returns a JSON file in `api/examples`.
pub fn example(file: &str) -> Value {
    serde_json::from_str(&example_text(file)).expect("an example is JSON")
}

/// Returns a link of a job, a batch, a run or a result.
pub fn link<'a>(of: &'a Value, name: &str) -> &'a str {
    of["links"][name].as_str().expect("a link")
}

/// Returns the number of entries of an array.
pub fn count(of: &Value) -> usize {
    of.as_array().expect("an array").len()
}
