//! What is asked of a gap: the surfaces, and how hard they are pressed together.

use crate::contact::normal::gap::preview::PreviewCache;
use crate::contact::normal::gap::surface::GapSurface;
use crate::contact::normal::hertz::NormalLoad;

/// Two bodies with a gap between them, pressed together.
#[derive(Debug, Clone, PartialEq)]
pub struct GapTask {
    /// The gap of the undeformed bodies.
    pub gap: GapSurface,
    /// Force, or approach counted from gap = 0.
    pub loading: NormalLoad,
    /// Contact modulus `E* = G/(1−ν)` in MPa.
    pub contact_modulus: f64,
    /// First looks at the contact, kept once they were taken; starts empty.
    pub seen: PreviewCache,
}
