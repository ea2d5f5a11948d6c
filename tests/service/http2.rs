//! Tests HTTP/2 with prior knowledge: several requests on a connection, and responses that the client does not read.

use std::time::Duration;

use axum::body::Bytes;
use http_body_util::Empty;
use hyper::client::conn::http2::{Builder, SendRequest};
use hyper::{Method, Request};
use hyper_util::rt::{TokioExecutor, TokioIo};
use tokio::net::TcpStream;
use tokio::task::JoinHandle;

use crate::server::{Server, example};

/// A time far beyond every limit that the tests set.
const FOR_EVER: Duration = Duration::from_secs(60);

/// Connects a client with this flow-control window per response. The returned task ends when the service closes the connection.
async fn connect(server: &Server, window: u32) -> (SendRequest<Empty<Bytes>>, JoinHandle<()>) {
    let stream = TcpStream::connect(server.address).await;
    let mut builder = Builder::new(TokioExecutor::new());
    builder.initial_stream_window_size(window);
    let stream = TokioIo::new(stream.expect("a connection"));
    let (sender, connection) = builder.handshake(stream).await.expect("HTTP/2");
    let connection = tokio::spawn(async move {
        let _ = connection.await;
    });
    (sender, connection)
}

fn request(method: Method, server: &Server, path: &str) -> Request<Empty<Bytes>> {
    let address = format!("http://{}{path}", server.address);
    let request = Request::builder().method(method).uri(address);
    request.body(Empty::new()).expect("a request")
}

#[tokio::test]
async fn without_a_key_the_name_in_the_address_is_judged() {
    let server = Server::start().await;
    let (mut sender, _connection) = connect(&server, 1 << 16).await;
    for (name, allowed) in [("localhost", true), ("rail.example", false)] {
        let address = format!("http://{name}/v1/jobs");
        let own = format!("http://{name}");
        let request = Request::get(address).header("origin", own);
        let request = request.body(Empty::new()).expect("a request");
        let answer = sender.send_request(request).await.expect("an answer");
        assert_eq!(answer.status().is_success(), allowed, "{name}");
    }
    // A page of this service may change data, because its origin has the same host name.
    let address = format!("http://localhost/v1/jobs/{}/cancel", uuid::Uuid::nil());
    let request = Request::post(address).header("origin", "http://localhost");
    let request = request.body(Empty::new()).expect("a request");
    let answer = sender.send_request(request).await.expect("an answer");
    assert_eq!(answer.status(), 404);
}

#[tokio::test]
async fn a_client_that_grants_no_window_for_its_answer_is_let_go() {
    let server = Server::with(|setup| setup.http.write_timeout = Duration::from_millis(300)).await;
    let (mut sender, connection) = connect(&server, 100).await;
    // A client that follows events waits for the service, and must not be disconnected.
    let events = request(Method::GET, &server, "/v1/events");
    let events = sender.send_request(events).await.expect("an answer");
    assert_eq!(events.status(), 200);
    tokio::time::sleep(Duration::from_secs(1)).await;
    assert!(!connection.is_finished());
    let contract = request(Method::GET, &server, "/openapi.json");
    let contract = sender.send_request(contract).await.expect("an answer");
    assert_eq!(contract.status(), 200);
    let closed = tokio::time::timeout(FOR_EVER, connection).await;
    closed
        .expect("the connection is still open")
        .expect("an end");
    // Other clients are served.
    let job = server.solve(&example("spin.case.json")).await;
    assert_eq!(job["state"], "succeeded");
}
