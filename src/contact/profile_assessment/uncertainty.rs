//! The uncertainty due to the measurement of the profiles, from solving the same contact with other smoothings.
//!
//! With the smoothing L the contact is solved again with L/2.5, which shows how much noise remains, and with 2 L, which shows how much of
//! the shape is lost. The uncertainty is the largest difference, plus 1 % of the pressure and 0.3 % of μN respectively. Population: noise
//! of 1 to 20 µm with L = 5 mm. The errors of 97 % of the pressures and 93 % of the forces are within it.

use std::sync::Arc;

use crate::error::SolveError;
use crate::geometry::profile::Profile;
use crate::geometry::profile_quality::{CHORDS, SMOOTHING_ADVISED};
use crate::monitor::{Monitor, MonitorPart};
use crate::normal::wheel::WheelTask;
use crate::problem::checked_case::CheckedCase;
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;
use crate::rolling::operator_store::OperatorStore;
use crate::rolling::task::Resolution;
use crate::solution::words::answer::{PatchSolution, Solution};
use crate::solution::words::damage::{ProfileQuality, ProfileUncertainty};
use crate::wheel_on_rail;

/// Factors of the smoothing in the companion solves.
pub(crate) const COMPANIONS: [f64; 2] = [0.4, 2.0];
/// Part of the uncertainty in any case, which sound profiles have too: of the pressure relative to the largest pressure.
const PRESSURE_FLOOR: f64 = 0.01;
/// Part of the uncertainty of the forces that is always present, relative to μN.
const FORCE_FLOOR: f64 = 0.003;
/// Change between two readings from which there is a remark, as a multiple of these parts.
const CHANGE: f64 = 6.0;
/// Uncertainty of the pressure due to the points, as a multiple of their roughness.
const BY_ROUGHNESS: f64 = 2.0;
/// Uncertainty of the forces due to the points, relative to μN, as a multiple of that of the pressure relative to the pressure.
const FORCE_BY_PRESSURE: f64 = 0.1;
/// Target error of the companions relative to μN.
const TARGET: f64 = 0.01;
/// Most motions for which companions are solved.
const MOTIONS_MAX: usize = 5;

/// Writes the uncertainty into every point and total. Returns for each patch whether it changes so much without any smoothing that a remark is
/// due.
///
/// # Errors
/// Returns an error if the monitor stopped the work.
pub(crate) fn add(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    contact: &WheelTask,
    suspicious: bool,
    solution: &mut Solution,
    monitor: &dyn Monitor,
) -> Result<Vec<bool>, SolveError> {
    let motions = case.problem.motions.len();
    // The points of a history depend on each other.
    let chosen: Vec<usize> = if motions <= MOTIONS_MAX || case.problem.history.is_some() {
        (0..motions).collect()
    } else {
        (0..MOTIONS_MAX)
            .map(|k| k * (motions - 1) / (MOTIONS_MAX - 1))
            .collect()
    };
    let mut companions = Vec::new();
    let is_smoothed = contact.geometry.profiles().map(Profile::smoothing) != [0.0; 2];
    if suspicious || is_smoothed {
        let companion = CheckedCase {
            problem: case.problem.with_motions(&chosen),
            run: case.run.for_resultants(TARGET),
            label: case.label.clone(),
            remarks: Vec::new(),
        };
        for smoothing in readings(contact, solution) {
            let other = contact.smoothed(smoothing);
            match wheel_on_rail::solve(
                operators,
                &companion,
                &other,
                // The profiles of companions are not assessed.
                &mut |_| Ok(()),
                // Companions can be stopped, but report no progress, because that of the solve is complete.
                &MonitorPart::new(monitor, 1.0, 0.0),
            ) {
                Ok(found) => companions.push(found.solution),
                Err(stop @ (SolveError::Cancelled | SolveError::OutOfTime { .. })) => {
                    return Err(stop);
                }
                // Without companions, the uncertainty follows from the roughness alone.
                Err(_) => {}
            }
        }
    }
    let mut changes = write(
        case.problem.friction.largest(),
        &chosen,
        &companions,
        solution,
    );
    // Companions of a smoothed profile always differ, by their smoothing.
    if is_smoothed {
        changes.fill(false);
    }
    Ok(changes)
}

/// The remark on a target below the uncertainty due to the profiles, where that was determined.
pub(crate) fn target_below(case: &CheckedCase, solution: &Solution) -> Option<RemarkEntry> {
    let Resolution::Target(target) = case.run.resolution else {
        return None;
    };
    let limit: f64 = solution
        .patches
        .iter()
        .map(|patch| case.problem.friction.largest() * patch.normal_force_n)
        .sum();
    let totals = solution.total.iter();
    let uncertainties = totals.filter_map(|total| total.profile_uncertainty);
    let largest = uncertainties
        .map(|own| own.force_x_n.max(own.force_y_n))
        .reduce(f64::max)?;
    let uncertainty = largest / limit;
    (limit > 0.0 && uncertainty > target.max(2.0 * FORCE_FLOOR)).then(|| {
        Remark::TargetBelowProfileUncertainty {
            target,
            uncertainty,
        }
        .into()
    })
}

/// The smoothings of rail and wheel for the companions. Profiles without smoothing have one companion, with the smoothing that suits
/// their noise.
fn readings(contact: &WheelTask, solution: &Solution) -> Vec<[f64; 2]> {
    let used = contact.geometry.profiles().map(Profile::smoothing);
    let mut advised = [0.0_f64; 2];
    for quality in solution
        .patches
        .iter()
        .filter_map(|patch| patch.quality.as_ref())
    {
        advised[0] = advised[0].max(quality.rail.smoothing_suggested_mm);
        advised[1] = advised[1].max(quality.wheel.smoothing_suggested_mm);
    }
    if used == [0.0; 2] {
        let chords = contact.geometry.profiles().map(Profile::usual_chord);
        let [least, most] = SMOOTHING_ADVISED;
        let least = chords.map(|chord| (CHORDS * chord).clamp(least, most));
        return vec![[0, 1].map(|k| advised[k].max(least[k]))];
    }
    let with = |factor: f64| {
        [0, 1].map(|k| {
            if used[k] > 0.0 {
                factor * used[k]
            } else {
                advised[k]
            }
        })
    };
    COMPANIONS.map(with).to_vec()
}

/// Changes of the forces along x and y in N and of the largest pressure in MPa.
type Changes = [f64; 3];

/// The larger one of each pair of changes.
fn widest(one: Changes, other: Changes) -> Changes {
    [0, 1, 2].map(|k| one[k].max(other[k]))
}

/// The uncertainty with these changes where the friction limit μN is `limit` and the largest pressure is `pressure`, of a motion with
/// `[load, pressure]` relative to these.
fn report(changes: Changes, limit: f64, pressure: f64, share: [f64; 2]) -> ProfileUncertainty {
    let [force_x, force_y, change] = changes;
    let floor = FORCE_FLOOR * limit;
    ProfileUncertainty {
        force_x_n: share[0] * (force_x + floor),
        force_y_n: share[0] * (force_y + floor),
        pressure_max_mpa: share[1] * (change + PRESSURE_FLOOR * pressure),
    }
}

/// Writes the uncertainties of all motions, in proportion to their loads and pressures. Returns for each patch whether a companion differs so
/// much that a remark is due.
fn write(
    friction: f64,
    chosen: &[usize],
    companions: &[Solution],
    solution: &mut Solution,
) -> Vec<bool> {
    let is_compared = !companions.is_empty();
    let patches = || solution.patches.iter();
    let changes: Vec<Changes> = patches()
        .map(|patch| changes(patch, chosen, companions))
        .collect();
    let all: Vec<Changes> = patches()
        .zip(&changes)
        .map(|(patch, own)| widest(*own, by_points(patch, friction, is_compared)))
        .collect();
    let mut total = all.iter().fold([0.0; 3], |sum: Changes, own| {
        [sum[0] + own[0], sum[1] + own[1], sum[2].max(own[2])]
    });
    if is_compared {
        total = [0.0, 0.0, total[2]];
    }
    for companion in companions {
        let pressure = (largest(companion) - largest(solution)).abs();
        for (k, other) in chosen.iter().zip(&companion.total) {
            let own = &solution.total[*k];
            let force_x = (other.force_x_n - own.force_x_n).abs();
            let force_y = (other.force_y_n - own.force_y_n).abs();
            total = widest(total, [force_x, force_y, pressure]);
        }
    }
    let load: f64 = patches().map(|patch| patch.normal_force_n).sum();
    let pressure = largest(solution);
    let shares: Vec<[f64; 2]> = (0..solution.total.len())
        .map(|motion| {
            let regions = || solution.at(motion).map(|part| part.region);
            let own: f64 = regions().map(|region| region.normal_force_n).sum();
            let pressures = regions().map(|region| region.pressure_max_mpa);
            [own / load, pressures.fold(0.0, f64::max) / pressure]
        })
        .collect();
    for (motion, share) in solution.total.iter_mut().zip(shares) {
        motion.profile_uncertainty = Some(report(total, friction * load, pressure, share));
    }
    let mut remarkable = Vec::with_capacity(changes.len());
    for (patch, (own, all)) in solution.patches.iter_mut().zip(changes.iter().zip(all)) {
        let (load, pressure) = (patch.normal_force_n, patch.pressure_max_mpa);
        let limit = CHANGE * FORCE_FLOOR * friction * load;
        let is_large = |force: f64| force > limit && limit > 0.0;
        remarkable.push(
            own[2] > CHANGE * PRESSURE_FLOOR * pressure || is_large(own[0]) || is_large(own[1]),
        );
        for point in &mut patch.points {
            let share = point.region.as_deref().map_or([1.0; 2], |region| {
                [
                    region.normal_force_n / load,
                    region.pressure_max_mpa / pressure,
                ]
            });
            point.profile_uncertainty = Some(report(all, friction * load, pressure, share));
        }
    }
    remarkable
}

fn largest(solution: &Solution) -> f64 {
    let all = solution.patches.iter().map(|patch| patch.pressure_max_mpa);
    all.fold(0.0, f64::max)
}

/// The changes of a patch from the nearest patch of each companion.
fn changes(patch: &PatchSolution, chosen: &[usize], companions: &[Solution]) -> Changes {
    let across = |patch: &PatchSolution| patch.position.map_or(0.0, |place| place.track_mm[1]);
    let far = |other: &PatchSolution| (across(other) - across(patch)).abs();
    let mut changes = [0.0; 3];
    for companion in companions {
        let others = companion.patches.iter();
        let Some(same) = others.min_by(|a, b| far(a).total_cmp(&far(b))) else {
            continue;
        };
        let pressure = (same.pressure_max_mpa - patch.pressure_max_mpa).abs();
        for (k, other) in chosen.iter().zip(&same.points) {
            let own = &patch.points[*k];
            let force_x = (other.force_x_n - own.force_x_n).abs();
            let force_y = (other.force_y_n - own.force_y_n).abs();
            changes = widest(changes, [force_x, force_y, pressure]);
        }
    }
    changes
}

/// The changes that the roughness of both bodies may cause: their ambiguity, and their waviness if it is not due to the shape.
fn by_points(patch: &PatchSolution, friction: f64, is_rough: bool) -> Changes {
    let Some(quality) = &patch.quality else {
        return [0.0; 3];
    };
    let roughness = |body: &ProfileQuality| {
        let is_shape = !is_rough && body.smoothing_mm == 0.0;
        let waviness = if is_shape { 0.0 } else { body.waviness_mpa };
        waviness.hypot(body.ambiguity_mpa)
    };
    let pressure = BY_ROUGHNESS * roughness(&quality.rail).hypot(roughness(&quality.wheel));
    let limit = friction * patch.normal_force_n;
    let force = FORCE_BY_PRESSURE * limit * pressure / patch.pressure_max_mpa;
    [force, force, pressure]
}
