//! Tests the cost of requests: memory is bounded for any body and response, and other clients are served.

use std::process::Stdio;
use std::time::Duration;

use reqwest::Method;
use serde_json::{Value, json};
use tokio::io::AsyncReadExt;

use crate::caching::gzip;
use crate::crowds::silent;
use crate::errors::assert_problem;
use crate::server::{Server, Setup, example};
use crate::support::{Service, railhead};

/// The maximal resident memory of the whole process with idle workers.
const RESIDENT_MAX: usize = 1 << 30;

/// Returns the memory of a process in bytes by a name in `/proc/PID/status`: `VmRSS:` is the current and `VmHWM:` the peak resident size.
pub fn memory_bytes(process: u32, name: &str) -> usize {
    memory_of(process, name).expect("a process")
}

fn memory_of(process: u32, name: &str) -> Option<usize> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(name))?;
    let kibibytes: usize = line.trim().trim_end_matches(" kB").parse().ok()?;
    Some(kibibytes * 1024)
}

/// Returns an array of this many bytes that repeats an element.
fn repeated(element: &str, bytes: usize) -> String {
    format!(
        "[{}]",
        vec![element; bytes / (element.len() + 1) - 1].join(",")
    )
}

#[tokio::test]
async fn bodies_that_would_fill_the_memory_are_refused_unread() {
    // The limits are small, in the same ratio as the defaults.
    let server = Server::idle_with(|setup| {
        setup.http.body_max_bytes = 1 << 20;
        setup.http.parsed_max_bytes = 12 << 20;
    })
    .await;
    for (element, path) in [
        (r#"{"":1}"#, "/v1/jobs"),
        ("[1]", "/v1/cases/check"),
        ("1", "/v1/jobs"),
        (r#"{"a":{"b":{}}}"#, "/v1/cases/check"),
    ] {
        let text = repeated(element, 1 << 20);
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
    // The limits are in the same ratio as the defaults, as far as small limits allow.
    let limits = "--body-max-mib 2 --parsed-case-max-mb 24 --request-memory-mb 128 --tenant-request-memory-mb 64";
    let limits: Vec<&str> = limits.split(' ').collect();
    let (_folder, service) = Service::fresh(&limits);
    // The first body is read completely. The second is refused because its parsed form would be too large.
    let plain = format!(
        r#"{{"x":{}}}"#,
        repeated("0.12345678901234567", (2 << 20) - 100)
    );
    let packed = gzip(repeated(r#"{"":1}"#, 2 << 20).as_bytes());
    assert!(packed.len() < 5000);
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
    assert!(peak < RESIDENT_MAX / 4, "{} MiB", peak >> 20);
}

/// Solves a case with fields. Returns the path of its job.
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
        // The answer is 503 if the memory for answers is used up.
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
    let server = Server::with(|setup| setup.http.grid_max_samples = 2500).await;
    let job = server.solve(&example("spin.case.json")).await;
    let path = format!("/v1/jobs/{}/tractions", job["id"].as_str().unwrap());
    let answer = server.get(&format!("{path}?grid=101x25")).await;
    assert_problem(&answer, 400, "bad-query", "");
    assert!(answer.text.contains("2500 samples"), "{}", answer.text);
    let answer = server.get(&format!("{path}?grid=100x25&format=csv")).await;
    assert_eq!((answer.status, answer.text.lines().count()), (200, 2501));
}

/// Returns a service that solves one motion and repeats its answer this many times.
pub fn repeating_motions(motions: usize) -> Setup {
    Setup::new().solving(move |problem, monitor| {
        let (mut solution, fields) = railhead::contact::solve(problem, monitor)?;
        let points = &mut solution.patches[0].points;
        *points = vec![points[0].clone(); motions];
        solution.total = vec![solution.total[0]; motions];
        Ok((solution, fields))
    })
}

#[tokio::test]
async fn large_results_are_passed_on_as_they_are_stored() {
    let server = repeating_motions(2000).start().await;
    let case = crate::batches::small("large");
    let waited = server
        .post_with("/v1/jobs", "prefer", "wait=60", &case)
        .await
        .is(200);
    assert_eq!(waited.json["state"], "succeeded");
    let id = waited.json["id"].as_str().unwrap();
    let result = server.get(&format!("/v1/jobs/{id}/result")).await;
    assert!(result.bytes.len() > 1 << 20, "{}", result.bytes.len());
    assert_eq!(result.json["total"].as_array().unwrap().len(), 2000);
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
    assert_eq!(lines.text.lines().count(), 1 + 2 * 2000);
    let one = server.get(&format!("{path}?point=1999")).await;
    assert_eq!(one.json["total"].as_array().unwrap().len(), 1);
    let none = server.get(&format!("{path}?point=2000")).await;
    assert_problem(&none, 400, "bad-query", "");
}

/// Returns a sweep at fixed spin whose spin poles form a grid inside the patch, so that the best mesh differs between motions.
fn creep_map(side: u32) -> Value {
    let spin = 0.003;
    let ranges =
        |low: f64, high: f64| json!({ "from": low * spin, "to": high * spin, "points": side });
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 100_000 },
        "motion": { "sweep": { "creepage_x": ranges(-4.0, 4.0), "creepage_y": ranges(-5.5, 5.5),
                               "spin_per_mm": { "from": spin, "to": spin, "points": 1 }, "combine": "grid" } },
        "solver": { "target_error": 0.001 },
        "outputs": ["resultants"],
    })
}

/// Solves a case with the real program. Returns the peak resident size that was observed, in bytes.
fn peak_of(case: &Value) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("case.json");
    std::fs::write(&file, case.to_string()).unwrap();
    let mut child = railhead()
        .args(["solve", "--operator-store-mb", "16"])
        .arg(&file)
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut most = 0;
    while child.try_wait().unwrap().is_none() {
        most = most.max(memory_of(child.id(), "VmHWM:").unwrap_or(0));
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(child.wait().unwrap().success());
    most
}

#[test]
fn a_creep_map_needs_hardly_more_memory_than_four_motions() {
    let (four, map) = (peak_of(&creep_map(2)), peak_of(&creep_map(8)));
    assert!(four > 1 << 20, "{four} bytes were seen");
    // Operators of the 64 motions would take about 320 MB.
    let more = map.saturating_sub(four);
    assert!(
        more < 160 << 20,
        "{} MiB more than for four motions",
        more >> 20
    );
}
