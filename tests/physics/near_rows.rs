//! Rows that start from rows like them: their answers are those of their cases alone, within what either is off by, for less work.

use railhead::contact;
use railhead::contact::case::limits::Limits;
use railhead::contact::evaluate::many::solve::own_bytes;
use railhead::contact::evaluate::many::task::RowStarts;
use railhead::contact::evaluate::many_answer::{ManyAnswer, ManyStatus};
use railhead::contact::evaluate::varied::VariedColumn;
use serde_json::{Value, json};

use crate::gap_samples::{profile, spread, steel};
use crate::many_rows::{bits, case, column, numbers, solved_by, solved_from};

/// Rows as a simulation writes them, step by step.
fn steps(rows: usize, step: f64) -> Vec<VariedColumn> {
    let of = |value: fn(f64) -> f64| -> Vec<f64> {
        (0..rows).map(|row| value(step * row as f64)).collect()
    };
    vec![
        numbers("/load/normal_force_n", &of(|t| 8e4 + 2e4 * (0.9 * t).sin())),
        numbers(
            "/friction/coefficient",
            &of(|t| 0.3 + 0.05 * (0.2 * t).cos()),
        ),
        numbers("/motion/creepage_x", &of(|t| 1.5e-3 * (0.31 * t).sin())),
        numbers("/motion/creepage_y", &of(|t| 2e-3 * (0.47 * t + 1.0).sin())),
        numbers(
            "/motion/spin_per_mm",
            &of(|t| 4e-4 + 3e-4 * (0.2 * t).sin()),
        ),
    ]
}

fn both(case: &Value, columns: &[VariedColumn]) -> [ManyAnswer; 2] {
    [RowStarts::Own, RowStarts::Neighbours].map(|starts| solved_from(case, columns, starts))
}

/// Every number but the iterations agrees to `share` of the largest in its column.
fn assert_same([own, near]: &[ManyAnswer; 2], share: f64) {
    assert_eq!(own.status, near.status);
    assert_eq!(own.method, near.method);
    for (name, pair) in own
        .columns
        .names()
        .iter()
        .zip(own.numbers.iter().zip(&near.numbers))
    {
        if *name == "iterations" {
            continue;
        }
        let largest = pair
            .0
            .iter()
            .fold(0.0, |most: f64, number| most.max(number.abs()));
        for (row, (own, near)) in pair.0.iter().zip(pair.1).enumerate() {
            assert!(
                (own - near).abs() <= share * largest || own.is_nan() && near.is_nan(),
                "{name} of row {row}: {own} alone, {near} from its neighbours"
            );
        }
    }
}

fn sum(answer: &ManyAnswer, name: &str) -> f64 {
    column(answer, name).iter().sum()
}

#[test]
fn on_a_given_mesh_rows_of_any_load_and_friction_are_those_of_their_cases() {
    let mut case = case("boundary_element");
    case["solver"] = json!({ "method": "boundary_element", "mesh": { "strips": 10, "cells": 14 } });
    let answers = both(&case, &steps(24, 0.5));
    // Similar ellipses have similar meshes, on which the iteration ends at a residual of 1e-6.
    assert_same(&answers, 2e-4);
    assert_ne!(
        bits(&answers[0], 7),
        bits(&answers[1], 7),
        "nothing was shared"
    );
}

#[test]
fn prescribed_forces_of_similar_rows_are_met_and_their_creepages_told() {
    let mut case = case("boundary_element");
    case["solver"] = json!({ "method": "boundary_element", "mesh": { "strips": 10, "cells": 14 } });
    case["motion"] = json!({ "force_x_n": 5000.0, "creepage_y": 0.0005, "spin_per_mm": 0.0002 });
    let columns = [
        numbers("/load/normal_force_n", &[8e4, 6e4, 9e4, 8e4]),
        numbers("/motion/force_x_n", &[5000.0, 4000.0, -7000.0, 5500.0]),
    ];
    let answers = both(&case, &columns);
    assert!(answers[0].columns.names().contains(&"creepage_x"));
    assert!(
        !answers[0].columns.names().contains(&"creepage_y"),
        "it was given"
    );
    for answer in &answers {
        for (found, asked) in column(answer, "force_x_n")
            .iter()
            .zip([5e3, 4e3, -7e3, 5.5e3])
        {
            assert!(
                (found - asked).abs() < 1e-3 * 0.3 * 8e4,
                "{found} N, {asked} N asked for"
            );
        }
        assert!(
            column(answer, "creepage_x")
                .iter()
                .all(|creepage| creepage.abs() > 1e-5)
        );
    }
    assert_same(&answers, 2e-3);
}

#[test]
fn to_a_target_they_take_less_work_and_are_within_both_estimates() {
    for target in [0.02, 0.005] {
        let mut case = case("boundary_element");
        case["solver"]["target_error"] = json!(target);
        let columns = steps(100, 0.05);
        let [own, near] = both(&case, &columns);
        assert_eq!(near.status, [ManyStatus::Ok; 100]);
        let less = sum(&near, "iterations") / sum(&own, "iterations");
        assert!(less < 0.6, "{less} of the iterations at {target}");
        let mut beyond = 0;
        for row in 0..100 {
            let of = |answer: &ManyAnswer, name: &str| column(answer, name)[row];
            let apart = |name: &str| of(&own, name) - of(&near, name);
            let estimates = of(&own, "error_estimate") + of(&near, "error_estimate");
            let largest = apart("force_x_n").abs().max(apart("force_y_n").abs());
            beyond += usize::from(largest > estimates);
        }
        assert!(beyond <= 2, "{beyond} of 100 rows at {target}");
    }
}

#[test]
fn the_same_rows_have_the_same_answers_to_the_last_bit() {
    let case = case("boundary_element");
    let columns = steps(20, 0.4);
    let [first, second] = [0, 1].map(|_| solved_from(&case, &columns, RowStarts::Neighbours));
    assert!((0..20).all(|row| bits(&first, row) == bits(&second, row)));
}

#[test]
fn rows_of_one_gap_share_it_and_rows_of_another_do_not() {
    let contact = profile(460.0, &spread(-12.0, 12.0, 60), |y| {
        y * y / 300.0 + 1e-6 * y.powi(4)
    });
    let mut case = steel(contact, json!({ "normal_force_n": 6e4 }), [1e-3, 0.0, 0.0]);
    case["solver"] = json!({ "method": "boundary_element", "target_error": 0.01 });
    case["outputs"] = json!(["resultants"]);
    let columns = [
        numbers("/load/normal_force_n", &[6e4, 6e4, 6e4, 7e4, 6e4, 7e4]),
        numbers(
            "/motion/creepage_x",
            &[1e-3, 1.1e-3, 9e-4, 1e-3, 1.05e-3, 1.1e-3],
        ),
    ];
    let answers = both(&case, &columns);
    assert_same(&answers, 0.02);
    let normal = column(&answers[1], "normal_force_n");
    assert!(
        normal
            .iter()
            .zip([6e4, 6e4, 6e4, 7e4, 6e4, 7e4])
            .all(|(n, load)| (n / load - 1.0).abs() < 1e-3)
    );
}

#[test]
fn where_rows_have_no_answer_together_each_has_its_own() {
    let case = case("boundary_element");
    let mut columns = steps(9, 0.4);
    columns.push(numbers(
        "/contact/rolling_mm",
        &[460.0, 460.0, -1.0, 460.0, 460.0, 460.0, 460.0, 460.0, 460.0],
    ));
    let alone = solved_from(&case, &columns, RowStarts::Own);
    let answer = solved_by(
        &case,
        &columns,
        RowStarts::Neighbours,
        &|checked, monitor| {
            assert_eq!(checked.problem.motions.len(), 1, "a defect of the solver");
            contact::solve(checked, monitor).map(|(solution, _)| solution)
        },
    );
    assert_eq!(answer.status[2], ManyStatus::Refused);
    assert_eq!(answer.without_answer(), 1);
    assert!(
        (0..9)
            .filter(|row| *row != 2)
            .all(|row| bits(&alone, row) == bits(&answer, row))
    );
}

#[test]
fn rows_that_are_solved_together_are_counted_with_their_memory() {
    let case = case("boundary_element");
    let checked = contact::check(&case, &Limits::default()).expect("a sound case");
    let [alone, together] =
        [RowStarts::Own, RowStarts::Neighbours].map(|starts| own_bytes(&checked, starts));
    assert_eq!(alone, checked.cost().own_bytes());
    assert!(together > alone, "{together} of {alone} bytes");
}
