//! What a request may cost: memory is bounded however large or clever bodies and answers are, and others are served.

use std::time::Duration;

use railhead::http::{HttpOptions, router};
use reqwest::Method;
use serde_json::{Value, json};
use tokio::io::AsyncReadExt;
use tower::ServiceExt;

use crate::caching::gzip;
use crate::crowds::silent;
use crate::errors::assert_problem;
use crate::server::{Server, Setup, example};
use crate::support::Service;

/// Memory that the whole process may take with idle workers.
const RESIDENT_MAX: usize = 1 << 30;

/// Memory of a process by the name of a line: `VmRSS:` resident now, `VmHWM:` the most it ever took.
pub fn memory_bytes(process: u32, name: &str) -> usize {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).expect("a process");
    let line = status.lines().find_map(|line| line.strip_prefix(name));
    let text = line.expect("its memory").trim().trim_end_matches(" kB");
    text.parse::<usize>().expect("a number") * 1024
}

/// An array of so many bytes that repeats an element.
fn repeated(element: &str, bytes: usize) -> String {
    format!(
        "[{}]",
        vec![element; bytes / (element.len() + 1) - 1].join(",")
    )
}

#[tokio::test]
async fn bodies_that_would_fill_the_memory_are_refused_unread() {
    let server = Server::idle().await;
    for (element, path) in [
        (r#"{"":1}"#, "/v1/jobs"),
        ("[1]", "/v1/cases/check"),
        ("1", "/v1/jobs"),
        (r#"{"a":{"b":{}}}"#, "/v1/cases/check"),
    ] {
        let text = repeated(element, 8 << 20);
        let batch = format!("[{text}]");
        let json = "application/json";
        let answer = server.post_as(path, json, text).await;
        assert_problem(&answer, 413, "body-too-large", "allowed");
        let answer = server.post_as("/v1/batches", json, batch).await;
        assert_problem(&answer, 413, "body-too-large", "");
    }
}

#[tokio::test]
async fn large_bodies_at_once_take_bounded_memory_and_others_are_served() {
    let (_folder, service) = Service::fresh(&[]);
    // A body that is read whole, and one that is refused for what it would become.
    let plain = format!(
        r#"{{"x":{}}}"#,
        repeated("0.12345678901234567", (8 << 20) - 100)
    );
    let packed = gzip(repeated(r#"{"":1}"#, 8 << 20).as_bytes());
    assert!(packed.len() < 20_000);
    let mut sent = Vec::new();
    for number in 0..40 {
        let path = if number % 2 == 0 {
            "/v1/jobs"
        } else {
            "/v1/cases/check"
        };
        let request = service.request(Method::POST, path);
        let request = request.header("content-type", "application/json");
        let request = if number % 4 < 2 {
            request.body(plain.clone())
        } else {
            request
                .header("content-encoding", "gzip")
                .body(packed.clone())
        };
        sent.push(tokio::spawn(request.send()));
    }
    for _ in 0..5 {
        service.get("/healthz").await;
        service.submit(&example("spin.case.json")).await;
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    for answer in sent {
        let status = answer.await.unwrap().unwrap().status().as_u16();
        assert!([413, 422, 503].contains(&status), "{status}");
    }
    let peak = memory_bytes(service.id(), "VmHWM:");
    assert!(peak < RESIDENT_MAX, "{} MiB", peak >> 20);
}

/// The path of a solved job with fields.
async fn solved(service: &Service) -> String {
    let mut case = example("spin.case.json");
    case["outputs"] = json!(["resultants", "zones", "tractions", "slip"]);
    let id = service.submit(&case).await;
    service.until(&id, "succeeded").await;
    format!("/v1/jobs/{id}")
}

#[tokio::test]
async fn grids_that_nobody_reads_take_bounded_memory_and_others_are_served() {
    let (_folder, service) = Service::fresh(&[]);
    let job = solved(&service).await;
    let mut held = Vec::new();
    for number in 0..16 {
        let format = ["csv", "json", "npz", "vtk"][number % 4];
        let path = format!("{job}/slip?grid=500x500&format={format}");
        held.push(silent(service.address(), &path).await);
    }
    for stream in held.iter_mut().take(2) {
        let mut begun = [0; 12];
        stream.read_exact(&mut begun).await.unwrap();
        // Or 503, where the memory for answers is taken.
        assert!([b"HTTP/1.1 200", b"HTTP/1.1 503"].contains(&&begun));
    }
    service.get("/healthz").await;
    service.get(&format!("{job}/tractions")).await;
    let answer = service.request(Method::GET, &format!("{job}/plot.png?field=zones"));
    assert_eq!(answer.send().await.unwrap().status(), 200);
    let peak = memory_bytes(service.id(), "VmHWM:");
    assert!(peak < RESIDENT_MAX, "{} MiB", peak >> 20);
    drop(held);
}

#[tokio::test]
async fn grids_have_a_largest_number_of_samples() {
    let server = Server::start().await;
    let job = server.solve(&example("spin.case.json")).await;
    let path = format!("/v1/jobs/{}/tractions", job["id"].as_str().unwrap());
    let answer = server.get(&format!("{path}?grid=1000x1000")).await;
    assert_problem(&answer, 400, "bad-query", "");
    assert!(answer.text.contains("250000 samples"), "{}", answer.text);
    let answer = server
        .get(&format!("{path}?grid=1000x250&format=csv"))
        .await;
    assert_eq!((answer.status, answer.text.lines().count()), (200, 250_001));
}

#[tokio::test]
async fn what_a_client_has_is_not_made_again() {
    let server = Setup::new().start().await;
    let mut case = example("spin.case.json");
    case["outputs"] = json!(["resultants", "zones", "tractions"]);
    let job = server.solve(&case).await;
    let own = format!("/v1/jobs/{}", job["id"].as_str().unwrap());
    // The same jobs behind a service that makes no picture, grid or table any more.
    let options = HttpOptions {
        renderings_waiting_max: 0,
        ..HttpOptions::default()
    };
    let unable = router(server.jobs.clone(), options);
    let ask = async |path: &str, tag: Option<&str>| {
        let mut request = axum::http::Request::get(path).header("host", "localhost");
        if let Some(tag) = tag {
            request = request.header("if-none-match", tag);
        }
        let request = request.body(axum::body::Body::empty()).unwrap();
        unable
            .clone()
            .oneshot(request)
            .await
            .unwrap()
            .status()
            .as_u16()
    };
    for part in [
        "tractions?grid=20x20",
        "tractions?format=csv",
        "zones",
        "plot.png",
        "plot.svg?width=300",
        "resultants",
        "resultants?format=csv",
    ] {
        let path = format!("{own}/{part}");
        let answer = server.get(&path).await;
        let tag = answer.header("etag").expect("a tag").to_owned();
        assert_eq!(ask(&path, Some(&tag)).await, 304, "{path}");
        assert_eq!(ask(&path, None).await, 503, "{path}");
        let other = format!(
            "{path}{}point=0",
            if part.contains('?') { "&" } else { "?" }
        );
        assert_eq!(ask(&other, Some(&tag)).await, 503, "{other}");
        let again = server.get(&path).await;
        assert_eq!(again.header("etag"), Some(tag.as_str()));
    }
    let unknown = format!("/v1/jobs/{}/zones", uuid::Uuid::now_v7());
    assert_eq!(ask(&unknown, Some("\"x\"")).await, 404);
    let _: Value = server.read(&own).await;
}

#[tokio::test]
async fn large_results_are_passed_on_as_they_are_stored() {
    let mut setup = Setup::new();
    setup.options.cache = false;
    // As if the one motion had been thousands.
    let server = setup
        .solving(|problem, monitor| {
            let (mut solution, fields) = railhead::contact::solve(problem, monitor)?;
            let points = &mut solution.patches[0].points;
            *points = vec![points[0].clone(); 5000];
            solution.total = vec![solution.total[0]; 5000];
            Ok((solution, fields))
        })
        .start()
        .await;
    let case = crate::batches::small("large");
    let waited = server
        .post_with("/v1/jobs", "prefer", "wait=60", &case)
        .await;
    assert_eq!(waited.status, 200, "{}", waited.text);
    assert_eq!(waited.json["state"], "succeeded");
    let id = waited.json["id"].as_str().unwrap();
    let result = server.get(&format!("/v1/jobs/{id}/result")).await;
    assert!(result.bytes.len() > 1 << 20, "{}", result.bytes.len());
    assert_eq!(result.json["total"].as_array().unwrap().len(), 5000);
    assert_eq!(result.json["links"]["job"], json!(format!("/v1/jobs/{id}")));
    assert_eq!(result.json["cached"], json!(false));
    assert_eq!(waited.json["result"], result.json);
    assert_eq!(
        waited.json["links"]["result"],
        json!(format!("/v1/jobs/{id}/result"))
    );
    let path = format!("/v1/jobs/{id}/resultants");
    let resultants = server.get(&path).await;
    assert_eq!(resultants.json["total"], result.json["total"]);
    let lines = server.get(&format!("{path}?format=csv")).await;
    assert_eq!(lines.text.lines().count(), 1 + 2 * 5000);
    let one = server.get(&format!("{path}?point=4999")).await;
    assert_eq!(one.json["total"].as_array().unwrap().len(), 1);
    let none = server.get(&format!("{path}?point=5000")).await;
    assert_problem(&none, 400, "bad-query", "");
}
