//! Tests that the motions of a sweep share work, and that each has the result of a separate solve.

use std::sync::Arc;

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::error::SolveError;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::remark::entry::RemarkEntry;
use railhead_contact::rolling::operator_store::OperatorStore;
use railhead_contact::slices::{joined, slices};
use railhead_contact::solution::words::answer::{Fields, Solution};
use railhead_contact::{check, solve_slice};
use serde_json::{Value, json};

use crate::reference::{force_of_cells, solve};

fn case(motion: &Value, target: f64) -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 100_000 },
        "motion": motion,
        "solver": { "method": "boundary_element", "target_error": target },
        "outputs": ["resultants"],
    })
}

/// Returns paths of 25 motions along a line, in three directions.
fn lines() -> [Vec<Value>; 3] {
    let line = |at: fn(f64) -> Value| (0..25).map(|k| at(f64::from(k) / 24.0)).collect();
    [
        line(|s| json!({ "creepage_x": 0.004 * s })),
        line(|s| json!({ "spin_per_mm": 0.0015 * s })),
        line(
            |s| json!({ "creepage_x": 0.006 * s - 0.003, "creepage_y": 0.001, "spin_per_mm": 0.0003 }),
        ),
    ]
}

/// Estimates must cover the error of 95 in 100 motions.
#[test]
fn motions_of_a_sweep_are_within_their_estimates_of_finer_solves_alone() {
    let (mut tried, mut beyond) = (0, Vec::new());
    for motions in lines() {
        let (sweep, _) = solve(&case(&json!(motions), 0.01));
        for (k, motion) in motions.iter().enumerate().step_by(3) {
            let (alone, _) = solve(&case(motion, 0.001));
            let (here, there) = (&sweep.total[k], &alone.total[0]);
            let estimate = here.error_estimate.expect("an estimate").force_x_n;
            let truth = there.error_estimate.expect("an estimate").force_x_n;
            assert!(estimate <= 0.01 * 30_000.0, "{motion}: {estimate}");
            let off = [
                here.force_x_n - there.force_x_n,
                here.force_y_n - there.force_y_n,
            ];
            let off = off[0].abs().max(off[1].abs());
            assert!(
                off <= 1.5 * estimate + truth,
                "{motion}: {off}, estimate {estimate}"
            );
            tried += 1;
            if off > estimate + truth {
                beyond.push(format!("{motion}: {off}, estimate {estimate}"));
            }
        }
    }
    assert!(20 * beyond.len() <= tried, "{beyond:?} of {tried}");
}

#[test]
fn a_sweep_takes_fewer_products_than_its_motions_alone() {
    for motions in lines() {
        let products = |question: &Value| -> u32 {
            let (solution, _) = solve(question);
            let points = &solution.patches[0].points;
            points.iter().map(|point| point.solver.products).sum()
        };
        let together = products(&case(&json!(motions), 0.005));
        let alone: u32 = motions
            .iter()
            .map(|motion| products(&case(motion, 0.005)))
            .sum();
        assert!(
            4 * together < 3 * alone,
            "{together} together, {alone} alone"
        );
    }
}

#[test]
fn the_order_of_motions_does_not_change_their_answers_beyond_the_estimate() {
    let mut motions: Vec<Value> = lines().concat();
    let (forward, _) = solve(&case(&json!(motions), 0.01));
    motions.reverse();
    let (backward, _) = solve(&case(&json!(motions), 0.01));
    for (there, back) in forward.total.iter().zip(backward.total.iter().rev()) {
        let estimates = [there, back].map(|t| t.error_estimate.expect("an estimate").force_x_n);
        let allowed = estimates[0] + estimates[1];
        assert!((there.force_x_n - back.force_x_n).abs() <= allowed);
        assert!((there.force_y_n - back.force_y_n).abs() <= allowed);
    }
}

/// Returns the bits of forces, moments, estimates, verdicts and meshes of an answer. Slips may need additional products.
fn verdicts(question: &Value, outputs: &Value) -> Vec<String> {
    let mut question = question.clone();
    question["outputs"] = outputs.clone();
    let (solution, fields) = solve(&question);
    let only_resultants = *outputs == json!(["resultants"]);
    assert_eq!(fields.patches.is_empty(), only_resultants);
    let totals = solution.total.iter().map(|total| format!("{total:?}"));
    let points = solution.patches.iter().flat_map(|patch| &patch.points);
    let points = points.map(|point| {
        let forces = [point.force_x_n, point.force_y_n, point.moment_z_n_mm];
        let solver = &point.solver;
        format!(
            "{forces:?} {:?} {:?} {:?} {:?}",
            point.error_estimate, point.target_met, point.motion, solver.mesh
        )
    });
    totals.chain(points).collect()
}

#[test]
fn forces_never_depend_on_outputs() {
    let spin: Vec<Value> = (0..7)
        .map(|k| json!({ "creepage_x": 0.001 * f64::from(k), "spin_per_mm": 0.003 }))
        .collect();
    let spinning = case(&json!(spin), 0.005);
    let mut ellipse = case(
        &json!([{ "creepage_x": 0.001 }, { "creepage_y": 0.002, "spin_per_mm": 0.001 }]),
        0.01,
    );
    ellipse["contact"] = json!({ "type": "ellipse", "a_mm": 6, "b_mm": 3 });
    let mut force = ellipse.clone();
    force["motion"] = json!([{ "force_x_n": 9000 }, { "force_y_n": 9000, "spin_per_mm": 0.001 }]);
    let mut gap = ellipse.clone();
    let y: Vec<f64> = (-24..=24).map(|k| 0.5 * f64::from(k)).collect();
    let heights: Vec<f64> = y.iter().map(|y| y * y / 600.0 + 0.001 * y.abs()).collect();
    gap["contact"] =
        json!({ "type": "gap_profile", "rolling_mm": 460, "y_mm": y, "gap_mm": heights });
    let mut paper = ellipse.clone();
    paper["solver"]["method"] = json!("liu_hsu");
    let mut simplified = ellipse.clone();
    simplified["solver"] = json!({ "method": "fastsim" });
    let mut meshed = ellipse.clone();
    meshed["solver"] = json!({ "mesh": { "strips": 10, "cells": 14 } });
    for question in [spinning, ellipse, force, gap, paper, simplified, meshed] {
        let resultants = verdicts(&question, &json!(["resultants"]));
        for outputs in [
            json!(["resultants", "zones"]),
            json!(["resultants", "tractions"]),
            json!(["pressure", "slip"]),
            json!(["resultants", "zones", "tractions", "pressure", "slip"]),
        ] {
            assert_eq!(
                verdicts(&question, &outputs),
                resultants,
                "{outputs} of {question}"
            );
        }
    }
}

#[test]
fn the_default_outputs_of_a_sweep_with_spin_meet_their_target() {
    let motions: Vec<Value> = (0..7)
        .map(|k| json!({ "creepage_x": 0.001 * f64::from(k), "spin_per_mm": 0.003 }))
        .collect();
    let mut question = case(&json!(motions), 0.002);
    question["outputs"] = json!(["resultants", "zones", "tractions"]);
    let (solution, fields) = solve(&question);
    let patch = &fields.patches[0];
    assert!(patch.meshes.len() > 1, "motions have meshes of their own");
    for (k, point) in solution.patches[0].points.iter().enumerate() {
        assert_eq!(point.target_met, Some(true), "motion {k}");
        let [sum, _] = force_of_cells(&fields, k);
        let estimate = point.error_estimate.expect("an estimate").force_x_n;
        assert!(
            (sum - point.force_x_n).abs() <= estimate,
            "motion {k}: the cells carry {sum}, the force is {}, estimate {estimate}",
            point.force_x_n
        );
    }
}

/// Returns the answer with all times set to 0.
pub fn timeless((mut solution, fields): (Solution, Fields)) -> (Solution, Fields) {
    for point in solution.patches.iter_mut().flat_map(|p| &mut p.points) {
        point.solver.seconds = 0.0;
    }
    if let Some(normal) = &mut solution.normal {
        normal.seconds = 0.0;
    }
    (solution, fields)
}

#[test]
fn a_sweep_solved_by_slices_in_any_order_is_the_sweep_solved_at_once() {
    // Most of the sweep is in full slip, which is fast.
    let mut question = case(
        &json!({ "sweep": { "creepage_x": { "from": 0.01, "to": 0.3, "points": 450 } } }),
        0.0005,
    );
    question["outputs"] = json!(["resultants", "zones"]);
    question["friction"]["coefficient"] = json!(1.2);
    let checked = check(&question, &Limits::default()).expect("a valid case");
    let ranges = slices(&checked);
    assert!(ranges.len() > 2, "{ranges:?}");
    assert_eq!((ranges[0].start, ranges[ranges.len() - 1].end), (0, 450));
    assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start));
    assert_eq!(ranges, slices(&checked));
    // The slices are solved in reverse order, each with an empty store as in a separate process.
    let solved = ranges.iter().rev().map(|range| {
        let store = Arc::new(OperatorStore::new(0));
        solve_slice(&store, &checked, range.clone(), &Unmonitored)
    });
    let solved: Vec<Result<(Solution, Fields), SolveError>> = solved.collect();
    let joined = timeless(joined(solved.into_iter().rev()).expect("an answer"));
    let whole = timeless(contact::solve(&checked, &Unmonitored).expect("an answer"));
    assert_eq!(joined.0, whole.0);
    assert!(joined.1 == whole.1, "fields differ");
    let told = |remark: &&RemarkEntry| remark.code == "friction-unusual";
    assert_eq!(whole.0.remarks.iter().filter(told).count(), 1);
}

#[test]
fn a_short_sweep_is_one_slice() {
    let checked = check(&case(&json!(lines()[2]), 0.005), &Limits::default()).expect("a case");
    assert_eq!(slices(&checked), vec![0..25]);
}

#[test]
fn the_estimate_is_continuous_along_a_sweep() {
    for spin in [2e-4, 1.5e-3] {
        let motions: Vec<Value> = (0..41)
            .map(|k| json!({ "creepage_x": 1e-4 * f64::from(k), "spin_per_mm": spin }))
            .collect();
        let (sweep, _) = solve(&case(&json!(motions), 0.005));
        let estimates: Vec<f64> = sweep
            .total
            .iter()
            .map(|total| total.error_estimate.expect("an estimate").force_x_n)
            .collect();
        let mut changes: Vec<f64> = estimates
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).abs() / (0.005 * 30_000.0))
            .collect();
        changes.sort_by(f64::total_cmp);
        // The limit holds for nine of ten steps. A change of the mesh between two steps may be visible.
        let most = changes[9 * (changes.len() - 1) / 10];
        assert!(most < 0.3, "spin {spin}: {changes:?}");
    }
}
