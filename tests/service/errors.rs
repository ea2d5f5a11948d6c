//! Every way to fail: the right status, the right problem, and words that help.

use std::collections::BTreeSet;
use std::sync::Mutex;
use std::sync::mpsc::channel;
use std::time::Duration;

use railhead::contact::error::SolveError;
use railhead::contact::method::Method as SolverMethod;
use railhead::contact::monitor::Stop;
use reqwest::Method;
use serde_json::{Value, json};

use crate::server::{Answer, Server, Setup, example};

/// Checks a failure: status, type, and a word that its detail must have.
pub fn assert_problem(answer: &Answer, status: u16, kind: &str, word: &str) {
    assert_eq!(answer.status, status, "{}", answer.text);
    assert_eq!(
        answer.header("content-type"),
        Some("application/problem+json")
    );
    assert_eq!(
        answer.json["type"],
        format!("/problems/{kind}"),
        "{}",
        answer.text
    );
    assert_eq!(answer.json["status"], status);
    let detail = answer.json["detail"].as_str().expect("a detail");
    assert!(detail.contains(word), "`{word}` is not in: {detail}");
    assert!(answer.json["instance"].is_string(), "{}", answer.text);
}

#[tokio::test]
async fn faulty_case_is_answered_with_all_its_faults() {
    let server = Server::idle().await;
    let answer = server.post("/v1/jobs", &example("faulty.case.json")).await;
    assert_problem(&answer, 422, "faulty-case", "faults");
    assert_eq!(
        answer.json,
        example("faulty.problem.json"),
        "{:#}",
        answer.json
    );
    let checked = server
        .post("/v1/cases/check", &example("faulty.case.json"))
        .await;
    assert_eq!(
        checked.json["errors"], answer.json["errors"],
        "checking and submitting agree"
    );
    assert_eq!(
        server.get("/v1/jobs").await.json["jobs"],
        json!([]),
        "a faulty case makes no job"
    );
}

#[tokio::test]
async fn unknown_addresses_and_methods_are_problems() {
    let server = Server::idle().await;
    for path in [
        "/v2/jobs",
        "/v1",
        "/v1/jobs/",
        "/docs/nothing.js",
        "/problems/unheard-of",
    ] {
        assert_problem(&server.get(path).await, 404, "unknown-route", "");
    }
    let answer = server
        .send(Method::PUT, "/v1/jobs", |request| request)
        .await;
    assert_problem(&answer, 405, "method-not-allowed", "PUT");
    let allowed: BTreeSet<&str> = answer
        .header("allow")
        .expect("Allow")
        .split(',')
        .map(str::trim)
        .collect();
    assert!(
        allowed.contains("GET") && allowed.contains("POST"),
        "{allowed:?}"
    );
}

#[tokio::test]
async fn idempotency_key_of_another_case_is_refused() {
    let server = Server::idle().await;
    let send = |file: &str| {
        let case = example(file);
        server.send(Method::POST, "/v1/jobs", move |request| {
            request.header("idempotency-key", "k").json(&case)
        })
    };
    assert_eq!(send("spin.case.json").await.status, 202);
    assert_problem(
        &send("sweep.case.json").await,
        422,
        "idempotency-conflict",
        "different case",
    );
}

#[tokio::test]
async fn unknown_jobs_are_not_found_everywhere() {
    let server = Server::idle().await;
    for id in ["0198c0de-0000-7000-8000-000000000000", "not-an-id"] {
        let job = format!("/v1/jobs/{id}");
        assert_problem(&server.get(&job).await, 404, "job-not-found", "id");
        assert_problem(&server.delete(&job).await, 404, "job-not-found", "id");
        assert_problem(
            &server
                .send(Method::POST, &format!("{job}/cancel"), |request| request)
                .await,
            404,
            "job-not-found",
            "id",
        );
        for part in [
            "result",
            "resultants",
            "zones",
            "tractions",
            "pressure",
            "slip",
            "case",
        ] {
            assert_problem(
                &server.get(&format!("{job}/{part}")).await,
                404,
                "job-not-found",
                "id",
            );
        }
    }
}

#[tokio::test]
async fn result_asked_for_too_early_says_when_to_ask_again() {
    let server = Server::idle().await;
    let path = server.submit(&example("spin.case.json")).await;
    for part in [
        "result",
        "resultants",
        "zones",
        "tractions",
        "pressure",
        "slip",
    ] {
        let answer = server.get(&format!("{path}/{part}")).await;
        assert_problem(&answer, 409, "result-not-ready", "queued");
        assert_eq!(answer.header("retry-after"), Some("1"));
    }
    assert_problem(&server.delete(&path).await, 409, "job-not-ended", "cancel");
}

#[tokio::test]
async fn cancelled_job_has_no_result() {
    let server = Server::idle().await;
    let path = server.submit(&example("spin.case.json")).await;
    let answer = server
        .send(Method::POST, &format!("{path}/cancel"), |request| request)
        .await;
    assert_eq!(
        (answer.status, &answer.json["state"]),
        (200, &json!("cancelled"))
    );
    assert_problem(
        &server.get(&format!("{path}/result")).await,
        409,
        "job-cancelled",
        "cancelled",
    );
    assert_eq!(server.delete(&path).await.status, 204);
}

#[tokio::test]
async fn full_queue_refuses_and_stores_nothing() {
    let mut setup = Setup::new();
    setup.working = false;
    setup.options.queue_max = 2;
    let server = setup.start().await;
    let case = example("spin.case.json");
    server.submit(&case).await;
    let path = server.submit(&case).await;
    let answer = server.post("/v1/jobs", &case).await;
    assert_problem(&answer, 503, "queue-full", "2");
    assert_eq!(answer.header("retry-after"), Some("1"));
    assert_eq!(
        server.get("/v1/jobs").await.json["jobs"]
            .as_array()
            .map(Vec::len),
        Some(2)
    );
    server
        .send(Method::POST, &format!("{path}/cancel"), |request| request)
        .await;
    server.submit(&case).await;
}

#[tokio::test]
async fn draining_service_is_not_ready_and_takes_no_jobs() {
    let server = Server::start().await;
    assert_eq!(server.get("/readyz").await.status, 200);
    server.jobs.drain();
    assert_problem(
        &server.get("/readyz").await,
        503,
        "draining",
        "shutting down",
    );
    let answer = server.post("/v1/jobs", &example("spin.case.json")).await;
    assert_problem(&answer, 503, "draining", "shutting down");
    assert_eq!(answer.header("retry-after"), Some("1"));
    assert_eq!(
        server.get("/healthz").await.status,
        200,
        "a draining process is alive"
    );
}

#[tokio::test]
async fn failed_job_is_answered_with_its_reason_in_time() {
    let setup = Setup::new().solving(|checked, _| match checked.label.name.as_deref() {
        Some("no convergence") => Err(SolveError::NotConverged {
            method: SolverMethod::LiuHsu,
            point: 0,
            iterations: 40,
            residual: 3.5e-4,
            tolerance: 1e-8,
            advice: "try `boundary_element`".to_owned(),
        }),
        Some("out of time") => Err(Stop::OutOfTime.into()),
        Some("no strips") => Err(SolveError::Unmeshable {
            patch: 0,
            strips: 2,
        }),
        _ => panic!("a defect of the solver"),
    });
    let server = setup.start().await;
    let mut case = example("spin.case.json");
    for (name, status, kind) in [
        ("no convergence", 422, "not-converged"),
        ("out of time", 422, "out-of-time"),
        ("no strips", 422, "unsolvable"),
        ("defect", 500, "solver-panic"),
    ] {
        case["name"] = json!(name);
        let job = server.solve(&case).await;
        assert_eq!(job["state"], "failed", "{job:#}");
        let error = &job["error"];
        assert_eq!(error["type"], format!("/problems/{kind}"), "{job:#}");
        assert_eq!(error["status"], status);
        let path = job["links"]["self"].as_str().expect("a link");
        assert_eq!(error["instance"], path);
        assert!(job.get("result").is_none(), "{job:#}");
        let reason = error["detail"].as_str().expect("a detail");
        assert_problem(
            &server.get(&format!("{path}/result")).await,
            409,
            "job-failed",
            reason,
        );
        assert!(!reason.contains("a defect of the solver"), "{reason}");
        if kind == "not-converged" {
            assert_eq!(
                (&error["iterations"], &error["residual"]),
                (&json!(40), &json!(3.5e-4))
            );
            assert!(reason.contains("boundary_element"), "{reason}");
        }
    }
}

#[tokio::test]
async fn field_that_was_not_asked_for_says_what_was() {
    let server = Server::start().await;
    let job = server.solve(&example("hertz-steel.case.json")).await;
    let path = job["links"]["self"].as_str().expect("a link");
    for part in ["pressure", "slip"] {
        let answer = server.get(&format!("{path}/{part}")).await;
        assert_problem(
            &answer,
            404,
            "output-not-asked",
            "`resultants`, `zones`, `tractions`",
        );
        assert!(
            answer.json["detail"]
                .as_str()
                .is_some_and(|detail| detail.contains(&format!("`{part}`")))
        );
        assert!(
            job["result"]["links"].get(part).is_none(),
            "{part} is linked"
        );
    }
    assert_eq!(
        server
            .get(
                job["result"]["links"]["tractions"]
                    .as_str()
                    .expect("a link")
            )
            .await
            .status,
        200
    );
    let mut case = example("hertz-steel.case.json");
    case["outputs"] = json!(["resultants"]);
    let job = server.solve(&case).await;
    let path = job["links"]["self"].as_str().expect("a link");
    for part in ["zones", "tractions", "pressure", "slip"] {
        assert_problem(
            &server.get(&format!("{path}/{part}")).await,
            404,
            "output-not-asked",
            "`resultants`",
        );
    }
}

#[tokio::test]
async fn job_whose_workers_fall_silent_fails_as_lost() {
    let (release, held) = channel::<()>();
    let held = Mutex::new(held);
    let mut setup = Setup::new().solving(move |_, _| {
        // Never ticks, so the lease is not renewed; returns when the test is over.
        let _ = held.lock().expect("a lock").recv();
        Err(SolveError::Cancelled)
    });
    setup.options.lease = Duration::from_millis(90);
    setup.options.attempts_max = 1;
    let server = setup.start().await;
    let job = server.solve(&example("spin.case.json")).await;
    assert_eq!(job["error"]["type"], "/problems/worker-lost", "{job:#}");
    drop(release);
}

#[tokio::test]
async fn every_kind_of_problem_explains_itself() {
    let server = Server::idle().await;
    let kinds = server.get("/problems").await.json;
    let kinds = kinds.as_array().expect("a list");
    let mut seen = BTreeSet::new();
    for kind in kinds {
        let path = kind["type"].as_str().expect("a type");
        assert!(seen.insert(path.to_owned()), "{path} is there twice");
        assert_eq!(&server.get(path).await.json, kind);
    }
    // Every kind is provoked by a test here or in the files below; `internal` by a unit test of the panic handler, and `not-ready`
    // needs a job table that stops answering.
    let here = concat!(
        include_str!("batch_deletion.rs"),
        include_str!("batch_tables.rs"),
        include_str!("access.rs"),
        include_str!("batches.rs"),
        include_str!("caching.rs"),
        include_str!("crowds.rs"),
        include_str!("errors.rs"),
        include_str!("evaluate.rs"),
        include_str!("kept_profiles.rs"),
        include_str!("order.rs"),
        include_str!("cluster/database_away.rs"),
        include_str!("requests.rs"),
        include_str!("retention.rs"),
        include_str!("runs.rs"),
        include_str!("shares.rs"),
        include_str!("storage.rs"),
        include_str!("stored_bytes.rs")
    );
    let untested: Vec<&String> = seen
        .iter()
        .filter(|path| !["/problems/internal", "/problems/not-ready"].contains(&path.as_str()))
        .filter(|path| {
            !here.contains(&format!("\"{}\"", path.trim_start_matches("/problems/")))
                && !here.contains(&format!("{path}\""))
        })
        .collect();
    assert_eq!(untested, Vec::<&String>::new());
    let unknown: Value = server.get("/problems/unheard-of").await.json;
    assert_eq!(unknown["type"], "/problems/unknown-route");
}
