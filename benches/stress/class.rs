//! Classes of random cases, each checked against laws.

use std::fmt::Write as _;

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::solution::words::answer::{Fields, Solution};
use serde_json::{Value, json};

use crate::random::Random;

/// A class, the number of its cases, and the function that turns a basic case into one of the class.
pub type Class = (&'static str, usize, fn(&mut Random, &mut Value));

/// Returns a basic case: like bodies, one friction coefficient, an ellipse, creepages of a wheel on a rail.
pub fn base(random: &mut Random) -> Value {
    let ratio = random.decades(0.3, 3.0).sqrt();
    json!({
        "material": { "shear_modulus_mpa": 82_000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "ellipse", "a_mm": 5.0 * ratio, "b_mm": 5.0 / ratio },
        "load": { "normal_force_n": random.decades(10_000.0, 120_000.0) },
        "motion": {
            "creepage_x": random.between(-0.01, 0.01), "creepage_y": random.between(-0.01, 0.01),
            "spin_per_mm": random.between(-1e-3, 1e-3),
        },
        "outputs": ["resultants"],
    })
}

/// Returns the answer to a case, or `None` if it is refused.
pub fn solved(case: &Value) -> Result<Option<(Solution, Fields)>, String> {
    let Ok(checked) = contact::check(case, &Limits::default()) else {
        return Ok(None);
    };
    let answer = contact::solve(&checked, &Unmonitored);
    answer.map(Some).map_err(|error| error.to_string())
}

/// Checks the cases of a class at a target and returns the first cells of its row: name, tried, refused, solved, target met. Also returns the number of
/// failed cases, which are listed in `troubles`. `check` returns whether the target was met, or `None` if the case was refused.
pub fn tried(
    (name, count, make): Class,
    target: f64,
    seed: u64,
    troubles: &mut String,
    mut check: impl FnMut(&Value) -> Result<Option<bool>, String>,
) -> (String, usize) {
    let mut random = Random(seed);
    let [mut refused, mut solved, mut met, mut failed] = [0; 4];
    for _ in 0..count {
        let mut case = base(&mut random);
        case["solver"] = json!({ "target_error": target });
        make(&mut random, &mut case);
        match check(&case) {
            Ok(None) => refused += 1,
            Ok(Some(target_met)) => {
                solved += 1;
                met += usize::from(target_met);
            }
            Err(why) => {
                failed += 1;
                let _ = writeln!(troubles, "- {why}: `{case}`");
            }
        }
    }
    let cells = format!("| {name} | {count} | {refused} | {solved} | {met} |");
    (cells, failed)
}
