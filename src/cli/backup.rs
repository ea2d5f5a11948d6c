//! `railhead backup`: copies the data folder, also while a service uses it.

use std::path::Path;
use std::process::ExitCode;

use crate::cli::commands::BackupArgs;
use crate::cli::output::print;
use crate::cli::serve::block_on;
use crate::jobs::backup::backup;

/// Makes the copy and prints its path.
pub(super) fn run(args: &BackupArgs) -> anyhow::Result<ExitCode> {
    let parent = std::path::absolute(&args.to)?
        .parent()
        .map(Path::canonicalize);
    if let (Some(Ok(parent)), Ok(inside)) = (parent, args.folder.data_dir.canonicalize())
        && parent.starts_with(inside)
    {
        anyhow::bail!(
            "--to: `{}` is inside the data folder; name a folder outside of it",
            args.to.display()
        );
    }
    block_on(backup(&args.folder.data_dir, &args.to))??;
    print(&args.to.display().to_string())
}
