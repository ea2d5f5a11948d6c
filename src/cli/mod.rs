//! The command line: commands, flags and environment variables.
//!
//! [`commands`], [`Options`](crate::jobs::Options) and [`HttpOptions`](crate::http::HttpOptions) declare the flags;
//! [`serve`] starts and stops a service.

mod backup;
mod commands;
mod config;
#[cfg(feature = "cluster")]
mod database;
mod healthcheck;
mod keys;
mod output;
mod serve;
mod solve;

use std::process::ExitCode;

use clap::FromArgMatches;

use crate::cli::commands::{Cli, Command, command_line};
use crate::cli::output::{print, print_error, reasons};
use crate::cli::serve::Role;
use crate::http;
#[cfg(not(feature = "cluster"))]
use crate::jobs::JobsError;

/// Parses the command line, runs the command, and returns the exit code.
#[must_use]
pub fn run() -> ExitCode {
    let mut command = command_line();
    let given = command.get_matches_mut();
    let cli = Cli::from_arg_matches(&given).unwrap_or_else(|error| error.exit());
    let done = match cli.command {
        Command::Serve(args) => serve::run(&args, Role::Serve),
        Command::Worker(args) => serve::run(&args, Role::Work),
        #[cfg(feature = "cluster")]
        Command::Migrate(args) => database::migrate(&args),
        #[cfg(feature = "cluster")]
        Command::Doctor(args) => database::doctor(&args),
        Command::Solve(args) => solve::run(&args),
        Command::Config(args) => match (
            command.find_subcommand("config"),
            given.subcommand_matches("config"),
        ) {
            (Some(command), Some(given)) => print(&config::describe(command, given, &args)),
            _ => unreachable!("the subcommand was read from these"),
        },
        #[cfg(feature = "cluster")]
        Command::Move(args) => database::move_folder(&args),
        #[cfg(feature = "cluster")]
        Command::MoveResults(args) => database::move_results(&args),
        #[cfg(not(feature = "cluster"))]
        Command::Migrate(_) | Command::Doctor(_) | Command::Move(_) | Command::MoveResults(_) => {
            Err(JobsError::NotBuilt {
                what: "PostgreSQL",
                feature: "cluster",
            }
            .into())
        }
        Command::Backup(args) => backup::run(&args),
        Command::Keys(args) => keys::run(&args),
        Command::Healthcheck(args) => healthcheck::run(&args),
        Command::Openapi => print(&http::openapi_json()),
    };
    done.unwrap_or_else(|error| {
        print_error(&reasons(&error));
        ExitCode::FAILURE
    })
}
