//! Tests of a target relative to the tangential force: every kind of motion meets it, or the answer says that it is missed. With a target relative
//! to the friction limit, the answer remarks on small forces.

use railhead_contact::evaluate::answer::RowStatus;
use railhead_contact::solution::words::answer::Solution;
use serde_json::{Value, json};

use crate::cases::{assert_fault, good, good_with, problem, with};
use crate::many_rows::{case as rows_case, numbers, solved};
use crate::profile_cases::{generated, put};
use crate::reference::solve;

/// Returns the case with a target relative to the force, and with the same target relative to the friction limit.
fn both(case: &Value, target: f64) -> [Value; 2] {
    ["force", "friction_limit"].map(|of| {
        let mut case = case.clone();
        case["solver"] = json!({ "target_error": target, "relative_to": of });
        case["outputs"] = json!(["resultants", "zones", "tractions"]);
        case
    })
}

fn force(solution: &Solution, point: usize) -> f64 {
    let sum = |of: fn(&railhead_contact::solution::words::answer::PointSolution) -> f64| {
        let patches = solution.patches.iter();
        patches.map(|patch| of(&patch.points[point])).sum::<f64>()
    };
    sum(|p| p.force_x_n).hypot(sum(|p| p.force_y_n))
}

/// Requires that every point has an error of at most the target of its own force, and agrees with the answer relative to the friction limit.
fn assert_met(case: &Value, target: f64) {
    let [small, usual] = both(case, target).map(|case| solve(&case).0);
    for patch in 0..small.patches.len() {
        for (k, point) in small.patches[patch].points.iter().enumerate() {
            let error = point.error_estimate.expect("an estimate").force_x_n;
            let own = point.force_x_n.hypot(point.force_y_n);
            assert!(error <= target * own, "{k}: {error} of {own}");
            assert_eq!(point.target_met, Some(true));
            let other = &usual.patches[patch].points[k];
            let apart =
                (point.force_x_n - other.force_x_n).hypot(point.force_y_n - other.force_y_n);
            let allowed = error + other.error_estimate.expect("an estimate").force_x_n;
            assert!(apart <= 1.5 * allowed, "{k}: {apart} > {allowed}");
        }
    }
    let missed = |solution: &Solution| solution.remarks.iter().any(|r| r.code == "target-missed");
    assert!(!missed(&small));
}

#[test]
fn motions_with_small_forces_meet_a_target_relative_to_the_force() {
    let single = good_with("/motion", json!({ "creepage_x": 2e-5, "creepage_y": 1e-5 }));
    assert_met(&single, 0.02);
    let spinning = good_with(
        "/motion",
        json!({ "creepage_x": 5e-5, "spin_per_mm": 2e-5 }),
    );
    assert_met(&spinning, 0.02);
    let sweep = json!({ "sweep": { "creepage_x": { "from": 2e-5, "to": 3e-3, "points": 5 } } });
    assert_met(&good_with("/motion", sweep), 0.01);
    let prescribed = good_with("/motion", json!({ "force_x_n": 300, "creepage_y": 0 }));
    assert_met(&prescribed, 0.01);
    let gap = with(
        &good(),
        "/contact",
        Some(json!({
            "type": "gap_profile", "rolling_mm": 460,
            "y_mm": (-60..=60).map(|k| 0.25 * f64::from(k)).collect::<Vec<_>>(),
            "gap_mm": (-60..=60).map(|k| (0.25 * f64::from(k)).powi(2) / 600.0).collect::<Vec<_>>(),
        })),
    );
    assert_met(
        &put(
            &gap,
            "motion",
            json!({ "creepage_x": 3e-4, "spin_per_mm": 0 }),
        ),
        0.02,
    );
    // On the curve of the rail, mesh refinement does not reduce one part of the estimate.
    let on_planes = json!({ "reference_surface": "plane" });
    let wheel = put(&generated(), "motion", json!({ "creepage_x": 4e-4 }));
    assert_met(&put(&wheel, "contact", on_planes), 0.02);
}

/// Tests that the fields of a motion that was solved again belong to its own mesh: their sum is its force.
#[test]
fn tractions_of_a_sweep_belong_to_their_motion() {
    let sweep = json!({ "sweep": { "creepage_x": { "from": 2e-5, "to": 2e-3, "points": 3 } } });
    let [case, _] = both(&good_with("/motion", sweep), 0.01);
    let (solution, fields) = solve(&case);
    let patch = &fields.patches[0];
    for (k, point) in solution.patches[0].points.iter().enumerate() {
        let cells = patch.cells(k);
        let tractions = patch.points[k].traction_x_mpa.as_ref().expect("tractions");
        assert_eq!(cells.dx_mm.len(), tractions.len());
        let areas = cells.dx_mm.iter().zip(&cells.dy_mm).map(|(dx, dy)| dx * dy);
        let sum: f64 = areas
            .zip(tractions)
            .map(|(area, traction)| area * traction)
            .sum();
        assert!(
            (sum / point.force_x_n - 1.0).abs() < 0.05,
            "{k}: {sum} {}",
            point.force_x_n
        );
    }
}

/// Tests motions without a force, which cannot meet a relative target: the search ends at once or at the smallest target, and the answer says which.
#[test]
fn a_motion_without_a_force_ends() {
    let still = good_with("/motion", json!({ "creepage_x": 0, "creepage_y": 0 }));
    let tiny = good_with(
        "/motion",
        json!({ "creepage_x": 1e-12, "spin_per_mm": 3e-4 }),
    );
    for case in [still, tiny] {
        let [case, _] = both(&case, 0.001);
        let (solution, _) = solve(&case);
        let point = &solution.patches[0].points[0];
        let missed = solution
            .remarks
            .iter()
            .any(|remark| remark.code == "target-missed");
        assert_eq!(point.target_met, Some(!missed));
    }
}

#[test]
fn an_error_that_is_large_beside_the_force_is_told() {
    let small = good_with("/motion", json!({ "creepage_x": 5e-6 }));
    let (solution, _) = solve(&with(&small, "/solver/target_error", Some(json!(0.02))));
    let point = &solution.patches[0].points[0];
    let relative = point.error_estimate.expect("an estimate").force_x_n / force(&solution, 0);
    let remark = solution
        .remarks
        .iter()
        .find(|r| r.code == "error-large-for-force");
    assert_eq!(remark.is_some(), relative > 0.1, "{relative}");
    assert!(relative > 0.1, "{relative}");
    let (usual, _) = solve(&good());
    assert!(
        usual
            .remarks
            .iter()
            .all(|r| r.code != "error-large-for-force")
    );
}

#[test]
fn rows_by_the_table_count_their_bound_against_the_force() {
    let mut case = rows_case("auto");
    case["motion"] = json!({ "creepage_x": 0, "creepage_y": 0 });
    case["solver"] = json!({ "method": "auto", "target_error": 0.02, "relative_to": "force" });
    let columns = [numbers("/motion/creepage_x", &[2e-5, 1e-4, 2e-3])];
    let found = solved(&case, &columns);
    for (row, status) in found.status.iter().enumerate() {
        assert_eq!(*status, RowStatus::Ok, "{row}");
        let of = |name: &str| found.column(name)[row];
        assert!(
            of("error_estimate") <= 0.02 * of("force_x_n").abs(),
            "{row}"
        );
    }
}

#[test]
fn the_word_is_checked_and_part_of_the_digest() {
    let solver = |members: Value| good_with("/solver", members);
    let digest = |case: &Value| problem(case).label.digest;
    let default = solver(json!({ "target_error": 0.01 }));
    let limit = solver(json!({ "target_error": 0.01, "relative_to": "friction_limit" }));
    let force = solver(json!({ "target_error": 0.01, "relative_to": "force" }));
    assert_eq!(digest(&default), digest(&limit));
    assert_ne!(digest(&default), digest(&force));
    let mesh = json!({ "strips": 10, "cells": 10 });
    assert_fault(
        &solver(json!({ "mesh": mesh, "relative_to": "force" })),
        "/solver/relative_to",
        &["without a target"],
    );
    assert_fault(
        &solver(json!({ "relative_to": "normal_force" })),
        "/solver/relative_to",
        &["friction_limit, force"],
    );
    let history = json!({ "history": { "distance_mm": [0, 1, 2], "creepage_x": 0.001 } });
    assert_fault(
        &with(&force, "/motion", Some(history)),
        "/solver/relative_to",
        &["history"],
    );
}
