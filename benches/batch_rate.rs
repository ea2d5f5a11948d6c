//! How fast is a batch, from the first byte sent to the last result line received, against the bare solver with as many
//! threads as the service has workers? Cases are default Hertz ones with distinct loads and creepages; the driver runs
//! on the same machine. `cargo bench --bench batch_rate [-- cases workers]`.

use std::io::{BufRead, BufReader};
use std::ops::ControlFlow;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use railhead::contact::monitor::{Monitor, Stop};
use railhead::contact::problem::Limits;
use railhead::contact::{check, solve};
use serde_json::{Value, json};

struct Clock(Instant);

impl Monitor for Clock {
    fn tick(&self, _progress: f64) -> ControlFlow<Stop> {
        ControlFlow::Continue(())
    }

    fn elapsed(&self) -> Duration {
        self.0.elapsed()
    }
}

/// The real program on a data folder of its own; killed when dropped.
struct Service {
    child: Child,
    url: String,
    _folder: tempfile::TempDir,
}

impl Service {
    fn start(workers: usize) -> Service {
        let folder = tempfile::tempdir().expect("a folder");
        let mut child = Command::new(env!("CARGO_BIN_EXE_railhead"))
            .args(["serve", "--listen", "127.0.0.1:0", "--log-format", "json"])
            .args(["--workers", &workers.to_string(), "--data-dir"])
            .arg(folder.path())
            .stderr(Stdio::piped())
            .spawn()
            .expect("a service");
        let mut log = BufReader::new(child.stderr.take().expect("a log")).lines();
        let address = log
            .by_ref()
            .map_while(Result::ok)
            .filter_map(|line| serde_json::from_str::<Value>(&line).ok())
            .find(|event| event["message"] == "listening")
            .and_then(|event| Some(event["address"].as_str()?.to_owned()))
            .expect("an address");
        std::thread::spawn(move || log.map_while(Result::ok).count());
        Service {
            child,
            url: format!("http://{address}"),
            _folder: folder,
        }
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn cases(count: usize) -> Vec<Value> {
    let case = |i: usize| {
        let share = i as f64 / count as f64;
        json!({
            "name": format!("case {i}"),
            "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
            "friction": { "coefficient": 0.3 },
            "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
            "load": { "normal_force_n": 60_000.0 + 80_000.0 * share },
            "motion": {
                "creepage_x": 0.0001 + 0.003 * ((7 * i) % count) as f64 / count as f64,
                "creepage_y": 0.0,
                "spin_per_mm": 0.0004
            }
        })
    };
    (0..count).map(case).collect()
}

fn bare_seconds(cases: &[Value], threads: usize) -> f64 {
    let next = AtomicUsize::new(0);
    let start = Instant::now();
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let problem = check(case, &Limits::default()).expect("a case");
                    solve(&problem, &Clock(Instant::now())).expect("a solution");
                }
            });
        }
    });
    start.elapsed().as_secs_f64()
}

async fn batch_seconds(service: &Service, cases: &[Value]) -> (f64, f64) {
    let lines: Vec<String> = cases.iter().map(Value::to_string).collect();
    let body = lines.join("\n");
    let client = reqwest::Client::new();
    let start = Instant::now();
    let answer = client
        .post(format!("{}/v1/batches", service.url))
        .header("content-type", "application/x-ndjson")
        .body(body)
        .send()
        .await
        .expect("an answer");
    assert_eq!(answer.status(), 202);
    let batch: Value = answer.json().await.expect("JSON");
    let accepted = start.elapsed().as_secs_f64();
    let path = batch["links"]["results"].as_str().expect("a link");
    let answer = client
        .get(format!("{}{path}?wait=600", service.url))
        .send()
        .await
        .expect("results");
    let text = answer.text().await.expect("lines");
    let seconds = start.elapsed().as_secs_f64();
    let succeeded = text
        .lines()
        .filter(|line| line.contains("\"state\":\"succeeded\""))
        .count();
    assert_eq!(
        (text.lines().count(), succeeded),
        (cases.len(), cases.len())
    );
    (accepted, seconds)
}

fn main() {
    let mut numbers = std::env::args().filter_map(|text| text.parse::<usize>().ok());
    let count = numbers.next().unwrap_or(20_000);
    let workers = numbers
        .next()
        .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    let cases = cases(count);
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    println!("{count} default Hertz cases, {workers} workers");
    let service = Service::start(workers);
    let (accepted, seconds) = runtime.block_on(batch_seconds(&service, &cases));
    drop(service);
    let bare = bare_seconds(&cases, workers);
    let rate = |seconds: f64| count as f64 / seconds;
    println!("bare solver: {bare:.2} s, {:.0} cases/s", rate(bare));
    println!(
        "batch: accepted after {accepted:.2} s, last line after {seconds:.2} s, {:.0} cases/s",
        rate(seconds)
    );
    println!("share of the bare rate: {:.2}", bare / seconds);
}
