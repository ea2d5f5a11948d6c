//! Measures the cost of the service in addition to the solver.
//!
//! `cargo bench --bench overhead [-- program=PATH]` starts the real program with one worker on loopback and prints a table: the server's processor
//! time for a job (300 sequential `POST /v1/jobs` with `Prefer: wait`) and for a case of a batch, the time of one row by `/v1/evaluate`, and the
//! time of a simulation step on a pair of profiles. If `strace` is installed, it also prints the system calls of a job. `program=PATH` measures
//! another program, such as `target/release/railhead`.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use railhead::contact::case::solver::Limits;
use railhead::contact::check;
use railhead::contact::monitor::Unmonitored;
use railhead::jobs::engine::Engine;
use serde_json::{Value, json};

use crate::client::{Client, id_of};
use crate::machine::{median, quantile, seconds_of};
use crate::service::{Service, railhead};

#[path = "../client.rs"]
#[expect(dead_code, reason = "other benches use the rest")]
mod client;
#[path = "../machine.rs"]
mod machine;
#[path = "../service.rs"]
#[expect(dead_code, reason = "other benches use the rest")]
mod service;

/// Number of requests of each kind.
const JOBS: usize = 300;
const CASES: usize = 2000;
const ROWS: usize = 2000;
const STEPS: usize = 200;
/// Number of requests before the measurement.
const FIRST: usize = 20;

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

async fn job(client: &mut Client, number: usize) {
    let job = client.submit(&small(number), Some("wait=10")).await;
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
    let program = named.map_or_else(railhead, Command::new);
    let folder = tempfile::tempdir().expect("a folder");
    let data = folder.path().join("data");
    let flags = ["--rate-limit", "100000"];
    let service = Service::start_on(program, (folder, data), 1, &flags);
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .expect("a runtime");
    runtime.block_on(async {
        let mut client = Client::new(&service.url);
        println!("| what | measured | goal |\n|---|---|---|");
        jobs(&service, &mut client).await;
        batch(&service, &mut client).await;
        rows(&mut client).await;
        steps(&mut client).await;
        system_calls(&service, &mut client).await;
    });
}

async fn jobs(service: &Service, client: &mut Client) {
    for number in 0..FIRST {
        job(client, number).await;
    }
    let before = service.usage().processor_s;
    let mut times = Vec::new();
    for number in FIRST..FIRST + JOBS {
        let start = Instant::now();
        job(client, number).await;
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    let spent = service.usage().processor_s - before;
    row(
        "a job, processor",
        spent / JOBS as f64 * 1e3,
        "ms",
        Some(1.5),
    );
    row("a job, p50", median(times), "ms", None);
}

async fn batch(service: &Service, client: &mut Client) {
    let cases: Vec<Value> = (0..CASES).map(|number| small(10_000 + number)).collect();
    let engine = Engine::contact();
    let solves = cases.iter().take(200).map(|case| {
        let checked = check(case, &Limits::default()).expect("a case");
        seconds_of(|| engine.solve_whole(&checked, &Unmonitored)).0
    });
    let solve = median(solves.collect());
    let before = service.usage().processor_s;
    let batch = client.post("/v1/batches", &[202], &json!(cases)).await;
    let path = format!("/v1/batches/{}", id_of(&batch));
    while client.json(&path).await["states"]["succeeded"] != CASES {
        tokio::time::sleep(Duration::from_millis(50)).await;
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
async fn evaluated(
    client: &mut Client,
    number: usize,
    request: impl Fn(usize) -> Value,
) -> Vec<f64> {
    let mut times = Vec::new();
    for number in 0..FIRST + number {
        let body = request(number);
        let start = Instant::now();
        let answer = client.post("/v1/evaluate", &[200], &body).await;
        times.push(start.elapsed().as_secs_f64() * 1e3);
        let status = &answer["columns"]["status"][0];
        assert!(status == "ok" || status == "target_missed", "{answer}");
    }
    times.split_off(FIRST)
}

async fn rows(client: &mut Client) {
    let mut template = small(0);
    template["solver"] = json!({ "method": "table" });
    let request = |number| json!({ "template": template, "columns": { "/motion/creepage_x": [1e-8 * number as f64] } });
    let times = evaluated(client, ROWS, request).await;
    row("one row, p50", median(times.clone()), "ms", Some(0.6));
    row("one row, p99", quantile(times, 0.99), "ms", None);
}

/// Returns the load of a wheel in N, which varies from step to step.
fn load(step: usize) -> f64 {
    75_000.0 + 5_000.0 * (0.3 * step as f64).sin()
}

async fn steps(client: &mut Client) {
    let mut case: Value =
        serde_json::from_str(include_str!("../../api/examples/wheel-rail.case.json"))
            .expect("an example");
    case["outputs"] = json!(["resultants"]);
    let request =
        |step| json!({ "template": case, "columns": { "/load/vertical_force_n": [load(step)] } });
    let times = evaluated(client, STEPS, request).await;
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
async fn system_calls(service: &Service, client: &mut Client) {
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
    tokio::time::sleep(Duration::from_secs(2)).await;
    for number in 0..TRACED {
        job(client, 20_000 + number).await;
    }
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
