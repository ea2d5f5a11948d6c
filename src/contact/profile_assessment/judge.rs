//! Examines the points of both profiles under the patches found, and reports their defects.

use crate::contact::geometry::profile::{Body, Profile};
use crate::contact::geometry::profile_quality::{
    Grain, Oddity, UnderContact, advised_smoothing, noise_pressure, under_contact,
};
use crate::contact::geometry::wheel_rail::WheelRail;
use crate::contact::normal::wheel::WheelPatch;
use crate::contact::profile_assessment::finding::{AMBIGUOUS, Cause, Finding, LIGHT};
use crate::contact::solution::words::damage::{PatchQuality, ProfileQuality};

/// Share of the roughness of both bodies from which that of one body is reported.
const BLAMED: f64 = 0.6;
/// Longest chord relative to the width of the patch from which there is a remark, and from which a job fails (as with
/// [`AMBIGUOUS_MAX`]).
const COARSE: f64 = 1.0;
const COARSE_MAX: f64 = 1.5;
/// Chords up to this length in mm count as fine enough for any patch: only a lightly loaded flange, which touches over some tenths of
/// a mm, has smaller patches.
const CHORD_MIN: f64 = 1.0;
/// Ambiguity, relative to the pressure, below which the distance of points does not matter, as on a straight stretch.
const AMBIGUOUS_LEAST: f64 = 0.02;
/// Length in mm up to which a chord is judged by its ambiguity alone, however narrow the patch. The arcs of heads and treads are 10 to
/// 50 mm long, so that a longer chord may hide an arc that neither of the two curves through the points shows.
/// Population: holes and coarse points at 384 places on the pairs of the thresholds, seeds 1001 to 1004 and 2001 to 2012 of the class *damaged
/// profile*: with this bound 38 of 487 correct and 165 of 174 wrong answers get the remark, with 0 mm 43 and 166.
const CHORD_HIDES_ARC: f64 = 10.0;
/// Ambiguity relative to the largest pressure that makes a job fail.
const AMBIGUOUS_MAX: f64 = 0.5;
/// Pressure in MPa below which errors do no harm and no job fails because of them.
const PRESSURE_LIGHT: f64 = 200.0;
/// Length in mm of profile needed beyond a contact; with less there is a remark.
const BEYOND: f64 = 5.0;

/// What the assessment needs to know of a patch.
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

    fn cause(&self, harmful: bool) -> Cause {
        let found = &self.found;
        if let Some(chord) = found.polygon {
            return Cause::Polygon { chord };
        }
        match found.oddity {
            Some(Oddity::Outliers {
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
            Some(Oddity::Step { point, height }) => Cause::Step {
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

    fn grain(&self) -> Grain {
        Grain {
            noise: self.found.noise.unwrap_or(0.0),
            spacing: self.found.spacing,
            polygon: self.found.polygon,
        }
    }
}

fn sorted([a, b]: [f64; 2]) -> [f64; 2] {
    [a.min(b), a.max(b)]
}

/// The quality of both profiles under a patch, and the findings. Roughness is always among them, however small. `auto` says whose smoothing
/// is chosen automatically.
#[must_use]
pub fn judge(
    geometry: &WheelRail,
    patch: FoundPatch,
    modulus: f64,
    auto: [bool; 2],
) -> (PatchQuality, Vec<Finding>) {
    let contacts = [0, 1].map(|body| sorted(patch.patch.ends.map(|end| end[body])));
    let [rail, wheel] = geometry.profiles();
    let both = [
        Under::new(Body::Rail, rail, contacts[0], modulus),
        Under::new(Body::Wheel, wheel, contacts[1], modulus),
    ];
    // Without the lower bound, a lightly loaded patch would need far more smoothing than the one that carries the load.
    let pressure = patch.pressure.max(PRESSURE_LIGHT);
    let advised = advised_smoothing([both[0].grain(), both[1].grain()], modulus, pressure);
    let mut findings = Vec::new();
    let rough = both[0].rough().hypot(both[1].rough());
    for (k, own) in both.iter().enumerate() {
        if own.rough() >= BLAMED * rough {
            findings.push(roughness(own, rough, advised[k], auto[k], patch, modulus));
        }
        findings.extend(spacing(own, patch));
        findings.extend(place(own, patch));
    }
    let quality = |own: &Under, advised: f64| ProfileQuality {
        y_mm: sorted(own.contact.map(|s| own.y(s))),
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
    (quality, findings)
}

/// The roughness of a profile with its cause.
fn roughness(
    own: &Under,
    both: f64,
    advised: f64,
    auto: bool,
    patch: FoundPatch,
    modulus: f64,
) -> Finding {
    let smoothing = own.profile.smoothing();
    let found = &own.found;
    let more = if auto || advised <= smoothing {
        0.0
    } else {
        advised
    };
    Finding {
        body: own.body,
        patch: patch.number,
        y: [own.y(own.contact[0]), own.y(own.contact[1])],
        pressure: own.rough(),
        share: both / patch.pressure.max(PRESSURE_LIGHT),
        left: own.noise_left(modulus) / patch.pressure,
        load_share: patch.load_share,
        everywhere: found.roughness.everywhere / patch.pressure,
        chord: found.chord.map(|s| own.y(s)),
        chord_length: found.chord[1] - found.chord[0],
        over_width: found.over_width,
        smoothing,
        advised: more,
        refused: patch.load_share > LIGHT
            && found.roughness.ambiguity > AMBIGUOUS_MAX * patch.pressure.max(PRESSURE_LIGHT),
        cause: own.cause(advised > 0.0),
    }
}

/// Points too far apart for the width of the patch.
fn spacing(own: &Under, patch: FoundPatch) -> Option<Finding> {
    let found = &own.found;
    let length = found.chord[1] - found.chord[0];
    let hides_arc = length > CHORD_HIDES_ARC;
    let least = if hides_arc {
        AMBIGUOUS_LEAST
    } else {
        AMBIGUOUS
    };
    let open = found.roughness.ambiguity > least * patch.pressure;
    let wide = found.over_width > COARSE && open || found.over_width > COARSE_MAX && hides_arc;
    let wide = wide && length > CHORD_MIN;
    wide.then(|| Finding {
        body: own.body,
        patch: patch.number,
        y: [own.y(own.contact[0]), own.y(own.contact[1])],
        pressure: own.rough(),
        share: own.rough() / patch.pressure,
        left: 0.0,
        load_share: patch.load_share,
        everywhere: 0.0,
        chord: found.chord.map(|s| own.y(s)),
        chord_length: found.chord[1] - found.chord[0],
        over_width: found.over_width,
        smoothing: own.profile.smoothing(),
        advised: 0.0,
        refused: patch.load_share > LIGHT && found.over_width > COARSE_MAX,
        cause: Cause::Spacing,
    })
}

/// A contact at the end of a profile, or on the tip of the flange.
fn place(own: &Under, patch: FoundPatch) -> Option<Finding> {
    let [first, last] = own.profile.range();
    let [low, high] = own.contact;
    let y = [own.y(low), own.y(high)];
    let middle = own.y(0.5 * (low + high));
    let tip = match own.body {
        Body::Rail => None,
        Body::Wheel => own.profile.flange().and_then(|flange| flange.tip),
    };
    let on_tip = tip.is_some_and(|[from, to]| (from..=to).contains(&middle));
    let cause = if on_tip {
        Cause::FlangeTip
    } else if low - first < BEYOND || last - high < BEYOND {
        Cause::End {
            left: (low - first).min(last - high),
        }
    } else {
        return None;
    };
    Some(Finding {
        body: own.body,
        patch: patch.number,
        y,
        pressure: 0.0,
        share: 0.0,
        left: 0.0,
        load_share: patch.load_share,
        everywhere: 0.0,
        chord: y,
        chord_length: 0.0,
        over_width: 0.0,
        smoothing: own.profile.smoothing(),
        advised: 0.0,
        refused: false,
        cause,
    })
}
