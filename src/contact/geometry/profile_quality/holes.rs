//! Stretches without points where the bodies may touch all the same.

use crate::contact::geometry::contact_locus::ContactLocus;
use crate::contact::geometry::profile::Body;

/// Chords shorter than this, in mm, are no holes.
const LENGTH_MIN: f64 = 1.0;
/// Nor are chords shorter than this multiple of the width of the contact.
const WIDTH_MIN: f64 = 1.0;
/// Chords longer than this part of the width of the contact leave open whether the contact is there at all.
const WIDE: f64 = 1.5;
/// Radius in mm that a surface may have between two points: a chord c then hides a height of `c²/(8 R)`. Gauge corners and flange roots have
/// radii of 10 to 20 mm.
const RADIUS_HIDDEN: f64 = 20.0;

/// A chord over which the bodies may touch where no point says so.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hole {
    /// Whose profile.
    pub body: Body,
    /// Its ends along the profile in mm.
    pub chord: [f64; 2],
    /// It is wide enough for the whole contact to be there.
    pub wide: bool,
}

impl Hole {
    /// Chords that are shorter hide nothing that matters beside a contact of a width, both in mm.
    #[must_use]
    pub fn least(width: f64) -> f64 {
        LENGTH_MIN.max(WIDTH_MIN * width)
    }
}

/// Chords over which the clearance of the bodies, with the wheel lowered by `lowering` mm below first touch, is less than the height that
/// they may hide; `width` is that of the widest patch.
#[must_use]
pub fn holes(search: &ContactLocus, lowering: f64, width: f64) -> Vec<Hole> {
    let mut found = Vec::new();
    let profiles = search.geometry.profiles();
    for (body, profile) in [Body::Rail, Body::Wheel].into_iter().zip(profiles) {
        for pair in profile.points().along.windows(2) {
            let length = pair[1] - pair[0];
            if length < Hole::least(width) {
                continue;
            }
            let over = search.lines.iter().filter(|line| {
                let place = match body {
                    Body::Rail => line.rail,
                    Body::Wheel => line.wheel,
                };
                (pair[0]..=pair[1]).contains(&place)
            });
            let clearance = |line: &_| -> f64 { search.clearance(line, lowering) };
            let least = over.map(clearance).fold(f64::INFINITY, f64::min);
            if least < length * length / (8.0 * RADIUS_HIDDEN) {
                found.push(Hole {
                    body,
                    chord: [pair[0], pair[1]],
                    wide: length > WIDE * width,
                });
            }
        }
    }
    found
}
