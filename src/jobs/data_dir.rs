//! Files of the data folder: job table, lock, mark of a clean shutdown, reserve of disk space, and unnamed spool files.
//!
//! The reserve lets a service start on a full disk, because SQLite needs a new file to open the job table.

use std::fs::{DirBuilder, File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use crate::error::{JobsError, Result};

/// The file that marks a job table as closed in good order.
const CLOSED: &str = "closed";

/// The path of the embedded job table.
#[must_use]
pub fn table_file(data_dir: &Path) -> PathBuf {
    data_dir.join("jobs.db")
}

/// Options to create or truncate a file with mode 0600.
fn private_file() -> OpenOptions {
    let mut options = File::options();
    options.create(true).truncate(true).write(true).mode(0o600);
    options
}

/// Creates the data folder if needed and locks it for this process. The system frees the lock when the process ends.
pub(crate) fn lock_folder(data_dir: &Path) -> Result<File> {
    make_private_folder(data_dir).map_err(JobsError::at(data_dir))?;
    let path = data_dir.join("lock");
    let file = private_file()
        .truncate(false)
        .open(&path)
        .map_err(JobsError::at(&path))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(JobsError::DataDirInUse(data_dir.to_owned())),
        Err(TryLockError::Error(source)) => Err(JobsError::at(&path)(source)),
    }
}

/// Marks the job table as closed in good order.
pub(crate) fn note_closed(data_dir: &Path) {
    let marked = private_file().open(data_dir.join(CLOSED));
    if let Err(error) = marked {
        tracing::debug!(%error, "the next start will check the job table");
    }
}

/// Removes the mark of [`note_closed`]; `false` if there was none.
pub(crate) fn take_closed_mark(data_dir: &Path) -> bool {
    std::fs::remove_file(data_dir.join(CLOSED)).is_ok()
}

/// Creates a folder with mode 0700, regardless of the umask, if it does not exist.
pub(crate) fn make_private_folder(path: &Path) -> io::Result<()> {
    DirBuilder::new().recursive(true).mode(0o700).create(path)
}

/// Name of the reserve.
const RESERVE: &str = "reserve";

/// SQLite needs 32 KiB for the index of its log, and a page or two for the log.
const RESERVE_BYTES: usize = 1 << 20;

/// Creates the reserve if it does not exist and the disk has room.
pub(crate) fn keep_reserve(data_dir: &Path) {
    let path = data_dir.join(RESERVE);
    if std::fs::metadata(&path).is_ok_and(|about| about.len() >= RESERVE_BYTES as u64) {
        return;
    }
    let written = write_reserve(&path);
    if written.is_err() {
        // A part of the reserve is of no use.
        let _ = std::fs::remove_file(path);
    }
}

fn write_reserve(path: &Path) -> io::Result<()> {
    let mut file = private_file().open(path)?;
    file.write_all(&vec![0; RESERVE_BYTES])?;
    file.sync_all()
}

/// Writes as many bytes as the reserve has into an unnamed file of the folder.
pub(crate) fn try_write(data_dir: &Path) -> io::Result<()> {
    nameless(data_dir)?.write_all(&vec![0; RESERVE_BYTES])
}

/// Creates an unnamed, empty file on the file system of a folder.
pub(crate) fn nameless(folder: &Path) -> io::Result<File> {
    let path = folder.join(format!("spool-{}", uuid::Uuid::now_v7()));
    let file = File::options()
        .read(true)
        .write(true)
        .create_new(true)
        .mode(0o600)
        .open(&path)?;
    std::fs::remove_file(&path)?;
    Ok(file)
}

/// Removes the reserve; `false` if there was none.
pub(crate) fn remove_reserve(data_dir: &Path) -> bool {
    std::fs::remove_file(data_dir.join(RESERVE)).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_given_back_once() {
        let folder = tempfile::tempdir().unwrap();
        for _ in 0..2 {
            keep_reserve(folder.path());
        }
        let kept = std::fs::metadata(folder.path().join(RESERVE)).unwrap();
        assert_eq!(kept.len(), RESERVE_BYTES as u64);
        assert!(remove_reserve(folder.path()));
        assert!(!remove_reserve(folder.path()));
        keep_reserve(&folder.path().join("that is not there"));
    }
}
