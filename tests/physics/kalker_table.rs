//! Tests that the embedded table of Kalker's coefficients has the values of the fast solver without slip.
//!
//! `cargo test --test physics kalker_table -- --ignored --nocapture` recomputes the whole table, compares it, and prints it in the form of
//! `src/contact/rolling/linear_theory.rs`.

use serde_json::json;

use crate::reference::{Ellipse, assert_none, solve};
use railhead_contact::rolling::linear_theory::{POISSON_RATIOS, RATIOS, coefficients, ratio};

/// Returns C11, C22 and C23 of an ellipse, extrapolated from two meshes to vanishing cells. C23 is the mean of the effect of spin on the lateral
/// force and of lateral creepage on the moment.
fn computed(a_over_b: f64, poisson_ratio: f64) -> [f64; 3] {
    const FINENESS: [f64; 2] = [2.0, 3.0];
    let [coarse, fine] = FINENESS.map(|fineness| on_one_mesh(a_over_b, poisson_ratio, fineness));
    let share = 1.0 / ((FINENESS[1] / FINENESS[0]).powi(2) - 1.0);
    [0, 1, 2].map(|k| fine[k] + share * (fine[k] - coarse[k]))
}

fn on_one_mesh(a_over_b: f64, poisson_ratio: f64, fineness: f64) -> [f64; 3] {
    let steel = Ellipse::steel(a_over_b, poisson_ratio);
    let strips = 2.0 * (6.0 * fineness * a_over_b.powf(-0.2)).round();
    let cells = (14.0 * fineness * a_over_b.powf(0.2)).round();
    let mut case = steel.case(strips as u32, cells as u32);
    let motions = [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-6]]
        .map(|[x, y, spin]| steel.normalised(x, y, spin).motion);
    let named =
        |[x, y, spin]: [f64; 3]| json!({ "creepage_x": x, "creepage_y": y, "spin_per_mm": spin });
    case["motion"] = json!(motions.map(named));
    case["outputs"] = json!(["resultants"]);
    let points = &solve(&case).0.patches[0].points;
    let (c, g) = (steel.c(), steel.shear_modulus_mpa);
    let unit = g * c * c;
    let spin = motions[2][2] * c;
    let c23 = points[2].force_y_n / (unit * spin);
    let c32 = -points[1].moment_z_n_mm / (unit * c * motions[1][1]);
    [
        points[0].force_x_n / (unit * motions[0][0]),
        points[1].force_y_n / (unit * motions[1][1]),
        0.5 * (c23 + c32),
    ]
}

fn differences(ratios: &[f64], poisson_ratios: &[f64], allowed: f64) -> Vec<String> {
    let mut failures = Vec::new();
    for &a_over_b in ratios {
        for &nu in poisson_ratios {
            let (here, table) = (computed(a_over_b, nu), coefficients(a_over_b, nu));
            for ((name, here), table) in ["C11", "C22", "C23"].iter().zip(here).zip(table) {
                let off = table / here - 1.0;
                if off.abs() > allowed {
                    failures.push(format!(
                        "a/b {a_over_b:.4}, ν {nu}: {name} {table:.5} in the table, {here:.5} computed: {:+.3} %",
                        100.0 * off
                    ));
                }
            }
        }
    }
    failures
}

/// Compares a few entries. With `RAILHEAD_KALKER=all`, computes and prints the whole table of 105 ellipses, which takes minutes.
#[test]
fn the_table_holds_what_the_fast_solver_gives_without_slip() {
    let all = std::env::var_os("RAILHEAD_KALKER").is_some_and(|wish| wish == "all");
    let ratios: Vec<f64> = match all {
        true => (0..RATIOS).map(ratio).collect(),
        false => vec![ratio(4), 1.0, ratio(15)],
    };
    if all {
        print(&ratios);
        assert_none("entries", &differences(&ratios, &POISSON_RATIOS, 1e-4));
    } else {
        assert_none("entries", &differences(&ratios, &[0.0, 0.25, 0.5], 1e-4));
    }
}

#[test]
fn between_its_entries_the_table_is_interpolated_to_one_part_in_a_thousand() {
    let failures = differences(&[0.15, 0.6, 1.2, 5.0], &[0.05, 0.3, 0.45], 1e-3);
    assert_none("values between", &failures);
}

/// Prints the table in the form of its source.
fn print(ratios: &[f64]) {
    for ratio in ratios {
        println!("    [");
        let columns = POISSON_RATIOS.map(|nu| computed(*ratio, nu));
        for coefficient in 0..3 {
            let values = columns.map(|column| format!("{:.5}", column[coefficient]));
            println!("        [{}],", values.join(", "));
        }
        println!("    ],");
    }
}
