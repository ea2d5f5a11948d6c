//! All commands with their flags and environment variables.
use std::net::SocketAddr;
use std::path::PathBuf;
use std::thread::available_parallelism;
use std::time::Duration;

use clap::{ArgAction, Args, CommandFactory, Parser, Subcommand};

use crate::contact::case::solver::Limits;
use crate::contact::rolling::operator_store::{BYTES_DEFAULT, OperatorStore};
use crate::http::extract::query;
use crate::http::{AddressRange, HttpOptions};
use crate::jobs::Options;
use crate::jobs::options::{DATA_DIR_DEFAULT, Database, NotifyMode, seconds};
use crate::jobs::result_place::url::{ResultsPlace, ResultsUrl};
use crate::telemetry::{Endpoint, LogFormat};

/// When requests without an API key are answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Anonymous {
    /// Only if the service listens on a loopback address.
    Loopback,
    /// On every address: everyone who can reach the port can use the service.
    Always,
    /// Never.
    Never,
}

impl Anonymous {
    /// Whether requests without a key are answered on this address.
    #[must_use]
    pub(super) fn on(self, address: SocketAddr) -> bool {
        match self {
            Anonymous::Loopback => address.ip().is_loopback(),
            Anonymous::Always => true,
            Anonymous::Never => false,
        }
    }
}

/// Parses an origin, scheme and authority, into the form in which browsers send it.
pub(super) fn origin(text: &str) -> Result<String, String> {
    let text = text.trim().to_ascii_lowercase();
    let (scheme, authority) = text.split_once("://").unwrap_or_default();
    let default_port = match scheme {
        "http" => ":80",
        "https" => ":443",
        _ => return Err("an origin begins with `http://` or `https://`".to_owned()),
    };
    let authority = authority.strip_suffix(default_port).unwrap_or(authority);
    let stray = |of: char| !of.is_ascii_graphic() || "/*?#@".contains(of);
    match authority.chars().find(|of| stray(*of)) {
        Some(stray) => Err(format!(
            "an origin is a scheme and a host, perhaps with a port; `{stray}` is not allowed in them"
        )),
        None if authority.is_empty() => Err("the host is missing".to_owned()),
        None => Ok(format!("{scheme}://{authority}")),
    }
}

/// Parses an address to listen on.
pub(super) fn address(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| {
        "allowed is an IP address with a port, such as `127.0.0.1:8080`, `0.0.0.0:8080` or `[::1]:8080`; names are not looked up"
            .to_owned()
    })
}

/// Parses a label of a key, by the rule for labels of cases.
pub(super) fn bound_label(text: &str) -> Result<(String, String), String> {
    query::new_label().read(text).map_err(str::to_owned)
}

/// Limits of one case.
#[derive(Debug, Clone, Copy, Args)]
#[command(next_help_heading = "Solver")]
pub(super) struct CaseArgs {
    /// Maximum estimated memory of a case in MiB; a larger case is refused.
    #[arg(long, default_value_t = 2048, value_name = "MIB",
          value_parser = clap::value_parser!(u64).range(1..=1 << 30))]
    pub memory_limit_mb: u64,
    /// Memory in MiB for mesh operators, which all workers share and later cases of the same shape reuse; 0: none are stored.
    #[arg(long, default_value_t = BYTES_DEFAULT >> 20, value_name = "MIB",
          value_parser = clap::value_parser!(u64).range(..=1 << 30))]
    pub operator_store_mb: u64,
}

impl CaseArgs {
    /// The limits that cases are checked against.
    #[must_use]
    pub(super) fn limits(self) -> Limits {
        Limits {
            memory_bytes: self.memory_limit_mb << 20,
            operator_store_bytes: self.operator_store_mb << 20,
            ..Limits::default()
        }
    }

    /// The store of operators that all solves share.
    #[must_use]
    pub(super) fn operators(self) -> OperatorStore {
        OperatorStore::new(self.operator_store_mb << 20)
    }
}

/// The data folder of a command that runs at the same time as the service.
#[derive(Debug, Clone, Args)]
pub(super) struct DataFolderArgs {
    /// Data folder of the service.
    #[arg(long, default_value = DATA_DIR_DEFAULT, value_name = "FOLDER")]
    pub(crate) data_dir: PathBuf,
}

/// The shared database.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Shared database")]
pub(super) struct DatabaseArgs {
    /// PostgreSQL database (15 or later) that stores jobs and results and that any number of nodes share, such as
    /// `postgres://user:password@host/database`. Without it, they are stored in the data folder. Requires a build with the feature
    /// `cluster`.
    #[arg(long, hide_env_values = true, value_name = "URL")]
    pub database_url: Option<String>,
    /// Maximum number of database connections of this process, in addition to one that receives notifications.
    #[arg(long, default_value_t = 10, value_name = "N",
          value_parser = clap::value_parser!(u32).range(2..))]
    pub database_connections: u32,
    /// URL for notifications between nodes, if `--database-url` points to a pooler in transaction mode (such as PgBouncer): the same
    /// database without the pooler. `none`: no notifications; nodes poll and see changes up to a second later. Default: the value of
    /// `--database-url`.
    #[arg(long, hide_env_values = true, value_name = "URL")]
    pub database_direct_url: Option<String>,
    #[command(flatten)]
    pub results: ResultsArgs,
}

/// The location of large results with a shared database.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Shared database")]
pub(super) struct ResultsArgs {
    /// Location of results larger than 32 KiB if there is a database: `s3://bucket/prefix` (keys, region and address from the usual
    /// `AWS_…` variables) or `file:///folder`. Without it, they are stored in the database. Buckets require the feature `cluster`. All
    /// nodes of a database must use the same location.
    #[arg(long, value_name = "URL")]
    pub results_url: Option<ResultsUrl>,
    /// Confirms that the folder in `--results-url` is the same one on every node (a network file system).
    #[arg(
        long,
        default_value_t = false,
        action = ArgAction::Set,
        num_args = 0..=1,
        default_missing_value = "true",
        value_name = "BOOL"
    )]
    pub results_shared: bool,
}

impl ResultsArgs {
    /// The location, if given.
    #[must_use]
    pub(super) fn place(&self) -> Option<ResultsPlace> {
        Some(ResultsPlace {
            url: self.results_url.clone()?,
            shared: self.results_shared,
        })
    }
}

impl DatabaseArgs {
    /// The database, if given.
    #[must_use]
    pub(super) fn database(&self) -> Option<Database> {
        Some(Database {
            url: self.database_url.clone()?,
            connections: self.database_connections,
            notify_mode: match self.database_direct_url.as_deref() {
                None => NotifyMode::Database,
                Some("none") => NotifyMode::Off,
                Some(url) => NotifyMode::Direct(url.to_owned()),
            },
        })
    }
}

/// The database of a command.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Shared database")]
pub(super) struct DatabaseUrlArgs {
    /// PostgreSQL 15 or later, such as `postgres://user:password@host/database`.
    #[arg(long, hide_env_values = true, value_name = "URL")]
    pub database_url: String,
}

/// Settings of `doctor`.
#[derive(Debug, Clone, Args)]
pub(super) struct DoctorArgs {
    #[command(flatten)]
    pub database: DatabaseUrlArgs,
    #[command(flatten)]
    pub results: ResultsArgs,
}

/// Settings of `serve`.
#[derive(Debug, Clone, Args)]
pub(super) struct ServeArgs {
    /// IP address and port to listen on. Port 0 selects a free port; the log event `listening` contains it.
    #[arg(
        long,
        help_heading = "Service",
        default_value = "127.0.0.1:8080",
        value_name = "ADDRESS:PORT",
        value_parser = address
    )]
    pub listen: SocketAddr,
    #[command(flatten)]
    pub database: DatabaseArgs,
    /// Number of jobs solved at the same time, each on its own thread. 0: other nodes solve the jobs, which requires a database
    /// [default: cores − 1, at least 1].
    #[arg(long, help_heading = "Jobs", value_name = "N")]
    pub workers: Option<u16>,
    #[command(flatten)]
    pub case: CaseArgs,
    /// Seconds for which running jobs may continue after a stop signal; after that they return to the queue.
    #[arg(long = "shutdown-grace-s", help_heading = "Service", default_value = "10", value_name = "SECONDS", value_parser = seconds(..))]
    pub shutdown_grace: Duration,
    /// Seconds between SIGTERM, when `/readyz` changes to 503, and the closing of the port; connections are still accepted during this
    /// time. After SIGINT the port closes at once.
    #[arg(long = "drain-delay-s", help_heading = "Service", default_value = "2", value_name = "SECONDS", value_parser = seconds(..))]
    pub drain_delay: Duration,
    /// When requests without an API key are answered. The service does not start if there are no keys and anonymous requests are not
    /// answered.
    #[arg(long, help_heading = "Access", value_enum, default_value = "loopback")]
    pub anonymous: Anonymous,
    /// Maximum number of requests per second of one API key, with bursts of twice this number; 0: no limit. Requests without a key are
    /// counted by client address; those from this machine are not counted.
    #[arg(long, help_heading = "Access", default_value_t = 200, value_name = "N")]
    pub rate_limit: u32,
    /// Comma-separated origins of web pages that may read responses, such as `https://dashboard.example`.
    #[arg(long, help_heading = "Access", value_delimiter = ',', value_name = "ORIGIN", value_parser = origin)]
    pub cors_origin: Vec<String>,
    /// Collector that receives spans of requests and jobs by OTLP over HTTP, such as `http://127.0.0.1:4318`. Without it, no spans are
    /// recorded. Requires a build with the feature `otlp`.
    #[arg(long, help_heading = "Log and traces", value_name = "URL")]
    pub otlp_endpoint: Option<Endpoint>,
    #[command(flatten)]
    pub jobs: Options,
    /// IP address and port of a second listener that serves only `/healthz`, `/readyz` and `/metrics`. Without it, only the first
    /// listener serves them, with a few connections reserved for them.
    #[arg(long, help_heading = "Service", value_name = "ADDRESS:PORT", value_parser = address)]
    pub probe_listen: Option<SocketAddr>,
    #[command(flatten)]
    pub http: HttpOptions,
    /// Comma-separated addresses of trusted proxies, such as `10.0.0.0/8`. The service takes client addresses from their headers
    /// `Forwarded` or `X-Forwarded-For`, counts wrong keys and requests without a key by these client addresses, and does not apply
    /// `--address-connections-max` to the proxies.
    #[arg(
        long,
        help_heading = "Access",
        value_delimiter = ',',
        value_name = "ADDRESSES"
    )]
    pub trusted_proxies: Vec<AddressRange>,
    /// Comma-separated host names that requests without a key may have in `Host`, in addition to IP addresses and `localhost`. Other
    /// names are refused, because a web page could point its own name to this service (DNS rebinding).
    #[arg(
        long,
        help_heading = "Access",
        value_delimiter = ',',
        value_name = "NAME"
    )]
    pub allowed_host: Vec<String>,
    #[command(flatten)]
    pub log: LogArgs,
}

/// Settings of the log.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Log and traces")]
pub(super) struct LogArgs {
    /// Format of log lines.
    #[arg(long, value_enum, default_value = "text")]
    pub log_format: LogFormat,
    /// Log filter, such as `info,railhead_jobs=debug`.
    #[arg(long, default_value = "info", value_name = "FILTER")]
    pub log: String,
}

impl ServeArgs {
    /// Number of workers as given, or one less than the number of cores.
    #[must_use]
    pub(super) fn worker_count(&self) -> usize {
        self.workers.map_or_else(
            || available_parallelism().map_or(1, |cores| cores.get().saturating_sub(1).max(1)),
            usize::from,
        )
    }

    /// How long connections are accepted after a signal. A stop from a terminal does not wait for load balancers.
    #[must_use]
    pub(super) fn drain_delay(&self, signal: &str) -> Duration {
        match signal {
            "SIGTERM" => self.drain_delay,
            _ => Duration::ZERO,
        }
    }
}

/// Rolling-contact stress service: computes tractions, stick and slip zones and forces of bodies in rolling contact.
#[derive(Debug, Parser)]
#[command(name = "railhead", version)]
pub(super) struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Serve the HTTP API and solve the submitted jobs.
    Serve(ServeArgs),
    /// Solve jobs that other nodes of the same database accept; has the flags of `serve` and serves only probes.
    Worker(ServeArgs),
    /// Create the job table in a shared database, or upgrade it to this version.
    Migrate(DatabaseUrlArgs),
    /// Check a shared database; exit code 1 if there is a problem.
    Doctor(DoctorArgs),
    /// Solve one case without a server and print the result to standard output.
    ///
    /// Exit code 0: solved; 1: no solution; 2: the case has faults.
    Solve(SolveArgs),
    /// Create, list and revoke API keys; also possible while the service runs.
    Keys(KeysArgs),
    /// Copy the data folder; also possible while the service runs. A service can be started on the copy.
    Backup(BackupArgs),
    /// Move the contents of a data folder into a shared database; no service may use the folder.
    Move(MoveArgs),
    /// Move the large results of a database to another location; no node may use the database.
    MoveResults(MoveResultsArgs),
    /// Print the settings of `serve` and the source of each as JSON; has the flags of `serve`.
    Config(ServeArgs),
    /// Check whether a running service is ready; exit code 0 if it is, 1 if not.
    Healthcheck(HealthcheckArgs),
    /// Print the OpenAPI 3.1 description of the HTTP API as JSON.
    Openapi,
}

/// Settings of `backup`.
#[derive(Debug, Clone, Args)]
pub(super) struct BackupArgs {
    /// Folder to create; it must not exist.
    #[arg(long, value_name = "FOLDER")]
    pub to: PathBuf,
    #[command(flatten)]
    pub folder: DataFolderArgs,
}

/// Settings of `move`.
#[derive(Debug, Clone, Args)]
pub(super) struct MoveArgs {
    #[command(flatten)]
    pub folder: DataFolderArgs,
    #[command(flatten)]
    pub database: DatabaseUrlArgs,
    #[command(flatten)]
    pub results: ResultsArgs,
}

/// Settings of `move-results`.
#[derive(Debug, Clone, Args)]
pub(super) struct MoveResultsArgs {
    #[command(flatten)]
    pub database: DatabaseUrlArgs,
    #[command(flatten)]
    pub results: ResultsArgs,
}

/// Settings of `keys`.
#[derive(Debug, Clone, Args)]
pub(super) struct KeysArgs {
    #[command(subcommand)]
    pub action: KeysAction,
}

/// Actions on API keys.
#[derive(Debug, Clone, Subcommand)]
pub(super) enum KeysAction {
    /// Create a key and print it; it is not shown again.
    Create {
        /// Tenant whose jobs the key gives access to. Keys of the tenant `operator` may also read `/metrics`.
        #[arg(long, value_name = "TENANT")]
        tenant: String,
        /// Purpose of the key.
        #[arg(long, value_name = "TEXT")]
        name: Option<String>,
        /// Make the key read-only: it reads the tenant's data, checks cases and evaluates rows, but cannot submit, cancel or delete.
        #[arg(long)]
        read_only: bool,
        /// Restrict the key to jobs and batches with this label, and add the label to its submissions; may be repeated up to 8 times.
        #[arg(long = "label", value_name = "KEY:VALUE", value_parser = bound_label)]
        labels: Vec<(String, String)>,
        #[command(flatten)]
        folder: DataFolderArgs,
        #[command(flatten)]
        database: DatabaseArgs,
    },
    /// List all keys, without their secrets.
    List {
        #[command(flatten)]
        folder: DataFolderArgs,
        #[command(flatten)]
        database: DatabaseArgs,
    },
    /// Revoke a key; a running service refuses it within seconds.
    Revoke {
        /// Id of the key, from `railhead keys list`.
        #[arg(value_name = "ID")]
        id: String,
        #[command(flatten)]
        folder: DataFolderArgs,
        #[command(flatten)]
        database: DatabaseArgs,
    },
}

/// Settings of `solve`.
#[derive(Debug, Clone, Args)]
pub(super) struct SolveArgs {
    /// File with the case as JSON, or `-` for standard input.
    #[arg(value_name = "CASE.JSON")]
    pub file: PathBuf,
    #[command(flatten)]
    pub case: CaseArgs,
}

/// Settings of `healthcheck`.
#[derive(Debug, Clone, Args)]
pub(super) struct HealthcheckArgs {
    /// URL to request, with `http://` [default: `/readyz` at the address in RAILHEAD_PROBE_LISTEN or RAILHEAD_LISTEN, or else at
    /// 127.0.0.1:8080].
    #[arg(long, env = "RAILHEAD_HEALTHCHECK_URL", value_name = "URL")]
    pub url: Option<String>,
    /// Address and port of the service's listener for probes, if it has one.
    #[arg(long, value_name = "ADDRESS:PORT", value_parser = address)]
    pub probe_listen: Option<SocketAddr>,
    /// Address and port on which the service listens.
    #[arg(
        long,
        default_value = "127.0.0.1:8080",
        value_name = "ADDRESS:PORT",
        value_parser = address
    )]
    pub listen: SocketAddr,
}

/// Flags that no variable sets.
const WITHOUT_VARIABLE: [&str; 5] = ["to", "tenant", "name", "read-only", "label"];

/// The command line. The flag `--some-name` is also set by the variable `RAILHEAD_SOME_NAME`.
#[must_use]
pub(super) fn command_line() -> clap::Command {
    with_variables(Cli::command())
}

fn with_variables(command: clap::Command) -> clap::Command {
    let of_flag = |flag: clap::Arg| {
        let name = flag
            .get_long()
            .filter(|name| !WITHOUT_VARIABLE.contains(name));
        match name.filter(|_| flag.get_env().is_none()) {
            Some(name) => {
                let name = name.to_uppercase().replace('-', "_");
                flag.env(&*format!("RAILHEAD_{name}").leak())
            }
            None => flag,
        }
    };
    command.mut_args(of_flag).mut_subcommands(with_variables)
}

/// Variables named `RAILHEAD_…` that no command reads; most likely misspelt.
#[must_use]
pub(super) fn unknown_variables() -> Vec<String> {
    let command = command_line();
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

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

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

    #[test]
    fn the_command_line_is_consistent() {
        command_line().debug_assert();
    }

    #[test]
    fn every_setting_of_a_service_has_its_variable() {
        let command = command_line();
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
        // Read at run time, because the image is built without the documents.
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
    fn without_flags_one_core_is_left_to_the_service() {
        let Command::Serve(args) = Cli::try_parse_from(["railhead", "serve"]).unwrap().command
        else {
            panic!("serve was asked for");
        };
        let cores = std::thread::available_parallelism().unwrap().get();
        assert_eq!(args.worker_count(), if cores > 1 { cores - 1 } else { 1 });
        let none = Cli::try_parse_from(["railhead", "serve", "--workers", "0"]);
        assert!(matches!(none.unwrap().command, Command::Serve(args) if args.worker_count() == 0));
    }
}
