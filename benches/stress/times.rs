//! Time that `cases/check` expects beside time taken, kind by kind.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::contacts::samples;
use super::trial::attempt_timed;

/// Shorter solves count as so long, in s: nobody plans by less.
const SHORTEST: f64 = 1e-3;
/// An estimate is good within this factor either way.
const FACTOR: f64 = 3.0;

/// Seconds taken and expected.
pub type Times = Vec<[f64; 2]>;

/// The table of the first `count` cases of a seed.
pub fn table(count: usize, seed: u64) -> String {
    let mut kinds: BTreeMap<&'static str, Times> = BTreeMap::new();
    for sample in samples(count, seed) {
        if let Ok((_, times)) = attempt_timed(&sample.case) {
            kinds.entry(sample.kind).or_default().push(times);
        }
    }
    section(kinds.iter().map(|(kind, times)| (*kind, times)))
}

/// The section of the report.
pub fn section<'a>(kinds: impl Iterator<Item = (&'a str, &'a Times)>) -> String {
    let mut text = format!(
        "## Time expected and taken\n\nSeconds that `/v1/cases/check` tells beside processor time of the solve; less than {SHORTEST} s counts as \
         {SHORTEST} s. *Within 3×*: neither is more\nthan {FACTOR} times the other.\n\n\
         | cases | number | within 3× | took longer | took less | taken: median, s | largest | expected: median, s |\n\
         |---|---|---|---|---|---|---|---|\n"
    );
    let mut all = Times::new();
    for (kind, times) in kinds {
        row(&mut text, kind, times);
        all.extend(times);
    }
    row(&mut text, "all", &all);
    text.push('\n');
    text
}

fn row(text: &mut String, name: &str, times: &Times) {
    let sorted = |place: usize| {
        let mut values: Vec<f64> = times.iter().map(|pair| pair[place]).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let [taken, expected] = [sorted(0), sorted(1)];
    let middle = |values: &[f64]| values.get(values.len() / 2).copied().unwrap_or(f64::NAN);
    let ratios = times.iter().map(|pair| {
        let [taken, expected] = pair.map(|seconds| seconds.max(SHORTEST));
        taken / expected
    });
    let longer = ratios.clone().filter(|ratio| *ratio > FACTOR).count();
    let less = ratios.filter(|ratio| *ratio < 1.0 / FACTOR).count();
    let share = (times.len() - longer - less) as f64 / times.len().max(1) as f64;
    let _ = writeln!(
        text,
        "| {name} | {} | {:.1} % | {longer} | {less} | {:.1e} | {:.1e} | {:.1e} |",
        times.len(),
        100.0 * share,
        middle(&taken),
        taken.last().copied().unwrap_or(f64::NAN),
        middle(&expected),
    );
}
