//! Stretches of a profile without points in which the bodies may touch.

use crate::geometry::contact_locus::ContactLocus;
use crate::geometry::profile::Body;
use crate::geometry::profile_quality::STEP;

/// Length in mm up to which a chord is short enough for any patch. The direction of the profile at the end of a hole is taken over this length
/// too.
pub(crate) const LENGTH_MIN: f64 = 1.0;
/// Length relative to the width of the contact above which a chord may contain the whole contact, so that a job fails.
pub(crate) const WIDE: f64 = 1.5;
/// A chord over which the bodies may touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hole {
    /// The body whose profile has no points there.
    pub body: Body,
    /// Its ends along the profile in mm.
    pub chord: [f64; 2],
    /// Whether it may contain the whole contact.
    pub wide: bool,
}

impl Hole {
    /// Length in mm below which chords can be ignored near a contact of the given width in mm.
    pub fn least(width: f64) -> f64 {
        LENGTH_MIN.max(width)
    }
}

/// Finds the chords that the other body approaches within the largest bulge that the tangents at their ends allow. The wheel is `lowering` mm
/// below first touch, and `width` in mm is that of the widest patch.
pub fn holes(search: &ContactLocus, lowering: f64, width: f64) -> Vec<Hole> {
    let geometry = search.geometry;
    let sign = geometry.placement.side.sign();
    let height = search.touch - lowering;
    let rail = |s: f64| Some(geometry.rail_at(s).at);
    let wheel = |s: f64| geometry.lowest(s).map(|[_, y, z]| [y, z + height]);
    let of: [&dyn Fn(f64) -> Option<[f64; 2]>; 2] = [&rail, &wheel];
    let places = geometry.parameters(STEP);
    let mut found = Vec::new();
    for (k, body) in [Body::Rail, Body::Wheel].into_iter().enumerate() {
        let mut other: Option<Vec<[f64; 2]>> = None;
        let along = geometry.profiles()[k].points().along;
        // A rail bulges upward and a wheel downward.
        let outward = [sign, -sign][k];
        for (from, pair) in along.windows(2).enumerate() {
            let length = pair[1] - pair[0];
            if length < Hole::least(width) {
                continue;
            }
            let before = along[..from].iter().rfind(|s| pair[0] - **s >= LENGTH_MIN);
            let after = along[from + 2..]
                .iter()
                .find(|s| **s - pair[1] >= LENGTH_MIN);
            let [before, after] = [before, after].map(|s| of[k](*s?));
            let (Some(start), Some(end)) = (of[k](pair[0]), of[k](pair[1])) else {
                continue;
            };
            let bulge = Bulge::new([start, end], [before, after], outward);
            let other = other.get_or_insert_with(|| {
                let places = places[1 - k].iter();
                places.filter_map(|s| of[1 - k](*s)).collect()
            });
            if other.iter().any(|at| bulge.holds(*at, lowering)) {
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

/// The region between a chord and the tangents at its ends. The surface between two points lies in it if its curvature has one sign.
struct Bulge {
    start: [f64; 2],
    /// Unit vectors along the chord and away from the body.
    axes: [[f64; 2]; 2],
    length: f64,
    /// Slopes of the tangents away from the body, each in the direction from its end into the chord.
    slopes: [f64; 2],
}

impl Bulge {
    /// The bulge of a chord with the points before and after it, if there are any. The chords to these points stand for the tangents; they
    /// are steeper than the surface itself.
    fn new(
        [start, end]: [[f64; 2]; 2],
        [before, after]: [Option<[f64; 2]>; 2],
        outward: f64,
    ) -> Bulge {
        let [y, z] = [end[0] - start[0], end[1] - start[1]];
        let length = y.hypot(z);
        let axis = [y / length, z / length];
        let axes = [axis, [-outward * axis[1], outward * axis[0]]];
        let slope = |from: [f64; 2], to: [f64; 2]| {
            let step = [to[0] - from[0], to[1] - from[1]];
            let [along, up] = axes.map(|axis| axis[0] * step[0] + axis[1] * step[1]);
            // A tangent that leads backward counts as vertical.
            up / along.max(f64::EPSILON)
        };
        Bulge {
            start,
            axes,
            length,
            slopes: [
                before.map_or(0.0, |before| slope(before, start)),
                after.map_or(0.0, |after| -slope(end, after)),
            ],
        }
    }

    /// Largest height in mm of the surface above the chord at `t` from 0 to 1. If only one tangent leads away from the body, it is the height
    /// of the cubic that leaves along this tangent and arrives along the chord.
    fn height(&self, t: f64) -> f64 {
        let [start, end] = self.slopes.map(|slope| slope * self.length);
        if start > 0.0 && end > 0.0 {
            (start * t).min(end * (1.0 - t))
        } else {
            start.max(0.0) * t * (1.0 - t).powi(2) + end.max(0.0) * t.powi(2) * (1.0 - t)
        }
    }

    /// Returns whether a point of the other body lies in the bulge, or overlaps the chord by no more than `overlap` mm.
    fn holds(&self, at: [f64; 2], overlap: f64) -> bool {
        let from = [at[0] - self.start[0], at[1] - self.start[1]];
        let [along, up] = self.axes.map(|axis| axis[0] * from[0] + axis[1] * from[1]);
        let t = along / self.length;
        (0.0..=1.0).contains(&t) && -overlap <= up && up < self.height(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point of a circle of 20 mm about the origin.
    fn arc(angle: f64) -> [f64; 2] {
        [20.0 * angle.sin(), 20.0 * angle.cos()]
    }

    #[test]
    fn an_arc_lies_in_its_bulge_and_twice_its_height_does_not() {
        let ends = [arc(-0.3), arc(0.3)];
        let bulge = Bulge::new(ends, [Some(arc(-0.4)), Some(arc(0.4))], 1.0);
        for k in -9..=9 {
            assert!(bulge.holds(arc(0.03 * f64::from(k)), 0.0), "{k}");
        }
        let sagitta = 20.0 - ends[0][1];
        assert!(!bulge.holds([0.0, 20.0 + 2.0 * sagitta], 0.0));
        // Seen from the other side of the chord the arc is hollow.
        let hollow = Bulge::new(ends, [Some(arc(-0.4)), Some(arc(0.4))], -1.0);
        assert!(!hollow.holds([0.0, ends[0][1] - 0.01], 0.0));
    }

    #[test]
    fn a_straight_stretch_bulges_nowhere() {
        let bulge = Bulge::new([[0.0, 0.0], [0.0, -12.0]], [Some([0.0, 1.0]), None], 1.0);
        assert!(!bulge.holds([1e-6, -6.0], 0.0));
        assert!(bulge.holds([-1e-6, -6.0], 0.1));
    }
}
