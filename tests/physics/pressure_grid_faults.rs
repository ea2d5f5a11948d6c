//! Tests that an unreadable pressure grid is refused with the place of the fault.

use railhead_contact::case::solver::Limits;
use railhead_contact::check;
use serde_json::{Value, json};

use crate::cases::{assert_fault, faults, grid_case, problem, with};

#[test]
fn bad_grids_are_refused_with_their_place() {
    let case = grid_case(
        json!({ "type": "pressure_grid", "x_mm": [0, 1, 2], "y_mm": [0, 1],
        "pressure_mpa": [[0, 1, 0], [0, 2, 0]] }),
    );
    let patches = problem(&case).problem.task.known_patches();
    assert!(patches.is_some_and(|patches| patches.len() == 1));
    let put = |pointer: &str, value: Value| with(&case, pointer, Some(value));
    let pressure = "/contact/pressure_mpa";
    let order = "pressure_mpa[j][i] belongs to (x_mm[i], y_mm[j])";
    assert_fault(
        &put(pressure, json!([[0, 0], [1, 2], [0, 0]])),
        pressure,
        &[order, "transposed", "2 rows of 3"],
    );
    assert_fault(
        &put(pressure, json!([[0, 1, 0]])),
        pressure,
        &[order, "1 rows of 3"],
    );
    assert_fault(
        &put(pressure, json!([[0, 1, 0], [1, 2]])),
        "/contact/pressure_mpa/1",
        &["a row of 2"],
    );
    assert_fault(&put(pressure, json!([])), pressure, &["an empty array"]);
    assert_fault(&put(pressure, json!([0, 1, 0])), pressure, &[order]);
    assert_fault(
        &put("/contact/pressure_mpa/1/1", json!(-2.5)),
        "/contact/pressure_mpa/1/1",
        &["-2.5"],
    );
    assert_fault(
        &put("/contact/pressure_mpa/0/2", json!(null)),
        "/contact/pressure_mpa/0/2",
        &["null"],
    );
    assert_fault(
        &put(pressure, json!([[0, 0, 0], [0, 0, 0]])),
        pressure,
        &["no pressure"],
    );
    assert_fault(
        &put("/contact/x_mm", json!([0, 2, 2])),
        "/contact/x_mm/2",
        &["2 given after 2"],
    );
    assert_fault(
        &put("/contact/x_mm", json!([0, 2, 1])),
        "/contact/x_mm/2",
        &["increase strictly"],
    );
    assert_fault(
        &put("/contact/y_mm/1", json!("b")),
        "/contact/y_mm/1",
        &["\"b\""],
    );
    assert_fault(
        &put("/load", json!({ "normal_force_n": 5 })),
        "/load",
        &["carries its own load"],
    );
    assert_fault(
        &with(&case, "/contact/y_mm", None),
        "/contact/y_mm",
        &["missing"],
    );
}

#[test]
fn many_negative_samples_are_counted_rather_than_listed() {
    let axis: Vec<u32> = (0..100).collect();
    let case = grid_case(json!({ "type": "pressure_grid", "x_mm": axis, "y_mm": axis,
        "pressure_mpa": vec![vec![-1.0; 100]; 100] }));
    let found = faults(&case);
    assert_eq!(found[0].pointer, "/contact/pressure_mpa/0/0");
    assert_eq!(found.len(), 6, "{found:?}");
    assert_eq!(found[5].pointer, "/contact/pressure_mpa");
    assert!(found[5].detail.contains("9995 more"), "{found:?}");
}

#[test]
fn patches_are_limited_in_number() {
    let dots = |n: usize| {
        let axis: Vec<usize> = (0..2 * n).collect();
        let row = |j: usize| {
            (0..2 * n)
                .map(|i| u32::from(i.is_multiple_of(2) && j.is_multiple_of(2)))
                .collect::<Vec<u32>>()
        };
        let rows: Vec<Vec<u32>> = (0..2 * n).map(row).collect();
        grid_case(
            json!({ "type": "pressure_grid", "x_mm": axis, "y_mm": axis, "pressure_mpa": rows }),
        )
    };
    let limits = Limits {
        memory_bytes: u64::MAX,
        ..Default::default()
    };
    let checked = check(&dots(8), &limits).unwrap();
    let patches = checked.problem.task.known_patches().unwrap();
    assert_eq!(patches.len(), 64);
    assert_fault(
        &dots(9),
        "/contact/pressure_mpa",
        &["81 separate patches", "64"],
    );
}

#[test]
fn absurd_grids_are_refused() {
    let grid = |x: [f64; 3], y: [f64; 3], pressure: f64| {
        let rows = [[0.0; 3], [0.0, pressure, 0.0], [0.0; 3]];
        grid_case(json!({ "type": "pressure_grid", "x_mm": x, "y_mm": y, "pressure_mpa": rows }))
    };
    let unit = [-1.0, 0.0, 1.0];
    assert_eq!(faults(&grid(unit, unit, 1.0)), []);
    assert_fault(
        &grid(unit, unit, 1e-30),
        "/contact/pressure_mpa",
        &["1e-20"],
    );
    assert_fault(
        &grid(unit.map(|x| 1e-10 * x), unit, 1.0),
        "/contact",
        &["semi-axes"],
    );
    assert_fault(
        &grid(unit.map(|x| 1e5 * x), unit, 1.0),
        "/contact",
        &["ratio"],
    );
    // Coordinates so far from 0 that their differences have no significant digits.
    assert_fault(
        &grid([524_287.999_999_999_9, 524_288.0, 524_289.0], unit, 1.0),
        "/contact/x_mm/1",
        &["increase strictly"],
    );
    assert_fault(
        &grid([0.0, 1e-10, 1.0], unit, 1.0),
        "/contact/x_mm/1",
        &["1e-9"],
    );
}
