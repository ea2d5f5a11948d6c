//! Cases over the whole allowed range: shapes, loads, materials, motions, meshes, units.

use std::f64::consts::{PI, TAU};

use serde_json::{Value, json};

use super::random::Random;

/// A case to solve.
pub struct Sample {
    /// Row of the report that the case belongs to.
    pub kind: &'static str,
    /// Number of the case for messages.
    pub number: usize,
    pub case: Value,
}

/// Kinds of cases, with their frequencies out of twenty-one.
const KINDS: [&str; 21] = [
    "ellipse, mesh",
    "ellipse, target",
    "radii, target",
    "ellipse, mesh",
    "gap_profile, target",
    "ellipse, few cells",
    "pressure_grid, mesh",
    "radii, target",
    "ellipse, mesh",
    "prescribed force",
    "ellipse, target",
    "pressure_grid, target",
    "gap_grid, target",
    "ellipse, mesh",
    "radii, target",
    "fastsim",
    "gap_profile, mesh",
    "ellipse, few cells",
    "ellipse, target",
    "two patches nearly touching",
    "two unequal patches",
];
/// In addition to these, one case in this number has a huge mesh.
const HUGE_EVERY: usize = 500;

/// Returns the first `count` cases of a seed.
pub fn samples(count: usize, seed: u64) -> impl Iterator<Item = Sample> {
    (0..count).map(move |number| {
        let mut random = Random(
            seed.wrapping_add(1 + number as u64)
                .wrapping_mul(0x2545_F491),
        );
        let kind = if number % HUGE_EVERY == HUGE_EVERY - 1 {
            "ellipse, huge mesh"
        } else {
            KINDS[number % KINDS.len()]
        };
        let case = case(kind, &mut random);
        let case = match number % 9 {
            // Other units, or bodies of another size.
            4 => scaled(&case, random.decades(1e-6, 1e3), random.decades(1e-3, 1e3)),
            8 => scaled(&case, 1.0, random.decades(1e-6, 1e6)),
            _ => case,
        };
        Sample { kind, number, case }
    })
}

/// Load and stiffness of a contact, for motions of the usual size.
struct Setting {
    force: f64,
    modulus: f64,
    poisson: f64,
    friction: f64,
}

impl Setting {
    fn new(random: &mut Random) -> Setting {
        Setting {
            force: random.decades(1.0, 1e6),
            modulus: random.decades(1e3, 1e6),
            poisson: match random.below(10) {
                0 => 0.0,
                1 => 0.5,
                _ => random.between(0.0, 0.5),
            },
            friction: random.decades(1e-3, 2.0),
        }
    }

    /// Returns creepages in 1 and spin in 1/mm for a patch of half width `c`. A creepage of `unit` is near saturation.
    fn motion(&self, c: f64, random: &mut Random) -> Value {
        let unit = self.friction * self.force * (1.0 - self.poisson) / (2.0 * self.modulus * c * c);
        let size = match random.below(8) {
            0 => 0.0,
            1 => random.decades(1e-12, 1.0) / unit,
            _ => random.decades(1e-6, 1e2),
        };
        let angle = [0.0, 0.25 * TAU, random.between(0.0, TAU)][random.below(3)];
        let spin = match random.below(6) {
            0 | 1 => 0.0,
            2 => random.decades(1e-9, 1e2),
            3 => random.between(0.0, 100.0),
            _ => random.between(0.0, 8.0),
        };
        json!({
            "creepage_x": unit * size * angle.cos(),
            "creepage_y": unit * size * angle.sin(),
            "spin_per_mm": unit / c * spin * random.sign(),
        })
    }

    fn case(&self, contact: Value, motion: Value, solver: Value) -> Value {
        let mut case = json!({
            "material": { "shear_modulus_mpa": self.modulus, "poisson_ratio": self.poisson },
            "friction": { "coefficient": self.friction },
            "contact": contact,
            "motion": motion,
            "solver": solver,
            "outputs": ["resultants", "zones", "tractions", "pressure", "slip"],
        });
        if case["contact"]["type"] != "pressure_grid" {
            case["load"] = json!({ "normal_force_n": self.force });
        }
        case
    }

    /// Returns the half width of the circle that the load would give on spheres of this radius of curvature.
    fn hertz(&self, radius: f64) -> f64 {
        (0.75 * self.force * radius * (1.0 - self.poisson) / self.modulus).cbrt()
    }
}

fn mesh(strips: usize, cells: usize) -> Value {
    json!({ "method": "boundary_element", "mesh": { "strips": strips, "cells": cells } })
}

fn target(random: &mut Random) -> Value {
    let target = [0.05, 0.02, 0.005, 0.005, 0.002][random.below(5)];
    json!({ "target_error": target })
}

/// Returns solver settings for a case of this kind.
fn solver(kind: &str, random: &mut Random) -> Value {
    match kind {
        "ellipse, huge mesh" => mesh(44, 50),
        "ellipse, few cells" => match random.below(4) {
            0 => mesh(1, 1),
            1 => mesh(1, 1 + random.below(40)),
            2 => mesh(1 + random.below(40), 1),
            _ => mesh(1 + random.below(3), 1 + random.below(3)),
        },
        "fastsim" => {
            let bound = ["elliptic", "parabolic"][random.below(2)];
            json!({ "method": "fastsim", "traction_bound": bound })
        }
        "two patches nearly touching" => [mesh(8, 10), target(random)][random.below(2)].clone(),
        kind if kind.ends_with("mesh") => mesh(4 + random.below(14), 4 + random.below(20)),
        _ => target(random),
    }
}

fn case(kind: &str, random: &mut Random) -> Value {
    let setting = Setting::new(random);
    let solver = solver(kind, random);
    match kind {
        "radii, target" => {
            let radius = random.decades(0.1, 1e4);
            let ratio = random.decades(0.02, 50.0);
            let [rolling, lateral] = [radius * ratio.sqrt(), radius / ratio.sqrt()];
            let contact = json!({ "type": "radii", "rolling_mm": rolling, "lateral_mm": lateral });
            let motion = setting.motion(setting.hertz(radius), random);
            setting.case(contact, motion, solver)
        }
        "gap_profile, target"
        | "gap_profile, mesh"
        | "gap_grid, target"
        | "two unequal patches" => {
            let contact = if kind == "two unequal patches" {
                unequal(random)
            } else {
                gap(kind, random)
            };
            // Gaps have the size of rails, with loads and stiffness that give patches of 1 to 15 mm.
            let setting = Setting {
                force: random.decades(3e2, 3e5),
                modulus: 82_000.0,
                ..setting
            };
            let motion = setting.motion(setting.hertz(300.0), random);
            setting.case(contact, motion, solver)
        }
        "pressure_grid, mesh" | "pressure_grid, target" | "two patches nearly touching" => {
            let (contact, c) = pressures(kind, &setting, random);
            let motion = setting.motion(c, random);
            setting.case(contact, motion, solver)
        }
        _ => {
            let c = random.decades(0.01, 100.0);
            let ratio = random.decades(0.02, 50.0);
            let [a, b] = [c * ratio.sqrt(), c / ratio.sqrt()];
            let contact = json!({ "type": "ellipse", "a_mm": a, "b_mm": b });
            let mut motion = setting.motion(c, random);
            if kind == "prescribed force" {
                let name = ["creepage_x", "creepage_y"][random.below(2)];
                let part = random.between(-0.98, 0.98);
                motion = json!({
                    "creepage_x": 0.0, "creepage_y": 0.0, "spin_per_mm": 0.1 * motion["spin_per_mm"].as_f64().unwrap_or(0.0)
                });
                let members = motion.as_object_mut().expect("an object");
                members.remove(name);
                let force = name.replace("creepage", "force") + "_n";
                members.insert(force, json!(part * setting.friction * setting.force));
            }
            setting.case(contact, motion, solver)
        }
    }
}

/// Returns two bumps of very different radii side by side under a wheel.
fn unequal(random: &mut Random) -> Value {
    let rolling = random.decades(100.0, 2000.0);
    let radii = [random.decades(100.0, 600.0), random.decades(1.0, 60.0)];
    let half = random.between(6.0, 14.0);
    let offset = random.between(0.0, 0.02);
    let across = |y: f64| {
        let large = (y + half).powi(2) / (2.0 * radii[0]);
        large.min((y - half).powi(2) / (2.0 * radii[1]) + offset)
    };
    let y: Vec<f64> = (0..961).map(|k| 0.05 * f64::from(k) - 24.0).collect();
    let gap: Vec<f64> = y.iter().map(|y| across(*y)).collect();
    json!({ "type": "gap_profile", "rolling_mm": rolling, "y_mm": y, "gap_mm": gap })
}

/// Returns crowns of powers, two bumps, kinks and roughness under a wheel.
fn gap(kind: &str, random: &mut Random) -> Value {
    let rolling = random.decades(50.0, 5000.0);
    let shape = random.below(4);
    let (square, fourth) = (random.decades(5e-5, 1e-2), random.decades(1e-7, 1e-4));
    let (half, offset) = (random.between(2.0, 10.0), random.between(0.0, 0.05));
    let noise: Vec<f64> = (0..400)
        .map(|_| {
            if shape == 3 {
                random.between(-0.003, 0.003)
            } else {
                0.0
            }
        })
        .collect();
    let across = |y: f64| match shape {
        0 => square * y * y + fourth * y.powi(4),
        1 => (square * (y - half).powi(2)).min(square * (y + half).powi(2) + offset),
        // Another curvature on one side, and a kink next to the contact.
        2 => square * y * y * if y > 0.0 { 1.0 } else { 3.0 } + 0.01 * (y - half).max(0.0),
        _ => square * y * y,
    };
    let places = |half: f64, count: usize| -> Vec<f64> {
        let step = 2.0 * half / (count - 1) as f64;
        (0..count).map(|k| k as f64 * step - half).collect()
    };
    if kind == "gap_grid, target" {
        let (x, y) = (places(25.0, 61), places(30.0, 91));
        let rows: Vec<Vec<f64>> = y
            .iter()
            .zip(&noise)
            .map(|(y, noise)| {
                let over = |x: &f64| 0.5 * (x + 0.1 * y).powi(2) / rolling + across(*y) + noise;
                x.iter().map(over).collect()
            })
            .collect();
        return json!({ "type": "gap_grid", "x_mm": x, "y_mm": y, "gap_mm": rows });
    }
    let y = places(30.0, 151 + 60 * random.below(3));
    let gap: Vec<f64> = y
        .iter()
        .zip(&noise)
        .map(|(y, noise)| across(*y) + noise)
        .collect();
    json!({ "type": "gap_profile", "rolling_mm": rolling, "y_mm": y, "gap_mm": gap })
}

/// Returns sampled pressures: lens, egg, hollow, ridge with denormal numbers, or two lenses that nearly touch. Returns an approximation of √(A/π),
/// too.
fn pressures(kind: &str, setting: &Setting, random: &mut Random) -> (Value, f64) {
    let c = random.decades(0.5, 20.0);
    let count = 12 + random.below(24);
    let at = |k: usize| 2.6 * c * (k as f64 / (count - 1) as f64 - 0.5);
    let shape = if kind == "two patches nearly touching" {
        4
    } else {
        random.below(4)
    };
    let apart = random.decades(1e-3, 0.3);
    let largest = 1.5 * setting.force / (PI * c * c);
    let lens = |x: f64, y: f64| (1.0 - x * x - y * y).max(0.0).sqrt();
    let pressure = |x: f64, y: f64| {
        let p = match shape {
            0 => lens(x, y),
            1 => lens(x * (1.0 + 0.3 * y), y),
            2 if x.hypot(y) < 0.3 => 0.0,
            2 => lens(x, y),
            3 => (1.0 - x * x).max(0.0) * (-40.0 * y * y).exp(),
            _ => {
                let half = 0.5 * (1.0 - apart);
                lens(x, (y - 0.5 * (1.0 + apart)) / half)
                    .max(lens(x, (y + 0.5 * (1.0 + apart)) / half))
            }
        };
        // The ridge ends in denormal numbers.
        if shape == 3 && p > 0.0 && p < 1e-9 {
            1e-310
        } else {
            largest * p
        }
    };
    let rows: Vec<Vec<f64>> = (0..count)
        .map(|j| (0..count).map(|i| pressure(at(i) / c, at(j) / c)).collect())
        .collect();
    let places: Vec<f64> = (0..count).map(at).collect();
    let contact =
        json!({ "type": "pressure_grid", "x_mm": places, "y_mm": places, "pressure_mpa": rows });
    (contact, c)
}

/// Returns the contact in other units: lengths times `length`, stresses times `stress`. The names of the members give their units.
pub fn scaled(case: &Value, length: f64, stress: f64) -> Value {
    fn walk(value: &mut Value, factor: Option<f64>, length: f64, stress: f64) {
        match value {
            Value::Object(members) => {
                for (name, member) in members.iter_mut() {
                    let factor = match name.as_str() {
                        "spin_per_mm" => Some(1.0 / length),
                        name if name.ends_with("_mm") => Some(length),
                        name if name.ends_with("_mpa") => Some(stress),
                        name if name.ends_with("_n") => Some(stress * length * length),
                        _ => None,
                    };
                    walk(member, factor, length, stress);
                }
            }
            Value::Array(elements) => elements
                .iter_mut()
                .for_each(|element| walk(element, factor, length, stress)),
            Value::Number(number) => {
                if let (Some(factor), Some(value)) = (factor, number.as_f64()) {
                    *number =
                        serde_json::Number::from_f64(factor * value).unwrap_or(number.clone());
                }
            }
            _ => {}
        }
    }
    let mut case = case.clone();
    walk(&mut case, None, length, stress);
    case
}

/// Returns the contact with the motion, or the prescribed force, reversed.
pub fn reversed(case: &Value) -> Value {
    let mut case = case.clone();
    for (_, member) in case["motion"].as_object_mut().into_iter().flatten() {
        *member = json!(-member.as_f64().unwrap_or(0.0));
    }
    case
}
