//! Assesses the points of both profiles under the patches found, and describes their defects so that they can be corrected.

use crate::geometry::holes::{LENGTH_MIN, WIDE};
use crate::geometry::profile::{Body, NEEDED_BEYOND, Profile};
use crate::geometry::profile_quality::{
    LocalDefect, NoiseLevel, REFERENCE_MIN, UnderContact, advised_smoothing, noise_pressure,
    under_contact,
};
use crate::geometry::wheel_rail::WheelRail;
use crate::normal::wheel::WheelPatch;
use crate::numerics::roots::bounds;
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;
use crate::solution::words::damage::{PatchQuality, ProfileQuality};

/// Least roughness of one body, relative to that of both, that is reported.
const ROUGHNESS_SHARE: f64 = 0.6;
/// Length in mm up to which a chord is assessed by its ambiguity alone, however narrow the patch. The arcs of heads and treads are 10 to
/// 50 mm long, so that a longer chord may hide an arc that neither of the two curves through the points shows.
///
/// Population: holes and coarse points at 384 positions on the pairs of the thresholds, seeds 1001 to 1004 and 2001 to 2012 of the class
/// *damaged profile*. With this bound 38 of 487 correct and 165 of 174 wrong answers get the remark, with 0 mm 43 and 166.
const CHORD_HIDES_ARC: f64 = 10.0;
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

/// The profile of one body under a patch.
struct Under<'a> {
    body: Body,
    profile: &'a Profile,
    /// The contact as a range of the length along the profile, in mm.
    contact: [f64; 2],
    found: UnderContact,
}

impl<'a> Under<'a> {
    fn new(body: Body, profile: &'a Profile, contact: [f64; 2], modulus: f64) -> Under<'a> {
        Under {
            body,
            profile,
            contact,
            found: under_contact(&profile.read(), contact, modulus),
        }
    }

    /// y in mm at a length along the profile.
    fn y(&self, s: f64) -> f64 {
        self.profile.at(s).at[0]
    }

    fn y_of_point(&self, point: usize) -> f64 {
        self.profile.points().at[point][0]
    }

    fn rough(&self) -> f64 {
        let found = self.found.roughness;
        found.waviness.hypot(found.ambiguity)
    }

    /// The cause of the roughness. Noise counts only if it needs a smoothing, as `harmful` says.
    fn cause(&self, harmful: bool) -> Cause {
        let found = &self.found;
        if let Some(chord) = found.polygon {
            return Cause::Polygon { chord };
        }
        match found.local_defect {
            Some(LocalDefect::Outliers {
                points,
                count,
                farthest,
                distance,
            }) => Cause::Outliers {
                y: self.y_of_point(farthest),
                distance,
                between: points.map(|point| self.y_of_point(point)),
                count,
            },
            Some(LocalDefect::Step { point, height }) => Cause::Step {
                y: self.y_of_point(point),
                height,
            },
            None if harmful && found.noisy => Cause::Noise {
                noise: found.noise.unwrap_or(0.0),
                spacing: found.spacing,
                rounding: found.rounding,
            },
            None if found.roughness.ambiguity > found.roughness.waviness => Cause::Coarse,
            None => Cause::Waves,
        }
    }

    /// The noise that remains after smoothing, as a pressure in MPa.
    fn noise_left(&self, modulus: f64) -> f64 {
        let smoothing = self.profile.smoothing();
        match self.found.noise {
            Some(noise) if smoothing > 0.0 => {
                noise_pressure(modulus, noise, self.found.spacing, smoothing)
            }
            _ => 0.0,
        }
    }

    /// A defect under a patch because of which no job fails.
    fn defect(&self, patch: FoundPatch, cause: Cause) -> Defect {
        let found = &self.found;
        Defect {
            y: self.contact.map(|s| self.y(s)),
            pressure: self.rough(),
            load_share: patch.load_share,
            chord: found.chord.map(|s| self.y(s)),
            chord_length: found.chord[1] - found.chord[0],
            over_width: found.over_width,
            smoothing: self.profile.smoothing(),
            ..Defect::new(self.body, patch.number, cause)
        }
    }

    fn noise_level(&self) -> NoiseLevel {
        NoiseLevel {
            noise: self.found.noise.unwrap_or(0.0),
            spacing: self.found.spacing,
            polygon: self.found.polygon,
        }
    }
}

/// The quality of both profiles under a patch, and their defects. Roughness is always among the defects, however small. `auto` states whose
/// smoothing is chosen automatically.
pub fn judge(
    geometry: &WheelRail,
    patch: FoundPatch,
    modulus: f64,
    auto: [bool; 2],
) -> (PatchQuality, Vec<Defect>) {
    let contacts = [0, 1].map(|body| bounds(patch.patch.ends.map(|end| end[body])));
    let [rail, wheel] = geometry.profiles();
    let both = [
        Under::new(Body::Rail, rail, contacts[0], modulus),
        Under::new(Body::Wheel, wheel, contacts[1], modulus),
    ];
    // Without the lower bound, a lightly loaded patch would need far more smoothing than the one that carries the load.
    let pressure = patch.pressure.max(PRESSURE_LIGHT);
    let levels = both.each_ref().map(Under::noise_level);
    let advised = advised_smoothing(levels, modulus, pressure);
    let mut defects = Vec::new();
    let rough = both[0].rough().hypot(both[1].rough());
    for (k, own) in both.iter().enumerate() {
        if own.rough() >= ROUGHNESS_SHARE * rough {
            defects.push(roughness(own, rough, advised[k], auto[k], patch, modulus));
        }
        defects.extend(spacing(own, patch));
        defects.extend(place(own, patch));
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

/// The roughness of a profile with its cause.
fn roughness(
    own: &Under,
    both: f64,
    advised: f64,
    auto: bool,
    patch: FoundPatch,
    modulus: f64,
) -> Defect {
    let found = &own.found;
    let pressure = patch.pressure.max(PRESSURE_LIGHT);
    let more = !auto && advised > own.profile.smoothing();
    Defect {
        share: both / pressure,
        left: own.noise_left(modulus) / patch.pressure,
        everywhere: found.roughness.everywhere / patch.pressure,
        advised: if more { advised } else { 0.0 },
        refused: patch.load_share > LIGHT && found.roughness.ambiguity > AMBIGUOUS_MAX * pressure,
        ..own.defect(patch, own.cause(advised > 0.0))
    }
}

/// Points too far apart for the width of the patch.
fn spacing(own: &Under, patch: FoundPatch) -> Option<Defect> {
    let found = &own.found;
    let length = found.chord[1] - found.chord[0];
    let hides_arc = length > CHORD_HIDES_ARC;
    let least = if hides_arc {
        AMBIGUOUS_LEAST
    } else {
        AMBIGUOUS
    };
    let open = found.roughness.ambiguity > least * patch.pressure;
    // Chords up to this length are too long only for the patch of a lightly loaded flange, which touches over some tenths of a mm.
    let wide = length > LENGTH_MIN
        && (found.over_width > 1.0 && open || found.over_width > WIDE && hides_arc);
    wide.then(|| Defect {
        share: own.rough() / patch.pressure,
        refused: patch.load_share > LIGHT && found.over_width > WIDE,
        ..own.defect(patch, Cause::Spacing)
    })
}

/// A contact at the end of a profile, or on the tip of the flange.
fn place(own: &Under, patch: FoundPatch) -> Option<Defect> {
    let [first, last] = own.profile.range();
    let [low, high] = own.contact;
    let middle = own.y(0.5 * (low + high));
    let tip = match own.body {
        Body::Rail => None,
        Body::Wheel => own.profile.flange().and_then(|flange| flange.tip),
    };
    let on_tip = tip.is_some_and(|[from, to]| (from..=to).contains(&middle));
    let cause = if on_tip {
        Cause::FlangeTip
    } else if low - first < NEEDED_BEYOND || last - high < NEEDED_BEYOND {
        Cause::End {
            left: (low - first).min(last - high),
        }
    } else {
        return None;
    };
    // The length of a chord is no measure of this defect.
    Some(Defect {
        chord_length: 0.0,
        ..own.defect(patch, cause)
    })
}

/// Ambiguity, relative to the pressure, up to which the spacing does not matter, as on a straight stretch.
const AMBIGUOUS_LEAST: f64 = 0.02;
/// Ambiguity of both bodies together, relative to the largest pressure, from which coarse points get a remark.
///
/// Population: that of [`CHORD_HIDES_ARC`]. At 0.08, 47 of 487 correct and 166 of 174 wrong answers get the remark, at 0.09 38 and 165, at
/// 0.10 34 and 163.
const AMBIGUOUS: f64 = 0.09;
/// Ambiguity, relative to the largest pressure, from which a job fails.
const AMBIGUOUS_MAX: f64 = 0.5;
/// Waviness, relative to the largest pressure, from which it is a defect even without noise, outlier or step. Two arcs that meet have
/// some too: an unworn 60E1 reaches 0.12 at its gauge corner.
const WAVES_BEYOND_SHAPE: f64 = 0.3;
/// Share of the largest pressure up to which waves and noise are harmless. A larger median waviness indicates waves beyond the contact.
pub(crate) const HARMLESS: f64 = 0.03;
/// Share of the load up to which a patch may lie entirely where two arcs meet. Its pressure does not show the quality of the profiles, and the
/// forces do not depend on it.
pub const LIGHT: f64 = 0.02;
/// Roughness, relative to the largest pressure, that gets a remark even if other readings of the points hardly change the answer.
const ROUGH_IN_ANY_CASE: f64 = 0.15;
/// Noise, relative to the largest pressure, that may remain on each body after smoothing. The advised smoothing leaves 0.07 on both together.
const NOISE_LEFT_MAX: f64 = 0.08;

/// A defect of a profile under a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Defect {
    /// The body whose profile it is.
    pub body: Body,
    /// Index of the patch in the answer.
    pub patch: usize,
    /// Range of y on the profile, in mm.
    pub y: [f64; 2],
    /// Roughness of this body as a pressure in MPa.
    pub pressure: f64,
    /// Roughness of both bodies relative to the largest pressure of the patch.
    pub share: f64,
    /// Share of the load that the patch carries.
    pub load_share: f64,
    /// Noise that remains after smoothing, as a pressure relative to the largest one; 0 without smoothing.
    pub left: f64,
    /// Median waviness of this body in the contact and next to it, relative to the largest pressure.
    pub everywhere: f64,
    /// The longest chord, as a range of y in mm.
    pub chord: [f64; 2],
    /// Length of that chord in mm.
    pub chord_length: f64,
    /// Length of that chord relative to the width of the patch.
    pub over_width: f64,
    /// Smoothing in use, in mm.
    pub smoothing: f64,
    /// Smoothing advised, in mm; 0 if it is not more than the one in use, or if the smoothing is chosen automatically.
    pub advised: f64,
    /// Whether the answer would be unreliable, so that the job fails unless rough profiles are accepted.
    pub refused: bool,
    /// The kind of defect.
    pub cause: Cause,
}

/// A kind of defect of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// One point or a few neighbours are displaced.
    Outliers {
        /// y of the point displaced most, in mm.
        y: f64,
        /// Displacement of that point in mm.
        distance: f64,
        /// y of the first and of the last displaced point, in mm.
        between: [f64; 2],
        /// Number of displaced points.
        count: usize,
    },
    /// The profile jumps between two points.
    Step {
        /// y of the jump in mm.
        y: f64,
        /// Height of the jump in mm.
        height: f64,
    },
    /// The points were interpolated linearly between fewer points.
    Polygon {
        /// Length of the sides in mm.
        chord: f64,
    },
    /// Noise of the measurement or of rounding.
    Noise {
        /// Standard deviation in mm.
        noise: f64,
        /// Mean spacing of the points in mm.
        spacing: f64,
        /// Step of rounding in mm.
        rounding: Option<f64>,
    },
    /// Waves that are none of these.
    Waves,
    /// The points are too coarse to determine the curve between them.
    Coarse,
    /// The points are far apart for the width of the patch.
    Spacing,
    /// A stretch without points near the patch, where the bodies may touch too.
    Hole,
    /// The contact is on the tip of the flange.
    FlangeTip,
    /// The contact is near the end of the profile.
    End {
        /// Length of the profile beyond the contact, in mm.
        left: f64,
    },
}

impl Defect {
    /// A defect without any measures.
    pub(crate) fn new(body: Body, patch: usize, cause: Cause) -> Defect {
        Defect {
            body,
            patch,
            y: [0.0; 2],
            pressure: 0.0,
            share: 0.0,
            load_share: 0.0,
            left: 0.0,
            everywhere: 0.0,
            chord: [0.0; 2],
            chord_length: 0.0,
            over_width: 0.0,
            smoothing: 0.0,
            advised: 0.0,
            refused: false,
            cause,
        }
    }

    /// Returns whether this is a kind of roughness, which matters only above a threshold.
    pub fn is_roughness(&self) -> bool {
        matches!(
            self.cause,
            Cause::Outliers { .. }
                | Cause::Step { .. }
                | Cause::Polygon { .. }
                | Cause::Noise { .. }
                | Cause::Waves
                | Cause::Coarse
        )
    }

    /// Returns whether it exceeds the effect of the shape of a sound profile, such as two arcs that meet.
    pub fn has_evidence(&self) -> bool {
        match self.cause {
            Cause::Waves => {
                self.smoothing > 0.0
                    || self.everywhere > HARMLESS
                    || self.share > WAVES_BEYOND_SHAPE && self.load_share > LIGHT
            }
            Cause::Coarse => self.smoothing > 0.0 || self.share > AMBIGUOUS,
            _ => true,
        }
    }

    /// Returns whether `other` gives the same remark about another place.
    pub fn is_like(&self, other: &Defect) -> bool {
        let kind = std::mem::discriminant::<Cause>;
        self.body == other.body && kind(&self.cause) == kind(&other.cause)
    }

    /// Returns whether it becomes a remark. `changes` states whether another reading of the points changes the patch much.
    pub fn is_reported(&self, changes: bool) -> bool {
        match self.cause {
            Cause::Coarse => self.has_evidence(),
            Cause::Noise { .. } | Cause::Waves | Cause::Polygon { .. } if self.smoothing > 0.0 => {
                self.share > ROUGH_IN_ANY_CASE || self.left > NOISE_LEFT_MAX
            }
            _ if self.is_roughness() && !self.refused => {
                self.has_evidence() && (changes || self.share > ROUGH_IN_ANY_CASE)
            }
            _ => true,
        }
    }

    /// Returns whether it is worse than another defect of its kind.
    pub fn worse_than(&self, other: &Defect) -> bool {
        [self.share, self.chord_length] > [other.share, other.chord_length]
    }

    /// JSON pointer to the profile.
    pub fn pointer(&self) -> &'static str {
        match self.body {
            Body::Rail => "/contact/rail",
            Body::Wheel => "/contact/wheel",
        }
    }

    /// The remark for the answer.
    pub fn remark(&self) -> RemarkEntry {
        RemarkEntry {
            patch: Some(self.patch),
            ..self.report().at_pointer(self.pointer())
        }
    }

    fn report(&self) -> Remark {
        let profile = self.body.name();
        let (y_mm, waviness_mpa, share) = (self.y, self.pressure, self.share);
        let smoothing_mm = (self.advised > 0.0).then(|| (10.0 * self.advised).round() / 10.0);
        match self.cause {
            Cause::Outliers {
                y,
                distance,
                between,
                count,
            } => Remark::ProfileOutlier {
                profile,
                at_y_mm: y,
                distance_um: 1e3 * distance,
                points: count,
                y_mm: between,
                waviness_mpa,
                share,
            },
            Cause::Step { y, height } => Remark::ProfileStep {
                profile,
                at_y_mm: y,
                height_um: 1e3 * height,
                waviness_mpa,
                share,
            },
            Cause::Polygon { chord } => Remark::ProfilePolygon {
                profile,
                y_mm,
                chord_mm: chord,
                waviness_mpa,
                share,
                smoothing_mm,
            },
            Cause::Noise {
                noise,
                spacing,
                rounding,
            } => Remark::ProfileNoise {
                profile,
                y_mm,
                noise_um: 1e3 * noise,
                spacing_mm: spacing,
                rounding_mm: rounding,
                waviness_mpa,
                share,
                smoothing_mm,
            },
            Cause::Waves => Remark::ProfileWaves {
                profile,
                y_mm,
                shorter_than_mm: REFERENCE_MIN.max(2.0 * self.smoothing),
                waviness_mpa,
                share,
            },
            Cause::Coarse | Cause::Spacing => Remark::ProfileSpacing {
                profile,
                y_mm: self.chord,
                spacing_mm: self.chord_length,
                spacing_over_width: self.over_width,
                ambiguity_mpa: self.pressure,
            },
            Cause::Hole => Remark::ProfileHole {
                profile,
                y_mm: self.chord,
                hole_mm: self.chord_length,
            },
            Cause::FlangeTip => Remark::ContactOnFlangeTip { profile, y_mm },
            Cause::End { left } => Remark::ContactAtProfileEnd {
                profile,
                y_mm,
                left_mm: left.max(0.0),
            },
        }
    }
}
