//! A wheel over its rail, with what presses them together.

use crate::contact::geometry::contact_locus::ContactLocus;
use crate::contact::geometry::wheel_rail::WheelRail;
use crate::contact::half_space::bent_surface::Influence;

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
    #[must_use]
    pub(crate) fn on_planes(&self) -> WheelTask {
        WheelTask {
            surface: ReferenceSurface::Planes,
            ..self.clone()
        }
    }

    /// Whether planes may answer in place of the curve.
    #[must_use]
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
