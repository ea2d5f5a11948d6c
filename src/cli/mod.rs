//! What can be started, and with which settings? Every command, flag and environment variable.

mod backup;
mod commands;
mod config;
mod healthcheck;
mod http_args;
mod keys;
mod serve;
mod solve;
mod stop;
mod worker_args;

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::thread::available_parallelism;
use std::time::Duration;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};

use crate::cli::commands::{BackupArgs, HealthcheckArgs, KeysAction, KeysArgs, SolveArgs};
use crate::cli::http_args::HttpArgs;
use crate::cli::worker_args::WorkerArgs;
use crate::contact::problem::Limits;
use crate::contact::tangential::operator_store::{BYTES_DEFAULT, OperatorStore};
use crate::http;
use crate::telemetry::{Endpoint, LogFormat};

/// Rolling-contact stress service: tractions, stick and slip zones and forces between wheel and rail.
#[derive(Debug, Parser)]
#[command(name = "railhead", version, about)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// What can be started.
#[derive(Debug, Subcommand)]
enum Command {
    /// Serve the HTTP API and solve what is submitted.
    Serve(ServeArgs),
    /// Solve one case without a server; the result goes to standard output.
    ///
    /// Exit code 0: solved; 1: no answer; 2: the case is faulty.
    Solve(SolveArgs),
    /// Make, list and revoke API keys; also while the service runs.
    Keys(KeysArgs),
    /// Copy the data folder, also while the service runs; a service can be started on the copy.
    Backup(BackupArgs),
    /// Print the settings that `serve` would run with and where each comes from, as JSON; takes the flags of `serve`.
    Config(ServeArgs),
    /// Ask a running service whether it is ready; exit code 0 if it is, 1 if not.
    Healthcheck(HealthcheckArgs),
    /// Print the contract of the HTTP API (OpenAPI 3.1, JSON).
    Openapi,
}

/// Settings of `serve`.
#[derive(Debug, Clone, Args)]
pub struct ServeArgs {
    /// Address and port to listen on; port 0 takes a free one, which the log event `listening` names.
    #[arg(
        long,
        env = "RAILHEAD_LISTEN",
        default_value = "127.0.0.1:8080",
        value_name = "ADDRESS:PORT",
        value_parser = address
    )]
    pub listen: SocketAddr,
    /// Folder of the job table and the results; created if it is not there. One process at a time.
    #[arg(
        long,
        env = "RAILHEAD_DATA_DIR",
        default_value = "./railhead-data",
        value_name = "FOLDER"
    )]
    pub data_dir: PathBuf,
    /// Number of jobs solved at the same time, each on a thread of its own [default: cores − 1, at least 1].
    #[arg(long, env = "RAILHEAD_WORKERS", value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub workers: Option<u16>,
    #[command(flatten)]
    pub case: CaseArgs,
    /// Attempts at a job whose worker is lost each time, before it fails.
    #[arg(long, env = "RAILHEAD_ATTEMPTS_MAX", default_value_t = 5, value_name = "N",
          value_parser = clap::value_parser!(u32).range(1..))]
    pub attempts_max: u32,
    /// Queued jobs beyond which new ones are turned away.
    #[arg(long, env = "RAILHEAD_QUEUE_MAX", default_value_t = 300_000, value_name = "N",
          value_parser = clap::value_parser!(u64).range(1..))]
    pub queue_max: u64,
    /// Answer a case that is identical to one solved before with that result, without solving it again.
    #[arg(long, env = "RAILHEAD_CACHE", default_value_t = true, value_name = "BOOL",
          action = clap::ArgAction::Set)]
    pub cache: bool,
    /// How long ended jobs and their results are kept, such as `30d` or `12h`; `forever`: until they are deleted.
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
    /// Queued jobs of one tenant beyond which its new ones are turned away.
    #[arg(long, env = "RAILHEAD_TENANT_QUEUE_MAX", default_value_t = 250_000, value_name = "N",
          value_parser = clap::value_parser!(u64).range(1..))]
    pub tenant_queue_max: u64,
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
    /// none are made.
    #[arg(long, env = "RAILHEAD_OTLP_ENDPOINT", value_name = "URL")]
    pub otlp_endpoint: Option<Endpoint>,
    #[command(flatten)]
    pub worker: WorkerArgs,
    #[command(flatten)]
    pub http: HttpArgs,
    #[command(flatten)]
    pub log: LogArgs,
}

/// How long ended jobs are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Retention(pub Option<Duration>);

/// Reads a time such as `30d`, `1w` or `90m`, or `forever`.
fn retention(text: &str) -> Result<Retention, String> {
    if text == "forever" {
        return Ok(Retention(None));
    }
    let wrong = "allowed are `forever` or a time of at least 1 s such as `12h`, `30d`, `8w`";
    let span: jiff::Span = text.parse().map_err(|_| wrong.to_owned())?;
    let seconds = span
        .total((
            jiff::Unit::Second,
            jiff::SpanRelativeTo::days_are_24_hours(),
        ))
        .map_err(|_| wrong.to_owned())?;
    match Duration::try_from_secs_f64(seconds) {
        Ok(time) if time >= Duration::from_secs(1) => Ok(Retention(Some(time))),
        _ => Err(wrong.to_owned()),
    }
}

/// When requests without an API key are answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Anonymous {
    /// While the service listens on a loopback address.
    Loopback,
    /// On every address: whoever reaches the port may use the service.
    Always,
    /// Not at all.
    Never,
}

impl Anonymous {
    /// Are requests without a key answered on this address?
    fn on(self, address: SocketAddr) -> bool {
        match self {
            Anonymous::Loopback => address.ip().is_loopback(),
            Anonymous::Always => true,
            Anonymous::Never => false,
        }
    }
}

/// Reads an origin: scheme and authority, nothing else.
fn origin(text: &str) -> Result<String, String> {
    let rest = text
        .strip_prefix("https://")
        .or_else(|| text.strip_prefix("http://"));
    let plain = |rest: &str| {
        !rest.is_empty()
            && rest
                .bytes()
                .all(|byte| byte.is_ascii_graphic() && !b"/*?#@".contains(&byte))
    };
    if rest.is_some_and(plain) {
        return Ok(text.to_owned());
    }
    Err(
        "an origin is `http://` or `https://` and a host, perhaps with a port, and no path"
            .to_owned(),
    )
}

/// What one case may use.
#[derive(Debug, Clone, Copy, Args)]
pub struct CaseArgs {
    /// Estimated memory beyond which a case is refused, in MiB.
    #[arg(long, env = "RAILHEAD_MEMORY_LIMIT_MB", default_value_t = 2048, value_name = "MIB",
          value_parser = clap::value_parser!(u64).range(1..=1 << 30))]
    pub memory_limit_mb: u64,
    /// Memory for operators of meshes, in MiB, kept for the next cases of the same shape and shared by all workers; 0: none are kept.
    #[arg(long, env = "RAILHEAD_OPERATOR_STORE_MB", default_value_t = BYTES_DEFAULT >> 20, value_name = "MIB",
          value_parser = clap::value_parser!(u64).range(..=1 << 30))]
    pub operator_store_mb: u64,
}

/// How to log.
#[derive(Debug, Clone, Args)]
pub struct LogArgs {
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
    fn worker_count(&self) -> usize {
        self.workers.map_or_else(
            || available_parallelism().map_or(1, |cores| cores.get().saturating_sub(1).max(1)),
            usize::from,
        )
    }

    fn shutdown_grace(&self) -> Duration {
        Duration::from_secs(u64::from(self.shutdown_grace_s))
    }

    /// How long connections are still accepted after a signal: whoever stops a service at a terminal does not want to
    /// wait for a load balancer.
    fn drain_delay(&self, signal: &str) -> Duration {
        match signal {
            "SIGTERM" => Duration::from_secs(u64::from(self.drain_delay_s)),
            _ => Duration::ZERO,
        }
    }
}

impl CaseArgs {
    fn limits(self) -> Limits {
        Limits {
            memory_bytes: self.memory_limit_mb << 20,
            ..Limits::default()
        }
    }

    fn operators(self) -> OperatorStore {
        OperatorStore::new(self.operator_store_mb << 20)
    }
}

/// Reads the command line, does what it says, and returns the exit code.
#[must_use]
pub fn run() -> ExitCode {
    let mut command = Cli::command();
    let given = command.get_matches_mut();
    let cli = Cli::from_arg_matches(&given).unwrap_or_else(|error| error.exit());
    let done = match cli.command {
        Command::Serve(args) => serve::run(&args),
        Command::Solve(args) => solve::run(&args),
        Command::Config(args) => match (
            command.find_subcommand("config"),
            given.subcommand_matches("config"),
        ) {
            (Some(command), Some(given)) => print(&config::describe(command, given, &args)),
            _ => unreachable!("the subcommand was read from these"),
        },
        Command::Backup(args) => backup::run(&args),
        Command::Keys(args) => keys::run(&args),
        Command::Healthcheck(args) => healthcheck::run(&args),
        Command::Openapi => print(&http::openapi_json()),
    };
    done.unwrap_or_else(|error| {
        complain(&reasons(&error));
        ExitCode::FAILURE
    })
}

/// Variables named `RAILHEAD_…` that no command reads: most likely misspelt.
fn unknown_variables() -> Vec<String> {
    let command = Cli::command();
    let mut known = Vec::new();
    let mut commands = vec![&command];
    while let Some(command) = commands.pop() {
        let names = command.get_arguments().filter_map(clap::Arg::get_env);
        known.extend(names.map(|name| name.to_string_lossy().into_owned()));
        commands.extend(command.get_subcommands());
    }
    let given = std::env::vars_os().map(|(name, _)| name.to_string_lossy().into_owned());
    let ours =
        given.filter(|name| name.starts_with("RAILHEAD_") && !name.starts_with("RAILHEAD_TEST_"));
    ours.filter(|name| !known.contains(name)).collect()
}

/// Reads an address to listen on.
fn address(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| {
        "allowed is an IP address with a port, such as `127.0.0.1:8080`, `0.0.0.0:8080` or `[::1]:8080`; names are not looked up"
            .to_owned()
    })
}

/// Writes to standard output; a reader that has gone away is no fault of ours.
fn print(text: &str) -> anyhow::Result<ExitCode> {
    use std::io::{ErrorKind, Write};
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{}", text.trim_end()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// An error with its causes; a cause that was told already is not told again.
fn reasons(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain() {
        let cause = cause.to_string();
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

/// Writes one line to standard error.
fn complain(text: &str) {
    use std::io::Write;
    // If even standard error is closed there is nobody left to tell.
    let _ = writeln!(std::io::stderr(), "railhead: {text}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn a_cause_is_told_once() {
        let inner = anyhow::anyhow!("no such file");
        let error = inner.context("the folder: no such file").context("backup");
        assert_eq!(reasons(&error), "backup: the folder: no such file");
    }

    #[test]
    fn every_setting_of_a_service_has_its_variable() {
        let command = Cli::command();
        let serve = command.find_subcommand("serve").unwrap();
        for arg in serve
            .get_arguments()
            .filter(|arg| arg.get_long() != Some("help"))
        {
            let flag = arg.get_long().unwrap();
            let variable = format!("RAILHEAD_{}", flag.to_uppercase().replace('-', "_"));
            assert_eq!(
                arg.get_env().and_then(|name| name.to_str()),
                Some(variable.as_str())
            );
        }
    }

    #[test]
    fn every_setting_of_a_service_is_in_the_manual() {
        // Read and not compiled in: the image is built without the documents.
        let manual = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/operations.md");
        let manual = std::fs::read_to_string(manual).expect("the manual");
        let command = Cli::command();
        let serve = command.find_subcommand("serve").unwrap();
        for flag in serve.get_arguments().filter_map(clap::Arg::get_long) {
            let there = flag == "help" || manual.contains(&format!("--{flag}"));
            assert!(there, "--{flag} is not in docs/operations.md");
        }
    }

    #[test]
    fn a_retention_is_a_time_with_its_unit_or_forever() {
        let days = |days: u64| Ok(Retention(Some(Duration::from_secs(days * 24 * 3600))));
        assert_eq!(retention("forever"), Ok(Retention(None)));
        assert_eq!(retention("30d"), days(30));
        assert_eq!(retention("2w"), days(14));
        assert_eq!(retention("24h"), days(1));
        for wrong in ["", "30", "0s", "-1d", "1 month", "soon"] {
            assert!(retention(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn without_flags_one_core_is_left_to_the_service() {
        let Command::Serve(args) = Cli::try_parse_from(["railhead", "serve"]).unwrap().command
        else {
            panic!("serve was asked for");
        };
        let cores = available_parallelism().unwrap().get();
        assert_eq!(args.worker_count(), if cores > 1 { cores - 1 } else { 1 });
        assert!(Cli::try_parse_from(["railhead", "serve", "--workers", "0"]).is_err());
    }
}
