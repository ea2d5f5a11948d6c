//! Reads profile files: plain columns, Simpack and MiniProf.
//!
//! All formats share the reading of lines: comments, separators, decimal commas, keywords. Columns and MiniProf files are a header followed by
//! rows of numbers ([`Table`]).
//!
//! - **Columns**: y and z, one point per line.
//! - **Simpack** (`.prr`, `.prw`): a header with the type, a spline block with settings `name = value`, and points between `point.begin` and
//!   `point.end`, in any order of blocks. Shift, rotation and mirroring are applied in this order. `units.len.f` is the number of length units
//!   in a metre.
//! - **MiniProf** (`.ban`, `.whl`): header lines `Name=value`, or free words in old versions, then one point per line. `ColumnDef` names the
//!   columns; its `X` is y here and its `Y` is z. `X` usually points to the track centre. The direction of z is found from the shape.

use std::borrow::Cow;
use std::f64::consts::TAU;

use railhead_macros::{Named, Words, keyword};

use crate::geometry::plane_curve::{chords, distance};
use crate::geometry::profile::{LengthUnit, POINTS_MIN};
use crate::geometry::profile_quality::{LONG_MEDIANS, median};

/// A file format of cross-sections.
#[keyword(Words, Named)]
pub enum Format {
    /// Columns of numbers, the first two or those with the titles y and z, separated by blanks, commas, semicolons or tabs.
    Columns,
    /// Simpack's `.prr` (rail) and `.prw` (wheel).
    Simpack,
    /// MiniProf's `.ban` (rail) and `.whl` (wheel).
    Miniprof,
}

/// Byte order marks, as correct and as wrong decoders leave them.
const BYTE_ORDER_MARKS: [&str; 4] = ["\u{feff}", "\u{fffd}", "ï»¿", "ÿþ"];

/// Reads a profile from the text of a file.
///
/// # Errors
/// Returns a sentence that names the line that cannot be read, or the part that is missing.
pub fn read(format: Format, text: &str) -> Result<ProfileFile, String> {
    if is_path(text) {
        return Err(format!(
            "{} given, which looks like a path; text must be the content of the file",
            shown(text.trim())
        ));
    }
    // UTF-16 that was decoded byte by byte has nulls between its characters.
    let without_nulls = text.contains('\0').then(|| text.replace('\0', ""));
    let mut text = without_nulls.as_deref().unwrap_or(text);
    for mark in BYTE_ORDER_MARKS {
        text = text.trim_start_matches(mark);
    }
    if let Some(refused) = other_kind(text) {
        return Err(refused);
    }
    let other = looks_like(text).filter(|other| *other != format);
    let contents = match format {
        // Files of the other formats can be read as columns too, but without their settings.
        Format::Columns if other.is_some() => Err("no plain columns".to_owned()),
        Format::Columns => read_columns(text),
        Format::Simpack => read_simpack(text),
        Format::Miniprof if other.is_some() => Err("no file of MiniProf".to_owned()),
        Format::Miniprof => read_miniprof(text),
    };
    contents.map_err(|reason| match other.map(Format::name) {
        Some(other) => format!("{reason}; this looks like a file of the format {other}"),
        None => reason,
    })
}

/// The refusal of a text that does not contain a single cross-section: a list of cross-sections along the track or around the wheel, or a
/// file with both sides of the track.
fn other_kind(text: &str) -> Option<String> {
    let word = text.split_whitespace().next().unwrap_or_default();
    if ["wheelprofile", "railprofile"].contains(&word.to_ascii_lowercase().as_str()) {
        return Some(
            "this is a file of Vampire, with the left and the right side in each row: send the columns y and z of one side, with the format \
             columns"
                .to_owned(),
        );
    }
    // Each line of such a list has a position and the quoted name of a file.
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

/// Returns whether a text is a single line that ends like a file name.
fn is_path(text: &str) -> bool {
    let line = text.trim();
    !line.contains(['\n', '\r']) && has_extension(line)
}

/// The format whose keywords begin lines of a text.
fn looks_like(text: &str) -> Option<Format> {
    let first = text.lines().find(|line| !line.trim().is_empty());
    let first = first.unwrap_or_default().trim().to_ascii_lowercase();
    if first.starts_with("#miniwheelprof") || first == "#minirailprof" {
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

/// The settings of a Simpack file.
#[derive(Debug, Clone, Default)]
struct SimpackSettings {
    wheel: Option<bool>,
    /// Whether the current line is inside the spline block.
    in_spline: bool,
    shift: [f64; 2],
    rotate: f64,
    /// Allowed ranges of y and z. A range whose lower bound is not below the upper one is ignored.
    bounds: [[f64; 2]; 2],
    mirror: [bool; 2],
    per_metre: Option<f64>,
    unit: Option<LengthUnit>,
    per_radian: Option<f64>,
    /// Name of another file that holds the points.
    file: Option<String>,
}

/// Reads a Simpack file. The weights of the points are ignored.
fn read_simpack(text: &str) -> Result<ProfileFile, String> {
    let mut settings = SimpackSettings::default();
    let mut points: Vec<[f64; 2]> = Vec::new();
    let lines = lines(text)?;
    let comma = comma_of(&lines);
    let mut in_points = false;
    let mut blocks = 0;
    for line in &lines {
        let word = line.bare.split_whitespace().next().unwrap_or_default();
        match word.to_ascii_lowercase().as_str() {
            "" => {}
            "point.begin" if blocks > 0 => {
                return Err(format!(
                    "line {}: a second block of points begins; one cross-section is needed",
                    line.place
                ));
            }
            "point.begin" => in_points = true,
            "point.end" => (in_points, blocks) = (false, blocks + 1),
            "spline.begin" => settings.in_spline = true,
            "spline.end" => settings.in_spline = false,
            _ if in_points => {
                let mixed = comma == Comma::Separator && has_decimal_commas(&line.bare);
                match content(&line.bare, comma) {
                    Content::Row(numbers) if !mixed => points.push([numbers[0], numbers[1]]),
                    _ => {
                        let needed = "a point y, z with an optional weight";
                        return Err(unreadable(line, needed, comma));
                    }
                }
            }
            _ => {
                if let Some((name, value)) = keyword(line) {
                    settings
                        .take(&name, &value)
                        .ok_or_else(|| unreadable(line, "a number", comma))?;
                }
            }
        }
    }
    match settings.file.take() {
        Some(file) if points.is_empty() => Err(format!(
            "the points are in another file, {}: send its text, with the format columns if it holds columns of y and z",
            file.chars().take(100).collect::<String>()
        )),
        _ if in_points => Err("point.end is missing: the text ends within its points".to_owned()),
        _ if blocks == 0 => Err("no block from point.begin to point.end found".to_owned()),
        _ => settings.apply(points),
    }
}

impl SimpackSettings {
    /// Stores one setting. Returns `None` if a known setting has no valid number. Other settings are ignored.
    fn take(&mut self, name: &str, value: &str) -> Option<()> {
        let number = || match content(&format!("0 {value}"), Comma::Separator) {
            Content::Row(numbers) => Some(numbers[1]),
            _ => None,
        };
        let flag = || number().map(|number| number != 0.0);
        match name {
            "type" if !self.in_spline => self.wheel = Some(flag()?),
            "shift.y" => self.shift[0] = number()?,
            "shift.z" => self.shift[1] = number()?,
            "rotate" => self.rotate = number()?,
            "bound.y.min" => self.bounds[0][0] = number()?,
            "bound.y.max" => self.bounds[0][1] = number()?,
            "bound.z.min" => self.bounds[1][0] = number()?,
            "bound.z.max" => self.bounds[1][1] = number()?,
            "mirror.y" => self.mirror[0] = flag()?,
            "mirror.z" => self.mirror[1] = flag()?,
            "units.len" => self.unit = LengthUnit::named(value),
            "units.len.f" => self.per_metre = Some(number().filter(|f| *f > 0.0)?),
            "units.ang" if self.per_radian.is_none() => {
                self.per_radian = value
                    .to_ascii_lowercase()
                    .contains("deg")
                    .then_some(1_f64.to_degrees());
            }
            "units.ang.f" => self.per_radian = Some(number().filter(|f| *f > 0.0)?),
            "file" if value != "-" && !value.is_empty() => self.file = Some(value.to_owned()),
            _ => {}
        }
        Some(())
    }

    fn apply(&self, mut points: Vec<[f64; 2]>) -> Result<ProfileFile, String> {
        let angle = self.rotate / self.per_radian.unwrap_or(1.0);
        if angle.abs() > TAU {
            return Err(format!(
                "a rotation of {angle} rad is more than a whole turn"
            ));
        }
        let (sin, cos) = angle.sin_cos();
        for point in &mut points {
            let [y, z] = [point[0] + self.shift[0], point[1] + self.shift[1]];
            *point = [cos * y - sin * z, sin * y + cos * z];
        }
        points.retain(|point| {
            let within = |k: usize| {
                let [low, high] = self.bounds[k];
                low >= high || (low..=high).contains(&point[k])
            };
            within(0) && within(1)
        });
        let unit_mm = self.per_metre.map(|per_metre| 1000.0 / per_metre);
        let unit_mm = unit_mm.or(self.unit.map(LengthUnit::mm));
        let mm = unit_mm.unwrap_or(1.0);
        let scale = self.mirror.map(|mirror| if mirror { -mm } else { mm });
        for point in &mut points {
            *point = [point[0] * scale[0], point[1] * scale[1]];
        }
        Ok(ProfileFile {
            points,
            unit_mm,
            // After the file's own mirroring, y is positive to the field side and z is positive down.
            mirror_y: Some(false),
            mirror_z: Some(false),
            wheel: self.wheel,
            ..ProfileFile::default()
        })
    }
}

/// Reads a MiniProf file.
fn read_miniprof(text: &str) -> Result<ProfileFile, String> {
    let table = read_table(text)?;
    let mut columns = [0, 1];
    let mut stated = None;
    for line in &table.header {
        match keyword(line) {
            Some((name, value)) if name == "columndef" => {
                columns = columns_x_and_y(&value).ok_or_else(|| {
                    table.refuse(line, "a list with X and Y, such as ColumnDef=X,Y,A,C,")
                })?;
            }
            Some((name, value)) if name == "xypoints" => stated = value.parse::<usize>().ok(),
            _ => {}
        }
    }
    let mm = table.stated_unit().map(LengthUnit::mm);
    let points = table.points(columns, mm)?;
    let counts = [points.len(), points.len() + table.commented_out];
    Ok(ProfileFile {
        points,
        unit_mm: mm,
        mirror_y: Some(true),
        wrong_count: stated.filter(|count| !counts.contains(count)),
        header_rows: table.header_rows,
        ..ProfileFile::default()
    })
}

/// The numbers of the columns X and Y in the value of `ColumnDef`.
fn columns_x_and_y(value: &str) -> Option<[usize; 2]> {
    let column = |wanted: &str| {
        let mut names = words(value, Comma::Separator);
        names.position(|name| name.eq_ignore_ascii_case(wanted))
    };
    Some([column("X")?, column("Y")?])
}

/// The contents of a profile file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProfileFile {
    /// Points `[y, z]` in mm, with the file's own shifts, rotation and mirroring applied.
    pub points: Vec<[f64; 2]>,
    /// Length of the file's unit in mm, if the file names its unit. Without a name the points are read as mm.
    pub unit_mm: Option<f64>,
    /// Whether y of the points is positive to the track centre, if the format specifies it.
    pub mirror_y: Option<bool>,
    /// Whether z of the points is positive up, if the format specifies it.
    pub mirror_z: Option<bool>,
    /// Whether the file describes a wheel, if it states the body.
    pub wheel: Option<bool>,
    /// The number of points that the header states, if the file has another number of rows, with and without commented-out rows.
    pub wrong_count: Option<usize>,
    /// Rows of numbers that were read as a part of the header: their number and the line of the first one.
    pub header_rows: Option<(usize, usize)>,
}

/// Characters that begin a comment anywhere in a line.
const COMMENT: [char; 5] = ['#', '%', '!', '$', '"'];
/// Characters that begin a comment only at the start of a line. Elsewhere they separate or quote.
const COMMENT_AT_START: [char; 2] = [';', '\''];
/// Maximum number of non-empty lines of a text: five for each point that a cross-section may have.
const LINES_MAX: usize = 100_000;
/// Maximum number of characters of a line that a message shows.
const SHOWN_MAX: usize = 300;

/// One line of a text.
#[derive(Debug, Clone)]
struct Line<'a> {
    /// Its number, counted from 1.
    place: usize,
    /// The line as given.
    text: &'a str,
    /// The line without its comment, the quotes of quoted cells and surrounding blanks.
    bare: Cow<'a, str>,
    /// Whether the line above it is empty.
    after_empty: bool,
}

/// The meaning of a comma.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Comma {
    /// It separates numbers.
    Separator,
    /// It is the decimal sign.
    Decimal,
}

/// The contents of a line.
#[derive(Debug, Clone, PartialEq)]
enum Content {
    /// Only a comment.
    Nothing,
    /// At least two numbers, possibly followed by words.
    Row(Vec<f64>),
    /// A single number, or a word that begins like a number but is not one.
    Broken {
        /// The word that is not a number; `None` for a single number.
        word: Option<String>,
        /// Whether at least one word is a number.
        has_number: bool,
    },
    /// Words only.
    Words,
}

/// The non-empty lines of a text, which end with LF, CR LF or CR.
fn each_line(text: &str) -> impl Iterator<Item = Line<'_>> {
    let mut after_empty = false;
    text.split('\n')
        .flat_map(|line| line.strip_suffix('\r').unwrap_or(line).split('\r'))
        .enumerate()
        .filter_map(move |(k, text)| {
            let is_empty = text.trim().is_empty();
            let after_empty = std::mem::replace(&mut after_empty, is_empty);
            (!is_empty).then(|| Line {
                place: k + 1,
                text,
                bare: bare(text),
                after_empty,
            })
        })
}

/// The non-empty lines of a text.
///
/// # Errors
/// Returns a sentence with the limit if there are too many lines.
fn lines(text: &str) -> Result<Vec<Line<'_>>, String> {
    let lines: Vec<Line> = each_line(text).take(LINES_MAX + 1).collect();
    if lines.len() > LINES_MAX {
        return Err(format!(
            "the text has more than {LINES_MAX} lines; a cross-section has fewer"
        ));
    }
    Ok(lines)
}

/// Returns a line without its comment.
fn bare(text: &str) -> Cow<'_, str> {
    let line = text.trim();
    // A sign of inch in brackets is a unit, not a comment.
    if ["[\"]", "(\")"].iter().any(|inch| line.contains(inch)) {
        return Cow::Owned(line.replace("[\"]", "[in]").replace("(\")", "[in]"));
    }
    if let Some(cells) = quoted_cells(line) {
        return Cow::Owned(cells);
    }
    if line.starts_with(COMMENT_AT_START) {
        return Cow::Borrowed("");
    }
    // `1.#QNAN` is an invalid number, not a comment.
    let begins = |(at, _): &(usize, &str)| !line[..*at].ends_with('.');
    let comment = line.match_indices(COMMENT).find(begins).map(|(at, _)| at);
    let end = comment.into_iter().chain(line.find("//")).min();
    Cow::Borrowed(line[..end.unwrap_or(line.len())].trim_end())
}

/// The cells of a line that is quoted as in CSV, `"1.0","2.0"` or `"Name=value"`, joined by semicolons. Returns `None` for any other
/// line, in which a quote begins a comment.
fn quoted_cells(line: &str) -> Option<String> {
    let mut cells = Vec::new();
    let mut rest = line;
    while !rest.is_empty() {
        let (cell, behind) = rest.strip_prefix('"')?.split_once('"')?;
        cells.push(cell.trim());
        let behind = behind.trim_start();
        rest = behind
            .strip_prefix([',', ';'])
            .unwrap_or(behind)
            .trim_start();
    }
    let is_cell = |cell: &&str| number(cell, Comma::Decimal).is_some() || !begins_like_number(cell);
    let quoted = match cells.as_slice() {
        [only] => only.contains('='),
        all => !all.is_empty() && all.iter().all(is_cell),
    };
    quoted.then(|| cells.join(";"))
}

/// Parses a finite number, also with the exponents of Fortran (`1.0D0`), a typographic minus sign, or a decimal comma.
fn number(word: &str, comma: Comma) -> Option<f64> {
    let parsed = word.parse::<f64>().or_else(|_| {
        let plain = |c: char| match c {
            'd' | 'D' => 'e',
            '\u{2212}' => '-',
            ',' if comma == Comma::Decimal => '.',
            other => other,
        };
        word.chars().map(plain).collect::<String>().parse()
    });
    parsed.ok().filter(|number: &f64| number.is_finite())
}

/// Returns whether a word looks like a number, valid or not.
fn begins_like_number(word: &str) -> bool {
    let unsigned = word.trim_start_matches(['+', '-', '\u{2212}', '.', ',']);
    unsigned.starts_with(|c: char| c.is_ascii_digit()) || word.parse::<f64>().is_ok()
}

/// The words of a line.
fn words(bare: &str, comma: Comma) -> impl Iterator<Item = &str> {
    let separates =
        move |c: char| c.is_whitespace() || c == ';' || c == ',' && comma == Comma::Separator;
    bare.split(separates)
        // In `1,5, 2,5` a comma after a number separates.
        .map(move |word| match comma {
            Comma::Separator => word,
            Comma::Decimal => word.trim_end_matches(','),
        })
        .filter(|word| !word.is_empty())
}

/// Parses a line.
fn content(bare: &str, comma: Comma) -> Content {
    if bare.is_empty() {
        return Content::Nothing;
    }
    if comma == Comma::Separator
        && let Some(word) = mixed_word(bare)
    {
        return broken(Some(word), true);
    }
    let mut numbers = Vec::new();
    let mut malformed = None;
    for word in words(bare, comma) {
        match number(word, comma) {
            Some(number) if malformed.is_none() => numbers.push(number),
            Some(_) => return broken(malformed, true),
            // After two numbers it is a word, such as `2nd measurement` or `12:30`.
            None if begins_like_number(word) && numbers.len() < 2 => {
                malformed = malformed.or(Some(word));
            }
            None => break,
        }
    }
    match numbers.len() {
        _ if malformed.is_some() => broken(malformed, !numbers.is_empty()),
        0 => Content::Words,
        1 => broken(None, true),
        _ => Content::Row(numbers),
    }
}

/// The second word of a line such as `1.5 2,5`, in which blanks separate and the comma lies within a number.
fn mixed_word(bare: &str) -> Option<&str> {
    let mut words = bare.split_whitespace();
    let _first = number(words.next()?, Comma::Separator)?;
    let second = words.next().filter(|word| !word.starts_with(','))?;
    let second = second.trim_end_matches([',', ';']);
    let is_mixed = second.contains(',') && begins_like_number(second);
    is_mixed.then_some(second)
}

fn broken(word: Option<&str>, has_number: bool) -> Content {
    Content::Broken {
        word: word.map(str::to_owned),
        has_number,
    }
}

/// Returns whether a line has at least two numbers, at least one of them with a decimal comma and none with a decimal point.
fn has_decimal_commas(bare: &str) -> bool {
    let mut with_comma = 0;
    let is_number = |word: &&str| {
        !word.contains('.')
            && word.bytes().filter(|byte| *byte == b',').count() <= 1
            && number(word, Comma::Decimal).is_some()
    };
    let count = words(bare, Comma::Decimal)
        .take_while(is_number)
        .inspect(|word| with_comma += usize::from(word.contains(',')))
        .count();
    count >= 2 && with_comma > 0
}

/// The meaning of the comma in all rows of a text. It is decimal if some rows have decimal commas and no row has decimal points.
fn comma_of(lines: &[Line]) -> Comma {
    let has_points = |line: &Line| {
        let is_number = |word: &&str| number(word, Comma::Separator).is_some();
        matches!(content(&line.bare, Comma::Separator), Content::Row(_))
            && words(&line.bare, Comma::Separator)
                .take_while(is_number)
                .any(|word| word.contains('.'))
    };
    let decimal = lines.iter().any(|line| has_decimal_commas(&line.bare));
    if decimal && !lines.iter().any(has_points) {
        Comma::Decimal
    } else {
        Comma::Separator
    }
}

/// Splits a line `name = value`, `name: value` or `name value` into the name in lower case and the value without quotes.
fn keyword(line: &Line) -> Option<(String, String)> {
    let begins = line.bare.starts_with(|c: char| c.is_alphabetic());
    let end = line
        .bare
        .find(|c: char| c == '=' || c == ':' || c.is_whitespace())
        .filter(|_| begins)?;
    let name = line.bare[..end].trim().to_ascii_lowercase();
    // A quoted value may contain characters that begin a comment elsewhere.
    let quoted = line
        .text
        .split('\'')
        .nth(1)
        .filter(|_| line.bare.contains('\''));
    let value =
        line.bare[end..].trim_start_matches(|c: char| c == '=' || c == ':' || c.is_whitespace());
    Some((name, quoted.unwrap_or(value).trim().to_owned()))
}

/// Returns whether a line is a row that was commented out.
fn is_commented_out(line: &Line, comma: Comma) -> bool {
    let inner = line.text.trim_start_matches(|c: char| {
        c.is_whitespace() || c == '/' || COMMENT.contains(&c) || COMMENT_AT_START.contains(&c)
    });
    line.bare.is_empty() && matches!(content(&bare(inner), comma), Content::Row(_))
}

/// Quotes a text for a message, shortened if it is long.
fn shown(text: &str) -> String {
    let mut shown: String = text.chars().take(SHOWN_MAX).collect();
    if shown.len() < text.len() {
        shown.push('…');
    }
    format!("{shown:?}")
}

/// The refusal of a line. It states the line, the word that cannot be read, and what is allowed.
fn unreadable(line: &Line, needed: &str, comma: Comma) -> String {
    let place = |word: &str| {
        let at = line.text.find(word)?;
        let column = line.text[..at].chars().count() + 1;
        Some(format!(
            ", where {} at column {column} is no number",
            shown(word)
        ))
    };
    let word = match content(&line.bare, comma) {
        Content::Broken {
            word: Some(word), ..
        } => place(&word),
        Content::Broken { word: None, .. } => words(&line.bare, comma).nth(1).and_then(place),
        Content::Words => words(&line.bare, comma).next().and_then(place),
        Content::Nothing | Content::Row(_) => None,
    };
    let is_mixed = has_decimal_commas(&line.bare) || mixed_word(&line.bare).is_some();
    let hint = if comma == Comma::Separator && is_mixed {
        "; decimal commas and decimal points are mixed in this text"
    } else {
        ""
    };
    format!(
        "line {}: {} given{}; {needed} is needed{hint}; remarks begin with #, %, !, \" or //",
        line.place,
        shown(line.text),
        word.unwrap_or_default()
    )
}

/// Reads columns. The titles above them choose the columns y and z and may name their unit. Without titles they are the first two columns.
/// Other columns are ignored.
fn read_columns(text: &str) -> Result<ProfileFile, String> {
    let table = read_table(text)?;
    let (columns, unit) = titles(&table);
    if columns.is_none() && counts_rows(&table) {
        return Err(format!(
            "line {}: the first column counts the rows (0 or 1, 2, 3, …); remove it, or put a line of titles that contains y and z above the rows",
            table.rows[0].line.place
        ));
    }
    let columns = columns.unwrap_or([0, 1]);
    let mm = unit.or(table.stated_unit()).map(LengthUnit::mm);
    Ok(ProfileFile {
        points: table.points(columns, mm)?,
        unit_mm: mm,
        header_rows: table.header_rows,
        ..ProfileFile::default()
    })
}

/// Returns whether there are at least three columns and the first one counts the rows from 0 or 1.
fn counts_rows(table: &Table) -> bool {
    let first = table.rows[0].numbers[0];
    table.rows.len() >= POINTS_MIN
        && (first == 0.0 || first == 1.0)
        && table.rows.iter().enumerate().all(|(k, row)| {
            row.numbers.len() >= 3 && (row.numbers[0] - first - k as f64).abs() < 1e-9
        })
}

/// The columns y and z, x and y, or x and z, and their unit, from the last lines of the header: titles, units, or both.
fn titles(table: &Table) -> (Option<[usize; 2]>, Option<LengthUnit>) {
    let mut lines = table
        .header
        .iter()
        .rev()
        .filter(|line| !line.bare.is_empty());
    let Some(mut line) = lines.next() else {
        return (None, None);
    };
    let units = cells(line).into_iter().filter(|cell| !cell.is_empty());
    let mut unit = units
        .map(LengthUnit::named)
        .collect::<Option<Vec<_>>>()
        .and_then(|units| units.first().copied());
    if unit.is_some() {
        match lines.next() {
            Some(before) => line = before,
            None => return (None, unit),
        }
    }
    let width = table.rows[0].numbers.len();
    let mut titles = cells(line);
    // With a cell for each column, an empty cell is the title of a column. Otherwise separators are repeated, or braces and words surround the
    // titles.
    if titles.len() != width {
        titles.retain(|title| title.contains(char::is_alphanumeric) && !title.ends_with(':'));
    }
    let mut names: Vec<(char, Option<LengthUnit>)> = Vec::new();
    for cell in &titles {
        let alone = cell
            .starts_with(['[', '('])
            .then(|| LengthUnit::named(cell))
            .flatten();
        if let (Some(unit), Some(name)) = (alone, names.last_mut()) {
            name.1 = Some(unit);
            continue;
        }
        let mut letters = cell.chars();
        let letter = letters.next().unwrap_or(' ').to_ascii_lowercase();
        let is_axis = letters.next().is_none_or(|next| !next.is_alphanumeric());
        // `z raw` is not the axis if another title is `z`.
        let is_other = cell.len() > 1
            && titles
                .iter()
                .any(|title| title.len() == 1 && title.to_ascii_lowercase().starts_with(letter));
        let unit = cell.get(1..).and_then(LengthUnit::named);
        names.push((if is_axis && !is_other { letter } else { ' ' }, unit));
    }
    // The count of the rows may have no cell in the line of titles.
    if names.len() + 1 == width && counts_rows(table) {
        names.insert(0, (' ', None));
    }
    let place = |name: char| names.iter().position(|(own, _)| *own == name);
    let columns = [['y', 'z'], ['x', 'y'], ['x', 'z']]
        .into_iter()
        .find_map(|[y, z]| Some([place(y)?, place(z)?]))
        .filter(|columns| columns.iter().all(|column| *column < width));
    if let Some([y, z]) = columns {
        unit = unit.or(names[y].1.filter(|_| names[y].1 == names[z].1));
    }
    (columns, unit)
}

/// The cells of a line of titles or units, separated by commas, semicolons or tabs if it has any, otherwise by blanks.
fn cells<'a>(line: &'a Line<'_>) -> Vec<&'a str> {
    let separators = [',', ';', '\t'];
    if line.bare.contains(separators) {
        line.bare.split(separators).map(str::trim).collect()
    } else {
        line.bare.split_whitespace().collect()
    }
}

/// A row of numbers.
#[derive(Debug, Clone)]
struct Row<'a> {
    line: Line<'a>,
    numbers: Vec<f64>,
}

/// A header and rows of numbers.
#[derive(Debug, Clone)]
struct Table<'a> {
    /// The lines before the first row.
    header: Vec<Line<'a>>,
    rows: Vec<Row<'a>>,
    /// The number of rows that were commented out.
    commented_out: usize,
    /// Rows of numbers in the header: their number and the line of the first one.
    header_rows: Option<(usize, usize)>,
    comma: Comma,
}

/// The lines of a text with their contents.
struct Scanned<'a> {
    lines: Vec<Line<'a>>,
    contents: Vec<Content>,
    comma: Comma,
}

impl Scanned<'_> {
    /// The numbers of the lines with rows in a range of lines.
    fn rows(&self, from: usize, to: usize) -> impl Iterator<Item = usize> {
        (from..to).filter(|k| matches!(self.contents[*k], Content::Row(_)))
    }

    fn refuse(&self, k: usize) -> String {
        unreadable(&self.lines[k], "a row of finite numbers", self.comma)
    }

    /// The range of lines with the most rows among the ranges that lines of words separate.
    ///
    /// # Errors
    /// Returns a refusal if words separate rows of points.
    fn longest_stretch(&self) -> Result<[usize; 2], String> {
        let words = |k: &usize| self.contents[*k] == Content::Words;
        let ends: Vec<usize> = (0..self.lines.len()).filter(words).collect();
        let starts = [0].into_iter().chain(ends.iter().map(|end| end + 1));
        let ends = ends.iter().copied().chain([self.lines.len()]);
        let stretches: Vec<([usize; 2], usize)> = starts
            .zip(ends)
            .map(|(from, to)| ([from, to], self.rows(from, to).count()))
            .collect();
        let most = stretches.iter().map(|(_, rows)| *rows).max().unwrap_or(0);
        let longest = stretches.iter().position(|(_, rows)| *rows == most);
        let longest = longest.unwrap_or(0);
        let (before, behind) = (&stretches[..longest], &stretches[longest..]);
        if let Some(([_, end], _)) = before.iter().find(|(_, rows)| *rows >= POINTS_MIN) {
            return Err(self.refuse(*end));
        }
        if behind[1..].iter().any(|(_, rows)| *rows > 0) {
            return Err(self.refuse(behind[0].0[1]));
        }
        Ok(behind[0].0)
    }

    /// The number of rows at the beginning of a range that belong to the header: a single row of another length than all others, or the rows
    /// before the first empty line if their numbers are far from those of the next row.
    fn header_rows(&self, [from, to]: [usize; 2], points: &[[f64; 2]]) -> usize {
        let rows: Vec<usize> = self.rows(from, to).collect();
        let blank = (from..to).find(|k| self.lines[*k].after_empty);
        let is_attached = |k: &&usize| blank.is_some_and(|blank| **k < blank);
        let attached = rows.iter().take_while(is_attached).count();
        let length = |k: &usize| match &self.contents[*k] {
            Content::Row(numbers) => numbers.len(),
            _ => 0,
        };
        let lone = rows.len() > 2
            && length(&rows[0]) != length(&rows[1])
            && rows[2..].iter().all(|k| length(k) == length(&rows[1]));
        if !(1..POINTS_MIN).contains(&attached) || 2 * attached >= rows.len() {
            return usize::from(lone);
        }
        let usual = median(&mut chords(&points[attached..]).collect::<Vec<f64>>());
        let apart = distance(points[attached - 1], points[attached]) > LONG_MEDIANS * usual;
        if apart { attached } else { 0 }
    }

    /// A broken row directly above the first row, which cannot be part of the header.
    fn broken_row(&self, from: usize, first: usize) -> Option<usize> {
        let above = (from..first)
            .rev()
            .take_while(|k| !self.lines[*k + 1].after_empty);
        let is_row = |k: &usize| {
            matches!(
                self.contents[*k],
                Content::Broken {
                    word: Some(_),
                    has_number: true
                }
            )
        };
        above.filter(is_row).last()
    }

    /// The first line that is not allowed between or after the rows. Words are allowed, as the end of a file.
    fn bad_line(&self, first: usize) -> Option<usize> {
        let is_bad = |k: &usize| match self.contents[*k] {
            Content::Broken { .. } => true,
            Content::Words => !self.lines[*k].bare.starts_with(is_end),
            Content::Row(_) => {
                self.comma == Comma::Separator && has_decimal_commas(&self.lines[*k].bare)
            }
            Content::Nothing => false,
        };
        (first..self.lines.len()).find(is_bad)
    }

    /// The number of rows from a line on that were commented out.
    fn commented_out(&self, first: usize) -> usize {
        let lines = self.lines[first..].iter();
        lines
            .filter(|line| is_commented_out(line, self.comma))
            .count()
    }

    fn nothing_found(&self) -> String {
        let is_broken = |k: &usize| matches!(self.contents[*k], Content::Broken { .. });
        if let Some(k) = (0..self.contents.len()).find(is_broken) {
            return self.refuse(k);
        }
        // Only words count as such a line if its first cell is a text.
        let named = self.lines.iter().find(|line| {
            let behind = words(&line.bare, self.comma).skip(1).take(2);
            behind.filter_map(|word| number(word, self.comma)).count() == 2
        });
        if let Some(line) = named {
            return format!(
                "no points found: line {}, {} given, begins with a word; remove the first column, rows begin with numbers",
                line.place,
                shown(line.text)
            );
        }
        match self.commented_out(0) {
            0 => "no points found; each needs a line that begins with numbers, such as y z"
                .to_owned(),
            count => format!(
                "no points found; {count} rows are remarks, since they begin with #, %, !, \", ' or ;"
            ),
        }
    }
}

/// Reads the header and the rows of a text.
///
/// # Errors
/// Returns a sentence that names the line that cannot be read, or states that there are no rows.
fn read_table(text: &str) -> Result<Table<'_>, String> {
    let lines = lines(text)?;
    let comma = comma_of(&lines);
    let contents = lines.iter().map(|line| content(&line.bare, comma));
    let scanned = Scanned {
        contents: contents.collect(),
        lines,
        comma,
    };
    let [from, to] = scanned.longest_stretch()?;
    let places: Vec<usize> = scanned.rows(from, to).collect();
    let points: Vec<[f64; 2]> = places
        .iter()
        .filter_map(|k| match &scanned.contents[*k] {
            Content::Row(numbers) => Some([numbers[0], numbers[1]]),
            _ => None,
        })
        .collect();
    let left_out = scanned.header_rows([from, to], &points);
    let Some(first) = places.get(left_out).copied() else {
        return Err(scanned.nothing_found());
    };
    let broken = scanned.broken_row(from, first).filter(|_| left_out == 0);
    if let Some(k) = broken.or_else(|| scanned.bad_line(first)) {
        return Err(scanned.refuse(k));
    }
    let in_header: Vec<usize> = scanned.rows(0, first).collect();
    let first_of = |k: &usize| (in_header.len(), scanned.lines[*k].place);
    let header_rows = in_header.first().map(first_of);
    let commented_out = scanned.commented_out(first);
    let mut header = scanned.lines;
    let body = header.split_off(first).into_iter();
    let rows = body.zip(scanned.contents.into_iter().skip(first));
    let rows = rows.filter_map(|(line, content)| match content {
        Content::Row(numbers) => Some(Row { line, numbers }),
        _ => None,
    });
    Ok(Table {
        header,
        rows: rows.collect(),
        commented_out,
        header_rows,
        comma,
    })
}

/// Returns whether a line of words that begins with `c` may end a file: `END`, `[END]`, `}`, a DOS end of file.
fn is_end(c: char) -> bool {
    c.is_alphabetic() || "[]{}()<>=-_\u{1a}".contains(c)
}

impl Table<'_> {
    fn refuse(&self, line: &Line, needed: &str) -> String {
        unreadable(line, needed, self.comma)
    }

    /// The values in two columns of every row, in mm.
    ///
    /// # Errors
    /// Returns the refusal of the first row that is too short.
    fn points(&self, columns: [usize; 2], unit_mm: Option<f64>) -> Result<Vec<[f64; 2]>, String> {
        let scale = unit_mm.unwrap_or(1.0);
        let point = |row: &Row| {
            let value = |column: usize| row.numbers.get(column).copied();
            match columns.map(value) {
                [Some(y), Some(z)] => Ok([y * scale, z * scale]),
                _ => {
                    let count = columns[0].max(columns[1]) + 1;
                    let needed = format!("a row of at least {count} finite numbers");
                    Err(self.refuse(&row.line, &needed))
                }
            }
        };
        self.rows.iter().map(point).collect()
    }

    /// The unit named by a line of the header such as `Units=mm` or `LENGTH = 'm'`.
    fn stated_unit(&self) -> Option<LengthUnit> {
        self.header.iter().find_map(|line| {
            let (name, value) = keyword(line)?;
            let is_unit = name.contains("unit") || name == "length";
            LengthUnit::named(&value).filter(|_| is_unit)
        })
    }
}
