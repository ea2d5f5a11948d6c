//! Tests conventions of the API: parameters, final line breaks, readable limits, formats for older tools.

use reqwest::Method;
use serde_json::json;

use crate::batches::small;
use crate::errors::assert_problem;
use crate::results::path_of;
use crate::server::{Server, Setup};

#[tokio::test]
async fn parameters_that_nobody_knows_are_refused_everywhere() {
    let server = Server::start().await;
    let job = path_of(&server.solve(&small("one")).await);
    let sent = server.post("/v1/batches", &json!([small("two")])).await;
    let batch = sent.location();
    let gets = [
        job.clone(),
        format!("{job}/case"),
        format!("{job}/result"),
        format!("{job}/resultants"),
        format!("{job}/events"),
        batch.clone(),
        format!("{batch}/results"),
        "/v1/jobs".to_owned(),
        "/v1/methods".to_owned(),
        "/v1/remarks".to_owned(),
        "/problems".to_owned(),
    ];
    for path in gets {
        let answer = server.get(&format!("{path}?colour=red")).await;
        assert_problem(&answer, 400, "bad-query", "");
        assert!(answer.text.contains("colour"), "{path}: {}", answer.text);
    }
    for path in [format!("{job}/cancel"), format!("{batch}/cancel")] {
        let answer = server
            .send(Method::POST, &format!("{path}?colour=red"), |request| {
                request
            })
            .await;
        assert_problem(&answer, 400, "bad-query", "");
    }
    for path in ["/v1/cases/check", "/v1/jobs", "/v1/batches"] {
        let answer = server
            .post(&format!("{path}?colour=red"), &small("x"))
            .await;
        assert_problem(&answer, 400, "bad-query", "");
    }
    let kept = server.delete(&format!("{job}?colour=red")).await;
    assert_problem(&kept, 400, "bad-query", "");
    assert_eq!(server.get(&format!("{job}?format=json")).await.status, 200);
}

#[tokio::test]
async fn json_ends_with_a_newline_and_says_its_length() {
    let server = Server::start().await;
    let job = path_of(&server.solve(&small("one")).await);
    for path in [
        &*job,
        &format!("{job}/result"),
        "/v1/methods",
        "/v1/nothing",
    ] {
        let answer = server.get(path).await;
        assert!(answer.text.ends_with("}\n"), "{path}: {:?}", answer.text);
        assert!(!answer.text.ends_with("\n\n"), "{path}");
        let length = answer.header("content-length").expect("a length");
        assert_eq!(length, answer.bytes.len().to_string(), "{path}");
        let head = server.send(Method::HEAD, path, |request| request).await;
        assert_eq!(head.header("content-length"), Some(length), "{path}");
    }
    let csv = server.get(&format!("{job}/resultants?format=csv")).await;
    assert!(csv.text.ends_with('\n') && !csv.text.ends_with("\n\n"));
}

#[tokio::test]
async fn the_limits_of_a_service_can_be_asked_for() {
    let mut setup = Setup::new();
    setup.options.limits.motions_max = 77;
    setup.options.tenant_queue_max = 55;
    setup.http.batch_max_cases = 66;
    setup.http.grid_max_samples = 4444;
    let server = setup.start().await;
    let limits = server.read("/v1/methods").await["limits"].clone();
    for (name, value) in [
        ("motions_max", json!(77)),
        ("queue_max", json!(55)),
        ("batch_max_cases", json!(66)),
        ("grid_max_samples", json!(4444)),
        ("time_limit_max_seconds", json!(86_400.0)),
        ("memory_max_bytes", json!(2_u64 << 30)),
    ] {
        assert_eq!(limits[name], value, "{name}: {limits}");
    }
}

#[tokio::test]
async fn figures_come_in_the_form_that_is_accepted() {
    let server = Server::start().await;
    server.solve(&small("one")).await;
    let get = async |accept: &'static str| server.get_with("/metrics", "accept", accept).await;
    let new = get("application/openmetrics-text;version=1.0.0,text/plain;q=0.5").await;
    assert!(new.text.ends_with("# EOF\n"));
    let old = get("text/plain").await;
    let form = old.header("content-type").expect("a form");
    assert!(form.starts_with("text/plain; version=0.0.4"), "{form}");
    assert!(!old.text.contains("# EOF") && !old.text.contains(" info\n"));
    let typed = "# TYPE railhead_jobs_ended_total counter\nrailhead_jobs_ended_total{";
    assert!(old.text.contains(typed), "{}", old.text);
    let value = |name: &str| -> f64 {
        let line = old.text.lines().find_map(|line| line.strip_prefix(name));
        line.expect("a sample").trim().parse().expect("a number")
    };
    assert_eq!(value("railhead_workers "), 1.0);
    assert_eq!(value("railhead_workers_busy "), 0.0);
    assert!(value("railhead_process_start_time_seconds ") > 1.7e9);
}
