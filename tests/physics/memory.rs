//! Tests that a case keeps a bounded amount of memory, and that stored operators do not change an answer.

use std::sync::Arc;

use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::rolling::operator_store::OperatorStore;
use railhead_contact::solution::words::answer::Solution;
use railhead_contact::{check, solve_with};
use serde_json::{Value, json};

use crate::gap_samples::{profile, steel};

/// Returns creepages whose spin pole lies on a grid of `side × side` places inside the patch, at fixed spin. Each motion would prefer its own mesh.
pub fn creep_map(side: u32, target: f64) -> Value {
    let spin = 0.003;
    let at = |k: u32| f64::from(k) / f64::from((side - 1).max(1)) - 0.5;
    let mut motions = Vec::new();
    for row in 0..side {
        for column in 0..side {
            motions.push(json!({
                "creepage_x": spin * 8.0 * at(row),
                "creepage_y": -spin * 11.0 * at(column),
                "spin_per_mm": spin,
            }));
        }
    }
    let contact = json!({ "type": "radii", "rolling_mm": 460, "lateral_mm": 300 });
    resultants(
        contact,
        100_000,
        &json!(motions),
        &json!({ "method": "boundary_element", "target_error": target }),
    )
}

/// Returns a case of a contact with these motions under a load in N, with resultants only.
fn resultants(contact: Value, load: u32, motions: &Value, solver: &Value) -> Value {
    let mut case = steel(contact, json!({ "normal_force_n": load }), [0.0; 3]);
    case["motion"] = motions.clone();
    case["solver"] = solver.clone();
    case["outputs"] = json!(["resultants"]);
    case
}

fn problem(case: &Value) -> CheckedCase {
    check(case, &Limits::default()).expect("a valid case")
}

/// Returns the answer with all times set to 0.
fn answer(store: &Arc<OperatorStore>, checked: &CheckedCase) -> Solution {
    let (mut solution, _) = solve_with(store, checked, &Unmonitored).expect("an answer");
    for point in solution.patches.iter_mut().flat_map(|p| &mut p.points) {
        point.solver.seconds = 0.0;
    }
    if let Some(normal) = &mut solution.normal {
        normal.seconds = 0.0;
    }
    solution
}

#[test]
fn answers_do_not_depend_on_what_the_operator_store_keeps() {
    let y: Vec<f64> = (-20..=20).map(|k| 0.5 * f64::from(k)).collect();
    let contact = profile(460.0, &y, |y| y * y / 600.0);
    let motions = json!([{ "creepage_x": 0.001 }, { "creepage_x": 0.001, "spin_per_mm": 0.0005 },
                         { "creepage_x": 0.0012, "spin_per_mm": 0.0005 }]);
    let mut gap = steel(contact, json!({ "normal_force_n": 60_000 }), [0.0; 3]);
    gap["motion"] = motions;
    for case in [creep_map(4, 0.005), gap] {
        let checked = problem(&case);
        let roomy = Arc::new(OperatorStore::new(1 << 30));
        let first = answer(&roomy, &checked);
        assert!(roomy.bytes() > 0);
        assert_eq!(
            first,
            answer(&roomy, &checked),
            "all operators from the store"
        );
        for bytes in [0, 1 << 20] {
            let store = Arc::new(OperatorStore::new(bytes));
            assert_eq!(first, answer(&store, &checked), "a store of {bytes} bytes");
            assert!(store.bytes() <= bytes);
        }
    }
}

#[test]
fn a_creep_map_stays_within_the_bound_of_the_store() {
    let bytes = 4 << 20;
    let store = Arc::new(OperatorStore::new(bytes));
    let solution = answer(&store, &problem(&creep_map(9, 0.005)));
    assert_eq!(solution.total.len(), 81);
    assert!(store.bytes() <= bytes, "{}", store.bytes());
    assert!(store.bytes() > bytes / 2, "the map fills the store");
}

#[test]
fn the_memory_of_a_long_sweep_of_resultants_is_some_kilobytes_a_motion() {
    let bytes = |side: u32| problem(&creep_map(side, 0.005)).cost().bytes as f64;
    // From this number of motions on, their operators fill the store.
    let (few, many) = (bytes(25), bytes(100));
    assert!(many - few < 9375.0 * 4e3, "{few} and {many}");
    assert!(many < 300e6, "{many}");
}

/// Tests that the size of the operators that a case leaves in the store is the one in its cost. The allowed factor covers the sizes of meshes that
/// the target leads to. The operators are part of the memory in the cost.
#[test]
fn the_cost_counts_the_operators_that_a_case_leaves_in_the_store() {
    let ellipse = |solver: &Value, motions: &Value| {
        let contact = json!({ "type": "ellipse", "a_mm": 6, "b_mm": 4 });
        resultants(contact, 80_000, motions, solver)
    };
    let target = json!({ "method": "boundary_element", "target_error": 0.005 });
    let mesh = json!({ "mesh": { "strips": 20, "cells": 30 } });
    let creep = json!([{ "creepage_x": 0.001 }, { "creepage_x": 0.002 }]);
    let all = json!([{ "creepage_x": 0.001, "creepage_y": 0.0005, "spin_per_mm": 0.0004 }]);
    let cases = [
        (ellipse(&mesh, &all), 1.01),
        // Solved on the first mesh alone, which is fine enough according to the table of creep forces.
        (ellipse(&target, &creep), 8.0),
        (ellipse(&target, &all), 6.0),
        // Some rows keep one mesh that is fine enough according to the table, although each motion could use a mesh about its own pole.
        (creep_map(9, 0.005), 6.0),
    ];
    for (case, factor) in cases {
        for bytes in [0, 4 << 20, 128 << 20] {
            let limits = Limits {
                operator_store_bytes: bytes,
                ..Limits::default()
            };
            let checked = check(&case, &limits).expect("a valid case");
            let store = Arc::new(OperatorStore::new(bytes));
            answer(&store, &checked);
            let (cost, kept) = (checked.cost(), store.bytes() as f64);
            let told = cost.operator_store_bytes as f64;
            assert!(told <= bytes as f64 && cost.operator_store_bytes <= cost.bytes);
            assert!(
                (kept / factor..=kept * factor).contains(&told),
                "{told} estimated, {kept} kept of {bytes}: {case}"
            );
        }
    }
}
