//! Tests that clients that send too slowly, do not read, or open too many connections are disconnected without effect on others.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use futures_util::future::join_all;
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};

use crate::batches::small_loaded;
use crate::cost::{memory_bytes, repeating_motions};
use crate::crowds::{read_answer, silent};
use crate::server::{Server, example, link};
use crate::support::{Service, long_case, pause};

/// The time between two bytes of a slow client.
const DRIP: Duration = Duration::from_millis(10);
/// A time far beyond every limit that the tests set.
const FOR_EVER: Duration = Duration::from_secs(60);

async fn connect(server: &Server) -> TcpStream {
    TcpStream::connect(server.address)
        .await
        .expect("a connection")
}

/// Sends bytes one by one until the service closes the connection. Returns the answer up to then.
async fn drip(mut stream: TcpStream, bytes: impl Iterator<Item = u8>) -> String {
    let (mut read, mut write) = stream.split();
    let mut answer = Vec::new();
    let sending = async {
        for byte in bytes {
            if write.write_all(&[byte]).await.is_err() {
                break;
            }
            tokio::time::sleep(DRIP).await;
        }
        std::future::pending::<()>().await;
    };
    tokio::select! {
        // A reset connection is closed as well.
        _ = read.read_to_end(&mut answer) => {}
        () = sending => {}
        () = tokio::time::sleep(FOR_EVER) => panic!("the connection is still open"),
    }
    String::from_utf8_lossy(&answer).into_owned()
}

#[tokio::test]
async fn heads_that_never_end_are_given_up_and_others_are_served_meanwhile() {
    let server =
        Server::with(|setup| setup.http.first_head_timeout = Duration::from_millis(300)).await;
    let mut slow = Vec::new();
    for _ in 0..100 {
        let head = "GET /healthz HTTP/1.1\r\nhost: localhost\r\nx-slow: ".bytes();
        let head = head.chain(std::iter::repeat(b'a'));
        slow.push(tokio::spawn(drip(connect(&server).await, head)));
        slow.push(tokio::spawn(drip(
            connect(&server).await,
            std::iter::empty(),
        )));
    }
    assert_eq!(
        server.solve(&example("spin.case.json")).await["state"],
        "succeeded"
    );
    for client in slow {
        let answer = client.await.expect("a closed connection");
        assert!(
            answer.is_empty() || answer.starts_with("HTTP/1.1 408"),
            "{answer}"
        );
    }
}

#[tokio::test]
async fn bodies_that_come_byte_by_byte_are_cut_off() {
    let server = Server::with(|setup| setup.http.body_timeout = Duration::from_millis(300)).await;
    let sent = ["/v1/jobs", "/v1/batches", "/v1/evaluate", "/v1/runs"].map(async |path| {
        let mut stream = connect(&server).await;
        let head = format!(
            "POST {path} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\ncontent-type: application/json\r\ncontent-length: 1000000\r\n\r\n["
        );
        stream.write_all(head.as_bytes()).await.expect("sent");
        // Each byte arrives long before the timeout for a piece of the body.
        let answer = drip(stream, std::iter::repeat(b' ')).await;
        assert!(
            answer.starts_with("HTTP/1.1 408") && answer.contains("/problems/body-timeout"),
            "{path}: {answer}"
        );
    });
    join_all(sent).await;
}

#[tokio::test]
async fn rows_that_keep_coming_may_take_longer_than_a_piece_of_them() {
    let server = Server::with(|setup| setup.http.body_timeout = Duration::from_secs(2)).await;
    let template = crate::runs::template("fastsim");
    let rows: Vec<f64> = (0..4000).map(|row| 1e-6 * f64::from(row)).collect();
    let body = json!({ "template": template, "columns": { "/motion/creepage_x": rows } });
    let body = body.to_string();
    for (path, status) in [
        ("/v1/evaluate", "HTTP/1.1 200"),
        ("/v1/runs", "HTTP/1.1 202"),
    ] {
        let mut stream = connect(&server).await;
        let head = format!(
            "POST {path} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n",
            body.len()
        );
        stream.write_all(head.as_bytes()).await.expect("sent");
        // The upload takes 3 s in all. Its pauses are far below the timeout of 2 s.
        for piece in body.as_bytes().chunks(body.len() / 60) {
            stream.write_all(piece).await.expect("sent");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        let answer = read_answer(&mut stream).await;
        assert!(answer.starts_with(status), "{path}: {answer:.300}");
    }
}

#[tokio::test]
async fn an_answer_that_is_not_taken_is_given_up() {
    let mut setup = repeating_motions(400);
    setup.http.write_timeout = Duration::from_millis(300);
    let server = setup.start().await;
    let (path, whole) = large_results(&server).await;
    let socket = TcpSocket::new_v4().expect("a socket");
    socket.set_recv_buffer_size(4096).expect("a small buffer");
    let mut stream = socket.connect(server.address).await.expect("a connection");
    let request = format!("GET {path} HTTP/1.1\r\nhost: localhost\r\n\r\n");
    stream.write_all(request.as_bytes()).await.expect("sent");
    let start = Instant::now();
    until_closed(server.address, stream.local_addr().expect("an address")).await;
    let mut answer = Vec::new();
    // Data in the buffers of the system arrive before the end.
    let _ = tokio::time::timeout(FOR_EVER, stream.read_to_end(&mut answer))
        .await
        .expect("an end");
    assert!(
        answer.len() < whole,
        "{} of {whole} bytes after {:?}",
        answer.len(),
        start.elapsed()
    );
}

/// Waits until the server side of a connection is closed, according to the system.
async fn until_closed(server: SocketAddr, client: SocketAddr) {
    let ports = [server, client].map(|address| format!(":{:04X}", address.port()));
    let start = Instant::now();
    loop {
        let sockets = std::fs::read_to_string("/proc/net/tcp").expect("the system's sockets");
        let is_open = sockets.lines().any(|line| {
            let words: Vec<&str> = line.split_whitespace().collect();
            matches!(words[..], [_, local, remote, "01", ..]
                if local.ends_with(&ports[0]) && remote.ends_with(&ports[1]))
        });
        if !is_open {
            return;
        }
        assert!(start.elapsed() < FOR_EVER, "the connection is still open");
        pause().await;
    }
}

/// Returns the path of results that fill every buffer on the way, and their size in bytes.
async fn large_results(server: &Server) -> (String, usize) {
    let cases: Vec<Value> = (0..24).map(|n| small_loaded("large", 50_000 + n)).collect();
    let batch = server.post("/v1/batches", &json!(cases)).await.json;
    let path = format!("{}?wait=60", link(&batch, "results"));
    let whole = server.get(&path).await.bytes.len();
    assert!(whole > 7 << 20, "{whole} bytes do not fill the buffers");
    (path, whole)
}

#[tokio::test]
async fn clients_that_read_nothing_cost_little_memory() {
    const CLIENTS: usize = 60;
    let (_folder, service) = Service::fresh(&["--request-memory-mb", "64"]);
    // This is the maximal number of motions.
    let mut case = long_case("large", 10_000);
    case["solver"]["mesh"] = json!({ "strips": 2, "cells": 2 });
    let batch = service.post("/v1/batches?wait=60", &json!([case])).await;
    let results = link(&batch.is(200).json, "results").to_owned();
    let line = service.ask(&results).await.lines().remove(0);
    let motions = &line["result"]["patches"][0]["points"];
    assert_eq!(
        motions.as_array().map(Vec::len),
        Some(10_000),
        "{line:.300}"
    );
    let job = format!("/v1/jobs/{}", line["id"].as_str().expect("an id"));
    // A stored text is streamed to its client. Parts of it are parsed into numbers, which count against the memory limit. The allocator keeps some
    // freed memory.
    let (streamed, counted) = (CLIENTS << 20, (64 + 64) << 20);
    for (path, allowed) in [
        (results, counted),
        (format!("{job}/result"), streamed),
        (format!("{job}/resultants"), counted),
        (format!("{job}/resultants?format=csv"), counted),
    ] {
        let whole = service.ask(&path).await.bytes.len();
        assert!(whole > 1 << 20, "{path}: {whole} bytes fill no buffer");
        let before = memory_bytes(service.id(), "VmRSS:");
        let mut held = Vec::new();
        for _ in 0..CLIENTS {
            held.push(silent(service.address(), &path).await);
        }
        tokio::time::sleep(Duration::from_secs(2)).await;
        let grown = memory_bytes(service.id(), "VmRSS:").saturating_sub(before);
        assert!(
            allowed < CLIENTS * whole,
            "{path}: {whole} bytes show nothing"
        );
        assert!(
            grown < allowed,
            "{path}: {grown} bytes, {CLIENTS} times {whole}"
        );
        service.submit(&example("spin.case.json")).await;
    }
}
