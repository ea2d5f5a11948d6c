//! Tests of the derivatives of forces and moment, each within its stated error: against Kalker's coefficients at rest, and against secants of finer
//! answers.

use railhead_contact::remark::entry::RemarkEntry;
use railhead_contact::rolling::linear_theory::coefficients_with_spin;
use railhead_contact::solution::words::answer::{Gradients, PointSolution};
use serde_json::{Value, json};

use crate::cases::{assert_fault, good_with};
use crate::random::Random;
use crate::reference::{Ellipse, assert_none, solve};

/// Targets of the answers. `FINE` is the target of the answers that give the secants.
const TARGETS: [f64; 2] = [0.02, 0.005];
const FINE: f64 = 0.0005;
/// Half the width of a secant, as a fraction of μN/(G c²).
const HALF: f64 = 0.02;
/// Allowed error of a secant relative to G c².
const SECANT: f64 = 0.03;
/// States as `[a/b, ν, ξ, η, φ]`, with creepages relative to those of full slip by the linear theory.
const STATES: [[f64; 5]; 8] = [
    [1.0, 0.28, 0.3, 0.0, 0.0],
    [1.0, 0.28, 0.9, -0.4, 0.0],
    [1.3, 0.28, 0.2, -0.3, 0.5],
    [0.4, 0.28, 0.4, 0.3, -0.8],
    [3.0, 0.28, -0.5, 0.2, 0.3],
    [0.7, 0.0, 0.0, 0.5, 1.2],
    [1.6, 0.45, 1.6, 0.5, 0.4],
    [0.2, 0.28, 0.6, 0.6, 0.2],
];

fn case(contact: &Ellipse, solver: Value) -> Value {
    let [x, y, spin] = contact.motion;
    let mut case = contact.case(8, 8);
    case["motion"] = json!({ "creepage_x": x, "creepage_y": y, "spin_per_mm": spin });
    case["solver"] = solver;
    case["outputs"] = json!(["resultants", "gradients"]);
    case
}

fn to(target: f64) -> Value {
    json!({ "method": "boundary_element", "target_error": target })
}

fn only(case: &Value) -> PointSolution {
    solve(case).0.patches[0].points[0].clone()
}

fn rows(gradients: &Gradients) -> [[f64; 3]; 3] {
    [
        gradients.force_x_n,
        gradients.force_y_n,
        gradients.moment_z_n_mm,
    ]
}

fn errors(gradients: &Gradients) -> [[f64; 3]; 3] {
    let errors = gradients.error_estimate.expect("an error");
    [errors.force_x_n, errors.force_y_n, errors.moment_z_n_mm]
}

/// Returns the units of the gradients: G c² for forces by creepages, with one more factor c for the moment and for the spin.
fn units(contact: &Ellipse) -> [[f64; 3]; 3] {
    let c = contact.c();
    let force = contact.shear_modulus_mpa * c * c;
    let row = [force, force, force * c];
    [row, row, row.map(|unit| unit * c)]
}

#[test]
fn gradients_at_rest_are_kalkers_coefficients_within_their_errors() {
    let mut failures = Vec::new();
    for (ratio, nu) in [(1.0, 0.28), (0.3, 0.28), (2.5, 0.1)] {
        let contact = Ellipse::steel(ratio, nu).moving(0.0, 0.0, 0.0);
        let [c11, c22, c23, c33] = coefficients_with_spin(ratio, nu);
        let unit = units(&contact);
        for target in TARGETS {
            let found = *only(&case(&contact, to(target)))
                .gradients
                .expect("gradients");
            let (rows, errors) = (rows(&found), errors(&found));
            let expected = [[c11, 0.0, 0.0], [0.0, c22, c23], [0.0, -c23, c33]];
            for (k, j) in (0..9).map(|n| (n / 3, n % 3)) {
                let off = (rows[k][j] / unit[k][j] - expected[k][j]).abs();
                // Kalker's coefficients are known to 0.5 %.
                let allowed = errors[k][j] / unit[k][j] + 0.005 * expected[k][j].abs() + 1e-3;
                if off > allowed || errors[k][j] > unit[k][j] {
                    failures.push(format!(
                        "a/b {ratio}, {target}: {k} by {j}: {off} > {allowed}"
                    ));
                }
            }
        }
    }
    assert_none("gradients at rest", &failures);
}

#[test]
fn gradients_are_secants_of_finer_answers_within_their_errors() {
    let mut failures = Vec::new();
    let mut compared = 0;
    for [ratio, nu, x, y, spin] in STATES {
        let contact = Ellipse::steel(ratio, nu).normalised(x, y, spin);
        let (unit, c) = (units(&contact), contact.c());
        let step = HALF * contact.limit() / unit[0][0];
        let steps = [step, step, step / c];
        let ahead_and_back = [0, 1, 2].map(|j| {
            [1.0, -1.0].map(|sign| {
                let mut motion = contact.motion;
                motion[j] += sign * steps[j];
                let [x, y, spin] = motion;
                let mut case = case(&contact.moving(x, y, spin), to(FINE));
                case["outputs"] = json!(["resultants"]);
                let point = only(&case);
                [point.force_x_n, point.force_y_n, point.moment_z_n_mm]
            })
        });
        for target in TARGETS {
            let found = *only(&case(&contact, to(target)))
                .gradients
                .expect("gradients");
            let (rows, errors) = (rows(&found), errors(&found));
            for (k, j) in (0..9).map(|n| (n / 3, n % 3)) {
                let [ahead, back] = ahead_and_back[j];
                let secant = (ahead[k] - back[k]) / (2.0 * steps[j]);
                let off = (rows[k][j] - secant).abs() / unit[k][j];
                let allowed = errors[k][j] / unit[k][j] + SECANT;
                compared += 1;
                if off > allowed {
                    failures.push(format!(
                        "{contact:?} {target}: {k} by {j}: {off} > {allowed}"
                    ));
                }
            }
        }
    }
    assert!(failures.len() * 20 <= compared, "{compared}: {failures:#?}");
}

/// Half of the ellipses move, a quarter nearly rest, and a quarter rests.
#[test]
fn errors_of_gradients_cover_the_changes_to_a_finer_target() {
    let mut random = Random(7);
    let (mut compared, mut beyond, mut far) = (0, 0, 0);
    for k in 0..48 {
        let ratio = 10_f64.powf(random.between(-0.9, 0.9));
        let contact = Ellipse::steel(ratio, random.between(0.0, 0.45));
        let size = [0.0, 0.1, 2.0, 2.0][k % 4];
        let [x, y, spin] = [0, 1, 2].map(|_| size * random.between(-1.0, 1.0));
        let contact = contact.normalised(x, y, spin);
        let gradients = |target: f64| {
            let found = only(&case(&contact, to(target))).gradients;
            found.expect("gradients")
        };
        let unit = units(&contact);
        let fine = gradients(0.001);
        for target in TARGETS {
            let found = gradients(target);
            let (values, errors) = (rows(&found), errors(&found));
            for (k, j) in (0..9).map(|n| (n / 3, n % 3)) {
                let off = (values[k][j] - rows(&fine)[k][j]).abs();
                let off = (off - 1e-6 * unit[k][j]).max(0.0);
                compared += 1;
                beyond += u32::from(off > errors[k][j]);
                far += u32::from(off > 2.0 * errors[k][j] + self::errors(&fine)[k][j]);
            }
        }
    }
    assert!(20 * beyond <= compared, "{beyond} of {compared}");
    assert!(100 * far <= compared, "{far} of {compared}");
}

#[test]
fn the_gradient_by_the_normal_force_is_that_of_growing_loads() {
    for solver in [
        to(0.005),
        json!({ "method": "table" }),
        json!({ "method": "fastsim" }),
    ] {
        let load = |force: f64| {
            let mut case = good_with("/load", json!({ "normal_force_n": force }));
            case["contact"] = json!({ "type": "radii", "rolling_mm": 460.0, "lateral_mm": 300.0 });
            case["motion"] =
                json!({ "creepage_x": 0.0008, "creepage_y": -0.0005, "spin_per_mm": 0.0002 });
            case["solver"] = solver.clone();
            case["outputs"] = json!(["resultants", "gradients"]);
            let point = only(&case);
            let numbers = [point.force_x_n, point.force_y_n, point.moment_z_n_mm];
            (numbers, *point.gradients.expect("gradients"))
        };
        let (back, ahead) = (load(78e3).0, load(82e3).0);
        let (here, gradients) = load(80e3);
        let by_normal_force = gradients.by_normal_force.expect("a Hertz contact");
        for k in 0..3 {
            let secant = (ahead[k] - back[k]) / 4e3;
            let unit = here[k].abs() / 80e3;
            let stated = gradients.error_estimate.map_or(0.0, |errors| {
                errors.by_normal_force.expect("a Hertz contact")[k]
            });
            let off = (by_normal_force[k] - secant).abs();
            assert!(
                off < stated + 0.02 * unit,
                "{solver}: {k}: {} against {secant}, stated {stated}",
                by_normal_force[k]
            );
        }
    }
}

#[test]
fn every_method_and_contact_gives_gradients_with_their_error() {
    let pressed = json!({
        "type": "gap_profile",
        "rolling_mm": 460.0,
        "y_mm": (-20..=20).map(f64::from).collect::<Vec<_>>(),
        "gap_mm": (-20..=20).map(|y| f64::from(y * y) / 600.0).collect::<Vec<_>>(),
    });
    for solver in [
        to(0.02),
        json!({ "method": "auto" }),
        json!({ "method": "fastsim" }),
        json!({ "method": "liu_hsu", "mesh": { "strips": 5, "cells": 5 } }),
        json!({ "method": "boundary_element", "mesh": { "strips": 8, "cells": 12 } }),
    ] {
        let mut case = good_with("/contact", pressed.clone());
        case["solver"] = solver.clone();
        case["outputs"] = json!(["resultants", "gradients"]);
        let point = only(&case);
        let gradients = point.gradients.as_deref().expect("gradients");
        assert!(gradients.force_x_n[0] > 0.0, "{solver}: {gradients:?}");
        assert!(gradients.by_normal_force.is_none(), "{solver}");
        case["outputs"] = json!(["resultants"]);
        let without = only(&case);
        assert!(without.gradients.is_none());
        let forces =
            |point: &PointSolution| [point.force_x_n, point.force_y_n, point.moment_z_n_mm];
        assert_eq!(forces(&point), forces(&without), "{solver}");
    }
}

#[test]
fn outputs_change_no_force_of_a_list() {
    for method in ["auto", "boundary_element"] {
        let creepage = json!({ "from": 0, "to": 0.006, "points": 4 });
        let motion = json!({ "sweep": { "creepage_x": creepage, "spin_per_mm": 2e-4 } });
        let mut case = good_with("/motion", motion);
        case["solver"] = json!({ "method": method, "target_error": 0.02 });
        let mut forces = |outputs: Value| {
            case["outputs"] = outputs;
            let (solution, _) = solve(&case);
            let points = solution.total.into_iter();
            let forces = points.map(|total| [total.force_x_n, total.force_y_n]);
            forces.collect::<Vec<_>>()
        };
        let alone = forces(json!(["resultants"]));
        for outputs in [json!(["gradients"]), json!(["slip", "tractions", "damage"])] {
            assert_eq!(forces(outputs.clone()), alone, "{method} with {outputs}");
        }
    }
}

#[test]
fn a_history_has_no_gradients() {
    let mut case = good_with("/outputs", json!(["gradients"]));
    case["motion"] = json!({ "history": { "distance_mm": [1.0], "creepage_x": [0.001] } });
    assert_fault(&case, "/outputs", &["gradients", "history"]);
}

#[test]
fn gradients_come_with_the_forces_or_a_remark_says_why_they_are_missing() {
    // The guesses of the paper diverge on one of the neighbouring motions.
    let case = json!({
        "material": { "shear_modulus_mpa": 82_000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "ellipse", "a_mm": 17.93230868023767, "b_mm": 1.3941317008194984 },
        "load": { "normal_force_n": 60_000 },
        "motion": { "creepage_x": 0.0, "creepage_y": -6.465087797765299e-4, "spin_per_mm": 1.9395263393295894e-4 },
        "outputs": ["resultants", "gradients"],
        "solver": { "method": "liu_hsu", "mesh": { "strips": 8, "cells": 10 } },
    });
    let (solution, _) = solve(&case);
    let point = &solution.patches[0].points[0];
    assert!(point.force_y_n > 0.0);
    let told = |remark: &RemarkEntry| remark.code == "gradients-not-converged";
    let missing = point.gradients.is_none();
    assert_eq!(solution.remarks.iter().any(told), missing);
}
