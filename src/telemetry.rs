//! Logging: events are lines of text or JSON on standard error. The module `otlp` sends spans.

use std::io::stderr;
use std::panic;
use std::str::FromStr;
use std::sync::OnceLock;

use anyhow::{Context, bail};
use axum::http::Uri;
use tracing_appender::non_blocking::{ErrorCounter, NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::fmt::format::FmtSpan;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{Layer, Registry};

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
/// `filter` is a list such as `info,railhead_jobs=debug`. Names of earlier releases, such as `railhead::jobs`, mean the same.
///
/// # Errors
/// The filter cannot be read, or logging was started before.
pub fn start(format: LogFormat, filter: &str) -> anyhow::Result<WorkerGuard> {
    let renamed = ["contact", "jobs", "http"].iter();
    let renamed = renamed.fold(filter.to_owned(), |filter, name| {
        filter.replace(&format!("railhead::{name}"), &format!("railhead_{name}"))
    });
    let directives = renamed.split(',').filter(|part| !part.trim().is_empty());
    for part in directives {
        // `Targets` takes any other word for the name of a target, and then logs nothing else.
        let (target, level) = part.rsplit_once('=').unwrap_or(("", part));
        let is_name = |of: char| of.is_ascii_alphanumeric() || "_:-".contains(of);
        if level.trim().parse::<LevelFilter>().is_err() || !target.trim().chars().all(is_name) {
            bail!(
                "--log: `{part}` is neither a level (`error`, `warn`, `info`, `debug`, `trace` or `off`) nor a target with a \
                 level, such as `railhead_jobs=debug`"
            );
        }
    }
    let targets: Targets = renamed.parse().context("--log")?;
    let (writer, guard) = NonBlockingBuilder::default()
        .lossy(true)
        .buffered_lines_limit(LINES_WAITING)
        .thread_name("railhead-log")
        .finish(stderr());
    // A second start fails below, at `try_init`.
    let _ = DROPPED.set(writer.error_counter());
    let lines = tracing_subscriber::fmt::layer()
        .with_span_events(FmtSpan::NONE)
        .with_writer(writer);
    let lines: Box<dyn Layer<Registry> + Send + Sync> = match format {
        LogFormat::Text => lines.with_ansi(false).boxed(),
        LogFormat::Json => {
            let lines = lines.json().flatten_event(true);
            lines.with_span_list(false).boxed()
        }
    };
    tracing_subscriber::registry()
        .with(lines.with_filter(targets))
        .try_init()
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
pub struct Endpoint(pub(crate) String);

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
