//! Tests of the energy cell by cell: tractions times slips add up to the friction power of the patch, and no cell generates power.

use railhead_contact::solution::words::answer::{Fields, Solution, Zone};
use serde_json::{Value, json};

use crate::laws::{MOTIONS, shapes};
use crate::reference::{Ellipse, assert_none, solve};

/// Returns the power of the cells of a patch over the rolling speed in N, and the least power of a cell.
fn power(fields: &Fields, patch: usize) -> (f64, f64) {
    let cells = fields.patches[patch].cells(0);
    let point = &fields.patches[patch].points[0];
    let take = |values: &Option<Vec<f64>>| values.clone().expect("was asked for");
    let [tx, ty] = [take(&point.traction_x_mpa), take(&point.traction_y_mpa)];
    let [sx, sy] = [take(&point.slip_x), take(&point.slip_y)];
    let of_cell = |i: usize| (tx[i] * sx[i] + ty[i] * sy[i]) * cells.dx_mm[i] * cells.dy_mm[i];
    let powers = (0..tx.len()).map(of_cell);
    powers.fold((0.0, f64::INFINITY), |(sum, least), power| {
        (sum + power, least.min(power))
    })
}

/// Returns a message for each wrong power of an answer.
fn wrong(name: &str, solution: &Solution, fields: &Fields) -> Vec<String> {
    let mut wrong = Vec::new();
    for (k, patch) in solution.patches.iter().enumerate() {
        let known = patch.points[0].friction_power_n;
        let (sum, least) = power(fields, k);
        if (sum - known).abs() > 1e-9 * known.abs() || least < 0.0 {
            wrong.push(format!("{name}: {sum:e} N of {known:e}, least {least:e}"));
        }
    }
    wrong
}

#[test]
fn cells_give_the_power_of_the_patch_from_no_slip_to_full_slip() {
    let mut failures = Vec::new();
    let small = [1e-3, 0.0, 0.0];
    for steel in shapes() {
        for [x, y, spin] in MOTIONS.into_iter().chain([small]) {
            let contact = steel.normalised(x, y, spin);
            let (solution, fields) = solve(&contact.case(10, 10));
            let name = format!("a/b {:.2} {:?}", steel.a_mm / steel.b_mm, [x, y, spin]);
            failures.extend(wrong(&name, &solution, &fields));
        }
    }
    assert_none("powers do not add up", &failures);
}

#[test]
fn cells_give_the_power_with_any_method_target_and_contact() {
    let mut failures = Vec::new();
    for solver in [
        json!({ "target_error": 0.005 }),
        json!({ "method": "liu_hsu", "mesh": { "strips": 8, "cells": 8 } }),
        json!({ "method": "fastsim" }),
    ] {
        for motion in [[0.5, 0.0, 0.0], [0.02, 0.01, 0.03], [0.4, -0.3, 3.0]] {
            let contact = Ellipse::steel(1.5, 0.28).normalised(motion[0], motion[1], motion[2]);
            let mut case = contact.case(8, 8);
            case["solver"] = solver.clone();
            let (solution, fields) = solve(&case);
            failures.extend(wrong(&format!("{solver} {motion:?}"), &solution, &fields));
        }
    }
    for name in ["two-patches", "wheel-rail"] {
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
        let file = format!("{root}/api/examples/{name}.case.json");
        let text = std::fs::read_to_string(file).expect("an example");
        let mut case: Value = serde_json::from_str(&text).expect("JSON");
        case["outputs"] = json!(["tractions", "slip"]);
        let (solution, fields) = solve(&case);
        failures.extend(wrong(name, &solution, &fields));
    }
    assert_none("powers do not add up", &failures);
}

#[test]
fn power_lies_where_cells_slip_or_at_the_trailing_end() {
    let contact = Ellipse::steel(1.0, 0.28).normalised(0.3, 0.1, 0.2);
    let (_, fields) = solve(&contact.case(12, 12));
    let cells = fields.patches[0].cells(0);
    let point = &fields.patches[0].points[0];
    let zones = point.zone.as_ref().expect("zones");
    let slip = point.slip_x.as_ref().expect("slip");
    assert!(zones.contains(&Zone::Stick) && zones.contains(&Zone::Slip));
    for i in 1..slip.len() {
        let last = cells.strip[i] != cells.strip[i - 1];
        assert!(zones[i] == Zone::Slip || last || slip[i] == 0.0, "cell {i}");
    }
}
