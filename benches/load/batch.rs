//! Measures one batch of 20 000 default Hertz cases with distinct loads and creepages, from the first byte sent to the last result line received.

use std::time::{Duration, Instant};

use reqwest::Method;
use serde_json::Value;

use crate::Row;
use crate::cases::{bare_rate, hertz};
use crate::client::Client;
use crate::mixed::memory;
use crate::service::Service;

const CASES: usize = 20_000;
const BARE_TIME: Duration = Duration::from_secs(10);
const SAMPLE: Duration = Duration::from_millis(200);

/// Runs the batch and returns its figures.
pub async fn run(workers: usize) -> Vec<Row> {
    let lines: Vec<String> = (0..CASES).map(|number| hertz(number).to_string()).collect();
    let body = lines.join("\n");
    let service = Service::start(workers, &[]);
    let start = Instant::now();
    let sent = tokio::spawn(send(service.url.clone(), body, start));
    let mut samples = Vec::new();
    while !sent.is_finished() {
        samples.push(service.usage());
        tokio::time::sleep(SAMPLE).await;
    }
    let (accepted, seconds) = sent.await.expect("a batch without errors");
    let stored = service.usage().stored_mb;
    drop(service);
    let bare = bare_rate(workers, BARE_TIME, hertz);
    let rate = CASES as f64 / seconds;
    vec![
        Row::plain(
            "batch: bare solver, default Hertz cases",
            format!("{bare:.0} cases/s"),
        ),
        Row::judged(
            "batch: first byte sent to last line received, share of bare",
            format!(
                "{CASES} in {seconds:.1} s, {rate:.0} cases/s, {:.0} %",
                100.0 * rate / bare
            ),
            "≥ 40 %",
            rate >= 0.4 * bare,
        ),
        Row::plain("batch: accepted after", format!("{accepted:.2} s")),
        Row::plain(
            "batch: data folder, per job",
            format!("{stored:.0} MB, {:.1} kB", 1e3 * stored / CASES as f64),
        ),
        memory("batch: memory at 25, 50, 75, 100 % of the time", &samples),
    ]
}

/// Sends the batch and reads all results. Returns the seconds until it was accepted and until the last line.
async fn send(url: String, body: String, start: Instant) -> (f64, f64) {
    let mut client = Client::new(&url);
    let answer = client.send(Method::POST, "/v1/batches", &[202], |request| {
        request
            .header("content-type", "application/x-ndjson")
            .body(body.clone())
    });
    let batch: Value = answer.await.json().await.expect("JSON");
    let accepted = start.elapsed().as_secs_f64();
    client.batch_results(&batch, CASES).await;
    (accepted, start.elapsed().as_secs_f64())
}
