//! Profiles as text files: columns, Simpack and MiniProf. Text comes in, never a path.

mod columns;
mod miniprof;
mod simpack;

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

/// Reads a profile from the text of a file.
///
/// # Errors
/// A sentence with the number of the line that cannot be read, or with what is missing.
pub fn read(format: Format, text: &str) -> Result<Contents, String> {
    match format {
        Format::Columns => columns::read(text),
        Format::Simpack => simpack::read(text),
        Format::Miniprof => miniprof::read(text),
    }
}

/// The numbers of a line, separated by blanks, commas, semicolons or tabs; `None` if a word is no number.
fn numbers(line: &str) -> Option<Vec<f64>> {
    line.split(|c: char| c.is_whitespace() || c == ',' || c == ';')
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().ok().filter(|number: &f64| number.is_finite()))
        .collect()
}

fn unreadable(line: usize, text: &str, needed: &str) -> String {
    let shown: String = text.chars().take(60).collect();
    format!("line {}: {shown:?} given; {needed} is needed", line + 1)
}
