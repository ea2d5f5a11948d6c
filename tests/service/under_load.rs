//! Tests that no work is lost or duplicated when the process is killed or stopped while clients send many requests.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use reqwest::{Client, Method};
use serde_json::{Value, json};

use crate::malformed::Chance;
use crate::support::{Service, case};

const KILLS: usize = 8;
const STOPS: usize = 3;
const CLIENTS: usize = 4;
/// The maximal number of cases that a client submits between two kills.
const CASES_PER_ROUND: usize = 25;
/// The number of cases of the batch in every third round.
const BATCH: usize = 30;
const FLAGS: [&str; 4] = ["--workers", "2", "--shutdown-grace-s", "0"];

/// Returns a case that differs from all others of the test. Every tenth case is larger.
fn distinct(number: usize) -> Value {
    let mut case = case(&format!("case {number}"));
    case["load"]["normal_force_n"] = json!(20_000 + number);
    let mesh = if number.is_multiple_of(10) { 14 } else { 6 };
    case["solver"]["mesh"] = json!({ "strips": mesh, "cells": mesh });
    case
}

/// The state of a client: the id answered for each idempotency key, and the keys without an answer.
#[derive(Default)]
struct Known {
    answered: BTreeMap<String, String>,
    open: Vec<(String, usize)>,
}

/// Submits once with an idempotency key. Returns the id, or `None` if there is no answer or status 503.
async fn submit(client: &Client, url: &str, path: &str, key: &str, body: &Value) -> Option<String> {
    let request = client.request(Method::POST, format!("{url}{path}"));
    let request = request.header("idempotency-key", key).json(body);
    let answer = request.send().await.ok()?;
    let status = answer.status().as_u16();
    if status == 503 {
        return None;
    }
    assert!(
        status == 202 || status == 200,
        "{status}: {}",
        answer.text().await.unwrap()
    );
    let answer: Value = answer.json().await.ok()?;
    Some(answer["id"].as_str().unwrap().to_owned())
}

/// Runs one client between two kills. It first repeats unanswered submissions and then sends new cases.
async fn flood(
    mut known: Known,
    url: String,
    name: String,
    first: usize,
    stop: Arc<AtomicBool>,
) -> Known {
    let client = Client::new();
    let new = (0..CASES_PER_ROUND).map(|number| (format!("{name}-{number}"), first + number));
    let todo: Vec<_> = std::mem::take(&mut known.open)
        .into_iter()
        .chain(new)
        .collect();
    for (key, number) in todo {
        if stop.load(Ordering::SeqCst) {
            // A key that was never sent needs no answer.
            break;
        }
        match submit(&client, &url, "/v1/jobs", &key, &distinct(number)).await {
            Some(id) => {
                let before = known.answered.insert(key, id.clone());
                assert!(before.is_none_or(|before| before == id));
            }
            None => known.open.push((key, number)),
        }
    }
    known
}

/// The keys and batches known after a service was killed under load, and the jobs that had succeeded by then.
struct Flooded {
    clients: Vec<Known>,
    batches: BTreeMap<String, Option<String>>,
    succeeded: BTreeMap<String, Value>,
}

/// Starts a service on this folder several times, and ends it each time while clients send requests.
async fn ended_in_floods(folder: &Path, times: usize, end: impl Fn(Service)) -> Flooded {
    let mut random = Chance(7);
    let mut clients: Vec<Known> = (0..CLIENTS).map(|_| Known::default()).collect();
    let (mut batches, mut succeeded) = (BTreeMap::new(), BTreeMap::new());
    for round in 0..times {
        let service = Service::start(folder, &FLAGS);
        let url = format!("http://{}", service.address());
        let stop = Arc::new(AtomicBool::new(false));
        let floods: Vec<_> = clients
            .drain(..)
            .enumerate()
            .map(|(number, known)| {
                let name = format!("{round}-{number}");
                let first = (round * CLIENTS + number) * CASES_PER_ROUND;
                tokio::spawn(flood(known, url.clone(), name, first, stop.clone()))
            })
            .collect();
        let batch = (round % 3 == 0).then(|| {
            let cases: Vec<Value> = (0..BATCH)
                .map(|case| distinct(1_000_000 + round * BATCH + case))
                .collect();
            let (url, key) = (url.clone(), format!("batch-{round}"));
            tokio::spawn(async move {
                let id = submit(&Client::new(), &url, "/v1/batches", &key, &json!(cases)).await;
                (key, id)
            })
        });
        tokio::time::sleep(Duration::from_millis(30 + random.below(500) as u64)).await;
        succeeded.extend(all_jobs(&service, "&state=succeeded").await);
        end(service);
        stop.store(true, Ordering::SeqCst);
        for flood in floods {
            clients.push(flood.await.unwrap());
        }
        if let Some(batch) = batch {
            batches.extend([batch.await.unwrap()]);
        }
    }
    Flooded {
        clients,
        batches,
        succeeded,
    }
}

/// Returns every job that a query finds, by id.
async fn all_jobs(service: &Service, query: &str) -> BTreeMap<String, Value> {
    let (mut jobs, mut cursor) = (BTreeMap::new(), String::new());
    loop {
        let path = format!("/v1/jobs?limit=1000{query}{cursor}");
        let page = service.get(&path).await;
        for job in page["jobs"].as_array().unwrap() {
            let id = job["id"].as_str().unwrap().to_owned();
            assert_eq!(jobs.insert(id, job.clone()), None, "listed twice");
        }
        match page["next_cursor"].as_str() {
            Some(next) => cursor = format!("&cursor={next}"),
            None => return jobs,
        }
    }
}

/// Asserts that a new service answers the open submissions, and that every accepted case has one job, which succeeds.
async fn assert_all_is_there(folder: &Path, flooded: Flooded) {
    let Flooded {
        clients, batches, ..
    } = flooded;
    let service = Service::start(folder, &FLAGS);
    let url = format!("http://{}", service.address());
    let stop = Arc::new(AtomicBool::new(false));
    let mut singles = BTreeSet::new();
    let mut keys = 0;
    for (number, known) in clients.into_iter().enumerate() {
        let name = format!("last-{number}");
        let known = flood(
            known,
            url.clone(),
            name,
            2_000_000 + number * CASES_PER_ROUND,
            stop.clone(),
        )
        .await;
        assert_eq!(known.open, [], "everything is answered in the end");
        keys += known.answered.len();
        singles.extend(known.answered.into_values());
    }
    assert_eq!(singles.len(), keys, "each key has a job of its own");
    assert!(
        keys > CLIENTS * CASES_PER_ROUND,
        "the flood was more than its last part"
    );
    while service
        .get("/v1/jobs?limit=1&state=queued&state=running")
        .await["jobs"]
        != json!([])
    {
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    let jobs = all_jobs(&service, "").await;
    for (id, before) in flooded.succeeded {
        assert_eq!(jobs[&id], before, "what had succeeded is not touched again");
    }
    let unsuccessful: Vec<_> = jobs
        .values()
        .filter(|job| job["state"] != "succeeded")
        .collect();
    assert_eq!(unsuccessful, Vec::<&Value>::new());
    let (of_batches, alone): (BTreeMap<_, _>, BTreeMap<_, _>) = jobs
        .into_iter()
        .partition(|(_, job)| job["batch_id"].is_string());
    let alone: BTreeSet<String> = alone.into_keys().collect();
    assert_eq!(alone, singles, "no job is lost and none is there twice");
    let mut in_batch: BTreeMap<&str, usize> = BTreeMap::new();
    for job in of_batches.values() {
        *in_batch
            .entry(job["batch_id"].as_str().unwrap())
            .or_default() += 1;
    }
    for id in batches.values().flatten() {
        // An acknowledged batch must not be missing.
        let lines = service.ask(&format!("/v1/batches/{id}/results")).await;
        for (index, line) in lines.is(200).lines().iter().enumerate() {
            assert_eq!(
                (&line["index"], &line["state"]),
                (&json!(index), &json!("succeeded"))
            );
        }
        assert!(in_batch.contains_key(id.as_str()), "{id}");
    }
    assert!(
        in_batch.values().all(|jobs| *jobs == BATCH),
        "batches are there whole: {in_batch:?}"
    );
    for id in singles.iter().step_by(97) {
        let result = service.get(&format!("/v1/jobs/{id}/result")).await;
        assert!(result["total"][0]["force_x_n"].is_number(), "{result}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn kills_lose_nothing_and_double_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let flooded = ended_in_floods(folder.path(), KILLS, Service::kill).await;
    assert_all_is_there(folder.path(), flooded).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn stopping_under_load_ends_well_and_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let stop = |service: Service| {
        service.signal("TERM");
        assert_eq!(service.wait().code(), Some(0));
    };
    let flooded = ended_in_floods(folder.path(), STOPS, stop).await;
    assert_all_is_there(folder.path(), flooded).await;
}
