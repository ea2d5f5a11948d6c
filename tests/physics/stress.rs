//! A small part of the stability stress test: random cases end in an answer that obeys the laws, or in a reason.

use contacts::samples;
use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::{check, solve};
use serde_json::{Value, json};
use trial::{End, trial};

use crate::random;
use crate::reference::assert_none;

#[path = "../../benches/stress/contacts.rs"]
mod contacts;
#[path = "../../benches/stress/laws.rs"]
mod laws;
#[path = "../../benches/stress/trial.rs"]
mod trial;

#[test]
fn random_cases_obey_the_laws_or_say_why_not() {
    let mut failures = Vec::new();
    let (mut refused, mut covered, mut compared) = (0, 0, 0);
    let count = 160;
    for sample in samples(count, 7) {
        let found = trial(&sample);
        let name = |what: &str| format!("{} ({}): {what}", sample.number, sample.kind);
        failures.extend(found.broken.iter().map(|law| name(law)));
        if let Some((error, estimate)) = found.error {
            compared += 1;
            covered += usize::from(error <= estimate);
        }
        if let Some(apart) = found.from_liu_hsu
            && apart > 1e-4
        {
            failures.push(name(&format!("{apart:.1e} from liu_hsu")));
        }
        match found.end {
            End::Solved => {}
            End::Refused(_) => refused += 1,
            End::NotConverged(reason) | End::Failed(reason) => failures.push(name(&reason)),
        }
    }
    assert_none("of the random cases", &failures);
    assert!(refused < count / 20, "{refused} refused");
    assert!(
        10 * covered >= 9 * compared,
        "{covered} of {compared} covered"
    );
}

/// The two cases are a twin beyond the allowed lengths of a case, and a rough gap of thirteen patches, the smallest three cells across.
#[test]
fn cases_that_seemed_to_break_the_law_of_units_obey_it() {
    for number in [1156, 3124] {
        let sample = samples(number + 1, 20_261_121).last().expect("a case");
        let found = trial(&sample);
        assert_eq!(found.broken, Vec::<String>::new(), "{number}");
    }
}

#[test]
fn the_answer_to_a_smooth_gap_does_not_depend_on_the_units_of_length_and_force() {
    let y: Vec<f64> = (0..201).map(|k| 0.2 * f64::from(k) - 20.0).collect();
    let crown: Vec<f64> = y.iter().map(|y| y * y / 600.0 + 2e-6 * y.powi(4)).collect();
    let x: Vec<f64> = (0..81).map(|k| 0.5 * f64::from(k) - 20.0).collect();
    let rows: Vec<Vec<f64>> = crown
        .iter()
        .map(|gap| x.iter().map(|x| gap + x * x / 920.0).collect())
        .collect();
    for contact in [
        json!({ "type": "gap_profile", "rolling_mm": 460.0, "y_mm": y, "gap_mm": crown }),
        json!({ "type": "gap_grid", "x_mm": x, "y_mm": y, "gap_mm": rows }),
    ] {
        let case = json!({
            "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
            "friction": { "coefficient": 0.3 },
            "contact": contact,
            "load": { "normal_force_n": 80e3 },
            "motion": { "creepage_x": 0.001, "creepage_y": -0.0005, "spin_per_mm": 0.0002 },
            "solver": { "mesh": { "strips": 12, "cells": 14 } },
        });
        let relative = |case: &Value| {
            let problem = check(case, &Limits::default()).expect("a case");
            let (found, _) = solve(&problem, &Unmonitored).expect("an answer");
            laws::relative(case, &found).0
        };
        let own = relative(&case);
        for (length, stress) in [(37.0, 1.23e-4), (1e-2, 1.0), (1.0, 7e-3), (0.3, 11.0)] {
            let other = relative(&contacts::scaled(&case, length, stress));
            let apart = (0..3)
                .map(|k| (other[k] - own[k]).abs())
                .fold(0.0, f64::max);
            assert!(apart < 1e-5, "{length} {stress}: {own:?} {other:?}");
        }
    }
}
