//! A wheel over its rail, a wheel at rest, and a wheelset over both rails.

use crate::geometry::contact_locus::ContactLocus;
use crate::geometry::reference_curve::{CurvePlace, WheelOver};
use crate::geometry::wheel_rail::WheelRail;
use crate::geometry::wheelset_pose::WheelsetMotion;
use crate::half_space::bent_surface::Influence;
use crate::normal::hertz::Patch;
use crate::normal::pressure_field::field::PressureField;
use crate::remark::entry::RemarkEntry;

/// The load of a wheel on its rail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WheelLoad {
    /// Vertical force in N.
    Vertical(f64),
    /// Sum of the normal forces of all patches in N.
    Normal(f64),
    /// Lowering of the wheel below first touch in mm.
    Lowering(f64),
}

/// A wheel over its rail with its load.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelTask {
    /// Wheel and rail in place.
    pub geometry: WheelRail,
    /// The load.
    pub loading: WheelLoad,
    /// Contact modulus `E* = G/(1−ν)` in MPa.
    pub contact_modulus: f64,
    /// Treatment of the profiles.
    pub trust: ProfileTrust,
    /// The surface on which the contact is solved.
    pub surface: ReferenceSurface,
}

/// The surface on which the contact of a wheel on a rail is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ReferenceSurface {
    /// A plane for each patch, or for patches near each other.
    #[default]
    Planes,
    /// The cross-section of the rail.
    Curve {
        /// How its strips act on each other.
        influence: Influence,
        /// Whether the case asks for it. Otherwise planes are the fallback.
        required: bool,
    },
}

impl WheelTask {
    /// Returns this task with other smoothing lengths of rail and wheel, in mm.
    #[must_use]
    pub fn smoothed(&self, smoothing: [f64; 2]) -> WheelTask {
        WheelTask {
            geometry: self.geometry.smoothed(smoothing),
            ..self.clone()
        }
    }

    /// The height in mm of the wheel's centre at which the bodies just touch, and the estimated lowering below it.
    ///
    /// # Errors
    /// See [`ContactLocus::new`].
    pub(crate) fn first_touch(&self) -> Result<[f64; 2], String> {
        let locus = ContactLocus::new(&self.geometry)?;
        let lowering = match self.loading {
            WheelLoad::Vertical(force) | WheelLoad::Normal(force) => {
                locus.estimated_lowering(force / self.contact_modulus)
            }
            WheelLoad::Lowering(lowering) => lowering,
        };
        Ok([locus.touch, lowering])
    }

    /// Returns this task with planes of contact instead of the curve.
    pub(crate) fn on_planes(&self) -> WheelTask {
        WheelTask {
            surface: ReferenceSurface::Planes,
            ..self.clone()
        }
    }

    /// Whether planes may replace the curve.
    pub(crate) fn may_fall_back(&self) -> bool {
        matches!(
            self.surface,
            ReferenceSurface::Curve {
                required: false,
                ..
            }
        )
    }
}

/// Treatment of the profiles as requested by the case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ProfileTrust {
    /// Whether the smoothing of rail and wheel follows from their noise.
    pub auto: [bool; 2],
    /// Whether profiles are accepted that are too rough or too coarse for a reliable result.
    pub accept_rough: bool,
}

/// A wheel at rest on its rail.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelContact {
    /// How far the wheel is below first touch, in mm.
    pub lowering: f64,
    /// Height of the wheel's centre over the top of the rail, in mm.
    pub centre: f64,
    /// The patches, from smaller to larger y of the track; never empty.
    pub patches: Vec<WheelPatch>,
    /// Remarks for the answer.
    pub remarks: Vec<RemarkEntry>,
}

/// A patch between a wheel and a rail.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelPatch {
    /// x of the load centre in mm.
    pub x: f64,
    /// The place of the load centre on the rail.
    pub place: CurvePlace,
    /// The undeformed wheel over the load centre.
    pub wheel: WheelOver,
    /// Parameters of rail and wheel at the lateral ends.
    pub ends: [[f64; 2]; 2],
    /// Region and pressure, with coordinates from the load centre, of this patch and of those solved together with it.
    pub field: PressureField,
    /// Number of the patch in the field.
    pub number: usize,
}

impl WheelPatch {
    /// Region and forces of the patch.
    pub fn patch(&self) -> Patch {
        self.field.patches()[self.number]
    }

    /// The normal force in N.
    pub fn normal_force(&self) -> f64 {
        self.patch().normal_force
    }
}

impl WheelContact {
    /// Sum of the normal forces in N.
    pub fn normal_force(&self) -> f64 {
        self.patches.iter().map(WheelPatch::normal_force).sum()
    }
}

/// A wheelset over both rails, in all requested positions.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelsetTask {
    /// The left and the right wheel over their rails, each with its vertical force in the first position without roll.
    pub sides: [WheelTask; 2],
    /// Shift to the left in mm and yaw in rad of every position; not empty.
    pub poses: Vec<[f64; 2]>,
    /// The motion of the wheelset in every position.
    pub moves: Vec<WheelsetMove>,
    /// The requested kinematics of the rigid wheelset.
    pub kinematics: Option<KinematicsTask>,
    /// Whether the right rail and wheel have their own cross-sections, to which remarks point.
    pub own_right: [bool; 2],
}

impl WheelsetTask {
    /// The pointer to a cross-section of the right side for that of a single wheel.
    pub fn pointer_on_right(&self, pointer: &str) -> String {
        for (own, name) in self.own_right.into_iter().zip(["rail", "wheel"]) {
            if own && let Some(rest) = pointer.strip_prefix(&format!("/contact/{name}")) {
                return format!("/contact/right/{name}{rest}");
            }
        }
        pointer.to_owned()
    }
}

/// The motion of a wheelset in a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelsetMove {
    /// The motion; the angular velocity is NaN where it has to be found.
    pub motion: WheelsetMotion,
    /// Torque about the axle in N mm that the rails balance, if it is prescribed.
    pub drive_torque: Option<f64>,
}

/// The shifts and amplitudes, in mm, of the kinematics of a wheelset.
#[derive(Debug, Clone, PartialEq)]
pub struct KinematicsTask {
    /// Largest shift to either side.
    pub reach: f64,
    /// Distance between shifts.
    pub step: f64,
    /// Amplitudes of the conicity.
    pub amplitudes: Vec<f64>,
}
