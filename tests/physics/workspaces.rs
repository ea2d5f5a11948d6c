//! Tests that iterations and products use only the buffers of their workspaces, and that threads can share what they only read.

use std::sync::Arc;

use railhead_contact::case::solver::Limits;
use railhead_contact::half_space::bent_surface::{BentOperator, BentWorkspace};
use railhead_contact::half_space::strip_operator::operator::StripOperator;
use railhead_contact::mesh::MeshSize;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::rolling::methods::boundary_element::newton::Newton;
use railhead_contact::rolling::methods::boundary_element::task::{NewtonTask, STEPS_MAX};
use railhead_contact::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use railhead_contact::rolling::operator_store::{CaseOperators, OperatorStore};
use railhead_contact::rolling::slip_equations::{SlipEquations, SlipScratch};
use railhead_contact::rolling::slip_rules::Rule;
use railhead_contact::rolling::strip_mesh::StripMesh;
use railhead_contact::rolling::task::Motion;
use railhead_contact::{check, normal_stage, solve, solve_with};
use serde_json::{Value, json};

use crate::allocations::during;
use crate::sweeps::timeless;

#[test]
fn operators_equations_meshes_and_stores_are_shared_by_threads() {
    fn shared<T: Send + Sync>() {}
    shared::<BentOperator>();
    shared::<StripOperator>();
    shared::<OperatorStore>();
    shared::<CaseOperators>();
    shared::<SlipEquations>();
    shared::<Newton>();
    shared::<StripMesh>();
    shared::<CheckedCase>();
}

fn case(solver: &Value, motion: &Value) -> CheckedCase {
    let case = json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 100_000 },
        "motion": motion,
        "solver": solver,
        "outputs": ["resultants"],
    });
    check(&case, &Limits::default()).expect("a valid case")
}

/// Calls `work` with the equations of every rule on a mesh of 12 strips and 14 cells, whole and by parity, and with the padded bounds and areas.
fn with_equations(precision_target: f64, work: impl Fn(&SlipEquations, [&[f64]; 2])) {
    let checked = case(
        &json!({ "method": "boundary_element", "target_error": precision_target }),
        &json!({ "creepage_x": 0.001 }),
    );
    let footprint = normal_stage::solve(&checked, &Unmonitored)
        .expect("a contact")
        .footprint;
    let task = checked.rolling_task(&footprint);
    let size = MeshSize {
        strips: 12,
        cells: 14,
    };
    let level = StripMesh::new(&task, size).expect("a mesh");
    let operator = level.operator(&Unmonitored).expect("never stopped");
    for rule in [Rule::Upwind, Rule::ThreePoint, Rule::Trapezoid] {
        let equations = SlipEquations::new(rule, &level.normalised, &operator, None);
        let padded = |mut values: Vec<f64>| {
            values.resize(equations.padded(), 0.0);
            values
        };
        let (bound, area) = (
            padded(level.bound.clone()),
            padded(level.normalised.areas()),
        );
        work(&equations, [&bound, &area]);
    }
}

/// Returns the friction law with these rigid slips, bounds and areas, for a residual of 1e-7.
fn law<'a>(rigid: &'a [f64], [bound, area]: [&'a [f64]; 2]) -> NewtonTask<'a> {
    NewtonTask {
        rigid,
        bound,
        fall: None,
        area,
        scale: 1.0,
        tolerance: 1e-7,
        accepts_start: true,
    }
}

#[test]
fn a_product_allocates_nothing_after_the_first() {
    // The targets select single and double precision.
    for target in [0.005, 0.0002] {
        with_equations(target, |equations, _| {
            let length = 2 * equations.padded();
            let (t, mut slip) = (vec![0.1; length], vec![0.0; length]);
            let mut scratch = SlipScratch::default();
            equations.elastic(&t, &mut slip, &mut scratch);
            let later =
                during(|| (0..5).for_each(|_| equations.elastic(&t, &mut slip, &mut scratch)));
            assert_eq!(later, 0, "{:?}", equations.rule);
        });
    }
    let mut workspace = BentWorkspace::default();
    let operator = BentOperator::flat([30, 20], [0.1; 2], 1e5, &mut workspace);
    let factors = operator.pressure_factors();
    let (pressure, mut gap) = (vec![1.0; 600], vec![0.0; 600]);
    let mut product = || operator.opened_by_pressure(&factors, &pressure, &mut gap, &mut workspace);
    product();
    assert_eq!(during(product), 0, "on a grid");
}

#[test]
fn newton_and_gmres_allocate_nothing_in_a_workspace_that_has_served_before() {
    with_equations(0.005, |equations, [bound, area]| {
        let newton = Newton::new(equations);
        let mut workspace = NewtonWorkspace::default();
        let mut t = vec![0.0; 2 * equations.padded()];
        let mut iterations = [0; 2];
        for (spin, iterations) in [1.5, 0.7].into_iter().zip(&mut iterations) {
            let rigid = equations.rigid(&Motion {
                creepage_x: 0.6,
                creepage_y: 0.4,
                spin_per_mm: spin,
            });
            let law = law(&rigid, [bound, area]);
            let mut solve = || {
                t.fill(0.0);
                let report = newton.solve(&law, &mut t, &mut workspace, &Unmonitored);
                let report = report.expect("never stopped");
                assert!(report.converged, "{report:?}");
                *iterations = report.iterations;
            };
            solve();
            assert_eq!(during(&mut solve), 0, "{:?}", equations.rule);
        }
        // Each solve takes several iterations, in which allocations would be counted.
        assert!(iterations.iter().all(|count| *count > 2), "{iterations:?}");
    });
}

#[test]
fn a_workspace_that_has_served_other_motions_moves_no_answer() {
    with_equations(0.005, |equations, [bound, area]| {
        let newton = Newton::new(equations);
        let solve = |workspace: &mut NewtonWorkspace, steps_max, start: &[f64], creepage_x| {
            let rigid = equations.rigid(&Motion {
                creepage_x,
                creepage_y: 0.2,
                spin_per_mm: 0.3,
            });
            let law = law(&rigid, [bound, area]);
            let mut t = start.to_vec();
            let report = newton.solve(&law, &mut t, workspace, &Unmonitored);
            let report = report.expect("never stopped");
            assert!(report.converged, "{:?}: {report:?}", equations.rule);
            assert!(report.iterations <= steps_max);
            t
        };
        let zero = vec![0.0; 2 * equations.padded()];
        let mut served = NewtonWorkspace::default();
        let first = solve(&mut served, STEPS_MAX, &zero, 0.50);
        // A start nearby needs few steps.
        let near =
            |workspace: &mut NewtonWorkspace, creepage_x| solve(workspace, 8, &first, creepage_x);
        near(&mut served, 0.505);
        let again = near(&mut served, 0.51);
        assert_eq!(again, near(&mut NewtonWorkspace::default(), 0.51));
    });
}

#[test]
fn a_small_solve_allocates_a_bounded_number_of_times() {
    let motion = json!({ "creepage_x": 0.001, "creepage_y": 0.0005, "spin_per_mm": 0.0003 });
    let count = |solver: &Value| {
        let checked = case(solver, &motion);
        during(|| solve(&checked, &Unmonitored))
    };
    // Another thread computes what the process computes once. Its allocations are not counted.
    std::thread::scope(|scope| {
        scope
            .spawn(|| count(&json!({ "method": "boundary_element", "target_error": 0.02 })))
            .join()
    })
    .expect("an answer");
    let on_mesh = count(&json!({ "mesh": { "strips": 8, "cells": 8 } }));
    let to_target = count(&json!({ "method": "boundary_element", "target_error": 0.005 }));
    println!("{on_mesh} allocations on a mesh of the client, {to_target} to the target");
    // Most allocations are for meshes, operators and factors, each made once.
    assert!(on_mesh < 500, "{on_mesh} allocations on one mesh");
    assert!(to_target < 1450, "{to_target} allocations to the target");
}

/// Counts the allocations on the three coarsest meshes, by a worker that has solved similar cases.
#[test]
fn a_small_solve_takes_some_hundred_allocations() {
    let store = Arc::new(OperatorStore::default());
    for motion in [
        json!({ "creepage_x": 0.001, "creepage_y": 0.0005 }),
        json!({ "creepage_x": 0.0005, "creepage_y": 0.0005, "spin_per_mm": 0.0004 }),
    ] {
        let checked = case(
            &json!({ "method": "boundary_element", "target_error": 0.02 }),
            &motion,
        );
        let again = || solve_with(&store, &checked, &Unmonitored).expect("an answer");
        let first = again();
        let count = during(again);
        assert!(count < 450, "{count} allocations: {motion}");
        assert_eq!(timeless(again()).0, timeless(first).0);
    }
}
