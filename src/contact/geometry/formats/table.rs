//! A header and rows of numbers.

use crate::contact::geometry::formats::lines::{
    Comma, Held, Line, comma_of, has_decimal_commas, held, is_remarked_row, keyword, lines,
    unreadable,
};
use crate::contact::geometry::length_unit::LengthUnit;

/// What a line of points has to be.
const NEEDED: &str = "a row of finite numbers";
/// Rows in one piece that may be a part of the header: fewer than the points of any profile.
const HEADER_ROWS_MAX: usize = 7;
/// A row of the header is this many usual chords or more from the first point, while neighbouring points are one or two apart.
const CHORDS_APART: f64 = 10.0;

/// A row of numbers.
#[derive(Debug, Clone)]
pub(crate) struct Row<'a> {
    pub(crate) line: Line<'a>,
    pub(crate) numbers: Vec<f64>,
}

/// A header and rows of numbers.
#[derive(Debug, Clone)]
pub(crate) struct Table<'a> {
    /// The lines before the first row.
    pub(crate) header: Vec<Line<'a>>,
    pub(crate) rows: Vec<Row<'a>>,
    /// Rows that were commented out.
    pub(crate) remarked: usize,
    /// Rows of numbers in the header: their count and the line of the first.
    pub(crate) header_rows: Option<(usize, usize)>,
    comma: Comma,
}

/// The lines of a text with what they hold.
struct Scanned<'a> {
    lines: Vec<Line<'a>>,
    held: Vec<Held>,
    comma: Comma,
}

impl Scanned<'_> {
    fn rows(&self, from: usize, to: usize) -> impl Iterator<Item = usize> {
        (from..to).filter(|k| matches!(self.held[*k], Held::Row(_)))
    }

    fn refuse(&self, k: usize) -> String {
        unreadable(&self.lines[k], NEEDED, self.comma)
    }

    /// The stretch between lines of words that has the most rows.
    ///
    /// # Errors
    /// Words between rows.
    fn longest_stretch(&self) -> Result<[usize; 2], String> {
        let words = |k: &usize| self.held[*k] == Held::Words;
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
        if let Some(([_, end], _)) = before.iter().find(|(_, rows)| *rows > HEADER_ROWS_MAX) {
            return Err(self.refuse(*end));
        }
        if behind[1..].iter().any(|(_, rows)| *rows > 0) {
            return Err(self.refuse(behind[0].0[1]));
        }
        Ok(behind[0].0)
    }

    /// How many of the rows at the begin of a stretch belong to the header: those before its first empty line, or one of another length than
    /// all others, if they lie apart from the next row.
    fn header_rows(&self, [from, to]: [usize; 2], points: &[[f64; 2]]) -> usize {
        let rows: Vec<usize> = self.rows(from, to).collect();
        let blank = (from..to).find(|k| self.lines[*k].after_empty);
        let is_attached = |k: &&usize| blank.is_some_and(|blank| **k < blank);
        let attached = rows.iter().take_while(is_attached).count();
        let length = |k: &usize| match &self.held[*k] {
            Held::Row(numbers) => numbers.len(),
            _ => 0,
        };
        let lone = rows.len() > 2
            && length(&rows[0]) != length(&rows[1])
            && rows[2..].iter().all(|k| length(k) == length(&rows[1]));
        let chord = |pair: &[[f64; 2]]| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
        let count = if (1..=HEADER_ROWS_MAX).contains(&attached) {
            attached
        } else {
            usize::from(lone)
        };
        if count == 0 || 2 * count >= rows.len() {
            return 0;
        }
        let chords = points[count..].windows(2).map(chord);
        let mut chords: Vec<f64> = chords.collect();
        let middle = chords.len() / 2;
        let usual = *chords.select_nth_unstable_by(middle, f64::total_cmp).1;
        let apart = chord(&points[count - 1..=count]) > CHORDS_APART * usual;
        if apart { count } else { 0 }
    }

    /// A broken row directly above the first row: it is no header.
    fn broken_row(&self, from: usize, first: usize) -> Option<usize> {
        let above = (from..first)
            .rev()
            .take_while(|k| !self.lines[*k + 1].after_empty);
        let is_row = |k: &usize| {
            matches!(
                self.held[*k],
                Held::Broken {
                    word: Some(_),
                    has_number: true
                }
            )
        };
        above.filter(is_row).last()
    }

    /// The first line that may not stand behind the rows or between them. Words may: they are the end of a file.
    fn bad_line(&self, first: usize) -> Option<usize> {
        let is_bad = |k: &usize| match self.held[*k] {
            Held::Broken { .. } => true,
            Held::Words => !self.lines[*k].bare.starts_with(is_end),
            Held::Row(_) => {
                self.comma == Comma::Separator && has_decimal_commas(&self.lines[*k].bare)
            }
            Held::Nothing => false,
        };
        (first..self.lines.len()).find(is_bad)
    }

    /// Rows that are remarks.
    fn remarked(&self, first: usize) -> usize {
        let lines = self.lines[first..].iter();
        lines
            .filter(|line| is_remarked_row(line, self.comma))
            .count()
    }

    fn nothing_found(&self) -> String {
        let is_broken = |k: &usize| matches!(self.held[*k], Held::Broken { .. });
        if let Some(k) = (0..self.held.len()).find(is_broken) {
            return self.refuse(k);
        }
        match self.remarked(0) {
            0 => "no points found".to_owned(),
            count => format!(
                "no points found; {count} rows are remarks, since they begin with #, %, !, \", ' or ;"
            ),
        }
    }
}

/// Reads the header and the rows of a text.
///
/// # Errors
/// A sentence that names the line that cannot be read, or that there are no rows.
pub(crate) fn read(text: &str) -> Result<Table<'_>, String> {
    let lines = lines(text)?;
    let comma = comma_of(&lines);
    let held = lines.iter().map(|line| held(&line.bare, comma)).collect();
    let scanned = Scanned { lines, held, comma };
    let [from, to] = scanned.longest_stretch()?;
    let places: Vec<usize> = scanned.rows(from, to).collect();
    let points: Vec<[f64; 2]> = places
        .iter()
        .filter_map(|k| match &scanned.held[*k] {
            Held::Row(numbers) => Some([numbers[0], numbers[1]]),
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
    let remarked = scanned.remarked(first);
    let mut header = scanned.lines;
    let body = header.split_off(first);
    let rows = body.into_iter().zip(scanned.held.into_iter().skip(first));
    let rows = rows.filter_map(|(line, held)| match held {
        Held::Row(numbers) => Some(Row { line, numbers }),
        _ => None,
    });
    Ok(Table {
        header,
        rows: rows.collect(),
        remarked,
        header_rows,
        comma,
    })
}

/// Whether a line of words that begins with this may end a file: `END`, `[END]`, `}`, a DOS end of file.
fn is_end(c: char) -> bool {
    c.is_alphabetic() || "[]{}()<>=-_\u{1a}".contains(c)
}

impl Table<'_> {
    /// A refusal of a line of the header.
    pub(crate) fn refuse(&self, line: &Line, needed: &str) -> String {
        unreadable(line, needed, self.comma)
    }

    /// The values in two columns of every row.
    ///
    /// # Errors
    /// The first row that is too short.
    pub(crate) fn points(&self, columns: [usize; 2]) -> Result<Vec<[f64; 2]>, String> {
        let point = |row: &Row| {
            let value = |column: usize| row.numbers.get(column).copied();
            match columns.map(value) {
                [Some(y), Some(z)] => Ok([y, z]),
                _ => {
                    let count = columns[0].max(columns[1]) + 1;
                    let needed = format!("a row of at least {count} finite numbers");
                    Err(self.refuse(&row.line, &needed))
                }
            }
        };
        self.rows.iter().map(point).collect()
    }

    /// The unit that a line of the header names, such as `Units=mm` or `LENGTH = 'm'`.
    pub(crate) fn stated_unit(&self) -> Option<LengthUnit> {
        self.header.iter().find_map(|line| {
            let (name, value) = keyword(line)?;
            let is_unit = name.contains("unit") || name == "length";
            LengthUnit::named(&value).filter(|_| is_unit)
        })
    }
}
