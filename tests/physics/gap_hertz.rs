//! Tests that Hertz's contact given as a gap has Hertz's solution.

use std::f64::consts::PI;

use railhead_contact::normal::hertz::{Ellipse, NormalLoad};
use railhead_contact::solution::words::answer::Solution;
use serde_json::{Value, json};

use crate::gap_samples::{grid, profile, spread, steel};
use crate::reference::{assert_none, solve};

const CONTACT_MODULUS: f64 = 82_000.0 / 0.72;

/// Longitudinal and lateral radii in mm, and the force in N.
const CONTACTS: [(f64, f64, f64); 8] = [
    (460.0, 300.0, 100_000.0),
    (300.0, 300.0, 20_000.0),
    (460.0, 40.0, 80_000.0),
    (300.0, 3000.0, 50_000.0),
    (460.0, 300.0, 1.0),
    (12.0, 10.0, 50.0),
    (500.0, 13.0, 1000.0),
    (4000.0, 9000.0, 1e6),
];

fn hertz(rolling: f64, lateral: f64, force: f64) -> Ellipse {
    Ellipse::of_radii(rolling, lateral, NormalLoad::Force(force), CONTACT_MODULUS)
}

fn by_profile(rolling: f64, lateral: f64, ellipse: &Ellipse, points: usize) -> Value {
    let y = spread(-2.3 * ellipse.b, 2.1 * ellipse.b, points);
    profile(rolling, &y, |y| 0.5 * y * y / lateral)
}

fn by_grid(rolling: f64, lateral: f64, ellipse: &Ellipse, points: usize) -> Value {
    let x = spread(-1.9 * ellipse.a, 2.2 * ellipse.a, points);
    let y = spread(-2.3 * ellipse.b, 2.1 * ellipse.b, points + 3);
    grid(&x, &y, |x, y| 0.5 * x * x / rolling + 0.5 * y * y / lateral)
}

/// Returns the relative differences of approach, semi-axes, largest pressure and force from Hertz's.
fn differences(solution: &Solution, ellipse: &Ellipse, force: f64) -> [f64; 5] {
    assert_eq!(solution.patches.len(), 1);
    let patch = &solution.patches[0];
    let [x_min, x_max, y_min, y_max] = patch.extent_mm;
    [
        patch.approach_mm.expect("an approach") / ellipse.approach - 1.0,
        0.5 * (x_max - x_min) / ellipse.a - 1.0,
        0.5 * (y_max - y_min) / ellipse.b - 1.0,
        patch.pressure_max_mpa / ellipse.pressure_max - 1.0,
        patch.normal_force_n / force - 1.0,
    ]
}

const ALLOWED: [f64; 5] = [0.002, 0.005, 0.005, 0.005, 0.002];
const NAMES: [&str; 5] = ["approach", "a", "b", "p_max", "force"];

fn compare(failures: &mut Vec<String>, contact: Value, load: Value, ellipse: &Ellipse, force: f64) {
    let name = format!(
        "{} under {load}, a/b {:.2}",
        contact["type"],
        ellipse.a / ellipse.b
    );
    let mut case = steel(contact, load, [0.0; 3]);
    case["solver"] = json!({ "mesh": { "strips": 16, "cells": 16 } });
    let (solution, _) = solve(&case);
    let found = differences(&solution, ellipse, force);
    for k in 0..5 {
        if found[k].abs() > ALLOWED[k] {
            failures.push(format!("{name}: {} off by {:+.5}", NAMES[k], found[k]));
        }
    }
}

#[test]
fn load_and_approach_belong_together_as_in_hertzs_contact() {
    let mut failures = Vec::new();
    for (rolling, lateral, force) in CONTACTS {
        let ellipse = hertz(rolling, lateral, force);
        for contact in [
            by_profile(rolling, lateral, &ellipse, 41),
            by_grid(rolling, lateral, &ellipse, 30),
        ] {
            for load in [
                json!({ "normal_force_n": force }),
                json!({ "approach_mm": ellipse.approach }),
            ] {
                compare(&mut failures, contact.clone(), load, &ellipse, force);
            }
        }
    }
    assert_none("not Hertz's contact", &failures);
}

#[test]
fn a_loose_target_takes_fewer_cells_and_region_and_pressure_stay_within_it() {
    for (rolling, lateral, force) in CONTACTS {
        let ellipse = hertz(rolling, lateral, force);
        let contact = by_grid(rolling, lateral, &ellipse, 60);
        let mut case = steel(contact, json!({ "normal_force_n": force }), [0.0; 3]);
        let [default, loose] = [0.005, 0.02].map(|target| {
            case["solver"] = json!({ "target_error": target });
            let (solution, _) = solve(&case);
            let cells = solution.normal.as_ref().expect("a gap").cells;
            let off = differences(&solution, &ellipse, force).map(f64::abs);
            (cells, off.into_iter().fold(0.0, f64::max))
        });
        let told = format!("{rolling} {lateral}: {default:?} {loose:?}");
        assert!(default.1 < 0.003 && loose.1 < 0.012, "{told}");
        let [fine, coarse] = [default.0, loose.0].map(|cells| cells[0] * cells[1]);
        assert!(4 * coarse < 3 * fine, "{told}");
    }
}

#[test]
fn ellipses_oblique_to_the_axes_have_hertzs_area_and_pressure() {
    let force = 20_000.0;
    for lateral in [250.0, 50.0, 10.0] {
        let (rolling, ellipse) = (1000.0, hertz(1000.0, lateral, force));
        for degrees in [10.0_f64, 30.0, 45.0, 80.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let reach = |a: f64, b: f64| 1.6 * (ellipse.a * a).hypot(ellipse.b * b);
            let axis = |half: f64| spread(-half, half, 121);
            let contact = grid(&axis(reach(cos, sin)), &axis(reach(sin, cos)), |x, y| {
                let (along, across) = (x * cos + y * sin, y * cos - x * sin);
                0.5 * along * along / rolling + 0.5 * across * across / lateral
            });
            let load = json!({ "normal_force_n": force });
            let mut case = steel(contact, load, [0.0; 3]);
            case["solver"] = json!({ "mesh": { "strips": 16, "cells": 16 } });
            let (solution, _) = solve(&case);
            assert_eq!(solution.patches.len(), 1);
            let patch = &solution.patches[0];
            let area = patch.area_mm2 / (PI * ellipse.a * ellipse.b) - 1.0;
            let pressure = patch.pressure_max_mpa / ellipse.pressure_max - 1.0;
            assert!(
                area.abs() < 0.005 && pressure.abs() < 0.005,
                "a/b {:.1} at {degrees} degrees: area off by {area:+.4}, pressure by {pressure:+.4}",
                ellipse.a / ellipse.b
            );
        }
    }
}

#[test]
fn few_samples_of_a_parabola_are_enough() {
    let mut failures = Vec::new();
    let (rolling, lateral, force) = CONTACTS[0];
    let ellipse = hertz(rolling, lateral, force);
    let y = [-60.0, 0.0, 40.0];
    let contact = profile(rolling, &y, |y| 0.5 * y * y / lateral);
    compare(
        &mut failures,
        contact,
        json!({ "normal_force_n": force }),
        &ellipse,
        force,
    );
    assert_none("not Hertz's contact", &failures);
}

#[test]
fn a_constant_added_to_the_gap_is_added_to_the_approach() {
    let (rolling, lateral, force) = CONTACTS[0];
    let y = spread(-12.0, 12.0, 61);
    let solved = |offset: f64, load: Value| {
        let contact = profile(rolling, &y, |y| 0.5 * y * y / lateral + offset);
        solve(&steel(contact, load, [0.001, 0.0, 0.0])).0
    };
    let plain = solved(0.0, json!({ "normal_force_n": force }));
    let approach = plain.patches[0].approach_mm.expect("an approach");
    for offset in [-0.5, 0.25] {
        let moved = solved(offset, json!({ "normal_force_n": force }));
        let found = moved.patches[0].approach_mm.expect("an approach");
        assert!(
            (found - offset - approach).abs() < 1e-6 * approach,
            "{offset}: {found}"
        );
        assert!((moved.total[0].force_x_n / plain.total[0].force_x_n - 1.0).abs() < 1e-6);
        let pressed = solved(offset, json!({ "approach_mm": approach + offset }));
        let again = pressed.patches[0].normal_force_n;
        assert!((again / force - 1.0).abs() < 5e-4, "{offset}: {again}");
    }
}

#[test]
fn a_symmetric_gap_keeps_its_symmetry_to_the_last_digit() {
    for half in [0.0, 9.0] {
        let y = spread(-16.0, 16.0, 129);
        let contact = profile(460.0, &y, |y| (y.abs() - half).powi(2) / 160.0);
        let (solution, fields) = solve(&{
            let mut case = steel(
                contact,
                json!({ "normal_force_n": 80_000 }),
                [0.0, 0.0, 0.001],
            );
            case["outputs"] = json!(["pressure"]);
            case
        });
        let count = solution.patches.len();
        assert_eq!(count, if half == 0.0 { 1 } else { 2 });
        let [first, last] = [0, count - 1].map(|patch| fields.patches[patch].cells(0));
        let [low, high] = [&solution.patches[0], &solution.patches[count - 1]].map(|p| p.extent_mm);
        assert_eq!([low[2], low[3]], [-high[3], -high[2]]);
        let cells = first.x_mm.len();
        assert_eq!(cells, last.x_mm.len());
        // Strips run from smaller to larger y, so that the mirrored strip is counted from the end.
        let per_strip = first.strip.iter().filter(|strip| **strip == 0).count();
        for k in 0..cells {
            let image = cells - per_strip * (k / per_strip + 1) + k % per_strip;
            let [p, q] = [first, last].map(|f| f.pressure_mpa.as_ref().expect("pressures"));
            assert!((first.x_mm[k] - last.x_mm[image]).abs() < 1e-12);
            assert!((p[k] - q[image]).abs() < 1e-9 * solution.patches[0].pressure_max_mpa);
        }
        // F_x of pure spin vanishes on a mirror-symmetric contact.
        assert!(
            solution.total[0].force_x_n.abs() < 1e-6 * 24_000.0,
            "{:?}",
            solution.total[0]
        );
    }
}
