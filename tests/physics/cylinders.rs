//! Cylinders of unlike bodies, after Bentall and Johnson: the middle of a very long patch across rolling.

use railhead::contact::solution::words::fields::{Fields, PatchFields};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::reference::{Converged, assert_none, read, solve};

/// Half width over half length: end effects fall as its square.
const WIDE: f64 = 1000.0;
/// An odd number: one strip lies in the middle.
const STRIPS: u32 = 9;
/// Creepages tried, relative to the one that is looked for, which is negative: forces grow from the first to the last.
const TRIED: [f64; 3] = [1.05, 1.0, 0.95];

/// The creepage at which two cylinders carry a force, found elsewhere.
#[derive(Debug, Deserialize)]
struct Cylinders {
    id: String,
    material: Value,
    shear_modulus_mpa: f64,
    difference: f64,
    half_length_mm: f64,
    force_n_per_mm: f64,
    friction: f64,
    /// Of the lower body, over the friction limit.
    force: f64,
    creepage: Converged,
}

impl Cylinders {
    fn pressure_max(&self) -> f64 {
        2.0 * self.force_n_per_mm / (std::f64::consts::PI * self.half_length_mm)
    }

    /// The creepage at which the middle strip carries the force, between creepages about one that is known.
    fn found(&self, known: f64, cells: u32) -> f64 {
        let (a, b) = (self.half_length_mm, WIDE * self.half_length_mm);
        let load = self.pressure_max() * 2.0 * std::f64::consts::PI / 3.0 * a * b;
        // Several motions: pressures that feel the tractions would need a gap of this length.
        let motions: Vec<Value> = TRIED
            .iter()
            .map(
                |part| json!({ "creepage_x": part * known, "creepage_y": 0.0, "spin_per_mm": 0.0 }),
            )
            .collect();
        let (_, Fields { patches }) = solve(&json!({
            "material": self.material,
            "friction": { "coefficient": self.friction },
            "contact": { "type": "ellipse", "a_mm": a, "b_mm": b },
            "load": { "normal_force_n": load },
            "motion": motions,
            "solver": { "mesh": { "strips": STRIPS, "cells": cells } },
            "outputs": ["tractions", "pressure"],
        }));
        let off = [0, 1, 2].map(|k| self.middle_force(&patches[0], k) - self.force);
        let [low, _, high] = off;
        assert!(low < 0.0 && high > 0.0, "{}: {off:?}", self.id);
        let k = usize::from(off[1] < 0.0);
        let part = TRIED[k] - off[k] * (TRIED[k + 1] - TRIED[k]) / (off[k + 1] - off[k]);
        part * known
    }

    /// Force of the middle strip over its friction limit.
    fn middle_force(&self, patch: &PatchFields, motion: usize) -> f64 {
        let traction = patch.points[motion].traction_x_mpa.as_ref().unwrap();
        let mesh = patch.cells(motion);
        let pressure = mesh.pressure_mpa.as_ref().unwrap();
        let cells = || (0..mesh.strip.len()).filter(|&i| mesh.strip[i] == STRIPS / 2);
        let sum = |values: &[f64]| cells().map(|i| values[i] * mesh.dx_mm[i]).sum::<f64>();
        sum(traction) / (self.friction * sum(pressure))
    }
}

/// Creepages that belong to forces, from hardly any friction to none of the slip (Bentall and Johnson 1967), though pressures do not feel
/// tractions here: off by less than K μ, as far as friction counts.
#[test]
fn unlike_cylinders_roll_with_the_creepage_of_their_force() {
    let mut failures = Vec::new();
    for case in read::<Vec<Cylinders>>("cylinders.json") {
        let known = case.creepage;
        // Without friction to speak of cells slip forward or backward as a whole, so that forces grow in steps.
        let cells = if case.friction < 1e-3 { 160 } else { 48 };
        let found = case.found(known.value, cells) / known.value;
        println!("{}: {found:.4} of the creepage", case.id);
        let pull = (case.difference * case.friction).min(0.05);
        let allowed = 0.01 + known.unc / known.value.abs() + 0.3 * pull;
        if (found - 1.0).abs() > allowed {
            failures.push(format!("{}: {found:.4}, {allowed:.4} allowed", case.id));
        }
    }
    assert_none("creepages differ", &failures);
}

/// Without friction to speak of everything slips, along ξ + 2 K p/G. Nothing pulls where half of the load lies inside the change of sign,
/// at p = 0.9147 p0.
#[test]
fn with_hardly_any_friction_the_creepage_is_that_of_half_the_load() {
    let all: Vec<Cylinders> = read("cylinders.json");
    let case = all
        .iter()
        .find(|case| case.friction < 1e-3)
        .expect("there is one");
    let exact = -2.0 * case.difference * case.pressure_max() / case.shear_modulus_mpa * 0.9147;
    let found = case.found(exact, 200) / exact;
    println!("{found:.4} of the creepage");
    assert!((found - 1.0).abs() < 0.01, "{found}");
}
