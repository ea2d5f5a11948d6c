//! The rail over the plane of a frame: its height and the parameter of its curve there.

use crate::contact::geometry::frame::{Frame, Plane};
use crate::contact::geometry::frame::{SurfaceExit, SurfaceMissed};
use crate::contact::geometry::plane_curve::CurvePoint;
use crate::contact::geometry::wheel_rail::WheelRail;

/// The rail belongs to a patch as far as the component of its tangent along the plane of the frame is at least this.
const TANGENT_MIN: f64 = 0.1;
/// The curve is followed in steps of this length in mm at most, which Newton's method can take.
const STRIDE: f64 = 0.5;

/// The rail's curve over the plane of a frame, as far as it is a function there.
pub(crate) struct RailInFrame<'g> {
    geometry: &'g WheelRail,
    plane: Plane,
    /// Parameter of the frame's origin.
    origin: f64,
    /// Sign of the change of y with the parameter.
    sign: f64,
}

/// A point of the curve: coordinates across and along the normal, slope of the first by the parameter, and parameter.
#[derive(Clone, Copy)]
struct RailPoint {
    v: f64,
    slope: f64,
    height: f64,
    s: f64,
}

impl<'g> RailInFrame<'g> {
    pub(crate) fn new(geometry: &'g WheelRail, frame: &Frame) -> Self {
        RailInFrame {
            geometry,
            plane: frame.plane(),
            origin: frame.rail,
            sign: geometry.placement.side.sign(),
        }
    }

    /// The point at a parameter; none where the curve ends or turns away from the plane.
    fn at(&self, s: f64) -> Option<RailPoint> {
        let [first, last] = self.geometry.ranges()[0];
        let CurvePoint { at, slope, .. } = self.geometry.rail_at(s);
        let [tangent, _] = self.plane.axes;
        let along = slope[0] * tangent[0] + slope[1] * tangent[1];
        let length = (slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
        let [v, height] = self.plane.across(at);
        let found = RailPoint {
            v,
            slope: along,
            height,
            s,
        };
        ((first..=last).contains(&s) && self.sign * along > TANGENT_MIN * length).then_some(found)
    }

    /// The point over v, from one nearby on the part of the curve where v goes with the parameter.
    fn next(&self, mut from: RailPoint, v: f64) -> Option<RailPoint> {
        while (v - from.v).abs() > STRIDE {
            let stride = STRIDE.copysign(v - from.v);
            from = self.near(from, from.v + stride)?;
        }
        self.near(from, v)
    }

    /// The same, by Newton's method without strides.
    fn near(&self, mut from: RailPoint, v: f64) -> Option<RailPoint> {
        const STEPS: u32 = 30;
        const TOLERANCE: f64 = 1e-11;
        let [first, last] = self.geometry.ranges()[0];
        for _ in 0..STEPS {
            let step = (v - from.v) / from.slope;
            if (v - from.v).abs() < TOLERANCE {
                return Some(from);
            }
            // The end of the curve counts as reached, so that rounding never makes a place at the end miss it.
            let s = (from.s + step).clamp(first, last);
            if s == from.s {
                return None;
            }
            from = self.at(s)?;
        }
        None
    }

    /// Those of increasing places across over which the rail goes on from the frame's origin, with its heights there.
    pub(crate) fn heights(&self, y: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let above = y.partition_point(|v| *v < 0.0);
        let mut found: Vec<[f64; 2]> = Vec::with_capacity(y.len());
        let follow = |order: &mut dyn Iterator<Item = &f64>, found: &mut Vec<[f64; 2]>| {
            let mut from = self.at(self.origin);
            for v in order {
                from = from.and_then(|from| self.next(from, *v));
                let Some(point) = from else { break };
                found.push([*v, point.height]);
            }
        };
        follow(&mut y[..above].iter().rev(), &mut found);
        found.reverse();
        follow(&mut y[above..].iter(), &mut found);
        found.into_iter().map(|[v, height]| (v, height)).unzip()
    }

    /// The parameter of an end of the rail that lies over a range across and faces the plane, if there is one.
    pub(crate) fn end_within(&self, [low, high]: [f64; 2]) -> Option<f64> {
        let inside = |s: &f64| self.at(*s).is_some_and(|end| low < end.v && end.v < high);
        self.geometry.ranges()[0].into_iter().find(inside)
    }

    /// Height over the place `[u, v]` of the plane, and the parameter of the curve there.
    ///
    /// # Errors
    /// The rail ends or turns away from the plane before.
    pub(crate) fn over(&self, [u, v]: [f64; 2]) -> Result<[f64; 2], SurfaceMissed> {
        let found = self.at(self.origin).and_then(|from| self.next(from, v));
        let missed = SurfaceMissed {
            at: [u, v],
            exit: SurfaceExit::RailTurnsAway,
        };
        found.map(|point| [point.height, point.s]).ok_or(missed)
    }
}
