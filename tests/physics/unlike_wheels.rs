//! Tests of wheels and rails of dissimilar materials: patches of profiles against the same patches given by radii, and balance.

use railhead_contact::remark::entry::RemarkEntry;
use railhead_contact::solution::words::answer::{PatchSolution, Solution};
use serde_json::{Value, json};

use crate::profile_cases::{generated, on_planes, put};
use crate::profile_laws::cone_on_arc;
use crate::reference::solve;

/// Poisson's ratios and friction coefficients of soft wheels on steel. `LOAD` is the load in N that gives patches like those of steel under 75 kN.
const SOFT: [(f64, f64); 2] = [(0.4, 0.6), (0.25, 0.3)];
const LOAD: f64 = 1450.0;

fn soft(case: &Value, (poisson_ratio, friction): (f64, f64)) -> Value {
    let mut case = case.clone();
    case["material"] = json!({
        "upper": { "shear_modulus_mpa": 800.0, "poisson_ratio": poisson_ratio },
        "lower": { "shear_modulus_mpa": 82_000.0, "poisson_ratio": 0.28 },
    });
    case["friction"] = json!({ "coefficient": friction });
    case
}

/// Returns the largest error estimate of a point over its friction limit.
fn estimate(patch: &PatchSolution, point: usize) -> f64 {
    patch.points[point]
        .error_estimate
        .expect("a target")
        .force_x_n
        / patch.friction_limit_n.expect("a limit")
}

fn apart(one: &PatchSolution, other: &PatchSolution, point: usize) -> f64 {
    let limit = one.friction_limit_n.expect("a limit");
    let [a, b] = [&one.points[point], &other.points[0]];
    (a.force_x_n - b.force_x_n).hypot(a.force_y_n - b.force_y_n) / limit
}

fn not_of_first_order(solution: &Solution) {
    let mut remarks = solution.remarks.iter();
    assert!(remarks.all(|remark| remark.code != "coupling-first-order"));
}

/// Returns the solution of a wheel's patch given by radii, with this load.
fn by_radii(wheel: &PatchSolution, case: &Value, load: Value, motion: &Value) -> Solution {
    let position = wheel.position.expect("a place");
    let rolling = position.rolling_radius_mm / position.contact_angle_rad.cos();
    let radii = json!({
        "material": case["material"],
        "friction": case["friction"],
        "contact": { "type": "radii", "rolling_mm": rolling, "lateral_mm": 300.0 },
        "load": load,
        "motion": motion,
    });
    solve(&radii).0
}

#[test]
fn a_wheel_of_another_material_is_coupled_as_its_radii_are() {
    for body in SOFT {
        for creepage in [[0.0, 0.0], [0.004, 0.0], [0.001, 0.004]] {
            let motion =
                json!({ "creepage_x": creepage[0], "creepage_y": creepage[1], "spin_per_mm": 0.0 });
            let mut case = soft(&cone_on_arc(), body);
            case["load"] = json!({ "vertical_force_n": LOAD });
            case["motion"] = motion.clone();
            let began = std::time::Instant::now();
            let (solution, _) = solve(&case);
            let seconds = began.elapsed().as_secs_f64();
            not_of_first_order(&solution);
            let patch = &solution.patches[0];
            let load = json!({ "normal_force_n": patch.normal_force_n });
            let known = by_radii(patch, &case, load, &motion);
            let known = &known.patches[0];
            let off = apart(patch, known, 0);
            let area = patch.area_mm2 / known.area_mm2 - 1.0;
            let pressure = patch.pressure_max_mpa / known.pressure_max_mpa - 1.0;
            let approach = patch.approach_mm.unwrap() / known.approach_mm.unwrap() - 1.0;
            println!(
                "{body:?} {creepage:?}: forces apart {off:.4} ({:.4} estimated), area {area:.4}, pressure {pressure:.4}, approach {approach:.5}, {seconds:.3} s",
                estimate(patch, 0)
            );
            assert!(off < estimate(patch, 0) && off < 0.005, "{off}");
            assert!(area.abs() < 0.01 && pressure.abs() < 0.015 && approach.abs() < 2e-3);
            let vertical = -solution.total[0].force_z_n.expect("a vertical force");
            assert!((vertical / LOAD - 1.0).abs() < 1e-3, "{vertical}");
        }
    }
}

#[test]
fn motions_of_a_wheel_of_another_material_are_those_of_cases_of_their_own() {
    let mut case = soft(&cone_on_arc(), SOFT[0]);
    case["load"] = json!({ "normal_force_n": LOAD });
    let motion = |x: f64| json!({ "creepage_x": x, "creepage_y": 0.001, "spin_per_mm": 0.0 });
    let motions = [-0.004, 0.0, 0.001, 0.004].map(motion);
    case["motion"] = json!(motions);
    let (list, _) = solve(&case);
    not_of_first_order(&list);
    for (k, motion) in motions.iter().enumerate() {
        case["motion"] = motion.clone();
        let alone = solve(&case).0;
        let off = apart(&list.patches[0], &alone.patches[0], k);
        println!("{motion}: {off:.5}");
        assert!(off < 2e-3 && off < estimate(&list.patches[0], k), "{off}");
        let region = list.patches[0].points[k]
            .region
            .as_deref()
            .expect("one of several");
        assert!((region.area_mm2 / alone.patches[0].area_mm2 - 1.0).abs() < 3e-3);
    }
}

/// Tests that tractions change the load at a prescribed height slightly, as they do with radii.
#[test]
fn the_load_at_a_height_is_that_by_radii() {
    for body in SOFT {
        let motion = json!({ "creepage_x": 0.003, "creepage_y": 0.0, "spin_per_mm": 0.0 });
        let mut case = soft(&cone_on_arc(), body);
        case["load"] = json!({ "approach_mm": 0.08 });
        case["motion"] = motion.clone();
        let (solution, _) = solve(&case);
        let patch = &solution.patches[0];
        let cos = patch.position.expect("a place").contact_angle_rad.cos();
        let known = by_radii(patch, &case, json!({ "approach_mm": 0.08 * cos }), &motion);
        let load = known.patches[0].normal_force_n / patch.normal_force_n - 1.0;
        let off = apart(patch, &known.patches[0], 0);
        println!(
            "{body:?}: load {load:.5}, forces apart {off:.4} ({:.4} estimated)",
            estimate(patch, 0)
        );
        assert!(
            load.abs() < 0.001 && off < estimate(patch, 0),
            "{load} {off}"
        );
    }
}

/// Tests that several patches together carry the whole load.
#[test]
fn patches_of_another_material_carry_the_load_together() {
    let mut several = 0;
    for (shift, yaw) in [(-6.45, -0.02), (-6.0, 0.0), (5.0, 0.0)] {
        let place = json!({ "lateral_shift_mm": shift, "yaw_rad": yaw });
        let mut case = soft(&put(&generated(), "contact", place), SOFT[1]);
        case["load"] = json!({ "normal_force_n": LOAD });
        case["motion"] = json!({ "creepage_x": 0.001, "creepage_y": 0.0, "spin_per_mm": 0.0 });
        let (solution, _) = solve(&case);
        not_of_first_order(&solution);
        let carried: f64 = solution
            .patches
            .iter()
            .map(|patch| patch.normal_force_n)
            .sum();
        assert!((carried / LOAD - 1.0).abs() < 1e-3, "{carried}");
        several += usize::from(solution.patches.len() > 1);
        case["material"] = json!({ "shear_modulus_mpa": 1585.0, "poisson_ratio": 0.25 });
        let like = solve(&case).0;
        assert_eq!(solution.patches.len(), like.patches.len());
        for (patch, like) in solution.patches.iter().zip(&like.patches) {
            let approach = patch.approach_mm.unwrap() / like.approach_mm.unwrap() - 1.0;
            println!(
                "shift {shift}: {:.2} N ({:.2} N of like bodies), approach {approach:.4} lower, estimate {:.4}",
                patch.normal_force_n,
                like.normal_force_n,
                estimate(patch, 0),
            );
        }
    }
    assert!(several > 0);
}

/// Tests both wheels of a wheelset of another material: the forces are those of the wheels alone, without the remark.
#[test]
fn a_wheel_that_moves_with_its_wheelset_is_coupled_too() {
    // A cone on a crown, for which the slips of a wheelset are nearly those of the creepages at one place.
    let mut case = soft(&cone_on_arc(), SOFT[0]);
    case["load"] = json!({ "normal_force_n": LOAD });
    case["motion"] =
        json!({ "wheelset": { "speed_mm_per_s": 1e4, "angular_velocity_rad_per_s": 21.7 } });
    let (solution, _) = solve(&case);
    not_of_first_order(&solution);
    // The same wheel with the creepages found for its patch.
    let motion = solution.patches[0].points[0].motion;
    case["motion"] = json!(motion);
    let (known, _) = solve(&case);
    assert_eq!(solution.patches.len(), 1);
    let off = apart(&solution.patches[0], &known.patches[0], 0);
    assert!(off < 0.005, "{off}");
}

/// Returns a lobe next to another one that is `height` mm lower.
fn two_lobes(height: f64) -> Value {
    let y: Vec<f64> = (-60..=180).map(|k| 0.1 * f64::from(k)).collect();
    let lobe = |y: f64| (y * y / 600.0).min(height + (y - 12.0).powi(2) / 600.0);
    let gap: Vec<f64> = y.iter().map(|y| lobe(*y)).collect();
    let mut case = soft(&cone_on_arc(), SOFT[1]);
    case["contact"] =
        json!({ "type": "gap_profile", "rolling_mm": 300.0, "y_mm": y, "gap_mm": gap });
    case["load"] = json!({ "normal_force_n": 500.0 });
    case["solver"] = json!({ "mesh": { "strips": 12, "cells": 12 } });
    case
}

/// An answer has one list of patches. A motion whose tractions lift off a patch that touches without them is solved to first order.
#[test]
fn a_motion_whose_tractions_take_a_patch_away_says_that_it_is_of_first_order() {
    let patches = |height: f64| {
        let mut like = two_lobes(height);
        like["material"] = json!({ "shear_modulus_mpa": 1585.0, "poisson_ratio": 0.25 });
        like["motion"] = json!({ "creepage_x": 0.001 });
        solve(&like).0.patches.len()
    };
    let (mut low, mut high) = (0.001, 0.1);
    assert_eq!([patches(low), patches(high)], [2, 1]);
    for _ in 0..8 {
        let middle = 0.5 * (low + high);
        match patches(middle) {
            1 => high = middle,
            _ => low = middle,
        }
    }
    let mut told = 0;
    for part in [0.98, 0.99, 0.995] {
        let mut case = two_lobes(part * low);
        let motion = |x: f64| json!({ "creepage_x": x, "creepage_y": 0.0, "spin_per_mm": 0.0 });
        case["motion"] = json!([motion(0.0), motion(0.02)]);
        let (solution, _) = solve(&case);
        let said = |remark: &&RemarkEntry| remark.code == "coupling-first-order";
        let points: Vec<_> = solution
            .remarks
            .iter()
            .filter(said)
            .map(|r| r.point)
            .collect();
        println!("{part}: {} patches, {points:?}", solution.patches.len());
        assert!(points.iter().all(Option::is_some));
        told += points.len();
        for patch in &solution.patches {
            assert_eq!(patch.points.len(), 2);
        }
    }
    assert!(told > 0);
}

/// Tests that tractions do not change pressures on planes, which are for comparison.
#[test]
fn on_planes_a_wheel_of_another_material_is_of_first_order() {
    let mut case = soft(&cone_on_arc(), SOFT[1]);
    case["load"] = json!({ "normal_force_n": LOAD });
    case["motion"] = json!({ "creepage_x": 0.001, "creepage_y": 0.0, "spin_per_mm": 0.0 });
    let [plane, curve] = [on_planes(&case), case].map(|case| solve(&case).0);
    let mut remarks = plane.remarks.iter();
    assert!(remarks.any(|remark| remark.code == "coupling-first-order"));
    let off = apart(&plane.patches[0], &curve.patches[0], 0);
    assert!(off < estimate(&plane.patches[0], 0), "{off}");
}
