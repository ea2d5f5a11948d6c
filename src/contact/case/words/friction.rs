//! Friction between the bodies, and what lies between them.

use railhead_macros::{Words, none_is_absent};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Coulomb friction: exactly one of `coefficient`, `law` (with `limit` and `terms`), `across`, `along` and `by_temperature`. `layer` and
/// `reduction` make the contact softer to tractions and may stand beside each of them.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Default, Serialize, ToSchema)]
pub struct Friction {
    /// Friction coefficient: 0 (frictionless), or 1e-12 to 100.
    #[schema(minimum = 0.0, maximum = 100.0)]
    pub coefficient: Option<f64>,
    /// How the coefficient falls with the speed of slip; every motion needs its `speed_mm_per_s`.
    pub law: Option<FallName>,
    /// The coefficient that is left at the highest speeds of slip, 0 to 100; with `law`.
    #[schema(minimum = 0.0, maximum = 100.0)]
    pub limit: Option<f64>,
    /// What falls: one or two terms; with `law`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false, min_items = 1, max_items = 2)]
    pub terms: Vec<FallTermWords>,
    /// A coefficient that varies across the contact.
    pub across: Option<AcrossWords>,
    /// A coefficient that varies along the track; the case needs a `history`, which rolls over it.
    pub along: Option<AlongWords>,
    /// A coefficient that falls with the temperature of the contact; the case needs `thermal` and every motion its `speed_mm_per_s`.
    pub by_temperature: Option<ByTemperatureWords>,
    /// A layer between the bodies, such as wet leaves, sand or oxides.
    pub layer: Option<LayerWords>,
    /// Kalker's reduction factor, more than 0 and at most 1: the initial slope of the creep curves is this part of that of clean bodies.
    #[schema(exclusive_minimum = 0.0, maximum = 1.0)]
    pub reduction: Option<f64>,
}

/// How a coefficient falls with the speed of slip v: with f₀ the `limit`, f₁, f₂ the `coefficient` and v₁, v₂ the
/// `half_speed_mm_per_s` of the terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema, Words)]
#[serde(rename_all = "snake_case")]
pub enum FallName {
    /// f₀ + f₁ exp(−ln 2 v/v₁) + f₂ exp(−ln 2 v/v₂). Polach's μ₀((1 − A) exp(−B v) + A) is f₀ = A μ₀, f₁ = (1 − A) μ₀, v₁ = ln 2/B.
    Exponential,
    /// f₀ + f₁/(1 + v/v₁) + f₂/(1 + (v/v₂)²).
    Rational,
    /// f₀ + f₁ max(0, 1 − v/(2 v₁)) + f₂ max(0, 1 − v/(2 v₂)).
    Linear,
}

/// A part of the coefficient that falls with the speed of slip.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = FallTerm)]
pub struct FallTermWords {
    /// Its value at rest, 0 to 100.
    #[schema(minimum = 0.0, maximum = 100.0)]
    pub coefficient: f64,
    /// Speed of slip in mm/s at which half of it is left, more than 0.
    #[schema(exclusive_minimum = 0.0)]
    pub half_speed_mm_per_s: f64,
}

/// A coefficient across the contact: linear between points, constant outside; two points at the same place are a jump. Exactly one of
/// `y_mm` and `angle_rad` says where the points are.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = FrictionAcross)]
pub struct AcrossWords {
    /// Places in mm, in order: y in the axes of the case; with `profiles` the y of the rail's profile.
    #[schema(min_items = 2, max_items = 1000)]
    pub y_mm: Option<Vec<f64>>,
    /// Inclinations of the rail's surface in rad, in order, positive as contact angles are; with `profiles` only.
    #[schema(min_items = 2, max_items = 1000)]
    pub angle_rad: Option<Vec<f64>>,
    /// The coefficient at each of them, 1e-12 to 100.
    #[schema(min_items = 2, max_items = 1000)]
    pub coefficient: Vec<f64>,
}

/// A coefficient along the track, on which it lies still while the contact rolls over it: linear between points, constant outside; two
/// points at the same place are a jump.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = FrictionAlong)]
pub struct AlongWords {
    /// Places in mm, in order: x in the axes of the case when the history begins. After a rolled distance q the contact's x = 0 stands at q.
    #[schema(min_items = 2, max_items = 1000)]
    pub x_mm: Vec<f64>,
    /// The coefficient at each of them, 1e-12 to 100.
    #[schema(min_items = 2, max_items = 1000)]
    pub coefficient: Vec<f64>,
}

/// A coefficient by the temperature of both surfaces in the contact: linear between points, constant outside. Friction heats the contact,
/// and every place has the coefficient of the temperature it reaches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = FrictionByTemperature)]
pub struct ByTemperatureWords {
    /// Temperatures in °C, rising.
    #[schema(min_items = 2, max_items = 1000)]
    pub temperature_c: Vec<f64>,
    /// The coefficient at each of them, 1e-12 to 100, never rising.
    #[schema(min_items = 2, max_items = 1000)]
    pub coefficient: Vec<f64>,
}

/// An elastic layer between the bodies, so thin that each of its points shears by itself: the surfaces move apart by
/// thickness/modulus times the traction, beside what the bodies give. With `yield_mpa` it transmits no more than that stress, which grows with
/// the plastic displacement of the layer.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = Layer)]
pub struct LayerWords {
    /// Shear modulus in MPa, more than 0.
    #[schema(exclusive_minimum = 0.0)]
    pub shear_modulus_mpa: f64,
    /// Thickness in mm, more than 0.
    #[schema(exclusive_minimum = 0.0)]
    pub thickness_mm: f64,
    /// Shear stress in MPa at which the layer yields, more than 0; left out, it never does.
    #[schema(exclusive_minimum = 0.0)]
    pub yield_mpa: Option<f64>,
    /// Growth of that stress in MPa per mm of plastic displacement, 0 or more; 0 when left out.
    #[schema(minimum = 0.0)]
    pub hardening_mpa_per_mm: Option<f64>,
}

impl Friction {
    /// The largest coefficient.
    #[must_use]
    pub fn largest(&self) -> f64 {
        let falling = |limit: f64| limit + self.terms.iter().map(|t| t.coefficient).sum::<f64>();
        let across = self.across.iter().flat_map(|across| &across.coefficient);
        let given = self.coefficient.or_else(|| self.limit.map(falling));
        let across = across.chain(self.along.iter().flat_map(|along| &along.coefficient));
        let across = across.chain(self.by_temperature.iter().flat_map(|law| &law.coefficient));
        across.fold(given.unwrap_or(0.0), |most, value| most.max(*value))
    }

    /// What the coefficient falls with, if it falls.
    #[must_use]
    pub fn falls_with(&self) -> Option<&'static str> {
        match (self.law, &self.by_temperature) {
            (Some(_), _) => Some("slip"),
            (None, Some(_)) => Some("temperature"),
            (None, None) => None,
        }
    }

    /// The coefficient, if that is all there is.
    #[must_use]
    pub fn constant(&self) -> Option<f64> {
        let softer = self.layer.is_some() || self.reduction.is_some();
        self.coefficient.filter(|_| !softer)
    }
}
