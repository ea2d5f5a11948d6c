//! `railhead backup`: copies a data folder, also while a service uses it.

use std::fs::DirBuilder;
use std::io;
use std::os::unix::fs::DirBuilderExt;
use std::path::Path;

use crate::data_dir::make_private_folder;
use crate::data_dir::table_file;
use crate::error::{JobsError, Result};
use crate::store::Store;
use crate::store::sqlite::database::SqliteStore;
use crate::sync::blocking;

/// Copies jobs and results into a new folder, from which a service can be started.
///
/// The job table is copied first, as a snapshot. Results never change, and all results of the snapshot exist already. Only
/// a job that is deleted during the copy can lose its result.
///
/// # Errors
/// The folder `to` exists already, or a read or write failed.
pub async fn backup(data_dir: &Path, to: &Path) -> Result<()> {
    let table = table_file(data_dir);
    let store = SqliteStore::open_existing(&table).await?;
    let made = DirBuilder::new().mode(0o700).create(to);
    made.map_err(JobsError::at(to))?;
    let copied = store.copy_into(&table_file(to)).await;
    store.close().await;
    copied?;
    let (from, to) = (data_dir.join("results"), to.join("results"));
    if !from.exists() {
        return Ok(());
    }
    let source = from.clone();
    let copied = blocking(move || copy_folder(&source, &to)).await?;
    copied.map_err(JobsError::at(&from))
}

/// Copies a folder; files that disappear in the meantime are skipped.
fn copy_folder(from: &Path, to: &Path) -> io::Result<()> {
    make_private_folder(to)?;
    let entries = match std::fs::read_dir(from) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        entries => entries?,
    };
    for entry in entries {
        let path = entry?.path();
        let Some(name) = path.file_name() else {
            continue;
        };
        let copied = if path.is_dir() {
            copy_folder(&path, &to.join(name))
        } else {
            std::fs::copy(&path, to.join(name)).map(|_| ())
        };
        match copied {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            copied => copied?,
        }
    }
    Ok(())
}
