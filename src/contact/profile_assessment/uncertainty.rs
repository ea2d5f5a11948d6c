//! The uncertainty due to the measurement of the profiles, from solving the same contact with other readings of its profiles.
//!
//! With the smoothing L the contact is solved again with L/2.5, which shows how much noise remains, and with 2 L, which shows how much of
//! the shape is lost. The uncertainty is the largest difference, plus 1 % of the pressure and 0.3 % of μN respectively. Population: noise
//! of 1 to 20 µm with L = 5 mm; the errors of 97 % of the pressures and 93 % of the forces are within it.

use std::sync::Arc;

use crate::error::SolveError;
use crate::geometry::profile::Profile;
use crate::geometry::profile_quality::{CHORDS, SMOOTHING_ADVISED, noise_pressure};
use crate::monitor::{Monitor, MonitorPart};
use crate::normal::wheel::WheelTask;
use crate::problem::checked_case::CheckedCase;
use crate::profile_assessment::judge::HARMLESS;
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;
use crate::rolling::operator_store::OperatorStore;
use crate::rolling::task::Resolution;
use crate::solution::words::answer::{PatchSolution, Solution};
use crate::solution::words::damage::{ProfileQuality, ProfileUncertainty};
use crate::wheel_on_rail;

/// The companion solves use the smoothing multiplied by these factors.
pub(crate) const COMPANIONS: [f64; 2] = [0.4, 2.0];
/// Added to the differences, relative to the largest pressure and to μN.
const PRESSURE_FLOOR: f64 = 0.01;
const FORCE_FLOOR: f64 = 0.003;
/// Uncertainty without companions: of the pressure, as a multiple of the roughness; of the force relative to μN, as a multiple of the
/// roughness relative to the pressure.
const BY_ROUGHNESS: f64 = 2.0;
const FORCE_BY_PRESSURE: f64 = 0.1;
/// Smallest target of companions, relative to μN, and most motions that they are solved for.
const TARGET: f64 = 0.01;
const MOTIONS_MAX: usize = 5;
/// Uncertainty, relative to the largest pressure and to μN, from which there is a remark.
const PRESSURE_OPEN: f64 = 0.06;
const FORCE_OPEN: f64 = 0.02;
/// Largest distance across the track, in mm, between corresponding patches of a solve and its companion.
const SAME_PLACE: f64 = 6.0;

/// Writes the uncertainty into every point and total, and returns which patches another reading changes so much that a remark is due.
///
/// # Errors
/// The monitor stopped the work.
pub(crate) fn add(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    contact: &WheelTask,
    suspicious: bool,
    solution: &mut Solution,
    monitor: &dyn Monitor,
) -> Result<Vec<bool>, SolveError> {
    let motions = case.problem.motions.len();
    // The points of a history follow from each other.
    let chosen: Vec<usize> = if motions <= MOTIONS_MAX || case.problem.history.is_some() {
        (0..motions).collect()
    } else {
        (0..MOTIONS_MAX)
            .map(|k| k * (motions - 1) / (MOTIONS_MAX - 1))
            .collect()
    };
    let mut companions = Vec::new();
    let noisy = |patch: &PatchSolution| noisy(patch, contact.contact_modulus);
    if suspicious || solution.patches.iter().any(noisy) {
        for smoothing in readings(contact, solution) {
            let other = contact.smoothed(smoothing);
            match wheel_on_rail::solve(
                operators,
                &companion(case, &chosen),
                &other,
                // Companions are solved without an assessment of their profiles.
                &mut |_| Ok(()),
                // They can be stopped, but report no progress, because that of the solve is complete.
                &MonitorPart {
                    inner: monitor,
                    before: 1.0,
                    own: 0.0,
                },
            ) {
                Ok(found) => companions.push(found.solution),
                Err(stop @ (SolveError::Cancelled | SolveError::OutOfTime { .. })) => {
                    return Err(stop);
                }
                // The companion has no answer; the uncertainty then follows from roughness alone.
                Err(_) => {}
            }
        }
    }
    Ok(write(
        case.problem.friction.largest(),
        &chosen,
        &companions,
        solution,
    ))
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
    let open = solution
        .total
        .iter()
        .filter_map(|total| total.profile_uncertainty);
    let largest = open
        .map(|open| open.force_x_n.max(open.force_y_n))
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

/// Whether the noise that remains after smoothing is a significant share of the pressure.
fn noisy(patch: &PatchSolution, modulus: f64) -> bool {
    let Some(quality) = &patch.quality else {
        return false;
    };
    let noise = |own: &ProfileQuality| match own.noise_um {
        Some(noise) if own.smoothing_mm > 0.0 => {
            noise_pressure(modulus, 1e-3 * noise, own.spacing_mm, own.smoothing_mm)
        }
        _ => 0.0,
    };
    let both = noise(&quality.rail).hypot(noise(&quality.wheel));
    both > HARMLESS * patch.pressure_max_mpa
}

/// Ambiguity of both bodies in MPa, including waviness that is not due to the shape.
fn open_by_points(patch: &PatchSolution, rough: bool) -> f64 {
    let Some(quality) = &patch.quality else {
        return 0.0;
    };
    let own = |body: &ProfileQuality| {
        let waviness = if rough || body.smoothing_mm > 0.0 {
            body.waviness_mpa
        } else {
            0.0
        };
        waviness.hypot(body.ambiguity_mpa)
    };
    own(&quality.rail).hypot(own(&quality.wheel))
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

fn companion(case: &CheckedCase, chosen: &[usize]) -> CheckedCase {
    CheckedCase {
        problem: case.problem.with_motions(chosen),
        run: case.run.for_resultants(TARGET),
        label: case.label.clone(),
        remarks: Vec::new(),
    }
}

/// Differences between two answers, in forces and in the largest pressure.
#[derive(Debug, Clone, Copy, Default)]
struct Open {
    force: [f64; 2],
    pressure: f64,
}

/// Uncertainty of a patch: from the differences between readings, and from the spacing of its points.
struct OfPatch {
    between: Open,
    all: Open,
}

impl Open {
    fn widen(&mut self, force: [f64; 2], pressure: f64) {
        self.force = [0, 1].map(|k| self.force[k].max(force[k]));
        self.pressure = self.pressure.max(pressure);
    }

    /// The uncertainty with its lower bounds added, for a given μN and largest pressure.
    fn report(self, limit: f64, pressure: f64) -> ProfileUncertainty {
        ProfileUncertainty {
            force_x_n: self.force[0] + FORCE_FLOOR * limit,
            force_y_n: self.force[1] + FORCE_FLOOR * limit,
            pressure_max_mpa: self.pressure + PRESSURE_FLOOR * pressure,
        }
    }
}

impl ProfileUncertainty {
    /// Of a motion with these shares of the load and of the largest pressure that it was found for.
    fn in_proportion(self, [load, pressure]: [f64; 2]) -> ProfileUncertainty {
        ProfileUncertainty {
            force_x_n: self.force_x_n * load,
            force_y_n: self.force_y_n * load,
            pressure_max_mpa: self.pressure_max_mpa * pressure,
        }
    }
}

/// Writes the uncertainties of the first motion, and those of the others in proportion to their loads and pressures.
fn write(
    friction: f64,
    chosen: &[usize],
    companions: &[Solution],
    solution: &mut Solution,
) -> Vec<bool> {
    let rough = !companions.is_empty();
    let patches = solution.patches.iter();
    let of_patches: Vec<OfPatch> = patches
        .map(|patch| {
            of_patch(
                patch,
                chosen,
                companions,
                friction * patch.normal_force_n,
                rough,
            )
        })
        .collect();
    let mut of_all = Open::default();
    for own in &of_patches {
        of_all.pressure = of_all.pressure.max(own.all.pressure);
        of_all.force = [0, 1].map(|k| of_all.force[k] + own.all.force[k]);
    }
    if rough {
        of_all.force = [0.0; 2];
    }
    for companion in companions {
        let pressure = (largest(companion) - largest(solution)).abs();
        for (k, other) in chosen.iter().zip(&companion.total) {
            let own = &solution.total[*k];
            let force = [
                (other.force_x_n - own.force_x_n).abs(),
                (other.force_y_n - own.force_y_n).abs(),
            ];
            of_all.widen(force, pressure);
        }
    }
    let first: f64 = solution
        .patches
        .iter()
        .map(|patch| patch.normal_force_n)
        .sum();
    let reported = of_all.report(friction * first, largest(solution));
    let shares: Vec<[f64; 2]> = (0..solution.total.len())
        .map(|motion| {
            let regions = || solution.at(motion).map(|part| part.region);
            let load: f64 = regions().map(|region| region.normal_force_n).sum();
            let pressure = regions().map(|region| region.pressure_max_mpa);
            [
                load / first,
                pressure.fold(0.0, f64::max) / largest(solution),
            ]
        })
        .collect();
    for (total, share) in solution.total.iter_mut().zip(shares) {
        total.profile_uncertainty = Some(reported.in_proportion(share));
    }
    let mut changes = Vec::with_capacity(of_patches.len());
    for (patch, open) in solution.patches.iter_mut().zip(of_patches) {
        let limit = FORCE_OPEN * friction * patch.normal_force_n;
        changes.push(
            open.between.pressure > PRESSURE_OPEN * patch.pressure_max_mpa
                || open
                    .between
                    .force
                    .iter()
                    .any(|force| *force > limit && limit > 0.0),
        );
        let open = open.all;
        let reported = open.report(friction * patch.normal_force_n, patch.pressure_max_mpa);
        for point in &mut patch.points {
            let share = point.region.as_deref().map_or([1.0; 2], |region| {
                [
                    region.normal_force_n / patch.normal_force_n,
                    region.pressure_max_mpa / patch.pressure_max_mpa,
                ]
            });
            point.profile_uncertainty = Some(reported.in_proportion(share));
        }
    }
    changes
}

fn largest(solution: &Solution) -> f64 {
    let all = solution.patches.iter().map(|patch| patch.pressure_max_mpa);
    all.fold(0.0, f64::max)
}

/// The uncertainty of a patch, `limit` being its μN: from its points, and from the differences to the nearest patch of each companion.
fn of_patch(
    patch: &PatchSolution,
    chosen: &[usize],
    companions: &[Solution],
    limit: f64,
    rough: bool,
) -> OfPatch {
    let by_points = BY_ROUGHNESS * open_by_points(patch, rough);
    let force = FORCE_BY_PRESSURE * limit * by_points / patch.pressure_max_mpa;
    let mut open = Open::default();
    let across = |patch: &PatchSolution| patch.position.map_or(0.0, |place| place.track_mm[1]);
    let far = |other: &PatchSolution| (across(other) - across(patch)).abs();
    for companion in companions {
        let same = companion
            .patches
            .iter()
            .min_by(|a, b| far(a).total_cmp(&far(b)))
            .filter(|same| far(same) < SAME_PLACE);
        let Some(same) = same else {
            // The companion has no such patch, so nothing of it is certain.
            open.widen([limit; 2], patch.pressure_max_mpa);
            continue;
        };
        let pressure = (same.pressure_max_mpa - patch.pressure_max_mpa).abs();
        for (k, other) in chosen.iter().zip(&same.points) {
            let own = &patch.points[*k];
            let force = [
                (other.force_x_n - own.force_x_n).abs(),
                (other.force_y_n - own.force_y_n).abs(),
            ];
            open.widen(force, pressure);
        }
    }
    let mut all = open;
    all.widen([force; 2], by_points);
    OfPatch { between: open, all }
}
