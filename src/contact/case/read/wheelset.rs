//! Reads a contact of the type `wheelset`, and the load that goes with it.

use crate::contact::case::read::motion::swept;
use crate::contact::case::read::object::{AllowedRange, Object, shown};
use crate::contact::case::read::wheel_rail::{
    ANGLE, CANT, DISTANCE, PLACE, ROLLING_RADIUS, flag, rail_place, section, surface,
};
use crate::contact::case::words::contact::{Contact, KinematicsWords, Load, RightSide};
use crate::contact::case::words::motion::{Combine, Swept};

const SHARE: AllowedRange = AllowedRange::closed(0.01, 0.99, "");
const REACH: AllowedRange = AllowedRange::positive(50.0, "mm");
const STEP: AllowedRange = AllowedRange::positive(5.0, "mm");
/// Most shifts to one side, and most amplitudes.
const SHIFTS_MAX: f64 = 1000.0;
const AMPLITUDES_MAX: usize = 100;
const MEMBERS: [&str; 18] = [
    "type",
    "rail",
    "wheel",
    "right",
    "rolling_radius_mm",
    "gauge_mm",
    "gauge_height_mm",
    "rail_origin_mm",
    "cant_rad",
    "flange_back_distance_mm",
    "flange_back_position_mm",
    "lateral_shift_mm",
    "yaw_rad",
    "combine",
    "kinematics",
    "accept_rough_profiles",
    "reference_surface",
    "influence",
];

/// Reads the members of the contact.
pub(crate) fn read(block: &mut Object) -> Option<Contact> {
    block.only(&MEMBERS);
    let rail = section(block, "rail");
    let wheel = section(block, "wheel");
    let right = right(block);
    let rolling_radius_mm = block.required_number("rolling_radius_mm", ROLLING_RADIUS);
    let cant_rad = block.number_or("cant_rad", CANT, 0.0);
    let flange_back_distance_mm = block.number_or("flange_back_distance_mm", DISTANCE, 1360.0);
    let flange_back_position_mm = block.optional_number("flange_back_position_mm", PLACE);
    let place = rail_place(block);
    let (shifts, yaws, combine) = poses(block)?;
    let kinematics = kinematics(block);
    let accept_rough_profiles = flag(block, "accept_rough_profiles");
    let (reference_surface, influence) = surface(block)?;
    Some(Contact::Wheelset {
        rail: Box::new(rail?),
        wheel: Box::new(wheel?),
        right: right?.map(Box::new),
        rolling_radius_mm: rolling_radius_mm?,
        gauge_mm: place?.gauge_mm,
        gauge_height_mm: place?.gauge_height_mm,
        rail_origin_mm: place?.rail_origin_mm,
        cant_rad: cant_rad?,
        flange_back_distance_mm: flange_back_distance_mm?,
        flange_back_position_mm: flange_back_position_mm?,
        lateral_shift_mm: shifts,
        yaw_rad: yaws,
        combine,
        kinematics: kinematics?,
        accept_rough_profiles: accept_rough_profiles?.unwrap_or(false),
        reference_surface,
        influence,
    })
}

/// Shifts, yaws, and how they are combined.
fn poses(block: &mut Object) -> Option<(Swept, Swept, Combine)> {
    let mut values = |name: &str, allowed: AllowedRange| {
        let read = block.optional(name, |block, name| swept(block, name, allowed))?;
        Some(read.unwrap_or(Swept::Constant(0.0)))
    };
    let shifts = values("lateral_shift_mm", PLACE);
    let yaws = values("yaw_rad", ANGLE);
    let combine = block.optional_word("combine", Combine::WORDS)?;
    let (shifts, yaws, combine) = (shifts?, yaws?, combine.unwrap_or_default());
    let [a, b] = [&shifts, &yaws].map(Swept::points);
    if combine == Combine::Together && a != b && a > 1 && b > 1 {
        block.fault(
            "yaw_rad",
            format!(
                "{b} values given with {a} of lateral_shift_mm; values combined \"together\" need the same number, which \"combine\": \
                 \"grid\" does not"
            ),
        );
        return None;
    }
    Some((shifts, yaws, combine))
}

/// What differs on the right; the outer `None` is a fault.
fn right(block: &mut Object) -> Option<Option<RightSide>> {
    const MEMBERS: [&str; 3] = ["rail", "wheel", "rolling_radius_mm"];
    if !block.has("right") {
        return Some(None);
    }
    let mut side = block.child("right")?;
    side.only(&MEMBERS);
    if !MEMBERS.iter().any(|name| side.has(name)) {
        let names = MEMBERS.join(", ");
        side.fault_here(format!("empty; at least one of {names} is needed"));
        return None;
    }
    let mut own = |name| side.optional(name, |side, name| section(side, name).map(Box::new));
    let (rail, wheel) = (own("rail"), own("wheel"));
    let radius = side.optional_number("rolling_radius_mm", ROLLING_RADIUS);
    Some(Some(RightSide {
        rail: rail?,
        wheel: wheel?,
        rolling_radius_mm: radius?,
    }))
}

/// What is asked of the rigid wheelset; the outer `None` is a fault.
fn kinematics(block: &mut Object) -> Option<Option<KinematicsWords>> {
    if !block.has("kinematics") {
        return Some(None);
    }
    let mut asked = block.child("kinematics")?;
    asked.only(&["reach_mm", "step_mm", "amplitudes_mm"]);
    let reach_mm = asked.number_or("reach_mm", REACH, 10.0);
    let step_mm = asked.number_or("step_mm", STEP, 0.1);
    let amplitudes_mm = amplitudes(&mut asked);
    let (reach_mm, step_mm) = (reach_mm?, step_mm?);
    if reach_mm / step_mm > SHIFTS_MAX || reach_mm / step_mm < 2.0 {
        asked.fault(
            "step_mm",
            format!("{step_mm} given for a reach of {reach_mm} mm; 2 to {SHIFTS_MAX} steps to either side are allowed"),
        );
        return None;
    }
    Some(Some(KinematicsWords {
        reach_mm,
        step_mm,
        amplitudes_mm: amplitudes_mm?,
    }))
}

fn amplitudes(asked: &mut Object) -> Option<Vec<f64>> {
    if !asked.has("amplitudes_mm") {
        return Some((1..=7).map(f64::from).collect());
    }
    let what = format!("an array of 1 to {AMPLITUDES_MAX} amplitudes in mm");
    let elements = asked.array("amplitudes_mm", 1..=AMPLITUDES_MAX, &what)?;
    asked.numbers("amplitudes_mm", elements, REACH)
}

/// Reads the load of a wheelset: the vertical force of both wheels, and the part of the left one.
pub(crate) fn read_load(case: &mut Object, force: AllowedRange) -> Option<Load> {
    let what = "{\"vertical_force_n\": …}, the force of both wheels";
    case.required("load", what)?;
    let mut block = case.child("load")?;
    for name in ["normal_force_n", "approach_mm"] {
        if let Some(value) = block.value(name).cloned() {
            let detail = format!(
                "{} given for a wheelset; give vertical_force_n, the force of both wheels",
                shown(&value)
            );
            block.fault(name, detail);
            return None;
        }
    }
    block.only(&["vertical_force_n", "left_share"]);
    let vertical_force_n = block.required_number("vertical_force_n", force);
    let left_share = block.optional_number("left_share", SHARE)?;
    Some(Load {
        normal_force_n: None,
        vertical_force_n: Some(vertical_force_n?),
        left_share,
        approach_mm: None,
    })
}
