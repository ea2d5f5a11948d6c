//! Compares the estimates in sweeps of neighbouring motions, which share corrections, with those of separate motions, and measures the cost of a
//! motion.

use std::f64::consts::TAU;

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::solution::words::answer::Solution;
use serde_json::{Value, json};

use crate::machine::{median, seconds_of};
use crate::population::{Class, case};
use crate::random::Random;
use crate::truth::{Frame, Judged, distance};

/// Number of sweeps of every form. The first half is for fitting, the second for checking.
const SWEEPS: usize = 40;
/// First number of the contacts in the population of ellipses. No other table uses these.
const FIRST: usize = 1000;
/// Number of motions of a sweep whose errors are checked, at different places.
const LOOKED_AT: usize = 6;
/// Target of the reference results, and their uncertainty as a share of their estimates.
const TARGET_TRUE: f64 = 4e-4;
const SHARE_TRUE: f64 = 0.5;
const TARGETS: [f64; 3] = [0.02, 0.005, 0.001];

/// The form of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// Creepages and spin grow together.
    Ray,
    /// The largest creepage grows, the others are constant.
    Curve,
    /// Both creepages over a grid, at constant spin.
    Map,
    /// Motions about one motion, in random order.
    Cloud,
    /// Motions in the order of a simulation: each component oscillates with its own frequency, to both sides.
    Steps,
}

const FORMS: [Form; 5] = [Form::Ray, Form::Curve, Form::Map, Form::Cloud, Form::Steps];

/// Returns the motions of a sweep up to the given creepages and spin.
fn motions(form: Form, end: [f64; 3], random: &mut Random) -> Vec<[f64; 3]> {
    let count = random.decades(15.0, 120.0) as usize;
    let from = random.between(0.0, 0.3);
    let part = |k: usize, count: usize| from + (1.0 - from) * k as f64 / (count - 1) as f64;
    match form {
        Form::Ray => (0..count)
            .map(|k| end.map(|v| v * part(k, count)))
            .collect(),
        Form::Curve => {
            let moving = usize::from(end[1].abs() > end[0].abs());
            let at = |k: usize| {
                let mut motion = end;
                motion[moving] *= part(k, count);
                motion
            };
            (0..count).map(at).collect()
        }
        Form::Map => {
            let columns = (count / 4).max(2);
            let at = |k: usize| {
                let (row, column) = (k / columns, k % columns);
                [
                    end[0] * part(row, 5),
                    end[1] * part(column, columns),
                    end[2],
                ]
            };
            (0..4 * columns).map(at).collect()
        }
        Form::Cloud => (0..count)
            .map(|_| end.map(|v| v * random.between(0.9, 1.1)))
            .collect(),
        Form::Steps => {
            let step = random.decades(0.02, 0.4);
            let swings = end.map(|v| (v, random.between(0.3, 1.0), random.between(0.0, TAU)));
            let at = |k: usize| {
                swings.map(|(v, rate, phase)| v * (rate * step * k as f64 + phase).sin())
            };
            (0..count).map(at).collect()
        }
    }
}

/// Returns case `number` of a form with all its motions, and the indices of the checked motions.
fn sweep(form: Form, number: usize) -> (Value, Vec<[f64; 3]>, Vec<usize>) {
    let mut question = case(Class::Ellipse, FIRST + number);
    let seed = 7_000_003 * (form as u64 + 1) + number as u64;
    let random = &mut Random(seed.wrapping_mul(0x2545_F491));
    let motion = question["motion"].take();
    let end = ["creepage_x", "creepage_y", "spin_per_mm"]
        .map(|name| motion[name].as_f64().expect("a number"));
    let motions = motions(form, end, random);
    let each = motions.len() as f64 / LOOKED_AT as f64;
    let looked = (0..LOOKED_AT).map(|k| ((k as f64 + random.part()) * each) as usize);
    (question, motions.clone(), looked.collect())
}

fn words(motion: &[f64; 3]) -> Value {
    json!({ "creepage_x": motion[0], "creepage_y": motion[1], "spin_per_mm": motion[2] })
}

/// Returns the answer to a question at a target, and its processor time in s.
fn solved(question: &Value, motion: Value, target: f64) -> Option<(Solution, f64)> {
    let mut question = question.clone();
    question["motion"] = motion;
    question["solver"] = json!({ "method": "boundary_element", "target_error": target });
    let checked = contact::check(&question, &Limits::default()).expect("a sound case");
    let (seconds, solved) = seconds_of(|| contact::solve(&checked, &Unmonitored));
    Some((solved.ok()?.0, seconds))
}

/// Returns the resultants and the estimate of a motion, relative to μN.
fn relative(question: &Value, solution: &Solution, k: usize) -> Option<([f64; 3], f64)> {
    let number = |part: &Value| part.as_f64().expect("a number");
    let limit =
        number(&question["friction"]["coefficient"]) * number(&question["load"]["normal_force_n"]);
    let [a, b] = ["a_mm", "b_mm"].map(|name| number(&question["contact"][name]));
    let total = &solution.total[k];
    let frame = Frame {
        centre: [0.0; 2],
        length: (a * b).sqrt(),
        limit,
    };
    let sum = railhead_contact::rolling::answer::Resultants {
        force_x: total.force_x_n,
        force_y: total.force_y_n,
        moment_z: total.moment_z_n_mm,
    };
    Some((frame.relative(sum), total.error_estimate?.force_x_n / limit))
}

/// Sums over the sweeps of one form at one target.
#[derive(Default)]
struct Sum {
    found: Vec<Judged>,
    /// Results of the same motions solved separately.
    alone: Vec<Judged>,
    motions: usize,
    /// Motions with an estimate interpolated from neighbours.
    lent: usize,
    seconds: f64,
    products: u64,
    met: usize,
}

/// Prints the tables; `each` prints every motion whose error exceeds its estimate.
pub fn tables(each: bool) {
    println!(
        "\n| sweeps | target | half | motions | met | lent | ms, products a motion | covered | 2x too small | estimate/error | the same motions alone |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for form in FORMS {
        let mut sums: [[Sum; 2]; 3] = Default::default();
        for number in 0..SWEEPS {
            let (question, motions, looked) = sweep(form, number);
            let truths: Vec<Option<([f64; 3], f64)>> = looked
                .iter()
                .map(|k| truth(&question, &motions[*k]))
                .collect();
            for (target, sums) in TARGETS.iter().zip(&mut sums) {
                let sum = &mut sums[usize::from(2 * number >= SWEEPS)];
                let all: Value = motions.iter().map(words).collect();
                let Some((solution, seconds)) = solved(&question, all, *target) else {
                    println!("  {form:?} {number} at {target}: no answer");
                    continue;
                };
                add(sum, &solution, seconds);
                for (k, known) in looked.iter().zip(&truths) {
                    let Some((value, uncertainty)) = known else {
                        continue;
                    };
                    let judged = |solution: &Solution, k: usize| {
                        let (found, estimate) = relative(&question, solution, k)?;
                        Some(Judged {
                            error: distance(found, *value),
                            estimate,
                            uncertainty: *uncertainty,
                        })
                    };
                    if let Some(judged) = judged(&solution, *k) {
                        if each && judged.error > judged.estimate + judged.uncertainty {
                            println!("  {form:?} {number} motion {k} at {target}: {judged:?}");
                        }
                        sum.found.push(judged);
                    }
                    let alone = solved(&question, words(&motions[*k]), *target);
                    sum.alone
                        .extend(alone.and_then(|(solution, _)| judged(&solution, 0)));
                }
            }
        }
        for (target, sums) in TARGETS.iter().zip(&sums) {
            for (half, sum) in ["fit", "check"].iter().zip(sums) {
                row(form, *target, half, sum);
            }
        }
    }
}

/// Returns the resultants of a motion, and their uncertainty.
fn truth(question: &Value, motion: &[f64; 3]) -> Option<([f64; 3], f64)> {
    let (solution, _) = solved(question, words(motion), TARGET_TRUE)?;
    let (value, estimate) = relative(question, &solution, 0)?;
    Some((value, SHARE_TRUE * estimate))
}

fn add(sum: &mut Sum, solution: &Solution, seconds: f64) {
    let points = &solution.patches[0].points;
    sum.motions += points.len();
    sum.seconds += seconds;
    for point in points {
        sum.products += u64::from(point.solver.products);
        sum.met += usize::from(point.target_met == Some(true));
        let lent = |text: &String| text.contains("neighbours");
        sum.lent += usize::from(point.solver.skipped.iter().any(lent));
    }
}

fn row(form: Form, target: f64, half: &str, sum: &Sum) {
    let part = |found: &[Judged], test: &dyn Fn(&Judged) -> bool| {
        let count = found.iter().filter(|judged| test(judged)).count();
        count as f64 / found.len().max(1) as f64
    };
    let words = |found: &[Judged]| {
        let clear = found.iter().filter(|j| j.error > j.uncertainty);
        let ratios = clear.map(|judged| judged.estimate / judged.error);
        format!(
            "{:.3} | {:.3} | {:.1}",
            part(found, &|j| j.error <= j.estimate + j.uncertainty),
            part(found, &|j| j.error > 2.0 * j.estimate + j.uncertainty),
            median(ratios.collect()),
        )
    };
    let each = |value: f64| value / sum.motions.max(1) as f64;
    println!(
        "| {form:?} | {target} | {half} | {} | {:.3} | {:.2} | {:.3}, {:.1} | {} | {} |",
        sum.motions,
        each(sum.met as f64),
        each(sum.lent as f64),
        1e3 * each(sum.seconds),
        each(sum.products as f64),
        words(&sum.found),
        words(&sum.alone).replace(" | ", ", "),
    );
}
