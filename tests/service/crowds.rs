//! Tests many concurrent clients: idle connections are replaced, event streams and waits have their own limits, probes are always answered.

use std::net::SocketAddr;
use std::time::Duration;

use reqwest::Method;
use serde_json::json;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use crate::errors::assert_problem;
use crate::server::{Server, Setup, example};
use crate::support::{Service, pause, railhead};

/// Sends a request on a new connection and reads nothing.
pub async fn send(address: SocketAddr, request: &str) -> TcpStream {
    let mut stream = TcpStream::connect(address).await.expect("a connection");
    stream.write_all(request.as_bytes()).await.expect("sent");
    stream
}

/// Sends a GET on a new connection and leaves the answer unread.
pub async fn silent(address: SocketAddr, path: &str) -> TcpStream {
    let request = format!("GET {path} HTTP/1.1\r\nhost: localhost\r\n\r\n");
    send(address, &request).await
}

/// Reads an answer of known length, or up to the end of the connection.
pub async fn read_answer(stream: &mut TcpStream) -> String {
    let mut answer = Vec::new();
    loop {
        let text = String::from_utf8_lossy(&answer);
        if let Some((head, body)) = text.split_once("\r\n\r\n") {
            let mut lines = head.lines();
            let length = lines.find_map(|line| line.strip_prefix("content-length: "));
            if length.is_some_and(|length| Ok(body.len()) == length.parse()) {
                return text.into_owned();
            }
        }
        match stream.read_buf(&mut answer).await {
            Ok(0) | Err(_) => return String::from_utf8_lossy(&answer).into_owned(),
            Ok(_) => {}
        }
    }
}

/// Returns the whole answer to a GET on a new connection.
async fn ask(address: SocketAddr, path: &str) -> String {
    let request = format!("GET {path} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n");
    let mut stream = send(address, &request).await;
    let read = tokio::time::timeout(Duration::from_secs(20), read_answer(&mut stream));
    read.await.expect("an answer in time")
}

/// Follows the events of a job. Returns the connection and the first bytes of the answer.
async fn follow(server: &Server, job: &str) -> (TcpStream, [u8; 12]) {
    let mut stream = silent(server.address, &format!("{job}/events")).await;
    let mut begun = [0; 12];
    stream.read_exact(&mut begun).await.unwrap();
    (stream, begun)
}

#[tokio::test]
async fn the_oldest_silent_connection_makes_way_for_a_new_one() {
    let server = Server::with(|setup| setup.http.connections_max = 3).await;
    let mut silent = Vec::new();
    for _ in 0..3 {
        silent.push(TcpStream::connect(server.address).await.unwrap());
    }
    let answer = ask(server.address, "/healthz").await;
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    let mut end = [0];
    let closed = tokio::time::timeout(Duration::from_secs(5), silent[0].read(&mut end));
    assert!(matches!(closed.await.expect("the end"), Ok(0) | Err(_)));
    let open = tokio::time::timeout(Duration::from_millis(200), silent[2].read(&mut end));
    assert!(open.await.is_err(), "the youngest one was closed too");
}

#[tokio::test]
async fn probes_are_answered_while_every_connection_is_busy() {
    let server = Server::idle_with(|setup| setup.http.connections_max = 3).await;
    let job = server.submit(&example("spin.case.json")).await;
    let mut busy = Vec::new();
    for _ in 0..3 {
        busy.push(follow(&server, &job).await);
    }
    let refused = assert_probed(server.address, 503).await;
    assert!(refused.contains("/problems/overloaded"), "{refused}");
}

/// Asserts that probes are answered and that another request gets this status. Returns the last answer.
async fn assert_probed(address: SocketAddr, status: u16) -> String {
    let mut last = String::new();
    let probes = ["/healthz", "/readyz", "/metrics"].map(|path| (path, 200));
    for (path, status) in probes.into_iter().chain([("/v1/jobs", status)]) {
        last = ask(address, path).await;
        let begin = format!("HTTP/1.1 {status}");
        assert!(last.starts_with(&begin), "{path}: {last}");
    }
    last
}

#[tokio::test]
async fn a_tenant_may_follow_and_wait_so_often_and_no_more() {
    let mut setup = Setup::idle();
    setup.http.tenant_streams_max = 2;
    setup.http.tenant_waits_max = 0;
    let server = setup.start().await;
    let job = server.submit(&example("spin.case.json")).await;
    let mut streams = Vec::new();
    for _ in 0..2 {
        let (stream, begun) = follow(&server, &job).await;
        assert_eq!(&begun, b"HTTP/1.1 200");
        streams.push(stream);
    }
    let answer = ask(server.address, &format!("{job}/events")).await;
    assert!(answer.contains("/problems/too-many-requests"), "{answer}");
    // A wait is only a preference: the job is created and its id is returned at once.
    let waiting = |request: reqwest::RequestBuilder| {
        let request = request.header("prefer", "wait=60");
        request.json(&example("hertz-steel.case.json"))
    };
    let answer = server.send(Method::POST, "/v1/jobs", waiting).await.is(202);
    assert_eq!(answer.header("preference-applied"), None);
    // The slot of a follower is free again after it disconnects.
    streams.pop();
    while &follow(&server, &job).await.1 != b"HTTP/1.1 200" {}
}

#[tokio::test]
async fn a_tenant_may_have_so_many_requests_under_way_and_no_more() {
    let server = Server::idle_with(|setup| setup.http.tenant_requests_max = 1).await;
    // The request remains active while its body is missing.
    let begun = "POST /v1/jobs HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ncontent-length: 2\r\n\r\n";
    let held = send(server.address, begun).await;
    let until = async |part: &str| {
        while !ask(server.address, "/v1/jobs").await.contains(part) {
            pause().await;
        }
    };
    until("/problems/too-many-requests").await;
    drop(held);
    until("HTTP/1.1 200").await;
}

#[tokio::test]
async fn probes_can_have_a_port_of_their_own() {
    let (_folder, service) = Service::fresh(&["--probe-listen", "127.0.0.1:0"]);
    let log = service.log_text();
    let mut lines = log.lines();
    let event = lines.find(|line| line.contains("listening for probes"));
    let event: serde_json::Value = serde_json::from_str(event.expect("its address")).unwrap();
    let address = event["address"].as_str().unwrap().parse().unwrap();
    assert_probed(address, 404).await;
    service.signal("INT");
    // The main port closes at once. The port for probes stays open as long as the process lives.
    assert_eq!(service.wait().code(), Some(0));
}

#[tokio::test]
async fn without_a_key_foreign_names_pages_and_proxies_are_refused() {
    let server = Server::idle().await;
    let job = server.submit(&example("spin.case.json")).await;
    let cancel = format!("{job}/cancel");
    let kinds = [
        (&Method::GET, "/v1/jobs", "host: evil.example"),
        (&Method::GET, &job, "x-forwarded-for: 192.0.2.1"),
        (&Method::POST, &cancel, "origin: http://evil.example"),
        (&Method::DELETE, &job, "sec-fetch-site: same-site"),
    ];
    let problems = [
        (403, "host-not-allowed"),
        (401, "unauthorized"),
        (403, "cross-site"),
        (403, "cross-site"),
    ];
    for ((method, path, header), (status, slug)) in kinds.into_iter().zip(problems) {
        let (name, value) = header.split_once(": ").unwrap();
        let shape = |request: reqwest::RequestBuilder| request.header(name, value);
        let answer = server.send(method.clone(), path, shape).await;
        assert_problem(&answer, status, slug, "");
    }
    assert_eq!(server.read(&job).await["state"], json!("queued"));
    let nameless = "GET /healthz HTTP/1.1\r\nconnection: close\r\n\r\n";
    let mut stream = send(server.address, nameless).await;
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await.unwrap();
    assert!(
        answer.starts_with("HTTP/1.1 400") && answer.contains("Host"),
        "{answer}"
    );
}

#[tokio::test]
async fn a_log_that_nobody_reads_holds_up_nobody() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = railhead()
        .args(["serve", "--listen", "127.0.0.1:0", "--log-format", "json"])
        .args(["--data-dir".as_ref(), folder.path()])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    // The log is read up to the address and no further.
    let mut log = std::io::BufReader::new(child.stderr.take().unwrap());
    let address = loop {
        let mut line = String::new();
        std::io::BufRead::read_line(&mut log, &mut line).unwrap();
        let event: serde_json::Value = serde_json::from_str(&line).unwrap();
        if event["message"] == "listening" {
            break event["address"].as_str().unwrap().to_owned();
        }
    };
    let client = reqwest::Client::new();
    for _ in 0..600 {
        let answer = client.get(format!("http://{address}/healthz")).send();
        let answer = tokio::time::timeout(Duration::from_secs(30), answer).await;
        assert_eq!(answer.expect("an answer in time").unwrap().status(), 200);
    }
    child.kill().unwrap();
    child.wait().unwrap();
}
