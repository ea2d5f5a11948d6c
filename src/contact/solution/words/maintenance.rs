//! What follows from a solved contact, as the client reads it: stresses below the surface, damage and temperatures.

use railhead_macros::none_is_absent;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::contact::case::words::subsurface::BodyName;

/// A stress tensor in the axes of the patch: x along rolling, y to the left, z up. Tension is positive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StressTensor {
    /// σ_xx in MPa.
    pub xx: f64,
    /// σ_yy in MPa.
    pub yy: f64,
    /// σ_zz in MPa.
    pub zz: f64,
    /// σ_xy in MPa.
    pub xy: f64,
    /// σ_xz in MPa.
    pub xz: f64,
    /// σ_yz in MPa.
    pub yz: f64,
}

/// The stress at one point below the surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StressPoint {
    /// Where: `[x, y, depth]` in mm, depth positive into the body.
    pub at_mm: [f64; 3],
    /// The stress tensor.
    pub stress_mpa: StressTensor,
    /// Von Mises' equivalent stress.
    pub von_mises_mpa: f64,
    /// Tresca's: the largest principal stress less the smallest.
    pub tresca_mpa: f64,
    /// Principal stresses from the largest to the smallest.
    pub principal_mpa: [f64; 3],
    /// Mean of the normal stresses.
    pub hydrostatic_mpa: f64,
    /// The largest shear stress, half of Tresca's.
    pub shear_max_mpa: f64,
    /// Normal of a plane that carries it; the plane of `shear_direction` carries it too.
    pub shear_plane_normal: [f64; 3],
    /// Direction of that shear stress in the plane.
    pub shear_direction: [f64; 3],
}

/// Summary of the stresses below a patch. `/subsurface` returns the stresses at the requested points.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SubsurfaceSummary {
    /// The body whose stresses these are.
    pub body: BodyName,
    /// Smallest depth in mm at which stresses are evaluated; closer to the surface, mesh steps would distort them. Shallower points are
    /// evaluated at this depth.
    pub least_depth_mm: f64,
    /// Where von Mises' stress is largest; absent unless it was asked for.
    pub worst: Option<StressPoint>,
    /// What a point of the body lives through while the contact rolls over it; absent unless it was asked for.
    pub passage: Option<PassageSummary>,
}

/// The worst places of a passage of the contact in steady rolling. A place is a line along x; stresses belong to all of its history.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PassageSummary {
    /// Where Dang Van's stress is largest; absent without a slope.
    pub dang_van: Option<PassagePlace>,
    /// Smallest yield stress in shear (von Mises) with which nothing yields although there is no residual stress.
    pub yield_without_residual: PassagePlace,
    /// Smallest yield stress in shear (von Mises) with which residual stresses can end yielding: the limit of elastic shakedown.
    pub yield_with_residual: PassagePlace,
}

/// A stress and the line along x that it belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PassagePlace {
    /// Where: `[y, depth]` in mm.
    pub at_mm: [f64; 2],
    /// The stress.
    pub stress_mpa: f64,
}

/// Temperatures of both surfaces in the contact in short; both bodies have one temperature there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TemperatureSummary {
    /// Highest temperature in °C.
    pub max_c: f64,
    /// Highest rise by friction in K.
    pub rise_max_k: f64,
    /// Where it is, `[x, y]` in mm.
    pub at_mm: [f64; 2],
    /// Temperature in the contact without friction, in °C: between those of the bodies.
    pub without_friction_c: f64,
    /// Share of the friction heat that flows into the lower body.
    pub heat_share_lower: f64,
    /// Smaller of the two bodies' Péclet numbers. The theory assumes that heat flows only into the depth, which holds for large
    /// values.
    pub peclet: f64,
}
