//! Reads the worn rail and wheel of the reference files. `RAILHEAD_REFERENCE` names their folder.

use std::path::PathBuf;

use serde_json::{Value, json};

/// Returns the sections of a worn rail and a worn wheel in the form of a case, or `None` without the files.
pub(crate) fn worn_pair() -> Option<[Value; 2]> {
    let folder = PathBuf::from(std::env::var_os("RAILHEAD_REFERENCE")?);
    let file = |name: &str| {
        let text = std::fs::read_to_string(folder.join("extended/profiles").join(name)).ok()?;
        Some(json!({ "format": "simpack", "text": text }))
    };
    Some([file("site_b_hr.prr")?, file("worn_high_mileage.prw")?])
}
