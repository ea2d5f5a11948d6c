//! The contents of a profile file, and how its lines are read.

/// The contents of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProfileFile {
    /// Points `[y, z]` in mm, with the file's own shifts, rotation and mirroring applied.
    pub points: Vec<[f64; 2]>,
    /// Whether y of the points is positive to the track centre, if the format specifies it.
    pub mirror_y: Option<bool>,
    /// Whether z of the points is positive up, if the format specifies it.
    pub mirror_z: Option<bool>,
    /// Whether the file describes a wheel, if it states the body.
    pub wheel: Option<bool>,
}

/// The numbers of a line, separated by blanks, commas, semicolons or tabs; `None` if a word is no number.
pub(crate) fn numbers(line: &str) -> Option<Vec<f64>> {
    line.split(|c: char| c.is_whitespace() || c == ',' || c == ';')
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().ok().filter(|number: &f64| number.is_finite()))
        .collect()
}

/// Whether the numbers of a line have decimal commas: each has one comma between digits, and no point.
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
    // A line with only one such word and no separator is a pair of whole numbers.
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
