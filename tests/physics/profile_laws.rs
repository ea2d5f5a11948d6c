//! Tests of laws for a wheel on a rail of any shape: closed forms, balance, mirror images.

use railhead_contact::normal::hertz::{Ellipse, NormalLoad};
use railhead_contact::solution::words::answer::{PatchSolution, Position, Solution};
use serde_json::{Value, json};

use crate::profile_cases::{by_origin, generated, on_planes, put, wheel_on_rail};
use crate::reference::solve;

fn position(patch: &PatchSolution) -> Position {
    patch.position.expect("a position")
}

fn place(case: &Value, shift: f64, yaw: f64, roll: f64) -> Value {
    put(
        case,
        "contact",
        json!({ "lateral_shift_mm": shift, "yaw_rad": yaw, "roll_rad": roll }),
    )
}

fn moving(case: &Value, x: f64, y: f64, spin: f64) -> Value {
    put(
        case,
        "motion",
        json!({ "creepage_x": x, "creepage_y": y, "spin_per_mm": spin }),
    )
}

fn load(case: &Value, name: &str, value: f64) -> Value {
    let mut case = case.clone();
    case["load"] = json!({ name: value });
    case
}

/// Returns a rail of radius 300 mm under a wheel coned 1:20.
pub fn cone_on_arc() -> Value {
    let arc: Vec<[f64; 2]> = (-60..=60)
        .map(|k| 0.5 * f64::from(k))
        .map(|y| [y, 300.0 - (9e4 - y * y).sqrt()])
        .collect();
    let cone: Vec<[f64; 2]> = (-60..=60).map(f64::from).map(|y| [y, -0.05 * y]).collect();
    let stated = |points: Vec<[f64; 2]>| json!({ "points_mm": points, "mirror_y": false, "mirror_z": false });
    by_origin(wheel_on_rail(stated(arc), stated(cone), 0.0), 747.5)
}

#[test]
fn a_cone_on_an_arc_is_hertzs_contact_at_its_angle() {
    let angle = 0.05_f64.atan();
    for force in [1e3, 75e3] {
        let (solution, _) = solve(&on_planes(&load(&cone_on_arc(), "vertical_force_n", force)));
        assert_eq!(solution.patches.len(), 1);
        let patch = &solution.patches[0];
        let found = position(patch);
        assert!((found.contact_angle_rad + angle).abs() < 2e-5, "{found:?}");
        assert!(
            (found.rail_mm[0] + 300.0 * angle.sin()).abs() < 0.03,
            "{found:?}"
        );
        // Radius of curvature of a cone at right angles to its generator.
        let rolling = found.rolling_radius_mm / angle.cos();
        let normal = force / angle.cos();
        let modulus = 82_000.0 / 0.72;
        let hertz = Ellipse::of_radii(rolling, 300.0, NormalLoad::Force(normal), modulus);
        let close = |found: f64, expected: f64, allowed: f64| {
            assert!(
                (found / expected - 1.0).abs() < allowed,
                "{found} {expected}"
            );
        };
        close(patch.normal_force_n, normal, 1e-5);
        close(
            patch.approach_mm.expect("an approach"),
            hertz.approach,
            1e-3,
        );
        close(
            patch.area_mm2,
            std::f64::consts::PI * hertz.a * hertz.b,
            5e-3,
        );
        close(
            patch.pressure_max_mpa,
            1.5 * normal / (std::f64::consts::PI * hertz.a * hertz.b),
            5e-3,
        );
        let lowering = solution.wheel_lowering_mm.expect("a lowering");
        close(lowering * angle.cos(), hertz.approach, 1e-3);
    }
}

#[test]
fn each_patch_has_its_own_overlap() {
    let (solution, _) = solve(&place(&generated(), -4.9, 0.0, 0.0));
    let overlap = |k: usize| solution.patches[k].approach_mm.expect("an approach");
    let lowering = solution.wheel_lowering_mm.expect("a lowering");
    assert_eq!(solution.patches.len(), 2);
    let cosine = position(&solution.patches[0]).contact_angle_rad.cos();
    // Patch 0 touches first, and patch 1 after two hundredths of a millimetre.
    assert!((overlap(0) / (lowering * cosine) - 1.0).abs() < 0.02);
    assert!((0.5..0.9).contains(&(overlap(1) / overlap(0))));
}

#[test]
fn normal_and_tangential_forces_together_carry_the_vertical_force() {
    for (shift, y) in [(0.0, 0.0), (-2.0, 0.004), (-8.0, 0.02), (-8.0, -0.02)] {
        let case = moving(&place(&generated(), shift, 0.0, 0.0), 0.001, y, 0.0);
        let (solution, _) = solve(&case);
        let total = solution.total[0];
        let vertical = -total.force_z_n.expect("a vertical force");
        assert!(
            (vertical / 75e3 - 1.0).abs() < 1e-3,
            "shift {shift}: {vertical}"
        );
        // The test rotates the forces of every patch itself. On planes, the pressures of a patch have one direction.
        let (solution, _) = solve(&on_planes(&case));
        let total = solution.total[0];
        let vertical = -total.force_z_n.expect("a vertical force");
        let (mut across, mut up) = (0.0, 0.0);
        for patch in &solution.patches {
            let (sin, cos) = position(patch).contact_angle_rad.sin_cos();
            let (force_y, normal) = (patch.points[0].force_y_n, patch.normal_force_n);
            across += force_y * cos + normal * sin;
            up += force_y * sin - normal * cos;
        }
        assert!((across - total.force_y_n).abs() < 1e-6 * 75e3);
        assert!((up + vertical).abs() < 1e-6 * 75e3);
    }
}

#[test]
fn friction_lifts_or_presses_a_flange_by_its_direction() {
    let flange = place(&generated(), -8.0, 0.0, 0.0);
    let normal_force = |y: f64| -> f64 {
        let (solution, _) = solve(&moving(&flange, 0.0, y, 0.0));
        solution
            .patches
            .iter()
            .map(|patch| patch.normal_force_n)
            .sum()
    };
    let (up, none, down) = (normal_force(-0.02), normal_force(0.0), normal_force(0.02));
    assert!(down < 0.95 * none && up > 1.05 * none, "{down} {none} {up}");
}

#[test]
fn a_wheel_without_creepage_has_no_tractions_where_half_spaces_neglect_the_bend() {
    let half_space = json!({ "influence": "half_space" });
    let case = put(&generated(), "contact", half_space);
    let (still, _) = solve(&moving(&case, 0.0, 0.0, 0.0));
    let (creeping, _) = solve(&moving(&case, 1e-12, 0.0, 0.0));
    for (still, creeping) in still.total.iter().zip(&creeping.total) {
        let off =
            (still.force_x_n - creeping.force_x_n).hypot(still.force_y_n - creeping.force_y_n);
        assert!(off < 1e-3, "{still:?} {creeping:?}");
    }
}

#[test]
fn a_wheel_lowered_by_what_a_force_gave_carries_that_force() {
    let mut case = place(&generated(), -5.5, 0.0, 0.0);
    case["friction"] = json!({ "coefficient": 0.0 });
    let (by_force, _) = solve(&case);
    let lowering = by_force.wheel_lowering_mm.expect("a lowering");
    let (by_lowering, _) = solve(&load(&case, "approach_mm", lowering));
    let vertical = |solution: &Solution| solution.total[0].force_z_n.expect("a force");
    assert!((vertical(&by_lowering) / vertical(&by_force) - 1.0).abs() < 1e-3);
    let normal: f64 = by_force
        .patches
        .iter()
        .map(|patch| patch.normal_force_n)
        .sum();
    let (by_normal, _) = solve(&load(&case, "normal_force_n", normal));
    let again: f64 = by_normal
        .patches
        .iter()
        .map(|patch| patch.normal_force_n)
        .sum();
    assert!((again / normal - 1.0).abs() < 2e-5);
    assert!((by_normal.wheel_lowering_mm.expect("a lowering") / lowering - 1.0).abs() < 1e-3);
}

#[test]
fn left_and_right_are_mirror_images_in_every_number() {
    let right = place(&generated(), -5.5, -0.004, -2e-4);
    let left = put(
        &place(&generated(), 5.5, 0.004, 2e-4),
        "contact",
        json!({ "side": "left" }),
    );
    // With a target, rounding may decide which of two meshes is fine enough.
    let solved = |case: &Value, y: f64, spin: f64| {
        let mut case = moving(case, 0.001, y, spin);
        case["solver"] = json!({ "mesh": { "strips": 14, "cells": 19 } });
        solve(&case).0
    };
    let (right, left) = (solved(&right, 0.0005, 2e-4), solved(&left, -0.0005, -2e-4));
    assert_eq!(right.patches.len(), left.patches.len());
    let close = |a: f64, b: f64, scale: f64| assert!((a - b).abs() < 1e-3 * scale, "{a} {b}");
    for (a, b) in right.patches.iter().zip(left.patches.iter().rev()) {
        close(a.normal_force_n, b.normal_force_n, b.normal_force_n);
        // Rounding decides which heights are tried. The area is the number that depends most on them.
        close(a.area_mm2, b.area_mm2, 3.0 * b.area_mm2);
        let (here, there) = (position(a), position(b));
        close(here.contact_angle_rad, -there.contact_angle_rad, 1.0);
        close(here.track_mm[1], -there.track_mm[1], 1.0);
        close(here.rail_mm[0], there.rail_mm[0], 1.0);
        close(here.wheel_mm[1], there.wheel_mm[1], 1.0);
        let bound = 0.3 * a.normal_force_n;
        close(a.points[0].force_x_n, b.points[0].force_x_n, 2.0 * bound);
        close(a.points[0].force_y_n, -b.points[0].force_y_n, 2.0 * bound);
    }
    close(right.total[0].force_y_n, -left.total[0].force_y_n, 75e3);
    close(
        right.total[0].moment_z_n_mm,
        -left.total[0].moment_z_n_mm,
        75e3,
    );
}

#[test]
fn a_free_wheel_rolls_without_longitudinal_creepage_at_its_own_radius_only() {
    let (still, _) = solve(&on_planes(&generated()));
    let radius = position(&still.patches[0]).rolling_radius_mm;
    let mut rolling = on_planes(&generated());
    let wheelset = |free: f64| json!({ "wheelset": { "speed_mm_per_s": 20000, "free_rolling_radius_mm": free } });
    for free in [radius, radius + 1.0] {
        rolling["motion"] = wheelset(free);
        let (solution, _) = solve(&rolling);
        let point = &solution.patches[0].points[0];
        let angle = position(&solution.patches[0]).contact_angle_rad;
        let expected = 1.0 - radius / free;
        assert!(
            (point.motion.creepage_x - expected).abs() < 1e-6,
            "{:?}",
            point.motion
        );
        assert!((point.motion.spin_per_mm + angle.sin() / free).abs() < 1e-7);
        assert!(point.motion.creepage_y.abs() < 1e-9);
    }
}

#[test]
fn motions_of_a_list_on_planes_balance_the_vertical_force_as_if_they_were_alone() {
    let mut case = on_planes(&place(&generated(), -8.0, 0.0, 0.0));
    let motions = [0.0, 0.02].map(|y| json!({ "creepage_y": y }));
    case["motion"] = json!(motions);
    let (together, _) = solve(&case);
    for (k, motion) in motions.into_iter().enumerate() {
        case["motion"] = motion;
        let (alone, _) = solve(&case);
        let (found, own) = (&together.total[k], &alone.total[0]);
        assert_eq!(
            [found.force_x_n, found.force_y_n],
            [own.force_x_n, own.force_y_n],
            "{k}"
        );
        let vertical = -found.force_z_n.expect("a force");
        assert!((vertical / 75e3 - 1.0).abs() < 1e-3, "{k}: {vertical}");
    }
}
