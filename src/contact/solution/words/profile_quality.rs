//! The quality of the profiles as the client reads it.

use railhead_macros::none_is_absent;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// How far the points of both profiles can be trusted under a patch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PatchQuality {
    /// Of the rail.
    #[schema(inline = false)]
    pub rail: ProfileQuality,
    /// Of the wheel.
    #[schema(inline = false)]
    pub wheel: ProfileQuality,
}

/// What the points of a profile are like under a patch. Waviness and ambiguity are pressures, comparable with that of the patch: the
/// pressure that would flatten the difference between two interpolations of the same points.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ProfileQuality {
    /// The part of the profile under the patch, from and to y in mm (y to the field side, as `position` has it).
    pub y_mm: [f64; 2],
    /// Largest distance of neighbouring points under the patch in mm.
    pub spacing_mm: f64,
    /// The same over the width of the patch. If the points leave the curve ambiguous or are more than 10 mm apart, a value of at least 1
    /// adds a remark and a value of at least 1.5 fails the job.
    pub spacing_over_width: f64,
    /// Standard deviation of the noise of the points along the normal in µm; absent where they lie too far apart to tell.
    pub noise_um: Option<f64>,
    /// Root mean square of the pressure that flattens waves shorter than twice the smoothing or 3 mm, in MPa.
    pub waviness_mpa: f64,
    /// Root mean square of the pressure that flattens the difference of a spline and of Akima's curve through the points, in MPa; 0
    /// with a smoothing. The job fails if this reaches half of the largest pressure.
    pub ambiguity_mpa: f64,
    /// Length in mm of a stretch without points near the contact where the bodies may touch as well; absent if there is none.
    pub hole_mm: Option<f64>,
    /// Smoothing in use, in mm; 0 for none.
    pub smoothing_mm: f64,
    /// Smoothing that suits the noise, the spacing and the pressure, in mm; 0 where none is needed.
    pub smoothing_suggested_mm: f64,
}

/// What is known of a profile before its contact is.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct SectionQuality {
    /// Points in use.
    pub points: u32,
    /// Median distance of neighbouring points in mm.
    pub spacing_mm: f64,
    /// Largest distance of neighbouring points in mm.
    pub hole_mm: f64,
    /// Where that is, from and to y in mm.
    pub y_mm: [f64; 2],
    /// Standard deviation of the noise of the points along the normal in µm; absent where they lie too far apart to tell.
    pub noise_um: Option<f64>,
    /// Step in mm of which all heights are multiples, if it is 0.001 mm or more.
    pub rounding_mm: Option<f64>,
    /// Smoothing in use, in mm; 0 for none. That of `auto` is settled when the pressure is known.
    pub smoothing_mm: f64,
    /// Smoothing that suits the noise and the spacing at a pressure of 1200 MPa, in mm; 0 where none is needed.
    pub smoothing_suggested_mm: f64,
}

/// Both profiles before their contact is known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct PairQuality {
    /// Of the rail.
    #[schema(inline = false)]
    pub rail: SectionQuality,
    /// Of the wheel.
    #[schema(inline = false)]
    pub wheel: SectionQuality,
}

/// Absolute uncertainty due to the measurement of the profiles: how much the answer changes between plausible interpolations of the
/// points. Separate from `error_estimate`, which is numerical.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema)]
pub struct ProfileUncertainty {
    /// Of `force_x_n`, in N.
    pub force_x_n: f64,
    /// Of `force_y_n`, in N.
    pub force_y_n: f64,
    /// Of the largest pressure of the patch, in a total of the largest of all patches, in MPa.
    pub pressure_max_mpa: f64,
}
