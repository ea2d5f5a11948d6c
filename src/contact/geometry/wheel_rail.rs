//! A wheel placed on a rail: cross-sections in track axes, the wheel as a surface of revolution about its axle.
//!
//! Track axes: x along rolling, y to the left, z up; y = 0 in the middle of the track, z = 0 at the top of the rail.
//! The wheelset is turned by the roll about x first, then by the yaw about z, both about its centre, so that the axle
//! is `e = (−sin ψ cos φ, cos ψ cos φ, sin φ)`. The point `(y, z)` of the wheel's profile (z up) runs on a circle of
//! radius `r − z` at the distance `d/2 − p + y` from the centre along the axle, with the flange-back distance d and the
//! flange-back position p. Conventions of the Manchester contact benchmark (Shackleton and Iwnicki 2008).

use std::fmt;
use std::sync::Arc;

use railhead_macros::{Words, keyword};

use crate::geometry::curve_place::CurvePlace;
use crate::geometry::envelope::Envelope;
use crate::geometry::locus_lines::LocusLines;
use crate::geometry::plane_curve::{CurvePoint, PlaneCurve};
use crate::geometry::profile::Profile;
use crate::lazy_field::LazyField;
use crate::numerics::roots::bounds;

/// Left or right rail, seen in the rolling direction.
#[keyword(Words)]
pub enum Side {
    /// The rail at positive y of the track.
    Left,
    /// The rail at negative y of the track.
    Right,
}

impl Side {
    /// Sign of the track's y on this side.
    pub fn sign(self) -> f64 {
        match self {
            Side::Left => 1.0,
            Side::Right => -1.0,
        }
    }
}

/// The lateral position of a rail; lengths in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RailPlace {
    /// The rail is placed by its gauge face.
    Gauge {
        /// Distance of the gauge faces of the two rails.
        gauge: f64,
        /// Depth below the highest point of the rail at which the gauge is measured.
        height: f64,
    },
    /// Distance of the origin of the rail's cross-section from the middle of the track.
    Origin(f64),
}

/// The reason why a wheel and a rail cannot be placed; lengths in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NotPlaced {
    /// The rail ends on the gauge side before the depth at which the gauge is measured.
    NoGaugeFace {
        /// Depth at which the gauge is measured.
        height: f64,
        /// Greatest depth of the rail on the gauge side.
        deepest: f64,
    },
    /// The wheel's profile reaches its axle.
    ReachesAxle {
        /// Greatest height of the profile toward the axle.
        reach: f64,
        /// Radius of the wheel.
        radius: f64,
    },
}

impl fmt::Display for NotPlaced {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NotPlaced::NoGaugeFace { height, deepest } => write!(
                to,
                "the gauge is measured {height} mm below the top of the rail (gauge_height_mm), but on the gauge side the points of the rail \
                 end {deepest:.2} mm below it: send the points of the gauge face too, or place the rail by rail_origin_mm, the distance of \
                 the origin of its cross-section from the middle of the track"
            ),
            NotPlaced::ReachesAxle { reach, radius } => write!(
                to,
                "the wheel's profile reaches {reach:.1} mm toward the axle of a wheel of {radius} mm radius; rolling_radius_mm is in mm"
            ),
        }
    }
}

/// The position of a wheelset relative to a rail; lengths in mm, angles in rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// The side of wheel and rail.
    pub side: Side,
    /// Radius of the wheel at z = 0 of its profile.
    pub rolling_radius: f64,
    /// Lateral position of the rail.
    pub rail: RailPlace,
    /// Rotation of the rail about the origin of its profile, positive with its top toward the track centre.
    pub cant: f64,
    /// Distance between the backs of the two flanges.
    pub flange_back_distance: f64,
    /// y of the back of the flange in the wheel's profile.
    pub flange_back_position: f64,
    /// Shift of the wheelset to the left.
    pub lateral_shift: f64,
    /// Yaw of the wheelset, positive from x to y.
    pub yaw: f64,
    /// Roll of the wheelset, positive from y to z.
    pub roll: f64,
}

/// A wheel and a rail in position, except for the height of the wheel.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelRail {
    /// Their placement.
    pub placement: Placement,
    rail_given: Arc<Profile>,
    /// Origin `[y, z]` of the rail's profile, y from the middle of the track to the field side.
    origin: [f64; 2],
    /// The rail in track axes.
    rail: Arc<PlaneCurve>,
    wheel: Arc<Profile>,
    axes: AxleAxes,
    /// Upper envelope of the rail, independent of the position of the wheelset.
    pub(crate) rail_edge: Arc<LazyField<Envelope>>,
    /// Points along the rail's curve, independent of the position of the wheelset.
    pub(crate) rail_places: Arc<LazyField<Vec<CurvePlace>>>,
    /// The lines on which the wheel lies above the rail, or the reason why there are none.
    pub(crate) locus: LazyField<Arc<Result<LocusLines, String>>>,
}

/// Unit vectors of the wheelset in track axes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct AxleAxes {
    /// Along the axle, to the left.
    axle: [f64; 3],
    /// Length of the axle's component in the cross-section.
    across: f64,
    /// Perpendicular to the axle and nearly forward.
    forward: [f64; 3],
    /// Perpendicular to the axle, without a component along x, and nearly down.
    down: [f64; 3],
}

impl AxleAxes {
    fn new(placement: &Placement) -> AxleAxes {
        let (yaw, roll) = (placement.yaw, placement.roll);
        let axle = [-yaw.sin() * roll.cos(), yaw.cos() * roll.cos(), roll.sin()];
        let across = axle[1].hypot(axle[2]);
        AxleAxes {
            axle,
            across,
            forward: [
                across,
                -axle[0] * axle[1] / across,
                -axle[0] * axle[2] / across,
            ],
            down: [0.0, axle[2] / across, -axle[1] / across],
        }
    }
}

/// A point of the wheel's meridian: position along the axle and radius, with their derivatives with respect to the parameter of the profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meridian {
    /// Distance from the centre along the axle.
    pub along: f64,
    /// Its derivative.
    pub along_slope: f64,
    /// Radius.
    pub radius: f64,
    /// Its derivative.
    pub radius_slope: f64,
}

impl WheelRail {
    /// Places the rail by its top and by its gauge point or its origin, and the wheel by the wheelset.
    ///
    /// # Errors
    /// Returns an error if the rail has no gauge point or the wheel's profile reaches its axle.
    pub fn new(
        rail: Profile,
        wheel: Profile,
        placement: Placement,
    ) -> Result<WheelRail, NotPlaced> {
        let parameters = wheel.parameters(0.2).into_iter();
        let [_, reach] = bounds(parameters.map(|s| wheel.at(s).at[1]));
        if reach >= 0.9 * placement.rolling_radius {
            return Err(NotPlaced::ReachesAxle {
                reach,
                radius: placement.rolling_radius,
            });
        }
        let origin = origin(&rail, &placement)?;
        Ok(WheelRail::placed(rail, Arc::new(wheel), placement, origin))
    }

    fn placed(
        rail: Profile,
        wheel: Arc<Profile>,
        placement: Placement,
        origin: [f64; 2],
    ) -> WheelRail {
        let axes = AxleAxes::new(&placement);
        WheelRail {
            placement,
            rail: Arc::new(
                rail.curve()
                    .placed(placement.cant, origin, placement.side.sign()),
            ),
            rail_given: Arc::new(rail),
            origin,
            wheel,
            axes,
            rail_edge: Arc::default(),
            rail_places: Arc::default(),
            locus: LazyField::default(),
        }
    }

    /// Distance of the origin of the rail's profile from the middle of the track, in mm.
    pub fn rail_origin(&self) -> f64 {
        self.origin[0]
    }

    /// Returns the same rail and wheel with another position of the wheelset: shift to the left in mm, yaw and roll in rad.
    #[must_use]
    pub fn posed(&self, lateral_shift: f64, yaw: f64, roll: f64) -> WheelRail {
        let mut posed = self.clone();
        posed.pose(lateral_shift, yaw, roll);
        posed
    }

    /// Moves the wheelset and clears the cached lines.
    pub(crate) fn pose(&mut self, lateral_shift: f64, yaw: f64, roll: f64) {
        self.placement.lateral_shift = lateral_shift;
        self.placement.yaw = yaw;
        self.placement.roll = roll;
        self.axes = AxleAxes::new(&self.placement);
        self.locus = LazyField::default();
    }

    /// The profiles of the rail (before cant) and the wheel.
    pub fn profiles(&self) -> [&Profile; 2] {
        [&self.rail_given, &self.wheel]
    }

    /// Returns the same bodies with other smoothings of rail and wheel, in mm. If the gauge face is smoothed away, the rail keeps its position.
    #[must_use]
    pub fn smoothed(&self, smoothing: [f64; 2]) -> WheelRail {
        let rail = self.rail_given.smoothed(smoothing[0]);
        let wheel = Arc::new(self.wheel.smoothed(smoothing[1]));
        let origin = origin(&rail, &self.placement).unwrap_or(self.origin);
        WheelRail::placed(rail, wheel, self.placement, origin)
    }

    /// Unit vector along the axle, to the left.
    pub fn axle(&self) -> [f64; 3] {
        self.axes.axle
    }

    /// First and last parameter of the rail's and of the wheel's curve.
    pub fn ranges(&self) -> [[f64; 2]; 2] {
        [self.rail.range(), self.wheel.range()]
    }

    /// Parameters at most `step` apart along the rail and the wheel.
    pub fn parameters(&self, step: f64) -> [Vec<f64>; 2] {
        [self.rail.parameters(step), self.wheel.parameters(step)]
    }

    /// The rail's curve in track axes `[y, z]`, with derivatives with respect to the parameter.
    pub fn rail_at(&self, s: f64) -> CurvePoint {
        self.rail.at(s)
    }

    /// The wheel's meridian at a parameter of its profile.
    pub fn meridian(&self, s: f64) -> Meridian {
        let sign = self.placement.side.sign();
        let place = self.wheel.at(s);
        let base = 0.5 * self.placement.flange_back_distance - self.placement.flange_back_position;
        Meridian {
            along: sign * (base + place.at[0]),
            along_slope: sign * place.slope[0],
            radius: self.placement.rolling_radius - place.at[1],
            radius_slope: -place.slope[1],
        }
    }

    /// The point of a wheel circle at which the normal of the surface has no component along x, so that it can touch a rail that is straight
    /// along x. x and z are relative to the wheel's centre, y is in track axes. Returns `None` if there is no such point because of the yaw.
    pub fn lowest(&self, s: f64) -> Option<[f64; 3]> {
        let circle = self.meridian(s);
        let AxleAxes {
            axle,
            across,
            forward,
            down,
        } = &self.axes;
        let sin = circle.radius_slope / circle.along_slope * (axle[0] / across);
        if sin.is_nan() || sin.abs() >= 1.0 {
            return None;
        }
        let cos = (1.0 - sin * sin).sqrt();
        let mut point = [0, 1, 2]
            .map(|k| circle.along * axle[k] + circle.radius * (cos * down[k] + sin * forward[k]));
        point[1] += self.placement.lateral_shift;
        Some(point)
    }

    /// The wheel's cross-section below its axle in track axes `[y, z]`, with z from the height of the wheelset's centre.
    pub fn wheel_section(&self, s: f64) -> [f64; 2] {
        let circle = self.meridian(s);
        let at = |k: usize| circle.along * self.axes.axle[k] + circle.radius * self.axes.down[k];
        [at(1) + self.placement.lateral_shift, at(2)]
    }

    /// Position on the rail's profile before cant, with y to the field side and z down.
    pub fn on_rail(&self, s: f64) -> [f64; 2] {
        let [y, z] = self.rail_given.at(s).at;
        [y, -z]
    }

    /// Position on the wheel's profile, with y to the field side and z down.
    pub fn on_wheel(&self, s: f64) -> [f64; 2] {
        let [y, z] = self.wheel.at(s).at;
        [y, -z]
    }
}

/// Height in mm by which the points may end above the depth of the gauge, because of rounding.
const GAUGE_ROUNDING: f64 = 1e-6;

/// Position `[y, z]` of the origin of a running rail's profile in mm, with y from the middle of the track to the field side.
fn origin(rail: &Profile, placement: &Placement) -> Result<[f64; 2], NotPlaced> {
    let canted = rail.curve().placed(placement.cant, [0.0; 2], 1.0);
    let places: Vec<[f64; 2]> = canted
        .parameters(0.05)
        .into_iter()
        .filter(|s| *s >= rail.first())
        .map(|s| canted.at(s).at)
        .collect();
    let [_, top] = bounds(places.iter().map(|at| at[1]));
    let y = match placement.rail {
        RailPlace::Origin(y) => y,
        RailPlace::Gauge { gauge, height } => {
            let found = gauge_point(&places, top, height);
            0.5 * gauge - found.map_err(|deepest| NotPlaced::NoGaugeFace { height, deepest })?
        }
    };
    Ok([y, -top])
}

/// Least y of the head of a rail from its top down to a depth on the gauge side. Returns the greatest depth of the rail there as the error if
/// it is less. Points are in order from the gauge side to the field side. Points beyond the first descent to the depth do not belong to the
/// head.
fn gauge_point(places: &[[f64; 2]], top: f64, depth: f64) -> Result<f64, f64> {
    let height = top - depth;
    let of_top = places.iter().position(|at| at[1] >= top).unwrap_or(0);
    let below = places[..=of_top].iter().rposition(|at| at[1] < height);
    let head = &places[below.map_or(0, |below| below + 1)..=of_top];
    let [least, _] = bounds(head.iter().map(|at| at[0]));
    let Some(below) = below else {
        let [lowest, _] = bounds(head.iter().map(|at| at[1]));
        return if lowest - height <= GAUGE_ROUNDING {
            Ok(least)
        } else {
            Err(top - lowest)
        };
    };
    let [from, to] = [places[below], places[below + 1]];
    let t = (height - from[1]) / (to[1] - from[1]);
    Ok(least.min(from[0] + t * (to[0] - from[0])))
}
