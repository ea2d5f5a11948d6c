//! Where a wheel touches its rail if both are rigid, for many places of the wheelset over the same rail.

use crate::geometry::contact_locus::rail_points;
use crate::geometry::envelope::{Envelope, envelope};
use crate::geometry::wheel_rail::WheelRail;

/// Spacing in mm of the lines on which the rail's upper edge is kept, half of that of its points.
const LINE_STEP: f64 = 0.01;
/// Spacing of the points of the wheel among which the touching one is looked for, in mm. Two places of contact whose clearances
/// differ by less than some 3e-5 mm may be taken for each other.
const WHEEL_STEP: f64 = 0.05;
/// The upper edge of a rail, and the points of the wheel above it.
#[derive(Debug, Clone)]
pub(crate) struct RailTop {
    lines: Envelope,
    wheel: Vec<f64>,
}

/// A place where rigid bodies touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidTouch {
    /// Height of the wheel's centre over the top of the rail in mm.
    pub height: f64,
    /// Parameter of the rail's curve.
    pub rail: f64,
    /// Parameter of the wheel's curve.
    pub wheel: f64,
    /// The place in track axes `[x, y, z]` in mm.
    pub at: [f64; 3],
    /// Turn about x from the track's axes to those of the plane of contact, in rad.
    pub angle: f64,
    /// Radius of the wheel at the contact point in mm.
    pub radius: f64,
}

impl RailTop {
    pub(crate) fn new(geometry: &WheelRail) -> RailTop {
        let [rail, _] = geometry.parameters(2.0 * LINE_STEP);
        let rail = rail_points(geometry, rail);
        let [_, wheel] = geometry.parameters(WHEEL_STEP);
        RailTop {
            lines: envelope(&rail, LINE_STEP),
            wheel,
        }
    }

    /// Height and parameter of the rail's upper edge over y.
    fn over(&self, y: f64) -> Option<[f64; 2]> {
        let place = y / self.lines.step - self.lines.first as f64;
        let k = place.floor();
        if k < 0.0 {
            return None;
        }
        let [low, high] = [k as usize, k as usize + 1].map(|k| self.lines.points.get(k));
        let (low, high) = ((*low?)?, (*high?)?);
        let t = place - k;
        Some([0, 1].map(|part| low[part] + t * (high[part] - low[part])))
    }

    /// Where the wheel of the geometry, which has this rail, touches it first; none if no part of it is above the rail.
    pub(crate) fn touch(&self, geometry: &WheelRail) -> Option<RigidTouch> {
        let height = |s: &f64| {
            let [_, y, z] = geometry.lowest(*s)?;
            Some((self.over(y)?[0] - z, *s))
        };
        let highest = self.wheel.iter().filter_map(height);
        let (_, mut wheel) = highest.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let [first, last] = geometry.ranges()[1];
        let value = |s: f64| self.exactly(geometry, s.clamp(first, last)).map(|at| at[0]);
        // Refined by parabolas through points so far apart.
        for step in [WHEEL_STEP, LINE_STEP] {
            let around = [-step, 0.0, step].map(|by| value(wheel + by));
            let [Some(before), Some(here), Some(after)] = around else {
                break;
            };
            let bend = before - 2.0 * here + after;
            if bend < 0.0 {
                wheel += (0.5 * step * (before - after) / bend).clamp(-step, step);
            }
        }
        let wheel = wheel.clamp(first, last);
        let [height, rail] = self.exactly(geometry, wheel)?;
        let [x, y, z] = geometry.lowest(wheel)?;
        let [dy, dz] = geometry.rail_at(rail).slope;
        Some(RigidTouch {
            height,
            rail,
            wheel,
            at: [x, y, z + height],
            angle: (dz / dy).atan(),
            radius: geometry.meridian(wheel).radius,
        })
    }

    /// Height of the wheel's centre at which the point of the wheel touches the rail, and the parameter of the rail there.
    fn exactly(&self, geometry: &WheelRail, wheel: f64) -> Option<[f64; 2]> {
        let [_, y, z] = geometry.lowest(wheel)?;
        let [_, start] = self.over(y)?;
        let mut rail = start;
        // From a place on the line between two points of the rail each step of Newton's method squares the error, so that none is tested; bounds of the root,
        // as the common root finders need, are not known on a face.
        for _ in 0..4 {
            let point = geometry.rail_at(rail);
            let step = (y - point.at[0]) / point.slope[0];
            // On a face that is all but upright the place found from the lines is kept.
            if !step.is_finite() || (rail + step - start).abs() > 2.0 * 2.0 * LINE_STEP {
                break;
            }
            rail += step;
        }
        Some([geometry.rail_at(rail).at[1] - z, rail])
    }
}
