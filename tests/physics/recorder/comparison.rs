//! Describes the differences between two recordings: the first differences of each kind, and the largest change of every quantity.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::recorder::record::{Kind, Record, Recording, kind};

/// Number of differences that are written out. The others are counted.
const SHOWN: usize = 20;

/// Quantities that are compared between different arithmetics if the region is found by the solver.
const RESULTANTS: [&str; 5] = [
    "force_x",
    "force_y",
    "moment_z",
    "total_force",
    "total_moment",
];

/// How closely two recordings must agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Precision {
    /// All quantities agree to the last bit.
    Bits,
    /// The numbers that a client reads agree within these changes.
    Within {
        /// Allowed change for given contacts.
        given: f64,
        /// Allowed change of the resultants of contacts whose region is found by the solver.
        found: f64,
    },
}

/// Returns a description of the differences, or an empty string if the recordings agree.
pub fn compare(recorded: &Recording, present: &Recording, precision: Precision) -> String {
    let mut differences = Differences::new(precision);
    let before: BTreeMap<&str, &Record> = recorded
        .answers
        .iter()
        .map(|(name, record)| (name.as_str(), record))
        .collect();
    for (name, record) in &present.answers {
        match before.get(name.as_str()) {
            Some(before) => differences.record(name, before, record),
            None => differences.add(format!("{name}: not recorded")),
        }
    }
    for (name, _) in &recorded.answers {
        if !present.answers.iter().any(|(known, _)| known == name) {
            differences.add(format!("{name}: recorded, but asked no more"));
        }
    }
    differences.text()
}

struct Differences {
    precision: Precision,
    lines: Vec<String>,
    /// Per quantity: the number of differing lines, the largest change and its place.
    largest: BTreeMap<String, (usize, f64, String)>,
}

impl Differences {
    fn new(precision: Precision) -> Differences {
        Differences {
            precision,
            lines: Vec::new(),
            largest: BTreeMap::new(),
        }
    }

    fn add(&mut self, line: String) {
        self.lines.push(line);
    }

    fn record(&mut self, name: &str, before: &Record, now: &Record) {
        let known = before.0.iter().map(|(quantity, _)| quantity);
        let new = now.0.iter().map(|(quantity, _)| quantity);
        let new = new.filter(|quantity| before.get(quantity).is_none());
        for quantity in known.chain(new) {
            let (old, values) = (before.get(quantity), now.get(quantity));
            if old == values {
                continue;
            }
            let scale = scale(before, quantity);
            let change = change(old, values, scale);
            if let Precision::Within { given, found } = self.precision {
                let region_found = before.get("normal_work").is_some();
                let compared = if region_found {
                    RESULTANTS.contains(&quantity.as_str())
                } else {
                    kind(quantity) != Kind::Exact
                };
                if !compared || change <= if region_found { found } else { given } {
                    continue;
                }
            }
            let entry = self
                .largest
                .entry(quantity.clone())
                .or_insert((0, -1.0, String::new()));
            entry.0 += 1;
            if change > entry.1 {
                (entry.1, entry.2) = (change, name.to_owned());
            }
            let words = first_difference(old, values);
            self.add(format!("{name}: {quantity}{words}, change {change:.1e}"));
        }
    }

    fn text(&self) -> String {
        let mut text = String::new();
        if self.lines.is_empty() {
            return text;
        }
        let _ = writeln!(text, "{} lines differ:", self.lines.len());
        for line in self.lines.iter().take(SHOWN) {
            let _ = writeln!(text, "  {line}");
        }
        if self.largest.is_empty() {
            return text;
        }
        let _ = writeln!(
            text,
            "largest change of each quantity (resultants relative to μN):"
        );
        for (quantity, (count, change, name)) in &self.largest {
            let size = match kind(quantity) {
                Kind::Exact => String::new(),
                _ => format!(", at most {change:.1e} ({name})"),
            };
            let _ = writeln!(text, "  {quantity}: {count} lines{size}");
        }
        text
    }
}

/// Returns the scale by which changes of this quantity are measured.
fn scale(record: &Record, quantity: &str) -> f64 {
    let scales: Vec<f64> = record.get("scales").map_or_else(Vec::new, parsed);
    let [limit, length] = scales[..] else {
        return 0.0;
    };
    match kind(quantity) {
        Kind::Force => limit,
        Kind::Moment => limit * length,
        Kind::Number | Kind::Exact => {
            let values = record.get(quantity).map_or_else(Vec::new, parsed);
            values.into_iter().map(f64::abs).fold(0.0, f64::max)
        }
    }
}

fn parsed(values: &[String]) -> Vec<f64> {
    values.iter().filter_map(|v| v.parse().ok()).collect()
}

/// Returns the largest difference of the numbers over the scale. It is infinite if the count of numbers or the words differ.
fn change(before: Option<&[String]>, now: Option<&[String]>, scale: f64) -> f64 {
    let (Some(before), Some(now)) = (before, now) else {
        return f64::INFINITY;
    };
    if before.len() != now.len() {
        return f64::INFINITY;
    }
    let pairs = before.iter().zip(now).filter(|(old, new)| old != new);
    pairs
        .map(
            |(old, new)| match (old.parse::<f64>(), new.parse::<f64>()) {
                (Ok(old), Ok(new)) if scale > 0.0 => (old - new).abs() / scale,
                _ => f64::INFINITY,
            },
        )
        .fold(0.0, f64::max)
}

/// Returns a description of the first values that differ.
fn first_difference(before: Option<&[String]>, now: Option<&[String]>) -> String {
    match (before, now) {
        (None, _) => " was not there".to_owned(),
        (_, None) => " is there no more".to_owned(),
        (Some(old), Some(new)) if old.len() != new.len() => {
            format!(": {} values instead of {}", new.len(), old.len())
        }
        (Some(old), Some(new)) => {
            let at = old.iter().zip(new).position(|(old, new)| old != new);
            at.map_or_else(String::new, |at| {
                format!("[{at}]: {} instead of {}", new[at], old[at])
            })
        }
    }
}

fn recording(force: &str, iterations: &str) -> Recording {
    let text = format!(
        "revision 1\narithmetic test\n\n[one]\nscales 1e4 5e0\nforce_x {force} 3e3\niterations {iterations} 7\n"
    );
    Recording::read(&text).expect("a recording")
}

const ELSEWHERE: Precision = Precision::Within {
    given: 1e-9,
    found: 1e-2,
};

#[test]
fn a_recording_is_read_as_it_was_written() {
    let one = recording("1.25e3", "4");
    assert_eq!(Recording::read(&one.to_string()), Some(one));
}

#[test]
fn one_bit_is_a_difference_and_is_measured_by_the_friction_limit() {
    let before = recording("1.2500000000000002e3", "4");
    let now = recording("1.25e3", "4");
    assert_eq!(compare(&before, &before, Precision::Bits), "");
    let report = compare(&before, &now, Precision::Bits);
    assert!(
        report.contains("one: force_x[0]: 1.25e3 instead of 1.2500000000000002e3, change 2.3e-17"),
        "{report}"
    );
    assert_eq!(compare(&before, &now, ELSEWHERE), "");
}

#[test]
fn counts_are_compared_on_the_same_machine_only() {
    let (before, now) = (recording("1.25e3", "4"), recording("1.25e3", "5"));
    let report = compare(&before, &now, Precision::Bits);
    assert!(report.contains("iterations[0]: 5 instead of 4"), "{report}");
    assert_eq!(compare(&before, &now, ELSEWHERE), "");
    let far = recording("1.2501e3", "4");
    let report = compare(&before, &far, ELSEWHERE);
    assert!(
        report.contains("force_x: 1 lines, at most 1.0e-5 (one)"),
        "{report}"
    );
}

#[test]
fn missing_cases_and_quantities_are_differences() {
    let (one, mut fewer) = (recording("1.25e3", "4"), recording("1.25e3", "4"));
    fewer.answers[0].1.0.pop();
    let report = compare(&one, &fewer, Precision::Bits);
    assert!(report.contains("iterations is there no more"), "{report}");
    fewer.answers.clear();
    assert!(!compare(&one, &fewer, ELSEWHERE).is_empty());
    assert!(!compare(&fewer, &one, ELSEWHERE).is_empty());
}

#[test]
fn regions_that_are_found_are_compared_by_their_resultants_elsewhere() {
    let gap = |force: &str, area: &str| {
        let text = format!(
            "revision 1\narithmetic test\n\n[one]\nscales 1e4 5e0\nnormal_work 52 52 1\nforce_x {force}\nstick_area {area}\n"
        );
        Recording::read(&text).expect("a recording")
    };
    let before = gap("1.25e3", "4e0");
    assert_eq!(compare(&before, &gap("1.30e3", "7e0"), ELSEWHERE), "");
    let report = compare(&before, &gap("1.40e3", "4e0"), ELSEWHERE);
    assert!(
        report.contains("force_x: 1 lines, at most 1.5e-2"),
        "{report}"
    );
}
