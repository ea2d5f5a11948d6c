//! `smoothing_mm: "auto"`: the smoothing chosen from the noise of the profiles and the contact pressure.

use crate::contact::error::SolveError;
use crate::contact::geometry::contact_locus::ContactLocus;
use crate::contact::geometry::profile::{Body, Profile};
use crate::contact::geometry::profile_quality::points::{Grain, advised_smoothing, under_contact};
use crate::contact::half_space::grid_operator::GridWorkspace;
use crate::contact::monitor::Monitor;
use crate::contact::normal::wheel_height::search::HeightStart;
use crate::contact::normal::wheel_height::task::{Accuracy, NormalPass, WheelTask};
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::problem::profile_points;
use crate::contact::problem::profile_points::PRESSURE_USUAL;
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::remark::list::Remark;
use crate::contact::time_limit::TimeLimit;

/// Relative error allowed in the force of the solve that finds the pressure; the smoothing varies only as its power −2/9.
const TOLERANCE: f64 = 0.1;
/// Half of the length in mm about the first touch that counts as contact, about half the width of a usual patch.
const NEAR: f64 = 5.0;

/// Noise and spacing of a profile near a place in mm along it. A few displaced points are no noise: smoothing only spreads their error.
fn grain_near(profile: &Profile, place: f64, modulus: f64) -> Grain {
    let contact = [place - NEAR, place + NEAR];
    let found = under_contact(&profile.read(), profile.stretches(), contact, modulus);
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
            let remark = if profile_points::tells_noise(profile) {
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
        .any(|(profile, auto)| auto && !profile_points::tells_noise(profile))
}

/// The contact with every automatic smoothing replaced by a length: first the one for a pressure of 1200 MPa, then the one for the largest
/// pressure that a solve on coarse gaps finds with the first. Where the noise of a whole profile asks for none, that of its points near the
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
    let mut grains = contact.geometry.profiles().map(profile_points::grain);
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
    let trial = with(first);
    let mut search = trial
        .search()
        .map_err(|reason| SolveError::NormalProblem { reason })?;
    let wanted = NormalPass {
        friction_share: 0.0,
        accuracy: Accuracy::About(TOLERANCE),
    };
    let watch = TimeLimit::new(monitor, case.run.time_limit, 1);
    let wheel = trial.find_height(
        &mut search,
        wanted,
        HeightStart::default(),
        &mut GridWorkspace::default(),
        &watch,
    )?;
    let pressures = wheel.patches.iter().flat_map(|gap| gap.field.patches());
    let main = pressures
        .max_by(|a, b| a.normal_force.total_cmp(&b.normal_force))
        .map_or(PRESSURE_USUAL, |patch| patch.pressure_max);
    Ok(Some(with(chosen(main))))
}
