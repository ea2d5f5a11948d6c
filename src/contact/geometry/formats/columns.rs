//! Columns of numbers: y and z, one point per line.

use crate::contact::geometry::formats::lines::Line;
use crate::contact::geometry::formats::profile_file::ProfileFile;
use crate::contact::geometry::formats::table::{self, Table};
use crate::contact::geometry::length_unit::LengthUnit;

/// Rows from which on a column that counts them is recognised.
const COUNTED_MIN: usize = 8;

/// Reads the points. A line of titles before them says which columns are y and z and may name their unit; without it they are the
/// first two. Further columns are ignored.
pub(crate) fn read(text: &str) -> Result<ProfileFile, String> {
    let table = table::read(text)?;
    let (columns, unit) = titles(&table);
    if columns.is_none() && counts_rows(&table) {
        return Err(format!(
            "line {}: the first column counts the rows (0 or 1, 2, 3, …); remove it, or put a line of titles that contains y and z above the rows",
            table.rows[0].line.place
        ));
    }
    let columns = columns.unwrap_or([0, 1]);
    let mm = unit.or(table.stated_unit()).map(LengthUnit::mm);
    let scale = mm.unwrap_or(1.0);
    let points = table.points(columns)?;
    Ok(ProfileFile {
        points: points
            .into_iter()
            .map(|point| point.map(|part| part * scale))
            .collect(),
        unit_mm: mm,
        header_rows: table.header_rows,
        ..ProfileFile::default()
    })
}

/// Whether there are three columns or more and the first holds 0, 1, 2, … or 1, 2, 3, …
fn counts_rows(table: &Table) -> bool {
    let first = table.rows[0].numbers[0];
    table.rows.len() >= COUNTED_MIN
        && (first == 0.0 || first == 1.0)
        && table.rows.iter().enumerate().all(|(k, row)| {
            row.numbers.len() >= 3 && (row.numbers[0] - first - k as f64).abs() < 1e-9
        })
}

/// The columns of y and z, or of x and y, or of x and z, and their unit, by the last lines of the header: titles, units, or both.
fn titles(table: &Table) -> (Option<[usize; 2]>, Option<LengthUnit>) {
    let mut lines = table
        .header
        .iter()
        .rev()
        .filter(|line| !line.bare.is_empty());
    let Some(mut line) = lines.next() else {
        return (None, None);
    };
    let units = cells(line).map(LengthUnit::named);
    let mut unit = units
        .collect::<Option<Vec<_>>>()
        .and_then(|units| units.first().copied());
    if unit.is_some() {
        match lines.next() {
            Some(before) => line = before,
            None => return (None, unit),
        }
    }
    let mut names: Vec<(char, Option<LengthUnit>)> = Vec::new();
    for cell in cells(line) {
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
        let unit = cell.get(1..).and_then(LengthUnit::named);
        names.push((if is_axis { letter } else { ' ' }, unit));
    }
    let width = table.rows[0].numbers.len();
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

fn cells<'a>(line: &'a Line<'_>) -> impl Iterator<Item = &'a str> {
    let separated = line.bare.contains([',', ';', '\t']);
    line.bare
        .split(move |c: char| {
            if separated {
                ",;\t".contains(c)
            } else {
                c.is_whitespace()
            }
        })
        .map(str::trim)
        .filter(|cell| !cell.is_empty())
}
