//! Profiles as text files: columns, Simpack and MiniProf. Text comes in, never a path.

use crate::contact::geometry::formats::columns;
use crate::contact::geometry::formats::miniprof;
use crate::contact::geometry::formats::simpack;
use serde::Serialize;
use utoipa::ToSchema;

/// A file format a client can name; each is a file of that name beside this one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Format {
    /// Two columns y and z, separated by blanks, commas, semicolons or tabs.
    Columns,
    /// Simpack's `.prr` (rail) and `.prw` (wheel).
    Simpack,
    /// MiniProf's `.ban` (rail) and `.whl` (wheel).
    Miniprof,
}

/// What a file says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Contents {
    /// Points `[y, z]` in mm, with the file's own shifts, rotation and mirroring done.
    pub points: Vec<[f64; 2]>,
    /// y of the points is positive to the track centre, if the format settles that.
    pub mirror_y: Option<bool>,
    /// z of the points is positive up, if the format settles that.
    pub mirror_z: Option<bool>,
    /// The body the file says it belongs to: is it a wheel?
    pub wheel: Option<bool>,
}

/// Texts shorter than this may be paths.
const PATH_LENGTH_MAX: usize = 1000;

/// Reads a profile from the text of a file.
///
/// # Errors
/// A sentence with the number of the line that cannot be read, or with what is missing.
pub fn read(format: Format, text: &str) -> Result<Contents, String> {
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

/// One line that ends like a file name is no file.
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

/// The format that the words of a text belong to.
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

/// The numbers of a line, separated by blanks, commas, semicolons or tabs; `None` if a word is no number.
pub(crate) fn numbers(line: &str) -> Option<Vec<f64>> {
    line.split(|c: char| c.is_whitespace() || c == ',' || c == ';')
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().ok().filter(|number: &f64| number.is_finite()))
        .collect()
}

/// Are the numbers of a line written with decimal commas? Each has one comma between digits, and no point.
pub(crate) fn has_decimal_commas(line: &str) -> bool {
    let words = line
        .split(|c: char| c.is_whitespace() || c == ';')
        .filter(|word| !word.is_empty());
    let decimal = |word: &str| {
        let (whole, part) = word.split_once(',')?;
        let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        (digits(whole.trim_start_matches(['-', '+'])) && digits(part)).then_some(())
    };
    let mut count = 0;
    for word in words {
        if decimal(word).is_none() && word.parse::<i64>().is_err() {
            return false;
        }
        count += usize::from(word.contains(','));
    }
    // One such word is a pair of whole numbers.
    count >= 2 || count == 1 && line.trim().contains([';', ' ', '\t'])
}

pub(crate) fn unreadable(line: usize, text: &str, needed: &str) -> String {
    let shown: String = text.chars().take(60).collect();
    let hint = if has_decimal_commas(text) {
        "; numbers are written with a decimal point here, not with a decimal comma"
    } else {
        ""
    };
    format!(
        "line {}: {shown:?} given; {needed} is needed{hint}",
        line + 1
    )
}
