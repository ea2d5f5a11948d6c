//! Defects of a profile, described so that whoever measured it can correct them.

use crate::contact::geometry::profile::Body;
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::remark::list::Remark;

/// Ambiguity of both bodies together, relative to the largest pressure, from which coarse points get a remark.
///
/// Population: as for `CHORD_HIDES_ARC` of `judge.rs`. At 0.08, 47 of 487 correct and 166 of 174 wrong answers get the remark, at 0.09 38 and
/// 165, at 0.10 34 and 163.
pub const AMBIGUOUS: f64 = 0.09;
/// Waviness, relative to the largest pressure, above which it is a defect even without noise, outlier or step. Two arcs that meet have
/// some too: an unworn 60E1 reaches 0.12 at its gauge corner.
const WAVES_BEYOND_SHAPE: f64 = 0.3;
/// Median waviness, relative to the largest pressure, above which it extends beyond the contact and indicates waves.
const WAVES_EVERYWHERE: f64 = 0.03;
/// Share of the load below which a patch may lie entirely where two arcs meet: its pressure then says nothing of the profiles, and the forces do not depend
/// on it.
pub const LIGHT: f64 = 0.02;
/// Roughness, relative to the largest pressure, that gets a remark even if other readings of the points change the answer little.
const ROUGH_IN_ANY_CASE: f64 = 0.15;
/// Noise, relative to the largest pressure, that may remain on each body after smoothing; the advised smoothing leaves 0.07 on both
/// together.
const NOISE_LEFT_MAX: f64 = 0.08;

/// One thing that is wrong with a profile under a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// Which profile.
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
    /// Median waviness of this body in and beside the contact, relative to the largest pressure.
    pub everywhere: f64,
    /// The longest chord, as a range of y in mm.
    pub chord: [f64; 2],
    /// Length of that chord in mm.
    pub chord_length: f64,
    /// That length relative to the width of the patch.
    pub over_width: f64,
    /// Smoothing in use, in mm.
    pub smoothing: f64,
    /// Smoothing advised, in mm; 0 if no more is advised than is in use, or if the smoothing is chosen automatically.
    pub advised: f64,
    /// Whether the answer would mislead, so that the job fails unless rough profiles are accepted.
    pub refused: bool,
    /// The kind of defect.
    pub cause: Cause,
}

/// A kind of defect of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// One point or a few neighbours are displaced.
    Outliers {
        /// y of the point farthest off, in mm.
        y: f64,
        /// Displacement of that point in mm.
        distance: f64,
        /// y of the first and of the last of them, in mm.
        between: [f64; 2],
        /// How many there are.
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
        /// Length of the chords in mm.
        chord: f64,
    },
    /// Noise of the measurement or of rounding.
    Noise {
        /// Standard deviation in mm.
        noise: f64,
        /// Mean distance of the points in mm.
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
    /// A stretch without points near the patch, where the bodies may touch as well.
    Hole,
    /// The contact is on the tip of the flange.
    FlangeTip,
    /// The contact is near the end of the profile.
    End {
        /// Length of the profile beyond the contact, in mm.
        left: f64,
    },
}

impl Finding {
    /// Whether this is a kind of roughness, which matters only above a threshold.
    pub fn of_roughness(&self) -> bool {
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

    /// Whether it exceeds what the shape of a sound profile, such as two arcs that meet, can cause.
    pub fn has_evidence(&self) -> bool {
        match self.cause {
            Cause::Outliers { .. }
            | Cause::Step { .. }
            | Cause::Polygon { .. }
            | Cause::Noise { .. } => true,
            Cause::Waves => {
                self.smoothing > 0.0
                    || self.everywhere > WAVES_EVERYWHERE
                    || self.share > WAVES_BEYOND_SHAPE && self.load_share > LIGHT
            }
            Cause::Coarse => self.smoothing > 0.0 || self.share > AMBIGUOUS,
            Cause::Spacing | Cause::Hole | Cause::FlangeTip | Cause::End { .. } => true,
        }
    }

    /// Whether `other` would give the same remark about another place.
    pub fn is_like(&self, other: &Finding) -> bool {
        let kind = std::mem::discriminant::<Cause>;
        self.body == other.body && kind(&self.cause) == kind(&other.cause)
    }

    /// Whether it becomes a remark; `changes` is whether another reading of the points changes the patch much.
    pub fn is_reported(&self, changes: bool) -> bool {
        match self.cause {
            Cause::Coarse => self.has_evidence(),
            Cause::Noise { .. } | Cause::Waves | Cause::Polygon { .. } if self.smoothing > 0.0 => {
                self.share > ROUGH_IN_ANY_CASE || self.left > NOISE_LEFT_MAX
            }
            _ if self.of_roughness() && !self.refused => {
                self.has_evidence() && (changes || self.share > ROUGH_IN_ANY_CASE)
            }
            _ => true,
        }
    }

    /// Whether it is worse than another finding of its kind.
    pub fn worse_than(&self, other: &Finding) -> bool {
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

    /// The remark on points that are far apart.
    fn spacing(&self) -> Remark {
        Remark::ProfileSpacing {
            profile: self.body.name(),
            y_mm: self.chord,
            spacing_mm: self.chord_length,
            spacing_over_width: self.over_width,
            ambiguity_mpa: self.pressure,
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
                shorter_than_mm: 3.0_f64.max(2.0 * self.smoothing),
                waviness_mpa,
                share,
            },
            Cause::Coarse | Cause::Spacing => self.spacing(),
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
