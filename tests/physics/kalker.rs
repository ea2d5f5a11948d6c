//! Tests the limit of vanishing slip: Kalker's coefficients.
//!
//! F_x = G c² C11 ν_x, F_y = G c² C22 ν_y + G c³ C23 φ, M_z = G c³ C32 ν_y + G c⁴ C33 φ, c = √(ab), C32 = −C23.

use serde::Deserialize;
use serde_json::Value;

use crate::reference::{Ellipse, assert_none, cases, read};

/// Returns the coefficients that one motion determines, with their names.
fn coefficients(contact: &Ellipse, strips: u32, cells: u32) -> Vec<(&'static str, f64)> {
    let forces = contact.forces(strips, cells);
    let [x, y, spin] = contact.motion;
    let (c, g) = (contact.c(), contact.shear_modulus_mpa);
    // Forces are relative to μN, the moment to μN c.
    let unit = contact.limit() / (g * c * c);
    let mut out = Vec::new();
    if x != 0.0 {
        out.push(("C11", forces[0] * unit / x));
    }
    if y != 0.0 {
        out.push(("C22", forces[1] * unit / y));
        out.push(("C32", forces[2] * unit / y));
    }
    if spin != 0.0 {
        out.push(("C23", forces[1] * unit / (spin * c)));
        out.push(("C33", forces[2] * unit / (spin * c)));
    }
    out
}

/// Compares the coefficients `wanted` of the stored linear cases. Returns the number of comparisons and the failures.
fn against_converged(wanted: &[&str]) -> (usize, Vec<String>) {
    let cases = cases("hertz_linear");
    assert_eq!(cases.len(), 60);
    let (mut failures, mut compared) = (Vec::new(), 0);
    for case in &cases {
        let allowed = if (0.3..4.0).contains(&case.a_over_b()) {
            0.01
        } else {
            0.02
        };
        let expected = case
            .kalker
            .as_ref()
            .expect("a linear case carries its coefficients");
        for (name, value) in coefficients(&case.ellipse(), 16, 16) {
            if !wanted.contains(&name) {
                continue;
            }
            let number = |key: &str| {
                expected[name]
                    .get(key)
                    .and_then(Value::as_f64)
                    .expect("value and uncertainty")
            };
            let (reference, unc) = (number("value"), number("unc"));
            // CONTACT's C33 lies 0.7 to 1.1 % below the recomputed table at a/b of a half and a fifth.
            let low = name == "C33" && case.a_over_b() < 0.6;
            let allowed = if low { allowed + 0.011 } else { allowed };
            compared += 1;
            if (value - reference).abs() > allowed * reference.abs() + unc {
                let off = 100.0 * (value / reference - 1.0);
                failures.push(format!(
                    "{} {name}: {value:.5}, reference {reference:.5} ± {unc:.5}: {off:+.2} %",
                    case.id
                ));
            }
        }
    }
    (compared, failures)
}

#[test]
fn no_slip_coefficients_agree_with_converged_ones() {
    let (compared, failures) = against_converged(&["C11", "C22", "C23", "C32"]);
    assert_eq!(compared, 80, "four coefficients for each of 20 patches");
    assert_none("coefficients at 16 x 16 cells", &failures);
}

#[test]
fn no_slip_spin_moment_agrees_with_the_converged_one() {
    let (compared, failures) = against_converged(&["C33"]);
    assert_eq!(compared, 20);
    assert_none("C33 at 16 x 16 cells", &failures);
}

#[derive(Deserialize)]
struct Row {
    a_over_b: f64,
    poisson_ratio: f64,
    c11: f64,
    c22: f64,
    c23: f64,
    c33: f64,
}

/// Compares with the table at `strips × cells`. The allowed error is `allowed` for a/b from ½ to 2, and twice that from 0.2 to 5.
fn against_table(
    wanted: &[(&str, f64)],
    ratios: impl Fn(f64) -> bool,
    strips: u32,
    cells: u32,
) -> Vec<String> {
    let rows: Vec<Row> = read("kalker.json");
    let mut failures = Vec::new();
    for row in rows
        .iter()
        .filter(|row| row.a_over_b.max(1.0 / row.a_over_b) < 5.01 && ratios(row.poisson_ratio))
    {
        let factor = if row.a_over_b.max(1.0 / row.a_over_b) < 2.01 {
            1.0
        } else {
            2.0
        };
        let steel = Ellipse::steel(row.a_over_b, row.poisson_ratio);
        for &(name, allowed) in wanted {
            let (reference, contact) = match name {
                "C11" => (row.c11, steel.normalised(1e-6, 0.0, 0.0)),
                "C22" => (row.c22, steel.normalised(0.0, 1e-6, 0.0)),
                "C23" => (row.c23, steel.normalised(0.0, 0.0, 1e-6)),
                "C33" => (row.c33, steel.normalised(0.0, 0.0, 1e-6)),
                other => panic!("no column {other}"),
            };
            let found = coefficients(&contact, strips, cells);
            let value = found
                .iter()
                .find(|(n, _)| *n == name)
                .expect("a coefficient of the motion")
                .1;
            let off = 100.0 * (value / reference - 1.0);
            if off.abs() > 100.0 * factor * allowed {
                failures.push(format!(
                    "a/b {:.3}, ν {}: {name} {value:.5}, table {reference}: {off:+.2} %, {:.1} % is allowed",
                    row.a_over_b, row.poisson_ratio, 100.0 * factor * allowed
                ));
            }
        }
    }
    failures
}

#[test]
fn tiny_creepage_gives_kalkers_coefficients() {
    let wanted = [("C11", 0.006), ("C22", 0.006), ("C23", 0.01)];
    let failures = against_table(&wanted, |_| true, 16, 16);
    assert_none("coefficients at 16 x 16 cells", &failures);
}

#[test]
fn tiny_spin_gives_kalkers_moment_coefficient() {
    let failures = against_table(&[("C33", 0.006)], |nu| nu == 0.25, 16, 16);
    assert_none("C33 at 16 x 16 cells, ν = ¼", &failures);
}

#[test]
fn tiny_spin_gives_kalkers_moment_coefficient_at_the_ends_of_poissons_ratio() {
    // With ν = 0 or ½ sixteen strips leave an error of up to 1.5 % (2.5 % on slender patches). The table's own digits are accurate to 0.5 %.
    let failures = against_table(&[("C33", 0.015)], |nu| nu != 0.25, 16, 16);
    assert_none("C33 at 16 x 16 cells", &failures);
    // The error comes from the strips, not from the cells along them.
    let failures = against_table(&[("C33", 0.006)], |_| true, 64, 16);
    assert_none("C33 with 64 strips of 16 cells", &failures);
}

#[test]
fn longitudinal_and_lateral_stiffness_are_equal_without_poisson_effect() {
    for a_over_b in [0.2, 1.0, 3.0] {
        let steel = Ellipse::steel(a_over_b, 0.0);
        let along = steel.normalised(1e-6, 0.0, 0.0).forces(12, 12)[0];
        let across = steel.normalised(0.0, 1e-6, 0.0).forces(12, 12)[1];
        assert!(
            (along / across - 1.0).abs() < 1e-6,
            "a/b {a_over_b}: {along} {across}"
        );
    }
}

#[test]
fn force_over_creepage_is_constant_far_below_saturation() {
    // Saturation: the creepage at which the linear force reaches μN.
    let steel = Ellipse::steel(1.0, 0.28);
    let mut failures = Vec::new();
    for (name, direction) in [
        ("ν_x", [1.0, 0.0, 0.0]),
        ("ν_y", [0.0, 1.0, 0.0]),
        ("φ", [0.0, 0.0, 1.0]),
    ] {
        let largest = |parts: [f64; 3]| {
            let contact = steel.normalised(parts[0], parts[1], parts[2]);
            let forces = contact.forces(16, 16);
            forces.into_iter().fold(0.0f64, |m, f| m.max(f.abs()))
        };
        let saturation = 1e-6 / largest(direction.map(|d| 1e-6 * d));
        let slope = |part: f64| largest(direction.map(|d| d * saturation * part)) / part;
        let linear = slope(1e-6);
        for exponent in 2..=12 {
            let part = 10f64.powi(-exponent);
            let off = slope(part) / linear - 1.0;
            println!(
                "{name}: at 1e-{exponent} of saturation the force per creepage is off by {off:+.2e}"
            );
            if off.abs() > 1e-3 {
                failures.push(format!("{name} at 1e-{exponent} of saturation: {off:+.2e}"));
            }
        }
    }
    assert_none("force per creepage", &failures);
}
