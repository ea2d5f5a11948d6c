//! Elastic and thermal constants of the bodies.

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

/// Thermal constants: one set for both bodies, or one for each.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
#[schema(as = Thermal)]
pub enum ThermalWords {
    /// Both bodies alike.
    Same(ThermalBodyWords),
    /// One set for each.
    Pair {
        /// The lower body (body 2, the rail).
        lower: ThermalBodyWords,
        /// The upper body (body 1, the wheel).
        upper: ThermalBodyWords,
    },
}

/// Thermal constants of a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[schema(as = ThermalBody)]
pub struct ThermalBodyWords {
    /// Heat conductivity in W/(m K); steel has about 50.
    #[schema(exclusive_minimum = 0.0)]
    pub conductivity_w_per_mk: f64,
    /// Density in kg/m³; steel has about 7850.
    #[schema(exclusive_minimum = 0.0)]
    pub density_kg_per_m3: f64,
    /// Specific heat in J/(kg K); steel has about 450.
    #[schema(exclusive_minimum = 0.0)]
    pub specific_heat_j_per_kgk: f64,
    /// Temperature before the contact in °C.
    #[schema(minimum = -273.15)]
    pub bulk_c: f64,
}
