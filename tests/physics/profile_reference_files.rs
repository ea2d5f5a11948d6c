//! Reference files that lie beside the checkout; tests pass without them.

use std::path::PathBuf;

/// Text of a file in the folder `RAILHEAD_REFERENCE`, by default `../shared/reference` beside the checkout.
pub fn reference_file(name: &str) -> Option<String> {
    let folder = std::env::var_os("RAILHEAD_REFERENCE").map(PathBuf::from);
    let folder = folder.unwrap_or_else(|| {
        PathBuf::from(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../../shared/reference"
        ))
    });
    std::fs::read_to_string(folder.join(name)).ok()
}
