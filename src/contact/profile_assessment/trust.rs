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
use crate::problem::checked_case;
use crate::problem::checked_case::{CheckedCase, PRESSURE_USUAL};
use crate::profile_assessment::judge::{Defect, FoundPatch, judge};
use crate::profile_assessment::uncertainty;
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;
use crate::rolling::operator_store::OperatorStore;
use crate::solution::words::answer::{Fields, Solution};
use crate::solution::words::damage::PatchQuality;
use crate::wheel_on_rail;
use crate::wheel_on_rail::SolvedWheel;

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
    let mut judgement = Judgement::new(contact);
    let found = judgement.solve(operators, case, monitor)?;
    let found = assessed(operators, case, &judgement, found, monitor)?;
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
    Judgement::new(contact).solve(operators, case, monitor)
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
    let mut judgement = Judgement::new(contact);
    let before = &mut |wheel: &WheelContact| judgement.before(wheel);
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
    found: SolvedWheel,
    monitor: &dyn Monitor,
) -> Result<SolvedWheel, SolveError> {
    assessed(operators, case, &Judgement::new(contact), found, monitor)
}

fn assessed(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    judgement: &Judgement,
    mut found: SolvedWheel,
    monitor: &dyn Monitor,
) -> Result<SolvedWheel, SolveError> {
    let contact = judgement.contact;
    let (qualities, defects) = judgement.assess(&found.wheel);
    let solution = &mut found.solution;
    for (patch, quality) in solution.patches.iter_mut().zip(qualities) {
        patch.quality = Some(quality);
    }
    let suspicious = defects.iter().any(|defect| defect.suspicious) || undecided(contact);
    let changes = uncertainty::add(operators, case, contact, suspicious, solution, monitor)?;
    let reported = defects
        .into_iter()
        .filter(|defect| defect.is_reported(changes[defect.patch]));
    let worst = worst_of_each(reported);
    solution.remarks.extend(remarks(contact));
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

/// The assessment of the profiles under the patches of a wheel in equilibrium.
struct Judgement<'a> {
    contact: &'a WheelTask,
    /// Defects found for the last wheel.
    last: Vec<Defect>,
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

impl<'a> Judgement<'a> {
    fn new(contact: &'a WheelTask) -> Judgement<'a> {
        Judgement {
            contact,
            last: Vec::new(),
        }
    }

    fn solve(
        &mut self,
        operators: &Arc<OperatorStore>,
        case: &CheckedCase,
        monitor: &dyn Monitor,
    ) -> Result<SolvedWheel, SolveError> {
        let contact = self.contact;
        let before = &mut |wheel: &WheelContact| self.before(wheel);
        let found = wheel_on_rail::solve(operators, case, contact, before, monitor);
        found.map_err(|error| self.explained(error))
    }

    /// Fails before the tangential problem is solved if the answer would be unreliable. That solve could fail with an error that does not
    /// mention the cause, such as an outlier and the ridge on it.
    fn before(&mut self, wheel: &WheelContact) -> Result<(), SolveError> {
        (_, self.last) = self.assess(wheel);
        let refused = self.last.iter().find(|defect| defect.refused);
        match refused.filter(|_| !self.contact.trust.accept_rough) {
            Some(defect) => Err(rough(defect, ACCEPT)),
            None => Ok(()),
        }
    }

    /// The error of a motion that was not solved. If the profiles have defects, they are named as the cause of a failure of the mesh.
    fn explained(&self, error: SolveError) -> SolveError {
        let of_mesh = matches!(
            error,
            SolveError::NotConverged { .. } | SolveError::Unmeshable { .. }
        );
        let worst = (self.last.iter())
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

    /// The quality of the profiles under every patch, and their defects.
    fn assess(&self, wheel: &WheelContact) -> (Vec<PatchQuality>, Vec<Defect>) {
        let contact = self.contact;
        let (mut qualities, mut defects) = (Vec::new(), Vec::new());
        let mut width: f64 = 0.0;
        let load = wheel.normal_force();
        for found in &wheel.patches {
            let patch = found.patch();
            let [.., from, to] = patch.extent;
            let place = FoundPatch {
                patch: found,
                pressure: patch.pressure_max,
                load_share: patch.normal_force / load,
                number: qualities.len(),
            };
            let (modulus, auto) = (contact.contact_modulus, contact.trust.auto);
            let (quality, own) = judge(&contact.geometry, place, modulus, auto);
            width = width.max(to - from);
            qualities.push(quality);
            defects.extend(own);
        }
        defects.extend(self.hidden(wheel, width, &mut qualities));
        (qualities, defects)
    }

    /// Stretches without points outside all patches where the bodies may touch. `width` in mm is that of the widest patch.
    fn hidden(
        &self,
        wheel: &WheelContact,
        width: f64,
        qualities: &mut [PatchQuality],
    ) -> Vec<Defect> {
        let geometry = &self.contact.geometry;
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
            .filter_map(|hole| self.beside(&hole, wheel, qualities))
            .collect()
    }

    /// The defect of a hole, attributed to the nearest patch; `None` if a patch overlaps it.
    fn beside(
        &self,
        hole: &Hole,
        wheel: &WheelContact,
        qualities: &mut [PatchQuality],
    ) -> Option<Defect> {
        let body = hole.body as usize;
        let profile = self.contact.geometry.profiles()[body];
        let [from, to] = hole.chord;
        let distance = |patch: &WheelPatch| {
            let [low, high] = bounds(patch.ends.map(|end| end[body]));
            (low - to).max(from - high)
        };
        let distances = wheel.patches.iter().map(distance);
        let (nearest, distance) = (distances.enumerate()).min_by(|a, b| a.1.total_cmp(&b.1))?;
        if distance < 0.0 {
            return None;
        }
        let y = hole.chord.map(|s| profile.at(s).at[0]);
        let length = hole.chord[1] - hole.chord[0];
        let quality = match hole.body {
            Body::Rail => &mut qualities[nearest].rail,
            Body::Wheel => &mut qualities[nearest].wheel,
        };
        quality.hole_mm = Some(quality.hole_mm.unwrap_or(0.0).max(length));
        let remark = Remark::ProfileHole {
            profile: hole.body.name(),
            y_mm: y,
            hole_mm: length,
        };
        Some(Defect {
            refused: hole.wide,
            ..Defect::certain(hole.body, nearest, length, remark)
        })
    }
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

/// Remarks on the smoothing chosen.
fn remarks(contact: &WheelTask) -> Vec<RemarkEntry> {
    let profiles = contact
        .geometry
        .profiles()
        .into_iter()
        .zip([Body::Rail, Body::Wheel]);
    let chosen = profiles.zip(contact.trust.auto).filter(|(_, auto)| *auto);
    chosen
        .map(|((profile, body), _)| {
            let remark = if checked_case::tells_noise(profile) {
                Remark::SmoothingChosen {
                    profile: body.name(),
                    smoothing_mm: profile.smoothing(),
                }
            } else {
                Remark::SmoothingUndecided {
                    profile: body.name(),
                    spacing_mm: profile.usual_chord(),
                }
            };
            remark.into()
        })
        .collect()
}

/// Returns whether an automatic smoothing was requested for points from which the noise cannot be determined.
fn undecided(contact: &WheelTask) -> bool {
    let profiles = contact.geometry.profiles().into_iter();
    profiles
        .zip(contact.trust.auto)
        .any(|(profile, auto)| auto && !checked_case::tells_noise(profile))
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
