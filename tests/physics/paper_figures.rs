//! Tests that the examples for the figures of Liu and Hsu's paper show the paper's results, on a patch without symmetry.

use railhead_contact::solution::words::answer::{Fields, Solution, Zone};
use serde_json::{Value, json};

use crate::reference::solve;

const BOUND: f64 = 0.3 * 120_000.0;

fn figure(number: u32, mesh: Option<[u32; 2]>) -> Value {
    let path = format!(
        "{}/api/examples/paper-figure-{number}.case.json",
        concat!(env!("CARGO_MANIFEST_DIR"), "/..")
    );
    let text = std::fs::read_to_string(path).expect("an example");
    let mut case: Value = serde_json::from_str(&text).expect("an example is JSON");
    if let Some([strips, cells]) = mesh {
        case["solver"] = json!({ "mesh": { "strips": strips, "cells": cells } });
    }
    case
}

fn stick_area(solution: &Solution, point: usize) -> f64 {
    let [patch] = &solution.patches[..] else {
        panic!("{} patches", solution.patches.len())
    };
    patch.points[point].stick_area_mm2.expect("zones") / patch.area_mm2
}

/// Returns the mean position of the stick zone, weighted with the area.
fn stick_centre(fields: &Fields, point: usize) -> [f64; 2] {
    let patch = &fields.patches[0];
    let zones = patch.points[point].zone.as_ref().expect("zones");
    let cells = patch.cells(point);
    let (mut area, mut sum) = (0.0, [0.0; 2]);
    for k in (0..zones.len()).filter(|k| zones[*k] == Zone::Stick) {
        let own = cells.dx_mm[k] * cells.dy_mm[k];
        area += own;
        sum = [sum[0] + own * cells.x_mm[k], sum[1] + own * cells.y_mm[k]];
    }
    sum.map(|sum| sum / area)
}

#[test]
fn the_patch_of_the_figures_has_no_symmetry_across() {
    let (solution, _) = solve(&figure(3, Some([16, 16])));
    let [.., low, high] = solution.patches[0].extent_mm;
    assert!(low < -1.3 * high, "{low} {high}");
}

#[test]
fn spin_eats_the_stick_zone_and_drives_it_to_the_side_where_it_opposes_the_creepage() {
    let (solution, fields) = solve(&figure(3, Some([24, 32])));
    let total = &solution.total;
    for k in 1..total.len() {
        assert!(
            stick_area(&solution, k) < stick_area(&solution, k - 1),
            "{k}"
        );
        if k < 5 {
            let [here, before] = [k, k - 1].map(|k| stick_centre(&fields, k)[1]);
            assert!(here > before, "{k}: {here} {before}");
        }
    }
    // Longitudinal creepage alone causes a moment because the origin is not in the middle of the patch.
    assert!(
        total[0].moment_z_n_mm > 0.02 * BOUND * 7.8,
        "{:?}",
        total[0]
    );
    assert!(total[5].force_x_n < 0.75 * total[0].force_x_n);
    assert!(total[5].force_y_n > 0.6 * BOUND);
}

#[test]
fn pure_spin_leaves_separate_poles_and_then_one() {
    let mut case = figure(4, Some([44, 56]));
    let motions = case["motion"].as_array().expect("motions").clone();
    case["motion"] = json!([motions[6], motions[7]]);
    let (solution, fields) = solve(&case);
    let [_, leading, ..] = solution.patches[0].extent_mm;
    let poles = |point: usize| -> Vec<f64> {
        let patch = &fields.patches[0];
        let zones = patch.points[point].zone.iter().flatten();
        let cells = patch.cells(point).x_mm.iter().zip(zones);
        cells
            .filter(|(_, zone)| **zone == Zone::Stick)
            .map(|(x, _)| x / leading)
            .collect()
    };
    let (separate, one) = (poles(0), poles(1));
    assert!(separate.iter().any(|x| *x > 0.9), "{separate:?}");
    assert!(separate.iter().any(|x| *x < -0.8), "{separate:?}");
    assert!(!separate.iter().any(|x| x.abs() < 0.7), "{separate:?}");
    assert!(one.iter().all(|x| *x < -0.6 && *x > -0.9), "{one:?}");
    for point in [0, 1] {
        assert!(stick_area(&solution, point) < 0.01);
        // A patch that is symmetric about the rolling direction would have none.
        assert!(solution.total[point].force_x_n > 0.03 * BOUND);
    }
}

#[test]
fn the_force_grows_up_to_the_friction_and_the_moment_does_not_vanish() {
    let (solution, _) = solve(&figure(5, None));
    let total = &solution.total;
    assert_eq!(total.len(), 26);
    assert!(total[0].force_x_n.abs() < 1e-9 * BOUND);
    for k in 1..total.len() {
        let rise = total[k].force_x_n - total[k - 1].force_x_n;
        assert!(rise > -1e-3 * BOUND, "{k}: {rise}");
        assert!(total[k].moment_z_n_mm > 0.005 * BOUND * 7.8, "{k}");
        assert!(total[k].force_x_n < BOUND);
    }
    assert!(total[25].force_x_n > 0.995 * BOUND, "{:?}", total[25]);
}
