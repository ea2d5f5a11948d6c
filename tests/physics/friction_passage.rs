//! Tests of path-dependent friction: a coefficient that falls with temperature, and a layer that yields.

use railhead_contact::solution::words::answer::{Fields, Solution, Zone};
use serde_json::{Value, json};

use crate::cases::{assert_fault, with};
use crate::reference::{Ellipse, solve};

const SPEED: f64 = 30_000.0;
const LIMIT: f64 = 0.3 * 60_000.0;

fn steel() -> Value {
    json!({ "conductivity_w_per_mk": 50, "density_kg_per_m3": 7850, "specific_heat_j_per_kgk": 450, "bulk_c": 20 })
}

/// Returns a contact with these dimensionless creepages and friction by temperature.
fn heated(creepages: [f64; 3], speed: f64, friction: Value) -> Value {
    let [x, y, spin] = creepages;
    let mut case = Ellipse::steel(1.5, 0.28)
        .normalised(x, y, spin)
        .case(12, 20);
    case["friction"] = json!({ "by_temperature": friction });
    case["motion"]["speed_mm_per_s"] = json!(speed);
    case["thermal"] = steel();
    case
}

fn falling() -> Value {
    json!({ "temperature_c": [20, 400], "coefficient": [0.3, 0.1] })
}

fn forces((solution, _): &(Solution, Fields)) -> [f64; 3] {
    let point = &solution.patches[0].points[0];
    [
        point.force_x_n / LIMIT,
        point.force_y_n / LIMIT,
        point.moment_z_n_mm / LIMIT / 5.0,
    ]
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
}

#[test]
fn a_coefficient_that_does_not_fall_and_a_contact_that_stays_cold_have_its_forces() {
    let motion = [1.2, -0.3, 0.5];
    let constant = |mu: f64| {
        let [x, y, spin] = motion;
        let mut case = Ellipse::steel(1.5, 0.28)
            .normalised(x, y, spin)
            .case(12, 20);
        case["friction"]["coefficient"] = json!(mu);
        forces(&solve(&case))
    };
    let even = json!({ "temperature_c": [0, 500], "coefficient": [0.3, 0.3] });
    let even = forces(&solve(&heated(motion, SPEED, even)));
    assert!(apart(even, constant(0.3)) < 1e-6);
    // Slow rolling generates no heat: the coefficient is that of 20 °C, 0.2.
    let cold = json!({ "temperature_c": [0, 40], "coefficient": [0.3, 0.1] });
    let cold = forces(&solve(&heated(motion, 1e-9, cold)));
    assert!(apart(cold, constant(0.2)) < 1e-5, "{cold:?}");
}

/// All cells slip by the same creepage, so that every line along x heats up independently. The test integrates its coefficients step by step from
/// the leading edge, with its own cells.
#[test]
fn in_full_slip_the_force_is_that_of_the_heat_of_every_line() {
    let ellipse = Ellipse::steel(1.5, 0.28);
    let (creepage, speed) = (0.5, 200.0);
    let mut case = heated([1.0, 0.0, 0.0], speed, falling());
    case["motion"]["creepage_x"] = json!(creepage);
    case["solver"] = json!({ "target_error": 0.001 });
    let found = forces(&solve(&case))[0];
    let both = 2.0 * (50.0_f64 * 7850.0 * 450.0).sqrt();
    let rise = 1e3 * 1e-3_f64.sqrt() / (both * (std::f64::consts::PI * speed * 1e-3).sqrt())
        * speed
        * creepage;
    let (lines, cells) = (40, 240);
    let (mut sum, mut cold) = (0.0, 0.0);
    for line in 0..lines {
        let eta = (f64::from(line) + 0.5) / f64::from(lines);
        let half = ellipse.a_mm * (1.0 - eta * eta).sqrt();
        let edge = |k: i32| half * (std::f64::consts::PI * f64::from(k) / f64::from(cells)).cos();
        let mut heat: Vec<(f64, f64, f64)> = Vec::new();
        for k in 0..cells {
            let (right, left) = (edge(k), edge(k + 1));
            let x = 0.5 * (left + right);
            let pressure = ellipse.pressure_max()
                * (1.0 - eta * eta - (x / ellipse.a_mm).powi(2))
                    .max(0.0)
                    .sqrt();
            let ahead: f64 = heat
                .iter()
                .map(|(l, r, q)| 2.0 * q * ((r - x).sqrt() - (l - x).sqrt()))
                .sum();
            // μ = 0.3 − 0.2 (T − 20)/380, with T due to the heat ahead and to the cell's own half, which is linear in μ.
            let own = rise * 2.0 * pressure * (right - x).sqrt();
            let fall = 0.2 / 380.0;
            let mu = (0.3 - fall * rise * ahead) / (1.0 + fall * own);
            assert!(mu > 0.1, "the line stays on the slope");
            heat.push((left, right, mu * pressure));
            sum += mu * pressure * (right - left);
            cold += 0.3 * pressure * (right - left);
        }
    }
    let known = sum / cold;
    println!("{found} of {known}");
    assert!(known < 0.9, "hot enough to tell: {known}");
    assert!((found - known).abs() < 0.003, "{found} {known}");
}

/// Tests that the traction of slipping cells is the pressure times the coefficient at the temperature of the answer.
#[test]
fn tractions_have_the_coefficient_of_their_own_temperature() {
    let mut case = heated(
        [0.6, 0.1, 0.2],
        SPEED,
        json!({ "temperature_c": [20, 35, 120], "coefficient": [0.3, 0.255, 0.12] }),
    );
    case["outputs"] = json!([
        "resultants",
        "tractions",
        "pressure",
        "zones",
        "temperature"
    ]);
    case["solver"]["mesh"] = json!({ "strips": 16, "cells": 30 });
    let (solution, fields) = solve(&case);
    let (cells, values) = (fields.patches[0].cells(0), &fields.patches[0].points[0]);
    let take = |values: &Option<Vec<f64>>| values.clone().expect("asked for");
    let (tx, ty) = (take(&values.traction_x_mpa), take(&values.traction_y_mpa));
    let (pressure, temperature) = (take(&cells.pressure_mpa), take(&values.temperature_c));
    let zones = values.zone.clone().expect("asked for");
    let coefficient = |t: f64| match t {
        t if t <= 35.0 => 0.3 - 0.045 * (t.max(20.0) - 20.0) / 15.0,
        t => 0.255 - 0.135 * (t.min(120.0) - 35.0) / 85.0,
    };
    let (mut slipping, mut worst, mut least) = (0, 0.0_f64, 1.0_f64);
    for i in 0..tx.len() {
        if zones[i] == Zone::Slip {
            let mu = tx[i].hypot(ty[i]) / pressure[i];
            slipping += 1;
            least = least.min(mu);
            worst = worst.max((mu - coefficient(temperature[i])).abs());
        }
    }
    println!(
        "{slipping} of {} slip, least {least:.3}, off by {worst:.4}",
        tx.len()
    );
    assert!(slipping > 50 && slipping < tx.len() && least < 0.295);
    // The slips of the bounds are those of the three-point rule, and temperatures follow from the power of the tractions.
    assert!(worst < 0.01, "{worst}");
    let hottest = solution.patches[0].points[0]
        .temperature
        .expect("asked for");
    assert!(hottest.max_c > 22.0);
}

#[test]
fn a_layer_that_is_strong_enough_is_elastic_and_a_weaker_one_takes_less() {
    let force = |layer: Value| {
        let mut case = Ellipse::steel(1.0, 0.28)
            .normalised(2.0, 0.0, 0.0)
            .case(12, 20);
        case["friction"]["layer"] = layer;
        forces(&solve(&case))[0]
    };
    let elastic = json!({ "shear_modulus_mpa": 500, "thickness_mm": 0.02 });
    let yields = |stress: f64, hardening: f64| json!({ "shear_modulus_mpa": 500, "thickness_mm": 0.02, "yield_mpa": stress, "hardening_mpa_per_mm": hardening });
    let base = force(elastic);
    assert!((force(yields(1e4, 0.0)) - base).abs() < 1e-6);
    let weak = [20.0, 100.0, 200.0].map(|stress| force(yields(stress, 0.0)));
    assert!(
        weak[0] < weak[1] && weak[1] < weak[2] && weak[2] <= base + 1e-9,
        "{weak:?} {base}"
    );
    // With very little strength, the whole patch of 25 π mm² carries the yield stress, except for an edge where the friction bound is lower.
    let slow = force(yields(5.0, 0.0));
    let whole = 5.0 * std::f64::consts::PI * 25.0 / LIMIT;
    assert!((slow / whole - 1.0).abs() < 0.02, "{slow} {whole}");
    let hard = force(yields(20.0, 2000.0));
    assert!(hard > weak[0] && hard < base, "{hard}");
}

#[test]
fn faults_of_heated_friction_name_what_is_wrong() {
    let case = heated([1.0, 0.0, 0.0], SPEED, falling());
    assert_fault(&with(&case, "/thermal", None), "/thermal", &["missing"]);
    assert_fault(
        &with(&case, "/motion/speed_mm_per_s", None),
        "/motion/speed_mm_per_s",
        &["temperature"],
    );
    let rising = json!({ "temperature_c": [20, 400], "coefficient": [0.1, 0.3] });
    assert_fault(
        &with(&case, "/friction/by_temperature", Some(rising)),
        "/friction/by_temperature/coefficient/1",
        &["0.3", "rises"],
    );
    let unordered = json!({ "temperature_c": [20, 20], "coefficient": [0.3, 0.1] });
    assert_fault(
        &with(&case, "/friction/by_temperature", Some(unordered)),
        "/friction/by_temperature/temperature_c/1",
        &["20"],
    );
    assert_fault(
        &with(&case, "/solver/method", Some(json!("fastsim"))),
        "/friction",
        &["boundary_element"],
    );
    let steep = json!({ "temperature_c": [20, 20.1], "coefficient": [0.3, 0.1] });
    assert_fault(
        &with(&case, "/friction/by_temperature", Some(steep)),
        "/friction",
        &["stability number"],
    );
    let forced = with(
        &with(&case, "/motion/creepage_x", None),
        "/motion/force_x_n",
        Some(json!(100)),
    );
    assert_fault(&forced, "/motion/force_x_n", &["temperature"]);
    let both = with(&case, "/friction/coefficient", Some(json!(0.3)));
    assert_fault(&both, "/friction/by_temperature", &["coefficient"]);
    let mut layer = case.clone();
    layer["friction"] = json!({ "coefficient": 0.3, "layer": { "shear_modulus_mpa": 500, "thickness_mm": 0.02, "hardening_mpa_per_mm": 1 } });
    layer.as_object_mut().unwrap().remove("thermal");
    assert_fault(
        &layer,
        "/friction/layer/hardening_mpa_per_mm",
        &["yield_mpa"],
    );
    layer["friction"]["layer"]["yield_mpa"] = json!(100);
    layer["motion"] = json!({ "history": { "distance_mm": [0, 5], "creepage_x": 0.001 } });
    assert_fault(&layer, "/friction/layer/yield_mpa", &["history"]);
}
