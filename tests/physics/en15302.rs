//! Tests the benchmark of EN 15302: radius difference and equivalent conicity of every pair of reference profiles in `tests/data/en15302`.

use std::fs;
use std::path::Path;

use railhead_contact::solution::words::answer::Kinematics;
use serde_json::{Value, json};

use crate::reference::solve;

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("a number: {value}"))
}

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .expect("numbers")
        .iter()
        .map(number)
        .collect()
}

/// Returns the depth (z down) of an arc or a line of a reference profile at y.
fn depth(segment: &Value, y: f64) -> f64 {
    if let Some(arc) = segment.get("arc") {
        let (centre, radius) = (numbers(&arc["centre"]), number(&arc["radius"]));
        let across = y - centre[0];
        return centre[1]
            + number(&arc["sign"]) * (radius * radius - across * across).max(0.0).sqrt();
    }
    number(&segment["line"]["z0"]) + number(&segment["line"]["slope"]) * y
}

/// Returns points of a reference profile about 0.2 mm apart along it.
fn section(segments: &Value) -> Value {
    let mut points: Vec<[f64; 2]> = Vec::new();
    for segment in segments.as_array().expect("segments") {
        let [from, to] = ["from", "to"].map(|end| number(&segment[end]));
        let fine: Vec<[f64; 2]> = (0..=20_000)
            .map(|k| from + (to - from) * f64::from(k) / 20_000.0)
            .map(|y| [y, depth(segment, y)])
            .collect();
        for (k, point) in fine.iter().enumerate() {
            let far = points
                .last()
                .is_none_or(|last| (point[0] - last[0]).hypot(point[1] - last[1]) >= 0.2);
            if far || k + 1 == fine.len() {
                points.push(*point);
            }
        }
    }
    json!({ "points_mm": points, "mirror_y": false, "mirror_z": false })
}

fn kinematics(benchmark: &Value, name: &str, pair: &Value) -> Kinematics {
    let profile = |name: &Value| section(&benchmark["profiles"][name.as_str().expect("a name")]);
    // The last part of the name is the rail: `WheelARailA`.
    let rail = &name[name.rfind("Rail").expect("a rail")..];
    let case = json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": {
            "type": "wheelset",
            "rail": section(&benchmark["profiles"][rail]),
            "wheel": profile(&pair["left_wheel"]),
            "right": {
                "wheel": profile(&pair["right_wheel"]),
                "rolling_radius_mm": pair["rolling_radius_mm"]["right"],
            },
            "rolling_radius_mm": pair["rolling_radius_mm"]["left"],
            "rail_origin_mm": 750,
            "flange_back_distance_mm": 1360,
            "flange_back_position_mm": -70,
            "kinematics": { "amplitudes_mm": pair["amplitude_mm"] },
        },
        "load": { "vertical_force_n": 100_000 },
        "motion": { "wheelset": { "speed_mm_per_s": 20000, "free_rolling_radius_mm": 460 } },
        "solver": { "method": "fastsim", "mesh": { "strips": 10, "cells": 10 } },
        "outputs": ["resultants"],
    });
    let (solution, _) = solve(&case);
    let found = solution.wheelset.expect("a wheelset").kinematics;
    *found.expect("kinematics")
}

/// Returns every pair of every file in the folder. All files have the same form.
fn pairs() -> Vec<(Value, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/en15302");
    let mut pairs = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("a file").path();
        if path
            .extension()
            .is_some_and(|extension| extension == "json")
        {
            let text = fs::read_to_string(path).expect("a text");
            let benchmark: Value = serde_json::from_str(&text).expect("JSON");
            let names = benchmark["pairs"]
                .as_object()
                .expect("pairs")
                .keys()
                .cloned();
            pairs.extend(
                names
                    .map(|name| (benchmark.clone(), name))
                    .collect::<Vec<_>>(),
            );
        }
    }
    assert!(pairs.len() >= 5);
    pairs
}

#[test]
fn en_15302_is_met_by_every_pair_at_every_amplitude() {
    for (benchmark, name) in pairs() {
        let pair = &benchmark["pairs"][&name];
        let found = kinematics(&benchmark, &name, pair);
        let shifts = numbers(&pair["shift_mm"]);
        let mut off: Vec<f64> = shifts
            .iter()
            .zip(numbers(&pair["radius_difference_mm"]))
            .map(|(shift, difference)| {
                let near = |at: &f64| (at - shift).abs() < 1e-6;
                let at = found.lateral_shift_mm.iter().position(near);
                let at = at.unwrap_or_else(|| panic!("{name}: no shift {shift}"));
                (found.radius_difference_mm[at] - difference).abs()
            })
            .collect();
        off.sort_by(f64::total_cmp);
        let median = off[off.len() / 2];
        assert!(median < 0.01, "{name}: Δr off by {median} mm");
        let reference = numbers(&pair["conicity"]);
        println!(
            "{name}: Δr off by {median:.5} mm in the median, {:.3} at most",
            off[off.len() - 1]
        );
        for (k, entry) in found.conicity.iter().enumerate() {
            let conicity = entry
                .conicity
                .unwrap_or_else(|| panic!("{name}: {entry:?}"));
            println!(
                "{} {conicity:.4} {:.3} {:?} {:?}",
                entry.amplitude_mm, reference[k], entry.conicity_with_roll, entry.error_estimate
            );
            for window in ["window", "extended_window"] {
                let window = numbers(&pair[window][k]);
                assert!(
                    (window[0]..=window[1]).contains(&conicity),
                    "{name} at {} mm: {conicity}, the standard has {} within {window:?}",
                    entry.amplitude_mm,
                    reference[k]
                );
            }
        }
    }
}

/// Tests flat treads between flanges: the standard's wheel I has no radius difference at small shifts.
#[test]
fn flat_treads_have_the_conicity_zero() {
    let (benchmark, name) = pairs().remove(0);
    let mut flat = benchmark.clone();
    // The flange root of wheel B, with a cylinder in place of the cone.
    let wheel = flat["profiles"]["WheelB"].as_array_mut().expect("segments");
    wheel.truncate(5);
    wheel.push(json!({ "from": -29.3505, "to": 60.0, "line": { "z0": depth(&wheel[4], -29.3505), "slope": 0.0 } }));
    let mut pair = benchmark["pairs"][&name].clone();
    pair["left_wheel"] = json!("WheelB");
    pair["right_wheel"] = json!("WheelB");
    pair["rolling_radius_mm"] = json!({ "left": 460, "right": 460 });
    pair["amplitude_mm"] = json!([0.5, 2, 3, 20]);
    let found = kinematics(&flat, "WheelBRailA", &pair);
    for entry in &found.conicity[..2] {
        assert_eq!(entry.conicity, Some(0.0), "{entry:?}");
        assert_eq!(entry.wavelength_mm, None);
        let reason = entry.reason.as_deref().unwrap_or_default();
        assert!(reason.contains("wavelength_mm, turns_mm"), "{entry:?}");
    }
    assert_eq!(
        found.equilibrium_shift_mm.map(|y| (1e6 * y).round()),
        Some(0.0)
    );
    // The shifts end at 10 mm.
    let beyond = &found.conicity[3];
    assert_eq!(beyond.conicity, None);
    assert!(
        beyond
            .reason
            .as_deref()
            .is_some_and(|reason| reason.contains("conicity")),
        "{beyond:?}"
    );
}
