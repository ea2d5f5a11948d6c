//! Friction that falls with slip or temperature, varies laterally or has a layer, and dissimilar bodies: random cases checked against laws.

use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::class::{Class, base, solved, tried};
use crate::examples::example;
use crate::random::Random;

const CLASSES: [Class; 8] = [
    ("friction falls with slip", 600, falling),
    ("friction varies across", 400, across),
    ("friction falls with temperature", 300, heated),
    ("a layer, a reduction", 400, layered),
    ("a layer that yields", 200, yielding),
    ("bodies differ", 60, unlike),
    ("bodies differ, several motions", 40, unlike_motions),
    ("bodies differ, a wheel on a rail", 40, unlike_wheel),
];

fn falling(random: &mut Random, case: &mut Value) {
    let law = ["exponential", "rational", "linear"][random.below(3)];
    let term = |random: &mut Random| json!({ "coefficient": random.between(0.02, 0.3), "half_speed_mm_per_s": random.decades(50.0, 5000.0) });
    let terms: Vec<Value> = match random.part() < 0.5 {
        true => vec![term(random)],
        false => vec![term(random), term(random)],
    };
    case["friction"] = json!({ "law": law, "limit": random.between(0.02, 0.3), "terms": terms });
    case["motion"]["speed_mm_per_s"] = json!(random.decades(300.0, 80_000.0));
}

fn across(random: &mut Random, case: &mut Value) {
    let mut y: Vec<f64> = (0..4).map(|_| random.between(-8.0, 8.0)).collect();
    y.sort_by(f64::total_cmp);
    y[2] = y[1];
    let mu: Vec<f64> = (0..4).map(|_| random.decades(0.01, 0.8)).collect();
    case["friction"] = json!({ "across": { "y_mm": y, "coefficient": mu } });
}

fn layered(random: &mut Random, case: &mut Value) {
    let layer = json!({
        "shear_modulus_mpa": random.decades(10.0, 10_000.0), "thickness_mm": random.decades(1e-4, 0.2)
    });
    case["friction"] = match random.part() < 0.5 {
        true => json!({ "coefficient": 0.35, "layer": layer }),
        false => {
            json!({ "coefficient": 0.35, "layer": layer, "reduction": random.between(0.1, 1.0) })
        }
    };
}

fn heated(random: &mut Random, case: &mut Value) {
    let mut mu: Vec<f64> = (0..3).map(|_| random.between(0.02, 0.6)).collect();
    mu.sort_by(|a, b| b.total_cmp(a));
    let (first, second) = (random.decades(5.0, 500.0), random.decades(5.0, 500.0));
    let temperatures = json!([20.0, 20.0 + first, 20.0 + first + second]);
    case["friction"] =
        json!({ "by_temperature": { "temperature_c": temperatures, "coefficient": mu } });
    case["motion"]["speed_mm_per_s"] = json!(random.decades(300.0, 80_000.0));
    case["thermal"] = json!({
        "conductivity_w_per_mk": 50, "density_kg_per_m3": 7850, "specific_heat_j_per_kgk": 450, "bulk_c": 20
    });
}

fn yielding(random: &mut Random, case: &mut Value) {
    layered(random, case);
    case["friction"]["layer"]["yield_mpa"] = json!(random.decades(1.0, 1000.0));
    if random.part() < 0.5 {
        case["friction"]["layer"]["hardening_mpa_per_mm"] = json!(random.decades(1.0, 1e4));
    }
}

fn unlike(random: &mut Random, case: &mut Value) {
    let body = |random: &mut Random| json!({ "shear_modulus_mpa": random.decades(2e4, 2e5), "poisson_ratio": random.between(0.2, 0.4) });
    case["material"] = json!({ "upper": body(random), "lower": body(random) });
    case["solver"] = json!({ "target_error": 0.01 });
}

fn unlike_motions(random: &mut Random, case: &mut Value) {
    unlike(random, case);
    let motions: Vec<Value> = (0..3).map(|_| base(random)["motion"].take()).collect();
    case["motion"] = json!(motions);
}

fn unlike_wheel(random: &mut Random, case: &mut Value) {
    let motion = case["motion"].take();
    *case = example("wheel-rail");
    unlike(random, case);
    case["motion"] = motion;
    case["contact"]["lateral_shift_mm"] = json!(random.between(-5.0, 3.0));
    case["load"]["vertical_force_n"] = json!(random.decades(10_000.0, 120_000.0));
    case["outputs"] = json!(["resultants"]);
}

/// Returns the table. Cases that failed or broke a law are listed below it.
pub fn table(seed: u64) -> String {
    let mut text = String::from(
        "## Friction as it is, bodies that differ\n\n| cases | tried | refused | solved | target met | failed |\n|---|---|---|---|---|---|\n",
    );
    let mut troubles = String::new();
    for class in CLASSES {
        let (cells, failed) = tried(class, 0.005, seed, &mut troubles, one);
        let _ = writeln!(text, "{cells} {failed} |");
    }
    text + "\n" + &troubles
}

/// Returns whether the target was met at all points, or `None` if the case was refused.
fn one(case: &Value) -> Result<Option<bool>, String> {
    let Some((solution, _)) = solved(case)? else {
        return Ok(None);
    };
    let mut met = true;
    for patch in &solution.patches {
        for point in &patch.points {
            met &= point.target_met == Some(true);
            let own = point.region.as_ref();
            let limit = own.map_or(patch.friction_limit_n, |region| region.friction_limit_n);
            let limit = limit.unwrap_or(0.0);
            let force = point.force_x_n.hypot(point.force_y_n);
            if force > 1.02 * limit {
                return Err(format!("a force of {force} N beyond {limit} N"));
            }
            let creepage = point.motion.creepage_x.hypot(point.motion.creepage_y);
            if point.friction_power_n < -0.01 * limit * creepage {
                return Err(format!("a friction power of {} N", point.friction_power_n));
            }
        }
    }
    Ok(Some(met))
}
