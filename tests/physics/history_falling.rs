//! Tests of histories with friction that falls with slip.

use railhead_contact::solution::words::answer::{PointSolution, Solution};
use serde_json::{Value, json};

use crate::cases::{assert_fault, with};
use crate::histories::sphere;
use crate::reference::solve;

const LIMIT: f64 = 18_000.0;

/// Returns a law with coefficient 0.3 at rest. The part `falls` is halved at a speed in mm/s.
fn law(name: &str, falls: f64, half_speed: f64) -> Value {
    json!({ "law": name, "limit": 0.3 - falls, "terms": [{ "coefficient": falls, "half_speed_mm_per_s": half_speed }] })
}

/// Returns a motion over these distances in mm, at 30 m/s.
fn history(friction: Value, distances: &[f64], creepages: [f64; 3]) -> Value {
    let [x, y, spin] = creepages;
    let rolled = json!({
        "distance_mm": distances, "creepage_x": x, "creepage_y": y, "spin_per_mm": spin, "speed_mm_per_s": 30_000,
    });
    let case = sphere(0.28, json!({ "history": rolled }));
    with(&case, "/friction", Some(friction))
}

fn points(case: &Value) -> Vec<PointSolution> {
    let (solution, _): (Solution, _) = solve(case);
    solution.patches[0].points.clone()
}

/// Returns the distance between the forces of two points over the friction limit.
fn apart(a: &PointSolution, b: &PointSolution) -> f64 {
    (a.force_x_n - b.force_x_n).hypot(a.force_y_n - b.force_y_n) / LIMIT
}

fn estimate(point: &PointSolution) -> f64 {
    let estimate = point.error_estimate.unwrap();
    estimate.force_x_n.hypot(estimate.force_y_n) / LIMIT
}

/// Returns the answer of the steady solver to the motion of a history.
fn steady(case: &Value) -> PointSolution {
    let mut motion = case["motion"]["history"].clone();
    motion.as_object_mut().unwrap().remove("distance_mm");
    points(&with(case, "/motion", Some(motion)))[0].clone()
}

#[test]
fn long_rolling_ends_in_the_steady_state_and_remains_in_it() {
    for (friction, motion) in [
        (law("exponential", 0.2, 300.0), [0.004, 0.0, 0.0]),
        (law("exponential", 0.2, 300.0), [0.02, 0.01, 0.0]),
        (law("rational", 0.15, 400.0), [0.003, -0.002, 0.0006]),
        (law("linear", 0.2, 100.0), [0.0, 0.003, -0.0004]),
        (law("exponential", 0.1, 1500.0), [0.0015, 0.0, 0.0003]),
    ] {
        let case = history(friction.clone(), &[2.5, 60.0], motion);
        let known = steady(&case);
        let found = points(&case);
        let stays = points(&with(&case, "/motion/start", Some(json!("steady"))));
        for (name, point) in [
            ("end", &found[1]),
            ("begin", &stays[0]),
            ("stay", &stays[1]),
        ] {
            let (off, told) = (apart(point, &known), estimate(point) + estimate(&known));
            println!(
                "{name} {friction} {motion:?}: {off:.5} of {told:.5}, {:?}",
                [point.force_x_n / LIMIT, point.force_y_n / LIMIT]
            );
            assert!(off < told, "{name} {friction} {motion:?}: {off} of {told}");
        }
    }
}

/// Tests a creepage that grows, stays and falls, far into sliding: forces by the number of cells, and the estimates at default settings.
#[test]
fn finer_meshes_approach_one_history_within_what_is_told() {
    for friction in [law("exponential", 0.2, 120.0), law("linear", 0.15, 400.0)] {
        let rolled = |mesh: Option<[u32; 2]>| {
            let mut case = history(friction.clone(), &[0.0, 2.0, 4.0, 6.0, 8.0, 12.0], [0.0; 3]);
            case["motion"]["history"]["creepage_x"] = json!([0.0, 0.008, 0.02, 0.02, 0.002, 0.002]);
            case["motion"]["history"]["creepage_y"] = json!(0.001);
            if let Some([strips, cells]) = mesh {
                case["solver"] = json!({ "mesh": { "strips": strips, "cells": cells } });
            }
            points(&case)
        };
        let finest = rolled(Some([32, 64]));
        let off = |points: &[PointSolution]| {
            let pairs = points.iter().zip(&finest).map(|(a, b)| apart(a, b));
            pairs.fold(0.0, f64::max)
        };
        let [coarse, fine] = [[8, 16], [16, 32]].map(|mesh| off(&rolled(Some(mesh))));
        let usual = rolled(None);
        for (point, best) in usual.iter().zip(&finest) {
            let (off, told) = (apart(point, best), estimate(point) + estimate(best));
            println!(
                "{friction}: {off:.5} of {:.5} and {:.5}",
                estimate(point),
                estimate(best)
            );
            assert!(off < told, "{friction}: {off} of {told}");
        }
        println!(
            "{friction}: {coarse:.5} {fine:.5}, usual {:.5}",
            off(&usual)
        );
        assert!(coarse < 0.1 && fine < 0.4 * coarse, "{coarse} {fine}");
    }
}

#[test]
fn a_law_without_a_fall_has_the_history_of_its_coefficient() {
    let distances = [0.0, 1.0, 3.0, 5.0, 9.0];
    let motion = [0.002, -0.001, 0.0003];
    let plain = points(&history(json!({ "coefficient": 0.3 }), &distances, motion));
    let mut apart_before = f64::INFINITY;
    for falls in [1e-2, 1e-3, 0.0] {
        let found = points(&history(
            law("exponential", falls, 300.0),
            &distances,
            motion,
        ));
        let pairs = found.iter().zip(&plain).map(|(a, b)| apart(a, b));
        let off = pairs.fold(0.0, f64::max);
        println!("{falls}: {off:.2e}");
        assert!(
            off <= falls && off < apart_before.max(1e-9),
            "{falls}: {off}"
        );
        apart_before = off;
    }
    assert!(apart_before < 1e-9);
}

/// Tests that the example of `docs/rolling.md` has the forces shown there.
#[test]
fn the_example_has_the_forces_that_are_shown() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let read = |file: &str| std::fs::read_to_string(format!("{root}/{file}")).unwrap();
    let example: Value = serde_json::from_str(&read("api/examples/rolling.case.json")).unwrap();
    let rolled = json!({
        "distance_mm": [0, 2, 5, 10, 40], "creepage_x": [0, 0.004, 0.02, 0.02, 0.02], "speed_mm_per_s": 30_000,
    });
    let case = with(&example, "/motion", Some(json!({ "history": rolled })));
    let case = with(&case, "/friction", Some(law("exponential", 0.2, 300.0)));
    let forces = points(&case);
    let shown: Vec<String> = forces[1..]
        .iter()
        .map(|point| format!("{:.1}", 1e-3 * point.force_x_n))
        .collect();
    let shown = shown.join(", ");
    assert!(read("docs/rolling.md").contains(&shown), "{shown}");
}

/// All cells slide at once at the speed of the creepage, with a bound that follows within the damping distance.
#[test]
fn after_a_jump_of_the_creepage_the_force_falls_to_that_of_full_slip() {
    let case = history(
        law("exponential", 0.2, 300.0),
        &[2.0, 10.0, 40.0],
        [0.1, 0.0, 0.0],
    );
    let found = points(&case);
    let known = 0.1 + 0.2 * (-std::f64::consts::LN_2 * 3000.0 / 300.0).exp();
    // The distance given in the guide: four half-lengths times the stability number.
    let pressure = 1.5 * 60_000.0 / (std::f64::consts::PI * 25.0);
    let fall = 0.2 * std::f64::consts::LN_2 / 300.0;
    let told = 4.0 * 5.0 * 1.7 * 30_000.0 * fall * pressure / 82_000.0;
    let over = |k: usize| found[k].force_x_n.abs() / 60_000.0 - known;
    let distance = 8.0 / (over(0) / over(1)).ln();
    println!("{distance} {told}");
    assert!((distance / told - 1.0).abs() < 0.2, "{distance} {told}");
    let force = found[2].force_x_n.abs() / 60_000.0;
    assert!((force - known).abs() < 1e-3, "{force} {known}");
    let sizes: Vec<f64> = found.iter().map(|p| p.force_x_n.abs()).collect();
    assert!(sizes[0] > sizes[1] && sizes[1] >= sizes[2], "{sizes:?}");
}

#[test]
fn what_it_lacks_or_does_not_go_with_is_named() {
    let good = history(law("linear", 0.2, 200.0), &[0.0, 2.0], [0.002, 0.0, 0.0]);
    let path = |name: &str| format!("/motion/history/{name}");
    let speed = path("speed_mm_per_s");
    assert_fault(&with(&good, &speed, None), &speed, &["missing", "slip"]);
    for wrong in [json!(0), json!("fast"), json!(-3)] {
        let case = with(&good, &speed, Some(wrong.clone()));
        assert_fault(&case, &speed, &[&format!("{wrong} given")]);
    }
    let forced = with(&good, &path("creepage_x"), None);
    let forced = with(&forced, &path("force_x_n"), Some(json!(3000)));
    assert_fault(&forced, &path("force_x_n"), &["slip"]);
    let pressed = with(&good, "/motion/start", Some(json!("pressed")));
    assert_fault(&pressed, "/friction/law", &["pressed", "falls with slip"]);
    let fast = with(&good, "/friction", Some(law("linear", 0.2, 20.0)));
    assert_fault(&fast, "/friction", &["stability number"]);
}
