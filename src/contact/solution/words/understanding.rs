//! What a case was understood as before anything is solved: what is known of its patches, and where wheel and rail lie.

use serde::Serialize;
use utoipa::ToSchema;

/// What a case was understood as, without solving it.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Understanding {
    /// The patches, where they are known beforehand: of `radii` and `ellipse` by Hertz's formulas, of `pressure_grid` from the grid.
    /// Empty where they have to be found.
    pub patches: Vec<KnownPatch>,
    /// Friction coefficient times normal force in N, which no tangential force can exceed; absent where the normal force has to be
    /// found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction_limit_n: Option<f64>,
    /// Where wheel and rail lie; only for `profiles`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub placement: Option<PlacedProfiles>,
}

/// A patch that is known before anything is solved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct KnownPatch {
    /// Normal force in N.
    pub normal_force_n: f64,
    /// Approach of distant points in mm; absent where the pressure was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub approach_mm: Option<f64>,
    /// Contact area in mm².
    pub area_mm2: f64,
    /// Largest pressure in MPa.
    pub pressure_max_mpa: f64,
    /// Semi-axes along and across rolling in mm; only for elliptic patches.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub semi_axes_mm: Option<[f64; 2]>,
    /// Extent of the patch `[x_min, x_max, y_min, y_max]` in mm.
    pub extent_mm: [f64; 4],
}

/// Cross-sections of rail and wheel in track axes, `[y, z]` in mm: y to the left from the middle of the track, z up from the top of
/// the rail. Both are read, turned, shifted and smoothed as for the solution; coordinates are rounded to 0.0001 mm.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct PlacedProfiles {
    /// The rail.
    pub rail_mm: Vec<[f64; 2]>,
    /// The wheel at the height of first touch, as it meets a rail that is straight along x: of the circle on which a point of the profile
    /// runs, the place where the surface has no slope along x, else the place below the axle. Without yaw this is the cut through the axle.
    pub wheel_mm: Vec<[f64; 2]>,
    /// Where the wheel touches first when it is lowered onto the rail.
    pub first_touch: FirstTouch,
    /// About how far the wheel comes to rest below first touch, in mm; the result has the computed `wheel_lowering_mm`.
    pub lowering_estimate_mm: f64,
}

/// The point of first touch of a wheel on a rail.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct FirstTouch {
    /// In track axes, `[x, y, z]` in mm; x differs from 0 where the wheelset is yawed.
    pub track_mm: [f64; 3],
    /// On the rail's cross-section, `[y, z]` in mm, y to the field side and z down.
    pub rail_mm: [f64; 2],
    /// On the wheel's cross-section, likewise.
    pub wheel_mm: [f64; 2],
    /// Inclination of the surfaces there in rad, as `contact_angle_rad` of a patch.
    pub contact_angle_rad: f64,
}

/// How a time was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FoundBy {
    /// The case was solved.
    Solve,
    /// The case was solved up to an error, with which a job would end as well.
    FailedSolve,
    /// The solve had begun when the time ran out.
    PartOfSolve,
    /// Nothing was solved.
    Formulas,
}
