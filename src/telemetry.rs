//! Where do logs and spans go? Logs: one line per event to standard error, as text or JSON. Spans: to a collector by
//! OTLP over HTTP, if one is named.

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

/// How long a collector may take for one batch of spans.
const COLLECTED_WITHIN: Duration = Duration::from_secs(10);
/// How long the last spans may take when the service stops.
const LAST_WITHIN: Duration = Duration::from_secs(3);
/// More than any collector answers.
const ANSWER_BYTES: usize = 1 << 20;

/// How a log line looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum LogFormat {
    /// For people.
    Text,
    /// For machines: one JSON object per line.
    Json,
}

/// Lines that wait for whoever reads the log; further ones are dropped and counted.
const LINES_WAITING: usize = 50_000;

/// What knows how many lines were dropped.
static DROPPED: OnceLock<ErrorCounter> = OnceLock::new();

/// Log lines dropped so far because nobody read them.
#[must_use]
pub fn dropped_lines() -> u64 {
    let dropped = DROPPED.get().map_or(0, ErrorCounter::dropped_lines);
    u64::try_from(dropped).unwrap_or(u64::MAX)
}

/// Starts logging; panics are logged too, instead of being printed between the lines. A thread of its own writes the
/// lines, so that nothing waits for whoever reads them. Lines are written as long as the returned guard is held.
///
/// `filter` is a list such as `info,railhead::jobs=debug`.
///
/// # Errors
/// The filter cannot be read, or logging was started before.
pub fn start(format: LogFormat, filter: &str) -> anyhow::Result<WorkerGuard> {
    let mut targets = EnvFilter::try_new(filter).context("--log")?;
    // A client's name with signs that the font lacks is no concern of the operator.
    if !filter.contains("usvg") {
        targets = targets.add_directive("usvg=error".parse()?);
    }
    let (writer, guard) = NonBlockingBuilder::default()
        .lossy(true)
        .buffered_lines_limit(LINES_WAITING)
        .thread_name("railhead-log")
        .finish(stderr());
    // Logging is started once, or fails below.
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

/// The spans of this process on their way to a collector.
#[derive(Debug)]
pub struct Traces(SdkTracerProvider);

impl Traces {
    /// Starts sending spans, in batches and from a thread of its own; call it inside the async runtime. Sampling, size and
    /// pace of batches, headers for the collector and attributes of the process are read from OpenTelemetry's own variables.
    ///
    /// # Errors
    /// One of these variables says what is not allowed.
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

    /// What makes the spans.
    #[must_use]
    pub fn tracer(&self) -> SdkTracer {
        self.0.tracer(env!("CARGO_PKG_NAME"))
    }

    /// Sends what is left; a collector that does not take it in time loses it.
    pub async fn stop(self) {
        // The sending itself is done by the runtime, so this must not hold up one of its threads.
        let stopped =
            tokio::task::spawn_blocking(move || self.0.shutdown_with_timeout(LAST_WITHIN));
        match stopped.await {
            Ok(Ok(())) => {}
            Ok(Err(error)) => tracing::warn!(%error, "the last spans were not taken"),
            Err(error) => tracing::warn!(%error, "the last spans were not sent"),
        }
    }
}

/// Speaks plain HTTP with a collector, one connection per batch. The thread that sends is none of the runtime's, so the
/// runtime is named.
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
    // To the server itself only the path is said (RFC 9112, section 3.2.1).
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
