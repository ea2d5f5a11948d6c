//! The members `material` and `thermal` of a case.

use railhead_macros::{Members, none_is_absent};
use serde::Serialize;
use utoipa::ToSchema;

use crate::case::words::object::{AllowedRange, Object};

/// Elastic constants: one set for both bodies, or one for each.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum Material {
    /// Both bodies are of the same material.
    Same(Elastic),
    /// Different materials, combined as in quasi-identical contact.
    Pair {
        /// The lower body (body 2, the rail).
        lower: Elastic,
        /// The upper body (body 1, the wheel).
        upper: Elastic,
    },
}

impl Material {
    /// Returns the constants of the lower and the upper body.
    pub fn bodies(&self) -> [&Elastic; 2] {
        match self {
            Material::Same(both) => [both; 2],
            Material::Pair { lower, upper } => [lower, upper],
        }
    }
}

/// Isotropic linear elasticity. Exactly one of the two moduli is given.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema, Members)]
#[members(faults_of_elastic)]
pub struct Elastic {
    /// Shear modulus G in MPa, more than 0.
    #[member(positive(1e12, "MPa"))]
    pub shear_modulus_mpa: Option<f64>,
    /// Young's modulus E in MPa, more than 0.
    #[member(positive(1e12, "MPa"))]
    pub young_modulus_mpa: Option<f64>,
    /// Poisson's ratio, 0 to 0.5.
    #[schema(minimum = 0.0, maximum = 0.5)]
    #[member(closed(0.0, 0.5, ""))]
    pub poisson_ratio: f64,
}

impl Elastic {
    /// Returns the shear modulus in MPa, as given or computed from Young's modulus.
    pub fn shear(&self) -> Option<f64> {
        let from_young = || Some(self.young_modulus_mpa? / (2.0 * (1.0 + self.poisson_ratio)));
        self.shear_modulus_mpa.or_else(from_young)
    }
}

/// Thermal constants: one set for both bodies, or one for each.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum Thermal {
    /// One set of constants for both bodies.
    Same(ThermalBodyWords),
    /// One set for each body.
    Pair {
        /// The lower body (body 2, the rail).
        lower: ThermalBodyWords,
        /// The upper body (body 1, the wheel).
        upper: ThermalBodyWords,
    },
}

impl Thermal {
    /// Returns the constants of the lower and the upper body.
    pub fn bodies(&self) -> [&ThermalBodyWords; 2] {
        match self {
            Thermal::Same(both) => [both; 2],
            Thermal::Pair { lower, upper } => [lower, upper],
        }
    }
}

/// Thermal constants of a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema, Members)]
#[schema(as = ThermalBody)]
pub struct ThermalBodyWords {
    /// Heat conductivity in W/(m K); steel has about 50.
    #[schema(exclusive_minimum = 0.0)]
    #[member(positive(1e6, "W/(m K)"))]
    pub conductivity_w_per_mk: f64,
    /// Density in kg/m³; steel has about 7850.
    #[schema(exclusive_minimum = 0.0)]
    #[member(positive(1e6, "kg/m³"))]
    pub density_kg_per_m3: f64,
    /// Specific heat in J/(kg K); steel has about 450.
    #[schema(exclusive_minimum = 0.0)]
    #[member(positive(1e6, "J/(kg K)"))]
    pub specific_heat_j_per_kgk: f64,
    /// Temperature before the contact in °C.
    #[schema(minimum = -273.15)]
    #[member(closed(-273.15, 1e5, "°C"))]
    pub bulk_c: f64,
}

/// Reads the required member `material` of a case.
pub(crate) fn read_material(case: &mut Object) -> Option<Material> {
    let mut block = case.child("material")?;
    Some(match one_or_pair(&mut block, Elastic::members)? {
        [Some(lower), Some(upper)] => Material::Pair { lower, upper },
        [both, _] => Material::Same(both?),
    })
}

/// Reads one set of constants for both bodies, or one for the lower and one for the upper body.
fn one_or_pair<T>(
    block: &mut Object,
    read: fn(&mut Object) -> Option<T>,
) -> Option<[Option<T>; 2]> {
    if !block.has("lower") && !block.has("upper") {
        return read(block).map(|both| [Some(both), None]);
    }
    block.only(&["lower", "upper"]);
    let [lower, upper] = ["lower", "upper"].map(|name| read(&mut block.child(name)?));
    Some([Some(lower?), Some(upper?)])
}

/// Refuses a material without a modulus or with two.
pub(crate) fn faults_of_elastic(block: &mut Object, _: Option<&Elastic>) -> Option<()> {
    let moduli = ["shear_modulus_mpa", "young_modulus_mpa"];
    let given = block.exactly_one(&moduli, |block| {
        let modulus = AllowedRange::positive(1e12, "MPa");
        let detail = format!("missing; {modulus} is needed, or young_modulus_mpa instead");
        block.fault("shear_modulus_mpa", detail);
    });
    given.map(|_| ())
}

/// Reads the member `thermal` of a case, which belongs to the output `temperature` and to friction that falls with temperature.
/// `wanted` is `None` if it is not known whether the case needs it.
///
/// Returns `None` if a fault was recorded.
pub(crate) fn read_thermal(case: &mut Object, wanted: Option<bool>) -> Option<Option<Thermal>> {
    if !case.has("thermal") {
        if wanted == Some(true) {
            let what = "an object with the thermal constants of the bodies";
            case.required("thermal", what)?;
        }
        return Some(None);
    }
    if wanted == Some(false) {
        let detail =
            "given without \"temperature\" among the outputs; add it there or leave this out";
        return case.refuse("thermal", detail);
    }
    let mut block = case.child("thermal")?;
    Some(Some(
        match one_or_pair(&mut block, ThermalBodyWords::members)? {
            [Some(lower), Some(upper)] => Thermal::Pair { lower, upper },
            [both, _] => Thermal::Same(both?),
        },
    ))
}
