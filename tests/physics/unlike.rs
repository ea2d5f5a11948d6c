//! Tests of dissimilar bodies: references, laws and faults.

use std::sync::Arc;

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::normal::hertz::{Ellipse, NormalLoad};
use railhead_contact::rolling::operator_store::OperatorStore;
use railhead_contact::slices::{joined, slices};
use railhead_contact::solution::words::answer::Solution;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::cases::assert_fault;
use crate::reference::{Converged, assert_none, read, solve, solve_on_meshes};
use crate::sweeps::timeless;

/// A reference contact. Forces are over the friction limit, the moment over the friction limit times `arm_mm`.
#[derive(Debug, Deserialize)]
struct Reference {
    id: String,
    material: Value,
    difference: f64,
    radii_mm: [f64; 2],
    normal_force_n: f64,
    friction: f64,
    motion: [f64; 3],
    forces: [Converged; 3],
    arm_mm: f64,
    approach_mm: Converged,
    area_mm2: Converged,
    pressure_max_mpa: Converged,
}

impl Reference {
    fn case(&self, motion: Value) -> Value {
        json!({
            "material": self.material,
            "friction": { "coefficient": self.friction },
            "contact": { "type": "radii", "rolling_mm": self.radii_mm[0], "lateral_mm": self.radii_mm[1] },
            "load": { "normal_force_n": self.normal_force_n },
            "motion": motion,
        })
    }

    fn one(&self) -> Value {
        let [x, y, spin] = self.motion;
        json!({ "creepage_x": x, "creepage_y": y, "spin_per_mm": spin })
    }

    /// Returns the largest error of the resultants beyond the uncertainty of the reference.
    fn error(&self, solution: &Solution) -> f64 {
        let point = &solution.patches[0].points[0];
        let limit = self.friction * self.normal_force_n;
        let found = [
            point.force_x_n,
            point.force_y_n,
            point.moment_z_n_mm / self.arm_mm,
        ];
        let off = |k: usize| {
            ((found[k] / limit - self.forces[k].value).abs() - self.forces[k].unc).max(0.0)
        };
        [0, 1, 2].map(off).into_iter().fold(0.0, f64::max)
    }
}

#[test]
fn a_wheel_that_pulls_nothing_is_found_without_a_warning() {
    let mut failures = Vec::new();
    for reference in read::<Vec<Reference>>("unlike.json") {
        let (solution, _) = solve(&reference.case(json!({ "force_x_n": 0 })));
        let inexact = solution
            .remarks
            .iter()
            .find(|r| r.code == "iteration-inexact");
        failures.extend(inexact.map(|remark| format!("{}: {}", reference.id, remark.detail)));
    }
    assert_none("forces not found", &failures);
}

#[test]
fn unlike_bodies_agree_with_contact_within_one_percent_and_the_estimate() {
    let all: Vec<Reference> = read("unlike.json");
    let (mut failures, mut covered) = (Vec::new(), 0);
    // The mirrored case of another one has its own test.
    for reference in all
        .iter()
        .filter(|reference| !reference.id.ends_with("mxi"))
    {
        let began = std::time::Instant::now();
        let (solution, _) = solve(&reference.case(reference.one()));
        let seconds = began.elapsed().as_secs_f64();
        let patch = &solution.patches[0];
        let estimate = patch.points[0].error_estimate.expect("a target").force_x_n
            / (reference.friction * reference.normal_force_n);
        let error = reference.error(&solution);
        covered += usize::from(error <= estimate);
        let relative = |found: f64, known: Converged| {
            ((found - known.value).abs() - known.unc).max(0.0) / known.value
        };
        let approach = relative(patch.approach_mm.expect("found"), reference.approach_mm);
        let area = relative(patch.area_mm2, reference.area_mm2);
        let pressure = relative(patch.pressure_max_mpa, reference.pressure_max_mpa);
        println!(
            "{}: K {:.3}, forces off by {error:.4} ({estimate:.4} estimated), approach {approach:.5}, area {area:.4}, pressure {pressure:.4}, {seconds:.3} s {:?}",
            reference.id,
            reference.difference,
            solution
                .remarks
                .iter()
                .map(|r| r.code.clone())
                .collect::<Vec<_>>()
        );
        if error > 0.01 || approach > 0.005 || area > 0.01 || pressure > 0.025 {
            failures.push(reference.id.clone());
        }
    }
    assert_none("too far from CONTACT", &failures);
    assert_eq!(covered, all.len() - 1, "estimates that hold");
}

fn soft_on_rigid(id: &str) -> Reference {
    let all: Vec<Reference> = read("unlike.json");
    all.into_iter()
        .find(|reference| reference.id == id)
        .expect("a reference")
}

#[test]
fn bodies_that_hardly_differ_give_the_forces_of_like_bodies() {
    let mut reference = soft_on_rigid("dis_poly_steel_ab1_mu0.6_mix");
    let forces = |reference: &Reference| {
        let (solution, _) = solve_on_meshes(&reference.case(reference.one()));
        let point = &solution.patches[0].points[0];
        [point.force_x_n, point.force_y_n, point.moment_z_n_mm]
    };
    let body = |nu: f64| json!({ "shear_modulus_mpa": 800.0, "poisson_ratio": nu });
    reference.material = body(0.4);
    let like = forces(&reference);
    let differences = [1e-3, 1e-5].map(|by| {
        reference.material = json!({ "upper": body(0.4 - by), "lower": body(0.4 + by) });
        let found = forces(&reference);
        (found[0] - like[0]).hypot(found[1] - like[1])
            / (reference.friction * reference.normal_force_n)
    });
    assert!(
        differences[0] < 2e-3 && differences[1] < 2e-5 && differences[1] > 0.0,
        "{differences:?}"
    );
}

/// Tests that reversing the track changes only the sign of x, and that exchanging the bodies changes the sign of K.
#[test]
fn bodies_exchanged_and_rolled_backwards_give_the_mirrored_forces() {
    let reference = soft_on_rigid("dis_soft_rigid_ab1_mu0.3_mxi");
    let exchanged = soft_on_rigid("dis_rigid_soft_ab1_mu0.3_xi");
    let [a, b] = [&reference, &exchanged]
        .map(|reference| solve(&reference.case(reference.one())).0.patches[0].points[0].force_x_n);
    assert!((a + b).abs() < 2e-3 * a.abs(), "{a} {b}");
}

fn codes(solution: &Solution) -> Vec<&str> {
    let remarks = solution.remarks.iter();
    remarks.map(|remark| remark.code.as_str()).collect()
}

/// Tests that a motion far from its neighbours is as close to CONTACT as a separate solve.
#[test]
fn a_motion_among_others_agrees_with_contact() {
    let all: Vec<Reference> = read("unlike.json");
    let mut failures = Vec::new();
    for reference in &all {
        let far =
            json!({ "creepage_x": -reference.motion[0], "creepage_y": 0.004, "spin_per_mm": 0.0 });
        let motions = json!([far, reference.one(), far]);
        let began = std::time::Instant::now();
        let (solution, _) = solve(&reference.case(motions));
        let seconds = began.elapsed().as_secs_f64();
        let patch = &solution.patches[0];
        let point = &patch.points[1];
        let limit = reference.friction * reference.normal_force_n;
        let estimate = point.error_estimate.expect("a target").force_x_n / limit;
        let region = point.region.as_deref().expect("one of several");
        let error = reference.error(&only(&solution, 1));
        let off = |found: f64, known: Converged| {
            ((found - known.value).abs() - known.unc).max(0.0) / known.value
        };
        let area = off(region.area_mm2, reference.area_mm2);
        let pressure = off(region.pressure_max_mpa, reference.pressure_max_mpa);
        println!(
            "{}: forces off by {error:.4} ({estimate:.4} estimated), area {area:.4}, pressure {pressure:.4}, {seconds:.3} s",
            reference.id
        );
        let said = codes(&solution).contains(&"coupling-first-order");
        if said || error > estimate.min(0.01) || area > 0.01 || pressure > 0.025 {
            failures.push(reference.id.clone());
        }
        let first = patch.points[0].region.as_deref().expect("one of several");
        assert_eq!(
            patch.area_mm2, first.area_mm2,
            "the patch is that of the first motion"
        );
    }
    assert_none("too far from CONTACT among others", &failures);
}

/// Returns the answer to one of the motions, as if it were the only one.
fn only(solution: &Solution, motion: usize) -> Solution {
    let mut one = solution.clone();
    for patch in &mut one.patches {
        patch.points = vec![patch.points[motion].clone()];
    }
    one
}

/// Compares motions of a list with the same motions in separate cases: creep curves, prescribed forces, explicit meshes.
#[test]
fn motions_of_a_list_are_those_of_cases_of_their_own() {
    let reference = soft_on_rigid("dis_soft_rigid_ab1_mu0.3_eta");
    let limit = reference.friction * reference.normal_force_n;
    let curve = |k: u32| json!({ "creepage_x": 0.002 * f64::from(k), "creepage_y": 0.001, "spin_per_mm": 0.0 });
    let pull =
        |part: f64| json!({ "force_x_n": part * limit, "creepage_y": 0.0, "spin_per_mm": 0.0 });
    let target = json!({ "target_error": 0.005 });
    let mesh = json!({ "mesh": { "strips": 16, "cells": 16 } });
    let runs = [
        ((0..8).map(curve).collect::<Vec<Value>>(), &target),
        ([-0.5, 0.0, 0.5].map(pull).to_vec(), &target),
        ((0..4).map(curve).collect(), &mesh),
    ];
    for (motions, solver) in runs {
        let mut case = reference.case(json!(motions));
        case["solver"] = solver.clone();
        let began = std::time::Instant::now();
        let (list, _) = solve(&case);
        let together = began.elapsed().as_secs_f64();
        let mut apart = 0.0_f64;
        for (k, motion) in motions.iter().enumerate() {
            case["motion"] = motion.clone();
            let alone = solve(&case).0;
            let [found, known] = [&list.patches[0].points[k], &alone.patches[0].points[0]];
            apart = apart.max(
                (found.force_x_n - known.force_x_n).hypot(found.force_y_n - known.force_y_n)
                    / limit,
            );
            let region = found.region.as_deref().expect("one of several");
            let pressure = region.pressure_max_mpa / alone.patches[0].pressure_max_mpa - 1.0;
            // The cells of the tractions affect the displacement due to coupling. Its effect on the largest pressure depends on the grid.
            assert!(pressure.abs() < 0.006, "{motion}: {pressure}");
            let area = region.area_mm2 / alone.patches[0].area_mm2 - 1.0;
            assert!(area.abs() < 0.003, "{motion}: {area}");
            if let Some(estimate) = found.error_estimate {
                assert!(apart * limit < estimate.force_x_n, "{motion}: {apart}");
            }
        }
        let all = began.elapsed().as_secs_f64();
        case["motion"] = json!(motions);
        let checked = contact::check(&case, &Limits::default()).expect("a good case");
        println!(
            "{} motions off by {apart:.5}, {together:.3} s together ({:.3} estimated), {:.3} s alone",
            motions.len(),
            checked.cost().seconds,
            all - together
        );
        assert!(apart < 2e-3, "{apart}");
    }
}

#[test]
fn a_sweep_of_unlike_bodies_solved_by_slices_in_any_order_is_the_sweep_solved_at_once() {
    let reference = soft_on_rigid("dis_steel_alu_ab1_mu0.3_free0");
    let sweep = json!({ "sweep": { "creepage_x": { "from": 0.0, "to": 0.002, "points": 30 } } });
    let mut case = reference.case(sweep);
    case["outputs"] = json!(["resultants", "pressure"]);
    let checked = contact::check(&case, &Limits::default()).expect("a good case");
    let ranges = slices(&checked);
    assert!(ranges.len() > 1, "{ranges:?}");
    let began = std::time::Instant::now();
    let whole = timeless(contact::solve(&checked, &Unmonitored).expect("an answer"));
    println!(
        "30 motions in {} slices, {:.2} s ({:.2} estimated)",
        ranges.len(),
        began.elapsed().as_secs_f64(),
        checked.cost().seconds
    );
    let parts = ranges.iter().map(|range| {
        let store = Arc::new(OperatorStore::new(0));
        contact::solve_slice(&store, &checked, range.clone(), &Unmonitored)
    });
    let joined = timeless(joined(parts).expect("an answer"));
    assert_eq!(joined.0, whole.0);
    assert!(joined.1 == whole.1, "fields differ");
}

/// Tests that friction and K change their signs with the direction of rolling, motion by motion.
#[test]
fn mirrored_motions_of_a_list_give_mirrored_forces() {
    let reference = soft_on_rigid("dis_soft_rigid_ab1_mu0.3_eta");
    let motion = |y: f64| json!({ "creepage_x": 0.002, "creepage_y": y, "spin_per_mm": 0.0 });
    let motions = json!([motion(0.001), motion(0.003), motion(-0.003), motion(-0.001)]);
    let (solution, _) = solve(&reference.case(motions));
    let points = &solution.patches[0].points;
    let limit = reference.friction * reference.normal_force_n;
    for [a, b] in [[0, 3], [1, 2]] {
        let along = points[a].force_x_n - points[b].force_x_n;
        let across = points[a].force_y_n + points[b].force_y_n;
        assert!(along.hypot(across) < 2e-3 * limit, "{along} {across}");
    }
}

#[test]
fn motions_of_bodies_that_hardly_differ_are_those_of_like_bodies() {
    let mut reference = soft_on_rigid("dis_poly_steel_ab1_mu0.6_mix");
    let spin = json!({ "creepage_x": 0.0, "creepage_y": 0.0, "spin_per_mm": reference.motion[2] });
    let motions = json!([reference.one(), spin]);
    let limit = reference.friction * reference.normal_force_n;
    let forces = |reference: &Reference| {
        let (solution, _) = solve_on_meshes(&reference.case(motions.clone()));
        let points = &solution.patches[0].points;
        [0, 1].map(|k| [points[k].force_x_n, points[k].force_y_n])
    };
    let body = |nu: f64| json!({ "shear_modulus_mpa": 800.0, "poisson_ratio": nu });
    reference.material = body(0.4);
    let like = forces(&reference);
    // The last difference is far below the tolerance of the solver.
    for (by, allowed) in [(2e-2, 4e-2), (3e-3, 6e-3), (1e-5, 2e-4)] {
        reference.material = json!({ "upper": body(0.4 - by), "lower": body(0.4 + by) });
        let found = forces(&reference);
        for k in [0, 1] {
            let off = (found[k][0] - like[k][0]).hypot(found[k][1] - like[k][1]) / limit;
            assert!(off < allowed, "{by}: {off}");
        }
    }
}

#[test]
fn a_pressure_that_is_given_is_kept_and_nothing_is_said_of_it() {
    let reference = soft_on_rigid("dis_soft_rigid_ab1_mu0.3_eta");
    let axis: Vec<f64> = (-20..=20).map(|k| 0.1 * f64::from(k)).collect();
    let at = |x: f64, y: f64| 30.0 * (1.0 - (x * x + y * y) / 2.25).max(0.0).sqrt();
    let rows: Vec<Vec<f64>> = axis
        .iter()
        .map(|y| axis.iter().map(|x| at(*x, *y)).collect())
        .collect();
    let mut case = reference.case(reference.one());
    case["contact"] =
        json!({ "type": "pressure_grid", "x_mm": axis, "y_mm": axis, "pressure_mpa": rows });
    case.as_object_mut().expect("a case").remove("load");
    let (solution, _) = solve(&case);
    let said = codes(&solution);
    assert!(
        said.iter().all(|code| !code.starts_with("coupling")),
        "{said:?}"
    );
    let point = &solution.patches[0].points[0];
    assert_eq!(point.target_met, Some(true));
    case["material"] = json!({ "shear_modulus_mpa": 800.0, "poisson_ratio": 0.4 });
    let like = solve(&case).0;
    assert_eq!(solution.patches[0].area_mm2, like.patches[0].area_mm2);
    assert_eq!(
        solution.patches[0].pressure_max_mpa,
        like.patches[0].pressure_max_mpa
    );
}

/// The moment against rolling supplies the difference between work and friction power: friction dissipates power although the creepages are zero.
#[test]
fn free_rolling_of_unlike_bodies_takes_power_and_its_cells_add_up_to_it() {
    let reference = soft_on_rigid("dis_soft_rigid_ab1_mu0.3_free0");
    let mut case = reference.case(reference.one());
    case["outputs"] = json!(["resultants", "tractions", "slip"]);
    let (solution, fields) = solve(&case);
    let point = &solution.patches[0].points[0];
    let cells = fields.patches[0].cells(0);
    let values = &fields.patches[0].points[0];
    let take = |values: &Option<Vec<f64>>| values.clone().expect("asked for");
    let (tx, ty) = (take(&values.traction_x_mpa), take(&values.traction_y_mpa));
    let (sx, sy) = (take(&values.slip_x), take(&values.slip_y));
    let of_cell = |i: usize| cells.dx_mm[i] * cells.dy_mm[i] * (tx[i] * sx[i] + ty[i] * sy[i]);
    let sum: f64 = (0..tx.len()).map(of_cell).sum();
    assert!(
        point.friction_power_n > 0.0 && (sum / point.friction_power_n - 1.0).abs() < 1e-9,
        "{sum} {}",
        point.friction_power_n
    );
    // In free rolling, the creepage gives zero force.
    let free = solve(&reference.case(json!({ "force_x_n": 0.0 }))).0;
    let point = &free.patches[0].points[0];
    assert!(point.force_x_n.abs() < 1e-3 * reference.friction * reference.normal_force_n);
    assert!(
        point.motion.creepage_x < 0.0,
        "the softer body upward rolls ahead: {:?}",
        point.motion
    );
}

#[test]
fn methods_that_do_not_couple_refuse_bodies_that_differ_much() {
    let reference = soft_on_rigid("dis_soft_rigid_ab1_mu0.3_xi");
    let mut case = reference.case(reference.one());
    assert!(contact::check(&case, &Limits::default()).is_ok());
    case["solver"] = json!({ "method": "fastsim" });
    assert_fault(&case, "/material", &["K = 0.2500", "boundary_element"]);
}

#[test]
fn an_ellipse_has_the_curvatures_of_its_radii() {
    for (rolling, lateral) in [
        (460.0, 300.0),
        (300.0, 460.0),
        (300.0, 300.0),
        (50.0, 4000.0),
    ] {
        let ellipse = Ellipse::of_radii(rolling, lateral, NormalLoad::Force(8e4), 1.1e5);
        let [a, b] = ellipse.curvatures(1.1e5);
        assert!(
            (2.0 * rolling * a - 1.0).abs() < 1e-12,
            "{rolling} {lateral}: {a}"
        );
        assert!(
            (2.0 * lateral * b - 1.0).abs() < 1e-12,
            "{rolling} {lateral}: {b}"
        );
    }
}
