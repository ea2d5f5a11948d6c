//! Solves a wheel on a rail and assesses its profiles.

use std::sync::Arc;

use crate::error::SolveError;
use crate::geometry::contact_locus::ContactLocus;
use crate::geometry::holes::{Hole, holes};
use crate::geometry::profile::{Body, NEEDED_BEYOND, Profile};
use crate::geometry::profile_quality::{NoiseLevel, advised_smoothing, under_contact};
use crate::monitor::Monitor;
use crate::normal::wheel::{ReferenceSurface, WheelContact, WheelPatch, WheelTask};
use crate::numerics::roots::bounds;
use crate::problem::checked_case::{self, CheckedCase, PRESSURE_USUAL};
use crate::profile_assessment::judge::{Defect, FoundPatch, judge};
use crate::profile_assessment::uncertainty;
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;
use crate::rolling::operator_store::OperatorStore;
use crate::solution::words::answer::{Fields, Solution};
use crate::solution::words::damage::PatchQuality;
use crate::wheel_on_rail::{self, SolvedWheel};

/// Solves a wheel on a rail and assesses its profiles.
///
/// # Errors
/// Returns the reason why there is no answer: [`SolveError::RoughProfile`] if the points of a profile do not allow one and rough profiles are
/// not accepted.
pub(crate) fn solve(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    contact: &WheelTask,
    monitor: &dyn Monitor,
) -> Result<(Solution, Fields), SolveError> {
    let settled = settled(case, contact, monitor)?;
    let contact = settled.as_ref().unwrap_or(contact);
    let found = judged(operators, case, contact, monitor)?;
    let found = trusted(operators, case, contact, found, monitor)?;
    Ok((found.solution, found.fields))
}

/// Solves a wheel on a rail and refuses profiles that allow no answer, without assessing the uncertainty of the others.
///
/// # Errors
/// Returns the errors of [`solve`].
pub(crate) fn judged(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    contact: &WheelTask,
    monitor: &dyn Monitor,
) -> Result<SolvedWheel, SolveError> {
    let mut last = Vec::new();
    let before = &mut |wheel: &WheelContact| {
        (_, last) = assess(contact, wheel);
        refuse(contact, &last)
    };
    let found = wheel_on_rail::solve(operators, case, contact, before, monitor);
    found.map_err(|error| explained(&last, error))
}

/// Checks that a wheel without tractions has an equilibrium on the curve of its rail, on profiles that allow an answer. On planes nothing is
/// checked.
///
/// # Errors
/// Returns the reason why it has none.
pub(crate) fn comes_to_rest(
    case: &CheckedCase,
    contact: &WheelTask,
    monitor: &dyn Monitor,
) -> Result<(), SolveError> {
    if contact.surface == ReferenceSurface::Planes {
        return Ok(());
    }
    let settled = settled(case, contact, monitor)?;
    let contact = settled.as_ref().unwrap_or(contact);
    let before = &mut |wheel: &WheelContact| refuse(contact, &assess(contact, wheel).1);
    wheel_on_rail::at_rest(case, contact, before, monitor)?;
    Ok(())
}

/// Assesses the profiles under the patches of a solved wheel.
///
/// # Errors
/// Returns the errors of [`solve`].
pub(crate) fn trusted(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    contact: &WheelTask,
    mut found: SolvedWheel,
    monitor: &dyn Monitor,
) -> Result<SolvedWheel, SolveError> {
    let (qualities, defects) = assess(contact, &found.wheel);
    let solution = &mut found.solution;
    for (patch, quality) in solution.patches.iter_mut().zip(qualities) {
        patch.quality = Some(quality);
    }
    let of_smoothing = smoothing_remarks(contact);
    let undecided = |remark: &Remark| matches!(remark, Remark::SmoothingUndecided { .. });
    let suspicious =
        defects.iter().any(|defect| defect.suspicious) || of_smoothing.iter().any(undecided);
    let changes = uncertainty::add(operators, case, contact, suspicious, solution, monitor)?;
    let reported = defects
        .into_iter()
        .filter(|defect| defect.is_reported(changes[defect.patch]));
    let worst = worst_of_each(reported);
    let of_smoothing = of_smoothing.into_iter().map(RemarkEntry::from);
    solution.remarks.extend(of_smoothing);
    solution.remarks.extend(worst.iter().map(Defect::entry));
    let target_below = uncertainty::target_below(case, solution);
    solution.remarks.extend(target_below);
    Ok(found)
}

/// The worst defect of each kind and body. A rough profile may have dozens of patches, too many for one remark each.
fn worst_of_each(defects: impl Iterator<Item = Defect>) -> Vec<Defect> {
    let mut worst: Vec<Defect> = Vec::new();
    for defect in defects {
        let same = |other: &&mut Defect| defect.is_like(other);
        match worst.iter_mut().find(same) {
            None => worst.push(defect),
            Some(other) if defect.worse_than(other) => *other = defect,
            Some(_) => {}
        }
    }
    worst
}

/// Advice at the end of the error about a refused profile.
const ACCEPT: &str = "; to solve it anyway, give accept_rough_profiles: true";

/// The error that a defect causes, with a further clause.
fn rough(defect: &Defect, more: &str) -> SolveError {
    SolveError::RoughProfile {
        pointer: defect.pointer().to_owned(),
        reason: defect.entry().detail + more,
    }
}

/// Fails before the tangential problem is solved if the answer would be unreliable. That solve could fail with an error that does not mention
/// the cause, such as an outlier and the ridge on it.
fn refuse(contact: &WheelTask, defects: &[Defect]) -> Result<(), SolveError> {
    let refused = defects.iter().find(|defect| defect.refused);
    match refused.filter(|_| !contact.trust.accept_rough) {
        Some(defect) => Err(rough(defect, ACCEPT)),
        None => Ok(()),
    }
}

/// The error of a motion that was not solved. If the profiles have defects, they are named as the cause of a failure of the mesh.
fn explained(defects: &[Defect], error: SolveError) -> SolveError {
    let of_mesh = matches!(
        error,
        SolveError::NotConverged { .. } | SolveError::Unmeshable { .. }
    );
    let worst = defects
        .iter()
        .filter(|defect| of_mesh && (defect.refused || defect.is_reported(false)))
        .reduce(|worst, other| match other.worse_than(worst) {
            true => other,
            false => worst,
        });
    match worst {
        Some(defect) => rough(defect, &format!("; {error}")),
        None => error,
    }
}

/// The quality of the profiles under every patch of a wheel in equilibrium, and their defects.
fn assess(contact: &WheelTask, wheel: &WheelContact) -> (Vec<PatchQuality>, Vec<Defect>) {
    let (mut qualities, mut defects) = (Vec::new(), Vec::new());
    let mut width: f64 = 0.0;
    let load = wheel.normal_force();
    for (number, found) in wheel.patches.iter().enumerate() {
        let patch = found.patch();
        let [.., from, to] = patch.extent;
        let place = FoundPatch {
            patch: found,
            pressure: patch.pressure_max,
            load_share: patch.normal_force / load,
            number,
        };
        let (modulus, auto) = (contact.contact_modulus, contact.trust.auto);
        let (quality, own) = judge(&contact.geometry, place, modulus, auto);
        width = width.max(to - from);
        qualities.push(quality);
        defects.extend(own);
    }
    defects.extend(hidden(contact, wheel, width, &mut qualities));
    (qualities, defects)
}

/// Stretches without points outside all patches where the bodies may touch. `width` in mm is that of the widest patch.
fn hidden(
    contact: &WheelTask,
    wheel: &WheelContact,
    width: f64,
    qualities: &mut [PatchQuality],
) -> Vec<Defect> {
    let geometry = &contact.geometry;
    let longest = geometry.profiles().map(Profile::longest_chord);
    if longest[0].max(longest[1]) < Hole::least(width) {
        return Vec::new();
    }
    // The search takes a considerable part of the time of a solve.
    let Ok(search) = ContactLocus::new(geometry) else {
        return Vec::new();
    };
    holes(&search, wheel.lowering, width)
        .into_iter()
        .filter_map(|hole| beside(contact, &hole, wheel, qualities))
        .collect()
}

/// The defect of a hole, attributed to the nearest patch; `None` if a patch overlaps it.
fn beside(
    contact: &WheelTask,
    hole: &Hole,
    wheel: &WheelContact,
    qualities: &mut [PatchQuality],
) -> Option<Defect> {
    let body = hole.body as usize;
    let profile = contact.geometry.profiles()[body];
    let [from, to] = hole.chord;
    let distance = |patch: &WheelPatch| {
        let [low, high] = bounds(patch.ends.map(|end| end[body]));
        (low - to).max(from - high)
    };
    let distances = wheel.patches.iter().map(distance).enumerate();
    let (nearest, distance) = distances.min_by(|a, b| a.1.total_cmp(&b.1))?;
    if distance < 0.0 {
        return None;
    }
    let quality = match hole.body {
        Body::Rail => &mut qualities[nearest].rail,
        Body::Wheel => &mut qualities[nearest].wheel,
    };
    let length = to - from;
    quality.hole_mm = Some(quality.hole_mm.unwrap_or(0.0).max(length));
    let remark = Remark::ProfileHole {
        profile: hole.body.name(),
        y_mm: hole.chord.map(|s| profile.at(s).at[0]),
        hole_mm: length,
    };
    Some(Defect {
        refused: hole.wide,
        ..Defect::certain(hole.body, nearest, length, remark)
    })
}

/// Noise and spacing of a profile near a place in mm along it. Near a few displaced points no noise is reported, because smoothing would only
/// spread their error.
fn noise_level_near(profile: &Profile, place: f64, modulus: f64) -> NoiseLevel {
    // A usual patch is about as wide.
    let contact = [place - NEEDED_BEYOND, place + NEEDED_BEYOND];
    let found = under_contact(&profile.read(), contact, modulus);
    let noise = found.noise.filter(|_| found.local_defect.is_none());
    NoiseLevel {
        noise: noise.unwrap_or(0.0),
        spacing: found.spacing,
        polygon: found.polygon,
    }
}

/// Returns the remarks on smoothings that were requested to be automatic.
fn smoothing_remarks(contact: &WheelTask) -> Vec<Remark> {
    let profiles = contact.geometry.profiles().into_iter();
    let profiles = profiles.zip([Body::Rail, Body::Wheel]);
    let chosen = profiles.zip(contact.trust.auto).filter(|(_, auto)| *auto);
    let remark = |((profile, body), _): ((&Profile, Body), bool)| {
        let name = body.name();
        match checked_case::tells_noise(profile) {
            true => Remark::SmoothingChosen {
                profile: name,
                smoothing_mm: profile.smoothing(),
            },
            false => Remark::SmoothingUndecided {
                profile: name,
                spacing_mm: profile.usual_chord(),
            },
        }
    };
    chosen.map(remark).collect()
}

/// Replaces every automatic smoothing by a length. Returns `None` if the case has none.
///
/// The first length suits a pressure of 1200 MPa. The final one suits the largest pressure that a solve on a coarse grid finds with the first.
/// If the noise of a whole profile needs no smoothing, the points near the first touch decide.
///
/// # Errors
/// Returns an error if the wheel has no equilibrium on the rail or the monitor stopped the work.
pub(crate) fn settled(
    case: &CheckedCase,
    contact: &WheelTask,
    monitor: &dyn Monitor,
) -> Result<Option<WheelTask>, SolveError> {
    let auto = contact.trust.auto;
    if auto == [false; 2] {
        return Ok(None);
    }
    let modulus = contact.contact_modulus;
    let mut levels = contact.geometry.profiles().map(checked_case::noise_level);
    let advised = advised_smoothing(levels, modulus, PRESSURE_USUAL);
    if let Ok(search) = ContactLocus::new(&contact.geometry) {
        let touch = search.first_touch();
        for k in [0, 1] {
            if auto[k] && advised[k] == 0.0 {
                levels[k] = noise_level_near(contact.geometry.profiles()[k], touch[k], modulus);
            }
        }
    }
    let chosen = |pressure: f64| {
        let advised = advised_smoothing(levels, modulus, pressure);
        let [rail, wheel] = contact.geometry.profiles();
        let own = [rail.smoothing(), wheel.smoothing()];
        [0, 1].map(|k| if auto[k] { advised[k] } else { own[k] })
    };
    let mut smoothing = chosen(PRESSURE_USUAL);
    if smoothing != [0.0; 2] {
        let smoothed = contact.smoothed(smoothing);
        smoothing = chosen(wheel_on_rail::largest_pressure(case, &smoothed, monitor)?);
    }
    Ok(Some(contact.smoothed(smoothing)))
}
