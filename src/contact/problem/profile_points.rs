//! The quality of profiles as far as their points alone show it, before the contact is known.

use crate::contact::geometry::orientation::SureBody;
use crate::contact::geometry::profile::{Body, Profile};
use crate::contact::geometry::profile_quality::points::{
    Grain, advised_smoothing, noise_of, polygon_of,
};
use crate::contact::geometry::wheel_rail::WheelRail;
use crate::contact::normal::wheel::task::WheelTask;
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::remark::list::Remark;
use crate::contact::solution::words::profile_quality::{PairQuality, SectionQuality};

/// Pressure in MPa assumed for assessing profiles before their contact is known.
pub(crate) const PRESSURE_USUAL: f64 = 1200.0;

/// Noise and spacing of a whole profile.
pub fn grain(profile: &Profile) -> Grain {
    let reading = profile.read();
    let whole = [0, reading.points.at.len()];
    Grain {
        noise: noise_of(&reading, whole).unwrap_or(0.0),
        spacing: profile.usual_chord(),
        polygon: polygon_of(&reading, whole),
    }
}

/// Whether the points of a profile suffice to determine their noise, or lie on a polygon.
pub fn tells_noise(profile: &Profile) -> bool {
    let reading = profile.read();
    let whole = [0, reading.points.at.len()];
    noise_of(&reading, whole).is_some() || polygon_of(&reading, whole).is_some()
}

/// The quality of both profiles as far as it is known before the solve, with the contact modulus in MPa.
#[must_use]
pub fn quality(geometry: &WheelRail, modulus: f64) -> PairQuality {
    let profiles = geometry.profiles();
    let advised = advised_smoothing(profiles.map(grain), modulus, PRESSURE_USUAL);
    let [rail, wheel] = [0, 1].map(|k| section(profiles[k], advised[k]));
    PairQuality { rail, wheel }
}

/// How many other readings of the profiles a solve will look at: two with a smoothing, one where the noise asks for one, and one to settle
/// an automatic one.
#[must_use]
pub fn readings_expected(contact: &WheelTask) -> u32 {
    let profiles = contact.geometry.profiles();
    let auto = contact.trust.auto.contains(&true);
    let smoothed = profiles.iter().any(|profile| profile.smoothing() > 0.0);
    let grains = profiles.map(grain);
    let noisy = advised_smoothing(grains, contact.contact_modulus, PRESSURE_USUAL) != [0.0; 2];
    match (auto, smoothed || auto && noisy, noisy) {
        (true, true, _) => 3,
        (_, true, _) => 2,
        (_, false, true) => 1,
        _ => 0,
    }
}

/// The quality of one profile, with the smoothing that suits it in mm.
pub(crate) fn section(profile: &Profile, advised: f64) -> SectionQuality {
    let points = profile.points();
    let chords = points.along.windows(2).enumerate();
    let longest = chords
        .max_by(|(_, a), (_, b)| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))
        .map_or(0, |(k, _)| k);
    SectionQuality {
        points: u32::try_from(points.at.len()).unwrap_or(u32::MAX),
        spacing_mm: profile.usual_chord(),
        hole_mm: points.along[longest + 1] - points.along[longest],
        y_mm: [points.at[longest][0], points.at[longest + 1][0]],
        noise_um: noise_of(&profile.read(), [0, points.at.len()]).map(|noise| 1e3 * noise),
        rounding_mm: profile.rounding(),
        smoothing_mm: profile.smoothing(),
        smoothing_suggested_mm: advised,
    }
}

/// The remark on a profile whose shape can only be that of the other body.
#[must_use]
pub fn load_mismatch(profile: &Profile, body: Body) -> Option<RemarkEntry> {
    let (looks, like, pointer) = match body {
        Body::Rail => (SureBody::Wheel, "a wheel with its flange", "/contact/rail"),
        Body::Wheel => (SureBody::Rail, "the head of a rail", "/contact/wheel"),
    };
    let remark = Remark::ProfileOfOtherBody {
        profile: body.name(),
        like,
    };
    (profile.sure_body() == Some(looks)).then(|| remark.at_pointer(pointer))
}
