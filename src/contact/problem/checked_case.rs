//! A checked case: its physics ([`Problem`]), how it is solved ([`Run`]) and its name ([`Label`]).
//!
//! The quality of profiles before their contact is known, and remarks on contacts outside the range of the theory, are here too.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::case::words::contact::Contact;
use crate::case::words::solver::{MethodName, Output};
use crate::geometry::orientation::SureBody;
use crate::geometry::profile::{Body, NEEDED_BEYOND, Profile};
use crate::geometry::profile_quality::{NoiseLevel, advised_smoothing, polygon};
use crate::geometry::wheel_rail::WheelRail;
use crate::normal::footprint::Footprint;
use crate::normal::gap::outcome::{APPROACH_USUAL_MAX, HALF_WIDTH_USUAL_MAX};
use crate::normal::hertz::Patch;
use crate::problem::physics::{MotionPart, Problem, Run};
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;
use crate::rolling::task::{Motion, RollingTask};
use crate::solution::words::answer::Asked;
use crate::solution::words::damage::{PairQuality, SectionQuality};

/// A case that can be solved.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckedCase {
    /// The physics.
    pub problem: Problem,
    /// How it is solved.
    pub run: Run,
    /// Its name and digest.
    pub label: Label,
    /// Remarks of the checks, which the answer includes.
    pub remarks: Vec<RemarkEntry>,
}

/// Name, labels and digest of a case, on which the numbers of the answer do not depend.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// Free text of the client.
    pub name: Option<String>,
    /// Labels of the client.
    pub labels: BTreeMap<String, String>,
    /// Hexadecimal digest of everything that determines the answer, including the solver version.
    pub digest: String,
    /// The parts of the case that the answer includes.
    pub asked: Asked,
}

impl CheckedCase {
    /// Returns this case with a range of its motions.
    #[must_use]
    pub fn slice(&self, range: Range<usize>) -> CheckedCase {
        let chosen: Vec<usize> = range.clone().collect();
        let part = MotionPart {
            before: self.problem.part.before + range.start,
            ..self.problem.part
        };
        let problem = Problem {
            part,
            ..self.problem.with_motions(&chosen)
        };
        CheckedCase {
            problem,
            ..self.clone()
        }
    }

    /// Whether `auto` may take the resultants of a motion from the creep table. It needs creepages, a target and a contact that the table covers.
    pub(crate) fn may_take_table(&self, index: usize) -> bool {
        let CheckedCase { problem, run, .. } = self;
        run.method_asked == MethodName::Auto
            && run.resolution.target().is_some()
            && problem.history.is_none()
            && problem.forces[index] == [None; 2]
            && problem.is_in_table()
    }

    /// Returns the tangential problem on a footprint.
    pub fn rolling_task<'a>(&'a self, footprint: &'a Footprint) -> RollingTask<'a> {
        let CheckedCase { problem, run, .. } = self;
        RollingTask {
            footprint,
            elasticity: &problem.elasticity,
            friction: &problem.friction,
            interface: problem.interface,
            motions: &problem.motions,
            forces: &problem.forces,
            speeds: &problem.speeds,
            first_motion: problem.part.before,
            method: run.method,
            traction_bound: run.traction_bound,
            resolution: run.resolution,
            wants_slips: run.after.needs_power(&run.outputs),
            wants_gradients: run.wants(Output::Gradients),
            is_differenced: false,
        }
    }
}

/// Pressure in MPa with which profiles are assessed before their contact is known.
pub(crate) const PRESSURE_USUAL: f64 = 1200.0;

/// Returns noise and spacing of a whole profile.
pub(crate) fn noise_level(profile: &Profile) -> NoiseLevel {
    let reading = profile.read();
    let whole = [0, reading.points.at.len()];
    NoiseLevel {
        noise: reading.noise(whole).unwrap_or(0.0),
        spacing: profile.usual_chord(),
        polygon: polygon(reading.points, whole, reading.digits),
    }
}

/// Whether the points of a profile suffice to determine their noise, or lie on a polygon.
pub(crate) fn tells_noise(profile: &Profile) -> bool {
    let reading = profile.read();
    let whole = [0, reading.points.at.len()];
    reading.noise(whole).is_some() || polygon(reading.points, whole, reading.digits).is_some()
}

/// Returns the quality of both profiles before a solve, with the contact modulus in MPa.
pub(crate) fn quality(geometry: &WheelRail, modulus: f64) -> PairQuality {
    let profiles = geometry.profiles();
    let advised = advised_smoothing(profiles.map(noise_level), modulus, PRESSURE_USUAL);
    let [rail, wheel] = [0, 1].map(|k| section(profiles[k], advised[k]));
    PairQuality { rail, wheel }
}

/// Returns the quality of one profile, with the suggested smoothing in mm.
pub(crate) fn section(profile: &Profile, advised: f64) -> SectionQuality {
    let (points, groove) = (profile.points(), profile.groove());
    let chords = points.along.windows(2).enumerate();
    let longest = chords
        .filter(|(k, _)| !groove.contains(k))
        .max_by(|(_, a), (_, b)| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))
        .map_or(0, |(k, _)| k);
    SectionQuality {
        // The two points at the bottom of a groove are not points of the client.
        points: u32::try_from(points.at.len() - groove.len().min(2)).unwrap_or(u32::MAX),
        spacing_mm: profile.usual_chord(),
        hole_mm: points.along[longest + 1] - points.along[longest],
        y_mm: [points.at[longest][0], points.at[longest + 1][0]],
        noise_um: profile
            .read()
            .noise([0, points.at.len()])
            .map(|noise| 1e3 * noise),
        rounding_mm: profile.rounding(),
        smoothing_mm: profile.smoothing(),
        smoothing_suggested_mm: advised,
    }
}

/// Returns the remark on a profile whose shape can only be that of the other body.
pub(crate) fn other_body(profile: &Profile, body: Body) -> Option<Remark> {
    let (other, like) = match body {
        Body::Rail => (SureBody::Wheel, "a wheel with its flange"),
        Body::Wheel => (SureBody::Rail, "the head of a rail"),
    };
    let is_other = profile.sure_body() == Some(other);
    is_other.then(|| Remark::ProfileOfOtherBody {
        profile: body.name(),
        like,
    })
}

/// Returns the remark on a contact on the tip of the flange or near the end of a profile. The contact is a range along the profile in mm.
pub(crate) fn at_edge(profile: &Profile, body: Body, contact: [f64; 2]) -> Option<Remark> {
    let y = |s: f64| profile.at(s).at[0];
    let ([low, high], [first, last]) = (contact, profile.range());
    let left_mm = (low - first).min(last - high).max(0.0);
    let tip = profile.flange().and_then(|flange| flange.tip);
    let (profile, y_mm) = (body.name(), contact.map(y));
    if tip.is_some_and(|[from, to]| (from..=to).contains(&y(0.5 * (low + high)))) {
        return Some(Remark::ContactOnFlangeTip { profile, y_mm });
    }
    (left_mm < NEEDED_BEYOND).then_some(Remark::ContactAtProfileEnd {
        profile,
        y_mm,
        left_mm,
    })
}

/// Pressure in MPa above which all wheel and rail steels yield: about 3 times a yield stress of 1.6 GPa.
pub(crate) const PRESSURE_USUAL_MAX: f64 = 5000.0;
/// Shakedown limit of the pressure in MPa of rail steel in pure rolling: 4.7 times the shear yield stress (Johnson, Contact Mechanics, 1985,
/// section 9.2), which is 550 MPa divided by √3 for R260 (EN 13674-1).
const SHAKEDOWN_LIMIT: f64 = 1500.0;
/// Load in N above which a mistake of unit is likely: about 60 times that of a heavy wheel.
const LOAD_USUAL_MAX: f64 = 1e7;
/// Creepage above which sliding is not small compared with the rolling speed.
const CREEPAGE_USUAL_MAX: f64 = 0.2;

/// Returns the remarks on patches and motions that are known from the case alone.
pub(crate) fn of_case(
    contact: &Contact,
    patches: &[Patch],
    motions: &[Motion],
) -> Vec<RemarkEntry> {
    let radii = match *contact {
        Contact::Radii {
            rolling_mm,
            lateral_mm,
        } => Some([rolling_mm, lateral_mm]),
        _ => None,
    };
    let alone = patches.len() == 1;
    let of_patches = patches.iter().enumerate().flat_map(|(k, patch)| {
        let size = [1, 3].map(|end| 0.5 * (patch.extent[end] - patch.extent[end - 1]));
        let large = radii.map(|radii| large(size, radii));
        let strained = patch.approach.and_then(|depth| strained(depth, size));
        let all = large.into_iter().flatten().chain(strained);
        let all: Vec<Remark> = all.chain(pressure(patch.pressure_max)).collect();
        all.into_iter().map(move |remark| placed(remark, k, alone))
    });
    let load = load(patches.iter().map(|patch| patch.normal_force).sum());
    let length = patches.first().filter(|_| alone).map(|patch| patch.area);
    let length = length.map(|area| (area / std::f64::consts::PI).sqrt());
    let of_motions = motions.iter().enumerate().filter_map(|(k, motion)| {
        let remark = creepage(motion, length)?;
        Some(RemarkEntry {
            point: Some(k),
            ..placed(remark, 0, true)
        })
    });
    let load = load.map(RemarkEntry::from);
    of_patches.chain(load).chain(of_motions).collect()
}

/// Returns a remark for a patch, without its number if it is the only one.
fn placed(remark: Remark, patch: usize, alone: bool) -> RemarkEntry {
    if alone {
        remark.into()
    } else {
        remark.at_patch(patch)
    }
}

fn large(half_widths: [f64; 2], radii: [f64; 2]) -> Vec<Remark> {
    let directions = ["rolling", "lateral"].into_iter();
    let all = directions.zip(half_widths).zip(radii);
    all.filter(|((_, half), radius)| *half > HALF_WIDTH_USUAL_MAX * radius)
        .map(
            |((direction, half_width_mm), radius_mm)| Remark::PatchLarge {
                direction,
                half_width_mm,
                radius_mm,
            },
        )
        .collect()
}

fn strained(overlap_mm: f64, half_widths: [f64; 2]) -> Option<Remark> {
    let half_width_mm = half_widths[0].min(half_widths[1]);
    (overlap_mm > APPROACH_USUAL_MAX * half_width_mm).then_some(Remark::StrainsTooLarge {
        overlap_mm,
        half_width_mm,
    })
}

/// Returns the remark on an unusual largest pressure in MPa.
pub(crate) fn pressure(pressure_max_mpa: f64) -> Option<Remark> {
    if pressure_max_mpa > PRESSURE_USUAL_MAX {
        return Some(Remark::PressureImplausible {
            pressure_max_mpa,
            usual_max_mpa: PRESSURE_USUAL_MAX,
        });
    }
    (pressure_max_mpa > SHAKEDOWN_LIMIT).then_some(Remark::PressureAboveShakedown {
        pressure_max_mpa,
        shakedown_limit_mpa: SHAKEDOWN_LIMIT,
    })
}

/// Returns the remark on an unusual normal force of all patches in N.
pub(crate) fn load(normal_force_n: f64) -> Option<Remark> {
    (normal_force_n > LOAD_USUAL_MAX).then_some(Remark::LoadImplausible {
        normal_force_n,
        usual_max_n: LOAD_USUAL_MAX,
    })
}

/// Returns the remark on an unusual motion; `length` is √(area/π) of the patch in mm, if it is known.
pub(crate) fn creepage(motion: &Motion, length: Option<f64>) -> Option<Remark> {
    let Motion {
        creepage_x,
        creepage_y,
        spin_per_mm,
    } = *motion;
    let spin_times_length = length.map(|length| spin_per_mm * length);
    let sizes = [creepage_x, creepage_y, spin_times_length.unwrap_or(0.0)];
    let largest = sizes.map(f64::abs).into_iter().fold(0.0, f64::max);
    (largest > CREEPAGE_USUAL_MAX).then_some(Remark::CreepageLarge {
        creepage_x,
        creepage_y,
        spin_times_length,
        usual_max: CREEPAGE_USUAL_MAX,
    })
}
