//! What the bodies do with heat.

use serde::Serialize;
use utoipa::ToSchema;

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
