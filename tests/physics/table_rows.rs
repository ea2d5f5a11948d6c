//! Tests of rows of numbers: they have the answers of jobs, and report rows that have no answer.

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::evaluate::answer::{RowStatus, RowsAnswer};
use railhead_contact::evaluate::rows::Rows;
use railhead_contact::evaluate::varied::{Values, VariedColumn};
use serde_json::{Value, json};

use crate::gap_samples::steel;
use crate::reference::solve;

/// Returns the case of a template, and the answer to its rows with these columns.
fn rows(method: &str, contact: Value, columns: &[(&str, Vec<f64>)]) -> (Value, Option<RowsAnswer>) {
    let mut case = steel(
        contact,
        json!({ "normal_force_n": 8e4 }),
        [1e-3, -5e-4, 2e-4],
    );
    case["solver"] = json!({ "method": method });
    case["outputs"] = json!(["resultants"]);
    for (pointer, values) in columns {
        if let Some(place) = case.pointer_mut(pointer) {
            *place = json!(values[0]);
        }
    }
    let checked = contact::check(&case, &Limits::default()).expect("a sound case");
    let columns = columns.iter().map(|(pointer, values)| VariedColumn {
        pointer: (*pointer).to_owned(),
        values: Values::Numbers(values.clone()),
    });
    let columns: Vec<VariedColumn> = columns.collect();
    let rows = Rows::new(&case, &checked, &columns);
    let answer = rows.map(|rows| rows.evaluate());
    (case, answer)
}

#[test]
fn rows_of_a_list_or_a_sweep_of_one_motion_are_left_to_cases() {
    let contact = json!({ "type": "radii", "rolling_mm": 460.0, "lateral_mm": 300.0 });
    let columns = [VariedColumn {
        pointer: "/load/normal_force_n".to_owned(),
        values: Values::Numbers(vec![8e4, 9e4]),
    }];
    let one = json!({ "creepage_x": 1e-3 });
    for (motion, by_row) in [
        (one.clone(), true),
        (json!([one]), false),
        (json!({ "sweep": one }), false),
    ] {
        let mut case = steel(contact.clone(), json!({ "normal_force_n": 8e4 }), [0.0; 3]);
        case["motion"] = motion;
        case["solver"] = json!({ "method": "table" });
        case["outputs"] = json!(["resultants"]);
        let checked = contact::check(&case, &Limits::default()).expect("a sound case");
        assert_eq!(Rows::new(&case, &checked, &columns).is_some(), by_row);
    }
}

#[test]
fn rows_are_answered_as_jobs_of_the_same_method_are() {
    let columns = [
        ("/load/normal_force_n", vec![8e4, 3e4, 1.2e5, 8e4]),
        ("/contact/lateral_mm", vec![300.0, 90.0, 900.0, 300.0]),
        ("/motion/creepage_x", vec![0.0, 1e-3, -2e-3, 0.0]),
        ("/motion/spin_per_mm", vec![3e-4, -1e-3, 1e-5, 0.0]),
        ("/friction/coefficient", vec![0.3, 0.1, 0.5, 0.0]),
    ];
    let contact = json!({ "type": "radii", "rolling_mm": 460.0, "lateral_mm": 300.0 });
    for method in ["table", "fastsim"] {
        let (case, answer) = rows(method, contact.clone(), &columns);
        let answer = answer.expect("sound rows");
        for row in 0..4 {
            let mut single = case.clone();
            for (pointer, values) in &columns {
                *single.pointer_mut(pointer).expect("a number") = json!(values[row]);
            }
            let (solution, _) = solve(&single);
            let (patch, point) = (&solution.patches[0], &solution.patches[0].points[0]);
            let limit = patch.friction_limit_n.expect("a limit").max(1e-9);
            let c = (patch.area_mm2 / std::f64::consts::PI).sqrt();
            // Coordinates of a job's mesh are rounded to single precision.
            let within = if method == "table" { 0.0 } else { 1e-5 };
            let near = |found: f64, known: f64, unit: f64| (found - known).abs() <= within * unit;
            assert!(
                near(answer.column("force_x_n")[row], point.force_x_n, limit),
                "{method} {row}: {answer:?} {point:?}"
            );
            assert!(
                near(answer.column("force_y_n")[row], point.force_y_n, limit),
                "{method} {row}: {answer:?} {point:?}"
            );
            assert!(
                near(
                    answer.column("moment_z_n_mm")[row],
                    point.moment_z_n_mm,
                    limit * c
                ),
                "{method} {row}"
            );
            assert!(
                near(
                    answer.column("friction_power_n")[row],
                    point.friction_power_n,
                    limit
                ),
                "{method} {row}"
            );
            let stated = point.error_estimate.expect("a bound").force_x_n;
            assert!(
                near(answer.column("error_estimate")[row], stated, limit),
                "{method} {row}"
            );
            let known = [RowStatus::Ok, RowStatus::TargetMissed]
                [usize::from(point.target_met == Some(false))];
            assert_eq!(answer.status[row], known, "{method} {row}");
        }
    }
}

#[test]
fn rows_outside_the_table_say_so_and_columns_of_another_kind_are_left_to_the_solver() {
    let contact = json!({ "type": "ellipse", "a_mm": 5.0, "b_mm": 5.0 });
    let columns = [("/contact/a_mm", vec![5.0, 60.0, 45.0])];
    let (_, answer) = rows("auto", contact.clone(), &columns);
    let answer = answer.expect("sound rows");
    assert_eq!(answer.status[..2], [RowStatus::Ok, RowStatus::NotCovered]);
    assert!(answer.column("force_x_n")[0].is_finite() && answer.column("force_x_n")[1].is_nan());
    for refused in [
        ("/load/normal_force_n", vec![8e4, -1.0, 8e4]),
        ("/motion/speed", vec![1.0, 1.0, 1.0]),
    ] {
        let (_, answer) = rows("table", contact.clone(), &[refused]);
        assert_eq!(answer, None, "left to the solver");
    }
}

#[test]
fn many_rows_are_answered_as_a_few_are() {
    let count = 4200;
    let spread = |low: f64, high: f64, step: f64| -> Vec<f64> {
        let part = |row: usize| (step * row as f64).fract();
        (0..count)
            .map(|row| low + (high - low) * part(row))
            .collect()
    };
    let mut columns = vec![
        ("/load/normal_force_n", spread(2e4, 1.2e5, 0.618)),
        ("/contact/lateral_mm", spread(60.0, 3000.0, 0.731)),
        ("/motion/creepage_x", spread(-4e-3, 4e-3, 0.414)),
        ("/motion/spin_per_mm", spread(-1e-3, 1e-3, 0.236)),
        ("/friction/coefficient", spread(0.05, 0.5, 0.317)),
    ];
    let contact = json!({ "type": "radii", "rolling_mm": 460.0, "lateral_mm": 300.0 });
    for varies_material in [false, true] {
        if varies_material {
            columns.push(("/material/poisson_ratio", spread(0.0, 0.5, 0.557)));
        }
        let answer = |from: usize, to: usize| {
            let part: Vec<_> = columns
                .iter()
                .map(|(pointer, values)| (*pointer, values[from..to].to_vec()))
                .collect();
            rows("table", contact.clone(), &part).1.expect("sound rows")
        };
        let whole = answer(0, count);
        let halves = [answer(0, count / 2), answer(count / 2, count)];
        for row in 0..count {
            let half = &halves[row / (count / 2)];
            let at = row % (count / 2);
            let of = |answer: &RowsAnswer, row: usize| {
                [
                    answer.column("force_x_n")[row],
                    answer.column("force_y_n")[row],
                    answer.column("stick_share")[row],
                    answer.column("error_estimate")[row],
                ]
            };
            assert_eq!(of(&whole, row), of(half, at), "{row}");
            assert_eq!(whole.status[row], half.status[at], "{row}");
        }
    }
}
