//! Files of the data folder besides the table and the results: a reserve of room for a start on a full disk, because the job table
//! cannot be opened without a new file beside it; and nameless files for bodies that are being received.

use std::fs::{DirBuilder, File};
use std::io::{Result, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::Path;

/// Makes a folder with mode 0700, whatever the umask, if there is none.
pub(crate) fn make_private_folder(path: &Path) -> Result<()> {
    DirBuilder::new().recursive(true).mode(0o700).create(path)
}

const NAME: &str = "reserve";

/// SQLite needs 32 KiB for the index of its log, and a page or two for the log.
const BYTES: usize = 1 << 20;

/// Keeps the room, if it is not kept yet and the disk has it.
pub(crate) fn keep(data_dir: &Path) {
    let path = data_dir.join(NAME);
    if std::fs::metadata(&path).is_ok_and(|about| about.len() >= BYTES as u64) {
        return;
    }
    let written = write(&path);
    if written.is_err() {
        // What was written of it is of no use to anybody.
        let _ = std::fs::remove_file(path);
    }
}

fn write(path: &Path) -> Result<()> {
    let mut file = File::options()
        .create(true)
        .truncate(true)
        .write(true)
        .mode(0o600)
        .open(path)?;
    file.write_all(&vec![0; BYTES])?;
    file.sync_all()
}

/// Writes as many bytes into a nameless file of the folder.
pub(crate) fn try_write(data_dir: &Path) -> Result<()> {
    nameless(data_dir)?.write_all(&vec![0; BYTES])
}

/// An empty file without a name on the file system of a folder.
pub(crate) fn nameless(folder: &Path) -> Result<File> {
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

/// Gives the room back; `false` if none was kept.
pub(crate) fn give_back(data_dir: &Path) -> bool {
    std::fs::remove_file(data_dir.join(NAME)).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_given_back_once() {
        let folder = tempfile::tempdir().unwrap();
        for _ in 0..2 {
            keep(folder.path());
        }
        let kept = std::fs::metadata(folder.path().join(NAME)).unwrap();
        assert_eq!(kept.len(), BYTES as u64);
        assert!(give_back(folder.path()));
        assert!(!give_back(folder.path()));
        keep(&folder.path().join("that is not there"));
    }
}
