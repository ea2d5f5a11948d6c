//! What can be started, and with which settings? Every command, flag and environment variable.
//!
//! | to find | look in |
//! |---|---|
//! | a command or flag | [`commands`], [`Options`](crate::jobs::Options), [`HttpOptions`](crate::http::HttpOptions) |
//! | in which order a service starts and stops | [`serve`] |

mod backup;
mod commands;
mod config;
mod healthcheck;
mod keys;
#[cfg(feature = "cluster")]
mod migrate;
mod output;
#[cfg(feature = "cluster")]
mod relocate;
mod serve;
mod solve;

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches};

use crate::cli::commands::{Cli, Command};
use crate::cli::output::{print, print_error, reasons};
use crate::cli::serve::Role;
use crate::http;
#[cfg(not(feature = "cluster"))]
use crate::jobs::JobsError;

/// Reads the command line, does what it says, and returns the exit code.
#[must_use]
pub fn run() -> ExitCode {
    let mut command = Cli::command();
    let given = command.get_matches_mut();
    let cli = Cli::from_arg_matches(&given).unwrap_or_else(|error| error.exit());
    let done = match cli.command {
        Command::Serve(args) => serve::run(&args, Role::Serve),
        Command::Worker(args) => serve::run(&args, Role::Work),
        #[cfg(feature = "cluster")]
        Command::Migrate(args) => migrate::run(&args),
        #[cfg(feature = "cluster")]
        Command::Doctor(args) => migrate::doctor(&args),
        Command::Solve(args) => solve::run(&args),
        Command::Config(args) => match (
            command.find_subcommand("config"),
            given.subcommand_matches("config"),
        ) {
            (Some(command), Some(given)) => print(&config::describe(command, given, &args)),
            _ => unreachable!("the subcommand was read from these"),
        },
        #[cfg(feature = "cluster")]
        Command::Move(args) => relocate::run(&args),
        #[cfg(feature = "cluster")]
        Command::MoveResults(args) => relocate::run_results(&args),
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
