//! `railhead backup`: copies the data folder, also while a service uses it.

use std::process::ExitCode;

use crate::cli::commands::BackupArgs;
use crate::cli::output::print;
use crate::cli::serve::block_on;
use crate::jobs::backup::backup;

/// Makes the copy and prints its path.
pub(super) fn run(args: &BackupArgs) -> anyhow::Result<ExitCode> {
    block_on(backup(&args.folder.data_dir, &args.to))??;
    print(&args.to.display().to_string())
}
