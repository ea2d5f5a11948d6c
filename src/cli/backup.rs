//! `railhead backup`: copies the data folder, also while a service uses it.

use std::process::ExitCode;

use anyhow::Context;

use crate::cli::commands::BackupArgs;
use crate::cli::output::print;
use crate::jobs::backup::backup;

/// Makes the copy and prints its path.
pub(super) fn run(args: &BackupArgs) -> anyhow::Result<ExitCode> {
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .context("the async runtime could not be started")?
        .block_on(backup(&args.folder.data_dir, &args.to))?;
    print(&args.to.display().to_string())
}
