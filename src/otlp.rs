//! Sends the spans of this process to a collector, by OTLP over HTTP.

use std::pin::Pin;
use std::time::Duration;

use anyhow::Context;
use http_body_util::{BodyExt, Full, Limited};
use hyper::client::conn::http1;
use hyper::header::{HOST, HeaderValue};
use hyper_util::rt::TokioIo;
use opentelemetry::trace::TracerProvider;
use opentelemetry_http::{Bytes, HttpClient, HttpError, Request, Response};
use opentelemetry_otlp::{SpanExporter, WithExportConfig, WithHttpConfig};
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::trace::SdkTracerProvider;
use tokio::net::TcpStream;
use tokio::runtime::Handle;

use crate::jobs::trace::Tracer;
use crate::telemetry::Endpoint;

/// Time limit for sending one batch of spans.
const COLLECTED_WITHIN: Duration = Duration::from_secs(10);
/// Time limit for sending the last spans when the service stops.
const LAST_WITHIN: Duration = Duration::from_secs(3);
/// Longest answer of a collector that is read, in bytes.
const ANSWER_BYTES: usize = 1 << 20;

/// Sends the spans of this process to a collector.
#[derive(Debug)]
pub struct Traces(SdkTracerProvider);

impl Traces {
    /// Starts sending spans in batches, from a separate thread; must be called inside the async runtime. Sampling, batch size and
    /// interval, headers for the collector and resource attributes are read from OpenTelemetry's own environment variables.
    ///
    /// # Errors
    /// One of these variables has a value that is not allowed.
    pub fn start(endpoint: &Endpoint) -> anyhow::Result<Traces> {
        let exporter = SpanExporter::builder()
            .with_http()
            .with_http_client(Collector(Handle::current()))
            .with_endpoint(format!("{}/v1/traces", endpoint.0))
            .with_timeout(COLLECTED_WITHIN)
            .build()
            .context("spans cannot be sent")?;
        let resource = Resource::builder()
            .with_service_name(env!("CARGO_PKG_NAME"))
            .with_attribute(opentelemetry::KeyValue::new(
                "service.version",
                env!("CARGO_PKG_VERSION"),
            ))
            .build();
        let provider = SdkTracerProvider::builder()
            .with_batch_exporter(exporter)
            .with_resource(resource)
            .build();
        Ok(Traces(provider))
    }

    /// Creates the spans.
    #[must_use]
    pub fn tracer(&self) -> Tracer {
        Tracer::new(self.0.tracer(env!("CARGO_PKG_NAME")))
    }

    /// Sends the remaining spans; those that the collector does not accept in time are lost.
    pub async fn stop(self) {
        // Spans are sent by the runtime, so waiting here on one of its threads could block the sending.
        let stopped =
            tokio::task::spawn_blocking(move || self.0.shutdown_with_timeout(LAST_WITHIN));
        match stopped.await {
            Ok(Ok(())) => {}
            Ok(Err(error)) => tracing::warn!(%error, "the last spans were not taken"),
            Err(error) => tracing::warn!(%error, "the last spans were not sent"),
        }
    }
}

/// HTTP client for a collector, one connection per batch. The exporter calls it from a thread outside the runtime, hence the handle.
#[derive(Debug)]
struct Collector(Handle);

impl HttpClient for Collector {
    fn send_bytes<'me, 'answer>(
        &'me self,
        request: Request<Bytes>,
    ) -> Pin<Box<dyn Future<Output = Result<Response<Bytes>, HttpError>> + Send + 'answer>>
    where
        'me: 'answer,
        Self: 'answer,
    {
        let sent = self
            .0
            .spawn(async { tokio::time::timeout(COLLECTED_WITHIN, send(request)).await });
        Box::pin(async { sent.await?? })
    }
}

async fn send(request: Request<Bytes>) -> Result<Response<Bytes>, HttpError> {
    let (mut head, body) = request.into_parts();
    let authority = head.uri.authority().ok_or("the collector has no address")?;
    let host = authority.host().trim_matches(['[', ']']);
    let port = authority.port_u16().unwrap_or(80);
    let stream = TcpStream::connect((host, port)).await?;
    let name = HeaderValue::from_str(authority.as_str())?;
    head.headers.insert(HOST, name);
    // The request target for an origin server is the path alone (RFC 9112, section 3.2.1).
    head.uri = head.uri.path().parse()?;
    let (mut sender, connection) = http1::handshake(TokioIo::new(stream)).await?;
    let connection = tokio::spawn(connection);
    let answer = sender.send_request(Request::from_parts(head, Full::new(body)));
    let (head, body) = answer.await?.into_parts();
    let body = Limited::new(body, ANSWER_BYTES).collect().await?.to_bytes();
    connection.abort();
    Ok(Response::from_parts(head, body))
}
