//! Tests cylinders of dissimilar bodies after Bentall and Johnson, in the middle of a patch that is very wide across rolling.

use railhead_contact::solution::words::answer::{Fields, PatchFields};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::reference::{Converged, assert_none, read, solve};

/// Half width over half length. End effects decrease with its square.
const WIDE: f64 = 1000.0;
/// The number of strips, which is odd so that one strip lies in the middle.
const STRIPS: u32 = 9;
/// Trial creepages relative to the expected one. It is negative, so that forces grow from the first to the last.
const TRIED: [f64; 3] = [1.05, 1.0, 0.95];

/// The reference creepage at which two cylinders carry a given force.
#[derive(Debug, Deserialize)]
struct Cylinders {
    id: String,
    material: Value,
    shear_modulus_mpa: f64,
    difference: f64,
    half_length_mm: f64,
    force_n_per_mm: f64,
    friction: f64,
    /// Force on the lower body over the friction limit.
    force: f64,
    creepage: Converged,
}

impl Cylinders {
    fn pressure_max(&self) -> f64 {
        2.0 * self.force_n_per_mm / (std::f64::consts::PI * self.half_length_mm)
    }

    /// Returns the creepage at which the middle strip carries the force, by interpolation between creepages near `known`. They are solved in one
    /// case or in separate cases.
    fn found(&self, known: f64, cells: u32, together: bool) -> f64 {
        let motion = |part: &f64| json!({ "creepage_x": part * known, "creepage_y": 0.0, "spin_per_mm": 0.0 });
        let forces = |patches: &[PatchFields]| -> Vec<f64> {
            (0..patches[0].points.len())
                .map(|k| self.middle_force(&patches[0], k))
                .collect()
        };
        let forces: Vec<f64> = if together {
            let motions: Vec<Value> = TRIED.iter().map(motion).collect();
            forces(&self.solved(&json!(motions), cells))
        } else {
            let alone = |part| forces(&self.solved(&motion(part), cells));
            TRIED.iter().flat_map(alone).collect()
        };
        let off = [0, 1, 2].map(|k| forces[k] - self.force);
        let [low, _, high] = off;
        assert!(low < 0.0 && high > 0.0, "{}: {off:?}", self.id);
        let k = usize::from(off[1] < 0.0);
        let part = TRIED[k] - off[k] * (TRIED[k + 1] - TRIED[k]) / (off[k + 1] - off[k]);
        part * known
    }

    /// Returns the patches of a case with one motion or several.
    fn solved(&self, motion: &Value, cells: u32) -> Vec<PatchFields> {
        let (a, b) = (self.half_length_mm, WIDE * self.half_length_mm);
        let load = self.pressure_max() * 2.0 * std::f64::consts::PI / 3.0 * a * b;
        let (_, Fields { patches }) = solve(&json!({
            "material": self.material,
            "friction": { "coefficient": self.friction },
            "contact": { "type": "ellipse", "a_mm": a, "b_mm": b },
            "load": { "normal_force_n": load },
            "motion": motion,
            "solver": { "mesh": { "strips": STRIPS, "cells": cells } },
            "outputs": ["tractions", "pressure"],
        }));
        patches
    }

    /// Returns the force of the middle strip over its friction limit.
    fn middle_force(&self, patch: &PatchFields, motion: usize) -> f64 {
        let traction = patch.points[motion].traction_x_mpa.as_ref().unwrap();
        let mesh = patch.cells(motion);
        let pressure = mesh.pressure_mpa.as_ref().unwrap();
        let cells = || (0..mesh.strip.len()).filter(|&i| mesh.strip[i] == STRIPS / 2);
        let sum = |values: &[f64]| cells().map(|i| values[i] * mesh.dx_mm[i]).sum::<f64>();
        sum(traction) / (self.friction * sum(pressure))
    }
}

/// Tests the creepages that belong to given forces, from very little friction to no slip (Bentall and Johnson 1967), in single cases and in a list.
#[test]
fn unlike_cylinders_roll_with_the_creepage_of_their_force() {
    let mut failures = Vec::new();
    for case in read::<Vec<Cylinders>>("cylinders.json") {
        let known = case.creepage;
        // With very little friction, cells slip forward or backward as a whole, so that forces grow in steps.
        let cells = if case.friction < 1e-3 { 160 } else { 48 };
        let [alone, together] =
            [false, true].map(|together| case.found(known.value, cells, together) / known.value);
        println!(
            "{}: {alone:.4} of the creepage, {together:.4} in a list",
            case.id
        );
        let uncertain = known.unc / known.value.abs();
        let sticks = case.friction > 1.0;
        let allowed = if sticks { 0.02 } else { 0.008 };
        for found in [alone, together] {
            if (found - 1.0).abs() > allowed + uncertain {
                failures.push(format!("{}: {found:.4}, {allowed:.4} allowed", case.id));
            }
        }
    }
    assert_none("creepages differ", &failures);
}

/// With very little friction every cell slips, along ξ + 2 K p/G. The force vanishes where half of the load lies inside the change of sign, at p =
/// 0.9147 p0.
#[test]
fn with_hardly_any_friction_the_creepage_is_that_of_half_the_load() {
    let all: Vec<Cylinders> = read("cylinders.json");
    let case = all
        .iter()
        .find(|case| case.friction < 1e-3)
        .expect("a case with little friction");
    let exact = -2.0 * case.difference * case.pressure_max() / case.shear_modulus_mpa * 0.9147;
    let found = case.found(exact, 200, false) / exact;
    println!("{found:.4} of the creepage");
    assert!((found - 1.0).abs() < 0.01, "{found}");
}
