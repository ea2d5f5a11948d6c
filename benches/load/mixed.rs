//! Measures 64 clients for a minute. Each submits a case, polls its job until it has ended, and fetches parts of the result. Sometimes it waits for
//! the response or lists jobs.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::cases::{bare_rate, meshed, size_of};
use crate::client::{Client, id_of};
use crate::machine::{median, quantile};
use crate::service::{Service, Usage};
use crate::{Row, times};

const CLIENTS: usize = 64;
const TIME: Duration = Duration::from_secs(60);
const BARE_TIME: Duration = Duration::from_secs(10);
/// Target time of one solve in s.
const SOLVE_SECONDS: f64 = 0.005;
/// Pause between two polls of a job.
const PAUSE: Duration = Duration::from_millis(50);
/// Number of polls of an idle service.
const IDLE_LOOKS: usize = 2000;
/// Pause between two samples of memory.
const SAMPLE: Duration = Duration::from_millis(500);
/// Number of jobs on one page of the list.
const PAGE: usize = 1000;

/// Counts and times of one client.
#[derive(Default)]
struct Record {
    accepted: Vec<String>,
    /// Number of jobs whose result arrived before the end.
    done: usize,
    requests: usize,
    looks: Vec<f64>,
    submits: Vec<f64>,
    refused: BTreeMap<u16, usize>,
}

impl Record {
    /// Adds the counts and times of another client.
    fn add(&mut self, other: Record) {
        self.accepted.extend(other.accepted);
        self.done += other.done;
        self.requests += other.requests;
        self.looks.extend(other.looks);
        self.submits.extend(other.submits);
        for (status, times) in other.refused {
            *self.refused.entry(status).or_default() += times;
        }
    }
}

/// Runs the load and returns its figures.
pub async fn run(workers: usize) -> Vec<Row> {
    let (size, seconds) = size_of(SOLVE_SECONDS);
    let bare = bare_rate(workers, BARE_TIME, |number| meshed(number, size));
    let service = Service::start(workers, &[]);
    let looks = idle_looks(&service).await;
    let (idle, idle_times) = (median(looks.clone()), times(&looks));
    let end = Instant::now() + TIME;
    let clients: Vec<_> = (0..CLIENTS)
        .map(|number| tokio::spawn(client(service.url.clone(), number, size, end)))
        .collect();
    let samples = usage_until(&service, end).await;
    let mut all = Record::default();
    for client in clients {
        all.add(client.await.expect("a client without errors"));
    }
    verify(&service, &all.accepted).await;
    let rate = all.done as f64 / TIME.as_secs_f64();
    let p99 = quantile(all.looks.clone(), 0.99);
    vec![
        Row::plain(
            "mixed: mesh, time of one bare solve",
            format!("{size} × {size}, {:.1} ms", 1e3 * seconds),
        ),
        Row::plain("mixed: bare solver", format!("{bare:.0} cases/s")),
        Row::judged(
            "mixed: submit to result in hand, share of bare",
            format!("{rate:.0} jobs/s, {:.0} %", 100.0 * rate / bare),
            "≥ 60 %",
            rate >= 0.6 * bare,
        ),
        Row::judged(
            "mixed: GET of a job, idle median, p99; under load median, p99",
            format!(
                "{idle_times}; {} ({:.1} × idle)",
                times(&all.looks),
                p99 / idle
            ),
            "p99 ≤ 20 × idle",
            p99 <= 20.0 * idle,
        ),
        Row::plain("mixed: POST of a case, median, p99", times(&all.submits)),
        Row::plain(
            "mixed: requests, refusals by status",
            format!(
                "{} ({:.0}/s), {:?}",
                all.requests,
                all.requests as f64 / TIME.as_secs_f64(),
                all.refused
            ),
        ),
        Row::plain(
            "mixed: jobs accepted, lost, doubled, failed",
            format!("{}, 0, 0, 0", all.accepted.len()),
        ),
        memory("mixed: memory at 25, 50, 75, 100 % of the time", &samples),
    ]
}

/// Returns periodic samples of the resources that the service uses.
async fn usage_until(service: &Service, end: Instant) -> Vec<Usage> {
    let mut samples = Vec::new();
    while Instant::now() < end {
        tokio::time::sleep(SAMPLE).await;
        samples.push(service.usage());
    }
    samples
}

/// Returns the memory over time. It is flat if the mean of the last quarter exceeds that of the second by at most a tenth.
pub fn memory(what: &str, samples: &[Usage]) -> Row {
    let mean = |from: usize, to: usize| {
        let part = &samples[samples.len() * from / 8..(samples.len() * to / 8).max(1)];
        part.iter().map(|usage| usage.memory_mb).sum::<f64>() / part.len() as f64
    };
    let quarters = [mean(1, 2), mean(3, 4), mean(5, 6), mean(7, 8)];
    let flat = quarters[3] <= 1.1 * quarters[1] + 1.0;
    let text = quarters.map(|value| format!("{value:.0}")).join(", ");
    Row::judged(what, format!("{text} MB"), "flat", flat)
}

/// Returns the times of polls of an ended job on an idle service.
async fn idle_looks(service: &Service) -> Vec<f64> {
    let mut client = Client::new(&service.url);
    let job = client
        .submit(&meshed(usize::MAX >> 12, 8), Some("wait=10"))
        .await;
    assert_eq!(job["state"], "succeeded");
    let path = format!("/v1/jobs/{}", id_of(&job));
    let mut times = Vec::with_capacity(IDLE_LOOKS);
    for _ in 0..IDLE_LOOKS {
        times.push(client.get(&path).await.1);
    }
    times
}

async fn client(url: String, number: usize, size: u32, end: Instant) -> Record {
    let mut client = Client::new(&url);
    let mut record = Record::default();
    for round in 0.. {
        if Instant::now() >= end {
            break;
        }
        let case = meshed(1 + round * CLIENTS + number, size);
        // Every eighth job is waited for instead of polled.
        let prefer = (round % 8 == 7).then_some("wait=30");
        let start = Instant::now();
        let job = client.submit(&case, prefer).await;
        record.requests += 1;
        if prefer.is_none() {
            record.submits.push(start.elapsed().as_secs_f64());
        }
        let id = id_of(&job);
        record.accepted.push(id.clone());
        let mut state = job["state"].clone();
        while state != "succeeded" {
            assert!(state == "queued" || state == "running", "{id} is {state}");
            tokio::time::sleep(PAUSE).await;
            let (bytes, seconds) = client.get(&format!("/v1/jobs/{id}")).await;
            record.requests += 1;
            record.looks.push(seconds);
            state = serde_json::from_slice::<Value>(&bytes).expect("JSON")["state"].clone();
        }
        fetch(&mut client, &mut record, &id, round).await;
        record.done += usize::from(Instant::now() < end);
    }
    record.refused = client.refused;
    record
}

/// Fetches a part of the result. The round selects the part.
async fn fetch(client: &mut Client, record: &mut Record, id: &str, round: usize) {
    let result = client.json(&format!("/v1/jobs/{id}/result")).await;
    assert!(result["total"][0]["force_x_n"].is_number(), "{result}");
    record.requests += 1;
    let more = match round % 4 {
        0 => format!("/v1/jobs/{id}/resultants?format=csv"),
        1 => format!("/v1/jobs/{id}/zones"),
        2 => "/v1/jobs?state=succeeded&limit=20".to_owned(),
        _ => return,
    };
    client.get(&more).await;
    record.requests += 1;
}

/// Checks that all accepted jobs and the job of the idle polls, and no others, have succeeded at the first attempt.
async fn verify(service: &Service, accepted: &[String]) {
    let mut client = Client::new(&service.url);
    let mut seen = BTreeMap::new();
    let mut cursor = String::new();
    loop {
        let page = client.json(&format!("/v1/jobs?limit={PAGE}{cursor}")).await;
        for job in page["jobs"].as_array().expect("jobs") {
            let before = seen.insert(id_of(job), (job["state"].clone(), job["attempt"].clone()));
            assert_eq!(before, None, "listed twice");
        }
        let Some(next) = page["next_cursor"].as_str() else {
            break;
        };
        cursor = format!("&cursor={next}");
    }
    assert_eq!(
        seen.len(),
        accepted.len() + 1,
        "as many jobs as were accepted"
    );
    for id in accepted {
        let (state, attempt) = &seen[id];
        assert_eq!((state, attempt), (&"succeeded".into(), &1.into()), "{id}");
    }
    let ended = client
        .metric("railhead_jobs_ended_total{state=\"succeeded\"}")
        .await;
    assert_eq!(ended, seen.len() as f64, "each ended once");
}
