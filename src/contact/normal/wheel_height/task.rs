//! A wheel over its rail, with what presses them together: what is asked of the search for its height.

use crate::contact::geometry::wheel_rail::WheelRail;

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
}

/// What a case says about the trust in its profiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ProfileTrust {
    /// The smoothing of rail and wheel follows from their noise.
    pub auto: [bool; 2],
    /// Profiles are solved that are too rough or too coarse for an answer that can be relied on.
    pub accept_rough: bool,
}
