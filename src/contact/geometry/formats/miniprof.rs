//! MiniProf's rail and wheel profiles, `.ban` and `.whl`.
//!
//! A header of lines `Name=value`, or of free words in files of older versions, then one point per line. `ColumnDef` names the columns:
//! its `X` is y here and its `Y` is z; without it they are the first two. Instruments differ in the sense of both: `X` usually
//! points to the track centre, the sense of z is found from the shape.

use crate::contact::geometry::formats::lines::keyword;
use crate::contact::geometry::formats::profile_file::ProfileFile;
use crate::contact::geometry::formats::table;
use crate::contact::geometry::length_unit::LengthUnit;

/// Reads the points.
pub(crate) fn read(text: &str) -> Result<ProfileFile, String> {
    let table = table::read(text)?;
    let mut columns = [0, 1];
    let mut stated = None;
    for line in &table.header {
        match keyword(line) {
            Some((name, value)) if name == "columndef" => {
                columns = places(&value).ok_or_else(|| {
                    table.refuse(line, "a list with X and Y, such as ColumnDef=X,Y,A,C,")
                })?;
            }
            Some((name, value)) if name == "xypoints" => stated = value.parse::<usize>().ok(),
            _ => {}
        }
    }
    let points = table.points(columns)?;
    let counts = [points.len(), points.len() + table.remarked];
    let mm = table.stated_unit().map(LengthUnit::mm);
    let scale = mm.unwrap_or(1.0);
    Ok(ProfileFile {
        points: points
            .into_iter()
            .map(|point| point.map(|part| part * scale))
            .collect(),
        unit_mm: mm,
        mirror_y: Some(true),
        wrong_count: stated.filter(|count| !counts.contains(count)),
        header_rows: table.header_rows,
        ..ProfileFile::default()
    })
}

fn places(value: &str) -> Option<[usize; 2]> {
    let names: Vec<&str> = value
        .split(|c: char| c.is_whitespace() || c == ',' || c == ';')
        .filter(|name| !name.is_empty())
        .collect();
    let place = |name: &str| names.iter().position(|own| own.eq_ignore_ascii_case(name));
    Some([place("X")?, place("Y")?])
}
