//! Tests that every mutated case gives either a problem or faults that point into the case.

use proptest::prelude::*;
use railhead_contact::case::solver::Limits;
use railhead_contact::check;
use serde_json::{Value, json};

use crate::cases::{good, good_with, with};

/// Appends every pointer of the value, depth first.
fn pointers(value: &Value, here: &str, list: &mut Vec<String>) {
    list.push(here.to_owned());
    match value {
        Value::Object(members) => {
            for (name, value) in members {
                let name = name.replace('~', "~0").replace('/', "~1");
                pointers(value, &format!("{here}/{name}"), list);
            }
        }
        Value::Array(elements) => {
            for (k, value) in elements.iter().enumerate() {
                pointers(value, &format!("{here}/{k}"), list);
            }
        }
        _ => {}
    }
}

fn some_value() -> impl Strategy<Value = Value> {
    let scalar = prop_oneof![
        Just(json!(null)),
        any::<bool>().prop_map(|b| json!(b)),
        any::<f64>().prop_map(|x| json!(x)),
        (-310_i32..310).prop_map(|e| json!(10.0_f64.powi(e))),
        (-3_i64..2000).prop_map(|n| json!(n)),
        prop_oneof![
            Just("radii"),
            Just("ellipse"),
            Just("pressure_grid"),
            Just("gap_grid"),
            Just("liu_hsu"),
            Just("fastsim"),
            Just("grid"),
            Just("slip"),
            Just("é~/")
        ]
        .prop_map(|word| json!(word)),
    ];
    scalar.prop_recursive(3, 12, 4, |inner| {
        let name = prop_oneof![
            Just("sweep"),
            Just("from"),
            Just("to"),
            Just("points"),
            Just("creepage_x"),
            Just("lower"),
            Just("upper"),
            Just("type"),
            Just("a_mm"),
            Just("b_mm"),
            Just("force_x_n"),
            Just("mesh"),
            Just("a/b~c"),
            Just("")
        ]
        .prop_map(str::to_owned);
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..4).prop_map(Value::Array),
            prop::collection::vec((name, inner), 0..4)
                .prop_map(|members| Value::Object(members.into_iter().collect())),
        ]
    })
}

/// Returns valid cases of every kind, so that mutations reach every reader.
fn seeds() -> Vec<Value> {
    let ellipse = with(
        &good_with(
            "/contact",
            json!({ "type": "ellipse", "a_mm": 6, "b_mm": 3 }),
        ),
        "/motion",
        Some(json!({ "sweep": { "combine": "grid",
            "creepage_x": { "from": 0, "to": 0.01, "points": 3 },
            "spin_per_mm": { "from": 0, "to": 0.01, "points": 2 } } })),
    );
    let pair = with(
        &good_with(
            "/material",
            json!({
            "lower": { "young_modulus_mpa": 210_000, "poisson_ratio": 0.3 },
            "upper": { "young_modulus_mpa": 206_000, "poisson_ratio": 0.29 } }),
        ),
        "/solver",
        Some(
            json!({ "method": "liu_hsu", "mesh": { "strips": 8, "cells": 10 }, "time_limit_s": 10 }),
        ),
    );
    let grid = with(
        &good_with(
            "/contact",
            json!({ "type": "pressure_grid", "x_mm": [-1, 0, 1.5, 2], "y_mm": [0, 1, 2],
            "pressure_mpa": [[0, 3, 1, 0], [2, 9, 1e-3, 0], [0, 1, 0, 4]] }),
        ),
        "/load",
        None,
    );
    let profile = good_with(
        "/contact",
        json!({ "type": "gap_profile", "rolling_mm": 460,
            "y_mm": [-20, -10, 0, 10, 20], "gap_mm": [0.7, 0.2, 0, 0.2, 0.7] }),
    );
    let gap = good_with(
        "/contact",
        json!({ "type": "gap_grid", "x_mm": [-20, 0, 20], "y_mm": [-20, 0, 20],
            "gap_mm": [[1, 0.5, 1], [0.5, 0, 0.5], [1, 0.5, 1]] }),
    );
    vec![good(), ellipse, pair, grid, profile, gap]
}

fn mutated() -> impl Strategy<Value = Value> {
    let mutation = (
        any::<prop::sample::Index>(),
        prop::option::of(some_value()),
        any::<bool>(),
    );
    let start = prop::sample::select(seeds());
    (start, prop::collection::vec(mutation, 1..5)).prop_map(|(mut case, mutations)| {
        for (index, value, beside) in mutations {
            let mut list = Vec::new();
            pointers(&case, "", &mut list);
            let target = case.pointer_mut(&list[index.index(list.len())]).unwrap();
            match (target, value) {
                (Value::Object(members), Some(value)) if beside => {
                    members.insert("a/b~c".to_owned(), value);
                }
                (Value::Array(elements), Some(value)) if beside => elements.push(value),
                (Value::Object(members), None) => {
                    let name = members
                        .keys()
                        .nth(index.index(members.len().max(1)))
                        .cloned();
                    name.map(|name| members.remove(&name));
                }
                (Value::Array(elements), None) => {
                    elements.pop();
                }
                (target, Some(value)) => *target = value,
                (_, None) => {}
            }
        }
        case
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_mutation_of_a_case_panics(case in mutated()) {
        if let Ok(checked) = check(&case, &Limits::default()) {
            prop_assert!(!checked.problem.motions.is_empty() && !checked.run.outputs.is_empty());
            prop_assert!(checked.cost().bytes <= Limits::default().memory_bytes);
            prop_assert!(checked.cost().seconds.is_finite());
            for patch in checked.problem.task.known_patches().into_iter().flatten() {
                prop_assert!(patch.normal_force.is_finite() && patch.normal_force > 0.0, "{patch:?}");
                prop_assert!(patch.area.is_finite() && patch.area > 0.0, "{patch:?}");
            }
        }
    }

    #[test]
    fn every_fault_points_into_the_case(case in mutated()) {
        if let Err(error) = check(&case, &Limits::default()) {
            prop_assert!(!error.0.is_empty());
            for fault in error.0 {
                let parent = fault.pointer.rsplit_once('/').map_or("", |(parent, _)| parent);
                prop_assert!(case.pointer(&fault.pointer).or(case.pointer(parent)).is_some(), "{fault:?} in {case}");
                prop_assert!(!fault.detail.is_empty());
            }
        }
    }
}
