//! Reference files that may be read next to the checkout but not be copied into it. Tests that need missing files print that they are skipped. Other
//! tests check the same on generated profiles.

use std::path::{Path, PathBuf};

/// Returns the text of a file in the folder `RAILHEAD_REFERENCE`, by default `../shared/reference` next to the checkout.
pub fn reference_file(name: &str) -> Option<String> {
    let folder = std::env::var_os("RAILHEAD_REFERENCE").map(PathBuf::from);
    let beside = || {
        let package = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut folders = package
            .ancestors()
            .map(|above| above.join("shared/reference"));
        folders.find(|folder| folder.is_dir())
    };
    let folder = folder.or_else(beside).unwrap_or_default();
    let text = std::fs::read_to_string(folder.join(name)).ok();
    if text.is_none() {
        eprintln!("SKIPPED: there is no {name}; RAILHEAD_REFERENCE names the folder that it is in");
    }
    text
}
