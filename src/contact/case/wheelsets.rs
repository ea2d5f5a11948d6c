//! From the members of a case to a wheelset with both wheels placed over their rails, with the faults of all cross-sections.

use std::sync::Arc;

use crate::case::rail_pair::KnownPair;
use crate::case::solver::Limits;
use crate::case::wheel_task::{moves, placed};
use crate::case::words::contact::{Contact, Load, OnRails, RightSide};
use crate::case::words::motion::{Combine, Motions, Swept};
use crate::error::Fault;
use crate::geometry::wheel_rail::Side;
use crate::normal::footprint::NormalTask;
use crate::normal::wheel::{
    KinematicsTask, ReferenceSurface, WheelLoad, WheelTask, WheelsetMove, WheelsetTask,
};
use crate::remark::entry::{RemarkEntry, merged};

/// Returns the normal problem of a wheelset with its remarks; `None` without faults if the load or the contact modulus in MPa is unknown.
///
/// # Errors
/// The faults of the cross-sections, too many positions, or the reason why wheels and rails cannot meet.
pub(crate) fn task(
    contact: &Contact,
    load: Option<&Load>,
    motion: Option<&Motions>,
    contact_modulus: Option<f64>,
    surface: ReferenceSurface,
    (known, limits): (&KnownPair, &Limits),
) -> Result<Option<(NormalTask, Vec<RemarkEntry>)>, Vec<Fault>> {
    let (
        Some(rails),
        Contact::Wheelset {
            lateral_shift_mm,
            yaw_rad,
            combine,
            kinematics,
            right,
            ..
        },
    ) = (contact.on_rails(), contact)
    else {
        return Ok(None);
    };
    let right = right.as_deref();
    let poses = poses(lateral_shift_mm, yaw_rad, *combine, limits)?;
    let (poses, moves) = moving(poses, motion, *combine, limits)?;
    let pairs = sides(rails, right, poses[0]);
    if kinematics.is_some() {
        refuse_guard_rails(&pairs)?;
    }
    let [(left_wheel, mut remarks), (right_wheel, of_right)] =
        [placed(&pairs[0], known)?, placed(&pairs[1], known)?];
    remarks.extend(of_right);
    let force = load.and_then(|load| load.vertical_force_n);
    let (Some(force), Some(contact_modulus)) = (force, contact_modulus) else {
        return Ok(None);
    };
    let left_share = load.and_then(|load| load.left_share).unwrap_or(0.5);
    let wheel = |geometry, share: f64, pair: &OnRails| WheelTask {
        geometry,
        loading: WheelLoad::Vertical(share * force),
        contact_modulus,
        trust: pair.trust(),
        surface,
    };
    let task = WheelsetTask {
        sides: [
            wheel(left_wheel, left_share, &pairs[0]),
            wheel(right_wheel, 1.0 - left_share, &pairs[1]),
        ],
        poses,
        moves,
        kinematics: kinematics.as_ref().map(|asked| KinematicsTask {
            reach: asked.reach_mm,
            step: asked.step_mm,
            amplitudes: asked.amplitudes_mm.clone(),
        }),
        own_right: right.map_or([false; 2], |right| {
            [right.rail.is_some(), right.wheel.is_some()]
        }),
    };
    Ok(Some((
        NormalTask::Wheelset(Arc::new(task)),
        merged(remarks),
    )))
}

/// Returns the left and the right pair of rail and wheel, with the wheelset at a shift in mm and a yaw in rad without roll.
fn sides<'a>(
    mut left: OnRails<'a>,
    right: Option<&'a RightSide>,
    [lateral_shift, yaw]: [f64; 2],
) -> [OnRails<'a>; 2] {
    (left.placement.lateral_shift, left.placement.yaw) = (lateral_shift, yaw);
    let mut other = left;
    other.placement.side = Side::Right;
    if let Some(rail) = right.and_then(|right| right.rail.as_deref()) {
        (other.sections[0], other.pointers[0]) = (rail, "/contact/right/rail");
    }
    if let Some(wheel) = right.and_then(|right| right.wheel.as_deref()) {
        (other.sections[1], other.pointers[1]) = (wheel, "/contact/right/wheel");
    }
    if let Some(radius) = right.and_then(|right| right.rolling_radius_mm) {
        other.placement.rolling_radius = radius;
        other.radius_pointer = "/contact/right/rolling_radius_mm";
    }
    [left, other]
}

/// Refuses guard rails together with kinematics.
fn refuse_guard_rails(pairs: &[OnRails; 2]) -> Result<(), Vec<Fault>> {
    let guarded = pairs
        .iter()
        .filter(|pair| pair.sections[0].guard_rail_points_mm.is_some());
    let mut guarded: Vec<&str> = guarded.map(|pair| pair.pointers[0]).collect();
    guarded.dedup();
    let detail = "given together with kinematics, which take the running rail alone; leave one of the two out";
    let fault = |rail: &str| Fault::new(format!("{rail}/guard_rail_points_mm"), detail);
    match guarded.is_empty() {
        true => Ok(()),
        false => Err(guarded.into_iter().map(fault).collect()),
    }
}

/// Returns shift in mm and yaw in rad of every position.
fn poses(
    shifts: &Swept,
    yaws: &Swept,
    combine: Combine,
    limits: &Limits,
) -> Result<Vec<[f64; 2]>, Vec<Fault>> {
    let lengths = [shifts, yaws].map(Swept::points);
    let (count, most) = (combine.count(lengths), limits.motions_max);
    if count > most as u128 {
        let detail = format!("{count} positions given; at most {most} are allowed in one case");
        return Err(vec![Fault::new("/contact/lateral_shift_mm", detail)]);
    }
    let (shifts, yaws) = (shifts.values(), yaws.values());
    let pose = |k: usize| {
        let [i, j] = combine.indices(lengths, k);
        [shifts[i], yaws[j]]
    };
    Ok((0..count as usize).map(pose).collect())
}

/// Shift in mm and yaw in rad of every position, and the motion of the wheelset there.
type Moving = (Vec<[f64; 2]>, Vec<WheelsetMove>);

/// Combines positions with motions. Without motions it returns the positions alone.
fn moving(
    poses: Vec<[f64; 2]>,
    motion: Option<&Motions>,
    combine: Combine,
    limits: &Limits,
) -> Result<Moving, Vec<Fault>> {
    let moves = motion.map_or_else(Vec::new, moves);
    let (places, motions) = (poses.len(), moves.len());
    if motions == 0 {
        return Ok((poses, moves));
    }
    let refused = |detail| Err(vec![Fault::new("/motion/wheelset", detail)]);
    if combine == Combine::Together && motions > 1 && places > 1 && motions != places {
        return refused(format!(
            "{motions} motions given for {places} positions; give one motion, one per position, or \"combine\": \"grid\" in the contact"
        ));
    }
    let lengths = [places, motions];
    let (count, most) = (combine.count(lengths), limits.motions_max);
    if count > most as u128 {
        return refused(format!(
            "{count} positions with motions given; at most {most} are allowed in one case"
        ));
    }
    let pair = |k: usize| {
        let [i, j] = combine.indices(lengths, k);
        (poses[i], moves[j])
    };
    Ok((0..count as usize).map(pair).unzip())
}
