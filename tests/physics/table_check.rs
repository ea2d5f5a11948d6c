//! The table of creep forces tells the error of an ellipse's forces where it covers the contact: is what it tells right, does it save work,
//! and is it left alone elsewhere?

use railhead::contact::case::limits::Limits;
use railhead::contact::check;
use railhead::contact::solution::words::answer::Solution;
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

/// The larger difference of F_x and F_y of two answers, and the estimate of each, in N.
fn compared_forces(answers: [&Solution; 2]) -> (f64, [f64; 2]) {
    let [a, b] = answers.map(|solution| solution.total[0]);
    let apart = [a.force_x_n - b.force_x_n, a.force_y_n - b.force_y_n];
    let estimates = [a, b].map(|total| total.error_estimate.expect("an estimate").force_x_n);
    (apart[0].abs().max(apart[1].abs()), estimates)
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
        let (off, [estimate, uncertainty]) = compared_forces([&found, &truth]);
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
        let (apart, [estimate, bound]) = compared_forces([&found, &by_table]);
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

/// The estimate counts 1.5 |K|/μ for what the table does not know of bodies that differ.
#[test]
fn forces_of_bodies_that_differ_are_near_those_of_like_bodies_by_k_over_friction() {
    let steel = json!({ "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 });
    let others = [(800.0, 0.45), (800.0, 0.4), (27000.0, 0.33), (800.0, 0.2)];
    let motions = [
        [0.0, 0.0, 1e-9],
        [0.7, 0.7, 0.7],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0],
    ];
    for ((modulus, nu), friction) in others
        .into_iter()
        .flat_map(|o| [0.1, 0.6].map(|mu| (o, mu)))
    {
        let mut question = ellipse();
        question["friction"]["coefficient"] = json!(friction);
        question["solver"]["target_error"] = json!(0.002);
        let upper = json!({ "shear_modulus_mpa": modulus, "poisson_ratio": nu });
        question["material"] = json!({ "upper": upper, "lower": steel });
        let pair = check(&question, &Limits::default())
            .expect("a case")
            .problem
            .elasticity;
        let mut like = question.clone();
        like["material"] =
            json!({ "shear_modulus_mpa": pair.shear_modulus, "poisson_ratio": pair.poisson_ratio });
        let limit = friction * 80_000.0;
        let unit = limit / (pair.shear_modulus * 24.0);
        for [x, y, spin] in motions {
            let motion = json!({ "creepage_x": unit * x, "creepage_y": unit * y,
                                 "spin_per_mm": unit * spin / 24.0_f64.sqrt() });
            let [a, b] = [&question, &like].map(|case| {
                let mut case = case.clone();
                case["motion"] = motion.clone();
                solve_without_table(&case).0
            });
            let (apart, [uncertain, _]) = compared_forces([&a, &b]);
            let allowed = 1.5 * pair.difference.abs() / friction * limit + uncertain;
            assert!(
                apart <= allowed,
                "K {}, μ {friction}, {motion}: {apart} N of {allowed}",
                pair.difference
            );
        }
    }
}
