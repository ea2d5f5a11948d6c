//! The table of creep forces tells the error of an ellipse's forces where it covers the contact: is what it tells right, does it save work,
//! and is it left alone elsewhere?

use serde_json::{Value, json};

use crate::population::{Class, case};
use crate::reference::{solve, solve_without_table};

/// Contacts of the population that no constant was fitted to.
const FIRST: usize = 300;
const CONTACTS: usize = 40;
const TARGET: f64 = 0.005;

fn is_told(skipped: &[String]) -> bool {
    skipped.iter().any(|text| text.contains("table of creep"))
}

fn is_told_of(question: &Value) -> bool {
    let (solution, _) = solve(question);
    let mut points = solution.patches.iter().flat_map(|patch| &patch.points);
    points.any(|point| is_told(&point.solver.skipped))
}

fn ellipse() -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "ellipse", "a_mm": 6, "b_mm": 4 },
        "load": { "normal_force_n": 80_000 },
        "motion": { "creepage_x": 0.001 },
        "solver": { "target_error": TARGET },
        "outputs": ["resultants"],
    })
}

#[test]
fn what_the_table_tells_holds_and_saves_products() {
    let (mut told, mut beyond) = (0, Vec::new());
    let mut products = [0, 0];
    for number in FIRST..FIRST + CONTACTS {
        let mut question = case(Class::Ellipse, number);
        let mut at = |target: f64| {
            question["solver"] = json!({ "target_error": target });
            question.clone()
        };
        let (found, _) = solve(&at(TARGET));
        let (compared, _) = solve_without_table(&at(TARGET));
        let [found_point, compared_point] = [&found, &compared].map(|s| &s.patches[0].points[0]);
        assert!(!is_told(&compared_point.solver.skipped));
        if !is_told(&found_point.solver.skipped) {
            continue;
        }
        told += 1;
        products[0] += found_point.solver.products;
        products[1] += compared_point.solver.products;
        let (truth, _) = solve_without_table(&at(0.001));
        let (found, truth) = (found.total[0], truth.total[0]);
        let [estimate, uncertainty] =
            [found, truth].map(|total| total.error_estimate.expect("an estimate").force_x_n);
        let off = (found.force_x_n - truth.force_x_n)
            .abs()
            .max((found.force_y_n - truth.force_y_n).abs());
        if off > estimate + 0.5 * uncertainty {
            beyond.push(format!("{number}: {off} N, estimate {estimate} N"));
        }
    }
    assert!(2 * told > CONTACTS, "told of {told}");
    assert!(20 * beyond.len() <= told, "{beyond:?} of {told}");
    assert!(4 * products[0] < 3 * products[1], "{products:?}");
}

#[test]
fn the_estimate_is_no_less_than_the_distance_to_the_table() {
    for motion in [
        json!({ "creepage_x": 0.001 }),
        json!({ "creepage_y": 0.0007, "spin_per_mm": 0.0003 }),
        json!({ "creepage_x": 0.004, "creepage_y": -0.002 }),
    ] {
        let mut question = ellipse();
        question["solver"]["target_error"] = json!(0.02);
        question["motion"] = motion;
        let (found, _) = solve(&question);
        assert!(is_told(&found.patches[0].points[0].solver.skipped));
        question["solver"] = json!({ "method": "table" });
        let (by_table, _) = solve(&question);
        let (found, by_table) = (found.total[0], by_table.total[0]);
        let [estimate, bound] =
            [found, by_table].map(|total| total.error_estimate.expect("an estimate").force_x_n);
        let apart = (found.force_x_n - by_table.force_x_n)
            .abs()
            .max((found.force_y_n - by_table.force_y_n).abs());
        assert!(apart > 0.0 && apart + 0.5 * bound <= estimate);
    }
}

#[test]
fn the_table_tells_of_nothing_that_it_does_not_cover() {
    assert!(is_told_of(&ellipse()));
    let with = |part: &str, value: Value| {
        let mut question = ellipse();
        question[part] = value;
        question
    };
    let soft = json!({ "shear_modulus_mpa": 800, "poisson_ratio": 0.45 });
    let steel = json!({ "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 });
    let y: Vec<f64> = (-20..=20).map(|k| 0.5 * f64::from(k)).collect();
    let gap: Vec<f64> = y.iter().map(|y| y * y / 600.0).collect();
    for question in [
        with(
            "contact",
            json!({ "type": "ellipse", "a_mm": 12, "b_mm": 1 }),
        ),
        with(
            "contact",
            json!({ "type": "gap_profile", "rolling_mm": 460, "y_mm": y, "gap_mm": gap }),
        ),
        with("material", json!({ "upper": soft, "lower": steel })),
        with(
            "friction",
            json!({ "across": { "y_mm": [-4, 4], "coefficient": [0.2, 0.4] } }),
        ),
        with(
            "friction",
            json!({ "coefficient": 0.3, "layer": { "shear_modulus_mpa": 20, "thickness_mm": 0.01 } }),
        ),
        with("motion", json!({ "force_x_n": 9000 })),
        with("solver", json!({ "mesh": { "strips": 8, "cells": 8 } })),
        with("solver", json!({ "target_error": 0.0005 })),
    ] {
        assert!(!is_told_of(&question), "{question}");
    }
}

/// Reduced stiffness of the surfaces is that of a softer material.
#[test]
fn the_table_tells_the_same_of_reduced_stiffness_as_of_a_softer_material() {
    let mut reduced = ellipse();
    reduced["friction"]["reduction"] = json!(0.5);
    let mut softer = ellipse();
    softer["material"]["shear_modulus_mpa"] = json!(41000);
    let [reduced, softer] = [reduced, softer].map(|question| solve(&question).0);
    for solution in [&reduced, &softer] {
        assert!(is_told(&solution.patches[0].points[0].solver.skipped));
    }
    let (a, b) = (reduced.total[0], softer.total[0]);
    assert!((a.force_x_n - b.force_x_n).abs() < 1e-4 * 24_000.0);
}
