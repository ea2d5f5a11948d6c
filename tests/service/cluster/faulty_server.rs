//! An HTTP proxy that answers some requests with 500 and truncates some answers.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use axum::Router;
use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use futures_util::{StreamExt, stream};
use tokio::net::TcpListener;

/// The faults of a proxy. Every n-th request is faulty; 0 disables a fault.
#[derive(Default)]
pub struct Faults {
    pub refused: AtomicU64,
    pub cut: AtomicU64,
    requests: AtomicU64,
    /// The number of faults so far.
    pub made: AtomicU64,
}

impl Faults {
    fn due(&self, number: u64, every: &AtomicU64) -> bool {
        let every = every.load(Ordering::Relaxed);
        let due = every > 0 && number.is_multiple_of(every);
        self.made.fetch_add(u64::from(due), Ordering::Relaxed);
        due
    }
}

/// An HTTP proxy that answers some requests with 500 and truncates some answers.
pub struct FaultyServer {
    pub address: SocketAddr,
    pub faults: Arc<Faults>,
}

impl FaultyServer {
    /// Starts a proxy for the server on this port of this machine.
    pub async fn to(port: u16) -> FaultyServer {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let address = listener.local_addr().expect("an address");
        let faults = Arc::<Faults>::default();
        let state = (port, faults.clone(), reqwest::Client::new());
        let router = Router::new().fallback(pass).with_state(state);
        tokio::spawn(async move { axum::serve(listener, router).await });
        FaultyServer { address, faults }
    }
}

type Way = (u16, Arc<Faults>, reqwest::Client);

async fn pass(State((port, faults, client)): State<Way>, request: Request) -> Response {
    let number = faults.requests.fetch_add(1, Ordering::Relaxed) + 1;
    if faults.due(number, &faults.refused) {
        return StatusCode::INTERNAL_SERVER_ERROR.into_response();
    }
    let (parts, body) = request.into_parts();
    let url = format!("http://127.0.0.1:{port}{}", parts.uri);
    let body = axum::body::to_bytes(body, usize::MAX)
        .await
        .expect("a body");
    // The headers keep the name of the host, which is signed.
    let sent = client
        .request(parts.method, url)
        .headers(parts.headers)
        .body(body);
    let Ok(answer) = sent.send().await else {
        return StatusCode::BAD_GATEWAY.into_response();
    };
    let mut response = Response::builder().status(answer.status());
    for (name, value) in answer.headers() {
        response = response.header(name, value);
    }
    let length = answer.content_length().unwrap_or(0);
    let body = match length > 1 && faults.due(number, &faults.cut) {
        false => Body::from_stream(answer.bytes_stream()),
        true => {
            let half = answer.bytes().await.unwrap_or_default();
            let half = half.slice(..half.len() / 2);
            let cut = Err(std::io::Error::from(std::io::ErrorKind::ConnectionReset));
            Body::from_stream(stream::iter([Ok(half), cut]).boxed())
        }
    };
    response.body(body).expect("an answer")
}
