//! Tests of the table of creep forces: its laws, its limits, and its errors.

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::rolling::linear_theory::{coefficients, coefficients_with_spin};
use railhead_contact::rolling::methods::table::evaluate::EllipseTable;
use railhead_contact::rolling::methods::table::file::table;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::cases::{assert_fault, good_with};
use crate::gap_samples::{Across, spread, steel};
use crate::reference::{
    Ellipse, HERTZ_CLASSES, assert_none, cases, median, read, solve, solve_on_meshes,
};

const SHAPES: [[f64; 2]; 7] = [
    [0.1, 0.3],
    [0.13, 0.0],
    [0.4, 0.28],
    [1.0, 0.25],
    [2.2, 0.5],
    [6.0, 0.1],
    [10.0, 0.33],
];

fn shapes() -> impl Iterator<Item = ([f64; 2], EllipseTable<'static>)> {
    SHAPES
        .into_iter()
        .map(|[ratio, nu]| ([ratio, nu], table().ellipse(ratio, nu)))
}

/// Returns directions of (u_x, u_y, u_s), some on planes of symmetry.
fn directions() -> Vec<[f64; 3]> {
    let mut all = vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for k in 0..24 {
        let (turn, height) = (2.4 * f64::from(k), (f64::from(k) - 11.5) / 12.0);
        let flat = (1.0 - height * height).sqrt();
        all.push([flat * turn.cos(), flat * turn.sin(), height]);
    }
    all
}

/// Returns the dimensionless creepage of a direction and size.
fn creepage(shape: [f64; 2], direction: [f64; 3], size: f64) -> [f64; 3] {
    let [ratio, nu] = shape;
    let [c11, c22, _] = coefficients(ratio, nu);
    let h = 0.5 * (c22 * ratio.sqrt()).hypot(c11 / ratio.sqrt());
    [c11, c22, h]
        .iter()
        .zip(direction)
        .map(|(c, d)| size * d / c)
        .collect::<Vec<_>>()
        .try_into()
        .expect("three")
}

fn close(left: [f64; 3], right: [f64; 3], within: f64) -> bool {
    left.iter().zip(right).all(|(l, r)| (l - r).abs() <= within)
}

#[test]
fn reversed_and_mirrored_creepages_give_reversed_and_mirrored_forces_to_the_last_bit() {
    for (shape, ellipse) in shapes() {
        for direction in directions() {
            let [x, y, z] = creepage(shape, direction, 1.7);
            let [fx, fy, m] = ellipse.creep([x, y, z]).force;
            assert!(close(
                ellipse.creep([-x, -y, -z]).force,
                [-fx, -fy, -m],
                0.0
            ));
            assert!(close(ellipse.creep([x, -y, -z]).force, [fx, -fy, -m], 0.0));
            assert!(close(ellipse.creep([-x, y, z]).force, [-fx, fy, m], 0.0));
        }
    }
}

#[test]
fn on_planes_of_symmetry_the_components_that_vanish_are_0() {
    for (shape, ellipse) in shapes() {
        for size in [0.1, 1.0, 2.5, 20.0] {
            let [fx, _, _] = ellipse.creep(creepage(shape, [0.0, 0.6, 0.8], size)).force;
            let [_, fy, m] = ellipse.creep(creepage(shape, [1.0, 0.0, 0.0], size)).force;
            assert!([fx, fy, m] == [0.0; 3], "{shape:?} {size}: {fx} {fy} {m}");
        }
    }
}

#[test]
fn vanishing_creepage_gives_linear_theory_exactly() {
    for (shape, ellipse) in shapes() {
        let [ratio, nu] = shape;
        let [c11, c22, c23, c33] = coefficients_with_spin(ratio, nu);
        for direction in directions() {
            let size = 1e-7;
            let [x, y, z] = creepage(shape, direction, size);
            let linear = [c11 * x, c22 * y + c23 * z, c33 * z - c23 * y];
            let found = ellipse.creep([x, y, z]);
            assert!(
                close(found.force, linear, 3e-5 * size),
                "{shape:?} {direction:?}: {found:?} {linear:?}"
            );
            assert!(found.stick > 0.999);
        }
        let (still, slopes) = (ellipse.creep([0.0; 3]), ellipse.slopes([0.0; 3]));
        assert!(still.force == [0.0; 3] && still.stick == 1.0 && still.bound == 0.0);
        let known = [[c11, 0.0, 0.0], [0.0, c22, c23], [0.0, -c23, c33]];
        for (found, known) in slopes.iter().zip(known) {
            assert!(close(*found, known, 1e-4 * c11.max(c33)), "{slopes:?}");
        }
    }
}

#[test]
fn creepage_beyond_all_bounds_gives_friction_along_the_slip() {
    for (shape, ellipse) in shapes() {
        for (x, y) in [(1.0, 0.0), (0.0, -1.0), (0.6, 0.8), (-0.3, 0.5)] {
            for far in [1e4, 1e160, 1e300] {
                let found = ellipse.creep([far * x, far * y, 0.0]);
                let length = f64::hypot(x, y);
                let along = [x / length, y / length, 0.0];
                assert!(
                    close(found.force, along, 2e-3),
                    "{shape:?} {far:e}: {found:?}"
                );
                assert!(found.stick < 0.01);
            }
        }
    }
}

#[test]
fn derivatives_are_those_of_the_values_and_continue_across_planes_of_symmetry() {
    let mut failures = Vec::new();
    for (shape, ellipse) in shapes() {
        for direction in directions() {
            for size in [0.05, 0.7, 1.9, 4.0, 30.0] {
                let at = creepage(shape, direction, size);
                let unit = creepage(shape, [1.0, 1.0, 1.0], size);
                let slopes = ellipse.slopes(at);
                for j in 0..3 {
                    let step = 2.5e-4 * unit[j];
                    let moved = |by: f64| {
                        let mut moved = at;
                        moved[j] += by;
                        ellipse.creep(moved).force
                    };
                    // On a plane of symmetry the two differences lie on its two sides.
                    let (back, here, ahead) = (moved(-step), ellipse.creep(at).force, moved(step));
                    for k in 0..3 {
                        let sides = [(here[k] - back[k]) / step, (ahead[k] - here[k]) / step];
                        for side in sides {
                            let off = (side - slopes[k][j]).abs() * unit[j];
                            // For pure spin, the direction turns within zero distance, and derivatives are differences.
                            let allowed = if direction[2] == 1.0 { 0.1 } else { 0.02 };
                            if off > allowed * size.clamp(0.4, 1.0) {
                                failures.push(format!(
                                    "{shape:?} {direction:?} {size} {k} by {j}: {side} {}",
                                    slopes[k][j]
                                ));
                            }
                        }
                    }
                }
            }
        }
    }
    assert_none("derivatives", &failures);
}

fn question(ellipse: &Ellipse, outputs: Value) -> Value {
    let mut case = ellipse.case(1, 1);
    case["solver"] = json!({ "method": "table" });
    case["outputs"] = outputs;
    case
}

#[test]
fn the_62_hertz_references_are_met_within_the_bounds() {
    let (mut errors, mut covered) = (Vec::new(), 0);
    for case in HERTZ_CLASSES.iter().flat_map(|class| cases(class)) {
        let ellipse = case.ellipse();
        let point = &solve(&question(&ellipse, json!(["resultants"]))).0.patches[0].points[0];
        let (found, converged) = (ellipse.relative(point), case.converged());
        let off = |k: usize| (found[k] - converged[k].value).abs();
        let largest = (0..3).map(off).fold(0.0, f64::max);
        let reference = converged.iter().map(|c| c.unc).fold(0.0, f64::max);
        let stated = point.error_estimate.expect("a bound").force_x_n / ellipse.limit();
        covered += usize::from(largest <= stated + reference);
        errors.push(largest);
    }
    errors.sort_by(f64::total_cmp);
    println!(
        "median {:.5}, largest {:.5}, covered {covered}",
        median(&errors),
        errors[61]
    );
    assert!(
        median(&errors) <= 0.001 && errors[61] <= 0.005,
        "{errors:?}"
    );
    assert!(covered >= 61, "{covered} of 62");
}

/// A contact that was not used for the table, with its motions and their answers: F_x, F_y, M_z, stick share, estimated error.
#[derive(Deserialize)]
struct HeldOut {
    a_over_b: f64,
    poisson_ratio: f64,
    motions: Vec<([f64; 3], [f64; 5])>,
}

#[test]
fn motions_that_were_held_out_lie_within_the_bounds() {
    let (mut errors, mut sticks, mut covered) = (Vec::new(), Vec::new(), 0);
    for contact in read::<Vec<HeldOut>>("creep_held_out.json") {
        let ellipse = table().ellipse(contact.a_over_b, contact.poisson_ratio);
        for (motion, answer) in contact.motions {
            let found = ellipse.creep(motion);
            let off = |k: usize| (found.force[k] - answer[k]).abs();
            let largest = (0..3).map(off).fold(0.0, f64::max);
            covered += usize::from(largest <= found.bound);
            errors.push(largest);
            sticks.push((found.stick - answer[3]).abs());
        }
    }
    errors.sort_by(f64::total_cmp);
    sticks.sort_by(f64::total_cmp);
    let at = |values: &[f64], part: f64| values[(part * (values.len() - 1) as f64) as usize];
    println!(
        "errors {:.5} {:.5} {:.5}, sticks {:.4} {:.4}",
        at(&errors, 0.5),
        at(&errors, 0.99),
        at(&errors, 1.0),
        at(&sticks, 0.5),
        at(&sticks, 0.99)
    );
    assert!(errors.len() >= 300);
    assert!(at(&errors, 0.5) <= 0.001 && at(&errors, 0.99) <= 0.004 && at(&errors, 1.0) <= 0.01);
    assert!(at(&sticks, 0.5) <= 0.01 && at(&sticks, 0.99) <= 0.06);
    assert!(
        covered * 100 >= errors.len() * 98,
        "{covered} of {}",
        errors.len()
    );
}

#[test]
fn random_motions_solved_now_are_met() {
    let mut failures = Vec::new();
    for (k, [ratio, nu]) in SHAPES.into_iter().enumerate().take(6) {
        let steel = Ellipse::steel(ratio, nu);
        let kalker = coefficients(ratio, nu);
        let direction = directions()[5 + 3 * k];
        let [x, y, z] = creepage([ratio, nu], direction, 0.6 + 0.5 * k as f64);
        let unit = steel.limit() / (steel.shear_modulus_mpa * steel.c().powi(2));
        let contact = steel.moving(unit * x, unit * y, unit * z / steel.c());
        let mut case = question(&contact, json!(["resultants"]));
        let by_table = solve(&case).0;
        case["solver"] = json!({ "method": "boundary_element", "target_error": 0.003 });
        let solved = solve_on_meshes(&case).0;
        let [a, b] = [&by_table, &solved].map(|s| contact.relative(&s.patches[0].points[0]));
        if !close(a, b, 0.008) {
            failures.push(format!("{ratio} {nu} {kalker:?}: {a:?} {b:?}"));
        }
    }
    assert_none("motions", &failures);
}

#[test]
fn an_answer_has_gradients_areas_and_no_mesh() {
    let contact = Ellipse::steel(1.3, 0.28).normalised(0.4, -0.3, 0.9);
    let (solution, fields) = solve(&question(&contact, json!(["resultants", "gradients"])));
    let (patch, point) = (&solution.patches[0], &solution.patches[0].points[0]);
    assert!(
        fields.patches.is_empty()
            && point.solver.mesh.is_none()
            && point.traction_max_mpa.is_none()
    );
    let areas = [point.stick_area_mm2, point.slip_area_mm2].map(|area| area.expect("an area"));
    assert!((areas[0] + areas[1] - patch.area_mm2).abs() < 1e-9 * patch.area_mm2 && areas[0] > 1.0);
    let gradients = point.gradients.as_deref().expect("gradients");
    let [x, y, z] = contact.motion;
    let forces = |motion: [f64; 3]| {
        let [x, y, z] = motion;
        let solution = solve(&question(&contact.moving(x, y, z), json!(["resultants"]))).0;
        let point = &solution.patches[0].points[0];
        assert!(point.gradients.is_none());
        [point.force_x_n, point.force_y_n, point.moment_z_n_mm]
    };
    for j in 0..3 {
        let step = 1e-3 * contact.motion[j];
        let by = |sign: f64| {
            let mut motion = [x, y, z];
            motion[j] += sign * step;
            forces(motion)
        };
        let (back, ahead) = (by(-1.0), by(1.0));
        let rows = [
            gradients.force_x_n,
            gradients.force_y_n,
            gradients.moment_z_n_mm,
        ];
        for k in 0..3 {
            let difference = (ahead[k] - back[k]) / (2.0 * step);
            let scale =
                contact.limit() * if k == 2 { contact.c() } else { 1.0 } / contact.motion[j].abs();
            assert!(
                (difference - rows[k][j]).abs() < 2e-3 * scale,
                "{k} {j}: {difference} {}",
                rows[k][j]
            );
        }
    }
    let power = x * point.force_x_n + y * point.force_y_n + z * point.moment_z_n_mm;
    assert!((point.friction_power_n - power).abs() < 1e-9 * power.abs());
}

#[test]
fn prescribed_forces_are_found_in_the_table() {
    let mut case = question(&Ellipse::steel(0.8, 0.28), json!(["resultants"]));
    case["motion"] = json!({ "force_x_n": 9000.0, "force_y_n": -5000.0, "spin_per_mm": 2e-4 });
    let point = &solve(&case).0.patches[0].points[0];
    assert!(
        (point.force_x_n - 9000.0).abs() < 3.0 && (point.force_y_n + 5000.0).abs() < 3.0,
        "{point:?}"
    );
    assert!(!point.saturated);
}

#[test]
fn what_the_table_does_not_cover_is_refused_with_the_reason() {
    let table = json!({ "method": "table" });
    let mut case = good_with("/solver", table.clone());
    case["outputs"] = json!(["resultants"]);
    let with = |pointer: &str, value: Value| {
        let mut other = case.clone();
        *other.pointer_mut(pointer).expect("a member") = value;
        other
    };
    let long = json!({ "type": "ellipse", "a_mm": 22.0, "b_mm": 2.0 });
    assert_fault(
        &with("/contact", long),
        "/contact",
        &["a/b = 11", "0.1 to 10", "boundary_element"],
    );
    let unlike = json!({
        "lower": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "upper": { "shear_modulus_mpa": 80000, "poisson_ratio": 0.29 },
    });
    assert_fault(
        &with("/material", unlike),
        "/material",
        &["K = ", "boundary_element"],
    );
    let mesh = json!({ "method": "table", "mesh": { "strips": 8, "cells": 8 } });
    assert_fault(
        &with("/solver", mesh),
        "/solver/mesh",
        &["table", "no mesh"],
    );
    assert_fault(
        &with("/outputs", json!(["zones"])),
        "/outputs/0",
        &["zones", "resultants"],
    );
}

fn gap(across: &Across, motion: [f64; 3]) -> Value {
    let y = spread(-20.0, 20.0, 161);
    let h: Vec<f64> = y.iter().map(|y| across.at(*y)).collect();
    let contact = json!({ "type": "gap_profile", "rolling_mm": 460.0, "y_mm": y, "gap_mm": h });
    let mut case = steel(contact, json!({ "normal_force_n": 80000.0 }), motion);
    case["outputs"] = json!(["resultants"]);
    case
}

fn with_contact(case: &Value, contact: Value) -> Value {
    let mut other = case.clone();
    other["contact"] = contact;
    other.as_object_mut().expect("a case").remove("load");
    other
}

#[test]
fn a_patch_that_is_nearly_an_ellipse_is_met_within_its_bound_and_two_lobes_are_refused() {
    let arcs = Across::Arcs(vec![[-100.0, 2.0, 300.0], [2.0, 100.0, 80.0]]);
    for motion in [
        [0.001, 0.0, 0.0],
        [0.0, 0.001, 3e-4],
        [0.0005, -0.0008, -4e-4],
    ] {
        let mut case = gap(&arcs, motion);
        case["solver"] = json!({ "method": "table" });
        let by_table = solve(&case).0.total[0];
        case["solver"] = json!({ "method": "boundary_element", "target_error": 0.005 });
        let solved = solve(&case).0.total[0];
        let stated = by_table.error_estimate.expect("a bound");
        let off = (by_table.force_x_n - solved.force_x_n)
            .abs()
            .max((by_table.force_y_n - solved.force_y_n).abs());
        assert!(off <= stated.force_x_n, "{motion:?}: {off} {stated:?}");
        assert!(stated.force_x_n < 0.06 * 0.3 * 80000.0, "{stated:?}");
    }
    let axis = spread(-6.0, 6.0, 61);
    let lobe = |x: f64, y: f64| (1.0 - x * x / 9.0 - y * y / 4.0).max(0.0).sqrt();
    let row = |y: &f64| -> Vec<f64> {
        let both = |x: &f64| 700.0 * (lobe(*x, y - 1.9) + lobe(*x, y + 1.9));
        axis.iter().map(both).collect()
    };
    let pressure: Vec<Vec<f64>> = axis.iter().map(row).collect();
    let contact =
        json!({ "type": "pressure_grid", "x_mm": axis, "y_mm": axis, "pressure_mpa": pressure });
    let mut case = with_contact(&gap(&arcs, [0.001, 0.0, 0.0]), contact);
    case["solver"] = json!({ "method": "table" });
    let checked = contact::check(&case, &Limits::default()).expect("a sound case");
    let error = contact::solve(&checked, &Unmonitored)
        .expect_err("two lobes")
        .to_string();
    assert!(
        error.contains("% of the load of patch 0") && error.contains("boundary_element"),
        "{error}"
    );
}

#[test]
fn a_reduced_stiffness_has_the_forces_that_auto_takes_from_the_table() {
    let reduced = json!({ "coefficient": 0.3, "reduction": 0.6 });
    let forces = |method: &str| {
        let mut case = good_with("/friction", reduced.clone());
        case["solver"] = json!({ "method": method });
        case["outputs"] = json!(["resultants"]);
        let (solution, _) = solve(&case);
        let point = solution.patches[0].points[0].clone();
        [point.force_x_n, point.force_y_n, point.moment_z_n_mm]
    };
    assert_eq!(forces("table"), forces("auto"));
}
