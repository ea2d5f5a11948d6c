//! The rigid wheelset over a range of shifts: difference of the rolling radii, equilibrium, equivalent conicity, and what another
//! reading of the cross-sections would change of them.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use crate::contact::error::SolveError;
use crate::contact::geometry::conicity::RadiusDifference;
use crate::contact::geometry::profile::Profile;
use crate::contact::geometry::profile_quality::points::{SMOOTHING_ADVISED, advised_smoothing};
use crate::contact::geometry::wheel_rail::WheelRail;
use crate::contact::geometry::wheelset_pose::{PairOfRails, RigidPose};
use crate::contact::monitor::Monitor;
use crate::contact::normal::wheel_height::task::WheelTask;
use crate::contact::normal::wheel_height::wheelset_task::KinematicsTask;
use crate::contact::problem::profile_points;
use crate::contact::problem::profile_points::PRESSURE_USUAL;
use crate::contact::solution::words::wheelset::{EquivalentConicity, Kinematics, TouchLine};

/// The other reading of a cross-section has its smoothing times this, or one of so many chords.
const OTHER_TIMES: f64 = 2.0;
const OTHER_CHORDS: f64 = 2.0;

/// The kinematics of a wheelset, with both wheels over their rails also as contacts, for the other reading.
///
/// # Errors
/// A wheel is not over its rail even without a shift; or the monitor stopped the work.
pub(crate) fn of(
    rails: &mut PairOfRails,
    sides: &[WheelTask; 2],
    asked: &KinematicsTask,
    monitor: &dyn Monitor,
) -> Result<Kinematics, SolveError> {
    let poses = over_shifts(rails, asked, monitor)?;
    let mut other = PairOfRails::new([other_reading(&sides[0]), other_reading(&sides[1])]);
    let others = over_shifts(&mut other, asked, monitor)?;
    let level = without_roll(rails, &poses)?;
    let [radii, other_radii, level_radii] =
        [&poses, &others, &level].map(|poses| difference(poses));
    let rest = radii.rest();
    let middle = rest.unwrap_or(0.0);
    let near = poses.iter().min_by(|a, b| {
        let off = |pose: &RigidPose| (pose.lateral_shift - middle).abs();
        off(a).total_cmp(&off(b))
    });
    let distance = near.map_or(0.0, RigidPose::contact_distance);
    let mean_radius = near.map_or(0.0, |pose| {
        0.5 * (pose.touches[0].radius + pose.touches[1].radius)
    });
    let changed = |pose: &RigidPose| {
        let same = |other: &&RigidPose| (other.lateral_shift - pose.lateral_shift).abs() < 1e-9;
        let other = others.iter().find(same);
        other.map_or(0.0, |other| {
            (other.radius_difference() - pose.radius_difference()).abs()
        })
    };
    let each = |of: fn(&RigidPose) -> f64| poses.iter().map(of).collect::<Vec<f64>>();
    Ok(Kinematics {
        lateral_shift_mm: each(|pose| pose.lateral_shift),
        roll_rad: each(|pose| pose.roll),
        centre_height_mm: each(|pose| pose.height),
        radius_difference_mm: each(RigidPose::radius_difference),
        radius_difference_without_roll_mm: level.iter().map(RigidPose::radius_difference).collect(),
        profile_uncertainty_mm: poses.iter().map(changed).collect(),
        left: touch_line(rails, &poses, 0),
        right: touch_line(rails, &poses, 1),
        equilibrium_shift_mm: rest,
        equilibrium_uncertainty_mm: rest
            .zip(other_radii.rest())
            .map(|(own, other)| (own - other).abs()),
        contact_distance_mm: distance,
        conicity: asked
            .amplitudes
            .iter()
            .map(|amplitude| {
                let radii = [&radii, &other_radii, &level_radii];
                conicity(*amplitude, radii, distance * mean_radius)
            })
            .collect(),
    })
}

/// The wheelset at every shift it can have, in order.
fn over_shifts(
    rails: &mut PairOfRails,
    asked: &KinematicsTask,
    monitor: &dyn Monitor,
) -> Result<Vec<RigidPose>, SolveError> {
    let centred = rails.pose(0.0, 0.0, 0.0);
    let centred = centred.map_err(|reason| SolveError::NormalProblem { reason })?;
    let steps = (asked.reach / asked.step).round() as i32;
    let mut poses = vec![centred];
    for sign in [-1.0, 1.0] {
        let mut roll = centred.roll;
        for k in 1..=steps {
            if let ControlFlow::Break(stop) = monitor.tick(1.0) {
                return Err(stop.into());
            }
            let shift = sign * asked.reach * f64::from(k) / f64::from(steps);
            // Farther out a wheel has left its rail.
            let Ok(pose) = rails.pose(shift, 0.0, roll) else {
                break;
            };
            roll = pose.roll;
            poses.push(pose);
        }
    }
    poses.sort_by(|a, b| a.lateral_shift.total_cmp(&b.lateral_shift));
    Ok(poses)
}

/// The same shifts with the axle held level.
fn without_roll(
    rails: &mut PairOfRails,
    poses: &[RigidPose],
) -> Result<Vec<RigidPose>, SolveError> {
    let level = |pose: &RigidPose| rails.pose_without_roll(pose.lateral_shift, pose.yaw);
    let poses: Result<Vec<RigidPose>, String> = poses.iter().map(level).collect();
    poses.map_err(|reason| SolveError::NormalProblem { reason })
}

fn difference(poses: &[RigidPose]) -> RadiusDifference {
    let shift = poses.iter().map(|pose| pose.lateral_shift).collect();
    let difference = poses.iter().map(RigidPose::radius_difference).collect();
    RadiusDifference::new(shift, difference)
}

/// A wheel over its rail with the other reading of both cross-sections: smoother, as their noise and spacing advise at least.
fn other_reading(side: &WheelTask) -> WheelRail {
    let profiles = side.geometry.profiles();
    let grains = profiles.map(profile_points::grain);
    let advised = advised_smoothing(grains, side.contact_modulus, PRESSURE_USUAL);
    let other = |k: usize, profile: &Profile| {
        let chords = OTHER_CHORDS * profile.usual_chord();
        let least = (OTHER_TIMES * profile.smoothing()).max(chords.min(SMOOTHING_ADVISED[1]));
        least.max(advised[k])
    };
    side.geometry
        .smoothed([other(0, profiles[0]), other(1, profiles[1])])
}

/// The conicity at one amplitude, from Δr, that of the other reading and that without roll; `product` is that of contact distance and
/// radius in mm².
fn conicity(
    amplitude: f64,
    [radii, other, level]: [&RadiusDifference; 3],
    product: f64,
) -> EquivalentConicity {
    let found = radii.conicity(amplitude);
    let change = |to: &RadiusDifference| {
        let to = to.conicity(amplitude);
        found.zip(to).map(|(a, b)| (a.conicity - b.conicity).abs())
    };
    EquivalentConicity {
        amplitude_mm: amplitude,
        conicity: found.map(|found| found.conicity),
        conicity_without_roll: level.conicity(amplitude).map(|found| found.conicity),
        conicity_harmonic: found.map(|found| found.harmonic),
        error_estimate: change(&radii.coarser()),
        profile_uncertainty: change(other),
        wavelength_mm: found.map(|found| PI * (2.0 * product / found.conicity).sqrt()),
        turns_mm: found.map(|found| found.turns),
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
