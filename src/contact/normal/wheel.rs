//! A wheel over its rail, with what presses them together.
//!
//! A wheel at rest on its rail.
//!
//! A wheelset over both rails, with what presses it down and what is asked of it.

use crate::geometry::contact_locus::ContactLocus;
use crate::geometry::reference_curve::{CurvePlace, WheelOver};
use crate::geometry::wheel_rail::WheelRail;
use crate::geometry::wheelset_pose::WheelsetMotion;
use crate::half_space::bent_surface::Influence;
use crate::normal::hertz::Patch;
use crate::normal::pressure_field::field::PressureField;
use crate::remark::entry::RemarkEntry;

/// What presses the wheel on the rail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WheelLoad {
    /// Vertical force in N.
    Vertical(f64),
    /// Sum of the normal forces of all patches in N.
    Normal(f64),
    /// The wheel is lowered by so many mm below first touch.
    Lowering(f64),
}

/// A wheel over its rail, and what presses them together.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelTask {
    /// Wheel and rail in place.
    pub geometry: WheelRail,
    /// The load.
    pub loading: WheelLoad,
    /// Contact modulus `E* = G/(1−ν)` in MPa.
    pub contact_modulus: f64,
    /// What the case says about the trust in the profiles.
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

    /// The height in mm of the wheel's centre at which the bodies just touch, and about how far below it the wheel comes to rest.
    ///
    /// # Errors
    /// As [`ContactLocus::new`].
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

    /// This task with planes of contact in place of the curve.
    pub(crate) fn on_planes(&self) -> WheelTask {
        WheelTask {
            surface: ReferenceSurface::Planes,
            ..self.clone()
        }
    }

    /// Whether planes may answer in place of the curve.
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

/// What a case says about the trust in its profiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ProfileTrust {
    /// The smoothing of rail and wheel follows from their noise.
    pub auto: [bool; 2],
    /// Profiles are solved that are too rough or too coarse for an answer that can be relied on.
    pub accept_rough: bool,
}

/// The wheel at rest on its rail.
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
    /// Parameters of rail and wheel at the ends across.
    pub ends: [[f64; 2]; 2],
    /// Region and pressure from the load centre, of this patch and of those that are solved together with it.
    pub field: PressureField,
    /// Number of the patch in the field.
    pub number: usize,
}

impl WheelPatch {
    /// Its region and forces.
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

/// A wheelset over both rails, in all positions that are asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelsetTask {
    /// The left and the right wheel over their rails, each with the vertical force it carries, in the first position without roll.
    pub sides: [WheelTask; 2],
    /// Shift to the left in mm and yaw in rad of every position; never empty.
    pub poses: Vec<[f64; 2]>,
    /// How the wheelset moves in every position.
    pub moves: Vec<WheelsetMove>,
    /// What is asked of the rigid wheelset.
    pub kinematics: Option<KinematicsTask>,
    /// Whether the right rail and wheel have cross-sections of their own, to which remarks are to point.
    pub own_right: [bool; 2],
}

impl WheelsetTask {
    /// The pointer to a cross-section of the right side, from what it would be for a single wheel.
    pub fn pointer_on_right(&self, pointer: &str) -> String {
        for (own, name) in self.own_right.into_iter().zip(["rail", "wheel"]) {
            if own && let Some(rest) = pointer.strip_prefix(&format!("/contact/{name}")) {
                return format!("/contact/right/{name}{rest}");
            }
        }
        pointer.to_owned()
    }
}

/// How a wheelset moves in a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelsetMove {
    /// Its motion; the angular velocity is NaN where it has to be found.
    pub motion: WheelsetMotion,
    /// Torque about the axle in N mm that the rails are to balance.
    pub drive_torque: Option<f64>,
}

/// Shifts and amplitudes, in mm.
#[derive(Debug, Clone, PartialEq)]
pub struct KinematicsTask {
    /// Largest shift to either side.
    pub reach: f64,
    /// Distance of the shifts.
    pub step: f64,
    /// Amplitudes of the conicity.
    pub amplitudes: Vec<f64>,
}
