//! Tests problems of requests: status, type and advice.

use std::collections::BTreeSet;
use std::sync::Mutex;
use std::sync::mpsc::channel;
use std::time::Duration;

use railhead::contact::error::SolveError;
use railhead::contact::method::Method as SolverMethod;
use railhead::contact::monitor::Stop;
use reqwest::Method;
use serde_json::{Value, json};

use crate::runs::{columns, template};
use crate::server::{Answer, Server, Setup, count, example, link};
use crate::support::files_below;

/// Asserts status and type of a problem, and that its detail contains `word`.
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
    let keyed = async |file: &str| {
        let case = example(file);
        server
            .post_with("/v1/jobs", "idempotency-key", "k", &case)
            .await
    };
    let answer = keyed("faulty.case.json").await;
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
    let listed = server.read("/v1/jobs").await;
    assert_eq!(listed["jobs"], json!([]), "a faulty case makes no job");
    // A refused case does not use up its idempotency key, so that the corrected case can be sent with the same key.
    keyed("spin.case.json").await.is(202);
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

/// Returns the path of each kind of work, a valid body, and its problem types for unknown and for unfinished work.
fn kinds_of_work() -> [(&'static str, Value, [&'static str; 2]); 4] {
    let rows = json!({ "template": template("table"), "columns": columns(3) });
    let case = example("spin.case.json");
    let job = ["job-not-found", "job-not-ended"];
    [
        (
            "/v1/batches",
            json!([case]),
            ["batch-not-found", "batch-not-ended"],
        ),
        ("/v1/jobs", case, job),
        ("/v1/runs", rows, ["run-not-found", "run-not-ended"]),
        ("/v1/evolutions", crate::evolutions::request(1), job),
    ]
}

#[tokio::test]
async fn unknown_work_is_not_found_everywhere() {
    let server = Server::idle().await;
    for (path, _, [kind, _]) in kinds_of_work() {
        for id in ["0198c0de-0000-7000-8000-000000000000", "not-an-id"] {
            let work = format!("{path}/{id}");
            assert_problem(&server.delete(&work).await, 404, kind, "id");
            assert_problem(&server.cancel(&work).await, 404, kind, "id");
            let waited = server.get_with(&work, "prefer", "wait=60").await;
            assert_problem(&waited, 404, kind, "id");
            let parts = match path {
                "/v1/jobs" => "/result /resultants /zones /tractions /pressure /slip /case /events",
                "/v1/evolutions" => "/result",
                _ => "/results /events",
            };
            assert_problem(&server.get(&work).await, 404, kind, "id");
            for part in parts.split(' ') {
                let answer = server.get(&format!("{work}{part}")).await;
                assert_problem(&answer, 404, kind, "id");
            }
        }
        if path != "/v1/evolutions" {
            let events = format!("{path}/{}/events", uuid::Uuid::nil());
            let other = server.get_with(&events, "accept", "application/json").await;
            assert_problem(&other, 406, "not-acceptable", "text/event-stream");
        }
    }
}

#[tokio::test]
async fn work_that_has_not_ended_says_when_to_ask_again_and_is_cancelled_before_it_is_deleted() {
    let server = Server::idle().await;
    for (path, body, [_, not_ended]) in kinds_of_work() {
        let work = server.post(path, &body).await.is(202).location();
        let parts = match path {
            "/v1/jobs" => "result resultants zones tractions pressure slip",
            "/v1/evolutions" => "result",
            _ => "",
        };
        let parts: Vec<&str> = parts.split_terminator(' ').collect();
        for part in &parts {
            let answer = server.get(&format!("{work}/{part}")).await;
            assert_problem(&answer, 409, "result-not-ready", "queued");
            assert_eq!(answer.header("retry-after"), Some("1"));
        }
        let kept = server.delete(&work).await;
        assert_problem(&kept, 409, not_ended, "cancel");
        server.cancel(&work).await.is(200);
        for part in &parts {
            let answer = server.get(&format!("{work}/{part}")).await;
            assert_problem(&answer, 409, "job-cancelled", "cancelled");
        }
        server.delete(&work).await.is(204);
        server.get(&work).await.is(404);
        for part in &parts {
            server.get(&format!("{work}/{part}")).await.is(404);
        }
        server.delete(&work).await.is(404);
    }
}

#[tokio::test]
async fn full_queue_refuses_and_stores_nothing() {
    let server = Server::idle_with(|setup| setup.options.queue_max = 2).await;
    let case = example("spin.case.json");
    let keyed = async || {
        server
            .post_with("/v1/jobs", "idempotency-key", "k", &case)
            .await
    };
    let first = keyed().await.is(202).json;
    let path = server.submit(&case).await;
    let answer = server.post("/v1/jobs", &case).await;
    assert_eq!(keyed().await.json, first, "a known key needs no place");
    assert_problem(&answer, 503, "queue-full", "2");
    assert_eq!(answer.header("retry-after"), Some("1"));
    let listed = server.read("/v1/jobs").await;
    assert_eq!(count(&listed["jobs"]), 2);
    server.cancel(&path).await;
    server.submit(&case).await;
}

#[tokio::test]
async fn draining_service_is_not_ready_and_takes_no_jobs() {
    let server = Server::start().await;
    assert_eq!(server.get("/readyz").await.status, 200);
    server.jobs.drain();
    let answer = server.get("/readyz").await;
    assert_problem(&answer, 503, "draining", "shutting down");
    let answer = server.post("/v1/jobs", &example("spin.case.json")).await;
    assert_problem(&answer, 503, "draining", "shutting down");
    assert_eq!(answer.header("retry-after"), Some("1"));
    server.get("/healthz").await.is(200);
}

/// The check often identifies why a case cannot be solved.
#[tokio::test]
async fn a_failed_job_has_the_remarks_of_its_check() {
    let server = Server::start().await;
    let mut case = example("wheel-rail.case.json");
    case["contact"]["rail"] = case["contact"]["wheel"].clone();
    case["outputs"] = json!(["resultants"]);
    let checked = server.post("/v1/cases/check", &case).await.is(200).json;
    let remark = &checked["remarks"][0];
    assert_eq!(remark["code"], "profile-of-other-body", "{checked:#}");
    let job = server.solve(&case).await;
    assert_eq!(job["state"], "failed", "{job:#}");
    assert_eq!(job["remarks"], json!([remark]));
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
        let path = link(&job, "self");
        assert_eq!(error["instance"], path);
        assert!(job.get("result").is_none(), "{job:#}");
        let reason = error["detail"].as_str().expect("a detail");
        let answer = server.get(&format!("{path}/result")).await;
        assert_problem(&answer, 409, "job-failed", reason);
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
    let path = link(&job, "self");
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
    server.get(link(&job["result"], "tractions")).await.is(200);
}

#[tokio::test]
async fn job_whose_workers_fall_silent_fails_as_lost() {
    let (release, held) = channel::<()>();
    let held = Mutex::new(held);
    let mut setup = Setup::new().solving(move |_, _| {
        // The solver does not tick until the test ends, so that the lease is not renewed.
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
    let kinds = server.read("/problems").await;
    let kinds = kinds.as_array().expect("a list");
    let mut seen = BTreeSet::new();
    for kind in kinds {
        let path = kind["type"].as_str().expect("a type");
        assert!(seen.insert(path.to_owned()), "{path} is there twice");
        assert_eq!(&server.read(path).await, kind);
    }
    // A test in this folder provokes every problem except `internal`, which has a unit test in the panic handler, and `not-ready`, which needs a
    // job table that stops responding.
    let tests = files_below(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/service").as_ref());
    let tests = tests
        .iter()
        .map(|file| std::fs::read_to_string(file).expect("a test"));
    let here: String = tests.collect();
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
