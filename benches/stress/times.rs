//! Compares the time that `cases/check` expects with the actual time, kind by kind.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use railhead_contact::case::solver::Limits;
use railhead_contact::solution::words::answer::FoundBy;
use railhead_contact::{check, solve};
use serde_json::{Value, json};

use super::contacts::{Sample, samples};
use super::machine::{median, quantile};
use super::random::Random;
use super::runtime_probe::{ProbedTime, USUAL_LIMIT, probe};
use super::trial::attempt_timed;

/// Shorter solves count as this time in s, since their duration does not matter.
const SHORTEST: f64 = 1e-3;
/// An estimate is good within this factor either way.
const FACTOR: f64 = 3.0;

/// Number of creep curves.
const SWEEPS: usize = 60;

/// Times of one case.
#[derive(Debug, Clone, Copy)]
pub struct CaseTimes {
    /// Processor time of the solve in s.
    pub taken: f64,
    /// Estimated time by the formulas alone, in s.
    pub formulas: f64,
    /// Time that `cases/check` returns.
    pub told: ProbedTime,
}

pub type Times = Vec<CaseTimes>;

/// Returns the times that `cases/check` gives for a case.
///
/// # Panics
/// Panics if the case is invalid.
pub fn told(case: &Value) -> ProbedTime {
    let limits = Limits {
        memory_bytes: 4 << 30,
        ..Limits::default()
    };
    let checked = check(case, &limits).expect("a case");
    probe(&checked, USUAL_LIMIT, |monitor| {
        solve(&checked, monitor).map(drop)
    })
}

fn timed(case: &Value) -> Option<CaseTimes> {
    let (_, [taken, formulas]) = attempt_timed(case).ok()?;
    Some(CaseTimes {
        taken,
        formulas,
        told: told(case),
    })
}

/// Returns the table of the first `count` cases of a seed.
pub fn table(count: usize, seed: u64) -> String {
    let mut kinds: BTreeMap<&'static str, Times> = BTreeMap::new();
    for sample in samples(count, seed) {
        if let Some(times) = timed(&sample.case) {
            kinds.entry(sample.kind).or_default().push(times);
        }
    }
    section(kinds.iter().map(|(kind, times)| (*kind, times)), seed)
}

/// Returns creep curves from rest to the creepage of a sample at its spin, with neighbouring and distant motions.
fn sweeps(seed: u64) -> impl Iterator<Item = Value> {
    let mut random = Random(seed);
    let radii = samples(usize::MAX, seed).filter(|sample| sample.kind == "radii, target");
    radii.take(SWEEPS).map(move |Sample { mut case, .. }| {
        let count = random.decades(20.0, 3000.0) as usize;
        let motion = case["motion"].take();
        let part = |name: &str, k: usize| {
            motion[name].as_f64().expect("a number") * k as f64 / (count - 1) as f64
        };
        let motions = (0..count).map(|k| {
            json!({
                "creepage_x": part("creepage_x", k),
                "creepage_y": part("creepage_y", k),
                "spin_per_mm": motion["spin_per_mm"],
            })
        });
        case["motion"] = motions.collect();
        case["outputs"] = json!(["resultants"]);
        case
    })
}

/// Returns the section of the report, with creep curves made of the samples of a seed.
pub fn section<'a>(kinds: impl Iterator<Item = (&'a str, &'a Times)>, seed: u64) -> String {
    let mut text = format!(
        "## Time expected and taken\n\nThe time estimated by `/v1/cases/check` compared with the processor time of the solve; less than {SHORTEST} s counts as \
         {SHORTEST} s. *Within 3×*: neither is more\nthan {FACTOR} times the other. *Part*: cases whose solve did not end within the {} ms of the \
         check. *Formulas*: the same share without\nsolving anything.\n\n\
         | cases | number | within 3× | took longer | took less | part | taken: median, s | largest | formulas |\n\
         |---|---|---|---|---|---|---|---|---|\n",
        USUAL_LIMIT.as_millis()
    );
    let mut all = Times::new();
    for (kind, times) in kinds {
        row(&mut text, kind, times);
        all.extend(times);
    }
    let curves: Times = sweeps(seed).filter_map(|case| timed(&case)).collect();
    row(&mut text, "creep curves", &curves);
    all.extend(curves);
    row(&mut text, "all", &all);
    text.push('\n');
    text
}

/// Returns the numbers of cases that take more than `FACTOR` times the expected time, and less than 1/`FACTOR` of it.
fn beyond(times: &Times, expected: impl Fn(&CaseTimes) -> f64) -> [usize; 2] {
    let ratios = times.iter().map(|case| {
        let [taken, expected] = [case.taken, expected(case)].map(|seconds| seconds.max(SHORTEST));
        taken / expected
    });
    let longer = ratios.clone().filter(|ratio| *ratio > FACTOR).count();
    [longer, ratios.filter(|ratio| *ratio < 1.0 / FACTOR).count()]
}

fn row(text: &mut String, name: &str, times: &Times) {
    let taken: Vec<f64> = times.iter().map(|case| case.taken).collect();
    let share = |[longer, less]: [usize; 2]| {
        100.0 * (times.len() - longer - less) as f64 / times.len().max(1) as f64
    };
    let told = beyond(times, |case| case.told.seconds);
    let part = times
        .iter()
        .filter(|case| case.told.found_by != FoundBy::Solve);
    let _ = writeln!(
        text,
        "| {name} | {} | {:.1} % | {} | {} | {} | {:.1e} | {:.1e} | {:.1} % |",
        times.len(),
        share(told),
        told[0],
        told[1],
        part.count(),
        median(taken.clone()),
        quantile(taken, 1.0),
        share(beyond(times, |case| case.formulas)),
    );
}
