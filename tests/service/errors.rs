//! Every way to fail: the right status, the right problem, and words that help.

use std::collections::BTreeSet;
use std::sync::Mutex;
use std::sync::mpsc::channel;
use std::time::Duration;

use railhead::contact::case::Method as SolverMethod;
use railhead::contact::error::SolveError;
use reqwest::Method;
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use crate::server::{Answer, Server, Setup, example, example_text};

/// Checks a failure: status, type, and a word that its detail must have.
fn assert_problem(answer: &Answer, status: u16, kind: &str, word: &str) {
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
async fn malformed_json_is_answered_with_its_position() {
    let server = Server::idle().await;
    let deep = "[".repeat(10_000);
    for (body, line, word) in [
        ("", 1, "EOF"),
        ("{\n  \"name\": \"x\",\n}", 3, "trailing comma"),
        ("{\"friction\": NaN}", 1, "expected value"),
        (
            "{\"friction\": {\"coefficient\": 1e999}}",
            1,
            "out of range",
        ),
        ("{\n\"name\": \"a\",\n\"name\": \"b\"}", 3, "written twice"),
        (deep.as_str(), 1, "recursion limit"),
    ] {
        for path in ["/v1/jobs", "/v1/cases/check"] {
            let raw = |request: reqwest::RequestBuilder| {
                request
                    .header("content-type", "application/json")
                    .body(body.to_owned())
            };
            let answer = server.send(Method::POST, path, raw).await;
            assert_problem(&answer, 400, "malformed-json", word);
            assert_eq!(answer.json["line"], line, "{}", answer.text);
            assert!(answer.json["column"].is_u64(), "{}", answer.text);
        }
    }
}

#[tokio::test]
async fn body_must_be_declared_as_json() {
    let server = Server::idle().await;
    let case = example_text("spin.case.json");
    for content_type in [
        None,
        Some("text/plain"),
        Some("application/x-www-form-urlencoded"),
        Some("jsonapplication/"),
    ] {
        let answer = server
            .send(Method::POST, "/v1/jobs", |request| {
                let request = request.body(case.clone());
                content_type.map_or(request.try_clone().expect("a request"), |name| {
                    request.header("content-type", name)
                })
            })
            .await;
        assert_problem(&answer, 415, "unsupported-media-type", "application/json");
    }
    let charset = |request: reqwest::RequestBuilder| {
        request
            .header("content-type", "Application/JSON; charset=utf-8")
            .body(case.clone())
    };
    assert_eq!(
        server.send(Method::POST, "/v1/jobs", charset).await.status,
        202
    );
}

#[tokio::test]
async fn body_size_is_limited_exactly() {
    let case = example_text("spin.case.json");
    let mut setup = Setup::new();
    setup.working = false;
    setup.http.body_max_bytes = case.len();
    let server = setup.start().await;
    let send = |body: String| {
        server.send(Method::POST, "/v1/jobs", |request| {
            request
                .header("content-type", "application/json")
                .body(body)
        })
    };
    assert_eq!(send(case.clone()).await.status, 202);
    assert_problem(
        &send(format!("{case} ")).await,
        413,
        "body-too-large",
        &case.len().to_string(),
    );
}

/// Writes raw bytes to the service and reads the whole answer.
async fn raw(server: &Server, request: &str) -> String {
    let mut stream = tokio::net::TcpStream::connect(server.address)
        .await
        .expect("a connection");
    stream
        .write_all(request.as_bytes())
        .await
        .expect("the request is written");
    let mut answer = Vec::new();
    stream
        .read_to_end(&mut answer)
        .await
        .expect("the answer is read");
    String::from_utf8_lossy(&answer).into_owned()
}

const RAW_HEAD: &str =
    "POST /v1/jobs HTTP/1.1\r\nHost: x\r\nConnection: close\r\nContent-Type: application/json\r\n";

#[tokio::test]
async fn body_of_unknown_length_is_limited_too() {
    let mut setup = Setup::new();
    setup.http.body_max_bytes = 100;
    let server = setup.start().await;
    let chunk = format!("c8\r\n{}\r\n0\r\n\r\n", " ".repeat(200));
    let answer = raw(
        &server,
        &format!("{RAW_HEAD}Transfer-Encoding: chunked\r\n\r\n{chunk}"),
    )
    .await;
    assert!(
        answer.starts_with("HTTP/1.1 413") && answer.contains("/problems/body-too-large"),
        "{answer}"
    );
}

#[tokio::test]
async fn body_that_never_comes_is_given_up() {
    let mut setup = Setup::new();
    setup.http.body_timeout = Duration::from_millis(20);
    let server = setup.start().await;
    let answer = raw(&server, &format!("{RAW_HEAD}Content-Length: 10\r\n\r\n{{")).await;
    assert!(
        answer.starts_with("HTTP/1.1 408") && answer.contains("/problems/body-timeout"),
        "{answer}"
    );
}

#[tokio::test]
async fn body_that_breaks_is_refused() {
    let server = Server::idle().await;
    let answer = raw(
        &server,
        &format!("{RAW_HEAD}Transfer-Encoding: chunked\r\n\r\nno chunk\r\n"),
    )
    .await;
    assert!(
        answer.starts_with("HTTP/1.1 400") && answer.contains("/problems/unreadable-body"),
        "{answer}"
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
async fn answers_that_exclude_json_are_refused() {
    let server = Server::idle().await;
    for path in ["/v1/jobs", "/v1/methods", "/v1/jobs/x/result"] {
        let answer = server
            .send(Method::GET, path, |request| {
                request.header("accept", "text/csv")
            })
            .await;
        assert_problem(&answer, 406, "not-acceptable", "text/csv");
    }
    let browser = "text/html,application/xhtml+xml,*/*;q=0.8";
    assert_eq!(
        server
            .send(Method::GET, "/v1/jobs", |request| request
                .header("accept", browser))
            .await
            .status,
        200
    );
}

#[tokio::test]
async fn bad_query_names_every_parameter_with_its_value() {
    let server = Server::idle().await;
    let answer = server.get("/v1/jobs?limit=0&state=done&label=x&created_after=yesterday&colour=red&cursor=a&cursor=b").await;
    assert_problem(&answer, 400, "bad-query", "1 to 1000");
    let errors = answer.json["errors"].as_array().expect("errors");
    let named: BTreeSet<&str> = errors
        .iter()
        .filter_map(|error| error["parameter"].as_str())
        .collect();
    assert_eq!(
        named,
        BTreeSet::from([
            "limit",
            "state",
            "label",
            "created_after",
            "colour",
            "cursor"
        ]),
        "{}",
        answer.text
    );
    let state = errors
        .iter()
        .find(|error| error["parameter"] == "state")
        .expect("the fault of `state`");
    let detail = state["detail"].as_str().expect("a detail");
    assert!(
        detail.contains("`done`")
            && detail.contains("queued, running, succeeded, failed, cancelled"),
        "{detail}"
    );
    assert_problem(
        &server.get("/v1/jobs?limit=1001").await,
        400,
        "bad-query",
        "1001",
    );
    assert_problem(
        &server.get("/v1/jobs?cursor=unheard-of").await,
        400,
        "bad-query",
        "cursor",
    );
    assert_eq!(
        server.get("/v1/jobs?limit=1000.0").await.status,
        200,
        "an integral float is a whole number"
    );
    let path = server.submit(&example("spin.case.json")).await;
    for query in [
        "grid=1x5",
        "grid=5",
        "grid=5x1001",
        "grid=-5x5",
        "point=-1",
        "patch=0.5",
        "points=1",
    ] {
        let name = query.split('=').next().expect("a name");
        assert_problem(
            &server.get(&format!("{path}/tractions?{query}")).await,
            400,
            "bad-query",
            name,
        );
    }
}

#[tokio::test]
async fn bad_idempotency_keys_are_refused() {
    let server = Server::idle().await;
    let send = |key: String| {
        server.send(Method::POST, "/v1/jobs", |request| {
            request
                .header("idempotency-key", key)
                .json(&example("spin.case.json"))
        })
    };
    assert_problem(&send("x".repeat(256)).await, 400, "bad-header", "255");
    assert_problem(&send(String::new()).await, 400, "bad-header", "255");
    assert_eq!(send("x".repeat(255)).await.status, 202);
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
    let setup = Setup::new().solving(|problem, _| match problem.name.as_deref() {
        Some("no convergence") => Err(SolveError::NotConverged {
            method: SolverMethod::LiuHsu,
            point: 0,
            iterations: 40,
            residual: 3.5e-4,
            tolerance: 1e-8,
            advice: "try `boundary_element`".to_owned(),
        }),
        Some("out of time") => Err(SolveError::OutOfTime),
        _ => panic!("a defect of the solver"),
    });
    let server = setup.start().await;
    let mut case = example("spin.case.json");
    for (name, status, kind) in [
        ("no convergence", 422, "not-converged"),
        ("out of time", 422, "out-of-time"),
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
    // Every kind is provoked by a test of this file; `internal` by a unit test of the panic handler, and `not-ready`
    // needs a job table that stops answering.
    let here = include_str!("errors.rs");
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
