//! What is asked of a gap: the surfaces, and how hard they are pressed together.

use crate::contact::normal::gap::surface::Gap;
use crate::contact::normal::hertz::Pressing;

/// Two bodies with a gap between them, pressed together.
#[derive(Debug, Clone, PartialEq)]
pub struct GapContact {
    /// The gap of the undeformed bodies.
    pub gap: Gap,
    /// Force, or approach counted from gap = 0.
    pub pressing: Pressing,
    /// Contact modulus `E* = G/(1−ν)` in MPa.
    pub contact_modulus: f64,
}
