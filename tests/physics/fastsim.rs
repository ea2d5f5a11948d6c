//! Tests of the simplified theory: what it must reproduce, and its errors elsewhere.

use std::f64::consts::PI;

use serde_json::{Value, json};

use crate::cases::{assert_fault, good_with};
use crate::gap_samples::GapReference;
use crate::random::Random;
use crate::reference::{Ellipse, HERTZ_CLASSES, assert_none, cases, median, solve};

const BOUNDS: [&str; 2] = ["elliptic", "parabolic"];

fn question(ellipse: &Ellipse, bound: &str) -> Value {
    let mut case = ellipse.case(1, 1);
    case["solver"] = json!({ "method": "fastsim", "traction_bound": bound });
    case
}

fn forces(ellipse: &Ellipse, bound: &str) -> [f64; 3] {
    ellipse.relative(&solve(&question(ellipse, bound)).0.patches[0].points[0])
}

/// Returns the stated errors of one solver block over the 62 Hertz cases, and the true errors of forces and moment, relative to μN.
fn against_converged(solver: &Value) -> (Vec<f64>, [Vec<f64>; 2]) {
    let (mut stated, mut errors) = (Vec::new(), [Vec::new(), Vec::new()]);
    for case in HERTZ_CLASSES.iter().flat_map(|class| cases(class)) {
        let ellipse = case.ellipse();
        let mut question = ellipse.case(1, 1);
        question["solver"] = solver.clone();
        let (solution, _) = solve(&question);
        let point = &solution.patches[0].points[0];
        let found = ellipse.relative(point);
        let off = |k: usize| (found[k] - case.converged()[k].value).abs();
        stated.push(point.error_estimate.expect("a class").force_x_n / ellipse.limit());
        errors[0].push(off(0).max(off(1)));
        errors[1].push(off(2));
    }
    (stated, errors)
}

fn uncovered(solver: &Value) -> usize {
    let (stated, [forces, moments]) = against_converged(solver);
    let largest = forces.iter().zip(&moments).map(|(f, m)| f.max(*m));
    largest
        .zip(stated)
        .filter(|(error, stated)| error > stated)
        .count()
}

#[test]
fn the_stated_class_covers_every_reference_case() {
    // Median, 90th percentile and maximum over the cases: of forces, then of the moment.
    let allowed = [
        [[0.035, 0.055, 0.12], [0.01, 0.03, 0.06]],
        [[0.045, 0.135, 0.16], [0.055, 0.1, 0.14]],
    ];
    for (bound, allowed) in BOUNDS.iter().zip(allowed) {
        let solver = json!({ "method": "fastsim", "traction_bound": bound });
        assert_eq!(uncovered(&solver), 0, "{bound}");
        let (_, errors) = against_converged(&solver);
        for ((name, mut errors), allowed) in ["forces", "moment"].iter().zip(errors).zip(allowed) {
            errors.sort_by(f64::total_cmp);
            let found = [
                median(&errors),
                errors[errors.len() * 9 / 10],
                errors[errors.len() - 1],
            ];
            println!(
                "{bound}, {name}: median {:.4}, 90 % {:.4}, largest {:.4}",
                found[0], found[1], found[2]
            );
            assert!(
                found.iter().zip(allowed).all(|(f, a)| *f <= a),
                "{bound} {name}: {found:?}"
            );
        }
    }
}

#[test]
fn the_stated_error_covers_random_motions() {
    for bound in BOUNDS {
        let mut random = Random(20_261_130);
        let mut part = || match random.below(3) {
            0 => 0.0,
            _ => random.sign() * random.decades(0.1, 10.0),
        };
        let motions: Vec<[f64; 3]> = (0..300).map(|_| [part(), part(), part()]).collect();
        let mut errors = Vec::new();
        for [x, y, spin] in motions {
            let shape = Ellipse::steel(random.decades(0.1, 10.0), random.between(0.0, 0.5));
            let ellipse = shape.normalised(x, y, spin);
            let mut case = ellipse.case(1, 1);
            case["solver"] = json!({ "method": "table" });
            case["outputs"] = json!(["resultants"]);
            let truth = ellipse.relative(&solve(&case).0.patches[0].points[0]);
            let found = forces(&ellipse, bound);
            let off = found.iter().zip(&truth).map(|(f, t)| (f - t).abs());
            errors.push(off.fold(0.0, f64::max));
        }
        errors.sort_by(f64::total_cmp);
        let covered = errors.iter().filter(|error| **error <= 0.16).count();
        let (middle, largest) = (median(&errors), errors[errors.len() - 1]);
        println!("{bound}: {covered} of 300 covered, median {middle:.3}, largest {largest:.3}");
        assert!(covered >= 282, "{bound}: {covered} of 300");
        assert!(largest < 0.32, "{bound}: {largest}");
    }
}

#[test]
fn the_stated_error_grows_on_coarse_meshes_as_the_true_one_does() {
    for (strips, cells) in [(1, 1), (2, 3), (4, 4), (4, 16), (16, 4), (24, 40)] {
        for bound in BOUNDS {
            let mesh = json!({ "strips": strips, "cells": cells });
            let solver = json!({ "method": "fastsim", "traction_bound": bound, "mesh": mesh });
            assert_eq!(uncovered(&solver), 0, "{strips} x {cells}, {bound}");
        }
    }
}

#[test]
fn full_slip_carries_friction_times_load() {
    for bound in BOUNDS {
        for (x, y) in [(40.0, 0.0), (0.0, -40.0), (30.0, 30.0)] {
            let [fx, fy, _] = forces(&Ellipse::steel(0.6, 0.28).normalised(x, y, 0.0), bound);
            assert!(
                (fx.hypot(fy) - 1.0).abs() < 2e-3,
                "{bound} {x} {y}: {fx} {fy}"
            );
            assert!(fx * x >= 0.0 && fy * y >= 0.0);
        }
    }
}

#[test]
fn vanishing_creepage_gives_the_forces_of_linear_theory() {
    let mut failures = Vec::new();
    for a_over_b in [0.2, 0.7, 1.0, 3.0] {
        for nu in [0.0, 0.28, 0.5] {
            let steel = Ellipse::steel(a_over_b, nu);
            for (k, direction) in [
                (0, [1.0, 0.0, 0.0]),
                (1, [0.0, 1.0, 0.0]),
                (1, [0.0, 0.0, 1.0]),
            ] {
                let motion = direction.map(|d| 1e-5 * d);
                let contact = steel.normalised(motion[0], motion[1], motion[2]);
                let draft = forces(&contact, "elliptic")[k];
                let exact = contact.forces(32, 32)[k];
                if (draft / exact - 1.0).abs() > 0.015 {
                    failures.push(format!(
                        "a/b {a_over_b}, ν {nu}, {direction:?}: {draft:e} for {exact:e}"
                    ));
                }
            }
        }
    }
    assert_none("linear forces", &failures);
}

#[test]
fn reversed_and_mirrored_motions_give_reversed_and_mirrored_forces() {
    for bound in BOUNDS {
        let steel = Ellipse::steel(1.7, 0.3);
        let [fx, fy, mz] = forces(&steel.normalised(0.4, 0.3, 0.9), bound);
        let near = |found: [f64; 3], expected: [f64; 3]| {
            let off = (0..3)
                .map(|k| (found[k] - expected[k]).abs())
                .fold(0.0, f64::max);
            assert!(off < 1e-12, "{bound}: {found:?} {expected:?}");
        };
        near(
            forces(&steel.normalised(-0.4, -0.3, -0.9), bound),
            [-fx, -fy, -mz],
        );
        near(
            forces(&steel.normalised(0.4, -0.3, -0.9), bound),
            [fx, -fy, -mz],
        );
        near(
            forces(&steel.normalised(-0.4, 0.3, 0.9), bound),
            [-fx, fy, mz],
        );
    }
}

#[test]
fn tractions_obey_their_bound_and_zones_cover_the_patch() {
    let contact = Ellipse::steel(1.0, 0.28).normalised(0.3, 0.1, 0.4);
    for (bound, highest) in BOUNDS.iter().zip([1.0, 4.0 / 3.0]) {
        let (solution, fields) = solve(&question(&contact, bound));
        let (point, patch) = (&solution.patches[0].points[0], &fields.patches[0]);
        let pressure = patch.cells(0).pressure_mpa.as_ref().expect("pressure");
        let peak = pressure.iter().copied().fold(0.0, f64::max);
        let values = &patch.points[0];
        let (tx, ty) = (
            values.traction_x_mpa.as_ref(),
            values.traction_y_mpa.as_ref(),
        );
        let (sx, sy) = (values.slip_x.as_ref(), values.slip_y.as_ref());
        for (i, &pressure) in pressure.iter().enumerate() {
            let (tx, ty) = (tx.expect("x")[i], ty.expect("y")[i]);
            let (sx, sy) = (sx.expect("x")[i], sy.expect("y")[i]);
            let allowed = if highest > 1.0 {
                // The peak of the paraboloid is 4/3 of the peak of the ellipsoid.
                0.3 * highest * 1.03 * pressure * pressure / peak
            } else {
                0.3 * pressure
            };
            assert!(
                tx.hypot(ty) <= allowed * (1.0 + 1e-9),
                "{bound} {i}: {tx} {ty} {allowed}"
            );
            assert!(tx * sy - ty * sx <= 1e-9 * allowed && tx * sx + ty * sy >= 0.0);
        }
        assert!(point.stick_cells > Some(0) && point.slip_cells > Some(0));
        let areas = point
            .stick_area_mm2
            .zip(point.slip_area_mm2)
            .expect("zones");
        assert!(((areas.0 + areas.1) / solution.patches[0].area_mm2 - 1.0).abs() < 1e-9);
        assert!(point.friction_power_n > 0.0);
    }
}

#[test]
fn nothing_moves_nothing_rubs_and_no_friction_are_exact() {
    let steel = Ellipse::steel(1.0, 0.28);
    let still = solve(&question(&steel, "elliptic")).0;
    let frictionless = Ellipse {
        friction: 0.0,
        ..steel.moving(0.001, 0.002, 0.0003)
    };
    let smooth = solve(&question(&frictionless, "elliptic")).0;
    for solution in [still, smooth] {
        let point = &solution.patches[0].points[0];
        assert_eq!(
            [point.force_x_n, point.force_y_n, point.moment_z_n_mm],
            [0.0; 3]
        );
        assert_eq!(point.error_estimate.expect("an estimate").force_x_n, 0.0);
        assert_eq!(point.target_met, None, "no target was given");
    }
}

#[test]
fn a_target_below_the_class_is_answered_and_said_to_be_missed() {
    let contact = Ellipse::steel(1.0, 0.28).normalised(0.3, 0.0, 0.4);
    for (target, met) in [(0.005, false), (0.15, false), (0.17, true)] {
        let mut case = question(&contact, "elliptic");
        case["solver"]["target_error"] = json!(target);
        let (solution, _) = solve(&case);
        assert_eq!(solution.patches[0].points[0].target_met, Some(met));
        let warned = solution
            .remarks
            .iter()
            .any(|remark| remark.code == "target-missed");
        assert_eq!(warned, !met, "{:?}", solution.remarks);
    }
}

#[test]
fn patches_of_gaps_are_drafted_within_the_class() {
    let mut failures = Vec::new();
    for case in GapReference::profiles() {
        let mut question = case.case();
        question["solver"] = json!({ "method": "fastsim" });
        let (solution, _) = solve(&question);
        let total = solution.total[0];
        let bound = 0.3 * case.normal_force_n;
        let length = (case.area_mm2.value / PI).sqrt();
        let stated = total.error_estimate.expect("a class");
        for (name, found, expected, stated, unit) in [
            (
                "F_x",
                total.force_x_n,
                case.force_x_n,
                stated.force_x_n,
                bound,
            ),
            (
                "F_y",
                total.force_y_n,
                case.force_y_n,
                stated.force_y_n,
                bound,
            ),
            (
                "M_z",
                total.moment_z_n_mm,
                case.moment_z_n_mm,
                stated.moment_z_n_mm,
                bound * length,
            ),
        ] {
            let error = (found - expected.value).abs();
            println!("{} {name}: {:.4}", case.id, error / unit);
            if error > stated + expected.unc {
                failures.push(format!(
                    "{} {name}: {found} for {}, {stated} is stated",
                    case.id, expected.value
                ));
            }
        }
    }
    assert_none("too far from the converged value", &failures);
}

#[test]
fn other_methods_have_no_choice_of_bounds() {
    for method in ["auto", "boundary_element", "liu_hsu"] {
        let solver = json!({ "method": method, "traction_bound": "parabolic" });
        assert_fault(
            &good_with("/solver", solver),
            "/solver/traction_bound",
            &["fastsim"],
        );
    }
    let solver = json!({ "traction_bound": "elliptic" });
    assert_fault(
        &good_with("/solver", solver),
        "/solver/traction_bound",
        &["fastsim"],
    );
    let solver = json!({ "method": "fastsim", "traction_bound": "round" });
    assert_fault(
        &good_with("/solver", solver),
        "/solver/traction_bound",
        &["elliptic", "parabolic"],
    );
}

/// Tests that a patch of one sample, one row or one column does not spoil the forces of the main patch.
#[test]
fn patches_of_single_rows_of_samples_have_forces() {
    let axis: Vec<f64> = (-8..=8).map(f64::from).collect();
    let forces = |others: &[[usize; 2]], pressure: f64| {
        let lens = |x: &f64, y: &f64| 1.0 - (x / 4.0).powi(2) - ((y + 2.0) / 4.0).powi(2);
        let row = |y: &f64| -> Vec<f64> {
            let one = |x: &f64| 1000.0 * lens(x, y).max(0.0).sqrt();
            axis.iter().map(one).collect()
        };
        let mut rows: Vec<Vec<f64>> = axis.iter().map(row).collect();
        for [j, i] in others {
            rows[*j][*i] = pressure;
        }
        let contact =
            json!({ "type": "pressure_grid", "x_mm": axis, "y_mm": axis, "pressure_mpa": rows });
        let case = json!({
            "material": { "shear_modulus_mpa": 82_000.0, "poisson_ratio": 0.28 },
            "friction": { "coefficient": 0.3 },
            "contact": contact,
            "motion": { "creepage_x": 0.001, "creepage_y": 0.0005, "spin_per_mm": 1e-4 },
            "solver": { "method": "fastsim" },
            "outputs": ["resultants"],
        });
        let total = &solve(&case).0.total[0];
        [total.force_x_n, total.force_y_n]
    };
    let alone = forces(&[], 0.0);
    for others in [
        &[[14, 8]][..],
        &[[14, 7], [14, 8], [14, 9]],
        &[[13, 8], [14, 8], [15, 8]],
    ] {
        let light = forces(others, 1e-6);
        let loaded = forces(others, 300.0);
        for k in [0, 1] {
            assert!(
                (light[k] / alone[k] - 1.0).abs() < 1e-3,
                "{light:?}, {alone:?}"
            );
            assert!(loaded[k].abs() > alone[k].abs(), "{loaded:?}, {alone:?}");
        }
    }
}
