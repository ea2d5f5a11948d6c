//! Tests that a valid case is checked against physics and limits, and becomes a problem with remarks, cost and digest.

use serde_json::{Value, json};

use crate::cases::{assert_fault, faults, good, good_with, problem, with};

#[test]
fn different_bodies_are_combined_with_a_remark_or_refused() {
    let pair = |upper: f64, nu: f64| {
        good_with(
            "/material",
            json!({
                "lower": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
                "upper": { "shear_modulus_mpa": upper, "poisson_ratio": nu }
            }),
        )
    };
    // A difference this small has no visible effect.
    assert!(problem(&pair(79_000.0, 0.29)).remarks.is_empty());
    let uncoupled =
        |upper: f64, nu: f64| with(&pair(upper, nu), "/solver/method", Some(json!("fastsim")));
    let remarks = problem(&uncoupled(79_000.0, 0.29)).remarks;
    assert_eq!(remarks.len(), 1);
    assert_eq!(remarks[0].code, "coupling-neglected");
    assert_eq!(remarks[0].pointer.as_deref(), Some("/material"));
    assert!(remarks[0].detail.contains("K = "), "{remarks:?}");
    assert!(problem(&pair(82_000.0, 0.28)).remarks.is_empty());
    assert!(problem(&pair(23_000.0, 0.31)).remarks.is_empty());
    let refused = uncoupled(23_000.0, 0.31);
    assert_fault(&refused, "/material", &["K = 0.1", "0.05"]);
    assert_fault(
        &good_with(
            "/material",
            json!({ "lower": { "shear_modulus_mpa": 1, "poisson_ratio": 0 }, "upper": { "shear_modulus_mpa": 1, "poisson_ratio": 0 }, "poisson_ratio": 0 }),
        ),
        "/material/poisson_ratio",
        &["unknown"],
    );
}

#[test]
fn high_friction_is_solved_with_a_remark() {
    assert!(
        problem(&good_with("/friction/coefficient", json!(1.0)))
            .remarks
            .is_empty()
    );
    assert!(
        problem(&good_with("/friction/coefficient", json!(1.5))).remarks[0]
            .detail
            .contains("1.5")
    );
}

#[test]
fn meshes_are_limited_by_method_and_memory() {
    let meshed = |method: &str, strips: u32, cells: u32| {
        good_with(
            "/solver",
            json!({ "method": method, "mesh": { "strips": strips, "cells": cells } }),
        )
    };
    assert_eq!(faults(&meshed("liu_hsu", 25, 40)), []);
    assert_fault(
        &meshed("liu_hsu", 25, 41),
        "/solver/mesh",
        &["1025", "1000", "boundary_element"],
    );
    assert_eq!(faults(&meshed("boundary_element", 50, 100)), []);
    assert_fault(
        &meshed("boundary_element", 1000, 1000),
        "/solver/mesh",
        &["MiB", "2048 MiB"],
    );
    assert_fault(
        &meshed("boundary_element", 1001, 1),
        "/solver/mesh/strips",
        &["1001", "1000"],
    );
}

#[test]
fn memory_estimates_grow_with_mesh_and_motions() {
    let cost = |strips: u32, motions: u32| {
        let mut case = good_with(
            "/solver",
            json!({ "mesh": { "strips": strips, "cells": 20 } }),
        );
        case["motion"] =
            json!({ "sweep": { "creepage_x": { "from": 0, "to": 1, "points": motions } } });
        problem(&case).cost()
    };
    let (small, large, many) = (cost(10, 2), cost(40, 2), cost(10, 200));
    assert!(large.bytes > 7 * small.bytes && large.seconds > 10.0 * small.seconds);
    assert!(many.bytes > small.bytes && many.seconds > 50.0 * small.seconds);
    // 10 × 20 cells: three kernels of N² doubles take 0.96 MB, of which mirror symmetry leaves half. The kernels of the coarser meshes take a third
    // of it.
    assert!(
        (960_000..2_600_000).contains(&small.bytes),
        "{}",
        small.bytes
    );
}

#[test]
fn absurd_contacts_are_refused_by_what_comes_out() {
    let ellipse = |a: f64, b: f64, load: Value| {
        with(
            &good_with(
                "/contact",
                json!({ "type": "ellipse", "a_mm": a, "b_mm": b }),
            ),
            "/load",
            Some(load),
        )
    };
    assert_eq!(
        faults(&ellipse(6.0, 4.0, json!({ "approach_mm": 0.1 }))),
        []
    );
    assert_fault(
        &ellipse(1e6, 1e-6, json!({ "normal_force_n": 1 })),
        "/contact",
        &["ratio"],
    );
    assert_fault(
        &ellipse(1e-4, 1e-4, json!({ "normal_force_n": 1e12 })),
        "/load",
        &["MPa"],
    );
    assert_fault(
        &ellipse(1e-300, 1e-300, json!({ "normal_force_n": 1e12 })),
        "/contact",
        &["semi-axes"],
    );
}

#[test]
fn the_digest_names_the_answer_and_nothing_else() {
    let digest = |case: &Value| problem(case).label.digest;
    let base = digest(&good());
    assert_eq!(base.len(), 64);
    assert_eq!(digest(&good_with("/name", json!("other"))), base);
    assert_eq!(digest(&with(&good(), "/labels", None)), base);
    assert_eq!(digest(&good_with("/motion/creepage_y", json!(-0.0))), base);
    assert_eq!(digest(&with(&good(), "/motion/creepage_y", None)), base);
    assert_eq!(
        digest(&good_with(
            "/outputs",
            json!(["zones", "tractions", "resultants", "zones"])
        )),
        base
    );
    let list = json!([{ "creepage_x": 0.001, "spin_per_mm": 0.0004 }]);
    assert_eq!(digest(&good_with("/motion", list)), base);
    for (pointer, value) in [
        ("/material/poisson_ratio", json!(0.280_000_000_1)),
        ("/friction/coefficient", json!(0.31)),
        ("/contact/rolling_mm", json!(461)),
        ("/load/normal_force_n", json!(100_001)),
        ("/motion/spin_per_mm", json!(0.0005)),
        ("/solver/target_error", json!(0.01)),
        ("/solver/method", json!("liu_hsu")),
        ("/outputs", json!(["resultants"])),
    ] {
        assert_ne!(digest(&good_with(pointer, value)), base, "{pointer}");
    }
}

#[test]
fn limits_are_checked_beside_faults_of_the_text() {
    let mut case = good_with("/friction/coefficient", json!(-1));
    case["motion"] = json!({ "sweep": { "creepage_x": { "from": 0, "to": 1, "points": 20_000 } } });
    case["material"] = json!({
        "lower": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "upper": { "shear_modulus_mpa": 23000, "poisson_ratio": 0.31 }
    });
    case["solver"] = json!({ "method": "liu_hsu", "mesh": { "strips": 40, "cells": 40 } });
    let pointers: Vec<String> = faults(&case)
        .into_iter()
        .map(|fault| fault.pointer)
        .collect();
    assert_eq!(
        pointers,
        [
            "/friction/coefficient",
            "/material",
            "/motion",
            "/solver/mesh"
        ]
    );
}

#[test]
fn patches_too_long_for_the_fast_solver_are_refused_and_wide_ones_solved() {
    let ellipse = |a: f64, b: f64, solver: Value| {
        let contact = json!({ "type": "ellipse", "a_mm": a, "b_mm": b });
        with(&good_with("/contact", contact), "/solver", Some(solver))
    };
    let target = || json!({ "target_error": 0.005 });
    for (a, b) in [(10.0, 0.1), (10.0, 0.01)] {
        assert_fault(
            &ellipse(a, b, target()),
            "/contact",
            &["times as long", "60"],
        );
        let mesh = json!({ "method": "boundary_element", "mesh": { "strips": 8, "cells": 20 } });
        assert_fault(&ellipse(a, b, mesh), "/contact", &["times as long", "60"]);
        assert_eq!(faults(&ellipse(a, b, json!({ "method": "fastsim" }))), []);
    }
    assert_eq!(faults(&ellipse(10.0, 0.2, target())), []);
    for (a, b) in [(0.1, 10.0), (0.01, 10.0)] {
        let (solution, _) = crate::reference::solve(&ellipse(a, b, target()));
        let iterations = solution.patches[0].points[0].solver.iterations;
        assert!(iterations < 200, "b/a {}: {iterations} iterations", b / a);
    }
}

#[test]
fn a_rough_gap_is_expected_to_cost_more_than_a_smooth_one() {
    let seconds = |amplitude: f64| {
        let y: Vec<f64> = (0..1000).map(|k| -12.0 + 0.024 * f64::from(k)).collect();
        let tooth = |(k, y): (usize, &f64)| y * y / 600.0 + amplitude * (k % 2) as f64;
        let gap: Vec<f64> = y.iter().enumerate().map(tooth).collect();
        let contact = json!({ "type": "gap_profile", "rolling_mm": 460, "y_mm": y, "gap_mm": gap });
        problem(&good_with("/contact", contact)).cost().seconds
    };
    assert!(seconds(0.01) > 50.0 * seconds(0.0));
    assert!(seconds(0.0001) < 2.0 * seconds(0.0));
}
