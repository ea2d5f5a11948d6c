//! Measures the time of 200 short jobs on one worker from submission to end, with one long sweep and without.

use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::cases::meshed;
use crate::client::{Client, id_of};
use crate::machine::quantile;
use crate::service::Service;
use crate::{Row, times};

const SHORT: usize = 200;
/// Time between two submissions.
const EVERY: Duration = Duration::from_millis(200);
const SIZE: u32 = 10;

/// Runs both and returns the figures.
pub async fn run() -> Vec<Row> {
    let service = Service::start(1, &["--cache", "false"]);
    let alone = short_jobs(&service.url).await;
    let mut client = Client::new(&service.url);
    let mut sweep = meshed(0, 32);
    sweep["motion"] = json!({ "sweep": {
        "creepage_x": { "from": 0.0002, "to": 0.003, "points": 10_000 }
    } });
    let job = client.submit(&sweep, None).await;
    let path = format!("/v1/jobs/{}", id_of(&job));
    while client.json(&path).await["state"] != "running" {
        tokio::time::sleep(EVERY).await;
    }
    let before = progress(&client.json(&path).await);
    let start = Instant::now();
    let during = short_jobs(&service.url).await;
    let (after, seconds) = (client.json(&path).await, start.elapsed().as_secs_f64());
    vec![
        Row::plain(
            "mixed-lengths: submission to end of a short job, median, p99, on an idle worker",
            times(&alone),
        ),
        Row::judged(
            "mixed-lengths: the same during a sweep of 10 000 motions",
            times(&during),
            "p99 ≤ 5 s (two slices of 2 s)",
            quantile(during, 0.99) <= 5.0,
        ),
        Row::judged(
            "mixed-lengths: progress of the sweep meanwhile",
            format!(
                "{:.3} in {seconds:.0} s, {} at the end",
                progress(&after) - before,
                after["state"]
            ),
            "> 0",
            progress(&after) > before,
        ),
    ]
}

fn progress(job: &Value) -> f64 {
    job["progress"].as_f64().expect("a progress")
}

/// Returns the seconds from submission to end of short jobs submitted one after the other. A separate client waits for each.
async fn short_jobs(url: &str) -> Vec<f64> {
    let mut waiting = Vec::with_capacity(SHORT);
    for number in 0..SHORT {
        let url = url.to_owned();
        waiting.push(tokio::spawn(async move {
            let start = Instant::now();
            let case = meshed(number, SIZE);
            let job = Client::new(&url).submit(&case, Some("wait=60")).await;
            assert_eq!(job["state"], "succeeded", "{job}");
            start.elapsed().as_secs_f64()
        }));
        tokio::time::sleep(EVERY).await;
    }
    let mut times = Vec::with_capacity(SHORT);
    for one in waiting {
        times.push(one.await.expect("a job"));
    }
    times
}
