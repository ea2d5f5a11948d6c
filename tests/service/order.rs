//! Tests priorities, deadlines and clock jumps: the order in which jobs are solved, and which jobs are late.

use std::time::Duration;

use railhead::contact;
use railhead::jobs::State;
use serde_json::{Value, json};

use crate::batches::small;
use crate::errors::assert_problem;
use crate::server::{Server, Setup, link};
use crate::support::{DAY_MS, Turned, case, tick_forever};

async fn submit(server: &Server, query: &str, case: &Value) -> Value {
    let answer = server.post(&format!("/v1/jobs{query}"), case).await.is(202);
    answer.json
}

async fn until(server: &Server, job: &Value, state: &str) -> Value {
    server.until(link(job, "self"), state).await
}

#[tokio::test]
async fn late_jobs_fail_whether_queued_or_running_and_others_do_not() {
    let mut setup = Setup::new().solving(|checked, monitor| match checked.label.name.as_deref() {
        Some("endless") => Err(tick_forever(monitor)),
        _ => contact::solve(checked, monitor),
    });
    let turned = Turned::default();
    setup.options.clock = turned.clock();
    // The lease is so long that the clock jump does not expire it.
    setup.options.lease = Duration::from_secs(3600);
    let server = setup.start().await;
    let running = submit(&server, "?deadline_s=60", &case("endless")).await;
    assert!(running["deadline_at"].is_string(), "{running}");
    until(&server, &running, "running").await;
    let queued = submit(&server, "?deadline_s=60&priority=high", &small("late")).await;
    let patient = submit(&server, "", &small("has time")).await;
    assert_eq!(queued["priority"], "high");
    assert_eq!(patient["priority"], "normal");
    assert_eq!(patient["deadline_at"], Value::Null);
    turned.set(61_000);
    for job in [&queued, &running] {
        let job = until(&server, job, "failed").await;
        assert_eq!(job["error"]["type"], "/problems/deadline-passed", "{job}");
    }
    until(&server, &patient, "succeeded").await;
    let metrics = server.get("/metrics").await.text;
    assert!(
        metrics.contains("railhead_job_failures_total{reason=\"deadline_passed\"} 2\n"),
        "{metrics}"
    );
}

#[tokio::test]
async fn wishes_hold_for_every_job_of_a_batch_and_bad_ones_are_refused() {
    let server = Server::idle().await;
    let cases = json!([small("a"), small("b")]);
    let batch = server
        .post("/v1/batches?priority=low&deadline_s=3600", &cases)
        .await
        .json;
    let jobs = server.read(link(&batch, "jobs")).await;
    let jobs = jobs["jobs"].as_array().expect("jobs");
    assert_eq!(jobs.len(), 2);
    for job in jobs {
        assert_eq!(job["priority"], "low");
        assert!(job["deadline_at"].is_string(), "{job}");
    }
    for path in ["/v1/jobs", "/v1/batches"] {
        for query in [
            "priority=urgent",
            "deadline_s=0",
            "deadline_s=2592001",
            "deadline_s=soon",
            "prio=high",
        ] {
            let answer = server.post(&format!("{path}?{query}"), &cases).await;
            let name = query.split('=').next().expect("a name");
            assert_problem(&answer, 400, "bad-query", name);
        }
    }
}

#[tokio::test]
async fn a_clock_that_jumps_loses_no_job() {
    let mut setup = Setup::new();
    let turned = Turned::default();
    setup.options.clock = turned.clock();
    setup.options.workers = 2;
    setup.options.cache = false;
    let server = setup.start().await;
    let mut jobs = Vec::new();
    for jump in [400 * DAY_MS, -400 * DAY_MS, 0] {
        let cases: Vec<Value> = (0..200)
            .map(|number| small(&format!("{jump} {number}")))
            .collect();
        let batch = server.post("/v1/batches", &json!(cases)).await.json;
        jobs.push(link(&batch, "results").to_owned());
        turned.set(jump);
        let job = server.solve(&case("single")).await;
        assert_eq!(job["state"], "succeeded", "{job}");
    }
    for results in jobs {
        let text = server.get(&format!("{results}?wait=60")).await.text;
        let succeeded = text
            .lines()
            .filter(|line| line.contains(State::Succeeded.name()));
        assert_eq!((text.lines().count(), succeeded.count()), (200, 200));
    }
}
