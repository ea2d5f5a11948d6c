//! MiniProf's rail and wheel profiles, `.ban` and `.whl`.
//!
//! Lines `Name=value`, an empty line, then one point per line in the columns that `ColumnDef` names; its `X` is y here and
//! its `Y` is z. Instruments differ in the sense of both: `X` usually points to the track centre, the sense of z is found from
//! the shape.

use crate::contact::geometry::formats::profile_file::{
    ProfileFile, has_decimal_commas, numbers, unreadable,
};

/// Reads the points, after a header of lines with `=`.
pub(crate) fn read(text: &str) -> Result<ProfileFile, String> {
    let mut contents = ProfileFile {
        mirror_y: Some(true),
        ..ProfileFile::default()
    };
    let mut columns = [0, 1];
    let mut expected = None;
    for (k, line) in text.lines().enumerate() {
        let line = line.trim().trim_start_matches('"').trim();
        if line.is_empty() {
            continue;
        }
        if let Some((name, value)) = line.split_once('=') {
            match name.trim() {
                "ColumnDef" => {
                    columns =
                        places(value).ok_or_else(|| unreadable(k, line, "a list with X and Y"))?;
                }
                "XYPoints" => expected = value.trim().parse::<usize>().ok(),
                _ => {}
            }
            continue;
        }
        let row = numbers(line)
            .filter(|row| columns.iter().all(|column| *column < row.len()))
            .filter(|_| !has_decimal_commas(line));
        let row = row.ok_or_else(|| {
            unreadable(
                k,
                line,
                "a line of finite numbers in the columns of ColumnDef",
            )
        })?;
        contents.points.push(columns.map(|column| row[column]));
    }
    match expected {
        Some(count) if count != contents.points.len() => Err(format!(
            "{} points found, but XYPoints says {count}",
            contents.points.len()
        )),
        _ if contents.points.is_empty() => Err("no points found".to_owned()),
        _ => Ok(contents),
    }
}

fn places(value: &str) -> Option<[usize; 2]> {
    let place = |name: &str| value.split(',').position(|column| column.trim() == name);
    Some([place("X")?, place("Y")?])
}
