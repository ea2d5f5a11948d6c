//! Measures the response times of other clients and the memory of the service during crowds of silent connections, followers, large bodies and
//! unread responses.

use std::io::Write;
use std::time::{Duration, Instant};

use serde_json::json;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use crate::Row;
use crate::cases::meshed;
use crate::client::{Client, id_of};
use crate::service::Service;

/// Maximum waiting time of other clients in s.
const WITHIN: f64 = 1.0;
/// Largest memory of the process in MB.
const MEMORY_MB: f64 = 1024.0;
/// Time for which each crowd is observed.
const WATCHED: Duration = Duration::from_secs(10);
const BODY_BYTES: usize = 8 << 20;

/// Measures all crowds, each on a separate service.
pub async fn run(workers: usize) -> Vec<Row> {
    // Both ends of every connection need a descriptor.
    let _ = rlimit::increase_nofile_limit(u64::MAX);
    let mut rows = Vec::new();
    rows.extend(silent(workers).await);
    rows.extend(bodies(workers, false).await);
    rows.extend(bodies(workers, true).await);
    rows.extend(grids(workers, 60, "json", "500x500").await);
    rows.extend(grids(workers, 40, "csv", "1000x1000").await);
    rows.extend(grids(workers, 60, "json", "1000x1000").await);
    rows
}

async fn connect(service: &Service) -> TcpStream {
    let address = service.url.trim_start_matches("http://");
    TcpStream::connect(address).await.expect("a connection")
}

async fn send(service: &Service, request: &str) -> TcpStream {
    let mut stream = connect(service).await;
    stream.write_all(request.as_bytes()).await.expect("sent");
    stream
}

/// Returns the slowest of the probes and requests of another client, each on a new connection, and the peak memory so far.
async fn watched(service: &Service, what: &str, path: &str) -> Vec<Row> {
    let (mut slowest, mut asked) = (0.0_f64, 0);
    let begun = Instant::now();
    while begun.elapsed() < WATCHED {
        for path in ["/healthz", path] {
            let start = Instant::now();
            Client::new(&service.url).get(path).await;
            slowest = slowest.max(start.elapsed().as_secs_f64());
            asked += 1;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let memory = service.usage().peak_mb;
    vec![
        Row::judged(
            &format!("{what}: slowest of {asked} answers to others"),
            format!("{slowest:.3} s"),
            "at most 1 s",
            slowest <= WITHIN,
        ),
        Row::judged(
            &format!("{what}: most memory of the process"),
            format!("{memory:.0} MB"),
            "below 1 GiB",
            memory < MEMORY_MB,
        ),
    ]
}

/// Measures 2 000 connections that send nothing and 1 000 followers that read nothing.
async fn silent(workers: usize) -> Vec<Row> {
    let service = Service::start(workers, &[]);
    let mut client = Client::new(&service.url);
    let job = id_of(&client.submit(&meshed(1, 12), None).await);
    let mut held = Vec::new();
    let follow = format!("GET /v1/jobs/{job}/events HTTP/1.1\r\nhost: localhost\r\n\r\n");
    for _ in 0..1000 {
        held.push(send(&service, &follow).await);
    }
    for _ in 0..2000 {
        held.push(connect(&service).await);
    }
    let rows = watched(
        &service,
        "2 000 silent sockets, 1 000 unread streams",
        "/v1/jobs",
    )
    .await;
    drop(held);
    rows
}

/// Measures 40 simultaneous bodies of 8 MiB, uncompressed or compressed to about 12 kB.
async fn bodies(workers: usize, packed: bool) -> Vec<Row> {
    let service = Service::start(workers, &[]);
    let repeated = |element: &str| {
        let count = BODY_BYTES / (element.len() + 1) - 10;
        vec![element; count].join(",")
    };
    let body = if packed {
        let mut out = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
        let text = format!("[{}]", repeated(r#"{"":1}"#));
        out.write_all(text.as_bytes()).expect("packed");
        out.finish().expect("packed")
    } else {
        format!(r#"{{"x":[{}]}}"#, repeated("0.12345678901234567")).into_bytes()
    };
    let what = if packed {
        format!("40 bodies of {} kB that unpack to 8 MiB", body.len() / 1000)
    } else {
        "40 bodies of 8 MiB".to_owned()
    };
    let url = service.url.clone();
    let mut sending = Vec::new();
    for number in 0..40 {
        let path = ["/v1/jobs", "/v1/cases/check"][number % 2];
        let (url, body) = (format!("{url}{path}"), body.clone());
        sending.push(tokio::spawn(async move {
            let until = Instant::now() + WATCHED;
            while Instant::now() < until {
                let request = reqwest::Client::new().post(&url);
                let request = request.header("content-type", "application/json");
                let request = match packed {
                    true => request.header("content-encoding", "gzip"),
                    false => request,
                };
                let answer = request.body(body.clone()).send().await.expect("an answer");
                let status = answer.status().as_u16();
                assert!([413, 422, 503].contains(&status), "{status}");
            }
        }));
    }
    let rows = watched(&service, &what, "/v1/jobs").await;
    for sent in sending {
        sent.await.expect("sent");
    }
    rows
}

/// Measures `count` clients that request a grid but do not read the response.
async fn grids(workers: usize, count: usize, format: &str, grid: &str) -> Vec<Row> {
    let service = Service::start(workers, &["--grid-max-samples", "1000000"]);
    let mut client = Client::new(&service.url);
    let mut case = meshed(1, 12);
    case["outputs"] = json!(["resultants", "zones", "slip"]);
    let job = id_of(&client.submit(&case, Some("wait=30")).await);
    let request = format!(
        "GET /v1/jobs/{job}/slip?grid={grid}&format={format} HTTP/1.1\r\nhost: localhost\r\n\r\n"
    );
    let mut first = send(&service, &request).await;
    let mut head = [0; 15];
    first.read_exact(&mut head).await.expect("an answer");
    assert_eq!(&head, b"HTTP/1.1 200 OK", "the grid is answered");
    let mut held = vec![first];
    for _ in 1..count {
        held.push(send(&service, &request).await);
    }
    let what = format!("{count} unread {format} grids of {grid}");
    let rows = watched(&service, &what, &format!("/v1/jobs/{job}/result")).await;
    drop(held);
    rows
}
