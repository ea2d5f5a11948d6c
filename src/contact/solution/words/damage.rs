//! What a solved contact does to the surfaces, as the client reads it.
//!
//! The quality of the profiles as the client reads it.

use railhead_macros::{Finite, none_is_absent};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::contact::case::words::subsurface::{
    ArchardFigures, DamageModel, DamageSetName, UsfdFigures, WlrmFigures,
};

/// A number with the interval that the errors of its inputs leave; without an estimate of these there is none.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct Ranged {
    /// The number.
    pub value: f64,
    /// Least value.
    pub low: Option<f64>,
    /// Largest value.
    pub high: Option<f64>,
}

/// Damage of one pass over one patch: what the case asked for. Depths are of the body that is passed once.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
#[schema(as = DamageAnswer)]
pub struct Damage {
    /// Friction power over rolling speed.
    pub t_gamma: Option<TGamma>,
    /// Wear by the power per area.
    pub usfd_wear: Option<UsfdWear>,
    /// Wear by Archard's law.
    pub archard_wear: Option<ArchardWear>,
    /// Rolling contact fatigue by the Whole Life Rail Model.
    pub wlrm: Option<RailFatigue>,
    /// Surface fatigue index.
    pub surface_fatigue_index: Option<SurfaceFatigue>,
    /// Place on the shakedown map.
    pub shakedown: Option<ShakedownPlace>,
    /// Wear strip by strip.
    pub across: Option<WearAcross>,
}

/// Friction power over rolling speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct TGamma {
    /// ν_x F_x + ν_y F_y + φ M_z in N.
    pub with_spin_n: Ranged,
    /// |ν_x F_x| + |ν_y F_y| in N.
    pub without_spin_n: Ranged,
    /// With spin, over the area, in N/mm².
    pub over_area_n_per_mm2: Ranged,
}

/// A regime of wear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema, Finite)]
#[serde(rename_all = "snake_case")]
pub enum WearRegime {
    /// Mild.
    Mild,
    /// Severe.
    Severe,
    /// Catastrophic, of the wear map.
    Catastrophic,
    /// Seizure, of Archard's coefficients.
    Seizure,
}

/// Wear by the power per area.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct UsfdWear {
    /// Regime of the map.
    pub regime: WearRegime,
    /// Rate in µg per m rolled and mm² of contact.
    pub rate_ug_per_m_mm2: Ranged,
    /// Mass per m rolled, in µg.
    pub mass_ug_per_m: Ranged,
    /// Depth of one pass in nm, the mean over the width of the patch.
    pub depth_nm: Ranged,
}

/// Wear by Archard's law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct ArchardWear {
    /// Regime of the coefficients at the mean sliding speed and the mean pressure.
    pub regime: WearRegime,
    /// Mean sliding speed in mm/s: Tγ over the friction limit, times the rolling speed.
    pub sliding_speed_mm_per_s: f64,
    /// Coefficient K.
    pub coefficient: Ranged,
    /// Volume per m rolled, in mm³.
    pub volume_mm3_per_m: Ranged,
    /// Depth of one pass in nm, the mean over the width of the patch.
    pub depth_nm: Ranged,
}

/// Rolling contact fatigue by the Whole Life Rail Model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct RailFatigue {
    /// Tγ that the damage is taken at: without spin, in N.
    pub t_gamma_n: Ranged,
    /// Damage of one pass: 1 is a visible crack, below 0 wear removes cracks.
    pub damage_per_pass: Ranged,
}

/// Surface fatigue index.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct SurfaceFatigue {
    /// Tangential over normal force.
    pub utilisation: Ranged,
    /// Utilisation less 2 A k/(3 N), with the area A, the yield in shear k and the normal force N: above 0 the surface ratchets.
    pub index: Ranged,
    /// Largest traction less the yield in shear, in MPa: above 0 the surface ratchets there. Absent from methods without tractions.
    pub traction_excess_mpa: Option<f64>,
}

/// Place on the shakedown map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct ShakedownPlace {
    /// Tangential over normal force.
    pub utilisation: Ranged,
    /// Largest pressure over yield in shear.
    pub load_factor: f64,
    /// Load factor at the limit of shakedown: the subsurface limit, or 1 over the utilisation where that is less.
    pub limit: f64,
    /// Load factor over the limit: above 1 plastic strain goes on with every pass.
    pub over_limit: Ranged,
    /// Whether it is above 1.
    pub ratchets: bool,
}

/// Wear strip by strip, from smaller to larger y.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct WearAcross {
    /// Middle of the strip in mm.
    pub y_mm: Vec<f64>,
    /// Width of the strip in mm.
    pub dy_mm: Vec<f64>,
    /// Friction power over rolling speed per width, in N/mm; its sum over the strips, times their widths, is Tγ with spin.
    pub t_gamma_n_per_mm: Vec<f64>,
    /// Depth of one pass by the wear map, in nm.
    pub usfd_depth_nm: Option<Vec<f64>>,
    /// Depth of one pass by Archard's law, in nm.
    pub archard_depth_nm: Option<Vec<f64>>,
    /// Its parts from cells where wear is mild, severe, and catastrophic.
    pub usfd_regimes_nm: Option<Vec<[f64; 3]>>,
    /// The parts of Archard's depth from cells where wear is mild, severe, and seizure.
    pub archard_regimes_nm: Option<Vec<[f64; 3]>>,
}

/// The figures that damage was computed with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct DamageFiguresUsed {
    /// The named set; figures under one name never change.
    pub set: DamageSetName,
    /// Density in kg/m³.
    pub density_kg_per_m3: f64,
    /// Yield in shear in MPa.
    pub shear_yield_mpa: f64,
    /// Hardness in MPa.
    pub hardness_mpa: f64,
    /// The wear map.
    pub usfd: UsfdFigures,
    /// The map of Archard's coefficients.
    pub archard: ArchardFigures,
    /// The damage function.
    pub wlrm: WlrmFigures,
    /// Models that were evaluated with figures that are neither confirmed against their sources nor the client's.
    pub unconfirmed: Vec<DamageModel>,
    /// Where the figures of the set are from.
    pub sources: Vec<String>,
}

/// How far the points of both profiles can be trusted under a patch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
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
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct ProfileUncertainty {
    /// Of `force_x_n`, in N.
    pub force_x_n: f64,
    /// Of `force_y_n`, in N.
    pub force_y_n: f64,
    /// Of the largest pressure of the patch, in a total of the largest of all patches, in MPa.
    pub pressure_max_mpa: f64,
}
