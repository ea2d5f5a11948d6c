//! Tests partial slip on ellipses against converged results of an independent program.

use crate::reference::{Converged, HERTZ_CLASSES, ReferenceCase, assert_none, cases, median};

fn all() -> Vec<ReferenceCase> {
    HERTZ_CLASSES
        .iter()
        .flat_map(|class| cases(class))
        .collect()
}

fn errors(case: &ReferenceCase, n: u32) -> [f64; 3] {
    let forces = case.ellipse().forces(n, n);
    let converged = case.converged();
    [0, 1, 2].map(|k| (forces[k] - converged[k].value).abs())
}

fn assert_class_within_one_percent(class: &str, count: usize) {
    let cases = cases(class);
    assert_eq!(cases.len(), count);
    let mut failures = Vec::new();
    for case in &cases {
        let long_with_spin = case.a_over_b() > 4.9 && case.spin_per_mm != 0.0;
        let allowed = if long_with_spin { 0.03 } else { 0.01 };
        for (k, error) in errors(case, 16).into_iter().enumerate() {
            let Converged { value, unc } = case.converged()[k];
            if error > allowed + unc {
                let name = ["F_x", "F_y", "M_z"][k];
                failures.push(format!(
                    "{} {name}: off by {error:.5} of {value:.5} ± {unc:.5}, {allowed} is allowed",
                    case.id
                ));
            }
        }
    }
    assert_none(
        &format!("{class}: too far from the converged value at 16 x 16 cells"),
        &failures,
    );
}

#[test]
fn longitudinal_creepage_agrees_within_one_percent() {
    assert_class_within_one_percent("hertz_long", 13);
}

#[test]
fn lateral_creepage_agrees_within_one_percent() {
    assert_class_within_one_percent("hertz_lat", 7);
}

#[test]
fn spin_agrees_within_one_percent() {
    assert_class_within_one_percent("hertz_spin", 21);
}

#[test]
fn longitudinal_creepage_with_spin_agrees_within_one_percent() {
    assert_class_within_one_percent("hertz_longspin", 15);
}

#[test]
fn both_creepages_with_spin_agree_within_one_percent() {
    assert_class_within_one_percent("hertz_xyspin", 6);
}

#[test]
fn median_error_falls_with_the_mesh() {
    let cases = all();
    assert_eq!(cases.len(), 62);
    let median_of = |n| {
        median(
            &cases
                .iter()
                .map(|case| errors(case, n).into_iter().fold(0.0, f64::max))
                .collect::<Vec<_>>(),
        )
    };
    let [coarse, middle, fine] = [8, 16, 32].map(median_of);
    println!(
        "median of the largest error: {coarse:.5} at 8x8, {middle:.5} at 16x16, {fine:.5} at 32x32"
    );
    assert!(
        coarse >= 3.0 * middle,
        "8x8 to 16x16: {coarse:.5} to {middle:.5}"
    );
    assert!(
        middle >= 2.0 * fine,
        "16x16 to 32x32: {middle:.5} to {fine:.5}"
    );
}
