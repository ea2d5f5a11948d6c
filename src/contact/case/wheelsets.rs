//! From the words of a wheelset to both wheels over their rails, with every fault of the cross-sections.

use std::sync::Arc;

use crate::case::motions::swept_values;
use crate::case::solver::{Limits, PairWords};
use crate::case::wheel_task::{both, in_place, meet, moves, profile_at, remarks_of, trust};
use crate::case::words::contact::{Contact, Load};
use crate::case::words::cross_section::CrossSection;
use crate::case::words::motion::{Combine, Motions, Swept};
use crate::error::Fault;
use crate::geometry::profile::Body;
use crate::geometry::wheel_rail::{Placement, RailPlace, Side};
use crate::normal::footprint::NormalTask;
use crate::normal::wheel::{
    KinematicsTask, ReferenceSurface, WheelLoad, WheelTask, WheelsetMove, WheelsetTask,
};
use crate::remark::entry::{RemarkEntry, merged};

/// The task of a wheelset with its remarks; `None` without faults where the load or the contact modulus in MPa is not known.
///
/// # Errors
/// Every fault of the cross-sections; or that wheels and rails cannot meet; or too many positions.
pub(crate) fn task(
    contact: &Contact,
    load: Option<&Load>,
    motion: Option<&Motions>,
    contact_modulus: Option<f64>,
    surface: ReferenceSurface,
    limits: &Limits,
) -> Result<Option<(NormalTask, Vec<RemarkEntry>)>, Vec<Fault>> {
    let Contact::Wheelset {
        lateral_shift_mm,
        yaw_rad,
        combine,
        kinematics,
        right,
        ..
    } = contact
    else {
        return Ok(None);
    };
    let poses = poses(lateral_shift_mm, yaw_rad, *combine, limits)?;
    let (poses, moves) = moving(poses, motion, *combine, limits)?;
    let sections = sections(contact);
    if kinematics.is_some() {
        let rails = sections.into_iter().map(|[rail, _]| rail);
        let mut guarded: Vec<&str> = rails
            .filter(|(_, rail)| rail.guard_rail_points_mm.is_some())
            .map(|(pointer, _)| pointer)
            .collect();
        guarded.dedup();
        let detail = "given together with kinematics, which take the running rail alone; leave one of the two out";
        let faults: Vec<Fault> = guarded
            .into_iter()
            .map(|rail| Fault::new(format!("{rail}/guard_rail_points_mm"), detail))
            .collect();
        if !faults.is_empty() {
            return Err(faults);
        }
    }
    let profiles = sections.map(|[rail, wheel]| {
        let rail = profile_at(rail.0, Body::Rail, rail.1);
        (rail, profile_at(wheel.0, Body::Wheel, wheel.1))
    });
    let pointers = sections.map(|side| side.map(|(pointer, _)| pointer));
    let [left, right_profiles] = profiles;
    let sides = [both(left, pointers[0])?, both(right_profiles, pointers[1])?];
    let (mut geometries, mut remarks) = (Vec::with_capacity(2), Vec::new());
    for (k, profiles) in sides.into_iter().enumerate() {
        let pointers = pointers[k];
        let (words, placement, radius) = placement(contact, k, poses[0]);
        let (geometry, flange_back) = in_place(profiles, &words, placement, pointers, radius)?;
        meet(&geometry)?;
        remarks.extend(remarks_of(&geometry, pointers));
        remarks.extend(flange_back);
        geometries.push(geometry);
    }
    let force = load.and_then(|load| load.vertical_force_n);
    let (Some(force), Some(contact_modulus)) = (force, contact_modulus) else {
        return Ok(None);
    };
    let left = load.and_then(|load| load.left_share).unwrap_or(0.5);
    let mut geometries = geometries.into_iter();
    let mut side = |k: usize, share: f64| {
        let geometry = geometries.next()?;
        Some(WheelTask {
            geometry,
            loading: WheelLoad::Vertical(share * force),
            contact_modulus,
            trust: trust(&placement(contact, k, poses[0]).0),
            surface,
        })
    };
    let (Some(left), Some(right_side)) = (side(0, left), side(1, 1.0 - left)) else {
        return Ok(None);
    };
    let task = WheelsetTask {
        sides: [left, right_side],
        poses,
        moves,
        kinematics: kinematics.as_ref().map(|asked| KinematicsTask {
            reach: asked.reach_mm,
            step: asked.step_mm,
            amplitudes: asked.amplitudes_mm.clone(),
        }),
        own_right: right.as_ref().map_or([false; 2], |right| {
            [right.rail.is_some(), right.wheel.is_some()]
        }),
    };
    Ok(Some((
        NormalTask::Wheelset(Arc::new(task)),
        merged(remarks),
    )))
}

/// Shift and yaw of every position.
fn poses(
    shifts: &Swept,
    yaws: &Swept,
    combine: Combine,
    limits: &Limits,
) -> Result<Vec<[f64; 2]>, Vec<Fault>> {
    let [a, b] = [shifts, yaws].map(|swept| swept.points() as u128);
    let count = match combine {
        Combine::Together => a.max(b),
        Combine::Grid => a * b,
    };
    if count > limits.motions_max as u128 {
        let detail = format!(
            "{count} positions given; at most {} are allowed in one case",
            limits.motions_max
        );
        return Err(vec![Fault::new("/contact/lateral_shift_mm", detail)]);
    }
    let (shifts, yaws) = (swept_values(shifts), swept_values(yaws));
    Ok(match combine {
        Combine::Grid => shifts
            .iter()
            .flat_map(|shift| yaws.iter().map(|yaw| [*shift, *yaw]))
            .collect(),
        Combine::Together => (0..count as usize)
            .map(|k| [shifts[k.min(shifts.len() - 1)], yaws[k.min(yaws.len() - 1)]])
            .collect(),
    })
}

/// Shift and yaw of every position, and how the wheelset moves there.
type Moving = (Vec<[f64; 2]>, Vec<WheelsetMove>);

/// Every position with its motion; without motions the positions alone.
fn moving(
    poses: Vec<[f64; 2]>,
    motion: Option<&Motions>,
    combine: Combine,
    limits: &Limits,
) -> Result<Moving, Vec<Fault>> {
    let moves = motion.map_or_else(Vec::new, moves);
    let fault = |detail| Err(vec![Fault::new("/motion/wheelset", detail)]);
    let (places, motions) = (poses.len(), moves.len());
    if motions == 0 {
        return Ok((poses, moves));
    }
    let together = combine == Combine::Together;
    if together && motions > 1 && places > 1 && motions != places {
        return fault(format!(
            "{motions} motions given for {places} positions; give one motion, one per position, or \"combine\": \"grid\" in the contact"
        ));
    }
    let count = if together {
        places.max(motions)
    } else {
        places.saturating_mul(motions)
    };
    if count > limits.motions_max {
        return fault(format!(
            "{count} positions with motions given; at most {} are allowed in one case",
            limits.motions_max
        ));
    }
    let pair = |k: usize| match together {
        true => (poses[k.min(places - 1)], moves[k.min(motions - 1)]),
        false => (poses[k / motions], moves[k % motions]),
    };
    Ok((0..count).map(pair).unzip())
}

/// Of the left and of the right side, the cross-sections of rail and wheel with their pointers.
type Sections<'a> = [[(&'static str, &'a CrossSection); 2]; 2];

fn sections(contact: &Contact) -> Sections<'_> {
    let Contact::Wheelset {
        rail, wheel, right, ..
    } = contact
    else {
        unreachable!("only wheelsets have two sides")
    };
    let left: [(&'static str, &CrossSection); 2] =
        [("/contact/rail", rail), ("/contact/wheel", wheel)];
    let own = right.as_ref().map(|right| [&right.rail, &right.wheel]);
    let pointers = ["/contact/right/rail", "/contact/right/wheel"];
    let of_right = |k: usize| match own.and_then(|own| own[k].as_deref()) {
        Some(section) => (pointers[k], section),
        None => left[k],
    };
    [left, [of_right(0), of_right(1)]]
}

/// The members of a case that describe the pair of a side, its placement at a shift and a yaw without roll, and the pointer to the rolling radius.
fn placement(
    contact: &Contact,
    side: usize,
    [lateral_shift, yaw]: [f64; 2],
) -> (PairWords<'_>, Placement, &'static str) {
    let Contact::Wheelset {
        right,
        rolling_radius_mm,
        gauge_mm,
        gauge_height_mm,
        rail_origin_mm,
        cant_rad,
        flange_back_distance_mm,
        flange_back_position_mm,
        accept_rough_profiles,
        ..
    } = contact
    else {
        unreachable!("only wheelsets have two sides")
    };
    let own = right.as_ref().and_then(|right| right.rolling_radius_mm);
    let own = own.filter(|_| side == 1);
    let placement = Placement {
        side: [Side::Left, Side::Right][side],
        rolling_radius: own.unwrap_or(*rolling_radius_mm),
        rail: RailPlace::of(*gauge_mm, *gauge_height_mm, *rail_origin_mm),
        cant: *cant_rad,
        flange_back_distance: *flange_back_distance_mm,
        flange_back_position: 0.0,
        lateral_shift,
        yaw,
        roll: 0.0,
    };
    let words = PairWords {
        sections: sections(contact)[side].map(|(_, section)| section),
        flange_back: *flange_back_position_mm,
        accept_rough: *accept_rough_profiles,
    };
    let radius = match own {
        Some(_) => "/contact/right/rolling_radius_mm",
        None => "/contact/rolling_radius_mm",
    };
    (words, placement, radius)
}
