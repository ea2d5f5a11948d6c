//! The reference curve of a wheel on a rail: the rail's cross-section by its arc length, and the distance of the wheel from it.
//!
//! At the arc length s, which grows to the left, the curve has the position `(y, z)` in track axes, the tangent `(cos α, sin α)` and the normal out
//! of the rail `(−sin α, cos α)`. The gap is measured from the rail along that normal to the wheel, a surface of revolution about its axle. Both
//! are undeformed. A contact on this curve needs no plane of contact: x and s are the coordinates of the developed surface.
//!
//! Planes of contact are a special case. Each replaces a part of the curve. There s is the distance along the plane from its origin, the angle is
//! that of the plane, and the gap is measured along its normal.

use std::borrow::Cow;
use std::cell::Cell;
use std::ops::Range;

use crate::geometry::plane_curve::CurvePoint;
use crate::geometry::profile::POINT_SPACING;
use crate::geometry::wheel_rail::WheelRail;
use crate::geometry::wheelset_pose::WheelsetMotion;
use crate::numerics::ITERATIONS_MAX;
use crate::numerics::quadrature::{GaussPoints, integral};
use crate::numerics::roots::{bounds, maximum};

pub use crate::geometry::curve_place::CurvePlace;

/// Number of intervals between neighbouring circles, or points of the rail, in one bounding circle. The search tries this many circles near the last result before all others.
const BLOCK: usize = 16;
/// Gap in mm between the rail and the polygon of the wheel below which the gap is computed exactly. The bodies may then overlap between two tabulated points without
/// overlapping at them.
const POLYGON_GAP_MAX: f64 = 0.02;
/// Largest distance in mm between the polygons of both bodies where the bodies may overlap.
const DEEPEST: f64 = 2.0;
/// Distance in mm along the normal beyond which the wheel does not touch the rail.
const FAR: f64 = 8.0;
/// Least cosine of the angle between surfaces that face each other: between the outward normal of the wheel and the inward normal of the rail,
/// and between the rail and a plane of contact, which ends where the rail turns away from it.
pub(crate) const FACING_LEAST: f64 = 0.1;
/// Number of intervals between the points along x at which the gap is computed, for a wheel without yaw.
const INTERVALS: usize = 4;
/// Distance in mm across the wheel's profile that adds one interval.
const NODE_DISTANCE: f64 = 0.1;
/// Length in mm of a step that ends Newton's method.
const STEP_LAST: f64 = 1e-10;
/// Length in mm to which a step of Newton's method is limited.
const STEP_LONGEST: f64 = 1.0;

/// A plane of contact, parallel to x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPlane {
    /// Its origin on the rail.
    pub origin: CurvePlace,
    /// Its angle in rad.
    pub angle: f64,
    /// Range of arc lengths in mm in which it replaces the curve.
    pub range: [f64; 2],
}

impl ContactPlane {
    /// The coordinate s in mm of a point `[y, z]`.
    fn along(&self, at: [f64; 2]) -> f64 {
        let (sin, cos) = self.angle.sin_cos();
        self.origin.s + (at[0] - self.origin.at[0]) * cos + (at[1] - self.origin.at[1]) * sin
    }

    /// Cosine of the angle between the plane and a tangent at an angle in rad.
    fn follows(&self, angle: f64) -> f64 {
        (angle - self.angle).cos()
    }
}

/// The rail's cross-section by its arc length, and the wheel's circles.
#[derive(Debug, Clone)]
pub struct ReferenceCurve<'g> {
    geometry: &'g WheelRail,
    /// Points of the rail's curve, from the first to the last.
    rail: Cow<'g, [CurvePlace]>,
    /// Planes of contact that replace the curve, by increasing arc length; empty on the curve itself.
    planes: Vec<ContactPlane>,
    /// Lowest points of the wheel's circles.
    circles: Vec<LowestPoint>,
    /// Bounding circles of [`BLOCK`] intervals between neighbouring lowest points each.
    blocks: Vec<Circle>,
    /// The last result of [`ReferenceCurve::at`], because the cells of a strip have the same arc length.
    last: Cell<CurvePlace>,
    /// Number of the circle after the last point of the wheel that was found, near which the next search begins.
    after: Cell<usize>,
}

/// The lowest point of a circle of the wheel, with z from the height of the wheel's centre; NaN if there is none because of the yaw.
#[derive(Debug, Clone, Copy)]
struct LowestPoint {
    /// Parameter of the wheel's profile.
    wheel: f64,
    x: f64,
    at: [f64; 2],
}

/// A circle in the cross-section, in mm.
#[derive(Debug, Clone, Copy)]
struct Circle {
    centre: [f64; 2],
    radius: f64,
}

impl Circle {
    /// A circle around some points.
    fn around(points: impl Iterator<Item = [f64; 2]> + Clone) -> Circle {
        let centre = [0, 1].map(|k| {
            let [low, high] = bounds(points.clone().map(|at| at[k]));
            0.5 * (low + high)
        });
        let far = points.map(|at| (at[0] - centre[0]).hypot(at[1] - centre[1]));
        Circle {
            centre,
            radius: far.fold(0.0, f64::max),
        }
    }

    /// Returns whether another circle, raised by a height, comes within a distance.
    fn is_near(&self, other: &Circle, height: f64, distance: f64) -> bool {
        let across = self.centre[0] - other.centre[0];
        let up = self.centre[1] - other.centre[1] - height;
        let reach = self.radius + other.radius + distance;
        across * across + up * up <= reach * reach
    }
}

/// The point of a line along x at which the wheel is nearest to the rail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// The point of the curve through which the line passes.
    pub place: CurvePlace,
    /// x in mm.
    pub x: f64,
    /// The wheel.
    pub wheel: WheelOver,
}

/// The wheel's surface above a point of the rail's surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelOver {
    /// Distance from the rail along its normal in mm; negative where the bodies overlap.
    pub gap: f64,
    /// Parameter of the wheel's profile.
    pub wheel: f64,
    /// Derivative of the gap with respect to the height of the wheel's centre.
    pub lift: f64,
    /// Angle in rad of a rail that is parallel to the wheel there.
    pub angle: f64,
}

impl<'g> ReferenceCurve<'g> {
    /// The curve of a rail, with the wheel in its position.
    pub fn new(geometry: &'g WheelRail) -> ReferenceCurve<'g> {
        let [_, wheel] = geometry.parameters(POINT_SPACING);
        let circles: Vec<LowestPoint> = wheel
            .into_iter()
            .map(|wheel| {
                let [x, y, z] = geometry.lowest(wheel).unwrap_or([f64::NAN; 3]);
                LowestPoint {
                    wheel,
                    x,
                    at: [y, z],
                }
            })
            .collect();
        let blocks = blocks(circles.len()).map(|block| {
            let points = circles[block].iter().map(|circle| circle.at);
            Circle::around(points.filter(|at| !at[0].is_nan()))
        });
        let rail = geometry.rail_places.get_or_make(|| rail_places(geometry));
        ReferenceCurve {
            blocks: blocks.collect(),
            last: Cell::new(rail[0]),
            after: Cell::new(1),
            rail: Cow::Borrowed(rail),
            planes: Vec::new(),
            geometry,
            circles,
        }
    }

    /// Returns this curve with parts replaced by planes of contact, which are given by increasing arc length. Returns the curve itself if fewer
    /// than two of its points face a plane.
    #[must_use]
    pub fn on_planes(&self, planes: Vec<ContactPlane>) -> ReferenceCurve<'g> {
        let mut rail = Vec::new();
        for plane in &planes {
            let facing = |place: &CurvePlace| plane.follows(place.angle) > FACING_LEAST;
            let inside = |place: &CurvePlace| {
                (plane.range[0]..plane.range[1]).contains(&place.s) && facing(place)
            };
            let sign = self.sign();
            let before = |place: &CurvePlace| sign * place.s < sign * plane.origin.s;
            let middle = self.rail.partition_point(before);
            let before = self.rail[..middle]
                .iter()
                .rev()
                .take_while(|place| inside(place));
            let first = middle - before.count();
            let after = self.rail[middle..].iter().take_while(|place| inside(place));
            let last = middle + after.count();
            let places = self.rail[first..last].iter().map(|place| CurvePlace {
                s: plane.along(place.at),
                angle: plane.angle,
                ..*place
            });
            rail.extend(places);
        }
        // The planes are in order of the arc length, but the points in the order of the rail's points.
        if self.sign() < 0.0 {
            rail.sort_by(|a: &CurvePlace, b| b.s.total_cmp(&a.s));
        }
        match rail[..] {
            [first, _, ..] => ReferenceCurve {
                last: Cell::new(first),
                rail: Cow::Owned(rail),
                planes,
                ..self.clone()
            },
            _ => self.clone(),
        }
    }

    /// The number of the plane at a coordinate s in mm; 0 on the curve.
    pub fn plane(&self, s: f64) -> usize {
        let last = self.planes.len().saturating_sub(1);
        self.planes
            .partition_point(|plane| plane.range[1] <= s)
            .min(last)
    }

    /// Returns whether planes replace the curve.
    pub fn is_flat(&self) -> bool {
        !self.planes.is_empty()
    }

    /// Least and largest arc length in mm. Arc lengths are negative on a right rail, whose points run to the right.
    pub fn range(&self) -> [f64; 2] {
        let last = self.rail[self.rail.len() - 1].s;
        [last.min(0.0), last.max(0.0)]
    }

    fn sign(&self) -> f64 {
        self.geometry.placement.side.sign()
    }

    /// The point at an arc length. Beyond its ends the curve continues along the tangent.
    pub fn at(&self, s: f64) -> CurvePlace {
        if self.last.get().s == s {
            return self.last.get();
        }
        let sign = self.sign();
        let next = self
            .rail
            .partition_point(|known| sign * known.s <= sign * s);
        let next = next.clamp(1, self.rail.len() - 1);
        let [from, to] = [self.rail[next - 1], self.rail[next]];
        let mut rail = from.rail + (to.rail - from.rail) * (s - from.s) / (to.s - from.s);
        // The table is so fine that one Newton step squares an error of some thousandths of its spacing.
        let CurvePoint {
            at, slope: [y, z], ..
        } = self.geometry.rail_at(rail);
        let found = match self.planes.get(self.plane(s)) {
            None => {
                let missed = length(self.geometry, from.rail, rail) - sign * (s - from.s);
                rail -= missed / y.hypot(z);
                place(self.geometry, rail, s)
            }
            Some(plane) => {
                let (sin, cos) = plane.angle.sin_cos();
                rail -= (plane.along(at) - s) / (y * cos + z * sin);
                CurvePlace {
                    angle: plane.angle,
                    ..place(self.geometry, rail, s)
                }
            }
        };
        self.last.set(found);
        found
    }

    /// The point at a parameter of the rail's curve. It is not defined on planes.
    pub(crate) fn at_rail(&self, rail: f64) -> CurvePlace {
        let next = self.rail.partition_point(|known| known.rail <= rail);
        let from = self.rail[next.clamp(1, self.rail.len()) - 1];
        let along = length(self.geometry, from.rail, rail);
        place(self.geometry, rail, from.s + self.sign() * along)
    }

    /// Finds where the wheel is nearest to the rail on the line along x through a point of the curve, with the wheel's centre at a height in mm.
    /// Returns x and the wheel there, a start for [`over`](Self::over). Returns `None` if the wheel does not face the rail within 8 mm.
    pub fn nearest(&self, place: &CurvePlace, centre: f64) -> Option<(f64, WheelOver)> {
        let (x, start) = self.about(place, centre, FAR)?;
        Some((x, self.over(place, x, centre, &start)?))
    }

    /// Estimates [`nearest`](Self::nearest) from the polygon of the wheel's lowest points, if that is within a distance in mm. The search begins
    /// at the last result.
    fn about(&self, place: &CurvePlace, centre: f64, far: f64) -> Option<(f64, WheelOver)> {
        let (tangent, normal) = (place.tangent(), place.normal());
        let here = Circle {
            centre: place.at,
            radius: 0.0,
        };
        let seen = |k: usize| {
            let circle = &self.circles[k];
            let from = [
                circle.at[0] - place.at[0],
                circle.at[1] + centre - place.at[1],
            ];
            let [across, gap] = [tangent, normal].map(|axis| axis[0] * from[0] + axis[1] * from[1]);
            [self.sign() * across, gap, circle.x, circle.wheel]
        };
        let between = |k: usize| {
            let [from, to] = [seen(k - 1), seen(k)];
            let t = from[0] / (from[0] - to[0]);
            let at = [0, 1, 2, 3].map(|i| from[i] + t * (to[i] - from[i]));
            (from[0] <= 0.0 && to[0] > 0.0 && at[1].abs() < far).then_some((k, at))
        };
        let last = self.circles.len() - 1;
        let mut next = self.after.get();
        let mut found = None;
        for _ in 0..BLOCK {
            found = between(next);
            if found.is_some() {
                break;
            }
            let beyond = seen(next)[0] <= 0.0;
            next = if beyond { next + 1 } else { next - 1 }.clamp(1, last);
        }
        let near = || {
            blocks(last + 1)
                .zip(&self.blocks)
                .filter(|(_, circle)| here.is_near(circle, centre, far))
        };
        let found = found.or_else(|| {
            let all = near()
                .flat_map(|(block, _)| block.skip(1))
                .filter_map(between);
            all.min_by(|(_, a), (_, b)| a[1].abs().total_cmp(&b[1].abs()))
        });
        let (next, [_, gap, x, wheel]) = found?;
        self.after.set(next);
        let start = WheelOver {
            gap,
            wheel,
            lift: place.angle.cos(),
            angle: place.angle,
        };
        Some((x, start))
    }

    /// The parts of the rail in which the bodies overlap with the wheel's centre at a height in mm: points at most [`POINT_SPACING`] apart, by
    /// increasing arc length. If the bodies overlap only between two tabulated points, the part has the single point at which they overlap most.
    pub fn overlaps(&self, centre: f64) -> Vec<Vec<Nearest>> {
        let seen = self.close_places(centre);
        let gap = |k: usize| seen[k].map_or(f64::INFINITY, |seen| seen.wheel.gap);
        let last = seen.len() - 1;
        let is_least =
            |k: usize| gap(k) <= gap(k.saturating_sub(1)) && gap(k) <= gap((k + 1).min(last));
        let mut stretches: Vec<Vec<Nearest>> = Vec::new();
        let mut open = false;
        for (k, here) in seen.iter().enumerate() {
            let Some(here) = *here else {
                open = false;
                continue;
            };
            if here.wheel.gap >= 0.0 {
                open = false;
                let deepest = is_least(k).then(|| self.deepest_near(here, centre, POINT_SPACING));
                let deepest = deepest.filter(|deepest| deepest.wheel.gap < 0.0);
                stretches.extend(deepest.map(|deepest| vec![deepest]));
            } else if open && let Some(last) = stretches.last_mut() {
                last.push(here);
            } else {
                stretches.push(vec![here]);
                open = true;
            }
        }
        stretches
    }

    /// A point of the table, counted by increasing arc length.
    fn ordered(&self, k: usize) -> &CurvePlace {
        match self.sign() > 0.0 {
            true => &self.rail[k],
            false => &self.rail[self.rail.len() - 1 - k],
        }
    }

    /// The wheel above a point of the curve that it may overlap.
    fn nearest_at(&self, place: CurvePlace, centre: f64) -> Option<Nearest> {
        let about = self.about(&place, centre, DEEPEST);
        let (x, start) = about.filter(|(_, wheel)| wheel.gap < POLYGON_GAP_MAX)?;
        let wheel = self.over(&place, x, centre, &start)?;
        Some(Nearest { place, x, wheel })
    }

    /// The wheel above the points of the table that it may overlap, by increasing arc length.
    fn close_places(&self, centre: f64) -> Vec<Option<Nearest>> {
        let mut close = vec![None; self.rail.len()];
        for block in blocks(self.rail.len()) {
            let places = block.clone().map(|k| self.ordered(k).at);
            let around = Circle::around(places);
            if !self
                .blocks
                .iter()
                .any(|wheel| around.is_near(wheel, centre, DEEPEST))
            {
                continue;
            }
            for k in block {
                close[k] = self.nearest_at(*self.ordered(k), centre);
            }
        }
        close
    }

    /// The point with the least gap within a distance of another point.
    fn deepest_near(&self, start: Nearest, centre: f64, distance: f64) -> Nearest {
        let best = Cell::new(start);
        let around = [start.place.s - distance, start.place.s + distance];
        maximum(around, |s| {
            let Some(found) = self.nearest_at(self.at(s), centre) else {
                return f64::NEG_INFINITY;
            };
            if found.wheel.gap < best.get().wheel.gap {
                best.set(found);
            }
            -found.wheel.gap
        });
        best.get()
    }

    /// The wheel above a point of the rail's surface at x, with its centre at a height in mm, by Newton's method from a start nearby. Returns
    /// `None` if the search leaves the wheel's profile or finds a surface that does not face the rail.
    pub fn over(
        &self,
        place: &CurvePlace,
        x: f64,
        centre: f64,
        start: &WheelOver,
    ) -> Option<WheelOver> {
        let (geometry, axle, normal) = (self.geometry, self.geometry.axle(), place.normal());
        let from = [
            x,
            place.at[0] - geometry.placement.lateral_shift,
            place.at[1] - centre,
        ];
        let normal_along = normal[0] * axle[1] + normal[1] * axle[2];
        let [first, last] = geometry.ranges()[1];
        let WheelOver {
            mut gap, mut wheel, ..
        } = *start;
        for _ in 0..ITERATIONS_MAX {
            let arm = [
                from[0],
                from[1] + gap * normal[0],
                from[2] + gap * normal[1],
            ];
            let along: f64 = (0..3).map(|k| arm[k] * axle[k]).sum();
            let radial = [0, 1, 2].map(|k| arm[k] - along * axle[k]);
            let radius = (0..3).map(|k| radial[k] * radial[k]).sum::<f64>().sqrt();
            let meridian = geometry.meridian(wheel);
            let missed = [along - meridian.along, radius - meridian.radius];
            let widening = (normal[0] * radial[1] + normal[1] * radial[2]) / radius;
            let (a, r) = (meridian.along_slope, meridian.radius_slope);
            let determinant = a * widening - normal_along * r;
            let step = [
                (r * missed[0] - a * missed[1]) / determinant,
                (widening * missed[0] - normal_along * missed[1]) / determinant,
            ];
            let [across, along_wheel] = step.map(|step| step.clamp(-STEP_LONGEST, STEP_LONGEST));
            if !(across.is_finite() && along_wheel.is_finite()) {
                return None;
            }
            gap += across;
            wheel = (wheel + along_wheel).clamp(first, last);
            if step[0].abs().max(step[1].abs()) < STEP_LAST {
                let size = self.sign() * a.hypot(r);
                let outward = [0, 1, 2].map(|k| (a * radial[k] / radius - r * axle[k]) / size);
                let facing = outward[1] * normal[0] + outward[2] * normal[1];
                let inside = wheel > first && wheel < last;
                return (facing < -FACING_LEAST && inside).then(|| WheelOver {
                    gap,
                    wheel,
                    lift: outward[2] / facing,
                    angle: outward[1].atan2(-outward[2]),
                });
            }
        }
        None
    }

    /// Points along x between two ends in mm at which the gap of a strip is computed, so that a polynomial interpolates it. There are more if the
    /// yaw moves the contact across the wheel's profile.
    pub fn nodes(&self, [first, last]: [f64; 2]) -> Vec<f64> {
        let across = self.geometry.axle()[0].abs() * (last - first);
        let intervals = INTERVALS + (across / NODE_DISTANCE) as usize;
        let (middle, half) = (0.5 * (first + last), 0.5 * (last - first));
        let angle = |k: usize| std::f64::consts::PI * k as f64 / intervals as f64;
        (0..=intervals)
            .map(|k| middle - half * angle(k).cos())
            .collect()
    }

    /// The wheel above the points of a line along x, with its centre at a height in mm. The results on a neighbouring line serve as the start if
    /// they are given. Returns `None` if one of the points is not below the wheel.
    pub fn over_line(
        &self,
        place: &CurvePlace,
        x: &[f64],
        centre: f64,
        beside: Option<&[WheelOver]>,
    ) -> Option<Vec<WheelOver>> {
        let from_beside = beside.and_then(|beside| {
            let points = x.iter().zip(beside);
            let over = points.map(|(x, start)| self.over(place, *x, centre, start));
            over.collect::<Option<Vec<WheelOver>>>()
        });
        if from_beside.is_some() {
            return from_beside;
        }
        let (nearest, start) = self.nearest(place, centre)?;
        let middle = x.partition_point(|x| *x < nearest);
        let mut line = vec![start; x.len()];
        let mut from = start;
        for k in (0..middle).rev() {
            from = self.over(place, x[k], centre, &from)?;
            line[k] = from;
        }
        from = start;
        for k in middle..x.len() {
            from = self.over(place, x[k], centre, &from)?;
            line[k] = from;
        }
        Some(line)
    }

    /// Half of the length in mm on which the bodies overlap along x, given the wheel where it is nearest.
    pub fn half_length(&self, wheel: &WheelOver) -> f64 {
        let radius = self.geometry.meridian(wheel.wheel).radius;
        (2.0 * radius * (-wheel.gap).max(0.0) / wheel.lift.abs().max(FACING_LEAST)).sqrt()
    }
}

/// Ranges of points with [`BLOCK`] intervals each. Neighbouring ranges share a point.
fn blocks(points: usize) -> impl Iterator<Item = Range<usize>> {
    (0..points.saturating_sub(1))
        .step_by(BLOCK)
        .map(move |first| first..(first + BLOCK + 1).min(points))
}

/// Points along a rail's curve, from the first to the last.
fn rail_places(geometry: &WheelRail) -> Vec<CurvePlace> {
    let [parameters, _] = geometry.parameters(POINT_SPACING);
    let sign = geometry.placement.side.sign();
    let mut s = 0.0;
    let mut places = vec![place(geometry, parameters[0], s)];
    for pair in parameters.windows(2) {
        s += sign * length(geometry, pair[0], pair[1]);
        places.push(place(geometry, pair[1], s));
    }
    places
}

/// The point at a parameter of the rail's curve with a known arc length.
fn place(geometry: &WheelRail, rail: f64, s: f64) -> CurvePlace {
    let point = geometry.rail_at(rail);
    let [y, z] = point
        .tangent()
        .map(|part| geometry.placement.side.sign() * part);
    CurvePlace {
        s,
        at: point.at,
        angle: z.atan2(y),
        rail,
    }
}

/// Length of the rail's curve between two parameters at most one step of the table apart.
fn length(geometry: &WheelRail, from: f64, to: f64) -> f64 {
    integral([from, to], GaussPoints::Three, |s| {
        let [y, z] = geometry.rail_at(s).slope;
        y.hypot(z)
    })
}

/// The motion of the wheel as a rigid body, divided by the rolling speed, in track axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidMotion {
    /// A point of the body in mm.
    point: [f64; 3],
    /// Velocity of this point relative to the rail.
    velocity: [f64; 3],
    /// Angular velocity in 1/mm.
    turn: [f64; 3],
}

impl RigidMotion {
    /// The motion of a wheelset with its centre at a height in mm.
    pub fn of_wheelset(geometry: &WheelRail, centre: f64, motion: &WheelsetMotion) -> RigidMotion {
        let mut turn = geometry.axle().map(|part| motion.angular_velocity * part);
        turn[0] += motion.roll_rate;
        turn[2] += motion.yaw_rate;
        RigidMotion {
            point: [0.0, geometry.placement.lateral_shift, centre],
            velocity: [1.0, motion.lateral_velocity / motion.speed, 0.0],
            turn: turn.map(|part| part / motion.speed),
        }
    }

    /// The motion with these creepages and this spin in 1/mm at a point of the wheel's surface, which rotates only about the normal of the rail
    /// below it.
    pub fn of_creepages(point: [f64; 3], place: &CurvePlace, creepages: [f64; 3]) -> RigidMotion {
        let [along, across, spin] = creepages;
        let (tangent, normal) = (place.tangent(), place.normal());
        RigidMotion {
            point,
            velocity: [along, across * tangent[0], across * tangent[1]],
            turn: [0.0, spin * normal[0], spin * normal[1]],
        }
    }

    /// Rigid slip along x and along the tangent of the curve, at a point of the wheel in mm.
    pub fn slip(&self, point: [f64; 3], place: &CurvePlace) -> [f64; 2] {
        let arm = [0, 1, 2].map(|k| point[k] - self.point[k]);
        let turn = &self.turn;
        let velocity = [
            self.velocity[0] + turn[1] * arm[2] - turn[2] * arm[1],
            self.velocity[1] + turn[2] * arm[0] - turn[0] * arm[2],
            self.velocity[2] + turn[0] * arm[1] - turn[1] * arm[0],
        ];
        let tangent = place.tangent();
        [
            velocity[0],
            velocity[1] * tangent[0] + velocity[2] * tangent[1],
        ]
    }

    /// Angular velocity about the normal of the curve in 1/mm.
    pub fn spin(&self, place: &CurvePlace) -> f64 {
        let normal = place.normal();
        self.turn[1] * normal[0] + self.turn[2] * normal[1]
    }
}
