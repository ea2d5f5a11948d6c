//! Nodes on one database, as real processes that are killed and restarted.

use std::net::SocketAddr;
use std::process::Command;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use railhead::jobs::store::postgres::schema::migrate;
use reqwest::{Client, Method, RequestBuilder};
use serde_json::Value;
use sqlx::PgPool;
use tempfile::TempDir;

use crate::postgres;
use crate::support::Service;

/// Time limit after which something is considered to hang.
const WITHIN: Duration = Duration::from_secs(900);
const READ_WITHIN: Duration = Duration::from_secs(120);

/// Returns the command that starts the node with this number.
type Prepare = Box<dyn Fn(usize) -> Command + Send + Sync>;

/// A node. Between a kill and a restart it has no process.
struct Node {
    role: &'static str,
    flags: Vec<String>,
    folder: TempDir,
    service: Option<Service>,
}

/// Nodes that share a database.
pub struct Cluster {
    prepare: Prepare,
    nodes: Mutex<Vec<Node>>,
    /// Addresses that accept requests at the moment.
    apis: Mutex<Vec<SocketAddr>>,
    client: Client,
}

impl Cluster {
    pub fn new(prepare: impl Fn(usize) -> Command + Send + Sync + 'static) -> Arc<Cluster> {
        let client = Client::builder().timeout(Duration::from_secs(20)).build();
        Arc::new(Cluster {
            prepare: Box::new(prepare),
            nodes: Mutex::default(),
            apis: Mutex::default(),
            client: client.expect("a client"),
        })
    }

    /// Adds a node on a database, without the cache, starts it and returns its number. A `worker` has one worker, `serve` has none.
    pub fn add(&self, role: &'static str, url: &str, flags: &str) -> usize {
        let workers = if role == "worker" { "1" } else { "0" };
        let database = ["--database-url", url, "--workers", workers];
        let flags = database
            .into_iter()
            .chain(["--cache", "false"])
            .chain(flags.split(' '));
        let mut nodes = self.nodes.lock().expect("the nodes");
        nodes.push(Node {
            role,
            flags: flags.map(str::to_owned).collect(),
            folder: tempfile::tempdir().expect("a folder"),
            service: None,
        });
        let number = nodes.len() - 1;
        drop(nodes);
        self.start(number);
        number
    }

    /// Starts a node that has ended. Panics if the node does not start, and may then be called again.
    pub fn start(&self, number: usize) {
        let (role, flags, folder) = {
            let nodes = self.nodes.lock().expect("the nodes");
            let node = &nodes[number];
            (node.role, node.flags.clone(), node.folder.path().to_owned())
        };
        let flags: Vec<&str> = flags.iter().map(String::as_str).collect();
        let service = Service::start_as(&mut (self.prepare)(number), role, &folder, &flags);
        let mut nodes = self.nodes.lock().expect("the nodes");
        nodes[number].service = Some(service);
        self.list(&nodes);
    }

    /// Kills a node with SIGKILL.
    pub fn kill(&self, number: usize) {
        let mut nodes = self.nodes.lock().expect("the nodes");
        let service = nodes[number].service.take();
        self.list(&nodes);
        service.expect("it runs").kill();
    }

    /// Shuts a node down gracefully.
    pub fn stop(&self, number: usize) {
        let mut nodes = self.nodes.lock().expect("the nodes");
        let service = nodes[number].service.take().expect("it runs");
        self.list(&nodes);
        drop(nodes);
        service.signal("TERM");
        assert!(
            service.wait().success(),
            "node {number} did not shut down gracefully"
        );
    }

    fn list(&self, nodes: &[Node]) {
        let apis = nodes.iter().filter(|node| node.role == "serve");
        let apis = apis.filter_map(|node| Some(node.service.as_ref()?.address()));
        *self.apis.lock().expect("the list") = apis.collect();
    }

    /// Returns the addresses of the nodes that answer requests.
    pub fn apis(&self) -> Vec<SocketAddr> {
        self.apis.lock().expect("the list").clone()
    }

    /// Returns the status and the text of a response, or `None` if it is missing or incomplete.
    async fn ask(
        &self,
        api: SocketAddr,
        method: Method,
        path: &str,
        shape: impl FnOnce(RequestBuilder) -> RequestBuilder,
    ) -> Option<(u16, String)> {
        let request = self.client.request(method, format!("http://{api}{path}"));
        let answer = shape(request).send().await.ok()?;
        let status = answer.status().as_u16();
        Some((status, answer.text().await.ok()?))
    }

    /// Cancels a job.
    pub async fn cancel(&self, id: &str) {
        let path = format!("/v1/jobs/{id}/cancel");
        let api = self.apis()[0];
        self.ask(api, Method::POST, &path, |request| request).await;
    }

    /// Returns the text of a successful response, which must be the same at every API node. Retries after faults of the object store that are not
    /// repaired within a request.
    pub async fn read_everywhere(&self, path: &str) -> String {
        let since = Instant::now();
        let mut read = Vec::new();
        for api in self.apis() {
            let text = loop {
                let asked = self.ask(api, Method::GET, path, |request| request);
                match asked.await {
                    Some((200, text)) => break text,
                    other if since.elapsed() > READ_WITHIN => panic!("{path}: {other:?}"),
                    _ => tokio::time::sleep(Duration::from_millis(100)).await,
                }
            };
            read.push(text);
        }
        let same = read.windows(2).all(|pair| pair[0] == pair[1]);
        assert!(same, "{path} differs");
        read.swap_remove(0)
    }

    /// Submits a body with an idempotency key to one API node after the other until it is accepted. Returns the id of the job or run and the number
    /// of retries.
    pub async fn submit(
        &self,
        path: &str,
        body: &Value,
        key: &str,
        mut place: usize,
    ) -> (String, usize) {
        let mut again = 0;
        loop {
            let apis = self.apis();
            place += 1;
            if !apis.is_empty() {
                let shape =
                    |request: RequestBuilder| request.header("Idempotency-Key", key).json(body);
                let asked = self.ask(apis[place % apis.len()], Method::POST, path, shape);
                if let Some((200 | 202, job)) = asked.await {
                    let job: Value = job.parse().expect("JSON");
                    let id = job["id"].as_str().expect("an id");
                    return (id.to_owned(), again);
                }
            }
            again += 1;
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }

    /// Returns the log lines of the running nodes that contain this text.
    pub fn logged(&self, text: &str) -> Vec<String> {
        let nodes = self.nodes.lock().expect("the nodes");
        let services = nodes.iter().filter_map(|node| node.service.as_ref());
        let logs = services.map(Service::log_text);
        let lines = logs.flat_map(|log| log.lines().map(str::to_owned).collect::<Vec<_>>());
        lines.filter(|line| line.contains(text)).collect()
    }
}

/// Creates a database whose tables also record ends of jobs. Returns its URL and connections to it.
pub async fn tables() -> Option<(String, PgPool)> {
    let url = postgres::database().await?;
    migrate(&url).await.expect("tables");
    let pool = PgPool::connect(&url).await.expect("the database");
    note_ends(&pool).await;
    Some((url, pool))
}

/// Records every end of a job in a table, to detect jobs that end twice.
pub async fn note_ends(pool: &PgPool) {
    let statements = "CREATE TABLE soak_ends (job text NOT NULL, state text NOT NULL); \
        CREATE FUNCTION soak_end() RETURNS trigger LANGUAGE plpgsql AS $$ \
        BEGIN INSERT INTO soak_ends VALUES (NEW.id, NEW.state); RETURN NULL; END $$; \
        CREATE TRIGGER soak_ends AFTER UPDATE ON jobs FOR EACH ROW \
        WHEN (NEW.ended_at IS NOT NULL AND (OLD.state <> NEW.state OR OLD.ended_at IS DISTINCT FROM NEW.ended_at)) \
        EXECUTE FUNCTION soak_end()";
    sqlx::raw_sql(statements)
        .execute(pool)
        .await
        .expect("a table");
}

/// Waits until something is done. Panics if it seems to hang.
pub async fn until(what: &str, mut done: impl AsyncFnMut() -> bool) {
    let since = Instant::now();
    while !done().await {
        assert!(since.elapsed() < WITHIN, "not seen: {what}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

/// Waits until all jobs have ended.
pub async fn until_all_ended(pool: &PgPool) {
    let open = "SELECT COUNT(*) FROM jobs WHERE ended_at IS NULL";
    until("all jobs end", async || counted(pool, open).await == 0).await;
}

/// Panics if a job has ended twice.
pub async fn assert_ended_once(pool: &PgPool) {
    let twice = "SELECT COUNT(*) FROM (SELECT job FROM soak_ends GROUP BY job HAVING COUNT(*) > 1) AS twice";
    assert_eq!(counted(pool, twice).await, 0, "a job ended twice");
}

/// Returns the number that a statement counts. Retries while the database is unavailable.
pub async fn counted(pool: &PgPool, statement: &'static str) -> i64 {
    loop {
        match sqlx::query_scalar(statement).fetch_one(pool).await {
            Ok(number) => return number,
            Err(sqlx::Error::Database(error))
                if error.code().is_some_and(|code| code.starts_with("42")) =>
            {
                panic!("{error}");
            }
            Err(_) => tokio::time::sleep(Duration::from_millis(200)).await,
        }
    }
}
