//! Elastic constants of the bodies.

use railhead_macros::none_is_absent;
use serde::Serialize;
use utoipa::ToSchema;

/// Elastic constants: one set for both bodies, or one for each.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum Material {
    /// Both bodies are of the same material.
    Same(Elastic),
    /// The bodies differ; they are combined as in quasi-identical contact.
    Pair {
        /// The lower body (body 2, the rail).
        lower: Elastic,
        /// The upper body (body 1, the wheel).
        upper: Elastic,
    },
}

/// Isotropic linear elasticity. Exactly one of the two moduli is given.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct Elastic {
    /// Shear modulus G in MPa, more than 0.
    #[schema(exclusive_minimum = 0.0)]
    pub shear_modulus_mpa: Option<f64>,
    /// Young's modulus E in MPa, more than 0.
    #[schema(exclusive_minimum = 0.0)]
    pub young_modulus_mpa: Option<f64>,
    /// Poisson's ratio, 0 to 0.5.
    #[schema(minimum = 0.0, maximum = 0.5)]
    pub poisson_ratio: f64,
}
