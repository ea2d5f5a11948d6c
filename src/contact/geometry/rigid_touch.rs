//! First touch of a rigid wheel and a rigid rail, for many positions of the wheelset on the same rail.

use crate::geometry::contact_locus::rail_points;
use crate::geometry::envelope::{Envelope, envelope};
use crate::geometry::wheel_rail::WheelRail;

/// Spacing in mm of the samples of the rail's upper envelope, half of that of the points of the rail.
const LINE_STEP: f64 = 0.01;
/// Spacing in mm of the points of the wheel among which the search begins. Two candidates whose clearances differ by less than about 3e-5 mm
/// may be confused.
const WHEEL_STEP: f64 = 0.05;
/// The upper envelope of a rail, and the parameters of the points of the wheel.
#[derive(Debug, Clone)]
pub(crate) struct RailTop {
    lines: Envelope,
    wheel: Vec<f64>,
}

/// The point at which rigid bodies touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidTouch {
    /// Height of the wheel's centre above the top of the rail in mm.
    pub height: f64,
    /// Parameter of the rail's curve.
    pub rail: f64,
    /// Parameter of the wheel's curve.
    pub wheel: f64,
    /// The point `[x, y, z]` in track axes in mm.
    pub at: [f64; 3],
    /// Rotation about x from the track axes to the plane of contact, in rad.
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

    /// Height and parameter of the rail's upper envelope at y.
    fn at(&self, y: f64) -> Option<[f64; 2]> {
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

    /// Finds where the wheel of a geometry with this rail touches first. Returns `None` if no part of the wheel is above the rail.
    pub(crate) fn touch(&self, geometry: &WheelRail) -> Option<RigidTouch> {
        let height = |s: &f64| {
            let [_, y, z] = geometry.lowest(*s)?;
            Some((self.at(y)?[0] - z, *s))
        };
        let highest = self.wheel.iter().filter_map(height);
        let (_, mut wheel) = highest.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let [first, last] = geometry.ranges()[1];
        let value = |s: f64| {
            self.touching(geometry, s.clamp(first, last))
                .map(|at| at[0])
        };
        // The maximum is refined by parabolas through three points.
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
        let [height, rail] = self.touching(geometry, wheel)?;
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

    /// Height of the wheel's centre at which a point of the wheel touches the rail, and the parameter of the rail there.
    fn touching(&self, geometry: &WheelRail, wheel: f64) -> Option<[f64; 2]> {
        let [_, y, z] = geometry.lowest(wheel)?;
        let [_, start] = self.at(y)?;
        let mut rail = start;
        // The start is so close that every step of Newton's method squares the error, and four steps suffice without a test. A bracket, as
        // the general root finder needs it, is not known on a face.
        for _ in 0..4 {
            let point = geometry.rail_at(rail);
            let step = (y - point.at[0]) / point.slope[0];
            // On a nearly vertical face the start is kept.
            if !step.is_finite() || (rail + step - start).abs() > 2.0 * 2.0 * LINE_STEP {
                break;
            }
            rail += step;
        }
        Some([geometry.rail_at(rail).at[1] - z, rail])
    }
}
