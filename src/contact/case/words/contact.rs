//! The members `contact` and `load` of a case.

use railhead_macros::{Finite, Members, Words, keyword, none_is_absent};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use crate::case::words::cross_section::CrossSection;
use crate::case::words::motion::{Combine, Swept, swept};
use crate::case::words::object::{AllowedRange, Object, shown};
use crate::case::words::samples;
use crate::case::words::samples::COORDINATE;
use crate::geometry::wheel_rail::{Placement, RailPlace, Side};
use crate::half_space::bent_surface::Influence;

/// Where the bodies touch.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema, Members)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Contact {
    /// An elliptic patch by Hertz's theory, from relative radii of curvature.
    Radii {
        /// Relative radius in the rolling direction, in mm.
        #[member(positive(1e9, "mm"))]
        rolling_mm: f64,
        /// Relative radius across the rolling direction, in mm.
        #[member(positive(1e9, "mm"))]
        lateral_mm: f64,
    },
    /// An elliptic patch with Hertz's pressure.
    Ellipse {
        /// Semi-axis along the rolling direction, in mm.
        #[member(positive(1e6, "mm"))]
        a_mm: f64,
        /// Semi-axis across the rolling direction, in mm.
        #[member(positive(1e6, "mm"))]
        b_mm: f64,
    },
    /// A gap measured laterally between bodies that are circular along the rolling direction: `x²/(2 rolling_mm) + gap(y)`. The contact
    /// region and the pressure are computed.
    GapProfile {
        /// Relative radius in the rolling direction, in mm.
        #[member(positive(1e9, "mm"))]
        rolling_mm: f64,
        /// Strictly increasing coordinates along y, in mm.
        #[member(with = samples::axis)]
        y_mm: Vec<f64>,
        /// Distance of the undeformed surfaces at `y_mm` and x = 0, in mm; may include any constant offset.
        #[member(with = samples::gap_line)]
        gap_mm: Vec<f64>,
    },
    /// Any gap on a grid. The contact region and the pressure are computed; outside the grid there is no contact.
    GapGrid {
        /// Strictly increasing coordinates along the rolling direction, in mm.
        #[member(with = samples::axis)]
        x_mm: Vec<f64>,
        /// Strictly increasing coordinates along y, in mm.
        #[member(with = samples::axis)]
        y_mm: Vec<f64>,
        /// Distance of the undeformed surfaces in mm: `gap_mm[j][i]` at `(x_mm[i], y_mm[j])`; may include any constant offset.
        #[member(with = samples::gap_grid)]
        gap_mm: Vec<Vec<f64>>,
    },
    /// A given pressure on a grid; its positive part is the contact region, in one or several patches. Tractions do not change it; for
    /// bodies with different materials it must include their effect.
    PressureGrid {
        /// Strictly increasing coordinates along the rolling direction, in mm.
        #[member(with = samples::axis)]
        x_mm: Vec<f64>,
        /// Strictly increasing coordinates along y, in mm.
        #[member(with = samples::axis)]
        y_mm: Vec<f64>,
        /// `pressure_mpa[j][i]` at `(x_mm[i], y_mm[j])`, not negative, 0 outside the contact.
        #[member(with = samples::pressure_grid)]
        pressure_mpa: Vec<Vec<f64>>,
    },
    /// A wheel on a rail, given by their cross-sections. Every patch is found, and solved in its own frame.
    #[members(faults_of_pair)]
    Profiles {
        /// Cross-section of the rail.
        rail: Box<CrossSection>,
        /// Cross-section of the wheel.
        wheel: Box<CrossSection>,
        /// The side of the wheel in its wheelset, seen in the rolling direction.
        #[member(what = "left or right")]
        side: Side,
        /// Radius of the wheel at z = 0 of its cross-section, in mm.
        #[member(positive(1e5, "mm"))]
        rolling_radius_mm: f64,
        /// Distance between the gauge faces of the two rails, in mm; default 1435.
        #[member(whole = gauge)]
        gauge_mm: Option<f64>,
        /// Depth at which the gauge is measured, below the highest point of the rail as it lies, in mm; default 14.
        #[member(whole = gauge_height)]
        gauge_height_mm: Option<f64>,
        /// Distance of the origin of the rail's cross-section from the middle of the track, in mm; places the rail instead of the gauge.
        #[schema(minimum = 0.0)]
        #[member(closed(0.0, 1e5, "mm"))]
        rail_origin_mm: Option<f64>,
        /// Rotation of the rail about the origin of its cross-section, in rad, positive with its top toward the track centre; default 0.
        #[member(closed(-0.5, 0.5, "rad"), default)]
        cant_rad: f64,
        /// Distance between the backs of the two flanges, in mm; default 1360.
        #[member(closed(0.0, 1e5, "mm"), default = FLANGE_BACKS)]
        flange_back_distance_mm: f64,
        /// y of the back of the flange in the wheel's cross-section, in mm. Default: found from the points, or -70 if they agree with that
        /// or show no flange.
        #[member(closed(-1e3, 1e3, "mm"))]
        flange_back_position_mm: Option<f64>,
        /// Shift of the wheelset to the left, in mm; default 0.
        #[member(closed(-1e3, 1e3, "mm"), default)]
        lateral_shift_mm: f64,
        /// Yaw of the wheelset in rad, positive from x to y; default 0.
        #[member(closed(-0.3, 0.3, "rad"), default)]
        yaw_rad: f64,
        /// Roll of the wheelset in rad, positive from y to z; default 0.
        #[member(closed(-0.3, 0.3, "rad"), default)]
        roll_rad: f64,
        /// Solve even if the points of a profile are too coarse or rough for a reliable result, or if rail and wheel seem exchanged. If
        /// `false` (default), the job fails in these cases with the location of the fault.
        #[serde(skip_serializing_if = "is_false")]
        #[member(default)]
        accept_rough_profiles: bool,
        /// The surface on which the contact is solved. Default: the curve of the rail if possible, otherwise planes with the remark
        /// `on-planes`.
        reference_surface: Option<SurfaceName>,
        /// How cells of a curved surface act on each other; default `angle_corrected`. Not with `reference_surface: "plane"`.
        influence: Option<Influence>,
    },
    /// A wheelset on both rails of a track, given by their cross-sections. Its roll, its height and every patch of both wheels are
    /// computed.
    #[members(faults_of_pair, faults_of_poses)]
    Wheelset {
        /// Cross-section of both rails, or of the left one if `right` gives another.
        rail: Box<CrossSection>,
        /// Cross-section of both wheels, or of the left one if `right` gives another.
        wheel: Box<CrossSection>,
        /// Differences on the right; default none.
        right: Option<Box<RightSide>>,
        /// Radius of the wheels at z = 0 of their cross-section, in mm.
        #[member(positive(1e5, "mm"))]
        rolling_radius_mm: f64,
        /// Distance between the gauge faces of the two rails, in mm; default 1435.
        #[member(whole = gauge)]
        gauge_mm: Option<f64>,
        /// Depth at which the gauge is measured, below the highest point of the rail as it lies, in mm; default 14.
        #[member(whole = gauge_height)]
        gauge_height_mm: Option<f64>,
        /// Distance of the origin of the rail's cross-section from the middle of the track, in mm; places the rail instead of the gauge.
        #[schema(minimum = 0.0)]
        #[member(closed(0.0, 1e5, "mm"))]
        rail_origin_mm: Option<f64>,
        /// Rotation of each rail about the origin of its cross-section, in rad, positive with its top toward the track centre; default 0.
        #[member(closed(-0.5, 0.5, "rad"), default)]
        cant_rad: f64,
        /// Distance between the backs of the two flanges, in mm; default 1360.
        #[member(closed(0.0, 1e5, "mm"), default = FLANGE_BACKS)]
        flange_back_distance_mm: f64,
        /// y of the back of the flange in the wheels' cross-section, in mm. Default: found from the points of each wheel, or -70 if they
        /// agree with that or show no flange.
        #[member(closed(-1e3, 1e3, "mm"))]
        flange_back_position_mm: Option<f64>,
        /// Shift of the wheelset to the left, in mm: one number or several; default 0. Each shift with a yaw is a position with its own
        /// patches.
        #[member(with = swept, closed(-1e3, 1e3, "mm"), default = Swept::Constant(0.0))]
        lateral_shift_mm: Swept,
        /// Yaw of the wheelset in rad, positive from x to y: one number or several; default 0.
        #[member(with = swept, closed(-0.3, 0.3, "rad"), default = Swept::Constant(0.0))]
        yaw_rad: Swept,
        /// How several shifts and yaws form positions: `together` (default), or `grid`, in which the yaw varies fastest.
        #[member(default)]
        combine: Combine,
        /// Requests the difference of the rolling radii over the shift, and the equivalent conicity.
        kinematics: Option<KinematicsWords>,
        /// As in `profiles`.
        #[serde(skip_serializing_if = "is_false")]
        #[member(default)]
        accept_rough_profiles: bool,
        /// As in `profiles`.
        reference_surface: Option<SurfaceName>,
        /// As in `profiles`.
        influence: Option<Influence>,
    },
}

fn is_false(value: &bool) -> bool {
    !value
}

/// Differences on the right of a wheelset or of the track; at least one member is given.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema, Members)]
#[members(faults_of_right)]
pub struct RightSide {
    /// Cross-section of the right rail.
    pub rail: Option<Box<CrossSection>>,
    /// Cross-section of the right wheel.
    pub wheel: Option<Box<CrossSection>>,
    /// Radius of the right wheel at z = 0 of its cross-section, in mm.
    #[member(positive(1e5, "mm"))]
    pub rolling_radius_mm: Option<f64>,
}

/// Kinematics to compute for the rigid wheelset over a range of shifts, without yaw.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema, Members)]
#[members(faults_of_kinematics)]
pub struct KinematicsWords {
    /// Largest shift to either side, in mm; default 10.
    #[member(positive(50.0, "mm"), default = 10.0)]
    pub reach_mm: f64,
    /// Step between shifts, in mm; default 0.1.
    #[member(positive(5.0, "mm"), default = 0.1)]
    pub step_mm: f64,
    /// Amplitudes in mm for the equivalent conicity; default 1 to 7. Vehicle acceptance uses 3.
    #[member(with = amplitudes, 1..=100, default = (1..=7).map(f64::from).collect())]
    pub amplitudes_mm: Vec<f64>,
}

impl Contact {
    /// Whether cross-sections describe the contact.
    pub fn has_profiles(&self) -> bool {
        matches!(self, Contact::Profiles { .. } | Contact::Wheelset { .. })
    }

    /// Returns the wheel over its rail, for a wheelset that on the left without shift, yaw and roll; `None` for other contacts.
    pub(crate) fn on_rails(&self) -> Option<OnRails<'_>> {
        let (Contact::Profiles {
            rail,
            wheel,
            rolling_radius_mm,
            gauge_mm,
            gauge_height_mm,
            rail_origin_mm,
            cant_rad,
            flange_back_distance_mm,
            flange_back_position_mm,
            accept_rough_profiles,
            reference_surface,
            influence,
            ..
        }
        | Contact::Wheelset {
            rail,
            wheel,
            rolling_radius_mm,
            gauge_mm,
            gauge_height_mm,
            rail_origin_mm,
            cant_rad,
            flange_back_distance_mm,
            flange_back_position_mm,
            accept_rough_profiles,
            reference_surface,
            influence,
            ..
        }) = self
        else {
            return None;
        };
        let (side, [lateral_shift, yaw, roll]) = match *self {
            Contact::Profiles {
                side,
                lateral_shift_mm,
                yaw_rad,
                roll_rad,
                ..
            } => (side, [lateral_shift_mm, yaw_rad, roll_rad]),
            _ => (Side::Left, [0.0; 3]),
        };
        Some(OnRails {
            sections: [rail, wheel],
            pointers: ["/contact/rail", "/contact/wheel"],
            radius_pointer: "/contact/rolling_radius_mm",
            flange_back: *flange_back_position_mm,
            accept_rough: *accept_rough_profiles,
            placement: Placement {
                side,
                rolling_radius: *rolling_radius_mm,
                rail: match *rail_origin_mm {
                    Some(origin) => RailPlace::Origin(origin),
                    None => RailPlace::Gauge {
                        gauge: gauge_mm.unwrap_or(GAUGE),
                        height: gauge_height_mm.unwrap_or(GAUGE_HEIGHT),
                    },
                },
                cant: *cant_rad,
                flange_back_distance: *flange_back_distance_mm,
                flange_back_position: 0.0,
                lateral_shift,
                yaw,
                roll,
            },
            reference_surface: *reference_surface,
            influence: *influence,
        })
    }
}

/// The members of a case that describe a wheel over its rail.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OnRails<'a> {
    /// Cross-sections of rail and wheel.
    pub(crate) sections: [&'a CrossSection; 2],
    /// JSON pointers to them.
    pub(crate) pointers: [&'static str; 2],
    /// JSON pointer to the rolling radius.
    pub(crate) radius_pointer: &'static str,
    /// y of the back of the flange in mm, if the case states it.
    pub(crate) flange_back: Option<f64>,
    /// Whether rough or exchanged profiles are accepted.
    pub(crate) accept_rough: bool,
    /// The placement, in which the position of the back of the flange is still 0.
    pub(crate) placement: Placement,
    pub(crate) reference_surface: Option<SurfaceName>,
    pub(crate) influence: Option<Influence>,
}

/// The load that presses the bodies together: exactly one member, and `left_share` with `wheelset`.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct Load {
    /// Normal force in N, more than 0. For `profiles`: sum over all patches, each along its own normal.
    #[schema(exclusive_minimum = 0.0)]
    pub normal_force_n: Option<f64>,
    /// Vertical force of the wheel on the rail in N, more than 0; only for `profiles` and `wheelset`, which requires it: the force of both
    /// wheels.
    #[schema(exclusive_minimum = 0.0)]
    pub vertical_force_n: Option<f64>,
    /// Share of the vertical force that the left wheel carries; only for `wheelset`, default 0.5.
    #[schema(minimum = 0.01, maximum = 0.99)]
    pub left_share: Option<f64>,
    /// Approach of distant points in mm. For `radii` and `ellipse` it is measured from first touch and is more than 0. For gaps it is
    /// measured from gap = 0 of the data and is more than the smallest gap. For `profiles` it is the vertical displacement of the wheel
    /// below first touch.
    pub approach_mm: Option<f64>,
}

/// The surface on which the contact of a wheel on a rail is solved.
#[keyword(Words)]
#[schema(as = ReferenceSurface)]
pub enum SurfaceName {
    /// A plane of contact for each patch, or for patches near each other: for comparison.
    Plane,
    /// The cross-section of the rail: normals, slips and influences follow the bend of its surface, and all patches of a wheel are one problem. For
    /// bodies that do not differ.
    Curve,
}

/// Standard gauge in mm, the default.
pub(crate) const GAUGE: f64 = 1435.0;
/// Default depth in mm below the top of the rail at which the gauge is measured.
pub(crate) const GAUGE_HEIGHT: f64 = 14.0;
/// Default distance of the backs of the flanges in mm, that of standard gauge.
pub(crate) const FLANGE_BACKS: f64 = 1360.0;

/// The allowed normal and vertical forces.
pub(crate) const FORCE: AllowedRange = AllowedRange::positive(1e12, "N");
const APPROACH: AllowedRange = AllowedRange::positive(1e6, "mm");
const LEFT_SHARE: AllowedRange = AllowedRange::closed(0.01, 0.99, "");
/// Members of a load; the first is for cross-sections only.
const LOADS: [&str; 3] = ["vertical_force_n", "normal_force_n", "approach_mm"];

/// Maximum number of shifts to one side in the kinematics of a wheelset.
const SHIFTS_MAX: f64 = 1000.0;

/// Reads the required member `contact` of a case.
pub(crate) fn read(case: &mut Object) -> Option<Contact> {
    Contact::members(&mut case.child("contact")?)
}

/// Reads the member `load` of a case. The type of the contact decides whether it is required or refused; if the type is faulty, only the
/// members that are present are checked.
pub(crate) fn read_load(case: &mut Object) -> Option<Load> {
    let kind = case
        .value("contact")
        .and_then(|contact| contact.get("type"))
        .and_then(Value::as_str);
    match kind {
        Some("wheelset") => return load_of_wheelset(case),
        Some("pressure_grid") => {
            case.value("load")?;
            let detail =
                "given together with a pressure_grid, which carries its own load; leave it out";
            return case.refuse("load", detail);
        }
        _ => {}
    }
    let of_gap = matches!(kind, Some("gap_profile" | "gap_grid"));
    let of_profiles = kind == Some("profiles");
    if !case.has("load") && !of_gap && !of_profiles && !matches!(kind, Some("radii" | "ellipse")) {
        return None;
    }
    let mut block = case.child("load")?;
    let names = if of_profiles { &LOADS[..] } else { &LOADS[1..] };
    block.only_or(names, &LOADS[..1]);
    if !of_profiles && let Some(value) = block.value(LOADS[0]) {
        let value = shown(value);
        let detail = format!(
            "{value} given for another contact than \"type\": \"profiles\"; give normal_force_n instead"
        );
        return block.refuse(LOADS[0], detail);
    }
    let vertical_force_n = block.number("vertical_force_n", FORCE);
    let normal_force_n = block.number("normal_force_n", FORCE);
    let approach_mm = block.number("approach_mm", if of_gap { COORDINATE } else { APPROACH });
    let all = names.join(", ");
    match block.given(names)[..] {
        [] => return block.refuse_object(format!("empty; exactly one of {all} is needed")),
        [_] => {}
        [first, second, ..] => {
            let detail = format!("given together with {first}; exactly one of {all} is allowed");
            return block.refuse(second, detail);
        }
    }
    vertical_force_n.or(normal_force_n).or(approach_mm)?;
    Some(Load {
        normal_force_n,
        vertical_force_n,
        left_share: None,
        approach_mm,
    })
}

/// Reads the load of a wheelset: the vertical force of both wheels, and the share of the left one.
fn load_of_wheelset(case: &mut Object) -> Option<Load> {
    let what = "{\"vertical_force_n\": …}, the force of both wheels";
    case.required("load", what)?;
    let mut block = case.child("load")?;
    for name in &LOADS[1..] {
        if let Some(value) = block.value(name) {
            let detail = format!(
                "{} given for a wheelset; give vertical_force_n, the force of both wheels",
                shown(value)
            );
            return block.refuse(name, detail);
        }
    }
    block.only(&["vertical_force_n", "left_share"]);
    let vertical_force_n = block.required_number("vertical_force_n", FORCE);
    let left_share = block.optional("left_share", |block, name| block.number(name, LEFT_SHARE))?;
    Some(Load {
        vertical_force_n: Some(vertical_force_n?),
        left_share,
        ..Load::default()
    })
}

/// Refuses an influence on planes, and a rail that is placed by both its gauge and its origin.
pub(crate) fn faults_of_pair(block: &mut Object, _: Option<&Contact>) -> Option<()> {
    let mut sound = Some(());
    let plane = block.value("reference_surface") == Some(&Value::from("plane"));
    if plane && block.has("influence") {
        let detail = "given for planes of contact, which are half-spaces; leave it out, or give reference_surface: \"curve\"";
        sound = block.refuse("influence", detail);
    }
    let both = block.given(&["gauge_mm", "gauge_height_mm"]);
    if block.has("rail_origin_mm") && !both.is_empty() {
        let detail = format!(
            "given together with {}; give rail_origin_mm alone to place the rail by its origin, or gauge_mm and gauge_height_mm to \
             place it by its gauge face",
            both.join(" and ")
        );
        sound = block.refuse("rail_origin_mm", detail);
    }
    sound
}

/// Reads the gauge, unless the rail is placed by its origin.
pub(crate) fn gauge(block: &mut Object, name: &str) -> Option<Option<f64>> {
    by_gauge(block, name, AllowedRange::positive(1e5, "mm"), GAUGE)
}

/// Reads the depth at which the gauge is measured, unless the rail is placed by its origin.
pub(crate) fn gauge_height(block: &mut Object, name: &str) -> Option<Option<f64>> {
    let allowed = AllowedRange::closed(0.0, 100.0, "mm");
    by_gauge(block, name, allowed, GAUGE_HEIGHT)
}

fn by_gauge(
    block: &mut Object,
    name: &str,
    allowed: AllowedRange,
    usual: f64,
) -> Option<Option<f64>> {
    if block.has("rail_origin_mm") {
        return Some(None);
    }
    let given = block.optional(name, |block, name| block.number(name, allowed))?;
    Some(Some(given.unwrap_or(usual)))
}

/// Refuses shifts and yaws that are combined one by one and differ in their number.
pub(crate) fn faults_of_poses(block: &mut Object, read: Option<&Contact>) -> Option<()> {
    let Some(Contact::Wheelset {
        lateral_shift_mm,
        yaw_rad,
        combine: Combine::Together,
        ..
    }) = read
    else {
        return Some(());
    };
    let [a, b] = [lateral_shift_mm, yaw_rad].map(Swept::points);
    if a != b && a > 1 && b > 1 {
        let detail = format!(
            "{b} values given with {a} of lateral_shift_mm; values combined \"together\" need the same number, which \"combine\": \
             \"grid\" does not"
        );
        return block.refuse("yaw_rad", detail);
    }
    Some(())
}

/// Refuses a right side without a member.
pub(crate) fn faults_of_right(side: &mut Object, _: Option<&RightSide>) -> Option<()> {
    let members = ["rail", "wheel", "rolling_radius_mm"];
    if side.given(&members).is_empty() {
        let names = members.join(", ");
        return side.refuse_object(format!("empty; at least one of {names} is needed"));
    }
    Some(())
}

/// Refuses fewer than 2 or more than [`SHIFTS_MAX`] steps to either side.
pub(crate) fn faults_of_kinematics(
    asked: &mut Object,
    read: Option<&KinematicsWords>,
) -> Option<()> {
    let KinematicsWords {
        reach_mm, step_mm, ..
    } = read?;
    if !(2.0..=SHIFTS_MAX).contains(&(reach_mm / step_mm)) {
        let detail = format!(
            "{step_mm} given for a reach of {reach_mm} mm; 2 to {SHIFTS_MAX} steps to either side are allowed"
        );
        return asked.refuse("step_mm", detail);
    }
    Some(())
}

/// Reads the amplitudes of the equivalent conicity.
pub(crate) fn amplitudes(
    asked: &mut Object,
    name: &str,
    least: usize,
    most: usize,
) -> Option<Vec<f64>> {
    let what = format!("an array of {least} to {most} amplitudes in mm");
    let allowed = AllowedRange::positive(50.0, "mm");
    asked.number_array(name, least..=most, &what, allowed)
}
