//! Two-column text or CSV: y and z in mm, one point per line.

use crate::contact::geometry::formats::profile_file::{ProfileFile, numbers, unreadable};

/// Reads the points. Lines that start with `#`, `!`, `%` or `"` are comments; one line of titles may precede the first point.
pub(crate) fn read(text: &str) -> Result<ProfileFile, String> {
    let mut contents = ProfileFile::default();
    let mut title_allowed = true;
    for (k, line) in text.lines().enumerate() {
        let line = line.trim().trim_start_matches('\u{feff}');
        if line.is_empty() || line.starts_with(['#', '!', '%', '"']) {
            continue;
        }
        match numbers(line).as_deref() {
            Some([y, z]) => contents.points.push([*y, *z]),
            None if title_allowed && line.starts_with(|c: char| c.is_alphabetic()) => {}
            _ => return Err(unreadable(k, line, "a pair of finite numbers y and z")),
        }
        title_allowed = false;
    }
    if contents.points.is_empty() {
        return Err("no points found".to_owned());
    }
    Ok(contents)
}
