//! The HTTP client for object stores: HTTP/1.1, with the TLS implementation and certificates of the database connection.

use std::time::Duration;

use async_trait::async_trait;
use futures_util::{StreamExt, stream};
use http_body_util::{BodyExt, StreamBody};
use hyper_rustls::{HttpsConnector, HttpsConnectorBuilder};
use hyper_util::client::legacy;
use hyper_util::client::legacy::connect::HttpConnector as TcpConnector;
use hyper_util::rt::{TokioExecutor, TokioTimer};
use object_store::ClientOptions;
use object_store::client::{
    HttpClient, HttpConnector, HttpError, HttpErrorKind, HttpRequest, HttpRequestBody,
    HttpResponse, HttpResponseBody, HttpService,
};
use tokio::time::timeout;

use crate::error::{JobsError, Result};
use crate::metrics::{StoreRequests, count_request};

/// Time limit of connecting.
const CONNECTED_WITHIN: Duration = Duration::from_secs(5);

/// Time limit of the head of a response, and the additional time for each MiB of the request.
const ANSWERED_WITHIN: Duration = Duration::from_secs(15);
const SENT_WITHIN: Duration = Duration::from_secs(2);

/// Time limit of the next part of a response.
const PIECE_WITHIN: Duration = Duration::from_secs(15);

/// How long an idle connection is kept.
const KEPT_FOR: Duration = Duration::from_secs(30);

/// Sends requests to an object store and counts them.
#[derive(Debug, Clone)]
pub(crate) struct Client {
    pool: legacy::Client<HttpsConnector<TcpConnector>, HttpRequestBody>,
    requests: StoreRequests,
}

impl Client {
    /// Creates a client.
    ///
    /// # Errors
    /// The machine has no trusted certificate authorities.
    pub(crate) fn new(requests: StoreRequests) -> Result<Client> {
        let mut tcp = TcpConnector::new();
        tcp.enforce_http(false);
        tcp.set_nodelay(true);
        tcp.set_connect_timeout(Some(CONNECTED_WITHIN));
        let roots = HttpsConnectorBuilder::new().with_native_roots();
        let roots = roots.map_err(|error| {
            JobsError::ResultPlace(format!(
                "no authority that signs certificates is trusted on this machine ({error}); install them (ca-certificates) or name a file by SSL_CERT_FILE"
            ))
        })?;
        let connector = roots.https_or_http().enable_http1().wrap_connector(tcp);
        let pool = legacy::Client::builder(TokioExecutor::new())
            .pool_timer(TokioTimer::new())
            .pool_idle_timeout(KEPT_FOR)
            .build(connector);
        Ok(Client { pool, requests })
    }
}

impl HttpConnector for Client {
    fn connect(&self, _: &ClientOptions) -> object_store::Result<HttpClient> {
        Ok(HttpClient::new(self.clone()))
    }
}

#[async_trait]
impl HttpService for Client {
    async fn call(&self, request: HttpRequest) -> Result<HttpResponse, HttpError> {
        let method = request.method().clone();
        let mib = u32::try_from(request.body().content_length() >> 20).unwrap_or(u32::MAX);
        let patience = ANSWERED_WITHIN + SENT_WITHIN.saturating_mul(mib);
        let sent = match timeout(patience, self.pool.request(request)).await {
            Ok(sent) => sent.map_err(sorted),
            Err(late) => Err(HttpError::new(HttpErrorKind::Timeout, late)),
        };
        let status = sent.as_ref().ok().map(|answer| answer.status().as_u16());
        count_request(&self.requests, method.as_str(), status);
        let (head, body) = sent?.into_parts();
        let pieces = stream::unfold(Some(body), async |body| {
            let mut body = body?;
            match timeout(PIECE_WITHIN, body.frame()).await {
                Ok(Some(Ok(piece))) => Some((Ok(piece), Some(body))),
                Ok(Some(Err(cut))) => {
                    Some((Err(HttpError::new(HttpErrorKind::Interrupted, cut)), None))
                }
                Ok(None) => None,
                Err(late) => Some((Err(HttpError::new(HttpErrorKind::Timeout, late)), None)),
            }
        });
        let body = HttpResponseBody::new(StreamBody::new(Box::pin(pieces.fuse())));
        Ok(HttpResponse::from_parts(head, body))
    }
}

/// Classifies an error before the response: connection errors are retried, other requests only if they are idempotent.
fn sorted(error: legacy::Error) -> HttpError {
    let kind = match error.is_connect() {
        true => HttpErrorKind::Connect,
        false => HttpErrorKind::Interrupted,
    };
    HttpError::new(kind, error)
}
