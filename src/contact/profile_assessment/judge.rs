//! Assesses the points of both profiles under the patches found, and describes their defects so that they can be corrected.

use std::mem::discriminant;

use crate::geometry::holes::{LENGTH_MIN, WIDE};
use crate::geometry::profile::{Body, Profile};
use crate::geometry::profile_quality::{
    LONG, LocalDefect, NoiseLevel, REFERENCE_MIN, UnderContact, advised_smoothing, under_contact,
};
use crate::geometry::wheel_rail::WheelRail;
use crate::normal::gap::grid::SHARE_MIN;
use crate::normal::wheel::WheelPatch;
use crate::numerics::roots::bounds;
use crate::problem::checked_case::at_edge;
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;
use crate::solution::words::damage::{PatchQuality, ProfileQuality};

/// Roughness relative to the largest pressure up to which it is harmless.
pub(crate) const HARMLESS: f64 = 0.03;
/// Roughness relative to the largest pressure from which a remark is due whatever its effect.
///
/// Population: holes and coarse points at 384 positions of the class *damaged profile*. At 0.08, 47 of 487 correct and 166 of 174 wrong
/// answers get the remark, at 0.09 38 and 165, at 0.10 34 and 163.
const ROUGH: f64 = 0.09;
/// Ambiguity relative to the largest pressure from which a job fails.
const AMBIGUOUS_MAX: f64 = 0.5;
/// Waviness relative to the largest pressure from which it is a defect without noise, outlier or step. Two arcs that meet have some too: an
/// unworn 60E1 reaches 0.12 at its gauge corner.
const WAVES_BEYOND_SHAPE: f64 = 0.3;
/// Pressure in MPa below which errors of a profile are harmless, so that no job fails because of them.
const PRESSURE_LIGHT: f64 = 200.0;

/// A patch to assess.
#[derive(Debug, Clone, Copy)]
pub struct FoundPatch<'a> {
    /// The patch.
    pub patch: &'a WheelPatch,
    /// Largest pressure in MPa.
    pub pressure: f64,
    /// Its share of the sum of the normal forces of all patches.
    pub load_share: f64,
    /// Its index in the answer.
    pub number: usize,
}

/// A defect of a profile under or next to a patch.
#[derive(Debug, Clone, PartialEq)]
pub struct Defect {
    /// The body whose profile it is.
    pub body: Body,
    /// Index of the patch in the answer.
    pub patch: usize,
    /// Roughness of both bodies relative to the largest pressure of the patch; 0 for a defect that is no roughness.
    pub share: f64,
    /// Length in mm of the chord or stretch without points; 0 for other defects.
    pub length: f64,
    /// Whether a remark is due in any case.
    pub certain: bool,
    /// Whether a remark is due if other readings of the points change the answer.
    pub suspicious: bool,
    /// Whether the answer would be unreliable, so that the job fails unless rough profiles are accepted.
    pub refused: bool,
    /// The remark.
    pub remark: Remark,
}

impl Defect {
    /// Returns a defect that gets its remark in any case.
    pub fn certain(body: Body, patch: usize, length: f64, remark: Remark) -> Defect {
        Defect {
            body,
            patch,
            share: 0.0,
            length,
            certain: true,
            suspicious: false,
            refused: false,
            remark,
        }
    }

    /// Returns whether it becomes a remark. `changes` states whether another reading of the points changes the patch much.
    pub fn is_reported(&self, changes: bool) -> bool {
        self.certain || self.refused || self.suspicious && changes
    }

    /// Returns whether `other` gives the same remark about another place.
    pub fn is_like(&self, other: &Defect) -> bool {
        self.body == other.body && discriminant(&self.remark) == discriminant(&other.remark)
    }

    /// Returns whether it is worse than another defect of its kind.
    pub fn worse_than(&self, other: &Defect) -> bool {
        [self.share, self.length] > [other.share, other.length]
    }

    /// JSON pointer to the profile.
    pub fn pointer(&self) -> &'static str {
        match self.body {
            Body::Rail => "/contact/rail",
            Body::Wheel => "/contact/wheel",
        }
    }

    /// The remark for the answer.
    pub fn entry(&self) -> RemarkEntry {
        RemarkEntry {
            patch: Some(self.patch),
            ..self.remark.clone().at_pointer(self.pointer())
        }
    }
}

/// The profile of one body under a patch.
struct Under<'a> {
    body: Body,
    profile: &'a Profile,
    /// The contact as a range of the length along the profile, in mm.
    contact: [f64; 2],
    found: UnderContact,
}

impl Under<'_> {
    /// y in mm at a length along the profile.
    fn y(&self, s: f64) -> f64 {
        self.profile.at(s).at[0]
    }

    fn rough(&self) -> f64 {
        let found = self.found.roughness;
        found.waviness.hypot(found.ambiguity)
    }

    /// The longest chord, whose length in mm is also returned.
    fn spacing(&self) -> (Remark, f64) {
        let found = &self.found;
        let length = found.chord[1] - found.chord[0];
        let remark = Remark::ProfileSpacing {
            profile: self.body.name(),
            y_mm: found.chord.map(|s| self.y(s)),
            spacing_mm: length,
            spacing_over_width: found.over_width,
            ambiguity_mpa: self.rough(),
        };
        (remark, length)
    }

    /// The remark on the cause of the roughness, whose share of the pressure is `share`. `more` is the smoothing to recommend, in mm.
    fn cause(&self, share: f64, more: Option<f64>) -> Remark {
        let (found, profile) = (&self.found, self.body.name());
        let y_mm = self.contact.map(|s| self.y(s));
        let waviness_mpa = self.rough();
        let y_of = |point: usize| self.profile.points().at[point][0];
        if let Some(chord_mm) = found.polygon {
            return Remark::ProfilePolygon {
                profile,
                y_mm,
                chord_mm,
                waviness_mpa,
                share,
                smoothing_mm: more,
            };
        }
        match found.local_defect {
            Some(LocalDefect::Outliers {
                points,
                count,
                farthest,
                distance,
            }) => Remark::ProfileOutlier {
                profile,
                at_y_mm: y_of(farthest),
                distance_um: 1e3 * distance,
                points: count,
                y_mm: points.map(y_of),
                waviness_mpa,
                share,
            },
            Some(LocalDefect::Step { point, height }) => Remark::ProfileStep {
                profile,
                at_y_mm: y_of(point),
                height_um: 1e3 * height,
                waviness_mpa,
                share,
            },
            None if found.noisy => Remark::ProfileNoise {
                profile,
                y_mm,
                noise_um: 1e3 * found.noise.unwrap_or(0.0),
                spacing_mm: found.spacing,
                rounding_mm: found.rounding,
                waviness_mpa,
                share,
                smoothing_mm: more,
            },
            None if found.roughness.ambiguity > found.roughness.waviness => self.spacing().0,
            None => Remark::ProfileWaves {
                profile,
                y_mm,
                shorter_than_mm: REFERENCE_MIN.max(2.0 * self.profile.smoothing()),
                waviness_mpa,
                share,
            },
        }
    }
}

/// The quality of both profiles under a patch, and their defects. `auto` states whose smoothing is chosen automatically.
pub fn judge(
    geometry: &WheelRail,
    patch: FoundPatch,
    modulus: f64,
    auto: [bool; 2],
) -> (PatchQuality, Vec<Defect>) {
    let profiles = geometry.profiles();
    let both = [Body::Rail, Body::Wheel].map(|body| {
        let profile = profiles[body as usize];
        let contact = bounds(patch.patch.ends.map(|end| end[body as usize]));
        Under {
            body,
            profile,
            contact,
            found: under_contact(&profile.read(), contact, modulus),
        }
    });
    // Without the lower bound, a lightly loaded patch would need far more smoothing than the one that carries the load.
    let pressure = patch.pressure.max(PRESSURE_LIGHT);
    let levels = both.each_ref().map(|own| NoiseLevel {
        noise: own.found.noise.unwrap_or(0.0),
        spacing: own.found.spacing,
        polygon: own.found.polygon,
    });
    let advised = advised_smoothing(levels, modulus, pressure);
    let share = both[0].rough().hypot(both[1].rough()) / pressure;
    let mut defects = Vec::new();
    for (k, own) in both.iter().enumerate() {
        // Of two bodies with little roughness the rougher one is named.
        if own.rough() >= both[1 - k].rough() || own.rough() > ROUGH * pressure {
            let more = advised[k] > own.profile.smoothing() && !auto[k];
            let more = more.then(|| (10.0 * advised[k]).round() / 10.0);
            defects.push(roughness(own, share, pressure, more, patch));
        }
        defects.extend(spacing(own, patch));
        let edge = at_edge(own.profile, own.body, own.contact);
        defects.extend(edge.map(|remark| Defect::certain(own.body, patch.number, 0.0, remark)));
    }
    let quality = |own: &Under, advised: f64| ProfileQuality {
        y_mm: bounds(own.contact.map(|s| own.y(s))),
        spacing_mm: own.found.chord[1] - own.found.chord[0],
        spacing_over_width: own.found.over_width,
        noise_um: own.found.noise.map(|noise| 1e3 * noise),
        waviness_mpa: own.found.roughness.waviness,
        ambiguity_mpa: own.found.roughness.ambiguity,
        hole_mm: None,
        smoothing_mm: own.profile.smoothing(),
        smoothing_suggested_mm: advised,
    };
    let quality = PatchQuality {
        rail: quality(&both[0], advised[0]),
        wheel: quality(&both[1], advised[1]),
    };
    (quality, defects)
}

/// The roughness of a profile, however small, with its cause.
fn roughness(
    own: &Under,
    share: f64,
    pressure: f64,
    more: Option<f64>,
    patch: FoundPatch,
) -> Defect {
    let remark = own.cause(share, more);
    // A light patch may lie entirely where two arcs meet. Its pressure does not show the quality of the profiles.
    let loaded = patch.load_share > SHARE_MIN;
    // The shape of a sound profile, such as two arcs that meet, has some waviness and some ambiguity.
    let is_beyond_shape = match remark {
        _ if own.profile.smoothing() > 0.0 => true,
        Remark::ProfileWaves { .. } => share > WAVES_BEYOND_SHAPE && loaded,
        Remark::ProfileSpacing { .. } => share > ROUGH,
        _ => true,
    };
    Defect {
        share,
        certain: is_beyond_shape && share > ROUGH,
        suspicious: is_beyond_shape && share > HARMLESS,
        refused: loaded && own.found.roughness.ambiguity > AMBIGUOUS_MAX * pressure,
        ..Defect::certain(own.body, patch.number, own.spacing().1, remark)
    }
}

/// Points too far apart for the width of the patch.
fn spacing(own: &Under, patch: FoundPatch) -> Option<Defect> {
    let found = &own.found;
    let (remark, length) = own.spacing();
    let is_open = found.roughness.ambiguity > ROUGH * patch.pressure;
    // Chords up to the least length are too long only for the patch of a lightly loaded flange, which touches over some tenths of a mm.
    let is_wide = length > LENGTH_MIN && found.over_width > 1.0;
    // A long chord may hide an arc that neither of the two curves through the points shows.
    (is_wide && (is_open || length > LONG)).then(|| Defect {
        share: own.rough() / patch.pressure,
        refused: patch.load_share > SHARE_MIN && found.over_width > WIDE,
        ..Defect::certain(own.body, patch.number, length, remark)
    })
}
