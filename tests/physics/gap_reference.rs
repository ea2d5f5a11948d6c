//! Tests of measured and analytic gaps against converged results of an independent program.

use std::f64::consts::PI;

use serde_json::Value;

use crate::gap_samples::GapReference;
use crate::reference::{Converged, assert_none, solve};

/// Allowed errors beyond the uncertainty of the reference. They are relative, those of the resultants to μN and μN√(A/π).
const APPROACH: f64 = 0.003;
const AREA: f64 = 0.02;
const PRESSURE_MAX: f64 = 0.02;
const RESULTANT: f64 = 0.01;

/// Returns a message for every quantity of the answer that is off by more than is allowed.
fn failures(case: &GapReference, question: &Value) -> Vec<String> {
    let (solution, _) = solve(question);
    let area: f64 = solution.patches.iter().map(|patch| patch.area_mm2).sum();
    let peaks = solution.patches.iter().map(|patch| patch.pressure_max_mpa);
    let approach = solution.patches[0].approach_mm.expect("an approach");
    let mut failures = Vec::new();
    let mut compare = |name: &str, found: f64, expected: Converged, scale: f64, allowed: f64| {
        let (error, unc) = ((found - expected.value) / scale, expected.unc / scale);
        if error.abs() > allowed + unc {
            failures.push(format!(
                "{} {name}: {found} for {} is off by {error:+.5} ± {unc:.5}, {allowed} is allowed",
                case.id, expected.value
            ));
        }
    };
    let relative = |expected: Converged| expected.value;
    compare(
        "approach",
        approach,
        case.approach_mm,
        relative(case.approach_mm),
        APPROACH,
    );
    compare("area", area, case.area_mm2, relative(case.area_mm2), AREA);
    let peak = case.pressure_max_mpa;
    compare(
        "p_max",
        peaks.fold(0.0, f64::max),
        peak,
        relative(peak),
        PRESSURE_MAX,
    );
    let bound = 0.3 * case.normal_force_n;
    let length = (case.area_mm2.value / PI).sqrt();
    // Where the tangential mesh reports that it is too coarse, the allowed error is its estimate.
    let point = &solution.patches[0].points[0];
    let estimate = solution.total[0]
        .error_estimate
        .expect("an estimate")
        .force_x_n
        / bound;
    let allowed = match point.target_met {
        Some(false) => RESULTANT.max(estimate),
        _ => RESULTANT,
    };
    let total = solution.total[0];
    compare("F_x", total.force_x_n, case.force_x_n, bound, allowed);
    compare("F_y", total.force_y_n, case.force_y_n, bound, allowed);
    compare(
        "M_z",
        total.moment_z_n_mm,
        case.moment_z_n_mm,
        bound * length,
        allowed,
    );
    failures
}

fn assert_class(cases: &[GapReference], count: usize) {
    assert_eq!(cases.len(), count);
    let failures: Vec<String> = cases
        .iter()
        .flat_map(|case| failures(case, &case.case()))
        .collect();
    assert_none("too far from the converged value", &failures);
}

#[test]
fn crowns_quartics_and_two_patches_agree_with_the_reference() {
    assert_class(&GapReference::profiles(), 17);
}

#[test]
fn wheel_on_rail_given_as_a_gap_agrees_with_the_reference() {
    assert_class(&GapReference::grids(), 9);
}

#[test]
fn an_approach_gives_back_the_load_it_came_from() {
    for case in GapReference::profiles() {
        let (by_force, _) = solve(&case.case());
        let approach = by_force.patches[0].approach_mm.expect("an approach");
        let mut again = case.case();
        again["load"] = serde_json::json!({ "approach_mm": approach });
        let (by_approach, _) = solve(&again);
        let force: f64 = by_approach
            .patches
            .iter()
            .map(|patch| patch.normal_force_n)
            .sum();
        let error = force / case.normal_force_n - 1.0;
        assert!(error.abs() < 1e-3, "{}: {error}", case.id);
        assert_eq!(
            by_force.patches.len(),
            by_approach.patches.len(),
            "{}",
            case.id
        );
    }
}

#[test]
fn the_examples_are_reference_cases_sampled_as_a_measurement_is() {
    let mut all = Vec::new();
    for (file, id) in [
        ("uic60-crown.case.json", "rad_uic_y8_80kN"),
        ("area-132re-crown.case.json", "rad_area_y15_60kN"),
        ("two-patches.case.json", "two_offset"),
    ] {
        let path = format!(
            "{}/api/examples/{file}",
            concat!(env!("CARGO_MANIFEST_DIR"), "/..")
        );
        let text = std::fs::read_to_string(path).expect("an example");
        let question: Value = serde_json::from_str(&text).expect("JSON");
        let cases = GapReference::profiles();
        let case = cases.iter().find(|case| case.id == id).expect("a case");
        all.extend(failures(case, &question));
    }
    assert_none("too far from the converged value", &all);
}
