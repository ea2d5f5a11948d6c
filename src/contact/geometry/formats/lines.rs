//! The lines of a text file: numbers, remarks and words, as instruments, programs and people write them.

use std::borrow::Cow;

/// Signs that begin a remark anywhere in a line.
const REMARK: [char; 5] = ['#', '%', '!', '$', '"'];
/// Signs that begin a remark at the start of a line; elsewhere they separate or quote.
const REMARK_AT_START: [char; 2] = [';', '\''];
/// Lines of a text that are not empty: five for each point that a cross-section may have.
const LINES_MAX: usize = 100_000;
/// Signs of a line that a message shows.
const SHOWN_MAX: usize = 300;

/// One line of a text.
#[derive(Debug, Clone)]
pub(crate) struct Line<'a> {
    /// Its number, from 1.
    pub(crate) place: usize,
    /// The line as it stands.
    pub(crate) text: &'a str,
    /// The line without its remark, without the quotes of quoted cells, and without blanks around it.
    pub(crate) bare: Cow<'a, str>,
    /// Whether an empty line is above it.
    pub(crate) after_empty: bool,
}

/// Whether a comma separates numbers or stands before their decimals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Comma {
    Separator,
    Decimal,
}

/// What a line holds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Held {
    /// A remark alone.
    Nothing,
    /// Two numbers or more, possibly with words behind them.
    Row(Vec<f64>),
    /// Less than a row: a single number, or a word that begins like a number but is none.
    Broken {
        /// The word that is no number; `None` for a single number.
        word: Option<String>,
        /// Whether at least one word is a number.
        has_number: bool,
    },
    /// Words.
    Words,
}

/// The lines of a text that are not empty, whatever ends them.
pub(crate) fn each_line(text: &str) -> impl Iterator<Item = Line<'_>> {
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

/// The same, if they are not too many.
///
/// # Errors
/// A sentence with the limit.
pub(crate) fn lines(text: &str) -> Result<Vec<Line<'_>>, String> {
    let lines: Vec<Line> = each_line(text).take(LINES_MAX + 1).collect();
    if lines.len() > LINES_MAX {
        return Err(format!(
            "the text has more than {LINES_MAX} lines; a cross-section has fewer"
        ));
    }
    Ok(lines)
}

/// A line without its remark.
fn bare(text: &str) -> Cow<'_, str> {
    let line = text.trim();
    if let Some(cells) = quoted_cells(line) {
        return Cow::Owned(cells);
    }
    if line.starts_with(REMARK_AT_START) {
        return Cow::Borrowed("");
    }
    // `1.#QNAN` is a number that failed, not a remark.
    let sign = |(at, _): &(usize, &str)| !line[..*at].ends_with('.');
    let remark = line.match_indices(REMARK).find(sign).map(|(at, _)| at);
    let end = remark.into_iter().chain(line.find("//")).min();
    Cow::Borrowed(line[..end.unwrap_or(line.len())].trim_end())
}

/// The cells of a line that is quoted as in CSV, `"1.0","2.0"` or `"Name=value"`, separated by semicolons; `None` for any other
/// line, in which a quote begins a remark.
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

/// A finite number, also with the exponents of Fortran, the minus sign of typography, or a decimal comma.
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

/// Whether a word would be a number if it were written correctly.
fn begins_like_number(word: &str) -> bool {
    let unsigned = word.trim_start_matches(['+', '-', '\u{2212}', '.', ',']);
    unsigned.starts_with(|c: char| c.is_ascii_digit()) || word.parse::<f64>().is_ok()
}

fn words(bare: &str, comma: Comma) -> impl Iterator<Item = &str> {
    let separates =
        move |c: char| c.is_whitespace() || c == ';' || c == ',' && comma == Comma::Separator;
    bare.split(separates)
        // `1,5, 2,5`: the comma behind a number separates.
        .map(move |word| match comma {
            Comma::Separator => word,
            Comma::Decimal => word.trim_end_matches(','),
        })
        .filter(|word| !word.is_empty())
}

/// What a line holds.
pub(crate) fn held(bare: &str, comma: Comma) -> Held {
    if bare.is_empty() {
        return Held::Nothing;
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
            // Behind two numbers it is a word: `2nd measurement`, `12:30`.
            None if begins_like_number(word) && numbers.len() < 2 => {
                malformed = malformed.or(Some(word));
            }
            None => break,
        }
    }
    match numbers.len() {
        _ if malformed.is_some() => broken(malformed, !numbers.is_empty()),
        0 => Held::Words,
        1 => broken(None, true),
        _ => Held::Row(numbers),
    }
}

/// The second word of a line such as `1.5 2,5`, in which blanks separate and the comma is within a number.
fn mixed_word(bare: &str) -> Option<&str> {
    let mut words = bare.split_whitespace();
    let _first = number(words.next()?, Comma::Separator)?;
    let second = words.next().filter(|word| !word.starts_with(','))?;
    let second = second.trim_end_matches([',', ';']);
    let is_mixed = second.contains(',') && begins_like_number(second);
    is_mixed.then_some(second)
}

fn broken(word: Option<&str>, has_number: bool) -> Held {
    Held::Broken {
        word: word.map(str::to_owned),
        has_number,
    }
}

/// Whether a line has two numbers or more, at least one of them with a decimal comma and none with a decimal point.
pub(crate) fn has_decimal_commas(bare: &str) -> bool {
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

/// How the rows of a text use the comma: one use for all rows. It is decimal if some rows have decimal commas and no row has decimal points.
pub(crate) fn comma_of(lines: &[Line]) -> Comma {
    let has_points = |line: &Line| {
        let is_number = |word: &&str| number(word, Comma::Separator).is_some();
        matches!(held(&line.bare, Comma::Separator), Held::Row(_))
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

/// A line `name = value`, `name: value` or `name value`: the name in lower case, and the value without quotes.
pub(crate) fn keyword(line: &Line) -> Option<(String, String)> {
    let begins = line.bare.starts_with(|c: char| c.is_alphabetic());
    let end = line
        .bare
        .find(|c: char| c == '=' || c == ':' || c.is_whitespace())
        .filter(|_| begins)?;
    let name = line.bare[..end].trim().to_ascii_lowercase();
    // Signs of remarks may stand in a quoted value.
    let quoted = line
        .text
        .split('\'')
        .nth(1)
        .filter(|_| line.bare.contains('\''));
    let value =
        line.bare[end..].trim_start_matches(|c: char| c == '=' || c == ':' || c.is_whitespace());
    Some((name, quoted.unwrap_or(value).trim().to_owned()))
}

/// The words of a row that is no point but was one before its line became a remark.
pub(crate) fn is_remarked_row(line: &Line, comma: Comma) -> bool {
    let inner = line.text.trim_start_matches(|c: char| {
        c.is_whitespace() || c == '/' || REMARK.contains(&c) || REMARK_AT_START.contains(&c)
    });
    line.bare.is_empty() && matches!(held(&bare(inner), comma), Held::Row(_))
}

/// A text in quotes as a message shows it, with its end left out if it is long.
pub(crate) fn shown(text: &str) -> String {
    let mut shown: String = text.chars().take(SHOWN_MAX).collect();
    if shown.len() < text.len() {
        shown.push('…');
    }
    format!("{shown:?}")
}

/// A refusal of a line: the line, the word in it that cannot be read, and what is allowed.
pub(crate) fn unreadable(line: &Line, needed: &str, comma: Comma) -> String {
    let place = |word: &str| {
        let at = line.text.find(word)?;
        let column = line.text[..at].chars().count() + 1;
        Some(format!(
            ", where {} at column {column} is no number",
            shown(word)
        ))
    };
    let word = match held(&line.bare, comma) {
        Held::Broken {
            word: Some(word), ..
        } => place(&word),
        Held::Broken { word: None, .. } => words(&line.bare, comma).nth(1).and_then(place),
        Held::Words => words(&line.bare, comma).next().and_then(place),
        Held::Nothing | Held::Row(_) => None,
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
