//! Processes with a wrong system clock, by libfaketime. Their monotonic clocks are unchanged, as on a machine whose clock was set wrong.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::skip;

/// Returns the path of the library, or `None` after reporting that it is not installed.
pub fn library() -> Option<PathBuf> {
    let folders = std::fs::read_dir("/usr/lib").into_iter().flatten();
    let folders = folders.filter_map(|folder| Some(folder.ok()?.path()));
    // Debian has a folder for each architecture. Other distributions have one folder for the library.
    let names = folders.flat_map(|folder| {
        ["faketime/libfaketimeMT.so.1", "libfaketimeMT.so.1"].map(|name| folder.join(name))
    });
    let found = names.into_iter().find(|file| file.is_file());
    if found.is_none() {
        skip("there is no libfaketime here (Debian: apt-get install libfaketime)");
    }
    found
}

/// Sets the clock of a program by an offset in a file, such as `+40` or `-40` seconds. The program reads the file again every second.
pub fn with_clock(command: &mut Command, library: &Path, file: &Path) {
    command
        .env("LD_PRELOAD", library)
        .env("FAKETIME_TIMESTAMP_FILE", file)
        .env("FAKETIME_CACHE_DURATION", "1")
        .env("FAKETIME_DONT_FAKE_MONOTONIC", "1")
        .env("NO_FAKE_STAT", "1");
}

/// Writes the offset of a clock in seconds, atomically.
pub fn set_ahead(file: &Path, seconds: i32) {
    let new = file.with_extension("new");
    std::fs::write(&new, format!("{seconds:+}\n")).expect("a file");
    std::fs::rename(new, file).expect("a file");
}
