//! Remarks on numbers of a case that seem to be given in another unit. Nothing is refused here.
//!
//! A number is suspect if it is unusual for wheel and rail in its own unit and usual in another one. Lengths of wheel and track are checked in
//! `contact_task`.

use crate::case::words::contact::{Contact, Load};
use crate::case::words::material::{Material, Thermal};
use crate::case::words::motion::{AskedMotion, Course, Motions, Swept, Wheelset};
use crate::case::words::solver::Case;
use crate::case::words::subsurface::DamageParameterWords;
use crate::geometry::profile::LengthUnit;
use crate::normal::hertz::Patch;
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
/// Pressure in MPa above which the lengths that determine a patch are suspect: the static limit of ball bearings (ISO 76).
const PRESSURE_DOUBTED: f64 = 4200.0;

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

/// Returns the remarks on numbers that seem to be in another unit.
pub(crate) fn remarks(case: &Case, patches: &[Patch]) -> Vec<RemarkEntry> {
    let (contact, load) = (&case.contact, case.load.as_ref());
    let mut suspects = of_material(&case.material);
    suspects.extend(of_metal(case));
    suspects.extend(of_load(&case.material, contact, load, patches));
    suspects.extend(lengths_of_patch(contact, patches));
    suspects.extend(of_place(contact));
    suspects.extend(of_motion(&case.motion));
    suspects
}

/// Returns the constants of each body with their JSON pointers, those that both bodies share once.
fn bodies<'a, T>(pointer: &str, [lower, upper]: [&'a T; 2]) -> Vec<(String, &'a T)> {
    match std::ptr::eq(lower, upper) {
        true => vec![(pointer.to_owned(), lower)],
        false => vec![
            (format!("{pointer}/lower"), lower),
            (format!("{pointer}/upper"), upper),
        ],
    }
}

fn of_material(material: &Material) -> Vec<RemarkEntry> {
    let mut suspects = Vec::new();
    for (pointer, body) in bodies("/material", material.bodies()) {
        let moduli = [
            ("shear_modulus_mpa", body.shear_modulus_mpa, SHEAR_GPA),
            (
                "young_modulus_mpa",
                body.young_modulus_mpa,
                SHEAR_GPA.map(|g| 2.5 * g),
            ),
        ];
        for (name, modulus, range) in moduli {
            let modulus = modulus.filter(|value| is_within(*value, range));
            if let Some(value) = modulus.filter(|_| body.poisson_ratio < POISSON_METAL) {
                suspects.push(suspect(&format!("{pointer}/{name}"), value, "MPa", "GPa"));
            }
        }
    }
    suspects
}

/// Whether both bodies are metals, with moduli in MPa or in GPa.
fn is_metal(material: &Material) -> bool {
    let suspects = of_material(material);
    let bodies = bodies("/material", material.bodies());
    bodies.into_iter().all(|(pointer, body)| {
        let mut pointers = suspects.iter().filter_map(|one| one.pointer.as_deref());
        let shear = body.shear().unwrap_or(0.0);
        shear >= 1e3 * SHEAR_GPA[0] || pointers.any(|own| own.starts_with(&pointer))
    })
}

/// Returns the remarks on thermal properties and on parameters of damage models.
fn of_metal(case: &Case) -> Vec<RemarkEntry> {
    if !is_metal(&case.material) {
        return Vec::new();
    }
    let thermal = case.thermal.as_ref().map(Thermal::bodies).into_iter();
    let thermal = thermal.flat_map(|both| bodies("/thermal", both));
    let thermal = thermal.flat_map(|(pointer, body)| {
        let values = [
            body.conductivity_w_per_mk,
            body.specific_heat_j_per_kgk,
            body.density_kg_per_m3,
        ];
        LEAST_OF_METALS
            .iter()
            .zip(values)
            .map(move |(usual, value)| (pointer.clone(), usual, value))
    });
    let parameters = case
        .damage
        .as_ref()
        .and_then(|damage| damage.parameters.as_ref());
    let own = match parameters {
        Some(DamageParameterWords::Own(own)) => {
            [own.density_kg_per_m3, own.hardness_mpa, own.shear_yield_mpa]
        }
        _ => [None; 3],
    };
    let damage = LEAST_OF_METALS[2..].iter().zip(own);
    let damage =
        damage.filter_map(|(usual, value)| Some(("/damage/parameters".to_owned(), usual, value?)));
    thermal
        .chain(damage)
        .filter(|(_, (_, least, ..), value)| value < least)
        .map(|(pointer, (name, _, unit, likely), value)| {
            suspect(&format!("{pointer}/{name}"), value, unit, likely)
        })
        .collect()
}

fn of_load(
    material: &Material,
    contact: &Contact,
    load: Option<&Load>,
    patches: &[Patch],
) -> Option<RemarkEntry> {
    let load = load?;
    let given = [
        ("/load/normal_force_n", load.normal_force_n),
        ("/load/vertical_force_n", load.vertical_force_n),
    ];
    let (pointer, force) = given
        .into_iter()
        .find_map(|(at, force)| Some((at, force?)))?;
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
    (of_wheel && force < wheels * LOAD_LEAST && is_metal(material))
        .then(|| suspect(pointer, force, "N", "kN"))
}

/// Returns the units of length in which the pressure of a patch would be usual; it falls with this power of the length.
fn units_by_pressure(patches: &[Patch], power: f64) -> Option<String> {
    let pressure = patches.first()?.pressure_max;
    let usual = |unit: &LengthUnit| is_within(pressure / unit.mm().powf(power), PRESSURES);
    let units = [LengthUnit::M, LengthUnit::Cm, LengthUnit::Inch].into_iter();
    let units: Vec<&str> = units.filter(usual).map(LengthUnit::name).collect();
    (pressure > PRESSURE_DOUBTED && !units.is_empty()).then(|| units.join(" or "))
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
fn of_place(contact: &Contact) -> Vec<RemarkEntry> {
    let Some(rails) = contact.on_rails() else {
        return Vec::new();
    };
    let placement = rails.placement;
    let yaw = match contact {
        Contact::Wheelset { yaw_rad, .. } => largest(&yaw_rad.values()),
        _ => placement.yaw,
    };
    // Rails may be inclined by twice the usual angle.
    let angles = [
        ("cant_rad", placement.cant, 2.0 * ANGLE_MOST),
        ("yaw_rad", yaw, ANGLE_MOST),
        ("roll_rad", placement.roll, ANGLE_MOST),
    ];
    let large = angles
        .into_iter()
        .filter(|(_, angle, most)| angle.abs() > *most);
    large
        .map(|(name, angle, _)| suspect(&format!("/contact/{name}"), angle, "rad", "degrees"))
        .collect()
}

/// Returns the value with the largest magnitude; 0 if there is none.
fn largest(values: &[f64]) -> f64 {
    let larger = |a: f64, b: &f64| if b.abs() > a.abs() { *b } else { a };
    values.iter().fold(0.0, larger)
}

/// Longitudinal and lateral creepage and the speed, with the JSON pointer to their object.
type MotionNumbers = (String, [Option<f64>; 3]);

/// Returns the numbers of all motions; for a sweep and a history those with the largest magnitude.
fn numbers_of(motion: &Motions) -> Vec<MotionNumbers> {
    let swept = |swept: &Option<Swept>| Some(largest(&swept.as_ref()?.values()));
    let course = |course: &Option<Course>| Some(largest(&course.as_ref()?.values(1)));
    let asked = |one: &AskedMotion| [one.creepage_x, one.creepage_y, one.speed_mm_per_s];
    let rolling = |one: &Wheelset| [None, None, Some(one.speed_mm_per_s)];
    let alone = |of: &str, numbers| vec![(of.to_owned(), numbers)];
    match motion {
        Motions::One(one) => alone("/motion", asked(one)),
        Motions::Many(all) => {
            let all = all.iter().enumerate();
            all.map(|(k, one)| (format!("/motion/{k}"), asked(one)))
                .collect()
        }
        Motions::Sweep { sweep } => {
            let [x, y] = [&sweep.creepage_x, &sweep.creepage_y].map(swept);
            alone("/motion/sweep", [x, y, sweep.speed_mm_per_s])
        }
        Motions::History { history, .. } => {
            let [x, y] = [&history.creepage_x, &history.creepage_y].map(course);
            alone("/motion/history", [x, y, history.speed_mm_per_s])
        }
        Motions::Wheelset { wheelset } => alone("/motion/wheelset", rolling(wheelset)),
        Motions::Wheelsets { wheelset } => {
            let all = wheelset.iter().enumerate();
            all.map(|(k, one)| (format!("/motion/wheelset/{k}"), rolling(one)))
                .collect()
        }
    }
}

/// Returns the remarks on creepages and speeds; for several motions those on the first unusual ones.
fn of_motion(motion: &Motions) -> Vec<RemarkEntry> {
    let all = numbers_of(motion);
    let names = ["creepage_x", "creepage_y", "speed_mm_per_s"];
    let first = |(k, name): (usize, &str)| {
        all.iter().find_map(|(of, numbers)| {
            let value = numbers[k]?;
            let pointer = format!("{of}/{name}");
            if name == "speed_mm_per_s" {
                (0.0 < value && value < SPEED_LEAST)
                    .then(|| suspect(&pointer, value, "mm/s", "m/s or km/h"))
            } else {
                is_within(value.abs(), CREEPAGE_PERCENT)
                    .then(|| suspect(&pointer, value, "as a ratio", "per cent"))
            }
        })
    };
    names.into_iter().enumerate().filter_map(first).collect()
}
