//! Recorded cases: the shipped examples, references of every kind, and random contacts, the same on every machine.

use serde_json::{Value, json};

use crate::gap_samples::GapReference;
use crate::golden;
use crate::population::{self, Class};
use crate::profile_cases::{generated, put};
use crate::random::Random;
use crate::reference::{self, Ellipse, HERTZ_CLASSES};

const ELLIPSES: usize = 60;
const WHEELS: usize = 20;

/// Returns all cases with their names.
pub fn all() -> Vec<(String, Value)> {
    let mut cases = examples();
    cases.extend(golden::cases());
    cases.extend(references());
    cases.extend(by_chance());
    cases.extend(sweeps());
    cases.extend(methods());
    cases.extend(wheels());
    cases.extend(variants());
    // Wheels on planes, and the random ones on the curve of the rail.
    for (_, case) in &mut cases {
        let contact = &mut case["contact"];
        let on_rails = ["profiles", "wheelset"]
            .iter()
            .any(|name| contact["type"] == *name);
        if on_rails && contact.get("reference_surface").is_none() {
            contact["reference_surface"] = json!("plane");
        }
    }
    cases.extend(on_the_curve());
    for (_, case) in &mut cases {
        round(case);
        // All recorded quantities must be in the outputs.
        case["outputs"] = json!(["resultants", "zones", "tractions", "pressure", "slip"]);
    }
    cases
}

/// Rounds all numbers to twelve digits. The results of powers and logarithms depend on the optimisation level, but every build must solve the same
/// cases.
fn round(value: &mut Value) {
    match value {
        Value::Number(number) if number.is_f64() => {
            let exact = number.as_f64().unwrap_or_default();
            let rounded: f64 = format!("{exact:.11e}").parse().expect("a number");
            *value = json!(rounded);
        }
        Value::Array(values) => values.iter_mut().for_each(round),
        Value::Object(members) => members.values_mut().for_each(round),
        _ => {}
    }
}

/// Returns the shipped examples that have an answer.
fn examples() -> Vec<(String, Value)> {
    let folder = format!(
        "{}/api/examples",
        concat!(env!("CARGO_MANIFEST_DIR"), "/..")
    );
    let mut cases = Vec::new();
    for entry in std::fs::read_dir(folder).expect("the examples") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").display().to_string();
        let other = ["faulty"].iter().any(|word| name.contains(word));
        if name.ends_with(".case.json") && !other {
            let text = std::fs::read_to_string(&path).expect("an example");
            let case = serde_json::from_str(&text).expect("an example is JSON");
            cases.push((format!("example {name}"), case));
        }
    }
    cases.sort_by(|(a, _), (b, _)| a.cmp(b));
    cases
}

/// Returns the ellipses and gaps with reference results.
fn references() -> Vec<(String, Value)> {
    let ellipses = HERTZ_CLASSES
        .iter()
        .chain(&["hertz_linear"])
        .flat_map(|class| reference::cases(class))
        .map(|case| {
            let mut question = case.ellipse().case(1, 1);
            question["solver"] = json!({ "method": "boundary_element", "target_error": 0.005 });
            (format!("reference {}", case.id), question)
        });
    let gaps = GapReference::profiles()
        .into_iter()
        .chain(GapReference::grids())
        .map(|case| (format!("reference {}", case.id), case.case()));
    ellipses.chain(gaps).collect()
}

/// Returns ellipses, pressures and gaps from the random population that calibrates the error estimate.
fn by_chance() -> Vec<(String, Value)> {
    let classes = [
        (Class::Ellipse, ELLIPSES),
        (Class::Smooth, 12),
        (Class::Jump, 6),
        (Class::Gap, 16),
    ];
    classes
        .into_iter()
        .flat_map(|(class, count)| (0..count).map(move |number| (class, number)))
        .map(|(class, number)| {
            let name = format!("{} {number}", class.name());
            let mut case = population::case(class, number);
            case["solver"] = json!({ "method": "boundary_element" });
            (name, case)
        })
        .collect()
}

/// Returns sweeps of one component at each of two shapes, a map of two components, and forces in place of creepages.
fn sweeps() -> Vec<(String, Value)> {
    let mut cases = Vec::new();
    for (shape, ratio) in [("wide", 0.4), ("long", 2.5)] {
        let ellipse = Ellipse::steel(ratio, 0.28).normalised(1.0, 1.0, 1.0);
        let [x, y, spin] = ellipse.motion;
        let range =
            |from: f64, to: f64, points: u32| json!({ "from": from, "to": to, "points": points });
        let at = |value: f64, points: u32| range(value, value, points);
        let sweeps = [
            (
                "spin",
                json!({ "spin_per_mm": range(0.2 * spin, 12.0 * spin, 8) }),
            ),
            (
                "creepage_x",
                json!({ "creepage_x": range(-2.0 * x, 2.0 * x, 7) }),
            ),
            (
                "lateral",
                json!({ "creepage_y": range(0.1 * y, 3.0 * y, 6), "spin_per_mm": at(1.5 * spin, 6) }),
            ),
            (
                "map",
                json!({
                    "creepage_x": range(0.0, 1.5 * x, 3), "creepage_y": range(-y, y, 3), "combine": "grid",
                }),
            ),
            (
                "force",
                json!({ "force_x_n": range(-12e3, 12e3, 4), "spin_per_mm": at(0.5 * spin, 4) }),
            ),
        ];
        for (name, sweep) in sweeps {
            let mut case = ellipse.case(1, 1);
            case["solver"] = json!({ "method": "boundary_element", "target_error": 0.005 });
            case["motion"] = json!({ "sweep": sweep });
            cases.push((format!("sweep {name} {shape}"), case));
        }
    }
    cases
}

/// Returns cases with the other methods and with explicit meshes.
fn methods() -> Vec<(String, Value)> {
    let solvers = [
        (
            "liu_hsu",
            json!({ "method": "liu_hsu", "mesh": { "strips": 8, "cells": 10 } }),
        ),
        ("fastsim", json!({ "method": "fastsim" })),
        (
            "parabolic",
            json!({ "method": "fastsim", "traction_bound": "parabolic" }),
        ),
        ("mesh", json!({ "mesh": { "strips": 12, "cells": 16 } })),
        (
            "finer",
            json!({ "method": "boundary_element", "target_error": 0.001 }),
        ),
        ("auto", json!({})),
    ];
    let random = &mut Random(17);
    let mut cases = Vec::new();
    for (name, solver) in solvers {
        for number in 0..4 {
            let ellipse = Ellipse::steel(random.decades(0.3, 3.0), random.between(0.0, 0.5));
            let [x, y] = [0; 2].map(|_| random.sign() * random.decades(0.1, 3.0));
            let spin = random.sign() * random.decades(0.1, 5.0);
            let mut case = ellipse.normalised(x, y, spin).case(1, 1);
            case["solver"] = solver.clone();
            cases.push((format!("{name} {number}"), case));
        }
    }
    cases
}

/// Returns wheels on rails: random ones from the population, and ones displaced step by step with the motion of their wheelset.
fn wheels() -> Vec<(String, Value)> {
    let mut cases: Vec<(String, Value)> = (0..WHEELS)
        .map(|number| {
            let name = format!("{} {number}", Class::Profiles.name());
            (name, population::case(Class::Profiles, number))
        })
        .collect();
    for (shift, yaw) in [(-5.0, 0.01), (-2.0, -0.005), (0.0, 0.0), (3.0, 0.02)] {
        let place = json!({ "lateral_shift_mm": shift, "yaw_rad": yaw });
        let mut case = put(&generated(), "contact", place);
        case["motion"] =
            json!({ "wheelset": { "speed_mm_per_s": 20_000, "free_rolling_radius_mm": 461 } });
        cases.push((format!("wheelset {shift} {yaw}"), case));
    }
    cases
}

/// Returns random new and worn wheels on new and worn rails, and wheelsets, on the curve of the rail.
fn on_the_curve() -> Vec<(String, Value)> {
    let mut cases = wheels();
    for (name, case) in &mut cases {
        *name = format!("{name} on the curve");
        case["contact"]["reference_surface"] = json!("curve");
    }
    let place = json!({ "lateral_shift_mm": -5.0, "reference_surface": "curve" });
    let mut case = put(&generated(), "contact", place);
    case["motion"] = json!({ "history": {
        "distance_mm": [0, 3, 8, 8, 20], "shift_y_mm": [0, 0, 0, 0.004, 0],
        "creepage_x": [0, 0.002, 0, 0, 0], "creepage_y": 0.001, "spin_per_mm": 2e-4
    } });
    cases.push(("history on the curve".to_owned(), case));
    cases.extend((0..WHEELS).map(|number| {
        let name = format!("{} {number}", Class::Curve.name());
        (name, population::case(Class::Curve, number))
    }));
    cases
}

/// Returns cases of the remaining kinds: other loads, dissimilar bodies, no friction, smoothed profiles.
fn variants() -> Vec<(String, Value)> {
    let mut cases = Vec::new();
    let mut add = |name: &str, base: &Value, members: Value| {
        let mut case = base.clone();
        for (member, value) in members.as_object().expect("members") {
            case[member] = value.clone();
        }
        cases.push((name.to_owned(), case));
    };
    let mut ellipse = Ellipse::steel(1.5, 0.28)
        .normalised(0.8, -0.4, 1.2)
        .case(1, 1);
    ellipse["solver"] = json!({ "method": "boundary_element", "target_error": 0.005 });
    let radii = json!({ "type": "radii", "rolling_mm": 460, "lateral_mm": 300 });
    let steel = json!({ "shear_modulus_mpa": 82_000, "poisson_ratio": 0.28 });
    let soft = json!({ "young_modulus_mpa": 150_000, "poisson_ratio": 0.31 });
    add(
        "unlike bodies",
        &ellipse,
        json!({ "material": { "lower": steel, "upper": soft } }),
    );
    add(
        "no friction",
        &ellipse,
        json!({ "friction": { "coefficient": 0 } }),
    );
    add(
        "approach",
        &ellipse,
        json!({ "contact": radii, "load": { "approach_mm": 0.08 } }),
    );
    let gap = GapReference::profiles()[0].case();
    add(
        "gap, approach",
        &gap,
        json!({ "load": { "approach_mm": 0.05 } }),
    );
    let wheel = put(&generated(), "contact", json!({ "lateral_shift_mm": 2.0 }));
    add(
        "wheel, normal force",
        &wheel,
        json!({ "load": { "normal_force_n": 60_000 } }),
    );
    add(
        "wheel, approach",
        &wheel,
        json!({ "load": { "approach_mm": 0.1 } }),
    );
    add(
        "wheel, sweep",
        &wheel,
        json!({ "motion": [{ "creepage_x": 0.0005 }, { "creepage_x": 0.001, "creepage_y": 0.001 }] }),
    );
    let smooth = json!({ "points_mm": wheel["contact"]["rail"]["points_mm"], "smoothing_mm": 4 });
    let smoothed = put(&wheel, "contact", json!({ "rail": smooth }));
    add("wheel, smoothed rail", &smoothed, json!({}));
    cases
}
