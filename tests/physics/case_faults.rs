//! Tests that an invalid case is refused with every fault: its place, the given value and the allowed values.

use railhead_contact::case::words::solver::{Case, Output};
use railhead_contact::rolling::task::Resolution;
use serde_json::{Value, json};

use crate::cases::{assert_fault, faults, good, good_with, problem, with};

#[test]
fn the_good_case_is_good() {
    let checked = problem(&good());
    assert_eq!(checked.problem.motions.len(), 1);
    assert!(checked.remarks.is_empty(), "{:?}", checked.remarks);
    assert!(checked.run.wants(Output::Tractions) && !checked.run.wants(Output::Slip));
}

#[test]
fn what_is_left_out_has_the_documented_default() {
    let mut case = good();
    for name in ["name", "labels", "solver", "outputs"] {
        case.as_object_mut().unwrap().remove(name);
    }
    let checked = problem(&case);
    assert_eq!(checked.run.resolution, Resolution::Target(0.005));
    assert_eq!(checked.run.outputs, [Output::Resultants, Output::Zones]);
    assert_eq!(checked.label.name, None);
}

#[test]
fn a_case_reads_back_what_it_writes() {
    let case = Case::read(&good()).unwrap();
    let written = serde_json::to_value(&case).unwrap();
    assert_eq!(Case::read(&written).unwrap(), case);
}

#[test]
fn all_faults_are_named_at_once() {
    let case = json!({
        "material": { "shear_modulus_mpa": -5, "poisson_ratio": 0.7 },
        "friction": { "coefficient": "much" },
        "contact": { "type": "radii", "rolling_mm": 460 },
        "load": { "normal_force_n": -1, "mass_kg": 3 },
        "motion": {},
        "solver": { "method": "magic", "mesh": { "strips": 0, "cells": 2.5 } },
        "outputs": [],
        "colour": "red"
    });
    let mut found: Vec<String> = faults(&case)
        .into_iter()
        .map(|fault| fault.pointer)
        .collect();
    found.sort();
    let expected = [
        "/colour",
        "/contact/lateral_mm",
        "/friction/coefficient",
        "/load/mass_kg",
        "/load/normal_force_n",
        "/material/poisson_ratio",
        "/material/shear_modulus_mpa",
        "/motion",
        "/outputs",
        "/solver/mesh/cells",
        "/solver/mesh/strips",
        "/solver/method",
    ];
    assert_eq!(found, expected);
}

#[test]
fn every_required_member_is_missed() {
    for name in ["material", "friction", "contact", "load", "motion"] {
        let pointer = format!("/{name}");
        assert_fault(&with(&good(), &pointer, None), &pointer, &["missing"]);
    }
    for pointer in [
        "/material/poisson_ratio",
        "/friction/coefficient",
        "/contact/type",
        "/contact/rolling_mm",
    ] {
        assert_fault(&with(&good(), pointer, None), pointer, &["missing"]);
    }
}

#[test]
fn both_sides_of_every_range_are_kept() {
    let table = [
        (
            "/material/shear_modulus_mpa",
            vec![1e-3, 1e6],
            vec![0.0, -82000.0, 1.1e12],
        ),
        (
            "/material/poisson_ratio",
            vec![0.0, 0.5],
            vec![-1e-9, 0.5000001],
        ),
        ("/friction/coefficient", vec![0.0, 100.0], vec![-0.1, 100.5]),
        (
            "/contact/rolling_mm",
            vec![1.0, 1e5],
            vec![0.0, -460.0, 1.1e9],
        ),
        (
            "/contact/lateral_mm",
            vec![1.0, 1e5],
            vec![0.0, -300.0, 1.1e9],
        ),
        (
            "/load/normal_force_n",
            vec![1e-6, 1e9],
            vec![0.0, -1.0, 1.1e12],
        ),
        (
            "/motion/creepage_x",
            vec![-1e6, 0.0, 1e6],
            vec![-1.1e6, 1.1e6],
        ),
        ("/motion/creepage_y", vec![-1e6, 1e6], vec![-1.1e6, 1.1e6]),
        ("/motion/spin_per_mm", vec![-1e6, 1e6], vec![-1.1e6, 1.1e6]),
        (
            "/solver/target_error",
            vec![1e-4, 0.5],
            vec![0.99e-4, 0.51, 0.0],
        ),
        (
            "/solver/time_limit_s",
            vec![1e-3, 86400.0],
            vec![0.0, 86401.0, -1.0],
        ),
    ];
    for (pointer, allowed, refused) in table {
        for number in allowed {
            assert_eq!(
                faults(&good_with(pointer, json!(number))),
                [],
                "{pointer} = {number}"
            );
        }
        for number in refused {
            let given = serde_json::to_string(&number).unwrap();
            assert_fault(
                &good_with(pointer, json!(number)),
                pointer,
                &[&given, "is needed"],
            );
        }
        for wrong in [json!(null), json!("1"), json!([1]), json!({}), json!(true)] {
            assert_fault(&good_with(pointer, wrong), pointer, &["given", "a number"]);
        }
    }
}

#[test]
fn contradictions_are_refused() {
    assert_fault(
        &good_with("/material/young_modulus_mpa", json!(210_000)),
        "/material/young_modulus_mpa",
        &["exactly one"],
    );
    assert_fault(
        &good_with("/load/approach_mm", json!(0.1)),
        "/load/approach_mm",
        &["exactly one"],
    );
    assert_fault(
        &good_with("/load", json!({})),
        "/load",
        &["normal_force_n, approach_mm"],
    );
    assert_fault(
        &good_with("/solver/mesh", json!({ "strips": 8, "cells": 8 })),
        "/solver/mesh",
        &["target_error"],
    );
    assert_fault(
        &good_with("/material", json!({ "poisson_ratio": 0.3 })),
        "/material/shear_modulus_mpa",
        &["young_modulus_mpa"],
    );
}

#[test]
fn what_is_not_offered_yet_is_named_with_what_is() {
    assert_fault(
        &good_with("/contact/type", json!("slices")),
        "/contact/type",
        &[
            "slices",
            "radii, ellipse, gap_profile, gap_grid, pressure_grid, profiles",
        ],
    );
    assert_fault(
        &good_with("/outputs/1", json!("stresses")),
        "/outputs/1",
        &["\"stresses\" given", "subsurface"],
    );
}

#[test]
fn texts_are_limited_in_length() {
    assert_eq!(faults(&good_with("/name", json!("é".repeat(200)))), []);
    assert_fault(
        &good_with("/name", json!("é".repeat(201))),
        "/name",
        &["200 characters"],
    );
    assert_fault(
        &good_with("/labels/a~b", json!(3)),
        "/labels/a~0b",
        &["a text"],
    );
    assert_fault(
        &good_with("/labels/line", json!("x".repeat(257))),
        "/labels/line",
        &["256 characters"],
    );
    let key = "k".repeat(65);
    assert_fault(
        &good_with(&format!("/labels/{key}"), json!("v")),
        &format!("/labels/{key}"),
        &["64"],
    );
    let many: serde_json::Map<String, Value> =
        (0..33).map(|k| (format!("k{k}"), json!(""))).collect();
    assert_fault(
        &good_with("/labels", Value::Object(many)),
        "/labels",
        &["33", "32"],
    );
}

#[test]
fn values_of_a_sweep_are_a_number_a_range_or_a_list() {
    for (given, pointer, words) in [
        (json!("0.1"), "", ["a number, ", "values"]),
        (json!({ "values": [] }), "/values", ["array", "1 to"]),
        (
            json!({ "values": [0, "1"] }),
            "/values/1",
            ["\"1\"", "needed"],
        ),
        (
            json!({ "values": [0], "points": 1 }),
            "/points",
            ["unknown", "values"],
        ),
    ] {
        assert_fault(
            &good_with(
                "/motion",
                json!({ "sweep": { "creepage_x": given, "spin_per_mm": 0.001 } }),
            ),
            &format!("/motion/sweep/creepage_x{pointer}"),
            &words,
        );
    }
}

#[test]
fn motions_are_refused_with_the_place_in_the_list() {
    assert_fault(
        &good_with(
            "/motion",
            json!([{ "creepage_x": 1 }, { "creepage_y": "fast" }]),
        ),
        "/motion/1/creepage_y",
        &["\"fast\""],
    );
    assert_fault(
        &good_with("/motion", json!([])),
        "/motion",
        &["an empty array"],
    );
    assert_fault(
        &good_with("/motion", json!([{ "creepage_x": 1 }, {}])),
        "/motion/1",
        &["the value 0"],
    );
    assert_fault(
        &good_with(
            "/motion",
            json!({ "sweep": { "creepage_x": { "from": 0, "to": 1, "points": 1 } } }),
        ),
        "/motion/sweep/creepage_x/points",
        &["at least 2"],
    );
    let uneven = json!({ "sweep": {
        "creepage_x": { "from": 0, "to": 1, "points": 3 },
        "creepage_y": { "from": 0, "to": 1, "points": 4 }
    } });
    assert_fault(
        &good_with("/motion", uneven.clone()),
        "/motion/sweep",
        &["3, 4", "grid"],
    );
    let grid = with(
        &json!({ "motion": uneven }),
        "/motion/sweep/combine",
        Some(json!("grid")),
    );
    assert_eq!(
        problem(&good_with("/motion", grid["motion"].clone()))
            .problem
            .motions
            .len(),
        12
    );
    assert_fault(
        &good_with("/motion", json!({ "sweep": {} })),
        "/motion/sweep",
        &["at least one"],
    );
}
