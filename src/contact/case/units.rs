//! Remarks on numbers of a case that seem to be given in another unit. Nothing is refused here.
//!
//! A number is suspect if it is unusual for wheel and rail in its own unit and usual in another one. Lengths of wheel and track are checked in
//! `contact_task`.

use serde_json::Value;

use crate::case::words::contact::Contact;
use crate::case::words::material::Material;
use crate::case::words::solver::Case;
use crate::geometry::profile::LengthUnit;
use crate::normal::hertz::Patch;
use crate::problem::checked_case::PRESSURE_USUAL_MAX;
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;

/// Smallest usual load of a wheel in N.
const LOAD_LEAST: f64 = 1e3;
/// Smallest usual rolling radius of a wheel, or relative radius of wheel and rail, in mm.
const RADIUS_LEAST: f64 = 250.0;
/// Smallest usual rolling speed of a wheel in mm/s.
const SPEED_LEAST: f64 = 500.0;
/// Range of the shear moduli of metals in GPa; Young's moduli are 2.5 times as large.
const SHEAR_GPA: [f64; 2] = [10.0, 1000.0];
/// Poisson's ratio below which a body is a metal. Soft plastics, whose moduli in MPa have similar values, have a larger one.
const POISSON_METAL: f64 = 0.36;
/// Range of creepages that are probably given in per cent.
const CREEPAGE_PERCENT: [f64; 2] = [0.05, 5.0];
/// Largest yaw and roll of a wheelset in rad, and cant of a rail.
const ANGLE_MOST: f64 = 0.05;
/// Range of usual pressures of wheels on rails in MPa.
const PRESSURES: [f64; 2] = [200.0, 3500.0];

/// Properties of metals that are often given in another unit: the smallest usual value, its unit and the other one.
const LEAST_OF_METALS: [(&str, f64, &str, &str); 5] = [
    ("conductivity_w_per_mk", 1.0, "W/(m K)", "W/(mm K)"),
    ("specific_heat_j_per_kgk", 10.0, "J/(kg K)", "J/(g K)"),
    ("density_kg_per_m3", 100.0, "kg/m³", "g/cm³"),
    ("hardness_mpa", 700.0, "MPa", "HB or HV"),
    ("shear_yield_mpa", 10.0, "MPa", "GPa"),
];

/// Returns the remark on a number that seems to be in another unit.
fn suspect(pointer: &str, given: f64, unit: &str, likely_unit: &str) -> RemarkEntry {
    let remark = Remark::UnitSuspected {
        given,
        unit: unit.to_owned(),
        likely_unit: likely_unit.to_owned(),
    };
    remark.at_pointer(pointer)
}

fn is_within(value: f64, [low, high]: [f64; 2]) -> bool {
    (low..=high).contains(&value)
}

/// Returns the number at a pointer into a case, of several values the one with the largest magnitude.
fn number_at(case: &Value, pointer: &str) -> Option<f64> {
    let larger = |a: f64, b: f64| if b.abs() > a.abs() { b } else { a };
    match case.pointer(pointer)? {
        Value::Array(values) => values.iter().filter_map(Value::as_f64).reduce(larger),
        Value::Object(range) if range.contains_key("values") => {
            number_at(case, &format!("{pointer}/values"))
        }
        Value::Object(range) => {
            let ends = ["from", "to"].map(|end| range.get(end)?.as_f64());
            ends.into_iter().flatten().reduce(larger)
        }
        value => value.as_f64(),
    }
}

/// Returns the remarks on numbers that seem to be in another unit. `given` is the case as it was read.
pub(crate) fn remarks(case: &Case, given: &Value, patches: &[Patch]) -> Vec<RemarkEntry> {
    let of_material = of_material(given);
    let is_metal = is_metal(&case.material, &of_material);
    let mut suspects = of_material;
    if is_metal {
        suspects.extend(of_metal(given));
        suspects.extend(of_load(&case.contact, given, patches));
    }
    suspects.extend(lengths_of_patch(&case.contact, patches));
    suspects.extend(of_place(given));
    suspects.extend(of_motion(given));
    suspects
}

/// The places of the constants of a body in `material` and `thermal`, those that both bodies share first.
const BODIES: [&str; 3] = ["", "/lower", "/upper"];

fn of_material(given: &Value) -> Vec<RemarkEntry> {
    let mut suspects = Vec::new();
    for body in BODIES {
        let poisson = number_at(given, &format!("/material{body}/poisson_ratio"));
        let is_metal = poisson.is_some_and(|ratio| ratio < POISSON_METAL);
        for (name, factor) in [("shear_modulus_mpa", 1.0), ("young_modulus_mpa", 2.5)] {
            let pointer = format!("/material{body}/{name}");
            let modulus = number_at(given, &pointer).filter(|_| is_metal);
            let modulus = modulus.filter(|value| is_within(*value, SHEAR_GPA.map(|g| factor * g)));
            suspects.extend(modulus.map(|value| suspect(&pointer, value, "MPa", "GPa")));
        }
    }
    suspects
}

/// Whether both bodies are metals, with moduli in MPa or, by the remarks on them, in GPa.
fn is_metal(material: &Material, suspects: &[RemarkEntry]) -> bool {
    let suspected = |body: &str| {
        let mut pointers = suspects.iter().filter_map(|one| one.pointer.as_deref());
        pointers.any(|pointer| pointer.starts_with(body))
    };
    let places = match material {
        Material::Same(_) => ["/material"; 2],
        Material::Pair { .. } => ["/material/lower", "/material/upper"],
    };
    let mut bodies = material.bodies().into_iter().zip(places);
    bodies
        .all(|(body, place)| body.shear().unwrap_or(0.0) >= 1e3 * SHEAR_GPA[0] || suspected(place))
}

/// Returns the remarks on thermal properties and on parameters of damage models.
fn of_metal(given: &Value) -> Vec<RemarkEntry> {
    let thermal = BODIES.map(|body| (format!("/thermal{body}"), &LEAST_OF_METALS[..3]));
    let damage = ("/damage/parameters".to_owned(), &LEAST_OF_METALS[2..]);
    let places = thermal.into_iter().chain([damage]);
    let all = places.flat_map(|(place, usual)| {
        usual.iter().filter_map(move |(name, least, unit, likely)| {
            let pointer = format!("{place}/{name}");
            let value = number_at(given, &pointer).filter(|value| value < least)?;
            Some(suspect(&pointer, value, unit, likely))
        })
    });
    all.collect()
}

/// Returns the remark on the load of two metals.
fn of_load(contact: &Contact, given: &Value, patches: &[Patch]) -> Option<RemarkEntry> {
    let pointers = ["/load/normal_force_n", "/load/vertical_force_n"];
    let (pointer, force) = pointers
        .into_iter()
        .find_map(|at| Some((at, number_at(given, at)?)))?;
    let wheels = match contact {
        Contact::Wheelset { .. } => 2.0,
        _ => 1.0,
    };
    let radius = match *contact {
        Contact::Radii { rolling_mm, .. } | Contact::GapProfile { rolling_mm, .. } => {
            Some(rolling_mm)
        }
        _ => contact
            .on_rails()
            .map(|rails| rails.placement.rolling_radius),
    };
    let of_wheel = match contact {
        // The pressure of a given ellipse grows with its load.
        Contact::Ellipse { .. } => patches
            .iter()
            .any(|patch| is_within(1e3 * patch.pressure_max, PRESSURES)),
        _ => radius.is_some_and(|radius| radius >= RADIUS_LEAST),
    };
    (of_wheel && force < wheels * LOAD_LEAST).then(|| suspect(pointer, force, "N", "kN"))
}

/// Returns the units of length in which the pressure of a patch would be usual; it falls with this power of the length.
fn units_by_pressure(patches: &[Patch], power: f64) -> Option<String> {
    let pressure = patches.first()?.pressure_max;
    let usual = |unit: &LengthUnit| is_within(pressure / unit.mm().powf(power), PRESSURES);
    let units = [LengthUnit::M, LengthUnit::Cm, LengthUnit::Inch].into_iter();
    let units: Vec<&str> = units.filter(usual).map(LengthUnit::name).collect();
    (pressure > PRESSURE_USUAL_MAX && !units.is_empty()).then(|| units.join(" or "))
}

fn lengths_of_patch(contact: &Contact, patches: &[Patch]) -> Option<RemarkEntry> {
    match *contact {
        Contact::Radii { rolling_mm, .. } if rolling_mm < RADIUS_LEAST => {
            // Hertz: p ∝ R^(−2/3).
            let units = units_by_pressure(patches, 2.0 / 3.0)?;
            Some(suspect("/contact/rolling_mm", rolling_mm, "mm", &units))
        }
        Contact::Ellipse { a_mm, .. } => {
            let units = units_by_pressure(patches, 2.0)?;
            Some(suspect("/contact/a_mm", a_mm, "mm", &units))
        }
        _ => None,
    }
}

/// Returns the remarks on the angles of wheel and rail.
fn of_place(given: &Value) -> Vec<RemarkEntry> {
    // Rails may be inclined by twice the usual angle.
    let angles = [
        ("/contact/cant_rad", 2.0 * ANGLE_MOST),
        ("/contact/yaw_rad", ANGLE_MOST),
        ("/contact/roll_rad", ANGLE_MOST),
    ];
    let large = angles.into_iter().filter_map(|(pointer, most)| {
        let angle = number_at(given, pointer).filter(|angle| angle.abs() > most)?;
        Some(suspect(pointer, angle, "rad", "degrees"))
    });
    large.collect()
}

/// Returns the remarks on creepages and speeds; for several motions those on the first unusual ones.
fn of_motion(given: &Value) -> Vec<RemarkEntry> {
    let mut motions = Vec::new();
    for place in ["", "/sweep", "/history", "/wheelset"] {
        let place = format!("/motion{place}");
        match given.pointer(&place) {
            Some(Value::Array(all)) => {
                motions.extend((0..all.len()).map(|k| format!("{place}/{k}")));
            }
            _ => motions.push(place),
        }
    }
    let is_percent = |creepage: f64| is_within(creepage.abs(), CREEPAGE_PERCENT);
    let is_slow = |speed: f64| 0.0 < speed && speed < SPEED_LEAST;
    let first = |name: &str, unusual: &dyn Fn(f64) -> bool, unit: &str, likely: &str| {
        motions.iter().find_map(|motion| {
            let pointer = format!("{motion}/{name}");
            let value = number_at(given, &pointer).filter(|value| unusual(*value))?;
            Some(suspect(&pointer, value, unit, likely))
        })
    };
    let remarks = [
        first("creepage_x", &is_percent, "as a ratio", "per cent"),
        first("creepage_y", &is_percent, "as a ratio", "per cent"),
        first("speed_mm_per_s", &is_slow, "mm/s", "m/s or km/h"),
    ];
    remarks.into_iter().flatten().collect()
}
