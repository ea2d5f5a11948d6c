//! The uncertainty due to the measurement of the profiles, from solving the same contact with other smoothings.
//!
//! With the smoothing L the contact is solved again with L/2.5, which shows how much noise remains, and with 2 L, which shows how much of
//! the shape is lost. The uncertainty is the largest difference, plus 1 % of the pressure and 0.3 % of μN respectively. Population: noise
//! of 1 to 20 µm with L = 5 mm. The errors of 97 % of the pressures and 93 % of the forces are within it.

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

/// Factors of the smoothing in the companion solves.
pub(crate) const COMPANIONS: [f64; 2] = [0.4, 2.0];
/// Part of the uncertainty of the pressure in any case, relative to the largest pressure.
const PRESSURE_FLOOR: f64 = 0.01;
/// Part of the uncertainty of the forces in any case, relative to μN.
const FORCE_FLOOR: f64 = 0.003;
/// Uncertainty of the pressure due to the points, as a multiple of their roughness.
const BY_ROUGHNESS: f64 = 2.0;
/// Uncertainty of the forces due to the points, relative to μN, as a multiple of that of the pressure relative to the pressure.
const FORCE_BY_PRESSURE: f64 = 0.1;
/// Target error of the companions relative to μN.
const TARGET: f64 = 0.01;
/// Most motions for which companions are solved.
const MOTIONS_MAX: usize = 5;
/// Change of the pressure, relative to the largest pressure, from which there is a remark.
const PRESSURE_CHANGE: f64 = 0.06;
/// Change of a force, relative to μN, from which there is a remark.
const FORCE_CHANGE: f64 = 0.02;
/// Largest lateral distance in mm between corresponding patches of a solve and its companion.
const SAME_PATCH: f64 = 6.0;

/// Writes the uncertainty into every point and total. Returns for each patch whether another reading changes it so much that a remark is due.
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
    let noisy = |patch: &PatchSolution| noisy(patch, contact.contact_modulus);
    if suspicious || solution.patches.iter().any(noisy) {
        for smoothing in readings(contact, solution) {
            let other = contact.smoothed(smoothing);
            match wheel_on_rail::solve(
                operators,
                &companion(case, &chosen),
                &other,
                // The profiles of companions are not assessed.
                &mut |_| Ok(()),
                // Companions can be stopped, but report no progress, because that of the solve is complete.
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
                // Without companions, the uncertainty follows from the roughness alone.
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

/// Returns whether the noise that remains after smoothing is a significant share of the pressure.
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

/// Roughness of both bodies in MPa: their ambiguity, and their waviness if it is not due to the shape.
fn roughness(patch: &PatchSolution, rough: bool) -> f64 {
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

/// Differences between answers, in forces (N) and in the largest pressure (MPa).
#[derive(Debug, Clone, Copy, Default)]
struct Differences {
    force: [f64; 2],
    pressure: f64,
}

impl Differences {
    /// Enlarges the differences to at least these.
    fn widen(&mut self, force: [f64; 2], pressure: f64) {
        self.force = [0, 1].map(|k| self.force[k].max(force[k]));
        self.pressure = self.pressure.max(pressure);
    }

    /// The uncertainty for a friction limit μN and a largest pressure.
    fn report(self, limit: f64, pressure: f64) -> ProfileUncertainty {
        ProfileUncertainty {
            force_x_n: self.force[0] + FORCE_FLOOR * limit,
            force_y_n: self.force[1] + FORCE_FLOOR * limit,
            pressure_max_mpa: self.pressure + PRESSURE_FLOOR * pressure,
        }
    }
}

impl ProfileUncertainty {
    /// The uncertainty in another motion, given its load and its largest pressure relative to those of the first one.
    fn in_proportion(self, [load, pressure]: [f64; 2]) -> ProfileUncertainty {
        ProfileUncertainty {
            force_x_n: self.force_x_n * load,
            force_y_n: self.force_y_n * load,
            pressure_max_mpa: self.pressure_max_mpa * pressure,
        }
    }
}

/// Writes the uncertainties of all motions, in proportion to their loads and pressures.
fn write(
    friction: f64,
    chosen: &[usize],
    companions: &[Solution],
    solution: &mut Solution,
) -> Vec<bool> {
    let rough = !companions.is_empty();
    let patches = solution.patches.iter();
    let of_patches: Vec<[Differences; 2]> = patches
        .map(|patch| {
            let limit = friction * patch.normal_force_n;
            of_patch(patch, chosen, companions, limit, rough)
        })
        .collect();
    let mut of_all = Differences::default();
    for [_, all] in &of_patches {
        of_all.pressure = of_all.pressure.max(all.pressure);
        of_all.force = [0, 1].map(|k| of_all.force[k] + all.force[k]);
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
    for (patch, [between, all]) in solution.patches.iter_mut().zip(of_patches) {
        let limit = FORCE_CHANGE * friction * patch.normal_force_n;
        let is_large = |force: &f64| *force > limit && limit > 0.0;
        changes.push(
            between.pressure > PRESSURE_CHANGE * patch.pressure_max_mpa
                || between.force.iter().any(is_large),
        );
        let reported = all.report(friction * patch.normal_force_n, patch.pressure_max_mpa);
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

/// The differences of a patch, whose friction limit μN is `limit`, from the nearest patch of each companion; and the same including the effect
/// of the roughness of its points.
fn of_patch(
    patch: &PatchSolution,
    chosen: &[usize],
    companions: &[Solution],
    limit: f64,
    rough: bool,
) -> [Differences; 2] {
    let by_points = BY_ROUGHNESS * roughness(patch, rough);
    let force = FORCE_BY_PRESSURE * limit * by_points / patch.pressure_max_mpa;
    let mut between = Differences::default();
    let across = |patch: &PatchSolution| patch.position.map_or(0.0, |place| place.track_mm[1]);
    let far = |other: &PatchSolution| (across(other) - across(patch)).abs();
    for companion in companions {
        let same = companion
            .patches
            .iter()
            .min_by(|a, b| far(a).total_cmp(&far(b)))
            .filter(|same| far(same) < SAME_PATCH);
        let Some(same) = same else {
            // The companion has no such patch, so that the patch is entirely uncertain.
            between.widen([limit; 2], patch.pressure_max_mpa);
            continue;
        };
        let pressure = (same.pressure_max_mpa - patch.pressure_max_mpa).abs();
        for (k, other) in chosen.iter().zip(&same.points) {
            let own = &patch.points[*k];
            let force = [
                (other.force_x_n - own.force_x_n).abs(),
                (other.force_y_n - own.force_y_n).abs(),
            ];
            between.widen(force, pressure);
        }
    }
    let mut all = between;
    all.widen([force; 2], by_points);
    [between, all]
}
