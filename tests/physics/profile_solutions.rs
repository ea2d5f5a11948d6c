//! Tests patches, pressures and forces of wheel on rail against converged results of an independent program. Needs the reference files next to the
//! checkout.

use std::f64::consts::PI;

use railhead_contact::solution::words::answer::{PatchSolution, Position};
use serde_json::{Value, json};

use crate::profile_cases::{benchmark, put};
use crate::profile_reference_files::reference_file;
use crate::reference::{Converged, assert_none, solve};

/// Load centres `[x, y]` in mm of the reference's pressures in its own coordinates (y to the field side), from its tables of pressures per element.
const LOAD_CENTRES: [(&str, [f64; 2]); 10] = [
    ("prof_y-3_75kN_yaw", [-0.0003, 0.1154]),
    ("prof_y0_10kN_bench", [0.0, -0.4331]),
    ("prof_y0_75kN", [0.0, -0.2396]),
    ("prof_y10_10kN_bench", [0.0038, -0.0125]),
    ("prof_y1_75kN", [0.0, -0.1109]),
    ("prof_y2_75kN", [0.0, -0.3736]),
    ("prof_y4_75kN_yaw", [-0.0006, 0.0662]),
    ("prof_y5_10kN_bench", [-0.0992, 0.9061]),
    ("prof_y5_75kN_lowslip", [0.0, -0.5016]),
    ("prof_y6_10kN_bench", [-0.0319, 0.0366]),
];

/// In this record the reference has two patches 8 mm apart that press on each other's surface only in part, between one gap and two. Only those sums
/// that hardly depend on this are compared.
const HALF_MERGED: &str = "prof_y5_10kN_bench";
/// Allowed distance of the load centre from the reference's, in mm.
const PLACE: f64 = 0.1;
/// Allowed errors beyond the uncertainty of the reference. They are relative, those of the resultants to μN and μN√(A/π).
const APPROACH: f64 = 0.003;
const AREA: f64 = 0.02;
const PRESSURE_MAX: f64 = 0.02;
const RESULTANT: f64 = 0.01;

fn list(value: &Value) -> Vec<f64> {
    let elements = value.as_array().expect("an array").iter();
    elements.map(|v| v.as_f64().expect("a number")).collect()
}

/// A record of the reference, rotated by half a turn about x. In the reference, body 1 is the rail and z points down.
struct Record {
    id: String,
    question: Value,
    /// Reference point of creepages and moments, in railhead's track axes.
    place: [f64; 3],
    angle: f64,
    motion: [f64; 3],
    /// Angular velocity about the axle at 2 m/s, if stored.
    turning: Option<f64>,
    converged: Value,
}

impl Record {
    fn converged(&self, name: &str) -> Converged {
        let number = |part: &str| self.converged[name][part].as_f64().expect("a number");
        Converged {
            value: number("value"),
            unc: number("unc"),
        }
    }

    fn new(record: &Value) -> Option<Record> {
        let (input, patch) = (&record["input"], &record["patches"][0]);
        let shift = input["y_ws_mm"].as_f64().expect("a shift");
        // The benchmark's yaw grows with the shift. Roll and pitch follow from the place of the contact below.
        let yaw = input["yaw_rad"].as_f64().unwrap_or(2.4e-3 * shift);
        let on_track = list(&patch["contact_ref_track_xyz_delta_and_rail_yz"]);
        let on_wheel = list(&patch["contact_ref_wheel"]);
        // The lateral position of the contact circle gives the roll, by iteration of the cosine.
        let (along, across) = ((750.0 + on_wheel[1]) * yaw.cos(), on_wheel[0] * yaw.sin());
        let radius = 460.0 + on_wheel[2];
        let from = |roll: f64| (along * roll.cos() + across + shift - on_track[1]) / radius;
        let roll = (0..20).fold(0.0, |roll, _| from(roll).asin());
        let placed = put(
            &benchmark()?,
            "contact",
            json!({ "lateral_shift_mm": -shift, "yaw_rad": -yaw, "roll_rad": roll, "reference_surface": "plane" }),
        );
        let load = json!({ "vertical_force_n": input["fz_N"] });
        let value = |name: &str| {
            patch["converged"][name]["value"]
                .as_f64()
                .expect("a number")
        };
        Some(Record {
            id: record["id"].as_str().expect("an id").to_owned(),
            question: put(&placed, "load", load),
            place: [on_track[0], -on_track[1], -on_track[2]],
            angle: on_track[3],
            turning: input["vpitch_rad_per_s"].as_f64().map(|pitch| -pitch),
            motion: [-value("xi"), value("eta"), value("phi")],
            converged: patch["converged"].clone(),
        })
    }

    fn all() -> Option<Vec<Record>> {
        let text = reference_file("profile_module1.json")?;
        let records: Vec<Value> = serde_json::from_str(&text).expect("JSON");
        records.iter().map(Record::new).collect()
    }

    /// Returns the load centre in the reference's plane of contact, with y to the left.
    fn load_centre(&self) -> [f64; 2] {
        let known = LOAD_CENTRES.iter().find(|(id, _)| *id == self.id);
        let [x, y] = known.expect("a load centre").1;
        [x, -y]
    }

    /// Returns the distance of a place from the reference's load centre, in mm.
    fn away(&self, at: [f64; 3]) -> f64 {
        let away = [0, 1, 2].map(|k| at[k] - self.place[k]);
        let (sin, cos) = self.angle.sin_cos();
        let [u, v] = self.load_centre();
        (away[0] - u).hypot(away[1] * cos + away[2] * sin - v)
    }

    /// Returns the motion about the load centre.
    fn motion(&self) -> Value {
        let ([x, y, spin], [u, v]) = (self.motion, self.load_centre());
        json!({ "creepage_x": x - spin * v, "creepage_y": y + spin * u, "spin_per_mm": spin })
    }
}

fn position(patch: &PatchSolution) -> Position {
    patch.position.expect("a position")
}

/// Returns the load centre of all patches in track axes.
fn load_centre(patches: &[PatchSolution]) -> [f64; 3] {
    let load: f64 = patches.iter().map(|patch| patch.normal_force_n).sum();
    [0, 1, 2].map(|k| {
        let weighted = |patch: &PatchSolution| patch.normal_force_n * position(patch).track_mm[k];
        patches.iter().map(weighted).sum::<f64>() / load
    })
}

/// Returns the moment of all patches about their common load centre.
fn moment_of_all(patches: &[PatchSolution]) -> f64 {
    let origin = load_centre(patches);
    let of_patch = |patch: &PatchSolution| {
        let place = position(patch);
        let [x, y, z] = [0, 1, 2].map(|k| place.track_mm[k] - origin[k]);
        let (sin, cos) = place.contact_angle_rad.sin_cos();
        let point = &patch.points[0];
        point.moment_z_n_mm + x * point.force_y_n - (y * cos + z * sin) * point.force_x_n
    };
    patches.iter().map(of_patch).sum()
}

/// Returns a message for every quantity that is off by more than is allowed.
fn failures(record: &Record) -> Vec<String> {
    let (solution, _) = solve(&put(&record.question, "motion", record.motion()));
    let mut failures = Vec::new();
    // Neighbouring patches share a plane, and the reference counts them as one.
    let patches = &solution.patches;
    let origin = load_centre(patches);
    let angle = |patch: &PatchSolution| position(patch).contact_angle_rad;
    let shared = patches
        .iter()
        .all(|patch| (angle(patch) - angle(&patches[0])).abs() < 1e-9);
    let away = record.away(origin);
    let place = if record.id == HALF_MERGED {
        3.0 * PLACE
    } else {
        PLACE
    };
    if !shared || away > place {
        failures.push(format!(
            "{}: {} patches, {away} mm away",
            record.id,
            patches.len()
        ));
    }
    let sum = |of: fn(&PatchSolution) -> f64| patches.iter().map(of).sum::<f64>();
    let peak = patches.iter().map(|patch| patch.pressure_max_mpa);
    // The reference has one approach for all patches, that of the deepest one.
    let overlaps = patches.iter().filter_map(|patch| patch.approach_mm);
    let mut compare = |name: &str, found: f64, expected: Converged, scale: f64, allowed: f64| {
        if record.id == HALF_MERGED && ["approach_mm", "area_mm2", "M_z"].contains(&name) {
            return;
        }
        let (error, unc) = ((found - expected.value) / scale, expected.unc / scale.abs());
        if error.abs() > allowed + unc {
            failures.push(format!(
                "{} {name}: {found} for {} is off by {error:+.5} ± {unc:.5}, {allowed} is allowed",
                record.id, expected.value
            ));
        }
    };
    let found = [
        ("approach_mm", overlaps.fold(0.0, f64::max), APPROACH),
        ("area_mm2", sum(|patch| patch.area_mm2), AREA),
        ("pmax_MPa", peak.fold(0.0, f64::max), PRESSURE_MAX),
        ("Fn_N", sum(|patch| patch.normal_force_n), RESULTANT),
    ];
    for (name, found, allowed) in found {
        let expected = record.converged(name);
        compare(name, found, expected, expected.value, allowed);
    }
    for (name, found, expected, scale) in resultants(record, patches) {
        compare(name, found, expected, scale, RESULTANT);
    }
    failures
}

/// Returns the names of forces and moment, the found values, the reference values, and the units of the errors.
fn resultants(
    record: &Record,
    patches: &[PatchSolution],
) -> [(&'static str, f64, Converged, f64); 3] {
    let sum = |of: fn(&PatchSolution) -> f64| patches.iter().map(of).sum::<f64>();
    let bound = 0.3 * record.converged("Fn_N").value;
    let length = (record.converged("area_mm2").value / PI).sqrt();
    let turned = |expected: Converged| Converged {
        value: -expected.value,
        ..expected
    };
    let [force_x, force_y] = [record.converged("Fx_N"), turned(record.converged("Fy_N"))];
    let mut moment = turned(record.converged("Mz_Nmm"));
    let [u, v] = record.load_centre();
    moment.value += v * force_x.value - u * force_y.value;
    [
        (
            "F_x",
            sum(|patch| patch.points[0].force_x_n),
            force_x,
            bound,
        ),
        (
            "F_y",
            sum(|patch| patch.points[0].force_y_n),
            force_y,
            bound,
        ),
        ("M_z", moment_of_all(patches), moment, bound * length),
    ]
}

#[test]
fn wheel_on_rail_agrees_with_the_reference() {
    let Some(records) = Record::all() else {
        return;
    };
    assert_eq!(records.len(), 10);
    let failures: Vec<String> = records.iter().flat_map(failures).collect();
    assert_none("too far from the converged value", &failures);
}

/// Tests the same motions given by the wheelset's speed and angular velocity. CONTACT takes the rolling radius at the deepest overlap.
#[test]
fn creepages_of_a_wheelset_agree_with_the_reference() {
    let Some(records) = Record::all() else {
        return;
    };
    let mut compared = 0;
    for record in &records {
        let Some(turning) = record.turning else {
            continue;
        };
        let wheelset = json!({ "speed_mm_per_s": 2000, "angular_velocity_rad_per_s": turning });
        let mut question = record.question.clone();
        question["motion"] = json!({ "wheelset": wheelset });
        let (solution, _) = solve(&question);
        let found = solution.patches[0].points[0].motion;
        let expected = record.motion();
        let off = |name: &str, found: f64| found - expected[name].as_f64().expect("a number");
        // The places differ by up to 0.15 mm, where the radius changes with the slope of the wheel.
        let steep = 3e-4 * record.angle.abs();
        if solution.patches.len() > 1 {
            // The reference's point lies on the surface between two patches, 0.15 mm off the plane through both.
            continue;
        }
        assert!(
            off("creepage_x", found.creepage_x).abs() < 4e-5 + steep,
            "{}",
            record.id
        );
        assert!(
            off("creepage_y", found.creepage_y).abs() < 2e-6,
            "{}",
            record.id
        );
        assert!(
            off("spin_per_mm", found.spin_per_mm).abs() < 6e-6,
            "{}",
            record.id
        );
        compared += 1;
    }
    assert_eq!(compared, 5);
}
