//! One connected contact area, before anything is meshed.

/// What the normal problem says of one patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Normal force in N.
    pub normal_force: f64,
    /// Approach in mm, where it is known.
    pub approach: Option<f64>,
    /// Area in mm².
    pub area: f64,
    /// Largest pressure in MPa.
    pub pressure_max: f64,
    /// Semi-axes along and across rolling in mm, for ellipses.
    pub semi_axes: Option<[f64; 2]>,
    /// `[x_min, x_max, y_min, y_max]` in mm.
    pub extent: [f64; 4],
}
