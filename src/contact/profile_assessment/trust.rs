//! Solves a wheel on a rail and assesses its profiles.

use std::sync::Arc;

use crate::error::SolveError;
use crate::geometry::contact_locus::ContactLocus;
use crate::geometry::holes::{Hole, holes};
use crate::geometry::profile::{Body, NEEDED_BEYOND, Profile};
use crate::geometry::profile_quality::{Grain, advised_smoothing, under_contact};
use crate::monitor::Monitor;
use crate::normal::wheel::{ReferenceSurface, WheelContact, WheelPatch, WheelTask};
use crate::problem::checked_case;
use crate::problem::checked_case::{CheckedCase, PRESSURE_USUAL};
use crate::profile_assessment::judge::{Cause, Finding, FoundPatch, HARMLESS, judge, sorted};
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
/// Why there is no answer; [`SolveError::RoughProfile`] where the points of a profile do not allow one and rough profiles are not
/// accepted.
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

/// Solves a wheel on a rail and refuses profiles that allow no answer; how far the others can be trusted is not assessed.
///
/// # Errors
/// As [`solve`].
pub(crate) fn judged(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    contact: &WheelTask,
    monitor: &dyn Monitor,
) -> Result<SolvedWheel, SolveError> {
    Judgement::new(contact).solve(operators, case, monitor)
}

/// Whether a wheel comes to rest on the curve of its rail without tractions, on profiles that allow an answer. There is no such question on planes.
///
/// # Errors
/// Why it does not.
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

/// Assesses the profiles under the patches of a wheel that was solved.
///
/// # Errors
/// As [`solve`].
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
    let (qualities, findings) = judgement.assess(&found.wheel);
    let solution = &mut found.solution;
    for (patch, quality) in solution.patches.iter_mut().zip(qualities) {
        patch.quality = Some(quality);
    }
    let rough = findings.iter().any(|finding| {
        finding.of_roughness() && finding.has_evidence() && finding.share > HARMLESS
    });
    let suspicious = rough || undecided(contact);
    let changes = uncertainty::add(operators, case, contact, suspicious, solution, monitor)?;
    let reported = findings
        .into_iter()
        .filter(|finding| finding.is_reported(changes[finding.patch]));
    let reported = worst_of_each(reported);
    solution.remarks.extend(remarks(contact));
    solution
        .remarks
        .extend(reported.iter().map(Finding::remark));
    solution
        .remarks
        .extend(uncertainty::target_below(case, solution));
    Ok(found)
}

/// The worst finding of each kind and body. A rough profile has dozens of patches, of which one remark each would be too many.
fn worst_of_each(findings: impl Iterator<Item = Finding>) -> Vec<Finding> {
    let mut worst: Vec<Finding> = Vec::new();
    for finding in findings {
        let same = |other: &&mut Finding| finding.is_like(other);
        match worst.iter_mut().find(same) {
            None => worst.push(finding),
            Some(other) if finding.worse_than(other) => *other = finding,
            Some(_) => {}
        }
    }
    worst
}

/// Assesses the profiles under the patches of a wheel at rest.
struct Judgement<'a> {
    contact: &'a WheelTask,
    /// Findings of the last wheel that was judged.
    last: Option<Assessed>,
}

/// The quality of the profiles under every patch, and the findings.
type Assessed = (Vec<PatchQuality>, Vec<Finding>);

/// Advice that ends the error about a refused profile.
const ACCEPT: &str = "; to solve it anyway, give accept_rough_profiles: true";

/// The error that a finding causes, with a further clause.
fn rough(finding: &Finding, more: &str) -> SolveError {
    SolveError::RoughProfile {
        pointer: finding.pointer().to_owned(),
        reason: finding.remark().detail + more,
    }
}

impl<'a> Judgement<'a> {
    fn new(contact: &'a WheelTask) -> Judgement<'a> {
        Judgement {
            contact,
            last: None,
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

    /// Fails before the tangential problem is solved if the answer would mislead: on the ridge under an outlier, for example, that
    /// solve would fail with an error that does not mention the outlier.
    fn before(&mut self, wheel: &WheelContact) -> Result<(), SolveError> {
        let assessed = self.assess(wheel);
        let (_, findings) = self.last.insert(assessed);
        if self.contact.trust.accept_rough {
            return Ok(());
        }
        let refused = findings.iter().find(|finding| finding.refused);
        refused.map_or(Ok(()), |finding| Err(rough(finding, ACCEPT)))
    }

    /// The error of a motion that was not solved, with what the wheel at rest says of its cause.
    fn explained(&self, error: SolveError) -> SolveError {
        let of_mesh = matches!(
            error,
            SolveError::NotConverged { .. } | SolveError::Unmeshable { .. }
        );
        let Some((_, findings)) = self.last.as_ref().filter(|_| of_mesh) else {
            return error;
        };
        let worst = findings
            .iter()
            .filter(|finding| finding.refused || finding.is_reported(false))
            .reduce(|worst, other| match other.worse_than(worst) {
                true => other,
                false => worst,
            });
        match worst {
            Some(finding) => rough(finding, &format!("; {error}")),
            None => error,
        }
    }

    /// The quality of the profiles under every patch, and the findings.
    fn assess(&self, wheel: &WheelContact) -> Assessed {
        let contact = self.contact;
        let (mut qualities, mut findings) = (Vec::new(), Vec::new());
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
            findings.extend(own);
        }
        let hidden = self.hidden(wheel, width, &mut qualities);
        findings.extend(hidden);
        (qualities, findings)
    }

    /// Stretches without points where the bodies may touch in addition to the patches found; `width` in mm is that of the widest
    /// patch.
    fn hidden(
        &self,
        wheel: &WheelContact,
        width: f64,
        qualities: &mut [PatchQuality],
    ) -> Vec<Finding> {
        let geometry = &self.contact.geometry;
        let longest = geometry.profiles().map(Profile::longest_chord);
        if longest[0].max(longest[1]) < Hole::least(width) {
            return Vec::new();
        }
        // Searched only if there are long chords, because the search takes a considerable part of a solve's time.
        let Ok(search) = ContactLocus::new(geometry) else {
            return Vec::new();
        };
        holes(&search, wheel.lowering, width)
            .into_iter()
            .filter_map(|hole| self.beside(&hole, wheel, width, qualities))
            .collect()
    }

    /// The finding about a hole outside all patches, attributed to the nearest one.
    fn beside(
        &self,
        hole: &Hole,
        wheel: &WheelContact,
        width: f64,
        qualities: &mut [PatchQuality],
    ) -> Option<Finding> {
        let body = hole.body as usize;
        let profile = self.contact.geometry.profiles()[body];
        let [from, to] = hole.chord;
        let distance = |patch: &WheelPatch| {
            let [low, high] = sorted(patch.ends.map(|end| end[body]));
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
        Some(Finding {
            body: hole.body,
            patch: nearest,
            y,
            pressure: 0.0,
            share: 0.0,
            left: 0.0,
            load_share: 0.0,
            everywhere: 0.0,
            chord: y,
            chord_length: length,
            over_width: length / width,
            smoothing: profile.smoothing(),
            advised: 0.0,
            refused: hole.wide,
            cause: Cause::Hole,
        })
    }
}

/// Noise and spacing of a profile near a place in mm along it. A few displaced points are no noise: smoothing only spreads their error.
fn grain_near(profile: &Profile, place: f64, modulus: f64) -> Grain {
    // About the width of a usual patch.
    let contact = [place - NEEDED_BEYOND, place + NEEDED_BEYOND];
    let found = under_contact(&profile.read(), contact, modulus);
    let noise = found.noise.filter(|_| found.oddity.is_none());
    Grain {
        noise: noise.unwrap_or(0.0),
        spacing: found.spacing,
        polygon: found.polygon,
    }
}

/// Remarks on the smoothing chosen.
pub(crate) fn remarks(contact: &WheelTask) -> Vec<RemarkEntry> {
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

/// Whether an automatic smoothing was requested for points from which the noise cannot be determined.
pub(crate) fn undecided(contact: &WheelTask) -> bool {
    let profiles = contact.geometry.profiles().into_iter();
    profiles
        .zip(contact.trust.auto)
        .any(|(profile, auto)| auto && !checked_case::tells_noise(profile))
}

/// The contact with every automatic smoothing replaced by a length: first the one for a pressure of 1200 MPa, then the one for the largest
/// pressure that a solve on a coarse grid finds with the first. Where the noise of a whole profile asks for none, that of its points near the
/// first touch decides.
///
/// # Errors
/// The wheel does not come to rest on the rail, or the monitor stopped the work.
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
    let mut grains = contact.geometry.profiles().map(checked_case::grain);
    let advised = advised_smoothing(grains, modulus, PRESSURE_USUAL);
    if let Ok(search) = ContactLocus::new(&contact.geometry) {
        let touch = search.first_touch();
        for k in [0, 1] {
            if auto[k] && advised[k] == 0.0 {
                grains[k] = grain_near(contact.geometry.profiles()[k], touch[k], modulus);
            }
        }
    }
    let chosen = |pressure: f64| {
        let advised = advised_smoothing(grains, modulus, pressure);
        let [rail, wheel] = contact.geometry.profiles();
        let own = [rail.smoothing(), wheel.smoothing()];
        [0, 1].map(|k| if auto[k] { advised[k] } else { own[k] })
    };
    let with = |smoothing: [f64; 2]| contact.smoothed(smoothing);
    let first = chosen(PRESSURE_USUAL);
    if first == [0.0; 2] {
        return Ok(Some(with(first)));
    }
    let main = wheel_on_rail::largest_pressure(case, &with(first), monitor)?;
    Ok(Some(with(chosen(main))))
}
