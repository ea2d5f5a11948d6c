//! Tests that `/metrics` counts events with a bounded number of labels.

use std::collections::{BTreeMap, BTreeSet};

use railhead::contact::monitor::Stop;
use reqwest::Method;
use serde_json::Value;

use crate::server::{Server, Setup, example};
use crate::support::case;

/// Returns the samples of `/metrics`: name with labels, and value.
pub async fn samples(server: &Server) -> BTreeMap<String, f64> {
    let answer = server.get("/metrics").await.is(200);
    let kind = answer.header("content-type").unwrap_or_default();
    assert!(kind.starts_with("application/openmetrics-text"), "{kind}");
    assert!(answer.text.ends_with("# EOF\n"), "the end is marked");
    let lines = answer.text.lines().filter(|line| !line.starts_with('#'));
    lines
        .map(|line| {
            let (name, value) = line.rsplit_once(' ').expect("a sample");
            (name.to_owned(), value.parse().expect("a number"))
        })
        .collect()
}

fn value(samples: &BTreeMap<String, f64>, name: &str) -> f64 {
    *samples
        .get(name)
        .unwrap_or_else(|| panic!("no {name} in {samples:#?}"))
}

#[tokio::test]
async fn what_jobs_did_is_counted() {
    let server = Server::start().await;
    let before = samples(&server).await;
    assert_eq!(
        value(&before, r#"railhead_jobs_ended_total{state="failed"}"#),
        0.0,
        "series are there before their first event"
    );
    let job = server.solve(&case("one")).await;
    let patches = job["result"]["patches"].as_array().expect("patches");
    let points: Vec<&Value> = patches
        .iter()
        .flat_map(|patch| patch["points"].as_array().expect("points"))
        .collect();
    let after = samples(&server).await;
    let method = r#"{method="boundary_element"}"#;
    for (name, expected) in [
        (
            r#"railhead_jobs_ended_total{state="succeeded"}"#.to_owned(),
            1.0,
        ),
        (r#"railhead_jobs{state="succeeded"}"#.to_owned(), 1.0),
        (r#"railhead_jobs{state="queued"}"#.to_owned(), 0.0),
        (format!("railhead_solve_seconds_count{method}"), 1.0),
        (
            format!("railhead_newton_iterations_sum{method}"),
            points
                .iter()
                .map(|point| point["solver"]["iterations"].as_f64().unwrap())
                .sum(),
        ),
        ("railhead_queue_oldest_age_seconds".to_owned(), 0.0),
    ] {
        assert_eq!(value(&after, &name), expected, "{name}");
    }
    assert!(value(&after, &format!("railhead_solve_seconds_sum{method}")) > 0.0);
    assert!(value(&after, "railhead_database_bytes") > 4096.0);
}

#[tokio::test]
async fn waiting_failed_cancelled_and_large_jobs_are_seen() {
    let mut setup = Setup::new().solving(|_, _| Err(Stop::OutOfTime.into()));
    setup.working = false;
    let server = setup.start().await;
    let path = server.submit(&case("waits")).await;
    let other = server.submit(&case("is cancelled")).await;
    tokio::time::sleep(std::time::Duration::from_millis(2)).await;
    let waiting = samples(&server).await;
    assert_eq!(value(&waiting, r#"railhead_jobs{state="queued"}"#), 2.0);
    assert!(value(&waiting, "railhead_queue_oldest_age_seconds") > 0.0);
    assert!(value(&waiting, "railhead_queue_cost_seconds") > 0.0);

    for _ in 0..2 {
        server.cancel(&other).await;
    }
    server.jobs.start().expect("workers start");
    let id = path.rsplit('/').next().unwrap().parse().unwrap();
    let minute = std::time::Duration::from_secs(60);
    server.jobs.wait(id, minute).await.expect("the job ends");
    let after = samples(&server).await;
    for (name, expected) in [
        (r#"railhead_jobs_ended_total{state="cancelled"}"#, 1.0),
        (r#"railhead_jobs_ended_total{state="failed"}"#, 1.0),
        (r#"railhead_job_failures_total{reason="out_of_time"}"#, 1.0),
        (r#"railhead_job_failures_total{reason="panic"}"#, 0.0),
        ("railhead_result_bytes", 0.0),
    ] {
        assert_eq!(value(&after, name), expected, "{name}");
    }
}

#[tokio::test]
async fn results_outside_the_table_are_weighed_until_they_are_deleted() {
    let server = Server::with(|setup| setup.options.small_result_max_bytes = 0).await;
    let job = server.solve(&case("one")).await;
    let stored = value(&samples(&server).await, "railhead_result_bytes");
    assert!(stored > 1000.0, "{stored}");
    let path = format!("/v1/jobs/{}", job["id"].as_str().unwrap());
    assert_eq!(server.delete(&path).await.status, 204);
    assert_eq!(value(&samples(&server).await, "railhead_result_bytes"), 0.0);
}

#[tokio::test]
async fn addresses_and_methods_that_clients_make_up_do_not_become_labels() {
    let server = Server::idle().await;
    let path = server.submit(&example("spin.case.json")).await;
    server.get(&path).await;
    let get = samples(&server).await;
    let counted =
        r#"railhead_http_requests_total{method="GET",route="/v1/jobs/{id}",status="200"}"#;
    assert_eq!(value(&get, counted), 1.0);
    let timed = r#"railhead_http_request_seconds_count{method="GET",route="/v1/jobs/{id}"}"#;
    assert_eq!(value(&get, timed), 1.0);
    for number in 0..50 {
        server.get(&format!("/nothing/{number}")).await;
        let method = Method::from_bytes(format!("M{number}").as_bytes()).unwrap();
        server.send(method, "/v1/jobs", |request| request).await;
    }
    let after = samples(&server).await;
    let names = |samples: &BTreeMap<String, f64>| -> BTreeSet<String> {
        let names = samples.keys().filter(|name| name.contains("_requests_"));
        names.cloned().collect()
    };
    let new: Vec<String> = names(&after).difference(&names(&get)).cloned().collect();
    assert!(new.len() <= 3, "{new:?}");
    assert!(after.keys().all(|name| name.starts_with("railhead_")));
}
