//! Lengths in mm in the units of heat and of wear.

/// m in a mm.
pub(crate) const METRES: f64 = 1e-3;
/// nm in a mm.
pub(crate) const NANOMETRES: f64 = 1e6;
