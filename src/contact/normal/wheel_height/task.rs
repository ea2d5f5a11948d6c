//! A wheel over its rail, with what presses them together: what is asked of the search for its height.

use crate::contact::geometry::wheel_rail::WheelRail;
use crate::contact::half_space::bent_surface::Influence;

/// Bounds of the tolerance of the force, which is the target of the resultants' error. The contact is then scaled to the force as Hertz's
/// contacts scale; the error left is of second order for these, and at worst about a third of the tolerance in pressures and lengths.
/// Below the lower bound the forces of neighbouring heights differ by no more than those of different grids.
const FORCE_TOLERANCE: [f64; 2] = [5e-4, 5e-3];

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

/// How a wheel should come to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalPass {
    /// Of a vertical force the normal forces carry the part `1 / (1 + friction_share)`.
    pub friction_share: f64,
    /// How exactly.
    pub accuracy: Accuracy,
}

/// How exactly a force is to be carried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Accuracy {
    /// It may be missed by this part, by coarse gaps: a place to go on from.
    About(f64),
    /// As resultants with this error relative to μN need it; the contact is corrected to the force.
    For(f64),
}

/// Bounds of what coarse gaps of several patches may miss the force by, to be replaced by fine ones. At the lower bound 0.005 and 0.05 change
/// forces by 0.3 % and pressures by 0.04 % at most on the wheels of `cargo bench --bench calibrate profiles`, with as many iterations.
const NEAR: [f64; 2] = [0.02, 0.075];
/// The same as a multiple of the target: the next height misses the force by about a twentieth of what this one does (0.0002 to 0.002 after 0.01 to
/// 0.05, on wheels with two patches of `cargo bench --bench wheels -- rows`).
const NEAR_TARGETS: f64 = 15.0;

impl Accuracy {
    /// What coarse gaps of several patches may miss the force by, to be replaced by fine ones.
    pub(crate) fn near(self) -> f64 {
        let [low, high] = NEAR;
        match self {
            Accuracy::About(_) => low,
            Accuracy::For(target) => (NEAR_TARGETS * target).clamp(low, high),
        }
    }

    /// Part of the force that may be missed.
    pub(crate) fn tolerance(self) -> f64 {
        let [low, high] = FORCE_TOLERANCE;
        match self {
            Accuracy::About(part) => part,
            Accuracy::For(target) => target.clamp(low, high),
        }
    }
}
