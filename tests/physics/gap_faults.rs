//! Tests that a gap without a valid contact is refused, or fails with a reason.

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::check;
use railhead_contact::error::SolveError;
use railhead_contact::monitor::Unmonitored;
use serde_json::{Value, json};

use crate::cases::{assert_fault, faults, good_with, with};
use crate::gap_samples::{grid, profile, spread};

fn crown() -> Value {
    good_with(
        "/contact",
        profile(460.0, &spread(-15.0, 15.0, 31), |y| y * y / 600.0),
    )
}

fn bowl() -> Value {
    let axis = spread(-15.0, 15.0, 31);
    good_with(
        "/contact",
        grid(&axis, &axis[2..29], |x, y| x * x / 920.0 + y * y / 600.0),
    )
}

fn reason(case: &Value) -> String {
    let checked = check(case, &Limits::default()).unwrap_or_else(|e| panic!("{e}"));
    match contact::solve(&checked, &Unmonitored) {
        Err(SolveError::NormalProblem { reason }) => reason,
        other => panic!("{other:?}"),
    }
}

#[test]
fn sound_gaps_are_accepted_without_being_solved() {
    for case in [crown(), bowl()] {
        assert_eq!(faults(&case), []);
        let checked = check(&case, &Limits::default()).unwrap();
        assert!(checked.problem.task.known_patches().is_none() && checked.cost().seconds < 1.0);
    }
}

#[test]
fn bad_profiles_are_refused_with_their_place() {
    let put = |pointer: &str, value: Value| with(&crown(), pointer, Some(value));
    let gap = "/contact/gap_mm";
    assert_fault(
        &put(gap, json!([1, 0, 1])),
        gap,
        &["3 values given", "31", "one gap per y_mm"],
    );
    assert_fault(&put(gap, json!("flat")), gap, &["\"flat\"", "array"]);
    assert_fault(
        &put("/contact/gap_mm/4", json!(null)),
        "/contact/gap_mm/4",
        &["null"],
    );
    assert_fault(
        &put("/contact/gap_mm/4", json!(1e7)),
        "/contact/gap_mm/4",
        &["10000000"],
    );
    assert_fault(
        &put("/contact/y_mm/5", json!(-20)),
        "/contact/y_mm/5",
        &["-20 given after"],
    );
    assert_fault(
        &put("/contact/rolling_mm", json!(0)),
        "/contact/rolling_mm",
        &["0 given"],
    );
    assert_fault(
        &put("/contact/x_mm", json!([0, 1])),
        "/contact/x_mm",
        &["unknown"],
    );
    assert_fault(&with(&crown(), "/load", None), "/load", &["missing"]);
    assert_fault(&with(&crown(), gap, None), gap, &["missing"]);
}

#[test]
fn all_faults_of_a_gap_are_told_at_once() {
    let mut case = crown();
    case["contact"]["rolling_mm"] = json!(-3);
    case["contact"]["gap_mm"][7] = json!("x");
    case["contact"]["y_mm"][9] = json!(true);
    case["load"] = json!({});
    let pointers: Vec<String> = faults(&case).into_iter().map(|f| f.pointer).collect();
    for pointer in [
        "/contact/rolling_mm",
        "/contact/gap_mm/7",
        "/contact/y_mm/9",
        "/load",
    ] {
        assert!(
            pointers.iter().any(|p| p == pointer),
            "{pointer} in {pointers:?}"
        );
    }
}

#[test]
fn a_transposed_grid_is_recognised() {
    let x = spread(-10.0, 10.0, 21);
    let y = spread(-8.0, 8.0, 17);
    let mut contact = grid(&y, &x, |y, x| x * x / 920.0 + y * y / 600.0);
    contact["x_mm"] = json!(x);
    contact["y_mm"] = json!(y);
    assert_fault(
        &good_with("/contact", contact),
        "/contact/gap_mm",
        &[
            "gap_mm[j][i] belongs to (x_mm[i], y_mm[j])",
            "transposed",
            "21 rows of 17",
        ],
    );
}

#[test]
fn gaps_without_a_least_value_inside_are_refused() {
    let y = spread(-15.0, 15.0, 31);
    let refused = |across: &dyn Fn(f64) -> f64, words: &[&str]| {
        let contact = profile(460.0, &y, across);
        assert_fault(&good_with("/contact", contact), "/contact/gap_mm", words);
    };
    refused(&|_| 0.3, &["0.3 mm everywhere"]);
    refused(&|y| 0.1 * y, &["at the edge of the data, at y = -15 mm"]);
    refused(&|y| -y * y, &["at the edge"]);
    let axis = spread(-15.0, 15.0, 31);
    let ramp = grid(&axis, &axis, |x, y| y * y / 600.0 - 0.01 * x);
    assert_fault(
        &good_with("/contact", ramp),
        "/contact/gap_mm",
        &["at the edge of the data, at x = 15 mm"],
    );
}

#[test]
fn an_approach_counts_from_gap_zero_and_has_to_reach_the_least_gap() {
    let with_offset = |offset: f64, approach: f64| {
        let y = spread(-15.0, 15.0, 31);
        let contact = profile(460.0, &y, |y| y * y / 600.0 + offset);
        with(
            &good_with("/contact", contact),
            "/load",
            Some(json!({ "approach_mm": approach })),
        )
    };
    let pointer = "/load/approach_mm";
    assert_fault(&with_offset(0.0, 0.0), pointer, &["do not touch", "0 mm"]);
    assert_fault(
        &with_offset(0.2, 0.15),
        pointer,
        &["do not touch", "0.15 mm", "0.2 mm"],
    );
    assert_fault(&with_offset(-0.2, -0.21), pointer, &["do not touch"]);
    assert_eq!(faults(&with_offset(-0.2, -0.19)), []);
    assert_eq!(faults(&with_offset(0.2, 0.21)), []);
}

#[test]
fn a_contact_that_reaches_the_edge_of_the_data_is_an_error_that_says_where() {
    // The half width of Hertz's ellipse is 5.4 mm.
    let short = |low: f64, high: f64| {
        let y = spread(low, high, 31);
        let contact = profile(460.0, &y, |y| y * y / 600.0);
        reason(&good_with("/contact", contact))
    };
    assert!(
        short(-15.0, 4.0).contains("edge y = 4 mm"),
        "{}",
        short(-15.0, 4.0)
    );
    assert!(short(-5.0, 15.0).contains("edge y = -5 mm"));
    let (x, y) = (spread(-6.0, 15.0, 43), spread(-12.0, 12.0, 49));
    let contact = grid(&x, &y, |x, y| x * x / 920.0 + y * y / 600.0);
    let told = reason(&good_with("/contact", contact));
    assert!(
        told.contains("edge x = -6 mm") && told.contains("cut off"),
        "{told}"
    );
}

#[test]
fn a_contact_just_inside_the_data_is_solved() {
    let y = spread(-5.9, 5.9, 31);
    let contact = profile(460.0, &y, |y| y * y / 600.0);
    let checked = check(&good_with("/contact", contact), &Limits::default()).unwrap();
    let (solution, _) = contact::solve(&checked, &Unmonitored).unwrap();
    assert!(
        (solution.patches[0].area_mm2 / 122.27 - 1.0).abs() < 0.01,
        "{:?}",
        solution.patches[0].extent_mm
    );
}

#[test]
fn nearly_conformal_and_overloaded_contacts_carry_a_remark() {
    let y = spread(-40.0, 40.0, 81);
    let warned = |rolling: f64, lateral: f64, force: f64| {
        let contact = profile(rolling, &y, |y| 0.5 * y * y / lateral);
        let case = with(
            &good_with("/contact", contact),
            "/load",
            Some(json!({ "normal_force_n": force })),
        );
        let checked = check(&case, &Limits::default()).unwrap();
        contact::solve(&checked, &Unmonitored).unwrap().0.remarks
    };
    assert!(
        warned(20.0, 20.0, 2e6)
            .iter()
            .any(|remark| remark.code == "nearly-conformal")
    );
    assert!(
        warned(460.0, 5.0, 1e6)
            .iter()
            .any(|remark| remark.code == "strains-too-large")
    );
    let usual = warned(460.0, 300.0, 1e5);
    assert!(
        !usual
            .iter()
            .any(|w| w.code == "nearly-conformal" || w.code == "strains-too-large"),
        "{usual:?}"
    );
}
