//! The formats of profile files, and how the format of a text is recognised.

use crate::contact::geometry::formats::lines::{each_line, shown};
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
/// Starts of a text that was decoded in another encoding than its own.
const BYTE_ORDER_MARKS: [&str; 4] = ["\u{feff}", "\u{fffd}", "ï»¿", "ÿþ"];

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
    // Bytes of UTF-16 that were taken for single characters.
    let without_nulls = text.contains('\0').then(|| text.replace('\0', ""));
    let mut text = without_nulls.as_deref().unwrap_or(text);
    for mark in BYTE_ORDER_MARKS {
        text = text.trim_start_matches(mark);
    }
    if let Some(refused) = other_kind(text) {
        return Err(refused);
    }
    let looks_like = looks_like(text);
    let other = looks_like.filter(|other| *other != format);
    let contents = match format {
        // Columns would be read from files of the other formats too, without their settings.
        Format::Columns if other.is_some() => Err("no plain columns".to_owned()),
        Format::Columns => columns::read(text),
        Format::Simpack => simpack::read(text),
        Format::Miniprof if other.is_some() => Err("no file of MiniProf".to_owned()),
        Format::Miniprof => miniprof::read(text),
    };
    contents.map_err(|reason| match other {
        Some(other) => {
            format!(
                "{reason}; this looks like a file of the format {}",
                other.word()
            )
        }
        None => reason,
    })
}

/// Why a text holds something else than one cross-section: a list of cross-sections along the track or around the wheel, or both sides of a
/// track.
fn other_kind(text: &str) -> Option<String> {
    let word = text.split_whitespace().next().unwrap_or_default();
    if ["wheelprofile", "railprofile"].contains(&word.to_ascii_lowercase().as_str()) {
        return Some(
            "this is a file of Vampire, with the left and the right side in each row: send the columns y and z of one side, with the format \
             columns"
                .to_owned(),
        );
    }
    // A slice is a position and the quoted name of a file.
    let slices: Vec<&str> = text
        .lines()
        .filter_map(|line| {
            let mut words = line.split_whitespace();
            let _position: f64 = words.next()?.trim_end_matches(',').parse().ok()?;
            let name = words.next().filter(|name| name.starts_with(['\'', '"']))?;
            let name = name.trim_matches(|c| "'\",;".contains(c));
            has_extension(name).then_some(name)
        })
        .collect();
    let counts = |mark: &str| text.contains(mark) || text.contains(&mark.to_ascii_lowercase());
    if slices.len() < 2 && !(counts("NSLC") && (counts("S_OFFSET") || counts("TH_OFFSET"))) {
        return None;
    }
    let along = match (counts("TH_OFFSET"), counts("S_OFFSET")) {
        (true, _) => "around the wheel (.slcw)",
        (false, true) => "along the track (.slcs)",
        (false, false) => "along the track (.slcs) or around the wheel (.slcw)",
    };
    let first = slices
        .first()
        .map(|name| format!(", the first in {}", shown(name)));
    Some(format!(
        "this is a list of {} cross-sections that vary {along}{}; a case has one cross-section: send the text of the slice at the place of contact",
        slices.len(),
        first.unwrap_or_default()
    ))
}

fn has_extension(name: &str) -> bool {
    let name = name.rsplit(['/', '\\']).next().unwrap_or_default();
    let extension = name.rsplit_once('.').map(|(_, extension)| extension);
    extension.is_some_and(|letters| {
        (2..=5).contains(&letters.len()) && letters.chars().all(char::is_alphabetic)
    })
}

/// Whether a text is a single line that ends like a file name.
fn is_path(text: &str) -> bool {
    let line = text.trim();
    line.len() < PATH_LENGTH_MAX && !line.contains(['\n', '\r']) && has_extension(line)
}

/// The format whose keywords begin lines of a text.
fn looks_like(text: &str) -> Option<Format> {
    let first = text.trim_start().get(..14).unwrap_or_default();
    if ["#miniwheelprof", "#minirailprof\n"]
        .iter()
        .any(|mark| first.eq_ignore_ascii_case(mark))
    {
        return Some(Format::Miniprof);
    }
    each_line(text).find_map(|line| {
        let name = line
            .bare
            .split(|c: char| c == '=' || c == ':' || c.is_whitespace())
            .next();
        match name.unwrap_or_default().to_ascii_lowercase().as_str() {
            "point.begin" | "spline.begin" => Some(Format::Simpack),
            "columndef" | "xypoints" | "miniprof" => Some(Format::Miniprof),
            _ => None,
        }
    })
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
