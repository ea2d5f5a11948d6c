//! Administration of a shared database: `railhead migrate`, `doctor`, `move` and `move-results`.

use std::process::ExitCode;

use anyhow::Context;

use crate::cli::commands::{DatabaseUrlArgs, DoctorArgs, MoveArgs, MoveResultsArgs};
use crate::cli::output::print;
use crate::cli::serve::block_on;
use crate::jobs::blobs::Copied;
use crate::jobs::relocate::relocate;
use crate::jobs::result_place::{change, examine_results};
use crate::jobs::store::postgres::doctor::examine;
use crate::jobs::store::postgres::schema::{self, Migrated};

/// Creates or upgrades the job table.
pub(super) fn migrate(args: &DatabaseUrlArgs) -> anyhow::Result<ExitCode> {
    let made = block_on(schema::migrate(&args.database_url))??;
    print(match made {
        Migrated::Made => "the job table was created",
        Migrated::Upgraded => "the job table was upgraded to the version of this program",
        Migrated::AlreadyCurrent => "the job table exists in a version that this program can use",
    })
}

/// Prints the checks of the database, one per line; exit code 1 if there is a problem.
pub(super) fn doctor(args: &DoctorArgs) -> anyhow::Result<ExitCode> {
    let url = &args.database.database_url;
    let findings = block_on(async {
        let mut findings = examine(url).await?;
        findings.push(examine_results(url, args.results.place().as_ref()).await?);
        anyhow::Ok(findings)
    })??;
    let lines = findings.iter().map(|finding| {
        let mark = if finding.wrong { "WRONG" } else { "ok" };
        format!("{mark}\t{}\t{}", finding.about, finding.says)
    });
    print(&lines.collect::<Vec<_>>().join("\n"))?;
    let wrong = findings.iter().any(|finding| finding.wrong);
    Ok(ExitCode::from(u8::from(wrong)))
}

/// Moves a data folder and prints the number of moved rows and results.
pub(super) fn move_folder(args: &MoveArgs) -> anyhow::Result<ExitCode> {
    let place = args.results.place();
    let moved = block_on(relocate(
        &args.folder.data_dir,
        &args.database.database_url,
        place.as_ref(),
    ))??;
    let mut lines: Vec<String> = moved
        .rows
        .iter()
        .map(|(table, rows)| format!("{table}\t{rows}"))
        .collect();
    lines.extend(copied_lines(moved.results));
    print(&lines.join("\n"))
}

/// Moves large results and prints their number.
pub(super) fn move_results(args: &MoveResultsArgs) -> anyhow::Result<ExitCode> {
    let place = args
        .results
        .place()
        .context("give the new location of the results with --results-url")?;
    let moved = block_on(change::move_results(&args.database.database_url, &place))??;
    let from = match moved.from.as_str() {
        "" => "the database",
        place => place,
    };
    let mut lines = vec![format!("from\t{from}"), format!("to\t{}", place.url)];
    lines.extend(copied_lines(moved.results));
    print(&lines.join("\n"))
}

fn copied_lines(copied: Copied) -> [String; 3] {
    [
        format!("large results\t{}", copied.results),
        format!("bytes of these\t{}", copied.bytes),
        format!("large results that are missing\t{}", copied.missing),
    ]
}
