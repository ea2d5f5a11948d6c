//! What is wrong with a profile, in words a measuring engineer can act on.

use crate::contact::geometry::profile::Body;
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::remark::list::Remark;

/// Ambiguity of both bodies together that is remarked on where points are coarse, relative to the largest pressure.
///
/// Population: as for `CHORD_HIDES_ARC` of `judge.rs`. At 0.08 47 of 487 right and 166 of 174 wrong answers are told, at 0.09 38 and 165, at 0.10
/// 34 and 163.
pub const AMBIGUOUS: f64 = 0.09;
/// Waviness without noise, outlier or step may be that of two arcs that meet; new 60E1 reaches 0.12 at its gauge corner.
const WAVES_BEYOND_SHAPE: f64 = 0.3;
/// They are waves where they are found beside the contact as well.
const WAVES_EVERYWHERE: f64 = 0.03;
/// A patch that carries less of the load than this is no larger than the place where two arcs meet.
const LIGHT: f64 = 0.02;
/// Roughness that is told although other readings of the points change little, relative to the largest pressure.
const ROUGH_IN_ANY_CASE: f64 = 0.15;
/// Noise that a smoothing may leave on each body, relative to the largest pressure; the advised one leaves 0.07 of both.
const NOISE_LEFT_MAX: f64 = 0.08;

/// One thing that is wrong with a profile under a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// Which profile.
    pub body: Body,
    /// Number of the patch in the answer.
    pub patch: usize,
    /// Where on the profile, from and to y in mm.
    pub y: [f64; 2],
    /// Roughness of this body as a pressure in MPa.
    pub pressure: f64,
    /// That of both bodies relative to the largest pressure of the patch.
    pub share: f64,
    /// Part of the load that the patch carries.
    pub load_share: f64,
    /// Noise that its smoothing leaves, as a pressure over the largest one; 0 without a smoothing.
    pub left: f64,
    /// Waviness of this body as a median over the contact and beside it, relative to the largest pressure.
    pub everywhere: f64,
    /// The widest chord, from and to y in mm, and its length.
    pub chord: [f64; 2],
    /// Length of that chord in mm.
    pub chord_length: f64,
    /// That over the width of the patch.
    pub over_width: f64,
    /// Smoothing in use, in mm.
    pub smoothing: f64,
    /// Smoothing that is advised, in mm; 0 for none.
    pub advised: f64,
    /// An answer would mislead: the job fails unless rough profiles are accepted.
    pub refused: bool,
    /// What it is.
    pub cause: Cause,
}

/// What is wrong with a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// One point is off, by a distance in mm.
    Outlier {
        /// Where, in mm.
        y: f64,
        /// How far, in mm.
        distance: f64,
    },
    /// The profile jumps between two points.
    Step {
        /// Where, in mm.
        y: f64,
        /// By how much, in mm.
        height: f64,
    },
    /// The points lie on the chords of fewer points.
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
    /// Waves that are neither of these.
    Waves,
    /// The points leave the curve between them open.
    Coarse,
    /// The points are far apart for the width of the patch.
    Spacing,
    /// A stretch without points near the patch, where the bodies may touch as well.
    Hole,
    /// The contact is on the tip of the flange.
    FlangeTip,
    /// The contact is near the end of the profile.
    End {
        /// What is left of it, in mm.
        left: f64,
    },
}

impl Finding {
    /// Is this about the roughness of a profile, which matters from some measure on?
    pub fn of_roughness(&self) -> bool {
        matches!(
            self.cause,
            Cause::Outlier { .. }
                | Cause::Step { .. }
                | Cause::Polygon { .. }
                | Cause::Noise { .. }
                | Cause::Waves
                | Cause::Coarse
        )
    }

    /// Is it more than the shape of a sound profile, such as two arcs that meet, may show?
    pub fn has_evidence(&self) -> bool {
        match self.cause {
            Cause::Outlier { .. }
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

    /// Is another one the same remark elsewhere?
    pub fn is_like(&self, other: &Finding) -> bool {
        let kind = std::mem::discriminant::<Cause>;
        self.body == other.body && kind(&self.cause) == kind(&other.cause)
    }

    /// Is it told, where another reading of the points changes the patch by much or not?
    pub fn is_told(&self, changes: bool) -> bool {
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

    /// Does this one do more harm than another of its kind?
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
            ..self.told().at_pointer(self.pointer())
        }
    }

    fn told(&self) -> Remark {
        let profile = self.body.name();
        let (y_mm, waviness_mpa, share) = (self.y, self.pressure, self.share);
        let smoothing_mm = (self.advised > 0.0).then(|| (10.0 * self.advised).round() / 10.0);
        match self.cause {
            Cause::Outlier { y, distance } => Remark::ProfileOutlier {
                profile,
                at_y_mm: y,
                distance_um: 1e3 * distance,
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
