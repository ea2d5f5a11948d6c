//! Measures the condition of the equations by singular values of the whole map from tractions to slips.

use std::fmt::Write as _;

use faer::Mat;
use railhead_contact::case::solver::Limits;
use railhead_contact::mesh::MeshSize;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::rolling::slip_equations::SlipEquations;
use railhead_contact::rolling::slip_rules::Rule;
use railhead_contact::rolling::strip_mesh::StripMesh;
use railhead_contact::{check, normal_stage};
use serde_json::json;

/// Returns the ratio of the largest to the smallest singular value of the map of a rule, for ν = 0.28.
fn condition(a_over_b: f64, strips: u32, cells: u32, rule: Rule) -> f64 {
    let case = json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "ellipse", "a_mm": 5.0 * a_over_b.sqrt(), "b_mm": 5.0 / a_over_b.sqrt() },
        "load": { "normal_force_n": 60_000 },
        "motion": { "creepage_x": 0.001, "creepage_y": 0.0, "spin_per_mm": 0.0 },
        "solver": { "method": "liu_hsu", "mesh": { "strips": strips, "cells": cells } },
    });
    let problem = check(&case, &Limits::default()).expect("a valid case");
    let footprint = normal_stage::solve(&problem, &Unmonitored)
        .expect("a contact")
        .footprint;
    let level = StripMesh::new(
        &problem.rolling_task(&footprint),
        MeshSize { strips, cells },
    )
    .expect("a mesh");
    let operator = level.operator(&Unmonitored).expect("never stopped");
    let equations = SlipEquations::new(rule, &level.normalised, &operator, None);
    let values = equations.dense(&Unmonitored).expect("never stopped");
    let n = 2 * equations.cells();
    let matrix = Mat::from_fn(n, n, |i, j| values[j * n + i]);
    let singular = matrix.singular_values().expect("singular values");
    singular.iter().copied().fold(0.0, f64::max)
        / singular.iter().copied().fold(f64::INFINITY, f64::min)
}

pub fn section() -> String {
    let mut text = "## Condition of the equations\n\nLargest over smallest singular value of the map from tractions to slips, everything sticking, ν = 0.28.\n\n\
         | a/b | cells × strips | three-point rule | trapezoid | upwind |\n|---|---|---|---|---|\n"
        .to_owned();
    for (a_over_b, strips, cells) in [
        (1.0, 4, 4),
        (1.0, 8, 8),
        (1.0, 12, 12),
        (1.0, 16, 16),
        (1.0, 6, 24),
        (1.0, 24, 6),
        (0.02, 12, 12),
        (50.0, 12, 12),
    ] {
        let [mirror, trapezoid, upwind] = [Rule::ThreePoint, Rule::Trapezoid, Rule::Upwind]
            .map(|rule| condition(a_over_b, strips, cells, rule));
        let _ = writeln!(
            text,
            "| {a_over_b} | {cells} × {strips} | {mirror:.1e} | {trapezoid:.1e} | {upwind:.1e} |"
        );
    }
    text.push('\n');
    text
}
