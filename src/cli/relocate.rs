//! `railhead move`: from a data folder into a database that several nodes share. `railhead move-results`: its results elsewhere.

use std::process::ExitCode;

use anyhow::Context;

use crate::cli::commands::{MoveArgs, MoveResultsArgs};
use crate::cli::output::print;
use crate::cli::serve::block_on;
use crate::jobs::relocate::relocate;
use crate::jobs::result_place::change::move_results;

/// Moves everything and says what it was.
pub(super) fn run(args: &MoveArgs) -> anyhow::Result<ExitCode> {
    let place = args.results.place();
    let moved = block_on(relocate(
        &args.data_dir,
        &args.database.database_url,
        place.as_ref(),
    ))??;
    let mut lines: Vec<String> = moved
        .rows
        .iter()
        .map(|(table, rows)| format!("{table}\t{rows}"))
        .collect();
    lines.push(format!("large results\t{}", moved.results));
    lines.push(format!("bytes of these\t{}", moved.result_bytes));
    lines.push(format!("large results that are missing\t{}", moved.missing));
    print(&lines.join("\n"))
}

/// Moves the results and says how many there were.
pub(super) fn run_results(args: &MoveResultsArgs) -> anyhow::Result<ExitCode> {
    let place = args
        .results
        .place()
        .context("give the new location of the results with --results-url")?;
    let moved = block_on(move_results(&args.database.database_url, &place))??;
    let from = match moved.from.as_str() {
        "" => "the database",
        place => place,
    };
    let lines = [
        format!("from\t{from}"),
        format!("to\t{}", place.url),
        format!("large results\t{}", moved.results),
        format!("bytes of these\t{}", moved.bytes),
        format!("large results that are missing\t{}", moved.missing),
    ];
    print(&lines.join("\n"))
}
