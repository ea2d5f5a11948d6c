//! `railhead migrate` and `railhead doctor`: what an operator does to the database of several nodes.

use std::process::ExitCode;

use crate::cli::commands::{DatabaseUrlArgs, DoctorArgs};
use crate::cli::output::print;
use crate::cli::serve::block_on;
use crate::jobs::result_place::examine_results;
use crate::jobs::store::postgres::doctor::examine;
use crate::jobs::store::postgres::schema::{Migrated, migrate};

/// Makes the job table, or brings it forward.
pub(super) fn run(args: &DatabaseUrlArgs) -> anyhow::Result<ExitCode> {
    let made = block_on(migrate(&args.database_url))??;
    print(match made {
        Migrated::Made => "the job table was created",
        Migrated::Upgraded => "the job table was upgraded to the version of this program",
        Migrated::AlreadyCurrent => "the job table exists in a version that this program can use",
    })
}

/// Tells how the database is, one line per question; exit code 1 if something is wrong.
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
