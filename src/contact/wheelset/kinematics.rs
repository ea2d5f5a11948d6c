//! Kinematics of the rigid wheelset over a range of shifts: difference of the rolling radii, equilibrium, equivalent conicity, and their changes with
//! another smoothing of the cross-sections.
//!
//! EN 15302 keeps the axle level: each wheel touches where it would without the roll. The values with the roll are reported too.

use std::f64::consts::PI;

use crate::error::SolveError;
use crate::geometry::conicity::{Conicity, NoConicity, RadiusDifference};
use crate::geometry::profile::Profile;
use crate::geometry::profile_quality::{CHORDS, SMOOTHING_ADVISED, advised_smoothing};
use crate::geometry::wheel_rail::WheelRail;
use crate::geometry::wheelset_pose::{PairOfRails, RigidPose};
use crate::monitor::Monitor;
use crate::normal::wheel::{KinematicsTask, WheelTask};
use crate::problem::checked_case;
use crate::problem::checked_case::PRESSURE_USUAL;
use crate::profile_assessment::uncertainty::COMPANIONS;
use crate::solution::words::answer::{EquivalentConicity, Kinematics, TouchLine};

/// Tolerance of the radius difference between two shifts in mm, a fifth of the rounding of the tables in the standard.
const RESOLVED: f64 = 2e-3;
/// Most bisections of an interval between two shifts. They locate a jump to 0.0001 mm in an interval of 0.1 mm.
const HALVINGS: u32 = 10;

/// A radius difference as sampled, and with every second shift only.
struct Sampled {
    fine: RadiusDifference,
    coarse: RadiusDifference,
}

/// Computes the kinematics of a wheelset. `sides` has both wheels as contacts, from which other smoothings follow.
///
/// # Errors
/// Returns an error if a wheel is not above its rail without a shift, or the monitor stopped the work.
pub(crate) fn of(
    rails: &mut PairOfRails,
    sides: &[WheelTask; 2],
    asked: &KinematicsTask,
    monitor: &dyn Monitor,
) -> Result<Kinematics, SolveError> {
    let (level, end) = level_poses(rails, asked, monitor)?;
    let (rolled, rolled_end) = over_shifts(asked, monitor, |shift, roll| {
        let pose = rails.pose(shift, 0.0, roll)?;
        rails.not_cut_off(&pose).map(|()| pose)
    })?;
    let mut other = PairOfRails::new([other_reading(&sides[0]), other_reading(&sides[1])]);
    let (others, _) = over_shifts(asked, monitor, |shift, _| {
        other.pose_without_roll(shift, 0.0)
    })?;
    let radii = sampled(&level, |shift| rails.pose_without_roll(shift, 0.0));
    let other_radii = sampled(&others, |shift| other.pose_without_roll(shift, 0.0));
    let rolled_radii = sampled(&rolled, |shift| rails.pose(shift, 0.0, 0.0));
    let rest = radii.fine.rest();
    let near = nearest(&level, rest.unwrap_or(0.0));
    let distance = near.map_or(0.0, RigidPose::contact_distance);
    let mean_radius = near.map_or(0.0, |pose| {
        0.5 * (pose.touches[0].radius + pose.touches[1].radius)
    });
    let changed = |pose: &RigidPose| {
        at_shift(&others, pose).map_or(0.0, |other| {
            (other.radius_difference() - pose.radius_difference()).abs()
        })
    };
    let with_roll = |of: fn(&RigidPose) -> f64| {
        let at = |pose: &RigidPose| at_shift(&rolled, pose).map(of);
        level.iter().map(at).collect::<Vec<Option<f64>>>()
    };
    let radius_difference_mm: Vec<f64> = level.iter().map(RigidPose::radius_difference).collect();
    let conicity = asked.amplitudes.iter().map(|amplitude| {
        let radii = [&radii, &other_radii, &rolled_radii];
        conicity(*amplitude, radii, distance * mean_radius)
    });
    let known = level.iter().all(|pose| at_shift(&rolled, pose).is_some());
    let unbalanced = NoConicity::NoEquilibrium(radii.fine.range()).to_string();
    let rolled_end = rolled_end.map(|end| format!("with the roll: {end}"));
    let reasons = [
        Some(unbalanced).filter(|_| rest.is_none()),
        end,
        rolled_end.filter(|_| !known),
    ];
    let reasons: Vec<String> = reasons.into_iter().flatten().collect();
    Ok(Kinematics {
        lateral_shift_mm: level.iter().map(|pose| pose.lateral_shift).collect(),
        roll_rad: with_roll(|pose| pose.roll),
        centre_height_mm: with_roll(|pose| pose.height),
        radius_difference_with_roll_mm: with_roll(RigidPose::radius_difference),
        radius_difference_without_roll_mm: radius_difference_mm.clone(),
        radius_difference_mm,
        profile_uncertainty_mm: level.iter().map(changed).collect(),
        left: touch_line(rails, &level, 0),
        right: touch_line(rails, &level, 1),
        equilibrium_shift_mm: rest,
        equilibrium_uncertainty_mm: rest
            .zip(other_radii.fine.rest())
            .map(|(own, other)| (own - other).abs()),
        contact_distance_mm: distance,
        conicity: conicity.collect(),
        reason: (!reasons.is_empty()).then(|| reasons.join("; ")),
    })
}

/// The radius difference with a level axle, with more shifts where it bends or jumps.
///
/// # Errors
/// See [`of`].
pub(crate) fn level_radii(
    rails: &mut PairOfRails,
    asked: &KinematicsTask,
    monitor: &dyn Monitor,
) -> Result<RadiusDifference, SolveError> {
    let (level, _) = level_poses(rails, asked, monitor)?;
    Ok(sampled(&level, |shift| rails.pose_without_roll(shift, 0.0)).fine)
}

fn level_poses(
    rails: &mut PairOfRails,
    asked: &KinematicsTask,
    monitor: &dyn Monitor,
) -> Result<PosesOverShifts, SolveError> {
    over_shifts(asked, monitor, |shift, _| {
        let pose = rails.pose_without_roll(shift, 0.0)?;
        rails.not_cut_off(&pose).map(|()| pose)
    })
}

/// Poses at increasing shifts, and the reason if they end before the requested reach.
type PosesOverShifts = (Vec<RigidPose>, Option<String>);

/// The pose with the same shift as another one.
fn at_shift<'p>(poses: &'p [RigidPose], other: &RigidPose) -> Option<&'p RigidPose> {
    poses
        .iter()
        .find(|pose| (pose.lateral_shift - other.lateral_shift).abs() < 1e-9)
}

fn nearest(poses: &[RigidPose], shift: f64) -> Option<&RigidPose> {
    let off = |pose: &&RigidPose| (pose.lateral_shift - shift).abs();
    poses.iter().min_by(|a, b| off(a).total_cmp(&off(b)))
}

/// The poses at all possible shifts in order, and the reason if they end before the requested reach. `pose` finds one from the shift and a roll
/// nearby.
fn over_shifts(
    asked: &KinematicsTask,
    monitor: &dyn Monitor,
    mut pose: impl FnMut(f64, f64) -> Result<RigidPose, String>,
) -> Result<PosesOverShifts, SolveError> {
    let centred = pose(0.0, 0.0).map_err(SolveError::normal_problem)?;
    let steps = (asked.reach / asked.step).round() as i32;
    let (mut poses, mut end) = (vec![centred], None);
    for sign in [-1.0, 1.0] {
        let mut roll = centred.roll;
        for k in 1..=steps {
            monitor.go_on(1.0)?;
            let shift = sign * asked.reach * f64::from(k) / f64::from(steps);
            match pose(shift, roll) {
                Ok(pose) => {
                    roll = pose.roll;
                    poses.push(pose);
                }
                Err(reason) => {
                    end.get_or_insert(reason);
                    break;
                }
            }
        }
    }
    poses.sort_by(|a, b| a.lateral_shift.total_cmp(&b.lateral_shift));
    Ok((poses, end))
}

/// The radius difference of some poses, with more shifts where it bends or jumps.
fn sampled(poses: &[RigidPose], mut pose: impl FnMut(f64) -> Result<RigidPose, String>) -> Sampled {
    let known: Vec<[f64; 2]> = poses
        .iter()
        .map(|pose| [pose.lateral_shift, pose.radius_difference()])
        .collect();
    // The middle of a parabola is an eighth of its second difference away from the chord.
    let bends = |k: usize| {
        k > 0
            && k + 1 < known.len()
            && (known[k - 1][1] - 2.0 * known[k][1] + known[k + 1][1]).abs() > 8.0 * RESOLVED
    };
    let mut between = Vec::new();
    for k in 1..known.len() {
        if bends(k - 1) || bends(k) {
            halve([known[k - 1], known[k]], HALVINGS, &mut pose, &mut between);
        }
    }
    let curve = |every: usize| {
        let phase = known.len() / 2 % every;
        let mut all: Vec<[f64; 2]> = known.iter().copied().skip(phase).step_by(every).collect();
        all.extend(&between);
        all.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let (shifts, differences) = all.into_iter().map(|[y, d]| (y, d)).unzip();
        RadiusDifference::new(shifts, differences)
    };
    Sampled {
        fine: curve(1),
        coarse: curve(2),
    }
}

/// Adds samples between two others until the difference is linear between them or the jump is narrow.
fn halve(
    [from, to]: [[f64; 2]; 2],
    times: u32,
    pose: &mut impl FnMut(f64) -> Result<RigidPose, String>,
    found: &mut Vec<[f64; 2]>,
) {
    let shift = 0.5 * (from[0] + to[0]);
    let Some(middle) = pose(shift)
        .ok()
        .map(|pose| [shift, pose.radius_difference()])
    else {
        return;
    };
    found.push(middle);
    let off = (middle[1] - 0.5 * (from[1] + to[1])).abs();
    if times > 1 && off > RESOLVED {
        halve([from, middle], times - 1, pose, found);
        halve([middle, to], times - 1, pose, found);
    }
}

/// A wheel on its rail with both cross-sections smoothed more, at least as their noise and spacing advise.
fn other_reading(side: &WheelTask) -> WheelRail {
    let profiles = side.geometry.profiles();
    let levels = profiles.map(checked_case::noise_level);
    let advised = advised_smoothing(levels, side.contact_modulus, PRESSURE_USUAL);
    let other = |k: usize, profile: &Profile| {
        let chords = CHORDS * profile.usual_chord();
        let least = (COMPANIONS[1] * profile.smoothing()).max(chords.min(SMOOTHING_ADVISED[1]));
        least.max(advised[k])
    };
    side.geometry
        .smoothed([other(0, profiles[0]), other(1, profiles[1])])
}

/// The conicity at one amplitude, from the radius differences as given, with the other smoothing and with the roll. `product` is the contact
/// distance times the radius in mm².
fn conicity(
    amplitude: f64,
    [radii, other, rolled]: [&Sampled; 3],
    product: f64,
) -> EquivalentConicity {
    let found = radii.fine.conicity(amplitude);
    let mut reasons = Vec::new();
    let mut missing = |what: &str, reason: NoConicity| reasons.push(format!("{what}: {reason}"));
    let mut known = |what: &str, result: Result<Conicity, NoConicity>| {
        result.map_err(|reason| missing(what, reason)).ok()
    };
    let own = known("conicity", found);
    let with_roll = known("conicity_with_roll", rolled.fine.conicity(amplitude));
    let mut change = |what: &str, to: &RadiusDifference| {
        let own = own?;
        let to = known(what, to.conicity(amplitude))?;
        Some((own.conicity - to.conicity).abs())
    };
    let error_estimate = change("error_estimate, from twice the step", &radii.coarse);
    let profile_uncertainty = change("profile_uncertainty, from the other reading", &other.fine);
    let turns = own.and_then(|own| own.turns);
    let steers = own.filter(|_| turns.is_some());
    if own.is_some() && turns.is_none() {
        reasons.push(
            "wavelength_mm, turns_mm: the radii are equal over the whole amplitude, so that the wheelset does not steer"
                .to_owned(),
        );
    }
    EquivalentConicity {
        amplitude_mm: amplitude,
        conicity: own.map(|found| found.conicity),
        conicity_with_roll: with_roll.map(|found| found.conicity),
        conicity_without_roll: own.map(|found| found.conicity),
        conicity_harmonic: own.map(|found| found.harmonic),
        error_estimate,
        profile_uncertainty,
        wavelength_mm: steers.map(|found| PI * (2.0 * product / found.conicity).sqrt()),
        turns_mm: turns,
        reason: (!reasons.is_empty()).then(|| reasons.join("; ")),
    }
}

fn touch_line(rails: &PairOfRails, poses: &[RigidPose], side: usize) -> TouchLine {
    let mut line = TouchLine::default();
    for pose in poses {
        let touch = &pose.touches[side];
        let [rail, wheel] = rails.on_profiles(side, touch);
        line.rolling_radius_mm.push(touch.radius);
        line.contact_angle_rad.push(touch.angle);
        line.rail_y_mm.push(rail[0]);
        line.wheel_y_mm.push(wheel[0]);
    }
    line
}
