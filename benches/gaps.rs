//! Measures the time of the normal and the tangential problem on the reference gaps, in one run on one thread.
//!
//! For every case, `cargo bench --bench gaps` prints the time of both problems in a default solve in µs, and the errors of approach, area and
//! largest pressure against the converged reference.

use std::hint::black_box;

use machine::{lu_seconds, median, quantile, seconds_of};
use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::{check, normal_stage, solve};
use serde_json::{Value, json};

mod machine;

const REPEATS: usize = 21;

fn main() {
    println!("1 LU = {:.0} µs", 1e6 * lu_seconds());
    println!();
    println!("| case | normal, µs | tangential, µs | approach | area | largest pressure |");
    println!("|---|---|---|---|---|---|");
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/data/gap_grids.json");
    let text = std::fs::read_to_string(folder).expect("reference data");
    let cases: Vec<Value> = serde_json::from_str(&text).expect("reference data are JSON");
    let (mut normal, mut tangential) = (Vec::new(), Vec::new());
    for case in &cases {
        let times = row(case);
        normal.push(times[0]);
        tangential.push(times[1]);
    }
    for (name, share) in [("median", 0.5), ("slowest", 1.0)] {
        let [normal, tangential] = [&normal, &tangential].map(|t| 1e6 * quantile(t.clone(), share));
        println!("| {name} | {normal:.0} | {tangential:.0} | | | |");
    }
}

fn row(case: &Value) -> [f64; 2] {
    let problem = check(&question(case), &Limits::default()).expect("a valid case");
    let time = |work: &dyn Fn()| median((0..REPEATS).map(|_| seconds_of(work).0).collect());
    let normal = time(&|| {
        let _ = black_box(normal_stage::solve(&problem, &Unmonitored));
    });
    let pressed = normal_stage::solve(&problem, &Unmonitored).expect("a contact");
    let whole = time(&|| {
        let _ = black_box(solve(&problem, &Unmonitored));
    });
    let tangential = whole - normal;
    let patches = pressed.footprint.patches();
    let off =
        |name: &str, found: f64| found / case[name]["value"].as_f64().expect("a number") - 1.0;
    let peak = patches.iter().map(|p| p.pressure_max).fold(0.0, f64::max);
    println!(
        "| {} | {:.0} | {:.0} | {:+.5} | {:+.4} | {:+.4} |",
        case["id"].as_str().unwrap_or_default(),
        1e6 * normal,
        1e6 * tangential,
        off("approach_mm", patches[0].approach.unwrap_or(f64::NAN)),
        off("area_mm2", patches.iter().map(|p| p.area).sum()),
        off("pressure_max_mpa", peak),
    );
    [normal, tangential]
}

/// Returns a stored case as a question.
fn question(case: &Value) -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "gap_grid", "x_mm": case["x_mm"], "y_mm": case["y_mm"], "gap_mm": case["gap_mm"] },
        "load": { "normal_force_n": case["normal_force_n"] },
        "motion": { "creepage_x": case["creepage_x"], "creepage_y": case["creepage_y"], "spin_per_mm": case["spin_per_mm"] },
        "outputs": ["resultants"],
    })
}
