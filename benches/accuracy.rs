//! Run time against error, per mesh and method, on the Hertz reference cases; one run, one thread.
//!
//! `cargo bench --bench accuracy` prints for every mesh: the error of the resultants against the converged reference
//! (largest component relative to μN; median, 90 %, largest over the cases) and the time of a solve, in microseconds
//! and in units of one 500 × 500 f64 LU measured in the same run.

mod machine;

use railhead::contact::monitor::Unwatched;
use railhead::contact::problem::Limits;
use railhead::contact::solution::Total;
use railhead::contact::{check, solve};
use serde_json::{Value, json};

use machine::{lu_seconds, median, quantile, seconds_of};

const CLASSES: [&str; 5] = [
    "hertz_long",
    "hertz_lat",
    "hertz_spin",
    "hertz_longspin",
    "hertz_xyspin",
];
const REPEATS: usize = 5;

fn main() {
    let cases = cases();
    let lu = lu_seconds();
    println!(
        "{} Hertz cases with friction limit; 1 LU = {:.0} µs",
        cases.len(),
        1e6 * lu
    );
    println!();
    println!(
        "| method | cells × strips | solved | error: median | 90 % | largest | µs | LU | slowest case, LU |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    targets(&cases, lu);
    if std::env::var_os("TARGETS_ONLY").is_some() {
        return;
    }
    for (cells, strips) in [
        (8, 8),
        (12, 12),
        (16, 16),
        (24, 12),
        (24, 24),
        (32, 16),
        (32, 32),
        (48, 24),
    ] {
        row(
            "boundary_element",
            &json!({ "method": "boundary_element", "mesh": { "strips": strips, "cells": cells } }),
            &cases,
            lu,
        );
    }
    row(
        "boundary_element",
        &json!({ "method": "boundary_element", "target_error": 0.005 }),
        &cases,
        lu,
    );
    for bound in ["elliptic", "parabolic"] {
        row(
            &format!("fastsim, {bound}"),
            &json!({ "method": "fastsim", "traction_bound": bound, "target_error": 0.2 }),
            &cases,
            lu,
        );
    }
    for (cells, strips) in [(8, 8), (12, 12), (16, 16), (24, 12)] {
        row(
            "liu_hsu",
            &json!({ "method": "liu_hsu", "mesh": { "strips": strips, "cells": cells } }),
            &cases,
            lu,
        );
    }
}

/// What a target costs and whether it is met.
fn targets(cases: &[Value], lu: f64) {
    println!(
        "| target | met | covered | certified | estimate / error | error: median | 90 % | largest | LU: median | 90 % | largest | iterations | products | cells |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for target in [0.02, 0.005, 0.001] {
        let (mut met, mut covered, mut certified) = (0, 0, 0);
        let (mut ratios, mut errors, mut seconds) = (Vec::new(), Vec::new(), Vec::new());
        let (mut iterations, mut products, mut cells) = (0, 0, 0);
        for case in cases {
            let solver = json!({ "target_error": target });
            let problem =
                check(&question(case, &solver), &Limits::default()).expect("a valid case");
            let (solution, _) = solve(&problem, &Unwatched).expect("a solution");
            seconds.push(median(
                (0..REPEATS)
                    .map(|_| seconds_of(|| solve(&problem, &Unwatched)).0)
                    .collect(),
            ));
            let total = &solution.total[0];
            let force =
                case["friction"].as_f64().unwrap() * case["normal_force_n"].as_f64().unwrap();
            let estimate = total.error_estimate.expect("an estimate").force_x_n / force;
            let error = error(total, case);
            let uncertainty = ["force_x", "force_y", "moment_z"]
                .iter()
                .map(|name| case[*name]["unc"].as_f64().unwrap())
                .fold(0.0, f64::max);
            let point = &solution.patches[0].points[0].solver;
            met += i32::from(error <= target + uncertainty);
            covered += i32::from(estimate >= error - uncertainty);
            certified += i32::from(estimate <= target);
            if std::env::var_os("DETAILS").is_some() {
                println!(
                    "{} {target} est {estimate:.5} err {error:.5} unc {uncertainty:.5} {}x{} it {} prod {} LU {:.2}",
                    case["id"],
                    point.mesh.cells,
                    point.mesh.strips,
                    point.iterations,
                    point.products,
                    seconds.last().unwrap() / lu
                );
            }
            ratios.push(estimate / error);
            errors.push(error);
            iterations += point.iterations;
            products += point.products;
            cells += point.mesh.cells * point.mesh.strips;
        }
        let n = cases.len() as u32;
        println!(
            "| {target} | {met} | {covered} | {certified} | {:.1} | {:.4} | {:.4} | {:.4} | {:.3} | {:.3} | {:.3} | {:.1} | {:.1} | {:.0} |",
            median(ratios),
            median(errors.clone()),
            quantile(errors.clone(), 0.9),
            quantile(errors, 1.0),
            median(seconds.clone()) / lu,
            quantile(seconds.clone(), 0.9) / lu,
            quantile(seconds, 1.0) / lu,
            f64::from(iterations) / f64::from(n),
            f64::from(products) / f64::from(n),
            f64::from(cells) / f64::from(n),
        );
    }
    println!();
}

/// The stored reference cases of all classes.
fn cases() -> Vec<Value> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data");
    let read = |class: &&str| -> Vec<Value> {
        let text =
            std::fs::read_to_string(format!("{folder}/{class}.json")).expect("reference data");
        serde_json::from_str(&text).expect("reference data are JSON")
    };
    CLASSES.iter().flat_map(read).collect()
}

/// A stored case as a question.
fn question(case: &Value, solver: &Value) -> Value {
    json!({
        "material": { "shear_modulus_mpa": case["shear_modulus_mpa"], "poisson_ratio": case["poisson_ratio"] },
        "friction": { "coefficient": case["friction"] },
        "contact": { "type": "ellipse", "a_mm": case["a_mm"], "b_mm": case["b_mm"] },
        "load": { "normal_force_n": case["normal_force_n"] },
        "motion": { "creepage_x": case["creepage_x"], "creepage_y": case["creepage_y"], "spin_per_mm": case["spin_per_mm"] },
        "solver": solver,
        "outputs": ["resultants"],
    })
}

fn row(method: &str, solver: &Value, cases: &[Value], lu: f64) {
    let (mut errors, mut seconds) = (Vec::new(), Vec::new());
    for case in cases {
        let problem = check(&question(case, solver), &Limits::default()).expect("a valid case");
        let (first, solution) = seconds_of(|| solve(&problem, &Unwatched));
        let Ok((solution, _)) = solution else {
            continue;
        };
        let repeats = if first > 0.05 { 1 } else { REPEATS };
        seconds.push(median(
            (0..repeats)
                .map(|_| seconds_of(|| solve(&problem, &Unwatched)).0)
                .collect(),
        ));
        errors.push(error(&solution.total[0], case));
    }
    let mesh = match solver.get("mesh") {
        Some(mesh) => format!("{} × {}", mesh["cells"], mesh["strips"]),
        None => format!("target {}", solver["target_error"]),
    };
    if errors.is_empty() {
        println!("| {method} | {mesh} | 0/{} | | | | | | |", cases.len());
        return;
    }
    let mean = seconds.iter().sum::<f64>() / seconds.len() as f64;
    println!(
        "| {method} | {mesh} | {}/{} | {:.4} | {:.4} | {:.4} | {:.0} | {:.3} | {:.3} |",
        errors.len(),
        cases.len(),
        median(errors.clone()),
        quantile(errors.clone(), 0.9),
        quantile(errors, 1.0),
        1e6 * mean,
        mean / lu,
        quantile(seconds, 1.0) / lu
    );
}

/// Largest error of the resultants relative to μN (moment: μN√(ab)).
fn error(total: &Total, case: &Value) -> f64 {
    let number = |value: &Value| value.as_f64().expect("a number");
    let force = number(&case["friction"]) * number(&case["normal_force_n"]);
    let length = (number(&case["a_mm"]) * number(&case["b_mm"])).sqrt();
    let found = [
        ("force_x", total.force_x_n / force),
        ("force_y", total.force_y_n / force),
        ("moment_z", total.moment_z_n_mm / (force * length)),
    ];
    found
        .into_iter()
        .map(|(name, value)| (value - number(&case[name]["value"])).abs())
        .fold(0.0, f64::max)
}
