//! Measures the rows per second of `/v1/evaluate`, and the time of a run of a million rows.

use std::fmt::Write;
use std::time::Instant;

use railhead::tables::read::TableForm;
use railhead::tables::table::{RowTable, TableColumn};
use railhead::tables::write::RowWriter;
use reqwest::Method;
use serde_json::{Value, json};

use crate::Row;
use crate::client::{Client, id_of};
use crate::random::Random;
use crate::service::Service;

/// Number of rows of one request of `/v1/evaluate` as CSV, whose text stays below 64 MiB.
const EVALUATED: usize = 500_000;
/// Numbers of rows of a run by the table, and of one by the fast solver.
const BY_TABLE: usize = 1_000_000;
const BY_SOLVER: usize = 100_000;
/// Number of rows of a run of one pair, in the order of a simulation.
const BY_STEPS: usize = 20_000;

const NAMES: [&str; 7] = [
    "normal_force_n",
    "rolling_mm",
    "lateral_mm",
    "friction_coefficient",
    "creepage_x",
    "creepage_y",
    "spin_per_mm",
];

/// Returns columns of rows of a line: loads, radii, friction, creepages, spin.
fn columns(rows: usize) -> Vec<Vec<f64>> {
    let ranges = [
        [2e4, 1.2e5],
        [300.0, 600.0],
        [80.0, 980.0],
        [0.1, 0.5],
        [-2e-3, 2e-3],
        [-2e-3, 2e-3],
        [-1e-3, 1e-3],
    ];
    let mut random = Random(7);
    ranges
        .iter()
        .map(|[low, high]| (0..rows).map(|_| random.between(*low, *high)).collect())
        .collect()
}

/// Returns columns of rows of one pair, step by step: a wheelset oscillates, and load and friction with it.
fn steps(rows: usize) -> Vec<Vec<f64>> {
    let all = |of: fn(f64) -> f64| (0..rows).map(|row| of(0.05 * row as f64)).collect();
    vec![
        all(|t| 8e4 + 2e4 * (0.9 * t).sin()),
        all(|_| 460.0),
        all(|_| 300.0),
        all(|t| 0.3 + 0.05 * (0.02 * t).cos()),
        all(|t| 1.5e-3 * (0.31 * t).sin() + 5e-4 * (1.7 * t).cos()),
        all(|t| 2e-3 * (0.47 * t + 1.0).sin() + 7e-4 * (2.3 * t).sin()),
        all(|t| 4e-4 + 3e-4 * (0.2 * t).sin()),
    ]
}

fn template(method: &str, target: f64) -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82_000.0, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460.0, "lateral_mm": 300.0 },
        "load": { "normal_force_n": 8e4 },
        "motion": { "creepage_x": 0.0, "creepage_y": 0.0, "spin_per_mm": 0.0 },
        "solver": { "method": method, "target_error": target },
        "outputs": ["resultants"],
    })
}

fn csv(columns: &[Vec<f64>]) -> Vec<u8> {
    let mut text = format!("{}\n", NAMES.join(","));
    for row in 0..columns[0].len() {
        for (place, column) in columns.iter().enumerate() {
            let before = if place == 0 { "" } else { "," };
            // Nine digits, the maximum of measured data.
            write!(text, "{before}{:.8e}", column[row]).expect("a text");
        }
        text.push('\n');
    }
    text.into_bytes()
}

fn arrow(columns: &[Vec<f64>]) -> Vec<u8> {
    let columns = NAMES.iter().zip(columns);
    let table = RowTable {
        columns: columns
            .map(|(name, column)| ((*name).to_owned(), TableColumn::Numbers(column.clone())))
            .collect(),
    };
    RowWriter::whole(TableForm::Arrow, table).expect("a stream")
}

pub async fn run(workers: usize) -> Vec<Row> {
    let service = Service::start(workers, &[]);
    let mut client = Client::new(&service.url);
    let mut rows = Vec::new();
    for method in ["table", "boundary_element"] {
        let template = template(method, 0.005);
        let id = id_of(&client.submit(&template, Some("wait=60")).await);
        if method == "table" {
            rows.extend(evaluated(&mut client, &id).await);
            rows.push(run_of(&service, &mut client, &id, &columns(BY_TABLE), 60.0).await);
        } else {
            let each = bare(&columns(500));
            let within = 1.25 * each * BY_SOLVER as f64 / workers as f64;
            rows.push(run_of(&service, &mut client, &id, &columns(BY_SOLVER), within).await);
            let steps = steps(BY_STEPS);
            rows.push(run_of(&service, &mut client, &id, &steps, f64::INFINITY).await);
        }
    }
    rows
}

async fn evaluated(client: &mut Client, job: &str) -> Vec<Row> {
    let columns = columns(EVALUATED);
    let mut rows = Vec::new();
    for (name, form, format, body) in [
        ("CSV", "text/csv", "csv", csv(&columns)),
        (
            "Arrow",
            "application/vnd.apache.arrow.stream",
            "arrow",
            arrow(&columns),
        ),
    ] {
        let path = format!("/v1/evaluate?template={job}&format={format}");
        let mut best = 0.0_f64;
        for _ in 0..3 {
            let began = Instant::now();
            let shape = |request: reqwest::RequestBuilder| {
                request.header("content-type", form).body(body.clone())
            };
            let answer = client.send(Method::POST, &path, &[200], shape).await;
            let bytes = answer.bytes().await.expect("a body");
            assert!(bytes.len() > 40 * EVALUATED, "an answer of {}", bytes.len());
            best = best.max(EVALUATED as f64 / began.elapsed().as_secs_f64());
        }
        rows.push(Row::judged(
            &format!("`/v1/evaluate`, {EVALUATED} rows of 7 numbers, {name} in and out"),
            format!("{best:.0} rows/s"),
            "300 000 rows/s",
            best >= 3e5,
        ));
    }
    rows
}

async fn run_of(
    service: &Service,
    client: &mut Client,
    job: &str,
    sent: &[Vec<f64>],
    within: f64,
) -> Row {
    let count = sent[0].len();
    let body = arrow(sent);
    let began = Instant::now();
    let shape = |request: reqwest::RequestBuilder| {
        let request = request.header("content-type", "application/vnd.apache.arrow.stream");
        request.body(body.clone())
    };
    let path = format!("/v1/runs?template={job}");
    let answer = client.send(Method::POST, &path, &[202], shape).await;
    let run: Value = answer.json().await.expect("JSON");
    let accepted = began.elapsed().as_secs_f64();
    let own = format!("/v1/runs/{}", id_of(&run));
    let mut memory = 0.0_f64;
    let (run, ended) = loop {
        let run = client.json(&own).await;
        memory = memory.max(service.usage().memory_mb);
        if run["ended_at"].is_string() {
            break (run, began.elapsed().as_secs_f64());
        }
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
    };
    assert_eq!(run["rows_done"], json!(count), "{run}");
    let (parquet, seconds) = client.get(&format!("{own}/results?format=parquet")).await;
    let (text, csv_seconds) = client.get(&format!("{own}/results?format=csv")).await;
    let lines = text.iter().filter(|byte| **byte == b'\n').count();
    assert_eq!(lines, count + 1, "lines of the results");
    memory = memory.max(service.usage().memory_mb);
    let method = run["method"].as_str().expect("a method").to_owned();
    Row::judged(
        &format!("a run of {count} rows by `{method}`, sent as Arrow"),
        format!(
            "accepted after {accepted:.1} s, ended after {ended:.1} s; Parquet of {:.0} MB in {seconds:.1} s, CSV in {csv_seconds:.1} s; memory at most {memory:.0} MB",
            parquet.len() as f64 / 1e6
        ),
        &match within.is_finite() {
            true => format!("within {within:.0} s, below 1024 MB"),
            false => "below 1024 MB".to_owned(),
        },
        ended <= within && memory < 1024.0,
    )
}

/// Returns the seconds per row of the solver alone on one thread.
fn bare(columns: &[Vec<f64>]) -> f64 {
    use railhead::contact;
    use railhead::contact::case::solver::Limits;
    use railhead::contact::monitor::Unmonitored;
    let pointers = [
        "/load/normal_force_n",
        "/contact/rolling_mm",
        "/contact/lateral_mm",
        "/friction/coefficient",
        "/motion/creepage_x",
        "/motion/creepage_y",
        "/motion/spin_per_mm",
    ];
    let operators = std::sync::Arc::default();
    let rows = columns[0].len();
    let began = Instant::now();
    for row in 0..rows {
        let mut case = template("boundary_element", 0.005);
        for (pointer, column) in pointers.iter().zip(columns) {
            *case.pointer_mut(pointer).expect("a number") = json!(column[row]);
        }
        let checked = contact::check(&case, &Limits::default()).expect("a sound case");
        contact::solve_with(&operators, &checked, &Unmonitored).expect("an answer");
    }
    began.elapsed().as_secs_f64() / rows as f64
}
