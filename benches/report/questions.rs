//! The reference cases as questions, and the errors of their answers.

use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::solution::words::answer::{Solution, Total};
use railhead_contact::{check, solve};
use serde_json::{Value, json};

use crate::machine::{median, seconds_of};

/// The reference classes of Hertz contacts with a friction limit.
pub const CLASSES: [&str; 5] = [
    "hertz_long",
    "hertz_lat",
    "hertz_spin",
    "hertz_longspin",
    "hertz_xyspin",
];

/// Returns a stored list of reference data.
pub fn stored(name: &str) -> Vec<Value> {
    let path = format!(
        "{}/tests/data/{name}.json",
        concat!(env!("CARGO_MANIFEST_DIR"), "/..")
    );
    let text = std::fs::read_to_string(path).expect("reference data");
    serde_json::from_str(&text).expect("reference data are JSON")
}

pub fn hertz_cases() -> Vec<Value> {
    CLASSES.iter().flat_map(|class| stored(class)).collect()
}

/// Returns a number of a stored case.
pub fn number(case: &Value, name: &str) -> f64 {
    case[name].as_f64().expect("a number")
}

/// Returns a stored Hertz case as a problem.
pub fn hertz(case: &Value, solver: &Value, outputs: &Value) -> CheckedCase {
    let question = json!({
        "material": { "shear_modulus_mpa": case["shear_modulus_mpa"], "poisson_ratio": case["poisson_ratio"] },
        "friction": { "coefficient": case["friction"] },
        "contact": { "type": "ellipse", "a_mm": case["a_mm"], "b_mm": case["b_mm"] },
        "load": { "normal_force_n": case["normal_force_n"] },
        "motion": { "creepage_x": case["creepage_x"], "creepage_y": case["creepage_y"], "spin_per_mm": case["spin_per_mm"] },
        "solver": solver,
        "outputs": outputs,
    });
    problem(&question)
}

/// Returns a question as a problem. Meshes beyond the default memory limit are allowed.
pub fn problem(question: &Value) -> CheckedCase {
    let limits = Limits {
        memory_bytes: 8 << 30,
        ..Limits::default()
    };
    check(question, &limits).expect("a valid case")
}

/// Returns the answer, if there is one, and the median time of a solve over `repeats`, or fewer for slow solves.
pub fn timed(checked: &CheckedCase, repeats: usize) -> (Option<Solution>, f64) {
    let (first, answer) = seconds_of(|| solve(checked, &Unmonitored));
    let Ok((solution, _)) = answer else {
        return (None, first);
    };
    let repeats = if first > 0.1 { 1 } else { repeats };
    let seconds = (0..repeats).map(|_| seconds_of(|| solve(checked, &Unmonitored)).0);
    (Some(solution), median(seconds.collect()))
}

/// Returns the largest error of the resultants of a Hertz case, and the uncertainty of the reference.
pub fn hertz_error(total: &Total, case: &Value) -> (f64, f64) {
    let bound = number(case, "friction") * number(case, "normal_force_n");
    let length = (number(case, "a_mm") * number(case, "b_mm")).sqrt();
    let found = [
        ("force_x", total.force_x_n / bound),
        ("force_y", total.force_y_n / bound),
        ("moment_z", total.moment_z_n_mm / (bound * length)),
    ];
    let error = |(name, value): &(&str, f64)| (value - number(&case[*name], "value")).abs();
    (
        found.iter().map(error).fold(0.0, f64::max),
        found
            .iter()
            .map(|(name, _)| number(&case[*name], "unc"))
            .fold(0.0, f64::max),
    )
}
