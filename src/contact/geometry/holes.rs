//! Stretches without points in which the bodies may touch.

use crate::contact::geometry::contact_locus::ContactLocus;
use crate::contact::geometry::profile::Body;

/// Length in mm below which a chord is not a hole.
const LENGTH_MIN: f64 = 1.0;
/// Length relative to the width of the contact below which a chord is not a hole.
const WIDTH_MIN: f64 = 1.0;
/// Length relative to the width of the contact above which a chord may hold the whole contact.
const WIDE: f64 = 1.5;
/// Radius R in mm that a surface is assumed to have between two points, so that a chord c may hide a height of `c²/(8 R)`. Gauge corners
/// and flange roots have radii of 10 to 20 mm.
const RADIUS_HIDDEN: f64 = 20.0;

/// A chord without points over which the bodies may touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hole {
    /// Whose profile.
    pub body: Body,
    /// Its ends along the profile in mm.
    pub chord: [f64; 2],
    /// Whether it is wide enough to hold the whole contact.
    pub wide: bool,
}

impl Hole {
    /// Length in mm below which chords can be ignored beside a contact of the given width in mm.
    #[must_use]
    pub fn least(width: f64) -> f64 {
        LENGTH_MIN.max(WIDTH_MIN * width)
    }
}

/// The chords that may hide a height larger than the clearance of the bodies over them, with the wheel lowered by `lowering` mm below first
/// touch; `width` in mm is that of the widest patch.
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
