//! Tests that the solver gives the answers that belong to its revision. Stored results are served to equal cases of the same revision, so that a
//! change of numbers without a new revision would leave stale answers in the cache of every service.
//!
//! After an intended change of numbers, raise `SOLVER_REVISION` in `src/contact/case/digest.rs`, then run `RAILHEAD_GOLDEN=write cargo test --test
//! physics golden`.

use std::path::PathBuf;

use railhead_contact::case::digest::SOLVER_REVISION;
use railhead_contact::numerics::simd::SimdLevel;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::reference::solve;

/// Largest allowed change for a given contact, relative to the largest number of its kind. Other processors sum in another order, which changes
/// matrices in single precision by up to 4e-6. Changes of method, mesh or tolerance are larger.
const SAME: f64 = 1e-4;
/// Largest allowed change for a wheel on a rail, whose vertical position is found by decisions that the last bits can change. Kernels without SIMD
/// change its numbers by 1.6e-3. The recorder finds smaller changes.
const SAME_OF_WHEELS: f64 = 0.01;

/// Message for a new case.
const NOT_RECORDED: &str = ": not recorded";

/// The answers that belong to a revision.
#[derive(Debug, Serialize, Deserialize)]
struct Golden {
    revision: u32,
    /// Numbers of every case, rounded to eight digits.
    answers: Vec<(String, Vec<f64>)>,
}

fn path() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("tests/data/golden.json")
}

fn case(contact: Value, motion: Value, solver: Value) -> Value {
    let mut case = json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": contact,
        "motion": motion,
        "solver": solver,
        "outputs": ["resultants", "zones", "tractions"],
    });
    if case["contact"]["type"] != "pressure_grid" {
        case["load"] = json!({ "normal_force_n": 80_000 });
    }
    case
}

fn gap(rough: f64) -> Value {
    let y: Vec<f64> = (-24..=24).map(|k| 0.5 * f64::from(k)).collect();
    let height = |y: &f64| y * y / 700.0 + rough * (3.0 * y).sin();
    let heights: Vec<f64> = y.iter().map(height).collect();
    json!({ "type": "gap_profile", "rolling_mm": 460, "y_mm": y, "gap_mm": heights })
}

fn gap_grid() -> Value {
    let axis: Vec<f64> = (-15..=15).map(|k| 0.8 * f64::from(k)).collect();
    let row = |y: &f64| -> Vec<f64> {
        let height = |x: &f64| x * x / 900.0 + (y.abs() - 4.0).powi(2) / 500.0;
        axis.iter().map(height).collect()
    };
    let rows: Vec<Vec<f64>> = axis.iter().map(row).collect();
    json!({ "type": "gap_grid", "x_mm": axis, "y_mm": axis, "gap_mm": rows })
}

fn pressures() -> Value {
    let axis: Vec<f64> = (-10..=10).map(|k| 0.7 * f64::from(k)).collect();
    let row = |y: &f64| -> Vec<f64> {
        let inside = |x: &f64| (1.0 - (x / 6.5).powi(2) - (y / 5.0).powi(2) + 0.02 * x).max(0.0);
        axis.iter().map(|x| 900.0 * inside(x).sqrt()).collect()
    };
    let rows: Vec<Vec<f64>> = axis.iter().map(row).collect();
    json!({ "type": "pressure_grid", "x_mm": axis, "y_mm": axis, "pressure_mpa": rows })
}

/// The shipped examples that are recorded.
const EXAMPLES: [&str; 5] = [
    "wheel-rail",
    "wheel-rail-flange",
    "friction",
    "maintenance",
    "unlike-bodies",
];

/// Returns cases of every contact type, method and kind of friction, with creepage, spin, forces and sweeps, and with the outputs for maintenance.
pub fn cases() -> Vec<(String, Value)> {
    let mut cases = made();
    cases.extend(frictions());
    for name in EXAMPLES {
        let file = format!(
            "{}/api/examples/{name}.case.json",
            concat!(env!("CARGO_MANIFEST_DIR"), "/..")
        );
        let text = std::fs::read_to_string(file).expect("an example");
        let case = serde_json::from_str(&text).expect("an example is JSON");
        cases.push((name, case));
    }
    let owned = |(name, case): (&str, Value)| (name.to_owned(), case);
    cases.into_iter().map(owned).collect()
}

/// Returns the solver settings with this method.
fn with(method: &str, mut solver: Value) -> Value {
    solver["method"] = json!(method);
    solver
}

/// Returns the cases that are not shipped examples.
fn made() -> Vec<(&'static str, Value)> {
    let radii = || json!({ "type": "radii", "rolling_mm": 460, "lateral_mm": 300 });
    let ellipse = |a: f64, b: f64| json!({ "type": "ellipse", "a_mm": a, "b_mm": b });
    let along = || json!({ "creepage_x": 0.001 });
    let all = || json!({ "creepage_x": 0.001, "creepage_y": -0.0005, "spin_per_mm": 0.0006 });
    let spin = || json!({ "creepage_x": 0.004, "spin_per_mm": 0.004 });
    let target = |t: f64| json!({ "method": "boundary_element", "target_error": t });
    let mesh = || json!({ "mesh": { "strips": 12, "cells": 16 } });
    let sweep = || json!([{ "creepage_x": 0.0005, "spin_per_mm": 0.003 }, { "creepage_x": 0.001, "spin_per_mm": 0.003 }, { "creepage_x": 0.002, "spin_per_mm": 0.003 }]);
    vec![
        ("radii, creepage", case(radii(), along(), target(0.005))),
        ("radii, all", case(radii(), all(), target(0.005))),
        ("radii, all, auto", case(radii(), all(), json!({}))),
        ("radii, all, 0.001", case(radii(), all(), target(0.001))),
        ("radii, all, 0.0003", case(radii(), all(), target(0.0003))),
        ("radii, spin", case(radii(), spin(), target(0.002))),
        ("radii, sweep", case(radii(), sweep(), target(0.005))),
        (
            "radii, force",
            case(
                radii(),
                json!({ "force_x_n": 9000, "spin_per_mm": 0.0004 }),
                target(0.005),
            ),
        ),
        (
            "radii, full slip",
            case(
                radii(),
                json!({ "creepage_x": 0.2, "spin_per_mm": 0.01 }),
                target(0.005),
            ),
        ),
        ("radii, mesh", case(radii(), all(), mesh())),
        (
            "ellipse, long",
            case(ellipse(9.0, 2.0), all(), target(0.005)),
        ),
        (
            "ellipse, wide",
            case(ellipse(2.0, 9.0), all(), target(0.005)),
        ),
        (
            "ellipse, slender",
            case(ellipse(20.0, 1.0), along(), target(0.01)),
        ),
        (
            "ellipse, liu_hsu",
            case(ellipse(6.0, 4.0), along(), with("liu_hsu", mesh())),
        ),
        (
            "ellipse, liu_hsu, target",
            case(ellipse(6.0, 4.0), all(), with("liu_hsu", target(0.01))),
        ),
        (
            "ellipse, fastsim",
            case(ellipse(6.0, 4.0), all(), with("fastsim", json!({}))),
        ),
        ("gap profile", case(gap(0.0), all(), target(0.005))),
        ("gap profile, wavy", case(gap(0.001), all(), target(0.01))),
        (
            "gap grid, two patches",
            case(gap_grid(), all(), target(0.01)),
        ),
        ("pressure grid", case(pressures(), all(), target(0.01))),
        ("pressure grid, mesh", case(pressures(), all(), mesh())),
    ]
}

/// Returns cases with the creep table, and with friction other than one coefficient.
fn frictions() -> Vec<(&'static str, Value)> {
    let motion = || json!({ "creepage_x": 0.002, "creepage_y": -0.0005, "spin_per_mm": 0.0004, "speed_mm_per_s": 20_000 });
    let term = json!([{ "coefficient": 0.2, "half_speed_mm_per_s": 400 }]);
    let with = |friction: Value| {
        let contact = json!({ "type": "ellipse", "a_mm": 6, "b_mm": 4 });
        let mut case = case(contact, motion(), json!({ "target_error": 0.01 }));
        case["friction"] = friction;
        case
    };
    let falling = json!({ "law": "exponential", "limit": 0.15, "terms": term });
    let across = json!({ "across": { "y_mm": [-2, 2], "coefficient": [0.1, 0.4] } });
    let layer =
        json!({ "coefficient": 0.3, "layer": { "shear_modulus_mpa": 500, "thickness_mm": 0.01 } });
    let mut table = with(json!({ "coefficient": 0.3 }));
    table["solver"] = json!({ "method": "table" });
    table["outputs"] = json!(["resultants"]);
    vec![
        ("ellipse, table", table),
        ("friction falls", with(falling)),
        ("friction across", with(across)),
        ("friction with a layer", with(layer)),
    ]
}

/// Returns the number rounded to eight digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.7e}").parse().expect("a number")
}

/// Returns the numbers that identify an answer: forces, patches, stresses and temperatures. They are scaled to similar sizes.
fn numbers(case: &Value) -> Vec<f64> {
    let (solution, _) = solve(case);
    // Without a single coefficient, any number of similar size serves.
    let friction = case["friction"]["coefficient"].as_f64().unwrap_or(0.3);
    let mut numbers = Vec::new();
    for patch in &solution.patches {
        let bound = friction * patch.normal_force_n;
        numbers.extend([
            patch.normal_force_n / 1e4,
            patch.pressure_max_mpa / 1e3,
            patch.area_mm2 / 100.0,
        ]);
        for point in &patch.points {
            let arm = (patch.area_mm2 / std::f64::consts::PI).sqrt();
            numbers.extend([
                point.force_x_n / bound,
                point.force_y_n / bound,
                point.moment_z_n_mm / (bound * arm),
            ]);
            numbers.extend(point.error_estimate.map(|error| error.force_x_n / bound));
            let bound_max = friction * patch.pressure_max_mpa;
            numbers.extend(point.traction_max_mpa.map(|largest| largest / bound_max));
            let worst = point
                .subsurface
                .as_ref()
                .and_then(|below| below.worst.as_ref());
            numbers.extend(worst.map(|worst| worst.von_mises_mpa / patch.pressure_max_mpa));
            let heat = point.temperature.as_ref();
            numbers.extend(heat.map(|heat| heat.rise_max_k / 100.0));
        }
    }
    numbers.into_iter().map(rounded).collect()
}

/// Returns a message for each case whose numbers differ from the recorded ones.
fn changed(golden: &Golden, answers: &[(String, Vec<f64>)]) -> Vec<String> {
    let mut changed = Vec::new();
    for (name, now) in answers {
        let recorded = golden.answers.iter().find(|(known, _)| known == name);
        let Some((_, before)) = recorded else {
            changed.push(format!("{name}{NOT_RECORDED}"));
            continue;
        };
        let apart = before.iter().zip(now).map(|(a, b)| (a - b).abs());
        let apart = apart.fold(0.0, f64::max);
        let most = if name.starts_with("wheel-rail") {
            SAME_OF_WHEELS
        } else {
            SAME
        };
        if before.len() != now.len() || apart > most {
            changed.push(format!("{name}: {apart:.1e} apart"));
        }
    }
    changed
}

/// Returns the numbers of all cases.
fn answers() -> Vec<(String, Vec<f64>)> {
    let answer = |(name, case): (String, Value)| (name, numbers(&case));
    cases().into_iter().map(answer).collect()
}

#[test]
fn golden_answers_belong_to_the_revision_of_the_solver_at_every_simd_level() {
    let text = std::fs::read_to_string(path());
    let golden = text
        .ok()
        .map(|text| serde_json::from_str::<Golden>(&text).expect("golden.json is JSON"));
    if std::env::var_os("RAILHEAD_GOLDEN").is_some_and(|wish| wish == "write") {
        return write(golden.as_ref());
    }
    let golden =
        golden.expect("golden.json: RAILHEAD_GOLDEN=write cargo test --test physics golden");
    for level in SimdLevel::available() {
        let changed = changed(&golden, &level.during(answers));
        assert!(
            changed.is_empty() && golden.revision == SOLVER_REVISION,
            "answers of revision {}, the solver has {SOLVER_REVISION}; changed at level {level}: {changed:#?}\n\
             raise SOLVER_REVISION if they were meant to change, then RAILHEAD_GOLDEN=write cargo test --test physics golden",
            golden.revision
        );
    }
}

/// Writes the present answers. Changed answers need a higher revision.
fn write(before: Option<&Golden>) {
    let answers = answers();
    let recorded = before.map_or(0, |golden| golden.revision);
    let changed = before.map_or_else(Vec::new, |golden| changed(golden, &answers));
    let others = changed.iter().any(|what| !what.ends_with(NOT_RECORDED));
    assert!(
        !others || SOLVER_REVISION > recorded,
        "answers changed; raise SOLVER_REVISION above {recorded} first: {changed:#?}"
    );
    let lines: Vec<String> = answers
        .iter()
        .map(|answer| serde_json::to_string(answer).expect("JSON"))
        .collect();
    let text = format!(
        "{{\"revision\":{SOLVER_REVISION},\"answers\":[\n{}\n]}}\n",
        lines.join(",\n")
    );
    std::fs::write(path(), text).expect("golden.json can be written");
}
