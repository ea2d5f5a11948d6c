//! The formats of profile files, and how the format of a text is recognised.

use crate::contact::geometry::formats::profile_file::ProfileFile;
use crate::contact::geometry::formats::{columns, miniprof, simpack};

/// A file format that a client can name; each is read in the file of that name in this folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Two columns y and z, separated by blanks, commas, semicolons or tabs.
    Columns,
    /// Simpack's `.prr` (rail) and `.prw` (wheel).
    Simpack,
    /// MiniProf's `.ban` (rail) and `.whl` (wheel).
    Miniprof,
}

/// Length below which a text may be a path.
const PATH_LENGTH_MAX: usize = 1000;

/// Reads a profile from the text of a file.
///
/// # Errors
/// A sentence that names the line that cannot be read, or what is missing.
pub fn read(format: Format, text: &str) -> Result<ProfileFile, String> {
    if is_path(text) {
        return Err(format!(
            "{:?} given, which looks like a path; text is what the file holds, not its path",
            text.trim()
        ));
    }
    let contents = match format {
        Format::Columns => columns::read(text),
        Format::Simpack => simpack::read(text),
        Format::Miniprof => miniprof::read(text),
    };
    contents.map_err(|reason| match looks_like(text) {
        Some(other) if other != format => {
            format!(
                "{reason}; this looks like a file of the format {}",
                other.word()
            )
        }
        _ => reason,
    })
}

/// Whether a text is a single line that ends like a file name.
fn is_path(text: &str) -> bool {
    let line = text.trim();
    let name = line.rsplit(['/', '\\']).next().unwrap_or_default();
    let extension = name.rsplit_once('.').map(|(_, extension)| extension);
    line.len() < PATH_LENGTH_MAX
        && !line.contains('\n')
        && extension.is_some_and(|letters| {
            (2..=5).contains(&letters.len()) && letters.chars().all(char::is_alphabetic)
        })
}

/// The format whose keywords a text contains.
fn looks_like(text: &str) -> Option<Format> {
    if text.contains("point.begin") {
        Some(Format::Simpack)
    } else if text.contains("ColumnDef") || text.contains("XYPoints") {
        Some(Format::Miniprof)
    } else {
        None
    }
}

impl Format {
    fn word(self) -> &'static str {
        match self {
            Format::Columns => "columns",
            Format::Simpack => "simpack",
            Format::Miniprof => "miniprof",
        }
    }
}
