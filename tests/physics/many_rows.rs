//! Tests that each of many rows is answered as a separate case, independently of the other rows.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use railhead_contact as contact;
use railhead_contact::case::rail_pair::KnownPair;
use railhead_contact::case::solver::Limits;
use railhead_contact::evaluate::answer::{RowStatus, RowsAnswer};
use railhead_contact::evaluate::many::{ManyTask, RowSolver, solve_many};
use railhead_contact::evaluate::varied::{Values, VariedColumn, case_of_row};
use railhead_contact::monitor::Unmonitored;
use railhead_contact::rolling::operator_store::OperatorStore;
use serde_json::{Value, json};

use crate::gap_samples::steel;
use crate::profile_assessment::on_rail;
use crate::profile_cases::generated;
use crate::profile_shapes::rail_60e1;

pub fn case(method: &str) -> Value {
    let contact = json!({ "type": "radii", "rolling_mm": 460.0, "lateral_mm": 300.0 });
    let load = json!({ "normal_force_n": 8e4 });
    let mut case = steel(contact, load, [1e-3, -5e-4, 2e-4]);
    case["solver"] = json!({ "method": method, "target_error": 0.004 });
    case["outputs"] = json!(["resultants", "zones"]);
    case
}

pub fn numbers(pointer: &str, values: &[f64]) -> VariedColumn {
    VariedColumn {
        pointer: pointer.to_owned(),
        values: Values::Numbers(values.to_vec()),
    }
}

pub fn solved(case: &Value, columns: &[VariedColumn]) -> RowsAnswer {
    let operators = Arc::new(OperatorStore::default());
    solved_by(case, columns, &|checked, monitor| {
        contact::solve_with(&operators, checked, monitor).map(|(solution, _)| solution)
    })
}

fn solved_by(case: &Value, columns: &[VariedColumn], solve: &RowSolver) -> RowsAnswer {
    let task = ManyTask {
        case,
        columns,
        profiles: &BTreeMap::new(),
        known: &KnownPair::default(),
        limits: &Limits::default(),
        time_limit: Duration::from_secs(60),
    };
    solve_many(&task, solve, &Unmonitored).expect("never stopped")
}

/// Returns the numbers of a row as bits. Equal bits mean the same answer.
pub fn bits(answer: &RowsAnswer, row: usize) -> Vec<u64> {
    answer
        .numbers
        .iter()
        .map(|(_, column)| column[row].to_bits())
        .collect()
}

/// Returns a column of an answer.
pub fn column<'a>(answer: &'a RowsAnswer, name: &str) -> &'a [f64] {
    answer.column(name)
}

fn columns() -> Vec<VariedColumn> {
    vec![
        numbers("/load/normal_force_n", &[8e4, 3e4, 8e4, 1.2e5, 3e4, 8e4]),
        numbers("/motion/spin_per_mm", &[3e-4, -1e-3, 0.0, 1e-5, 2e-4, 3e-4]),
        numbers("/friction/coefficient", &[0.3, 0.1, 0.5, 0.4, 0.3, 0.3]),
    ]
}

#[test]
fn a_row_of_many_is_the_case_solved_alone_to_the_last_bit() {
    let (case, columns) = (case("boundary_element"), columns());
    let answer = solved(&case, &columns);
    for row in [1, 3] {
        let single =
            case_of_row(&case, &columns, &BTreeMap::new(), row).expect("it leads somewhere");
        let checked = contact::check(&single, &Limits::default()).expect("a sound case");
        let (alone, _) = contact::solve(&checked, &Unmonitored).expect("it is solved");
        let force = [answer.numbers[1].1[row], answer.numbers[2].1[row]];
        assert_eq!(force, [alone.total[0].force_x_n, alone.total[0].force_y_n]);
        let point = &alone.patches[0].points[0];
        let stick = point.stick_area_mm2.expect("zones") / alone.patches[0].area_mm2;
        assert_eq!(answer.numbers[7].1[row], stick);
        assert_eq!(answer.numbers[6].1[row], point.friction_power_n);
    }
}

#[test]
fn neither_order_nor_neighbours_change_a_row() {
    for method in ["auto", "boundary_element", "fastsim"] {
        let (case, columns) = (case(method), columns());
        let whole = solved(&case, &columns);
        let order = [5, 3, 0, 4, 2, 1];
        let turned: Vec<_> = columns
            .iter()
            .map(|column| match &column.values {
                Values::Numbers(values) => numbers(&column.pointer, &order.map(|row| values[row])),
                Values::Texts(_) => unreachable!("numbers"),
            })
            .collect();
        let turned = solved(&case, &turned);
        for (place, row) in order.into_iter().enumerate() {
            assert_eq!(
                bits(&turned, place),
                bits(&whole, row),
                "{method}, row {row}"
            );
            assert_eq!(turned.method(place), whole.method(row));
        }
    }
}

#[test]
fn auto_takes_the_table_where_its_bound_meets_the_target_and_solves_the_rest() {
    let mut case = case("auto");
    let answer = solved(&case, &columns());
    let by_table = |answer: &RowsAnswer| {
        let methods = (0..answer.status.len()).filter_map(|row| answer.method(row));
        methods.filter(|method| method.name() == "table").count()
    };
    assert!(by_table(&answer) > 0);
    assert_eq!(answer.status, [RowStatus::Ok; 6]);
    // The bound of the table never meets this target.
    case["solver"]["target_error"] = json!(0.0005);
    let exact = solved(&case, &columns()[1..]);
    assert_eq!(by_table(&exact), 0);
    assert!(exact.status.iter().all(|status| status.has_answer()));
    let limit = 0.3 * 8e4;
    let error = |name: &str| (column(&answer, name)[0] - column(&exact, name)[0]).abs();
    assert!(error("force_x_n").max(error("force_y_n")) < 0.008 * limit);
}

#[test]
fn a_row_that_cannot_be_solved_has_a_status_and_costs_no_other_row() {
    let case = case("boundary_element");
    let answer = solved(
        &case,
        &[numbers("/contact/rolling_mm", &[460.0, -1.0, 500.0])],
    );
    let refused = [RowStatus::Ok, RowStatus::Refused, RowStatus::Ok];
    assert_eq!(answer.status, refused);
    assert!(answer.numbers[1].1[1].is_nan() && answer.method(1).is_none());
    assert_eq!(answer.without_answer(), 1);
    assert!(
        answer.reason(1).starts_with("/contact/rolling_mm: -1"),
        "{answer:?}"
    );
    assert!(answer.reason(0).is_empty() && answer.reason(2).is_empty());
}

#[test]
fn a_row_on_a_rough_profile_has_the_reason_of_its_refusal() {
    let hole: Vec<_> = rail_60e1()
        .into_iter()
        .filter(|at| at[0].abs() > 25.0)
        .collect();
    let mut case = on_rail(&hole);
    case["outputs"] = json!(["resultants"]);
    let load = numbers("/load/vertical_force_n", &[7.5e4]);
    let answer = solved(&case, &[load]);
    assert_eq!(answer.status, [RowStatus::Unsolvable]);
    assert!(answer.reason(0).contains("/contact/rail"), "{answer:?}");
}

#[test]
fn a_row_whose_profiles_were_read_for_another_one_is_the_case_solved_alone() {
    let mut case = generated();
    case["solver"] = json!({ "target_error": 0.02 });
    case["outputs"] = json!(["resultants"]);
    let columns = [
        numbers("/contact/cant_rad", &[0.025, 0.05, 0.025, 0.025]),
        numbers("/contact/rail/smoothing_mm", &[0.0, 0.0, 0.0, 4.0]),
        numbers("/contact/lateral_shift_mm", &[0.5, 0.5, -2.0, 0.5]),
        numbers("/contact/yaw_rad", &[0.0, 0.0, 0.006, 0.0]),
    ];
    let answer = solved(&case, &columns);
    let mut forces = Vec::new();
    for row in 0..4 {
        let single = case_of_row(&case, &columns, &BTreeMap::new(), row).expect("a place in it");
        let checked = contact::check(&single, &Limits::default()).expect("a sound case");
        let (alone, _) = contact::solve(&checked, &Unmonitored).expect("it is solved");
        let [total] = &alone.total[..] else {
            panic!("one motion")
        };
        let found = [answer.numbers[1].1[row], answer.numbers[2].1[row]];
        assert_eq!(found, [total.force_x_n, total.force_y_n], "row {row}");
        forces.push(found);
    }
    // Different rows have different answers.
    assert!((1..4).all(|row| forces[row] != forces[0]), "{forces:?}");
}
