//! The reference curve of a wheel on a rail: the rail's cross-section by its arc length, and the wheel over it.
//!
//! In track axes the curve has the place `(y, z)`, the tangent `(cos α, sin α)` and the normal out of the rail `(−sin α, cos α)` at the arc length
//! s, which grows to the left. The gap is measured from the rail along that normal to the wheel, a surface of revolution about its axle; both are
//! undeformed. Contact solved on this curve needs no plane of contact: x and s are the coordinates of the surface, unfolded.

use crate::contact::geometry::wheel_rail::WheelRail;
use crate::contact::geometry::wheelset::WheelsetMotion;
use crate::contact::numerics::quadrature::{GaussPoints, integral};

/// Spacing of the table of arc lengths, in mm of the rail's parameter.
const LENGTH_STEP: f64 = 0.25;
/// Spacing of the wheel's circles among which the one over a place is looked for, in mm.
const WHEEL_STEP: f64 = 0.1;
/// A wheel farther from the rail than this along the normal, in mm, does not touch it.
const FAR: f64 = 8.0;
/// Largest cosine between the outward normals of two bodies that face each other.
const FACING: f64 = -0.1;
/// Newton's method for the wheel's surface: steps at most, the last step in mm, and the longest one allowed in mm.
const STEPS_MAX: usize = 25;
const STEP_LAST: f64 = 1e-10;
const STEP_LONGEST: f64 = 1.0;

/// The rail's cross-section by its arc length, and the wheel's circles.
#[derive(Debug, Clone)]
pub struct ReferenceCurve<'g> {
    geometry: &'g WheelRail,
    /// Parameters of the rail's curve with the length of the curve up to each.
    lengths: Vec<[f64; 2]>,
    /// Lowest points `[s, x, y, z]` of the wheel's circles, s the parameter of its profile, z from the height of its centre; none where the yaw
    /// hides a circle.
    circles: Vec<Option<[f64; 4]>>,
}

/// A place on the reference curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePlace {
    /// Arc length in mm.
    pub s: f64,
    /// `[y, z]` in track axes, in mm.
    pub at: [f64; 2],
    /// Angle α of the tangent in rad.
    pub angle: f64,
    /// Parameter of the rail's curve.
    pub rail: f64,
}

/// The wheel's surface over a place of the curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelOver {
    /// Distance from the rail along its normal in mm; negative where the bodies overlap.
    pub gap: f64,
    /// Parameter of the wheel's profile.
    pub wheel: f64,
    /// Change of the gap with the height of the wheel's centre.
    pub lift: f64,
    /// Angle in rad that the rail would have if it followed the wheel there.
    pub angle: f64,
}

impl CurvePlace {
    /// Unit tangent `[y, z]`.
    #[must_use]
    pub fn tangent(&self) -> [f64; 2] {
        let (sin, cos) = self.angle.sin_cos();
        [cos, sin]
    }

    /// Unit normal `[y, z]` out of the rail.
    #[must_use]
    pub fn normal(&self) -> [f64; 2] {
        let (sin, cos) = self.angle.sin_cos();
        [-sin, cos]
    }

    /// The point `[x, y, z]` in track axes at a distance along the normal, in mm.
    #[must_use]
    pub fn point(&self, x: f64, gap: f64) -> [f64; 3] {
        let normal = self.normal();
        [
            x,
            self.at[0] + gap * normal[0],
            self.at[1] + gap * normal[1],
        ]
    }
}

impl<'g> ReferenceCurve<'g> {
    /// The curve of a rail, with the wheel in its pose.
    #[must_use]
    pub fn new(geometry: &'g WheelRail) -> ReferenceCurve<'g> {
        let parameters = geometry.parameters(LENGTH_STEP)[0].clone();
        let mut lengths = vec![[parameters[0], 0.0]];
        for pair in parameters.windows(2) {
            let [.., before] = lengths[lengths.len() - 1];
            lengths.push([pair[1], before + length(geometry, pair[0], pair[1])]);
        }
        let wheel = geometry.parameters(WHEEL_STEP)[1].clone();
        let circles = wheel.into_iter().map(|s| {
            let [x, y, z] = geometry.lowest(s)?;
            Some([s, x, y, z])
        });
        ReferenceCurve {
            geometry,
            lengths,
            circles: circles.collect(),
        }
    }

    /// Least and largest arc length in mm. On a right rail, whose points run to the right, arc lengths are negative.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        let whole = self.lengths[self.lengths.len() - 1][1];
        match self.sign() > 0.0 {
            true => [0.0, whole],
            false => [-whole, 0.0],
        }
    }

    fn sign(&self) -> f64 {
        self.geometry.placement.side.sign()
    }

    /// The place at an arc length; beyond the ends the tangent there.
    #[must_use]
    pub fn at(&self, s: f64) -> CurvePlace {
        let along = self.sign() * s;
        let last = self.lengths.len() - 1;
        let k = self.lengths.partition_point(|known| known[1] <= along);
        let [from, before] = self.lengths[k.clamp(1, last) - 1];
        let [to, after] = self.lengths[k.clamp(1, last)];
        let mut rail = from + (to - from) * (along - before) / (after - before);
        // The table is so fine that each step squares an error of some thousandths of its spacing.
        for _ in 0..2 {
            let [y, z] = self.geometry.rail_at(rail).slope;
            rail -= (before + length(self.geometry, from, rail) - along) / y.hypot(z);
        }
        let point = self.geometry.rail_at(rail);
        let [y, z] = point.tangent().map(|part| self.sign() * part);
        CurvePlace {
            s,
            at: point.at,
            angle: z.atan2(y),
            rail,
        }
    }

    /// Where the wheel is nearest to the rail on the line along x through a place, with the wheel's centre at a height in mm: x, and the wheel there as
    /// a start for [`over`](Self::over). None where the wheel does not face the rail within 8 mm.
    #[must_use]
    pub fn nearest(&self, place: &CurvePlace, centre: f64) -> Option<(f64, WheelOver)> {
        let (tangent, normal) = (place.tangent(), place.normal());
        let seen = |[s, x, y, z]: [f64; 4]| {
            let from = [y - place.at[0], z + centre - place.at[1]];
            let [across, gap] = [tangent, normal].map(|axis| axis[0] * from[0] + axis[1] * from[1]);
            [self.sign() * across, gap, x, s]
        };
        let mut found: Option<[f64; 4]> = None;
        let mut before: Option<[f64; 4]> = None;
        for circle in &self.circles {
            let here = circle.map(seen);
            if let (Some(from), Some(to)) = (before, here)
                && from[0] <= 0.0
                && to[0] > 0.0
            {
                let t = from[0] / (from[0] - to[0]);
                let at = [0, 1, 2, 3].map(|k| from[k] + t * (to[k] - from[k]));
                if at[1].abs() < found.map_or(FAR, |found| found[1].abs()) {
                    found = Some(at);
                }
            }
            before = here;
        }
        let [_, gap, x, wheel] = found?;
        let start = WheelOver {
            gap,
            wheel,
            lift: place.angle.cos(),
            angle: place.angle,
        };
        Some((x, self.over(place, x, centre, &start)?))
    }

    /// The wheel over a place, at x and with its centre at a height in mm, by Newton's method from a start nearby. None where the search leaves the
    /// wheel's profile, or finds a surface that does not face the rail.
    #[must_use]
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
        for _ in 0..STEPS_MAX {
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
                return (facing < FACING && inside).then(|| WheelOver {
                    gap,
                    wheel,
                    lift: outward[2] / facing,
                    angle: outward[1].atan2(-outward[2]),
                });
            }
        }
        None
    }

    /// Half of the length in mm on which the bodies overlap along x, where the wheel is nearest to a place at x.
    #[must_use]
    pub fn half_length(&self, wheel: &WheelOver) -> f64 {
        let radius = self.geometry.meridian(wheel.wheel).radius;
        (2.0 * radius * (-wheel.gap).max(0.0) / wheel.lift.abs().max(0.1)).sqrt()
    }
}

/// Length of the rail's curve between two parameters at most one step of the table apart.
fn length(geometry: &WheelRail, from: f64, to: f64) -> f64 {
    integral([from, to], GaussPoints::Three, |s| {
        let [y, z] = geometry.rail_at(s).slope;
        y.hypot(z)
    })
}

/// The motion of the wheel as a rigid body, divided by the rolling speed: in track axes, about a point in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidMotion {
    point: [f64; 3],
    /// Velocity of the point relative to the rail.
    velocity: [f64; 3],
    /// Angular velocity in 1/mm.
    turn: [f64; 3],
}

impl RigidMotion {
    /// That of a wheelset with its centre at a height in mm.
    #[must_use]
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

    /// The one that has these creepages and this spin in 1/mm at a point of the wheel's surface over a place, and turns about the normal there alone.
    #[must_use]
    pub fn of_creepages(point: [f64; 3], place: &CurvePlace, creepages: [f64; 3]) -> RigidMotion {
        let [along, across, spin] = creepages;
        let (tangent, normal) = (place.tangent(), place.normal());
        RigidMotion {
            point,
            velocity: [along, across * tangent[0], across * tangent[1]],
            turn: [0.0, spin * normal[0], spin * normal[1]],
        }
    }

    /// Rigid slip along x and along the tangent of a place, at a point of the wheel in mm.
    #[must_use]
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

    /// Turn about the normal of a place in 1/mm.
    #[must_use]
    pub fn spin(&self, place: &CurvePlace) -> f64 {
        let normal = place.normal();
        self.turn[1] * normal[0] + self.turn[2] * normal[1]
    }
}
