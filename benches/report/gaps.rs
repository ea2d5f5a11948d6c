//! Contacts found from measured gaps and from profiles: the normal and the tangential problem.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::hint::black_box;

use railhead_contact::monitor::Unmonitored;
use railhead_contact::normal_stage;
use railhead_contact::solution::words::answer::Solution;
use serde_json::{Value, json};

use crate::examples::wheel_places;
use crate::machine::{lu_seconds, median, quantile, seconds_of};
use crate::questions::{number, problem, stored, timed};

const REPEATS: usize = 11;

/// Classes of the reference: heading, description, and the prefix of the names of its cases.
pub const CLASSES: [(&str, &str, &str); 4] = [
    (
        "Wheel on rail",
        "`gap_grid` of the undeformed distance of S1002 and UIC60 profiles, 61 to 100 samples a side",
        "prof_",
    ),
    (
        "Crowns of arcs",
        "`gap_profile`, a sample every 0.1 mm",
        "rad_",
    ),
    (
        "Quartics",
        "`gap_profile` of y² and y⁴, sampled likewise",
        "quart_",
    ),
    (
        "Two patches",
        "`gap_profile` of two parabolas, sampled likewise",
        "two_",
    ),
];

pub fn section() -> String {
    let mut text = "## Contacts from gaps\n\nAt the default target of 0.005, resultants only; both problems are in the time.\n\n".to_owned();
    let cases = [stored("gap_grids"), stored("gap_profiles")].concat();
    for (name, what, start) in CLASSES {
        let _ = writeln!(text, "### {name}\n\nGiven as {what}.\n");
        let of_class = |case: &&Value| case["id"].as_str().is_some_and(|id| id.starts_with(start));
        text.push_str(&table(cases.iter().filter(of_class)));
    }
    text + &wheels()
}

/// Returns the table of one class against its reference.
fn table<'a>(cases: impl Iterator<Item = &'a Value>) -> String {
    let mut text = "| case | LU | normal problem, LU | error of resultants | estimate | approach | area | largest pressure |\n\
                    |---|---|---|---|---|---|---|---|\n"
        .to_owned();
    let (mut whole, mut normal, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    for case in cases {
        let lu = lu_seconds();
        let checked = problem(&question(case));
        let (solution, seconds) = timed(&checked, REPEATS);
        let press = || {
            let _ = black_box(normal_stage::solve(&checked, &Unmonitored));
        };
        let normal_seconds = median((0..REPEATS).map(|_| seconds_of(press).0).collect());
        let solution = solution.expect("an answer");
        let patches = &solution.patches;
        let area: f64 = patches.iter().map(|p| p.area_mm2).sum();
        let peaks = patches.iter().map(|p| p.pressure_max_mpa);
        let peak = peaks.fold(0.0, f64::max);
        let (error, estimate) = error(case, &solution, area);
        let off = |name: &str, found: f64| found / number(&case[name], "value") - 1.0;
        let _ = writeln!(
            text,
            "| {} | {:.2} | {:.2} | {error:.4} | {estimate:.4} | {:+.5} | {:+.4} | {:+.4} |",
            case["id"].as_str().unwrap_or_default(),
            seconds / lu,
            normal_seconds / lu,
            off("approach_mm", patches[0].approach_mm.unwrap_or(f64::NAN)),
            off("area_mm2", area),
            off("pressure_max_mpa", peak),
        );
        whole.push(seconds / lu);
        normal.push(normal_seconds / lu);
        errors.push(error);
    }
    for (name, share) in [("median", 0.5), ("largest", 1.0)] {
        let of = |values: &[f64]| quantile(values.to_vec(), share);
        let _ = writeln!(
            text,
            "| {name} | {:.2} | {:.2} | {:.4} | | | | |",
            of(&whole),
            of(&normal),
            of(&errors)
        );
    }
    text + "\n"
}

/// Returns the largest error of the resultants and the largest estimate, both in the report's units.
pub fn error(case: &Value, solution: &Solution, area: f64) -> (f64, f64) {
    let total = &solution.total[0];
    let bound = 0.3 * number(case, "normal_force_n");
    let arm = bound * (area / PI).sqrt();
    let estimates = total.error_estimate.unwrap_or_default();
    let parts = [
        ("force_x_n", total.force_x_n, estimates.force_x_n, bound),
        ("force_y_n", total.force_y_n, estimates.force_y_n, bound),
        (
            "moment_z_n_mm",
            total.moment_z_n_mm,
            estimates.moment_z_n_mm,
            arm,
        ),
    ];
    parts.iter().fold(
        (0.0, 0.0),
        |(error, estimate), (name, found, own, scale)| {
            let off = (found - number(&case[*name], "value")).abs() / scale;
            (f64::max(error, off), f64::max(estimate, own / scale))
        },
    )
}

/// Returns a stored case as a question.
pub fn question(case: &Value) -> Value {
    let contact = if case["gap_mm"].is_array() {
        json!({ "type": "gap_grid", "x_mm": case["x_mm"], "y_mm": case["y_mm"], "gap_mm": case["gap_mm"] })
    } else {
        profile(case)
    };
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": contact,
        "load": { "normal_force_n": case["normal_force_n"] },
        "motion": { "creepage_x": case["creepage_x"], "creepage_y": case["creepage_y"], "spin_per_mm": case["spin_per_mm"] },
        "outputs": ["resultants"],
    })
}

/// Returns the gap of a stored case that is given by a formula, up to 2 mm beyond its window on either side.
fn profile(case: &Value) -> Value {
    let window = numbers(&case["window_y_mm"]);
    let (low, high) = (window[0] - 2.0, window[1] + 2.0);
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let last = ((high - low) / 0.1) as usize;
    // Measured from the middle, so that a symmetric window has symmetric samples.
    let at = |k: usize| middle + half * (2.0 * k as f64 - last as f64) / last as f64;
    let y: Vec<f64> = (0..=last).map(at).collect();
    let gap: Vec<f64> = y.iter().map(|y| across(&case["across"], *y)).collect();
    json!({ "type": "gap_profile", "rolling_mm": case["rolling_mm"], "y_mm": y, "gap_mm": gap })
}

fn numbers(value: &Value) -> Vec<f64> {
    let elements = value.as_array().expect("an array").iter();
    elements.map(|v| v.as_f64().expect("a number")).collect()
}

/// Returns the gap at x = 0, by the formulas in `tests/data/README.md`.
fn across(formula: &Value, y: f64) -> f64 {
    let rows = |name: &str| -> Option<Vec<Vec<f64>>> {
        Some(formula[name].as_array()?.iter().map(numbers).collect())
    };
    if let Some(parabolas) = rows("parabolas") {
        let values = parabolas.iter().map(|p| (y - p[0]).powi(2) / p[1] + p[2]);
        return values.fold(f64::INFINITY, f64::min);
    }
    if let Some(arcs) = rows("arcs") {
        let last = arcs.len() - 1;
        // ∫(y − t)/R(t) dt from 0 to y, arc by arc. The outer arcs extend to infinity.
        let part = |(k, arc): (usize, &Vec<f64>)| {
            let from = if k == 0 { f64::NEG_INFINITY } else { arc[0] };
            let to = if k == last { f64::INFINITY } else { arc[1] };
            let (low, high) = (from.max(y.min(0.0)), to.min(y.max(0.0)));
            let at = |t: f64| (y - t).powi(2) / (2.0 * arc[2]);
            if low < high {
                (at(low) - at(high)).abs()
            } else {
                0.0
            }
        };
        return arcs.iter().enumerate().map(part).sum();
    }
    let powers = numbers(&formula["powers"]);
    powers[0] * y.powi(2) + powers[1] * y.powi(4)
}

/// Returns the section on wheel on rail by profiles. The repository has no converged results for it, so that the errors are the solver's estimates.
fn wheels() -> String {
    let mut text = "### Wheel on rail by profiles\n\nS1002 on 60E1 as in `api/examples/wheel-rail.case.json`, by lateral shift of the wheelset, and the \
                    flange contact of `wheel-rail-flange.case.json`; 75 kN vertical, target 0.005.\n\n\
                    | case | patches | LU | tangential estimate |\n|---|---|---|---|\n"
        .to_owned();
    for (name, case) in wheel_places() {
        let lu = lu_seconds();
        let checked = problem(&case);
        let (solution, seconds) = timed(&checked, REPEATS);
        let solution = solution.expect("an answer");
        let estimate = solution.patches.iter().map(|patch| {
            let estimate = patch.points[0].error_estimate.unwrap_or_default();
            estimate.force_x_n.max(estimate.force_y_n)
                / (checked.problem.friction.largest() * patch.normal_force_n)
        });
        let _ = writeln!(
            text,
            "| {name} | {} | {:.2} | {:.4} |",
            solution.patches.len(),
            seconds / lu,
            estimate.fold(0.0, f64::max),
        );
    }
    text + "\n"
}
