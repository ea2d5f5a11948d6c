//! `smoothing_mm: "auto"`: the smoothing that suits the noise of the profiles and the pressure between them.

use crate::contact::case::problem::CheckedCase;
use crate::contact::case::profile_points;
use crate::contact::case::profile_points::PRESSURE_USUAL;
use crate::contact::error::SolveError;
use crate::contact::geometry::profile::Body;
use crate::contact::geometry::profile_quality::points::advised_smoothing;
use crate::contact::half_space::grid_operator::GridWorkspace;
use crate::contact::monitor::Monitor;
use crate::contact::normal::wheel_height::search::{Accuracy, NormalPass};
use crate::contact::normal::wheel_height::task::WheelTask;
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::remark::list::Remark;
use crate::contact::time_limit::TimeLimit;

/// By which part the rest for that pressure may miss the force: the length goes with its power −2/9.
const TOLERANCE: f64 = 0.1;

/// What was chosen, for the answer.
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

/// Was a smoothing to be chosen from points that do not tell their noise?
pub(crate) fn undecided(contact: &WheelTask) -> bool {
    let profiles = contact.geometry.profiles().into_iter();
    profiles
        .zip(contact.trust.auto)
        .any(|(profile, auto)| auto && !profile_points::tells_noise(profile))
}

/// The contact with the smoothing settled where the case leaves it to the noise: first for a pressure of 1200 MPa, then for the largest one
/// found with that, on coarse gaps.
///
/// # Errors
/// There is no rest of the wheel, or the monitor stopped the work.
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
    let grains = contact.geometry.profiles().map(profile_points::grain);
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
    let search = trial
        .search()
        .map_err(|reason| SolveError::NormalProblem { reason })?;
    let wanted = NormalPass {
        friction_share: 0.0,
        accuracy: Accuracy::About(TOLERANCE),
    };
    let watch = TimeLimit::new(monitor, case.run.time_limit, 1);
    let wheel = trial.press(&search, wanted, None, &mut GridWorkspace::default(), &watch)?;
    let pressures = wheel.patches.iter().flat_map(|gap| gap.field.patches());
    let main = pressures
        .max_by(|a, b| a.normal_force.total_cmp(&b.normal_force))
        .map_or(PRESSURE_USUAL, |patch| patch.pressure_max);
    Ok(Some(with(chosen(main))))
}
