//! The command line: every command, and the settings of those beside `serve`.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::{Args, CommandFactory, Parser, Subcommand};

use crate::cli::case_args::CaseArgs;
use crate::cli::database_args::{
    DATA_DIR_DEFAULT, DATA_DIR_VARIABLE, DataFolderArgs, DatabaseArgs, DatabaseUrlArgs, DoctorArgs,
    ResultsArgs,
};
use crate::cli::serve_args::ServeArgs;
use crate::cli::values::{address, bound_label};

/// Rolling-contact stress service: tractions, stick and slip zones and forces between wheel and rail.
#[derive(Debug, Parser)]
#[command(name = "railhead", version, about)]
pub(super) struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

/// What can be started.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Serve the HTTP API and solve what is submitted.
    Serve(ServeArgs),
    /// Solve what is submitted to other nodes of the same database; takes the flags of `serve` and answers probes only.
    Worker(ServeArgs),
    /// Make the job table in a database that several nodes share, or bring it forward to this version.
    Migrate(DatabaseUrlArgs),
    /// Tell how the database is that several nodes share; exit code 1 if something is wrong.
    Doctor(DoctorArgs),
    /// Solve one case without a server; the result goes to standard output.
    ///
    /// Exit code 0: solved; 1: no answer; 2: the case is faulty.
    Solve(SolveArgs),
    /// Make, list and revoke API keys; also while the service runs.
    Keys(KeysArgs),
    /// Copy the data folder, also while the service runs; a service can be started on the copy.
    Backup(BackupArgs),
    /// Move what is in a data folder, which no service uses, into a database that several nodes share.
    Move(MoveArgs),
    /// Move the large results of a database, which no node uses, to another place.
    MoveResults(MoveResultsArgs),
    /// Print the settings that `serve` would run with and where each comes from, as JSON; takes the flags of `serve`.
    Config(ServeArgs),
    /// Ask a running service whether it is ready; exit code 0 if it is, 1 if not.
    Healthcheck(HealthcheckArgs),
    /// Print the contract of the HTTP API (OpenAPI 3.1, JSON).
    Openapi,
}

/// Settings of `backup`.
#[derive(Debug, Clone, Args)]
pub(super) struct BackupArgs {
    /// Folder to make; it must not be there yet.
    #[arg(long, value_name = "FOLDER")]
    pub to: PathBuf,
    #[command(flatten)]
    pub folder: DataFolderArgs,
}

/// Settings of `move`.
#[derive(Debug, Clone, Args)]
pub(super) struct MoveArgs {
    /// Data folder to move.
    #[arg(
        long,
        env = DATA_DIR_VARIABLE,
        default_value = DATA_DIR_DEFAULT,
        value_name = "FOLDER"
    )]
    pub data_dir: PathBuf,
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

/// What can be done with API keys.
#[derive(Debug, Clone, Subcommand)]
pub(super) enum KeysAction {
    /// Make a key and print it, this one time.
    Create {
        /// Whose jobs the key opens; keys of the tenant `operator` may also read `/metrics`.
        #[arg(long, value_name = "TENANT")]
        tenant: String,
        /// What the key is for.
        #[arg(long, value_name = "TEXT")]
        name: Option<String>,
        /// The key reads what is the tenant's, checks cases and evaluates rows, but makes, cancels and deletes nothing.
        #[arg(long)]
        read_only: bool,
        /// The key opens only jobs and batches with this label, and what it makes gets it; may be given up to 8 times.
        #[arg(long = "label", value_name = "KEY:VALUE", value_parser = bound_label)]
        labels: Vec<(String, String)>,
        #[command(flatten)]
        folder: DataFolderArgs,
        #[command(flatten)]
        database: DatabaseArgs,
    },
    /// List all keys without their secrets.
    List {
        #[command(flatten)]
        folder: DataFolderArgs,
        #[command(flatten)]
        database: DatabaseArgs,
    },
    /// Revoke a key; a running service refuses it within seconds.
    Revoke {
        /// Id of the key, as `list` shows it.
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
    /// What to ask; only plain `http://` is possible [default: `/readyz` at the address that RAILHEAD_PROBE_LISTEN or
    /// RAILHEAD_LISTEN says, else at 127.0.0.1:8080].
    #[arg(long, env = "RAILHEAD_HEALTHCHECK_URL", value_name = "URL")]
    pub url: Option<String>,
    /// The listener for probes of the service, if it has one.
    #[arg(long, env = "RAILHEAD_PROBE_LISTEN", value_name = "ADDRESS:PORT", value_parser = address)]
    pub probe_listen: Option<SocketAddr>,
    /// Where the service listens.
    #[arg(
        long,
        env = "RAILHEAD_LISTEN",
        default_value = "127.0.0.1:8080",
        value_name = "ADDRESS:PORT",
        value_parser = address
    )]
    pub listen: SocketAddr,
}

/// Variables named `RAILHEAD_…` that no command reads: most likely misspelt.
#[must_use]
pub(super) fn unknown_variables() -> Vec<String> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
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
