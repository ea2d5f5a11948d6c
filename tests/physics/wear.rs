//! Tests wear across a patch against sums of tractions times slips over the elements of another program.

use std::collections::HashMap;

use railhead_contact::solution::words::damage::WearAcross;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::gap_samples::GapReference;
use crate::reference::{assert_none, cases, read, solve};

/// Allowed error of the total power. `SHARE` is the allowed error of its share on either side of any line.
const TOTAL: f64 = 0.02;
const SHARE: f64 = 0.025;

/// Rows of elements with friction power over speed and width and the depth of the wear map, and the power of the converged forces.
#[derive(Debug, Deserialize)]
struct WearReference {
    id: String,
    power_n: f64,
    dy_mm: f64,
    y_mm: Vec<f64>,
    power_n_per_mm: Vec<f64>,
    usfd_depth_nm: Vec<f64>,
}

/// A distribution across the patch: centres, widths and values over the width.
type Across<'a> = (&'a [f64], &'a dyn Fn(usize) -> f64, &'a [f64]);

/// Returns the integral of the distribution up to `y`.
fn right_of((middles, width, values): Across, y: f64) -> f64 {
    let parts = middles.iter().zip(values).enumerate();
    let parts = parts.map(|(k, (middle, value))| {
        let width = width(k);
        value * (y - (middle - 0.5 * width)).clamp(0.0, width)
    });
    parts.sum()
}

/// Returns the largest difference between the shares of two distributions on one side of a line.
fn difference(found: Across, expected: Across) -> f64 {
    let [of_found, of_expected] = [found, expected].map(|across| right_of(across, 1e3));
    let (first, last) = (expected.0[0], expected.0[expected.0.len() - 1]);
    let lines = (0..=40).map(|k| first - 1.0 + (last - first + 2.0) * f64::from(k) / 40.0);
    let shares = lines.map(|y| right_of(found, y) / of_found - right_of(expected, y) / of_expected);
    shares.fold(0.0, |most, share| share.abs().max(most))
}

#[test]
fn wear_across_agrees_with_tractions_times_slips_of_the_reference() {
    let grids = GapReference::grids().into_iter();
    let mut known: HashMap<String, Value> =
        grids.map(|case| (case.id.clone(), case.case())).collect();
    for class in ["hertz_long", "hertz_spin", "hertz_longspin", "hertz_xyspin"] {
        let ellipses = cases(class).into_iter();
        known.extend(ellipses.map(|case| (case.id.clone(), case.ellipse().case(10, 10))));
    }
    let mut failures = Vec::new();
    let references: Vec<WearReference> = read("wear.json");
    assert!(references.len() > 8);
    for reference in references {
        let mut case = known[&reference.id].clone();
        case["damage"] = json!({ "models": ["t_gamma", "usfd_wear"], "across": true });
        case["outputs"] = json!(["resultants", "damage"]);
        case["solver"] = json!({ "target_error": 0.005 });
        let (solution, _) = solve(&case);
        let damages = solution.patches.iter().map(|patch| &patch.points[0].damage);
        let strips: Vec<WearAcross> = damages
            .map(|damage| damage.as_ref().and_then(|damage| damage.across.clone()))
            .collect::<Option<_>>()
            .expect("strips");
        let all = |of: fn(&WearAcross) -> &[f64]| -> Vec<f64> {
            strips.iter().flat_map(of).copied().collect()
        };
        let (middles, widths) = (all(|strips| &strips.y_mm), all(|strips| &strips.dy_mm));
        let powers = all(|strips| &strips.t_gamma_n_per_mm);
        let depths = all(|strips| strips.usfd_depth_nm.as_deref().expect("depths"));
        let own = |k: usize| widths[k];
        let theirs = |_: usize| reference.dy_mm;
        for (name, found, expected) in [
            ("power", &powers, &reference.power_n_per_mm),
            ("depth", &depths, &reference.usfd_depth_nm),
        ] {
            let off = difference(
                (&middles, &own, found),
                (&reference.y_mm, &theirs, expected),
            );
            if off > SHARE {
                failures.push(format!("{} {name}: {off}", reference.id));
            }
        }
        let power = right_of((&middles, &own, &powers), 1e3);
        let off = power / reference.power_n - 1.0;
        if off.abs() > TOTAL {
            failures.push(format!("{} total power: {off}", reference.id));
        }
    }
    assert_none("wear that is off by more than is allowed", &failures);
}
