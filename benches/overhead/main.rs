//! Measures the cost of the service in addition to the solver.
//!
//! `cargo bench --bench overhead [-- program=PATH]` starts the real program with one worker on loopback and prints a table: the server's processor
//! time for a job (300 sequential `POST /v1/jobs` with `Prefer: wait`) and for a case of a batch, the time of one row by `/v1/evaluate`, and the
//! time of a simulation step on a pair of profiles. If `strace` is installed, it also prints the system calls of a job. `program=PATH` measures
//! another program, such as `target/release/railhead`.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use railhead::contact::case::solver::Limits;
use railhead::contact::check;
use railhead::contact::monitor::Unmonitored;
use railhead::jobs::engine::Engine;
use serde_json::{Value, json};

use crate::machine::{median, quantile, seconds_of};
use crate::service::Service;

#[path = "../machine.rs"]
mod machine;
#[path = "../load/service.rs"]
#[expect(dead_code, reason = "other benches use the rest")]
mod service;

/// Number of requests of each kind.
const JOBS: usize = 300;
const CASES: usize = 2000;
const ROWS: usize = 2000;
const STEPS: usize = 200;
/// Number of requests before the measurement.
const FIRST: usize = 20;

/// A persistent connection.
struct Connection {
    stream: BufReader<TcpStream>,
}

impl Connection {
    fn open(service: &Service) -> Connection {
        let address = service.url.trim_start_matches("http://");
        let stream = TcpStream::connect(address).expect("a connection");
        stream.set_nodelay(true).expect("an option");
        Connection {
            stream: BufReader::new(stream),
        }
    }

    /// Sends a request and returns the response body. The status must be 200 or 202.
    fn send(&mut self, method: &str, path: &str, header: &str, body: &[u8]) -> Vec<u8> {
        let head = format!(
            "{method} {path} HTTP/1.1\r\nhost: localhost\r\ncontent-length: {}\r\n{header}\r\n",
            body.len()
        );
        let request = [head.as_bytes(), body].concat();
        self.stream.get_mut().write_all(&request).expect("sent");
        let status = self.line();
        let (mut length, mut chunked) = (0, false);
        loop {
            let line = self.line().to_ascii_lowercase();
            if line.is_empty() {
                break;
            }
            if let Some(text) = line.strip_prefix("content-length: ") {
                length = text.parse().expect("a length");
            }
            chunked |= line == "transfer-encoding: chunked";
        }
        let mut answer = Vec::new();
        if chunked {
            loop {
                let size = usize::from_str_radix(&self.line(), 16).expect("a size");
                answer.extend(self.bytes(size));
                self.line();
                if size == 0 {
                    break;
                }
            }
        } else {
            answer = self.bytes(length);
        }
        assert!(
            status.starts_with("HTTP/1.1 20"),
            "{method} {path}: {status} {}",
            String::from_utf8_lossy(&answer)
        );
        answer
    }

    fn post(&mut self, path: &str, prefer: &str, body: &Value) -> Value {
        let header = format!("content-type: application/json\r\n{prefer}");
        let answer = self.send("POST", path, &header, body.to_string().as_bytes());
        serde_json::from_slice(&answer).expect("JSON")
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.stream.read_line(&mut line).expect("a line");
        line.trim_end().to_owned()
    }

    fn bytes(&mut self, length: usize) -> Vec<u8> {
        let mut bytes = vec![0; length];
        self.stream.read_exact(&mut bytes).expect("bytes");
        bytes
    }
}

/// Returns a case that is solved in a fraction of a millisecond. Each number gives a distinct case.
fn small(number: usize) -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82_000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "ellipse", "a_mm": 6, "b_mm": 4 },
        "load": { "normal_force_n": 80_000 },
        "motion": { "creepage_x": 1e-4 + 1e-8 * number as f64 },
        "solver": { "method": "fastsim" },
    })
}

fn job(connection: &mut Connection, number: usize) {
    let job = connection.post("/v1/jobs", "prefer: wait=10\r\n", &small(number));
    assert_eq!(job["state"], "succeeded", "{job}");
}

/// Prints a line of the table.
fn row(what: &str, figure: f64, unit: &str, goal: Option<f64>) {
    let verdict = goal.map_or(String::new(), |goal| {
        let met = if figure <= goal { "met" } else { "MISSED" };
        format!("≤ {goal} {unit}: {met}")
    });
    println!("| {what} | {figure:.2} {unit} | {verdict} |");
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --benches` also runs this program, and then it measures nothing.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return;
    }
    let named = arguments
        .iter()
        .find_map(|one| one.strip_prefix("program="));
    let program = named.unwrap_or(env!("CARGO_BIN_EXE_railhead"));
    let service = Service::start_program(program, 1, &["--rate-limit", "100000"]);
    let mut connection = Connection::open(&service);
    println!("| what | measured | goal |\n|---|---|---|");
    jobs(&service, &mut connection);
    batch(&service, &mut connection);
    rows(&mut connection);
    steps(&mut connection);
    system_calls(&service, &mut connection);
}

fn jobs(service: &Service, connection: &mut Connection) {
    (0..FIRST).for_each(|number| job(connection, number));
    let before = service.usage().processor_s;
    let times = (FIRST..FIRST + JOBS).map(|number| {
        let start = Instant::now();
        job(connection, number);
        start.elapsed().as_secs_f64() * 1e3
    });
    let times: Vec<f64> = times.collect();
    let spent = service.usage().processor_s - before;
    row(
        "a job, processor",
        spent / JOBS as f64 * 1e3,
        "ms",
        Some(1.5),
    );
    row("a job, p50", median(times), "ms", None);
}

fn batch(service: &Service, connection: &mut Connection) {
    let cases: Vec<Value> = (0..CASES).map(|number| small(10_000 + number)).collect();
    let engine = Engine::contact();
    let solves = cases.iter().take(200).map(|case| {
        let checked = check(case, &Limits::default()).expect("a case");
        seconds_of(|| engine.solve_whole(&checked, &Unmonitored)).0
    });
    let solve = median(solves.collect());
    let before = service.usage().processor_s;
    let batch = connection.post("/v1/batches", "", &json!(cases));
    let path = format!("/v1/batches/{}", batch["id"].as_str().expect("an id"));
    loop {
        std::thread::sleep(Duration::from_millis(50));
        let answer = connection.send("GET", &path, "", b"");
        let batch: Value = serde_json::from_slice(&answer).expect("JSON");
        if batch["states"]["succeeded"] == CASES {
            break;
        }
    }
    let spent = (service.usage().processor_s - before) / CASES as f64;
    row(
        "a case of a batch beside its solve, processor",
        (spent - solve) * 1e3,
        "ms",
        Some(0.3),
    );
}

/// Returns the times of requests to `/v1/evaluate` in ms.
fn evaluated(
    connection: &mut Connection,
    number: usize,
    request: impl Fn(usize) -> Value,
) -> Vec<f64> {
    let header = "content-type: application/json\r\n";
    let times = (0..FIRST + number).map(|number| {
        let body = request(number).to_string();
        let start = Instant::now();
        let answer = connection.send("POST", "/v1/evaluate", header, body.as_bytes());
        let time = start.elapsed().as_secs_f64() * 1e3;
        let answer: Value = serde_json::from_slice(&answer).expect("JSON");
        let status = &answer["columns"]["status"][0];
        assert!(status == "ok" || status == "target_missed", "{answer}");
        time
    });
    times.skip(FIRST).collect()
}

fn rows(connection: &mut Connection) {
    let mut template = small(0);
    template["solver"] = json!({ "method": "table" });
    let times = evaluated(
        connection,
        ROWS,
        |number| json!({ "template": template, "columns": { "/motion/creepage_x": [1e-8 * number as f64] } }),
    );
    row("one row, p50", median(times.clone()), "ms", Some(0.6));
    row("one row, p99", quantile(times, 0.99), "ms", None);
}

/// Returns the load of a wheel in N, which varies from step to step.
fn load(step: usize) -> f64 {
    75_000.0 + 5_000.0 * (0.3 * step as f64).sin()
}

fn steps(connection: &mut Connection) {
    let mut case: Value =
        serde_json::from_str(include_str!("../../api/examples/wheel-rail.case.json"))
            .expect("an example");
    case["outputs"] = json!(["resultants"]);
    let times = evaluated(
        connection,
        STEPS,
        |step| json!({ "template": case, "columns": { "/load/vertical_force_n": [load(step)] } }),
    );
    let engine = Engine::contact();
    let solves = (0..STEPS).map(|step| {
        case["load"]["vertical_force_n"] = json!(load(step));
        let checked = check(&case, &Limits::default()).expect("a case");
        seconds_of(|| engine.solve_whole(&checked, &Unmonitored)).0 * 1e3
    });
    let solve = median(solves.collect());
    row("a step on profiles, p50 of the solve", solve, "ms", None);
    row(
        "a step on profiles beside its solve, p50",
        median(times) - solve,
        "ms",
        Some(1.0),
    );
}

/// Prints the system calls of a job, as `strace` counts them.
fn system_calls(service: &Service, connection: &mut Connection) {
    const TRACED: usize = 100;
    let counts = tempfile::NamedTempFile::new().expect("a file");
    let strace = Command::new("strace")
        .args(["-c", "-f", "-p", &service.pid().to_string(), "-o"])
        .arg(counts.path())
        .stderr(Stdio::null())
        .spawn();
    let Ok(mut strace) = strace else {
        println!("| system calls of a job | no `strace` here | |");
        return;
    };
    std::thread::sleep(Duration::from_secs(2));
    (0..TRACED).for_each(|number| job(connection, 20_000 + number));
    let interrupted = nix::sys::signal::kill(
        nix::unistd::Pid::from_raw(strace.id().cast_signed()),
        nix::sys::signal::Signal::SIGINT,
    );
    interrupted.expect("a signal");
    strace.wait().expect("an end");
    let text = std::fs::read_to_string(counts.path()).expect("counts");
    for call in [
        "futex",
        "fsync",
        "write",
        "pwrite64",
        "pread64",
        "epoll_wait",
    ] {
        let lines = text.lines().map(str::split_whitespace);
        let line = lines.map(Iterator::collect::<Vec<_>>);
        let counted = line
            .into_iter()
            .find(|words| words.last() == Some(&call))
            .and_then(|words| words[3].parse::<f64>().ok());
        let goal = (call == "futex").then_some(40.0);
        row(
            &format!("calls of `{call}` of a job"),
            counted.unwrap_or(0.0) / TRACED as f64,
            "calls",
            goal,
        );
    }
}
