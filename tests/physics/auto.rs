//! Tests that `auto` takes the resultants of ellipses from the creep table where its bound meets the target. The resultants are the same on every
//! route, with and without values per cell, and within the errors of `boundary_element`.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use railhead_contact as contact;
use railhead_contact::case::rail_pair::KnownPair;
use railhead_contact::case::solver::Limits;
use railhead_contact::case::words::solver::MethodName;
use railhead_contact::evaluate::many::{ManyTask, evaluate_at_once};
use railhead_contact::monitor::{Monitor, Unmonitored};
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::rolling::operator_store::OperatorStore;
use railhead_contact::solution::words::answer::{PointSolution, Solution};
use serde_json::{Value, json};

use crate::many_rows::{column, numbers, solved};
use crate::random::Random;
use crate::reference::{assert_none, force_of_cells, solve, solve_on_meshes};

const CONTACTS: usize = 40;
const TARGET: f64 = 0.005;

/// Returns a random ellipse, given by radii or semi-axes, with a motion from stick to nearly full slip.
fn random_case(random: &mut Random) -> Value {
    let by_radii = random.between(0.0, 1.0) < 0.5;
    let ratio = random.between(-1.5, 1.5).exp();
    let contact = match by_radii {
        true => {
            json!({ "type": "radii", "rolling_mm": 400.0 * ratio, "lateral_mm": 400.0 / ratio })
        }
        false => json!({ "type": "ellipse", "a_mm": 5.0 * ratio, "b_mm": 5.0 / ratio }),
    };
    let mut creepage = || random.between(-1.0, 1.0).powi(3) * 0.006;
    let [x, y, spin] = [creepage(), creepage(), creepage() / 5.0];
    let material = match by_radii {
        true => json!({ "shear_modulus_mpa": 82e3, "poisson_ratio": random.between(0.0, 0.5) }),
        false => json!({ "young_modulus_mpa": 21e4, "poisson_ratio": random.between(0.2, 0.4) }),
    };
    json!({
        "material": material,
        "friction": { "coefficient": random.between(0.05, 0.6), "reduction": random.between(0.3, 1.0) },
        "contact": contact,
        "load": { "normal_force_n": random.between(2e4, 1.2e5) },
        "motion": { "creepage_x": x, "creepage_y": y, "spin_per_mm": spin },
        "solver": { "method": "auto", "target_error": TARGET },
        "outputs": ["resultants", "gradients"],
    })
}

fn random_cases(seed: u64) -> Vec<Value> {
    let mut random = Random(seed);
    (0..CONTACTS).map(|_| random_case(&mut random)).collect()
}

fn with_outputs(case: &Value, outputs: &[&str]) -> Value {
    let mut case = case.clone();
    case["outputs"] = json!(outputs);
    case
}

fn only(solution: &Solution) -> &PointSolution {
    &solution.patches[0].points[0]
}

/// Returns the bits of forces, moment, power, errors and derivatives.
fn bits(point: &PointSolution) -> Vec<u64> {
    let error = point.error_estimate.expect("an estimate");
    let slopes = point.gradients.as_deref().expect("gradients");
    let by_load = slopes.by_normal_force.expect("a Hertz contact");
    let found = [
        point.force_x_n,
        point.force_y_n,
        point.moment_z_n_mm,
        point.friction_power_n,
        error.force_x_n,
        error.moment_z_n_mm,
    ];
    let slopes = [
        slopes.force_x_n,
        slopes.force_y_n,
        slopes.moment_z_n_mm,
        by_load,
    ];
    let all = found.iter().chain(slopes.as_flattened());
    all.map(|number| number.to_bits()).collect()
}

fn is_by_table(point: &PointSolution) -> bool {
    point.solver.method == MethodName::Table
}

#[test]
fn resultants_do_not_depend_on_outputs() {
    let (mut table, mut meshes) = (0, 0);
    for case in random_cases(1) {
        let (without, _) = solve(&case);
        let outputs = ["resultants", "gradients", "zones", "tractions", "slip"];
        let (with, fields) = solve(&with_outputs(&case, &outputs));
        let (without, point) = (only(&without), only(&with));
        assert_eq!(bits(without), bits(point), "{case}");
        assert!(point.solver.mesh.is_some() && point.traction_max_mpa.is_some());
        if !is_by_table(point) {
            meshes += 1;
            assert!(without.solver.mesh.is_some(), "{case}");
            continue;
        }
        table += 1;
        assert!(without.solver.mesh.is_none() && without.solver.iterations == 0);
        let skipped = &without.solver.skipped;
        assert!(
            skipped.iter().any(|text| text.contains("no mesh")),
            "{skipped:?}"
        );
        let limit = with.patches[0].friction_limit_n.expect("a limit");
        let allowed = point.error_estimate.expect("a bound").force_x_n + TARGET * limit;
        let sums = force_of_cells(&fields, 0);
        for (sum, force) in sums.iter().zip([point.force_x_n, point.force_y_n]) {
            assert!(
                (sum - force).abs() <= allowed,
                "{sum} {force} {allowed} {case}"
            );
        }
    }
    assert!(table > CONTACTS / 2 && meshes > 0, "{table} {meshes}");
}

#[test]
fn alone_in_a_list_as_a_row_and_evaluated_the_resultants_are_the_same() {
    let names = [
        "force_x_n",
        "force_y_n",
        "moment_z_n_mm",
        "error_estimate",
        "friction_power_n",
    ];
    for case in random_cases(2).into_iter().take(CONTACTS / 2) {
        let motion = &case["motion"];
        let of = |name: &str| motion[name].as_f64().expect("a number");
        let [x, spin] = ["creepage_x", "spin_per_mm"].map(of);
        let rows = [[x, spin], [0.3 * x, -spin], [-3.0 * x, 0.0], [0.0, 0.0]];
        let alone = rows.map(|[x, spin]| {
            let mut case = case.clone();
            case["motion"]["creepage_x"] = json!(x);
            case["motion"]["spin_per_mm"] = json!(spin);
            only(&solve(&case).0).clone()
        });
        let mut list = case.clone();
        list["motion"] = rows
            .iter()
            .map(|[x, spin]| json!({ "creepage_x": x, "creepage_y": of("creepage_y"), "spin_per_mm": spin }))
            .collect();
        let list = solve(&with_outputs(&list, &["resultants", "gradients", "zones"])).0;
        for (point, alone) in list.patches[0].points.iter().zip(&alone) {
            assert_eq!(point.solver.method, alone.solver.method, "{case}");
            // On meshes, each motion starts from the solution of another one, so that results agree only to the residual.
            if is_by_table(alone) {
                assert_eq!(bits(point), bits(alone), "{case}");
            }
        }
        let columns = [
            numbers("/motion/creepage_x", &rows.map(|row| row[0])),
            numbers("/motion/spin_per_mm", &rows.map(|row| row[1])),
        ];
        let run = solved(&case, &columns);
        let operators = Arc::new(OperatorStore::default());
        let solve_row = |checked: &CheckedCase, monitor: &dyn Monitor| {
            contact::solve_with(&operators, checked, monitor).map(|(solution, _)| solution)
        };
        let task = ManyTask {
            case: &case,
            columns: &columns,
            profiles: &BTreeMap::new(),
            known: &KnownPair::default(),
            limits: &Limits::default(),
            time_limit: Duration::from_secs(60),
        };
        let checked = contact::check(&case, &Limits::default()).expect("a sound case");
        let step = || Ok::<_, ()>(());
        let evaluated = evaluate_at_once(&task, &checked, &solve_row, &Unmonitored, step);
        let evaluated = evaluated.expect("an answer");
        let evaluated: BTreeMap<_, _> = evaluated.columns().into_iter().collect();
        for (row, point) in alone.iter().enumerate() {
            let slopes = point.gradients.as_deref().expect("gradients");
            let error = point.error_estimate.expect("an estimate").force_x_n;
            let known = [
                point.force_x_n,
                point.force_y_n,
                point.moment_z_n_mm,
                error,
                point.friction_power_n,
            ];
            for (name, known) in names.into_iter().zip(known) {
                assert_eq!(
                    column(&run, name)[row],
                    known,
                    "{name} of row {row}, {case}"
                );
                assert_eq!(evaluated[name][row], known, "{name} of row {row}, {case}");
            }
            let name = "moment_z_n_mm_by_spin_per_mm";
            let known = slopes.moment_z_n_mm[2];
            assert_eq!(column(&run, name)[row], known, "{case}");
            assert_eq!(evaluated[name][row], known, "{case}");
            assert_eq!(run.method(row), Some(point.solver.method), "{case}");
        }
    }
}

#[test]
fn auto_and_boundary_element_agree_within_both_errors() {
    let mut wrong = Vec::new();
    for case in random_cases(3) {
        let case = with_outputs(&case, &["resultants"]);
        let (auto, exact) = (solve(&case).0, solve_on_meshes(&case).0);
        let (auto, exact) = (only(&auto), only(&exact));
        assert_eq!(exact.solver.method, MethodName::BoundaryElement);
        if !is_by_table(auto) {
            assert_eq!(auto.force_x_n.to_bits(), exact.force_x_n.to_bits());
            continue;
        }
        let of = |point: &PointSolution| {
            let error = point.error_estimate.expect("an estimate");
            [
                [point.force_x_n, error.force_x_n],
                [point.force_y_n, error.force_y_n],
                [point.moment_z_n_mm, error.moment_z_n_mm],
            ]
        };
        let pairs = of(auto).into_iter().zip(of(exact));
        if pairs
            .into_iter()
            .any(|([a, da], [b, db])| (a - b).abs() > da + db)
        {
            wrong.push(format!("{:?} {:?} {case}", of(auto), of(exact)));
        }
    }
    assert_none("apart by more than both errors", &wrong);
}

#[test]
fn the_force_is_at_most_the_friction_limit() {
    let mut random = Random(4);
    for mut case in random_cases(4) {
        case["motion"]["creepage_x"] = json!(random.between(-0.05, 0.05));
        let solution = solve(&with_outputs(&case, &["resultants"])).0;
        let (point, patch) = (only(&solution), &solution.patches[0]);
        let limit = patch.friction_limit_n.expect("a limit");
        let force = point.force_x_n.hypot(point.force_y_n);
        assert!(force <= limit * (1.0 + 1e-12), "{force} of {limit}: {case}");
    }
}

#[test]
fn auto_leaves_the_table_where_it_does_not_cover_the_case_or_misses_the_target() {
    let case = || {
        json!({
            "material": { "shear_modulus_mpa": 82e3, "poisson_ratio": 0.28 },
            "friction": { "coefficient": 0.3 },
            "contact": { "type": "ellipse", "a_mm": 6.0, "b_mm": 4.0 },
            "load": { "normal_force_n": 8e4 },
            "motion": { "creepage_x": 5e-4, "creepage_y": 3e-4 },
            "outputs": ["resultants"],
        })
    };
    let method = |case: &Value| only(&solve(case).0).solver.method;
    assert_eq!(method(&case()), MethodName::Table);
    let others = [
        ("/solver", json!({ "mesh": { "strips": 12, "cells": 12 } })),
        ("/solver", json!({ "target_error": 0.0005 })),
        ("/solver", json!({ "method": "boundary_element" })),
        (
            "/contact",
            json!({ "type": "ellipse", "a_mm": 24.0, "b_mm": 2.0 }),
        ),
        ("/motion", json!({ "force_x_n": 1e4, "creepage_y": 3e-4 })),
        (
            "/friction/layer",
            json!({ "shear_modulus_mpa": 1500, "thickness_mm": 0.02 }),
        ),
        (
            "/material",
            json!({
                "lower": { "shear_modulus_mpa": 82e3, "poisson_ratio": 0.28 },
                "upper": { "shear_modulus_mpa": 79e3, "poisson_ratio": 0.28 },
            }),
        ),
    ];
    for (pointer, value) in others {
        let mut case = case();
        let (parent, name) = pointer.rsplit_once('/').expect("a pointer");
        case.pointer_mut(parent).expect("an object")[name] = value;
        assert_eq!(method(&case), MethodName::BoundaryElement, "{case}");
    }
    // The bound meets a target relative to μN, but not a target relative to a force that is a small part of μN.
    let mut small = case();
    small["motion"] = json!({ "creepage_x": 2e-5 });
    assert_eq!(method(&small), MethodName::Table);
    small["solver"] = json!({ "relative_to": "force", "target_error": 0.01 });
    assert_eq!(method(&small), MethodName::BoundaryElement);
}
