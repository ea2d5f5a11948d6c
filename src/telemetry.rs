//! Where do logs and spans go? Log events are lines of text or JSON on standard error; spans go to a collector by OTLP over HTTP,
//! if one is configured.

use std::io::stderr;
use std::panic;
use std::pin::Pin;
use std::str::FromStr;
use std::sync::OnceLock;
use std::time::Duration;

use anyhow::Context;
use http_body_util::{BodyExt, Full, Limited};
use hyper::header::{HOST, HeaderValue};
use hyper::{Uri, client::conn::http1};
use hyper_util::rt::TokioIo;
use opentelemetry::trace::TracerProvider;
use opentelemetry_http::{Bytes, HttpClient, HttpError, Request, Response};
use opentelemetry_otlp::{SpanExporter, WithExportConfig, WithHttpConfig};
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::trace::{SdkTracer, SdkTracerProvider};
use tokio::net::TcpStream;
use tokio::runtime::Handle;
use tracing_appender::non_blocking::{ErrorCounter, NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::format::FmtSpan;

/// Time limit for sending one batch of spans.
const COLLECTED_WITHIN: Duration = Duration::from_secs(10);
/// Time limit for sending the last spans when the service stops.
const LAST_WITHIN: Duration = Duration::from_secs(3);
/// Longest answer of a collector that is read, in bytes.
const ANSWER_BYTES: usize = 1 << 20;

/// Format of the log lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum LogFormat {
    /// Readable text.
    Text,
    /// One JSON object per line.
    Json,
}

/// Log lines that are buffered until they are read; beyond this number new lines are dropped and counted.
const LINES_WAITING: usize = 50_000;

/// Counter of dropped log lines.
static DROPPED: OnceLock<ErrorCounter> = OnceLock::new();

/// Number of log lines dropped so far because the reader of the log was too slow.
#[must_use]
pub fn dropped_lines() -> u64 {
    let dropped = DROPPED.get().map_or(0, ErrorCounter::dropped_lines);
    u64::try_from(dropped).unwrap_or(u64::MAX)
}

/// Starts logging. A separate thread writes the lines, so that a slow reader of the log holds up nothing; it writes as long as the
/// returned guard is held. Panics are logged as events instead of being printed between the lines.
///
/// `filter` is a list such as `info,railhead::jobs=debug`.
///
/// # Errors
/// The filter cannot be read, or logging was started before.
pub fn start(format: LogFormat, filter: &str) -> anyhow::Result<WorkerGuard> {
    let mut targets = EnvFilter::try_new(filter).context("--log")?;
    // The renderer of pictures warns when a client's text has characters that the font lacks; operators need not know.
    if !filter.contains("usvg") {
        targets = targets.add_directive("usvg=error".parse()?);
    }
    let (writer, guard) = NonBlockingBuilder::default()
        .lossy(true)
        .buffered_lines_limit(LINES_WAITING)
        .thread_name("railhead-log")
        .finish(stderr());
    // A second start fails below, at `try_init`.
    let _ = DROPPED.set(writer.error_counter());
    let lines = tracing_subscriber::fmt()
        .with_env_filter(targets)
        .with_span_events(FmtSpan::NONE)
        .with_writer(writer);
    match format {
        LogFormat::Text => lines.with_ansi(false).try_init(),
        LogFormat::Json => {
            let lines = lines.json().flatten_event(true);
            lines.with_span_list(false).try_init()
        }
    }
    .map_err(|error| anyhow::anyhow!("logging could not be started: {error}"))?;
    panic::set_hook(Box::new(|panic| {
        let place = panic
            .location()
            .map(ToString::to_string)
            .unwrap_or_default();
        let thread = std::thread::current();
        let message = panic.payload_as_str().unwrap_or("no message");
        tracing::error!(place, thread = thread.name(), "panicked: {message}");
    }));
    Ok(guard)
}

/// Where a collector listens, such as `http://127.0.0.1:4318`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoint(String);

impl FromStr for Endpoint {
    type Err = String;

    fn from_str(text: &str) -> Result<Endpoint, String> {
        let wrong = "allowed is `http://` with host, port and perhaps a path, such as `http://127.0.0.1:4318`; \
             a collector beyond this machine is best reached through one on it, which can speak TLS";
        let uri: Uri = text.parse().map_err(|_| wrong.to_owned())?;
        let plain = uri.scheme_str() == Some("http")
            && uri
                .authority()
                .is_some_and(|authority| !authority.as_str().contains('@'))
            && uri.query().is_none();
        if plain {
            Ok(Endpoint(text.trim_end_matches('/').to_owned()))
        } else {
            Err(wrong.to_owned())
        }
    }
}

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
    pub fn tracer(&self) -> SdkTracer {
        self.0.tracer(env!("CARGO_PKG_NAME"))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_collector_is_an_address_for_plain_http() {
        for (text, kept) in [
            ("http://127.0.0.1:4318", "http://127.0.0.1:4318"),
            ("http://[::1]:4318/", "http://[::1]:4318"),
            ("http://collector/otlp/", "http://collector/otlp"),
        ] {
            assert_eq!(text.parse(), Ok(Endpoint(kept.to_owned())));
        }
        for wrong in [
            "",
            "127.0.0.1:4318",
            "https://collector:4318",
            "http://",
            "http://a:b@collector",
            "http://collector/?x=1",
            "grpc://collector:4317",
        ] {
            assert!(wrong.parse::<Endpoint>().is_err(), "{wrong:?}");
        }
    }
}
