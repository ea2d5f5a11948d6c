//! A wheel placed on a rail: cross-sections in track axes, the wheel as a surface of revolution about its axle.
//!
//! Track axes: x along rolling, y to the left, z up; y = 0 in the middle of the track, z = 0 at the top of the rail.
//! The wheelset is turned by the roll about x first, then by the yaw about z, both about its centre, so that the axle
//! is `e = (−sin ψ cos φ, cos ψ cos φ, sin φ)`. The point `(y, z)` of the wheel's profile (z up) runs on a circle of
//! radius `r − z` at the distance `d/2 − p + y` from the centre along the axle, with the flange-back distance d and the
//! flange-back position p. Conventions of the Manchester contact benchmark (Shackleton and Iwnicki 2008).

use std::sync::{Arc, Mutex, PoisonError};

use crate::contact::geometry::locus_lines::{LocusLines, RailEdge};
use crate::contact::geometry::plane_curve::{CurvePoint, PlaneCurve};
use crate::contact::geometry::profile::Profile;
use crate::contact::once::Once;
use crate::contact::remark::entry::RemarkEntry;

/// Left or right rail, seen along rolling.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// y of the track is positive there.
    Left,
    /// y of the track is negative there.
    Right,
}

impl Side {
    /// Sign of the track's y on this side.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Side::Left => 1.0,
            Side::Right => -1.0,
        }
    }
}

/// How wheelset and rail are placed relative to each other; lengths in mm, angles in rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Which wheel and rail.
    pub side: Side,
    /// Radius of the wheel where z of its profile is 0.
    pub rolling_radius: f64,
    /// Distance of the rails' gauge faces.
    pub gauge: f64,
    /// Depth below the top of the rail at which the gauge is measured.
    pub gauge_height: f64,
    /// Turn of the rail about its profile's origin, positive with its top toward the track centre.
    pub cant: f64,
    /// Distance of the backs of the two flanges.
    pub flange_back_distance: f64,
    /// y of the flange's back in the wheel's profile.
    pub flange_back_position: f64,
    /// Shift of the wheelset to the left.
    pub lateral_shift: f64,
    /// Yaw of the wheelset, positive from x to y.
    pub yaw: f64,
    /// Roll of the wheelset, positive from y to z.
    pub roll: f64,
}

/// A wheel and a rail in place, except for the height of the wheel.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelRail {
    /// Their placement.
    pub placement: Placement,
    rail_given: Arc<Profile>,
    /// The rail in track axes.
    rail: Arc<PlaneCurve>,
    wheel: Arc<Profile>,
    axes: AxleAxes,
    /// The rail's upper edge.
    pub(crate) rail_edge: Arc<Once<RailEdge>>,
    /// Circles of the wheel, which are the same for every place of the wheelset.
    pub(crate) circles: Arc<Once<Vec<WheelCircle>>>,
    /// The same pair with other smoothings, somewhere over the rail, which are the same for every place of the wheelset too.
    readings: Arc<OtherReadings>,
    /// Rail and wheel line by line, or why there are no lines.
    pub(crate) locus: Once<Arc<Result<LocusLines, String>>>,
}

/// Unit vectors of the wheelset in track axes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct AxleAxes {
    /// Along the axle, to the left.
    axle: [f64; 3],
    /// Length of the axle's part across the track.
    across: f64,
    /// At right angles to the axle: nearly forward, and nearly down (without a part along x).
    forward: [f64; 3],
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

/// Most readings of a pair that are kept. Keeps the memory small; it changes times, no answer.
const READINGS_MAX: usize = 4;

/// Pairs with other smoothings of rail and wheel in mm, the one asked for last at the end. They follow from the pair, so that two of them never make
/// pairs differ.
#[derive(Debug, Default)]
struct OtherReadings(Mutex<Vec<([f64; 2], WheelRail)>>);

impl PartialEq for OtherReadings {
    fn eq(&self, _: &OtherReadings) -> bool {
        true
    }
}

impl OtherReadings {
    fn find_or_make(&self, smoothing: [f64; 2], make: impl FnOnce() -> WheelRail) -> WheelRail {
        // A panic while it was held leaves the list as it is: only whole pairs are put there.
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match kept.iter().position(|(of, _)| *of == smoothing) {
            Some(place) => kept[place..].rotate_left(1),
            None => {
                if kept.len() == READINGS_MAX {
                    kept.remove(0);
                }
                kept.push((smoothing, make()));
            }
        }
        kept[kept.len() - 1].1.clone()
    }
}

/// A point of the wheel's meridian: position along the axle and radius, with their derivatives to the profile's parameter.
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

/// A circle of the wheel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WheelCircle {
    /// Parameter of the profile.
    pub(crate) s: f64,
    /// Distance from the centre along the axle, in mm.
    along: f64,
    /// Radius in mm.
    radius: f64,
    /// Change of the radius along the axle.
    widening: f64,
}

impl WheelRail {
    /// Places the rail by its gauge point and its top, the wheel by the wheelset.
    ///
    /// # Errors
    /// A sentence, if the wheel's profile reaches its axle or is all beyond it.
    pub fn new(rail: Profile, wheel: Profile, placement: Placement) -> Result<WheelRail, String> {
        let lowest = wheel
            .parameters(0.2)
            .into_iter()
            .map(|s| wheel.at(s).at[1])
            .fold(f64::NEG_INFINITY, f64::max);
        if lowest >= 0.9 * placement.rolling_radius {
            return Err(format!(
                "the wheel's profile reaches {lowest:.1} mm toward the axle of a wheel of {} mm radius",
                placement.rolling_radius
            ));
        }
        Ok(WheelRail::placed(rail, Arc::new(wheel), placement))
    }

    fn placed(rail: Profile, wheel: Arc<Profile>, placement: Placement) -> WheelRail {
        let canted = rail.curve().placed(placement.cant, [0.0; 2], 1.0);
        let places: Vec<[f64; 2]> = canted
            .parameters(0.05)
            .into_iter()
            .map(|s| canted.at(s).at)
            .collect();
        let top = places
            .iter()
            .map(|at| at[1])
            .fold(f64::NEG_INFINITY, f64::max);
        let gauge_point = nearest_above(&places, top - placement.gauge_height);
        let origin = [0.5 * placement.gauge - gauge_point, -top];
        let axes = AxleAxes::new(&placement);
        WheelRail {
            placement,
            rail: Arc::new(
                rail.curve()
                    .placed(placement.cant, origin, placement.side.sign()),
            ),
            rail_given: Arc::new(rail),
            wheel,
            axes,
            rail_edge: Arc::default(),
            circles: Arc::default(),
            readings: Arc::default(),
            locus: Once::default(),
        }
    }

    /// The same rail and wheel with the wheelset elsewhere: shift to the left in mm, yaw and roll in rad.
    #[must_use]
    pub fn posed(&self, lateral_shift: f64, yaw: f64, roll: f64) -> WheelRail {
        let placement = Placement {
            lateral_shift,
            yaw,
            roll,
            ..self.placement
        };
        WheelRail {
            axes: AxleAxes::new(&placement),
            placement,
            locus: Once::default(),
            ..self.clone()
        }
    }

    /// Moves the wheelset in place; what was found of the places of contact is forgotten.
    pub(crate) fn pose(&mut self, lateral_shift: f64, yaw: f64, roll: f64) {
        self.placement.lateral_shift = lateral_shift;
        self.placement.yaw = yaw;
        self.placement.roll = roll;
        self.axes = AxleAxes::new(&self.placement);
        self.locus = Once::default();
    }

    /// The profiles of rail (before cant) and wheel.
    #[must_use]
    pub fn profiles(&self) -> [&Profile; 2] {
        [&self.rail_given, &self.wheel]
    }

    /// The same with other smoothings of rail and wheel, in mm.
    #[must_use]
    pub fn smoothed(&self, smoothing: [f64; 2]) -> WheelRail {
        let Placement {
            lateral_shift,
            yaw,
            roll,
            ..
        } = self.placement;
        let reading = self.readings.find_or_make(smoothing, || {
            let rail = self.rail_given.smoothed(smoothing[0]);
            let wheel = Arc::new(self.wheel.smoothed(smoothing[1]));
            // What a wheel's profile may reach was checked; a smoothed one reaches hardly farther.
            WheelRail::placed(rail, wheel, self.placement)
        });
        reading.posed(lateral_shift, yaw, roll)
    }

    /// Unit vector along the axle, to the left.
    #[must_use]
    pub fn axle(&self) -> [f64; 3] {
        self.axes.axle
    }

    /// First and last parameter of the rail's and of the wheel's curve.
    #[must_use]
    pub fn ranges(&self) -> [[f64; 2]; 2] {
        [self.rail.range(), self.wheel.range()]
    }

    /// Parameters at most `step` apart along the rail and the wheel.
    #[must_use]
    pub fn parameters(&self, step: f64) -> [Vec<f64>; 2] {
        [self.rail.parameters(step), self.wheel.parameters(step)]
    }

    /// The rail's curve in track axes `[y, z]`, with derivatives to the parameter.
    #[must_use]
    pub fn rail_at(&self, s: f64) -> CurvePoint {
        self.rail.at(s)
    }

    /// The wheel's meridian at a parameter of its profile.
    #[must_use]
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

    /// The circle of the wheel at a parameter of its profile.
    pub(crate) fn circle(&self, s: f64) -> WheelCircle {
        let meridian = self.meridian(s);
        WheelCircle {
            s,
            along: meridian.along,
            radius: meridian.radius,
            widening: meridian.radius_slope / meridian.along_slope,
        }
    }

    /// The point of a wheel circle where the surface's normal has no part along x, relative to the wheel's centre but
    /// shifted sideways with it: where the circle meets a rail that is straight along x. None where the yaw hides it.
    #[must_use]
    pub fn lowest(&self, s: f64) -> Option<[f64; 3]> {
        self.lowest_of(&self.circle(s))
    }

    /// The same of a circle.
    pub(crate) fn lowest_of(&self, circle: &WheelCircle) -> Option<[f64; 3]> {
        let AxleAxes {
            axle,
            across,
            forward,
            down,
        } = &self.axes;
        let sin = circle.widening * (axle[0] / across);
        if sin.is_nan() || sin.abs() >= 1.0 {
            return None;
        }
        let cos = (1.0 - sin * sin).sqrt();
        let mut point = [0, 1, 2]
            .map(|k| circle.along * axle[k] + circle.radius * (cos * down[k] + sin * forward[k]));
        point[1] += self.placement.lateral_shift;
        Some(point)
    }

    /// The wheel's cross-section below its axle in track axes `[y, z]`, z from the height of the wheelset's centre.
    #[must_use]
    pub fn wheel_section(&self, s: f64) -> [f64; 2] {
        let circle = self.meridian(s);
        let at = |k: usize| circle.along * self.axes.axle[k] + circle.radius * self.axes.down[k];
        [at(1) + self.placement.lateral_shift, at(2)]
    }

    /// Position on the rail's profile as it was given (before cant): y to the field side, z down.
    #[must_use]
    pub fn on_rail(&self, s: f64) -> [f64; 2] {
        let [y, z] = self.rail_given.at(s).at;
        [y, -z]
    }

    /// Position on the wheel's profile: y to the field side, z down.
    #[must_use]
    pub fn on_wheel(&self, s: f64) -> [f64; 2] {
        let [y, z] = self.wheel.at(s).at;
        [y, -z]
    }

    /// Why there is no answer where a contact reaches the end of a profile, at these parameters of rail and wheel.
    pub(crate) fn cut_off(&self, [rail, wheel]: [f64; 2]) -> String {
        format!(
            "the contact reaches the end of a profile, at y = {:.2} mm on the rail and {:.2} mm on the wheel; the true contact is \
             cut off, longer profiles are needed",
            self.on_rail(rail)[0],
            self.on_wheel(wheel)[0]
        )
    }

    /// Remarks on the two profiles.
    #[must_use]
    pub fn remarks(&self) -> Vec<RemarkEntry> {
        let placed = |pointer: &'static str, profile: &Profile| {
            let remarks = profile.remarks.clone().into_iter();
            remarks.map(move |remark| remark.at_pointer(pointer))
        };
        placed("/contact/rail", &self.rail_given)
            .chain(placed("/contact/wheel", &self.wheel))
            .collect()
    }
}

/// Least y of a curve above a height, its crossings included.
fn nearest_above(places: &[[f64; 2]], height: f64) -> f64 {
    let above = places.iter().filter(|at| at[1] >= height);
    let crossings = places.windows(2).filter_map(|pair| {
        let [from, to] = [pair[0], pair[1]];
        let t = (height - from[1]) / (to[1] - from[1]);
        (0.0..1.0)
            .contains(&t)
            .then(|| from[0] + t * (to[0] - from[0]))
    });
    above
        .map(|at| at[0])
        .chain(crossings)
        .fold(f64::INFINITY, f64::min)
}
