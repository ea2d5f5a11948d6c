//! Patches, pressures and forces of wheel on rail against converged results of an independent program. Needs the reference
//! files beside the checkout.

use std::f64::consts::PI;

use railhead::contact::solution::{PatchSolution, Position};
use serde_json::{Value, json};

use crate::profile_cases::{benchmark, put};
use crate::profile_reference_files::reference_file;
use crate::reference::{Converged, assert_none, solve};

/// What is allowed beside the uncertainty of the reference: relative, the resultants to μN and μN√(A/π).
const APPROACH: f64 = 0.003;
const AREA: f64 = 0.02;
const PRESSURE_MAX: f64 = 0.02;
const RESULTANT: f64 = 0.01;

fn list(value: &Value) -> Vec<f64> {
    let elements = value.as_array().expect("an array").iter();
    elements.map(|v| v.as_f64().expect("a number")).collect()
}

/// One record of the reference, turned by half a turn about x: there body 1 is the rail and z points down.
pub struct Record {
    pub id: String,
    pub question: Value,
    /// Where creepages and moments are counted from, in our track axes.
    pub place: [f64; 3],
    pub angle: f64,
    pub motion: [f64; 3],
    converged: Value,
}

impl Record {
    pub fn converged(&self, name: &str) -> Converged {
        let number = |part: &str| self.converged[name][part].as_f64().expect("a number");
        Converged {
            value: number("value"),
            unc: number("unc"),
        }
    }

    fn new(record: &Value) -> Option<Record> {
        let (input, patch) = (&record["input"], &record["patches"][0]);
        let shift = input["y_ws_mm"].as_f64().expect("a shift");
        // The benchmark's yaw grows with the shift; roll and pitch are read off the place of the contact below.
        let yaw = input["yaw_rad"].as_f64().unwrap_or(2.4e-3 * shift);
        let on_track = list(&patch["contact_ref_track_xyz_delta_and_rail_yz"]);
        let on_wheel = list(&patch["contact_ref_wheel"]);
        let along = (750.0 + on_wheel[1]) * yaw.cos() + on_wheel[0] * yaw.sin();
        let roll = -(on_track[1] - shift - along) / (460.0 + on_wheel[2]);
        let placed = put(
            &benchmark()?,
            "contact",
            json!({ "lateral_shift_mm": -shift, "yaw_rad": -yaw, "roll_rad": roll }),
        );
        let load = json!({ "vertical_force_n": input["fz_N"] });
        let value = |name: &str| patch["converged"][name]["value"].as_f64().expect("a number");
        Some(Record {
            id: record["id"].as_str().expect("an id").to_owned(),
            question: put(&placed, "load", load),
            place: [on_track[0], -on_track[1], -on_track[2]],
            angle: on_track[3],
            motion: [-value("xi"), value("eta"), value("phi")],
            converged: patch["converged"].clone(),
        })
    }

    pub fn all() -> Option<Vec<Record>> {
        let text = reference_file("profile_module1.json")?;
        let records: Vec<Value> = serde_json::from_str(&text).expect("JSON");
        records.iter().map(Record::new).collect()
    }

    /// From the reference's point to a place, in the plane of contact.
    fn to(&self, position: &Position) -> [f64; 2] {
        let away = [0, 1, 2].map(|k| position.track_mm[k] - self.place[k]);
        [away[0], away[1] * self.angle.cos() + away[2] * self.angle.sin()]
    }

    /// The same motion about another place.
    fn motion_at(&self, position: &Position) -> Value {
        let ([x, y, spin], [u, v]) = (self.motion, self.to(position));
        json!({ "creepage_x": x - spin * v, "creepage_y": y + spin * u, "spin_per_mm": spin })
    }
}

fn position(patch: &PatchSolution) -> Position {
    patch.position.expect("a position")
}

/// Every quantity that is off by more than is allowed.
fn failures(record: &Record) -> Vec<String> {
    let [x, y, spin] = record.motion;
    let motion = json!({ "creepage_x": x, "creepage_y": y, "spin_per_mm": spin });
    let (first, _) = solve(&put(&record.question, "motion", motion));
    let there = position(&first.patches[0]);
    let (solution, _) = solve(&put(&record.question, "motion", record.motion_at(&there)));
    let mut failures = Vec::new();
    if solution.patches.len() != 1 {
        failures.push(format!("{}: {} patches", record.id, solution.patches.len()));
    }
    let patch = &solution.patches[0];
    let point = &patch.points[0];
    let mut compare = |name: &str, found: f64, expected: Converged, scale: f64, allowed: f64| {
        let (error, unc) = ((found - expected.value) / scale, expected.unc / scale.abs());
        eprintln!("{} {name} {found:.6} {:.6} {error:+.5} {unc:.5}", record.id, expected.value);
        if error.abs() > allowed + unc {
            failures.push(format!(
                "{} {name}: {found} for {} is off by {error:+.5} ± {unc:.5}, {allowed} is allowed",
                record.id, expected.value
            ));
        }
    };
    let found = [
        ("approach_mm", patch.approach_mm.expect("an approach"), APPROACH),
        ("area_mm2", patch.area_mm2, AREA),
        ("pmax_MPa", patch.pressure_max_mpa, PRESSURE_MAX),
        ("Fn_N", patch.normal_force_n, RESULTANT),
    ];
    for (name, found, allowed) in found {
        let expected = record.converged(name);
        compare(name, found, expected, expected.value, allowed);
    }
    let bound = 0.3 * record.converged("Fn_N").value;
    let length = (record.converged("area_mm2").value / PI).sqrt();
    let turned = |expected: Converged| Converged {
        value: -expected.value,
        ..expected
    };
    let [force_x, force_y] = [record.converged("Fx_N"), turned(record.converged("Fy_N"))];
    let [u, v] = record.to(&position(patch));
    let mut moment = turned(record.converged("Mz_Nmm"));
    moment.value += v * force_x.value - u * force_y.value;
    compare("F_x", point.force_x_n, force_x, bound, RESULTANT);
    compare("F_y", point.force_y_n, force_y, bound, RESULTANT);
    compare("M_z", point.moment_z_n_mm, moment, bound * length, RESULTANT);
    failures
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
