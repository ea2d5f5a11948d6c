//! Tests of properties that every answer has: finite numbers, no tiny residues, time shares that add up, and remarks on implausible values.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::{Monitor, Stop, Unmonitored};
use railhead_contact::remark::entry::RemarkEntry;
use railhead_contact::solution::words::answer::Solution;
use railhead_contact::{check, solve};
use serde_json::{Value, json};

use crate::cases::{assert_fault, good, good_with, with};
use crate::gap_samples::{profile, spread};

fn answer(case: &Value) -> Solution {
    let checked = check(case, &Limits::default()).unwrap_or_else(|error| panic!("{error}"));
    solve(&checked, &Unmonitored)
        .unwrap_or_else(|error| panic!("{error}"))
        .0
}

fn example(name: &str) -> Value {
    let file = format!(
        "{}/api/examples/{name}.case.json",
        concat!(env!("CARGO_MANIFEST_DIR"), "/..")
    );
    serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap()
}

fn codes(remarks: &[RemarkEntry]) -> Vec<&str> {
    remarks.iter().map(|remark| &*remark.code).collect()
}

#[test]
fn friction_too_small_to_count_is_refused_and_the_least_is_solved() {
    for coefficient in [5e-324, 1e-300, 0.99e-12] {
        let case = good_with("/friction/coefficient", json!(coefficient));
        assert_fault(&case, "/friction/coefficient", &["0 or at least 1e-12"]);
    }
    for coefficient in [0.0, 1e-12] {
        for method in ["auto", "fastsim"] {
            let case = good_with("/friction/coefficient", json!(coefficient));
            let case = with(&case, "/solver", Some(json!({ "method": method })));
            let text = serde_json::to_string(&answer(&case)).unwrap();
            let point = &serde_json::from_str::<Value>(&text).unwrap()["patches"][0]["points"][0];
            for name in [
                "force_x_n",
                "force_y_n",
                "moment_z_n_mm",
                "friction_power_n",
            ] {
                assert!(point[name].is_number(), "{method} {coefficient} {name}");
            }
        }
    }
}

#[test]
fn implausible_contacts_say_so_whatever_describes_them() {
    let said = |case: &Value, wanted: &[&str], at_check: bool| {
        let checked = check(case, &Limits::default()).expect("a valid case");
        let solved = answer(case);
        for (k, remark) in solved.remarks.iter().enumerate() {
            assert!(!solved.remarks[..k].contains(remark), "{remark:?} twice");
        }
        for code in wanted {
            let solved = codes(&solved.remarks);
            assert!(solved.contains(code), "{code}: {solved:?}");
            let checked = codes(&checked.remarks);
            assert_eq!(checked.contains(code), at_check, "{code}: {checked:?}");
        }
    };
    let coarse = json!({ "mesh": { "strips": 6, "cells": 8 } });
    let quick = with(&good(), "/solver", Some(coarse));
    let put = |pointer: &str, value: Value| with(&quick, pointer, Some(value));
    let absurd = put("/load", json!({ "normal_force_n": 1e12 }));
    let codes = [
        "load-implausible",
        "patch-large",
        "strains-too-large",
        "pressure-implausible",
    ];
    said(
        &with(&absurd, "/contact/lateral_mm", Some(json!(4000))),
        &codes,
        true,
    );
    let ellipse = put(
        "/contact",
        json!({ "type": "ellipse", "a_mm": 1.0, "b_mm": 2.0 }),
    );
    said(
        &ellipse,
        &["pressure-implausible", "strains-too-large"],
        true,
    );
    let axis: Vec<f64> = (-10..=10).map(|k| 0.5 * f64::from(k)).collect();
    let pressure = |x: &f64, y: &f64| 8000.0 * (1.0 - (x * x + y * y) / 16.0).max(0.0).sqrt();
    let rows = axis
        .iter()
        .map(|y| axis.iter().map(|x| pressure(x, y)).collect());
    let rows: Vec<Vec<f64>> = rows.collect();
    let grid = json!({ "type": "pressure_grid", "x_mm": axis, "y_mm": axis, "pressure_mpa": rows });
    let grid = with(&put("/contact", grid), "/load", None);
    said(&grid, &["pressure-implausible"], true);
    let y = spread(-40.0, 40.0, 81);
    let gap = put("/contact", profile(460.0, &y, |y| 0.5 * y * y / 5.0));
    let gap = with(&gap, "/load", Some(json!({ "normal_force_n": 1e6 })));
    said(&gap, &["pressure-implausible"], false);
    for motion in [
        json!({ "creepage_x": 5 }),
        json!({ "creepage_x": 1e-3, "spin_per_mm": 1e6 }),
    ] {
        said(&put("/motion", motion), &["creepage-large"], true);
    }
    // Values found by the solver are checked as well: here the creepage that gives this friction force.
    let forced = with(&quick, "/friction/coefficient", Some(json!(100)));
    let forced = with(&forced, "/motion", Some(json!({ "force_x_n": 9.9e6 })));
    said(&forced, &["creepage-large"], false);
}

#[test]
fn the_examples_are_plausible() {
    let implausible = |code: &&str| {
        code.ends_with("-implausible") || code.ends_with("-large") || *code == "iteration-inexact"
    };
    for name in [
        "hertz-steel",
        "pressure-grid",
        "two-patches",
        "uic60-crown",
        "wheel-rail",
        "sweep",
    ] {
        let remarks = answer(&example(name)).remarks;
        assert!(
            !codes(&remarks).iter().any(implausible),
            "{name}: {remarks:?}"
        );
    }
}

#[test]
fn the_simplified_theory_meets_no_target_that_nobody_asked_for() {
    let case = |solver: Value| answer(&with(&good(), "/solver", Some(solver)));
    let free = case(json!({ "method": "fastsim" }));
    let point = &free.patches[0].points[0];
    assert_eq!(point.target_met, None);
    assert!(free.remarks.is_empty(), "{:?}", free.remarks);
    assert!(point.error_estimate.is_some(), "the stated error stays");
    let asked = case(json!({ "method": "fastsim", "target_error": 0.005 }));
    assert_eq!(asked.patches[0].points[0].target_met, Some(false));
    assert_eq!(codes(&asked.remarks), ["target-missed"]);
    let ratio = asked.patches[0].points[0].force_x_n / point.force_x_n;
    assert!((ratio - 1.0).abs() < 1e-9, "{ratio}");
}

/// Reads the clock and never stops the solve.
struct Clock(Instant);

impl Monitor for Clock {
    fn tick(&self, _: f64) -> ControlFlow<Stop> {
        ControlFlow::Continue(())
    }

    fn elapsed(&self) -> Duration {
        self.0.elapsed()
    }
}

#[test]
fn seconds_are_shares_that_add_up_over_patches_and_motions() {
    for name in ["two-patches", "wheel-rail", "wheel-rail-flange", "sweep"] {
        let checked = check(&example(name), &Limits::default()).unwrap();
        let clock = Clock(Instant::now());
        let solution = solve(&checked, &clock).unwrap().0;
        let took = clock.elapsed().as_secs_f64();
        let points = solution.patches.iter().flat_map(|patch| &patch.points);
        let seconds: Vec<f64> = points.map(|point| point.solver.seconds).collect();
        let sum: f64 = seconds.iter().sum();
        assert!(
            seconds.iter().all(|share| *share > 0.0),
            "{name}: {seconds:?}"
        );
        // The second clock reading is taken after the last step of the solve.
        assert!(
            sum <= took && sum > 0.8 * took - 0.02,
            "{name}: {sum} of {took}"
        );
    }
}

#[test]
fn dust_is_zero_and_the_load_is_the_one_given() {
    let case = good_with("/motion", json!({ "creepage_x": 0.001 }));
    let solution = answer(&case);
    let point = &solution.patches[0].points[0];
    assert!(point.force_x_n > 1e3);
    for zero in [
        point.force_y_n,
        point.moment_z_n_mm,
        solution.total[0].force_y_n,
    ] {
        assert_eq!(zero.to_bits(), 0.0_f64.to_bits(), "{zero:e}");
    }
    for force in [100_000.0, 33_333.3, 7.0, 1e5 / 3.0] {
        let case = with(&case, "/load", Some(json!({ "normal_force_n": force })));
        assert_eq!(answer(&case).patches[0].normal_force_n, force);
    }
    let rest = answer(&good_with("/motion", json!({ "creepage_x": 0.0 })));
    assert_eq!(rest.total[0].force_x_n.to_bits(), 0, "no −0");
}

#[test]
fn prescribed_forces_follow_the_target() {
    let limit = 0.3 * 100_000.0;
    for target in [0.05, 0.005, 0.001] {
        let mut case = good_with(
            "/motion",
            json!({ "force_x_n": 0.5 * limit, "spin_per_mm": 4e-4 }),
        );
        case["solver"] = json!({ "target_error": target });
        case["outputs"] = json!(["resultants"]);
        let solution = answer(&case);
        let missed = (solution.total[0].force_x_n - 0.5 * limit).abs() / limit;
        let remarks = &solution.remarks;
        // The factor is `SHARE_OF_TARGET` of the search.
        assert!(missed <= 0.02 * target, "{target}: {missed:e}, {remarks:?}");
        assert!(!codes(remarks).contains(&"iteration-inexact"));
    }
}

#[test]
fn vertical_load_follows_the_target() {
    for target in [0.005, 0.001] {
        let mut case = example("wheel-rail-flange");
        case["solver"] = json!({ "target_error": target });
        case["outputs"] = json!(["resultants"]);
        let Some(load) = case["load"]["vertical_force_n"].as_f64() else {
            panic!("{}", case["load"]);
        };
        let solution = answer(&case);
        let carried = -solution.total[0].force_z_n.expect("a vertical force");
        let missed = (carried / load - 1.0).abs();
        assert!(missed <= 0.1 * target, "{target}: {missed:e}");
    }
}
