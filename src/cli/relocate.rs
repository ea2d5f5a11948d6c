//! `railhead move`: from a data folder into a database that several nodes share.

use std::process::ExitCode;

use anyhow::Context;

use crate::cli::commands::MoveArgs;
use crate::cli::output::print;
use crate::jobs::relocate::relocate;

/// Moves everything and says what it was.
pub(super) fn run(args: &MoveArgs) -> anyhow::Result<ExitCode> {
    let place = args.results.place();
    let moved = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .context("the async runtime could not be started")?
        .block_on(relocate(
            &args.data_dir,
            &args.database.database_url,
            place.as_ref(),
        ))?;
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
