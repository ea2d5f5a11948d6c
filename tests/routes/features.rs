//! Features of cases: forms of friction, pairs of bodies, contacts, ways to give the motion, methods and outputs. Each feature has the expected
//! outcome on every route. This is the list of combinations that are refused.

use serde_json::{Value, json};

use crate::matrix::{Expected, Route};
use crate::profile_shapes::{rail_60e1, s1002};

/// Number of rows of a feature.
pub const ROWS: usize = 3;

/// A column: the pointer into the case, and a number for each row.
pub type RowColumn = (&'static str, [f64; ROWS]);

/// The form of several motions in one case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motions {
    /// A list, or a sweep, of creepages and forces.
    Creepages,
    /// A list of motions of the wheelset.
    Wheelset,
}

/// A case with rows over it.
#[derive(Debug, Clone)]
pub struct Feature {
    pub name: String,
    pub case: Value,
    pub motions: Motions,
    /// Numbers that a job with several motions can vary.
    pub motion_columns: Vec<RowColumn>,
    /// Numbers that only rows can vary.
    pub columns: Vec<RowColumn>,
    /// Routes whose outcome is not the answer of the case alone.
    pub exceptions: Vec<(Route, Expected)>,
}

impl Feature {
    pub fn expected(&self, route: Route) -> Expected {
        let mut exceptions = self.exceptions.iter();
        let exception = exceptions.find(|(of, _)| *of == route);
        exception.map_or(Expected::Agrees, |(_, expected)| *expected)
    }

    /// Replaces the expected outcome of a route.
    fn but(mut self, route: Route, expected: Expected) -> Feature {
        self.exceptions.retain(|(of, _)| *of != route);
        self.exceptions.push((route, expected));
        self
    }

    fn named(mut self, name: &str) -> Feature {
        self.name = name.to_owned();
        self
    }

    fn with(mut self, pointer: &str, value: Value) -> Feature {
        let (parent, name) = pointer.rsplit_once('/').expect("a pointer");
        self.case.pointer_mut(parent).expect("an object")[name] = value;
        self
    }

    /// Replaces the creepages of the rows by prescribed forces.
    fn pulled(mut self, forces: &[RowColumn], given: Value) -> Feature {
        self.case["motion"] = given;
        self.motion_columns = forces.to_vec();
        self
    }
}

const SPEED: f64 = 20_000.0;
const CREEPAGES: [RowColumn; 3] = [
    ("/motion/creepage_x", [1e-3, -5e-4, 3e-3]),
    ("/motion/creepage_y", [-5e-4, 1e-3, 0.0]),
    ("/motion/spin_per_mm", [2e-4, -1e-4, 3e-4]),
];

/// Returns forms of friction for steady rolling.
fn frictions() -> Vec<(&'static str, Value)> {
    let layer = json!({ "shear_modulus_mpa": 1500, "thickness_mm": 0.02 });
    let yielding = json!({ "shear_modulus_mpa": 1500, "thickness_mm": 0.02, "yield_mpa": 100, "hardening_mpa_per_mm": 2000 });
    let falling = |law: &str| json!({ "law": law, "limit": 0.15, "terms": [{ "coefficient": 0.15, "half_speed_mm_per_s": 200 }] });
    let and = |mut friction: Value, name: &str, value: Value| {
        friction[name] = value;
        friction
    };
    let plain = json!({ "coefficient": 0.3 });
    let across = json!({ "across": { "y_mm": [-4.0, 4.0], "coefficient": [0.4, 0.15] } });
    vec![
        ("a coefficient", plain.clone()),
        ("no friction", json!({ "coefficient": 0.0 })),
        ("reduction", and(plain.clone(), "reduction", json!(0.3))),
        (
            "an elastic layer",
            and(plain.clone(), "layer", layer.clone()),
        ),
        (
            "a yielding layer",
            and(plain.clone(), "layer", yielding.clone()),
        ),
        (
            "layer and reduction",
            and(and(plain, "layer", layer.clone()), "reduction", json!(0.5)),
        ),
        ("exponential fall", falling("exponential")),
        ("rational fall", falling("rational")),
        ("linear fall", falling("linear")),
        (
            "exponential fall and reduction",
            and(falling("exponential"), "reduction", json!(0.5)),
        ),
        (
            "rational fall and a layer",
            and(falling("rational"), "layer", layer),
        ),
        ("across", across.clone()),
        (
            "across and reduction",
            and(across.clone(), "reduction", json!(0.5)),
        ),
        (
            "across and a yielding layer",
            and(across, "layer", yielding),
        ),
        (
            "by temperature",
            json!({ "by_temperature": { "temperature_c": [20, 400], "coefficient": [0.3, 0.1] } }),
        ),
    ]
}

/// Returns pairs of bodies.
fn bodies() -> Vec<(&'static str, Value)> {
    let steel = json!({ "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 });
    vec![
        // K = −0.01, too small for pressure and tractions to be coupled.
        (
            "hardly unlike bodies",
            json!({ "upper": steel, "lower": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.3 } }),
        ),
        // K = 0.1.
        (
            "unlike bodies",
            json!({ "upper": { "shear_modulus_mpa": 23000, "poisson_ratio": 0.31 }, "lower": steel }),
        ),
    ]
}

fn feature(name: &str, contact: Value, load: Value) -> Feature {
    let case = json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": contact,
        "load": load,
        "motion": { "speed_mm_per_s": SPEED },
        "solver": { "target_error": 0.02 },
        "outputs": ["resultants"],
    });
    Feature {
        name: name.to_owned(),
        case,
        motions: Motions::Creepages,
        motion_columns: CREEPAGES.to_vec(),
        columns: Vec::new(),
        exceptions: vec![(Route::TwoProfiles, Expected::Absent)],
    }
}

fn radii() -> Feature {
    let contact = json!({ "type": "radii", "rolling_mm": 460, "lateral_mm": 300 });
    let mut feature = feature("radii", contact, json!({ "normal_force_n": 8e4 }));
    feature.columns = vec![
        ("/load/normal_force_n", [8e4, 6e4, 9e4]),
        ("/contact/lateral_mm", [300.0, 300.0, 250.0]),
    ];
    feature
}

fn ellipse() -> Feature {
    let contact = json!({ "type": "ellipse", "a_mm": 5, "b_mm": 4 });
    let mut feature = feature("ellipse", contact, json!({ "normal_force_n": 6e4 }));
    feature.columns = vec![("/load/normal_force_n", [6e4, 5e4, 7e4])];
    feature
}

fn pressure_grid() -> Feature {
    let x: Vec<f64> = (-12..=12).map(|k| 0.5 * f64::from(k)).collect();
    let pressure = |x: f64, y: f64| 1432.0 * (1.0 - x * x / 25.0 - y * y / 16.0).max(0.0).sqrt();
    let rows: Vec<Vec<f64>> = x
        .iter()
        .map(|y| x.iter().map(|x| pressure(*x, *y)).collect())
        .collect();
    let contact = json!({ "type": "pressure_grid", "x_mm": x, "y_mm": x, "pressure_mpa": rows });
    let mut feature = feature("pressure_grid", contact, Value::Null);
    feature.case.as_object_mut().expect("a case").remove("load");
    feature
}

fn gap_profile() -> Feature {
    let y: Vec<f64> = (-48..=48).map(|k| 0.25 * f64::from(k)).collect();
    let gap: Vec<f64> = y.iter().map(|y| y * y / 600.0 + 1e-6 * y.powi(4)).collect();
    let contact = json!({ "type": "gap_profile", "rolling_mm": 460, "y_mm": y, "gap_mm": gap });
    let mut feature = feature("gap_profile", contact, json!({ "normal_force_n": 8e4 }));
    feature.columns = vec![("/load/normal_force_n", [8e4, 8e4, 7e4])];
    feature
}

fn gap_grid() -> Feature {
    let x: Vec<f64> = (-20..=20).map(|k| 0.5 * f64::from(k)).collect();
    let rows: Vec<Vec<f64>> = x
        .iter()
        .map(|y| x.iter().map(|x| x * x / 920.0 + y * y / 600.0).collect())
        .collect();
    let contact = json!({ "type": "gap_grid", "x_mm": x, "y_mm": x, "gap_mm": rows });
    feature("gap_grid", contact, json!({ "normal_force_n": 8e4 }))
}

fn wheel_on_rail() -> Value {
    json!({
        "type": "profiles", "rail": { "points_mm": rail_60e1() }, "wheel": { "points_mm": s1002() }, "side": "right",
        "rolling_radius_mm": 460, "cant_rad": 0.025,
    })
}

/// Returns a wheel of S1002 on 60E1 under the sum of its normal forces.
fn profiles() -> Feature {
    let contact = wheel_on_rail();
    let mut feature = feature("profiles", contact, json!({ "normal_force_n": 75_000 }));
    feature.motion_columns = vec![
        ("/motion/creepage_x", [1e-3, -5e-4, 2e-3]),
        ("/motion/creepage_y", [-2e-3, 1e-3, 0.0]),
        ("/motion/spin_per_mm", [2e-4, 1e-4, 2e-4]),
    ];
    feature
}

/// Returns the wheel under a vertical force. Friction carries a part of it, so that every motion has its own normal force.
fn profiles_under_vertical_force() -> Feature {
    let mut feature = profiles()
        .named("profiles under a vertical force")
        .with("/load", json!({ "vertical_force_n": 75_000 }))
        .with("/contact/lateral_shift_mm", json!(-8.0))
        .but(Route::List, Expected::SharedPatches)
        .but(Route::Sweep, Expected::SharedPatches);
    feature.motion_columns[1].1 = [0.02, -0.02, 0.0];
    feature
}

/// Returns the wheel moving with its wheelset.
fn profiles_with_wheelset() -> Feature {
    let mut feature = profiles()
        .named("profiles moving with the wheelset")
        .with(
            "/motion",
            json!({ "wheelset": { "speed_mm_per_s": SPEED, "free_rolling_radius_mm": 460.5 } }),
        )
        .but(Route::List, Expected::Refused("an object is needed"))
        .but(Route::Sweep, Expected::Absent);
    feature.motions = Motions::Wheelset;
    feature.motion_columns = vec![(
        "/motion/wheelset/lateral_velocity_mm_per_s",
        [20.0, -40.0, 0.0],
    )];
    feature.columns = vec![("/contact/lateral_shift_mm", [0.0, 1.0, 1.0])];
    feature
}

/// Returns a wheel on a rail with a guard rail. The back of the flange touches the guard rail in two of the three rows.
fn guard_rail() -> Feature {
    let text = include_str!("../../api/examples/guard-rail.case.json");
    let example: Value = serde_json::from_str(text).expect("an example");
    let mut feature = profiles_with_wheelset()
        .named("profiles with a guard rail")
        .with("/contact", example["contact"].clone())
        .with("/solver", json!({ "target_error": 0.02 }));
    feature.columns = vec![("/contact/lateral_shift_mm", [4.25, 3.0, 4.24])];
    feature
}

fn wheelset() -> Feature {
    let mut contact = wheel_on_rail();
    let members = contact.as_object_mut().expect("a contact");
    members.remove("side");
    members.insert("type".to_owned(), json!("wheelset"));
    let load = json!({ "vertical_force_n": 150_000 });
    let mut feature = feature("wheelset", contact, load)
        .with(
            "/motion",
            json!({ "wheelset": { "speed_mm_per_s": SPEED, "free_rolling_radius_mm": 460.2 } }),
        )
        .but(Route::Sweep, Expected::Absent)
        .but(Route::TwoProfiles, Expected::Agrees);
    feature.motions = Motions::Wheelset;
    feature.motion_columns = vec![(
        "/motion/wheelset/lateral_velocity_mm_per_s",
        [20.0, -40.0, 0.0],
    )];
    feature.columns = vec![("/contact/lateral_shift_mm", [0.0, 1.5, -3.0])];
    feature
}

/// Returns a contact with a form of friction.
fn rubbing(mut feature: Feature, (name, friction): &(&'static str, Value)) -> Feature {
    feature.name = format!("{}, {name}", feature.name);
    feature.case["friction"] = friction.clone();
    if friction.get("by_temperature").is_some() {
        feature.case["thermal"] = json!({
            "conductivity_w_per_mk": 50, "density_kg_per_m3": 7850, "specific_heat_j_per_kgk": 450, "bulk_c": 20
        });
    }
    let plain = friction.get("coefficient").is_some() && friction.get("layer").is_none();
    let elliptic = ["radii", "ellipse"]
        .map(Value::from)
        .contains(&feature.case["contact"]["type"]);
    if plain && elliptic && friction["coefficient"] != json!(0.0) {
        feature
            .columns
            .push(("/friction/coefficient", [0.3, 0.25, 0.35]));
    }
    let frictionless = friction["coefficient"] == json!(0.0);
    if frictionless && feature.expected(Route::List) == Expected::SharedPatches {
        // Only normal forces balance the load.
        feature = feature
            .but(Route::List, Expected::Agrees)
            .but(Route::Sweep, Expected::Agrees);
    }
    feature
}

/// Returns a contact between a pair of bodies.
fn between(mut feature: Feature, (name, material): &(&'static str, Value)) -> Feature {
    feature.name = format!("{}, {name}", feature.name);
    feature.case["material"] = material.clone();
    feature
}

/// Returns questions on an ellipse: methods, outputs, loads, forces, histories.
fn questions() -> Vec<Feature> {
    let mut approached = radii()
        .named("an approach")
        .with("/load", json!({ "approach_mm": 0.06 }));
    approached.columns = vec![("/load/approach_mm", [0.06, 0.05, 0.07])];
    let of_outputs = [
        json!(["zones"]),
        json!(["tractions", "pressure", "slip"]),
        json!(["resultants", "zones", "tractions"]),
    ];
    let mut features = vec![approached, guard_rail()];
    features.extend(of_outputs.map(|outputs| {
        radii()
            .named(&format!("outputs {outputs}"))
            .with("/outputs", outputs)
    }));
    features.extend(methods());
    features.extend(histories());
    features.extend(forced());
    features
}

fn methods() -> Vec<Feature> {
    let mesh = json!({ "strips": 8, "cells": 12 });
    let named = |name: &str, solver: Value| radii().named(name).with("/solver", solver);
    let other = |name: &str, solver: Value| named(name, solver);
    let by_table = json!({ "method": "table", "target_error": 0.02 });
    vec![
        named("table", by_table.clone()),
        named("table with gradients", by_table)
            .with("/outputs", json!(["gradients", "resultants"])),
        named("fastsim", json!({ "method": "fastsim" })),
        named("fastsim with gradients", json!({ "method": "fastsim" }))
            .with("/outputs", json!(["gradients", "resultants"])),
        named("auto with gradients", json!({ "method": "auto" }))
            .with("/outputs", json!(["gradients", "resultants"])),
        named(
            "fastsim with a parabolic bound",
            json!({ "method": "fastsim", "traction_bound": "parabolic" }),
        ),
        named(
            "fastsim on a mesh",
            json!({ "method": "fastsim", "mesh": mesh }),
        ),
        other(
            "boundary_element",
            json!({ "method": "boundary_element", "target_error": 0.02 }),
        ),
        other(
            "boundary_element on a mesh",
            json!({ "method": "boundary_element", "mesh": mesh }),
        ),
        named("auto on a mesh", json!({ "mesh": mesh })),
        other(
            "liu_hsu",
            json!({ "method": "liu_hsu", "mesh": { "strips": 6, "cells": 8 } }),
        ),
    ]
}

fn histories() -> Vec<Feature> {
    let of_contact = |contact: Feature, name: &str, motion: Value| {
        contact
            .named(name)
            .with("/motion", motion)
            .but(Route::List, Expected::Absent)
            .but(Route::Sweep, Expected::Absent)
    };
    let of = |name: &str, motion: Value| of_contact(ellipse(), name, motion);
    let point_of = |contact: Feature, name: &str, start: &str| {
        let point = json!({ "distance_mm": [0.0], "creepage_x": [1e-3], "creepage_y": [-5e-4] });
        let mut feature = of_contact(contact, name, json!({ "history": point, "start": start }));
        feature.motion_columns = vec![("/motion/history/creepage_x/0", [1e-3, -5e-4, 2e-3])];
        feature
    };
    let one_point = |name: &str, start: &str| point_of(ellipse(), name, start);
    let along = json!({ "along": { "x_mm": [-2.0, 2.0], "coefficient": [0.35, 0.2] } });
    let several = json!({ "distance_mm": [0, 2, 4, 8], "creepage_x": 1e-3, "creepage_y": 0.0 });
    let several_points = Expected::Refused("a row has one motion");
    let mut whole = of("a history", json!({ "history": several }))
        .but(Route::Run, several_points)
        .but(Route::RunOfMotions, several_points)
        .but(Route::Evaluate, Expected::Refused("row 0 is refused"));
    whole.motion_columns = vec![("/motion/history/creepage_x", [1e-3, -5e-4, 2e-3])];
    vec![
        one_point("one point of a history", "steady"),
        point_of(profiles(), "one point of a history of profiles", "steady"),
        one_point("one point of a history, along", "steady").with("/friction", along),
        one_point("bodies pressed together", "pressed"),
        whole,
    ]
}

/// Returns cases with prescribed forces in place of creepages.
fn forced() -> Vec<Feature> {
    let force_x: RowColumn = ("/motion/force_x_n", [9e3, -6e3, 4e3]);
    let force_y: RowColumn = ("/motion/force_y_n", [-4e3, 3e3, 5e3]);
    let spin = json!({ "spin_per_mm": 1e-4 });
    let (frictions, bodies) = (frictions(), bodies());
    let ellipses = || radii().named("forces");
    let both = vec![
        ellipses(),
        rubbing(ellipses(), &frictions[2]),
        rubbing(ellipses(), &frictions[3]),
        rubbing(ellipses(), &frictions[11]),
        between(ellipses(), &bodies[0]),
        between(ellipses(), &bodies[1]),
        gap_profile().named("forces on a gap_profile"),
    ];
    let both = both.into_iter();
    let mut features: Vec<Feature> = both
        .map(|feature| feature.pulled(&[force_x, force_y], spin.clone()))
        .collect();
    features.push(radii().named("a longitudinal force").pulled(
        &[force_x],
        json!({ "creepage_y": 2e-4, "spin_per_mm": 1e-4 }),
    ));
    let of_wheel = [("/motion/force_x_n", [5e3, -4e3, 7e3])];
    let shared = Expected::Refused("share their patches");
    features.push(
        profiles()
            .named("a force on profiles")
            .pulled(
                &of_wheel,
                json!({ "creepage_y": 1e-3, "spin_per_mm": 2e-4 }),
            )
            .but(Route::List, shared)
            .but(Route::Sweep, shared),
    );
    features
}

fn contacts() -> Vec<Feature> {
    vec![
        radii(),
        ellipse(),
        pressure_grid(),
        gap_profile(),
        gap_grid(),
        profiles(),
        profiles_under_vertical_force(),
        profiles_with_wheelset(),
        wheelset(),
    ]
}

/// Returns the indices of the forms of friction that a contact is combined with in the short selection.
fn short(contact: &Feature) -> &'static [usize] {
    match &*contact.name {
        "radii" => &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14],
        "profiles" => &[0, 2, 11],
        "wheelset" => &[0, 2],
        _ => &[0, 5],
    }
}

/// Returns every form of friction, every contact and every question. With `full`, combines every form of friction, contact and pair of bodies.
pub fn selection(full: bool) -> Vec<Feature> {
    let (frictions, bodies) = (frictions(), bodies());
    let mut features = Vec::new();
    for contact in contacts() {
        let chosen = match full {
            true => (0..frictions.len()).collect(),
            false => short(&contact).to_vec(),
        };
        for friction in chosen {
            let rubbing = rubbing(contact.clone(), &frictions[friction]);
            if full {
                features.extend(bodies.iter().map(|pair| between(rubbing.clone(), pair)));
            }
            features.push(rubbing);
        }
    }
    for pair in &bodies {
        // Similar ellipses with different friction coefficients.
        let mut similar = rubbing(radii(), &frictions[0]);
        similar
            .columns
            .retain(|(pointer, _)| *pointer != "/contact/lateral_mm");
        features.push(between(similar, pair));
        features.push(between(rubbing(ellipse(), &frictions[5]), pair));
        features.push(between(pressure_grid(), pair));
    }
    features.push(between(gap_profile(), &bodies[1]));
    features.extend(questions());
    features
}
