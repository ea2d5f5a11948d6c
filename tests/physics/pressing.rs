//! Tests of dissimilar bodies pressed together with friction: Spence's contact, and rolling that begins from it.

use railhead_contact::solution::words::answer::{Fields, PointSolution, Solution};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::cases::{assert_fault, with};
use crate::reference::{Converged, assert_none, read, solve};

/// A reference solution of normal loading with friction.
#[derive(Debug, Deserialize)]
struct Reference {
    id: String,
    material: Value,
    radius_mm: f64,
    normal_force_n: f64,
    friction: f64,
    approach_mm: Converged,
    pressure_max_mpa: Converged,
    /// Radius of the stick zone over that of the contact.
    stick_radius: Converged,
    traction_max_mpa: Converged,
}

impl Reference {
    fn case(&self) -> Value {
        json!({
            "material": self.material,
            "friction": { "coefficient": self.friction },
            "contact": { "type": "radii", "rolling_mm": self.radius_mm, "lateral_mm": self.radius_mm },
            "load": { "normal_force_n": self.normal_force_n },
            "motion": { "history": { "distance_mm": 0 }, "start": "pressed" },
            "outputs": ["resultants", "zones", "tractions"],
        })
    }
}

fn references() -> Vec<Reference> {
    read("pressing.json")
}

/// Returns the radius of the stick zone over that of the contact.
fn stick_radius(point: &PointSolution) -> f64 {
    let areas = [point.stick_area_mm2, point.slip_area_mm2].map(|area| area.expect("asked for"));
    (areas[0] / (areas[0] + areas[1])).sqrt()
}

fn dissipated(solution: &Solution) -> f64 {
    let point = &solution.patches[0].points[0];
    point.history.as_ref().expect("a history").dissipated_n_mm
}

#[test]
fn bodies_pressed_together_agree_with_contact() {
    let mut failures = Vec::new();
    for reference in references() {
        let began = std::time::Instant::now();
        let (solution, _) = solve(&reference.case());
        let seconds = began.elapsed().as_secs_f64();
        let (patch, point) = (&solution.patches[0], &solution.patches[0].points[0]);
        let off = |found: f64, known: Converged| ((found - known.value).abs() - known.unc).max(0.0);
        let relative = |found: f64, known: Converged| off(found, known) / known.value;
        let approach = relative(patch.approach_mm.expect("found"), reference.approach_mm);
        let pressure = relative(patch.pressure_max_mpa, reference.pressure_max_mpa);
        let radius = off(stick_radius(point), reference.stick_radius);
        let largest = point.traction_max_mpa.expect("has fields");
        let traction = relative(largest, reference.traction_max_mpa);
        let codes: Vec<&str> = solution.remarks.iter().map(|r| r.code.as_str()).collect();
        println!(
            "{}: approach off by {approach:.5}, pressure {pressure:.4}, stick radius {:.3} ({:.3}), traction {traction:.4}, mesh {:?}, estimate {:?}, {seconds:.2} s {codes:?}",
            reference.id,
            stick_radius(point),
            reference.stick_radius.value,
            point.solver.mesh,
            point.error_estimate,
        );
        let force = point.force_x_n.hypot(point.force_y_n);
        let limit = reference.friction * reference.normal_force_n;
        if approach > 1e-3
            || pressure > 0.01
            || radius > 0.04
            || traction > 0.01
            || force > 1e-3 * limit
        {
            failures.push(reference.id.clone());
        }
    }
    assert_none("too far from CONTACT", &failures);
}

/// Returns the tractions of the answer along x and y.
fn tractions(case: &Value) -> [Vec<f64>; 2] {
    tractions_of(&solve(case).1)
}

fn tractions_of(fields: &Fields) -> [Vec<f64>; 2] {
    let values = fields.patches[0].points[0].clone();
    [values.traction_x_mpa, values.traction_y_mpa].map(|values| values.expect("asked for"))
}

fn with_mesh(case: &Value) -> Value {
    with(
        case,
        "/solver",
        Some(json!({ "mesh": { "strips": 12, "cells": 12 } })),
    )
}

/// Spence (1975) gives a stick radius of one half for ν = 0 and μ = 0.2986 on a rigid body. Whole cells stick, so that the radius is accurate to
/// half a cell.
#[test]
fn half_of_the_radius_sticks_where_spence_says_so() {
    let all = references();
    let reference = all
        .iter()
        .find(|r| r.friction == 0.2986)
        .expect("it is there");
    let (solution, _) = solve(&reference.case());
    let found = stick_radius(&solution.patches[0].points[0]);
    assert!((found - 0.5).abs() < 0.02, "{found}");
}

/// Eight times the force gives twice the size and the tractions, and 32 times the work.
#[test]
fn a_pressing_is_a_scaled_copy_of_any_smaller_one() {
    let case = with_mesh(&references()[2].case());
    let force = 8.0 * references()[2].normal_force_n;
    let more = with(&case, "/load/normal_force_n", Some(json!(force)));
    let [(small, small_fields), (large, large_fields)] = [&case, &more].map(solve);
    let [less, much] = [&small, &large].map(dissipated);
    assert!((much / less / 32.0 - 1.0).abs() < 1e-2, "{less} {much}");
    let [small, large] = [&small_fields, &large_fields].map(tractions_of);
    let largest = small[0].iter().fold(0.0_f64, |most, t| most.max(t.abs()));
    for (small, large) in small[0].iter().zip(&large[0]) {
        assert!(
            (large - 2.0 * small).abs() < 0.02 * largest,
            "{small} {large}"
        );
    }
}

#[test]
fn like_bodies_are_pressed_together_without_tractions_and_exchanged_ones_with_their_opposite() {
    let reference = &references()[0];
    let case = with_mesh(&reference.case());
    let like = with(
        &case,
        "/material",
        Some(json!({ "shear_modulus_mpa": 1.0, "poisson_ratio": 0.2 })),
    );
    assert!(tractions(&like).iter().flatten().all(|t| *t == 0.0));
    let mut exchanged = case.clone();
    exchanged["material"] =
        json!({ "upper": case["material"]["lower"], "lower": case["material"]["upper"] });
    let ([x, y], [back_x, back_y]) = (tractions(&case), tractions(&exchanged));
    let largest = x.iter().fold(0.0_f64, |most, t| most.max(t.abs()));
    for (t, back) in x.iter().zip(&back_x).chain(y.iter().zip(&back_y)) {
        assert!((t + back).abs() < 2e-3 * largest, "{t} {back}");
    }
}

/// Tests that the tractions of normal loading fade after rolling some contact lengths, and that steady rolling remains.
#[test]
fn rolling_of_unlike_bodies_ends_steady_wherever_it_begins() {
    let material = json!({ "upper": { "young_modulus_mpa": 70000, "poisson_ratio": 0.33 }, "lower": { "young_modulus_mpa": 210000, "poisson_ratio": 0.3 } });
    let case = |motion: Value| {
        json!({
            "material": material,
            "friction": { "coefficient": 0.3 },
            "contact": { "type": "ellipse", "a_mm": 5.0, "b_mm": 4.0 },
            "load": { "normal_force_n": 40000 },
            "motion": motion,
        })
    };
    let creepage = 0.0006;
    // Several motions share their patches, as the points of a history do.
    let one = json!({ "creepage_x": creepage });
    let (steady, _) = solve(&case(json!([one, one])));
    let steady = &steady.patches[0].points[1];
    let limit = 0.3 * 40000.0;
    let mut first = Vec::new();
    for start in ["rest", "pressed", "steady"] {
        let history = json!({ "history": { "distance_mm": [0.5, 40], "creepage_x": creepage }, "start": start });
        let (rolled, _) = solve(&case(history));
        let [early, late] = &rolled.patches[0].points[..] else {
            panic!("two points")
        };
        let off = (late.force_x_n - steady.force_x_n).abs() / limit;
        assert!(
            off < 0.01,
            "{start}: {} {}",
            late.force_x_n,
            steady.force_x_n
        );
        let power = late.friction_power_n / steady.friction_power_n;
        assert!((power - 1.0).abs() < 0.03, "{start}: {power}");
        first.push(early.force_x_n / limit);
    }
    // The history that starts from steady rolling is steady at once, the other two are not.
    assert!(
        (first[2] - steady.force_x_n / limit).abs() < 0.01,
        "{first:?}"
    );
    assert!(
        (first[0] - first[2]).abs() > 0.05 && (first[1] - first[2]).abs() > 0.05,
        "{first:?}"
    );
}

#[test]
fn a_pressing_that_is_not_similar_to_itself_is_refused_by_name() {
    let good = references()[0].case();
    let profile = json!({ "type": "gap_profile", "rolling_mm": 100, "y_mm": [-5, 0, 5], "gap_mm": [1, 0, 1] });
    let across = json!({ "across": { "y_mm": [-1, 1], "coefficient": [0.2, 0.3] } });
    let layer =
        json!({ "coefficient": 0.3, "layer": { "shear_modulus_mpa": 10, "thickness_mm": 0.1 } });
    for (name, value, at, words) in [
        ("/contact", profile, "/motion/start", ["pressed", "radii"]),
        (
            "/friction",
            across,
            "/friction/across",
            ["pressed", "across"],
        ),
        ("/friction", layer, "/friction/layer", ["pressed", "layer"]),
        (
            "/motion/start",
            json!("press"),
            "/motion/start",
            ["press", "pressed"],
        ),
        (
            "/motion/start",
            json!("rest"),
            "/motion/history",
            ["no motion", "creepage_x"],
        ),
    ] {
        assert_fault(&with(&good, name, Some(value)), at, &words);
    }
}
