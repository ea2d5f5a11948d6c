//! A copy of a data folder that a service may be using at the same time.

use std::fs::DirBuilder;
use std::io;
use std::os::unix::fs::DirBuilderExt;
use std::path::Path;

use crate::disk_reserve::make_private_folder;
use crate::error::{JobsError, Result};
use crate::open_store::table_file;
use crate::store::Store;
use crate::store::sqlite::database::SqliteStore;
use crate::sync::blocking;

/// Copies the jobs and their results into a new folder, from which a service can be started.
///
/// The job table first, as it is at one moment, then the results outside it: they never change, and every result that
/// the copied table names was there before. Only a job that is deleted while the copy is made can lose its result in it.
///
/// # Errors
/// The folder `to` exists already, or something cannot be read or written.
pub async fn backup(data_dir: &Path, to: &Path) -> Result<()> {
    let failed = |path: &Path, source| JobsError::DataDir {
        path: path.to_owned(),
        source,
    };
    let table = table_file(data_dir);
    let store = SqliteStore::open_existing(&table).await?;
    let made = DirBuilder::new().mode(0o700).create(to);
    made.map_err(|source| failed(to, source))?;
    let copied = store.copy_into(&table_file(to)).await;
    store.close().await;
    copied?;
    let (from, to) = (data_dir.join("results"), to.join("results"));
    if !from.exists() {
        return Ok(());
    }
    let source = from.clone();
    let copied = blocking(move || copy_folder(&source, &to)).await?;
    copied.map_err(|source| failed(&from, source))
}

/// Copies what is there; what goes away meanwhile is left out.
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
