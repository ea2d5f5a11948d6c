//! The settings of `serve`.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::thread::available_parallelism;
use std::time::Duration;

use clap::Args;

use crate::cli::case_args::CaseArgs;
use crate::cli::database_args::{DATA_DIR_DEFAULT, DATA_DIR_VARIABLE, DatabaseArgs};
use crate::cli::values::{Anonymous, Retention, address, origin, retention};
use crate::http::{AddressRange, HttpOptions};
use crate::jobs::Options;
use crate::telemetry::{Endpoint, LogFormat};

/// Settings of `serve`.
#[derive(Debug, Clone, Args)]
pub(super) struct ServeArgs {
    /// Address and port to listen on; port 0 takes a free one, which the log event `listening` names.
    #[arg(
        long,
        env = "RAILHEAD_LISTEN",
        default_value = "127.0.0.1:8080",
        value_name = "ADDRESS:PORT",
        value_parser = address
    )]
    pub listen: SocketAddr,
    /// Folder of the job table and the results; with a database only of batches that are being received. Created if it is
    /// not there. One process at a time.
    #[arg(
        long,
        env = DATA_DIR_VARIABLE,
        default_value = DATA_DIR_DEFAULT,
        value_name = "FOLDER"
    )]
    pub data_dir: PathBuf,
    #[command(flatten)]
    pub database: DatabaseArgs,
    /// Number of jobs solved at the same time, each on a thread of its own; 0, with a database: other nodes solve
    /// [default: cores − 1, at least 1].
    #[arg(long, env = "RAILHEAD_WORKERS", value_name = "N")]
    pub workers: Option<u16>,
    #[command(flatten)]
    pub case: CaseArgs,
    /// How long ended jobs and their results are kept, such as `30d`, `30days` or `12h`; `forever`: until they are deleted.
    #[arg(long, env = "RAILHEAD_RETENTION", default_value = "forever", value_name = "TIME", value_parser = retention)]
    pub retention: Retention,
    /// Seconds a running job may go on after the service was told to stop; then it goes back to the queue.
    #[arg(
        long,
        env = "RAILHEAD_SHUTDOWN_GRACE_S",
        default_value_t = 10,
        value_name = "SECONDS"
    )]
    pub shutdown_grace_s: u32,
    /// Seconds between SIGTERM, when `/readyz` turns 503, and the closing of the port; connections are accepted
    /// meanwhile. None after SIGINT.
    #[arg(
        long,
        env = "RAILHEAD_DRAIN_DELAY_S",
        default_value_t = 2,
        value_name = "SECONDS"
    )]
    pub drain_delay_s: u32,
    /// Whether requests without an API key are answered. Without keys and without anonymous use the service does not
    /// start.
    #[arg(
        long,
        env = "RAILHEAD_ANONYMOUS",
        value_enum,
        default_value = "loopback"
    )]
    pub anonymous: Anonymous,
    /// Requests per second of one API key, twice as many at once; 0: any number. Requests without a key are counted by
    /// address, those from this machine itself not at all.
    #[arg(
        long,
        env = "RAILHEAD_RATE_LIMIT",
        default_value_t = 200,
        value_name = "N"
    )]
    pub rate_limit: u32,
    /// Origins of web pages that may read answers, such as `https://dashboard.example`, separated by commas.
    #[arg(long, env = "RAILHEAD_CORS_ORIGIN", value_delimiter = ',', value_name = "ORIGIN", value_parser = origin)]
    pub cors_origin: Vec<String>,
    /// Collector that gets the spans of requests and jobs by OTLP over HTTP, such as `http://127.0.0.1:4318`; without it
    /// none are made. Needs a build with the feature `otlp`.
    #[arg(long, env = "RAILHEAD_OTLP_ENDPOINT", value_name = "URL")]
    pub otlp_endpoint: Option<Endpoint>,
    #[command(flatten)]
    pub jobs: Options,
    /// Address and port of a second listener that answers `/healthz`, `/readyz` and `/metrics` only; without it they are
    /// answered on the first one alone, where a few places are kept for them.
    #[arg(long, env = "RAILHEAD_PROBE_LISTEN", value_name = "ADDRESS:PORT", value_parser = address)]
    pub probe_listen: Option<SocketAddr>,
    #[command(flatten)]
    pub http: HttpOptions,
    /// Addresses of proxies, separated by commas, such as `10.0.0.0/8`, that are believed when they name the addresses of their clients
    /// in `Forwarded` or `X-Forwarded-For`. Wrong keys and requests without a key are then counted by these addresses, and
    /// `--address-connections-max` does not hold for the proxies.
    #[arg(
        long,
        env = "RAILHEAD_TRUSTED_PROXIES",
        value_delimiter = ',',
        value_name = "ADDRESSES"
    )]
    pub trusted_proxies: Vec<AddressRange>,
    /// Names of the service, separated by commas, by which it may be asked without a key; addresses and `localhost` always
    /// may. Others are refused, as a web page could make its own name lead here.
    #[arg(
        long,
        env = "RAILHEAD_ALLOWED_HOST",
        value_delimiter = ',',
        value_name = "NAME"
    )]
    pub allowed_host: Vec<String>,
    #[command(flatten)]
    pub log: LogArgs,
}

/// How to log.
#[derive(Debug, Clone, Args)]
pub(super) struct LogArgs {
    /// How a log line looks.
    #[arg(long, env = "RAILHEAD_LOG_FORMAT", value_enum, default_value = "text")]
    pub log_format: LogFormat,
    /// What is logged, for example `info,railhead::jobs=debug`.
    #[arg(
        long,
        env = "RAILHEAD_LOG",
        default_value = "info",
        value_name = "FILTER"
    )]
    pub log: String,
}

impl ServeArgs {
    /// Workers as asked for, or one less than there are cores.
    #[must_use]
    pub(super) fn worker_count(&self) -> usize {
        self.workers.map_or_else(
            || available_parallelism().map_or(1, |cores| cores.get().saturating_sub(1).max(1)),
            usize::from,
        )
    }

    /// How long running jobs may go on after the signal.
    #[must_use]
    pub(super) fn shutdown_grace(&self) -> Duration {
        Duration::from_secs(u64::from(self.shutdown_grace_s))
    }

    /// How long connections are still accepted after a signal: whoever stops a service at a terminal does not want to
    /// wait for a load balancer.
    #[must_use]
    pub(super) fn drain_delay(&self, signal: &str) -> Duration {
        match signal {
            "SIGTERM" => Duration::from_secs(u64::from(self.drain_delay_s)),
            _ => Duration::ZERO,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: ServeArgs,
    }

    #[test]
    fn a_balancer_is_waited_for_and_somebody_at_a_terminal_is_not() {
        let args = |line: &[&str]| Line::parse_from([&["serve"], line].concat()).args;
        assert_eq!(args(&[]).drain_delay("SIGTERM"), Duration::from_secs(2));
        assert_eq!(args(&[]).drain_delay("SIGINT"), Duration::ZERO);
        let asked = args(&["--drain-delay-s", "7"]);
        assert_eq!(asked.drain_delay("SIGTERM"), Duration::from_secs(7));
    }
}
