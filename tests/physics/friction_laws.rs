//! Tests of friction that falls with slip or varies across, and of interfacial layers: references, limits, laws and faults.

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::error::SolveError;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::solution::words::answer::{PatchSolution, PointSolution, Zone};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::cases::{assert_fault, good, good_with, with};
use crate::reference::{Converged, Ellipse, assert_none, read, solve};

/// A reference contact. `friction` has the form of a case, and forces are over the normal force.
#[derive(Debug, Deserialize)]
struct Reference {
    id: String,
    semi_axes_mm: [f64; 2],
    normal_force_n: f64,
    shear_modulus_mpa: f64,
    poisson_ratio: f64,
    friction: Value,
    speed_mm_per_s: Option<f64>,
    points: Vec<ReferencePoint>,
}

#[derive(Debug, Deserialize)]
struct ReferencePoint {
    motion: [f64; 3],
    forces: [Converged; 3],
}

impl Reference {
    fn case(&self, solver: Value) -> Value {
        let motion = |point: &ReferencePoint| {
            let [x, y, spin] = point.motion;
            let mut motion = json!({ "creepage_x": x, "creepage_y": y, "spin_per_mm": spin });
            if let Some(speed) = self.speed_mm_per_s {
                motion["speed_mm_per_s"] = json!(speed);
            }
            motion
        };
        let [a, b] = self.semi_axes_mm;
        json!({
            "material": { "shear_modulus_mpa": self.shear_modulus_mpa, "poisson_ratio": self.poisson_ratio },
            "friction": self.friction,
            "contact": { "type": "ellipse", "a_mm": a, "b_mm": b },
            "load": { "normal_force_n": self.normal_force_n },
            "motion": self.points.iter().map(motion).collect::<Vec<_>>(),
            "solver": solver,
        })
    }

    /// Returns the errors over the friction limit beyond the uncertainty of the reference, each with its estimate.
    fn errors(&self, patch: &PatchSolution) -> Vec<(f64, f64)> {
        let [a, b] = self.semi_axes_mm;
        let limit = patch.friction_limit_n.expect("known") / self.normal_force_n;
        let of = |(point, known): (&PointSolution, &ReferencePoint)| {
            let arm = (a * b).sqrt();
            let found = [point.force_x_n, point.force_y_n, point.moment_z_n_mm / arm];
            let off = |k: usize| {
                let Converged { value, unc } = known.forces[k];
                ((found[k] / self.normal_force_n - value).abs() - unc).max(0.0) / limit
            };
            let estimate = point.error_estimate.expect("a target").force_x_n;
            let errors = [0, 1, 2].map(off);
            (
                errors.into_iter().fold(0.0, f64::max),
                estimate / patch.friction_limit_n.expect("known"),
            )
        };
        patch.points.iter().zip(&self.points).map(of).collect()
    }
}

/// Compares 110 forces with CONTACT's at default settings: within 1 % of the friction limit, and within the estimate.
#[test]
fn friction_as_it_is_agrees_with_contact_within_one_percent_and_the_estimate() {
    let all: Vec<Reference> = read("friction.json");
    let (mut failures, mut covered, mut worst, mut count) = (Vec::new(), 0, 0.0_f64, 0);
    for reference in &all {
        let (solution, _) = solve(&reference.case(json!({ "target_error": 0.005 })));
        for (k, (error, estimate)) in reference
            .errors(&solution.patches[0])
            .into_iter()
            .enumerate()
        {
            count += 1;
            covered += usize::from(error <= estimate);
            worst = worst.max(error);
            if error > 0.01 {
                failures.push(format!(
                    "{} {k}: off by {error:.4}, {estimate:.4} estimated",
                    reference.id
                ));
            }
        }
        let products: u32 = solution.patches[0]
            .points
            .iter()
            .map(|p| p.solver.products)
            .sum();
        println!("{}: {products} products", reference.id);
    }
    println!("{count} points, largest error {worst:.4}, {covered} covered");
    assert_eq!(count, 110);
    assert_none("too far from CONTACT", &failures);
    assert!(100 * covered >= 95 * count, "{covered} of {count}");
}

fn steel() -> Value {
    let mut case = Ellipse::steel(1.5, 0.28)
        .normalised(0.7, -0.3, 0.5)
        .case(10, 14);
    case["motion"]["speed_mm_per_s"] = json!(20_000.0);
    case
}

fn falling(law: &str, limit: f64, drop: f64, half_speed: f64) -> Value {
    json!({ "law": law, "limit": limit, "terms": [{ "coefficient": drop, "half_speed_mm_per_s": half_speed }] })
}

fn forces(case: &Value) -> [f64; 3] {
    let point = &solve(case).0.patches[0].points[0];
    [point.force_x_n, point.force_y_n, point.moment_z_n_mm]
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1]) / 18_000.0
}

#[test]
fn every_way_to_say_a_constant_coefficient_gives_its_forces() {
    let known = forces(&steel());
    let across = json!({ "across": { "y_mm": [0.0, 1.0], "coefficient": [0.3, 0.3] } });
    assert!(distance(forces(&with(&steel(), "/friction", Some(across))), known) < 1e-12);
    let plain = json!({ "coefficient": 0.3, "reduction": 1.0 });
    assert_eq!(forces(&with(&steel(), "/friction", Some(plain))), known);
    for law in ["exponential", "rational", "linear"] {
        // Without a fall the forces agree up to the order of summation. A small fall changes them by about as much.
        for (drop, allowed) in [(0.0, 1e-5), (3e-5, 2e-4)] {
            let friction = falling(law, 0.3 - drop, drop, 1000.0);
            let off = distance(forces(&with(&steel(), "/friction", Some(friction))), known);
            assert!(off < allowed, "{law} {drop}: {off:.2e}");
        }
    }
}

#[test]
fn a_thinner_layer_comes_nearer_to_none_and_a_thick_one_takes_the_force() {
    let layered = |thickness: f64| {
        let layer = json!({ "coefficient": 0.3, "layer": { "shear_modulus_mpa": 500.0, "thickness_mm": thickness } });
        forces(&with(&steel(), "/friction", Some(layer)))
    };
    let known = forces(&steel());
    let [thin, thick] = [2e-5, 2e-4].map(|thickness| distance(layered(thickness), known));
    assert!(thin < 0.12 * thick && thin > 0.0, "{thin:.2e} {thick:.2e}");
    // In full stick, a thick layer alone is Kalker's simplified theory: T = w/L (leading edge − x).
    let [a, b, w, flexibility] = [6.0_f64, 4.0, 1e-5, 10.0 / 500.0];
    let mut case = Ellipse {
        a_mm: a,
        b_mm: b,
        ..Ellipse::steel(1.0, 0.28)
    }
    .moving(w, 0.0, 0.0)
    .case(16, 16);
    case["friction"] = json!({ "coefficient": 0.3, "layer": { "shear_modulus_mpa": 500.0, "thickness_mm": 10.0 } });
    // ∬ (√(1 − y²/b²) a − x) dA = 8 a² b/3.
    let known = w / flexibility * 8.0 * a * a * b / 3.0;
    let [found, ..] = forces(&case);
    // The bodies add 3 % to the flexibility of the layer.
    assert!((found / known - 1.0).abs() < 0.05, "{found} {known}");
}

#[test]
fn a_reduction_is_a_smaller_shear_modulus_for_tractions_alone() {
    let mut reduced = steel();
    reduced["friction"] = json!({ "coefficient": 0.3, "reduction": 0.5 });
    let mut softer = steel();
    softer["material"]["shear_modulus_mpa"] = json!(41_000.0);
    assert!(distance(forces(&reduced), forces(&softer)) < 1e-9);
    let [of_reduced, of_steel] =
        [&reduced, &steel()].map(|case| solve(case).0.patches[0].approach_mm);
    assert_eq!(of_reduced, of_steel);
}

#[test]
fn tractions_of_falling_friction_obey_the_law_of_their_own_slip() {
    let mut case = steel();
    case["friction"] = falling("exponential", 0.12, 0.18, 300.0);
    let (_, fields) = solve(&case);
    let (cells, point) = (fields.patches[0].cells(0), &fields.patches[0].points[0]);
    let take = |values: &Option<Vec<f64>>| values.clone().expect("asked for");
    let (pressure, zone) = (
        take(&cells.pressure_mpa),
        point.zone.clone().expect("asked for"),
    );
    let [tx, ty] = [take(&point.traction_x_mpa), take(&point.traction_y_mpa)];
    let utilised = |i: usize| tx[i].hypot(ty[i]) / pressure[i];
    let slipping: Vec<usize> = (0..zone.len()).filter(|i| zone[*i] == Zone::Slip).collect();
    assert!(slipping.len() > 20);
    for i in 0..zone.len() {
        assert!(
            utilised(i) <= 0.3 + 1e-9,
            "never above the coefficient at rest"
        );
    }
    let least = slipping.iter().map(|i| utilised(*i)).fold(1.0, f64::min);
    assert!(
        slipping.iter().all(|i| utilised(*i) >= 0.12) && least < 0.27,
        "{least}"
    );
}

#[test]
fn forces_of_a_mirrored_coefficient_are_mirrored() {
    let across = |mu: [f64; 3]| {
        let mut case = Ellipse::steel(1.5, 0.28)
            .normalised(0.7, 0.0, 0.0)
            .case(10, 14);
        case["friction"] = json!({ "across": { "y_mm": [-3.0, 1.0, 3.0], "coefficient": mu } });
        case
    };
    let mut mirrored = across([0.4, 0.2, 0.1]);
    mirrored["friction"]["across"]["y_mm"] = json!([-3.0, -1.0, 3.0]);
    mirrored["friction"]["across"]["coefficient"] = json!([0.1, 0.2, 0.4]);
    let ([x, y, m], [mx, my, mm]) = (forces(&across([0.4, 0.2, 0.1])), forces(&mirrored));
    assert!((x - mx).abs() < 1e-4 * x && (y + my).abs() < 1e-4 * x && (m + mm).abs() < 1e-3 * x);
    assert!(m.abs() > 0.1 * x, "more friction on one side turns");
}

/// Under a crown that is sharp on one side the load distribution is far from an ellipse's. The friction limit is still the force of full sliding,
/// and a parabolic load distribution is not.
#[test]
fn sliding_under_a_skew_crown_takes_the_friction_limit_of_a_coefficient_that_varies_across() {
    let y: Vec<f64> = (-120..=120).map(|k| 0.25 * f64::from(k)).collect();
    let radius = |y: f64| if y < 0.0 { 400.0 } else { 60.0 };
    let gap: Vec<f64> = y.iter().map(|y| 0.5 * y * y / radius(*y)).collect();
    let case = json!({
        "material": { "shear_modulus_mpa": 82_000, "poisson_ratio": 0.28 },
        "friction": { "across": { "y_mm": [-3.0, -3.0], "coefficient": [0.1, 0.5] } },
        "contact": { "type": "gap_profile", "rolling_mm": 460, "y_mm": y, "gap_mm": gap },
        "load": { "normal_force_n": 80_000 },
        "motion": { "creepage_x": 0.1 },
        "solver": { "target_error": 0.001 },
        "outputs": ["resultants"],
    });
    let (solution, _) = solve(&case);
    let patch = &solution.patches[0];
    let limit = patch.friction_limit_n.expect("known");
    let force = patch.points[0].force_x_n.abs();
    assert!((force / limit - 1.0).abs() < 2e-3, "{force} {limit}");
    let [.., low, high] = patch.extent_mm;
    let part = (-3.0 - low) / (high - low);
    let parabola = 0.5 - 0.4 * part * part * (3.0 - 2.0 * part);
    let as_ellipse = parabola * patch.normal_force_n;
    assert!(
        (force / as_ellipse - 1.0).abs() > 0.02,
        "{force} {as_ellipse}"
    );
}

/// Tests a wheel at the gauge corner and the flange of a rail that is lubricated there.
#[test]
fn every_patch_of_a_wheel_has_the_friction_of_its_place_on_the_rail() {
    let text = include_str!("../../api/examples/wheel-rail-flange.case.json");
    let mut case: Value = serde_json::from_str(text).expect("an example");
    case["solver"] = json!({ "target_error": 0.05 });
    case["outputs"] = json!(["resultants"]);
    let limits = |friction: Value| {
        let (solution, _) = solve(&with(&case, "/friction", Some(friction)));
        let of = |patch: &PatchSolution| {
            let position = patch.position.as_ref().expect("on a rail");
            let share = patch.friction_limit_n.expect("known") / patch.normal_force_n;
            (position.contact_angle_rad, position.rail_mm[0], share)
        };
        solution.patches.iter().map(of).collect::<Vec<_>>()
    };
    let by_angle = json!({ "across": { "angle_rad": [-1.5, 1.5], "coefficient": [0.35, 0.05] } });
    let by_place = json!({ "across": { "y_mm": [-40.0, 40.0], "coefficient": [0.1, 0.3] } });
    let (by_angle, by_place) = (limits(by_angle), limits(by_place));
    assert!(by_angle.len() > 1 && by_angle[0].0 != by_angle[1].0);
    for (angle, _, share) in by_angle {
        assert!(
            (share - (0.2 - 0.1 * angle)).abs() < 0.01,
            "{angle}: {share}"
        );
    }
    for (_, y, share) in by_place {
        assert!((share - (0.2 + 0.0025 * y)).abs() < 0.003, "{y}: {share}");
    }
}

#[test]
fn friction_that_falls_too_fast_for_one_answer_is_refused_with_its_number() {
    let mut case = good_with("/friction", falling("exponential", 0.1, 0.4, 20.0));
    case["motion"]["speed_mm_per_s"] = json!(60_000.0);
    assert_fault(&case, "/friction", &["falls too fast", "stability"]);
    // Patches found by the solver are checked after they are found.
    let y: Vec<f64> = (-20..=20).map(f64::from).collect();
    let gap: Vec<f64> = y.iter().map(|y| y * y / 600.0).collect();
    case["contact"] =
        json!({ "type": "gap_profile", "rolling_mm": 460.0, "y_mm": y, "gap_mm": gap });
    let checked = contact::check(&case, &Limits::default()).expect("nothing is known of the patch");
    let refused = contact::solve(&checked, &Unmonitored).expect_err("too fast");
    assert!(
        matches!(refused, SolveError::NotCovered { .. }),
        "{refused}"
    );
}

/// Tests that a layer under friction that falls with slip limits the meshes: shorter cells alternate between stick and slip.
#[test]
fn a_layer_under_falling_friction_limits_the_cells_of_a_strip() {
    let case = |layer: Value, solver: Value| {
        let mut friction = falling("exponential", 0.1, 0.2, 300.0);
        friction["layer"] = layer;
        json!({
            "material": { "shear_modulus_mpa": 82_000.0, "poisson_ratio": 0.28 },
            "friction": friction,
            "contact": { "type": "radii", "rolling_mm": 460.0, "lateral_mm": 300.0 },
            "load": { "normal_force_n": 85_000.0 },
            "motion": { "sweep": { "creepage_x": { "from": 0.003, "to": 0.012, "points": 10 }, "speed_mm_per_s": 15_000.0 } },
            "solver": solver,
            "outputs": ["resultants"],
        })
    };
    let solve = |solver: Value| {
        let thin = json!({ "shear_modulus_mpa": 1500.0, "thickness_mm": 0.02 });
        let checked = contact::check(&case(thin, solver), &Limits::default()).expect("sound");
        contact::solve(&checked, &Unmonitored).map(|found| found.0)
    };
    let forces = |target: f64| {
        let found = solve(json!({ "target_error": target })).expect("an answer");
        found.total.into_iter().map(|total| total.force_x_n)
    };
    // The friction limit is 25 500 N.
    for (usual, fine) in forces(0.005).zip(forces(0.0005)) {
        assert!(
            (usual - fine).abs() < 0.005 * 25_500.0,
            "{usual} and {fine}"
        );
    }
    let refused = solve(json!({ "mesh": { "strips": 40, "cells": 52 } }));
    let refused = refused.expect_err("the cells are too short").to_string();
    assert!(refused.contains("52 cells in a strip"), "{refused}");
    let soft = json!({ "shear_modulus_mpa": 500.0, "thickness_mm": 0.05 });
    assert_fault(
        &case(soft, json!({})),
        "/friction",
        &["falls too fast", "layer this soft"],
    );
}

#[test]
fn faults_of_friction_name_what_is_wrong() {
    let one = |friction: Value| good_with("/friction", friction);
    let law = falling("rational", 0.1, 0.2, 500.0);
    assert_fault(
        &one(law.clone()),
        "/motion/speed_mm_per_s",
        &["missing", "falls with slip"],
    );
    let pulled = json!({ "force_x_n": 100.0, "speed_mm_per_s": 1000.0 });
    let pulled = with(&one(law.clone()), "/motion", Some(pulled));
    assert_fault(&pulled, "/motion/force_x_n", &["two creepages"]);
    assert_fault(&one(json!({})), "/friction/coefficient", &["missing"]);
    assert_fault(
        &one(
            json!({ "coefficient": 0.3, "across": { "y_mm": [0, 1], "coefficient": [0.3, 0.2] } }),
        ),
        "/friction/across",
        &["exactly one"],
    );
    assert_fault(
        &one(json!({ "coefficient": 0.3, "limit": 0.1 })),
        "/friction/limit",
        &["without law"],
    );
    assert_fault(
        &one(with(&law, "/terms", Some(json!([])))),
        "/friction/terms",
        &["one or two"],
    );
    assert_fault(
        &one(with(&law, "/law", Some(json!("steep")))),
        "/friction/law",
        &["exponential"],
    );
    assert_fault(
        &one(json!({ "coefficient": 0.3, "reduction": 1.2 })),
        "/friction/reduction",
        &["at most 1"],
    );
    let across = |y: Value, mu: Value| one(json!({ "across": { "y_mm": y, "coefficient": mu } }));
    assert_fault(
        &across(json!([1.0, 0.0]), json!([0.1, 0.2])),
        "/friction/across/y_mm/1",
        &["must increase"],
    );
    assert_fault(
        &across(json!([1.0, 1.0, 1.0]), json!([0.1, 0.2, 0.3])),
        "/friction/across/y_mm/2",
        &["1 given three times"],
    );
    assert_fault(
        &across(json!([0.0, 1.0]), json!([0.1])),
        "/friction/across/coefficient",
        &["2 to 1000"],
    );
    let angles = one(json!({ "across": { "angle_rad": [0.0, 0.1], "coefficient": [0.1, 0.2] } }));
    assert_fault(&angles, "/friction/across/angle_rad", &["profiles"]);
    let layer =
        json!({ "coefficient": 0.3, "layer": { "shear_modulus_mpa": 0.0, "thickness_mm": 0.1 } });
    assert_fault(
        &one(layer),
        "/friction/layer/shear_modulus_mpa",
        &["more than 0"],
    );
    let by_fastsim = with(
        &one(json!({ "coefficient": 0.3, "reduction": 0.5 })),
        "/solver/method",
        Some(json!("fastsim")),
    );
    assert_fault(&by_fastsim, "/friction", &["boundary_element"]);
    assert!(contact::check(&good(), &Limits::default()).is_ok());
}
