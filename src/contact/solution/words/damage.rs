//! Damage of the surfaces and quality of the profiles in an answer.

use railhead_macros::{Finite, keyword, none_is_absent};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::case::words::subsurface::{
    ArchardFigures, DamageModel, DamageSetName, UsfdFigures, WlrmFigures,
};

/// A number and the interval that follows from the errors of its inputs; the interval is absent if these errors are not estimated.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct Ranged {
    /// The number.
    pub value: f64,
    /// Smallest value.
    pub low: Option<f64>,
    /// Largest value.
    pub high: Option<f64>,
}

/// Damage of one pass over one patch, by the requested models. Depths are for the body that the contact passes once.
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
    /// Position on the shakedown map.
    pub shakedown: Option<ShakedownPlace>,
    /// Wear per strip.
    pub across: Option<WearAcross>,
}

/// Friction power over rolling speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct TGamma {
    /// Tγ with spin: ν_x F_x + ν_y F_y + φ M_z in N.
    pub with_spin_n: Ranged,
    /// Tγ without spin: |ν_x F_x| + |ν_y F_y| in N.
    pub without_spin_n: Ranged,
    /// Tγ with spin divided by the area, in N/mm².
    pub over_area_n_per_mm2: Ranged,
}

/// A regime of wear.
#[keyword(Finite)]
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
    /// Wear rate in µg per m rolled and mm² of contact.
    pub rate_ug_per_m_mm2: Ranged,
    /// Worn mass per m rolled, in µg.
    pub mass_ug_per_m: Ranged,
    /// Wear depth of one pass in nm, averaged over the width of the patch.
    pub depth_nm: Ranged,
}

/// Wear by Archard's law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct ArchardWear {
    /// Wear regime at the mean sliding speed and the mean pressure.
    pub regime: WearRegime,
    /// Mean sliding speed in mm/s: Tγ divided by the friction limit, times the rolling speed.
    pub sliding_speed_mm_per_s: f64,
    /// Wear coefficient K.
    pub coefficient: Ranged,
    /// Volume per m rolled, in mm³.
    pub volume_mm3_per_m: Ranged,
    /// Wear depth of one pass in nm, averaged over the width of the patch.
    pub depth_nm: Ranged,
}

/// Rolling contact fatigue by the Whole Life Rail Model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct RailFatigue {
    /// Tγ without spin from which the damage follows, in N.
    pub t_gamma_n: Ranged,
    /// Damage of one pass: 1 is a visible crack; below 0, wear removes cracks.
    pub damage_per_pass: Ranged,
}

/// Surface fatigue index.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct SurfaceFatigue {
    /// Tangential force divided by normal force.
    pub utilisation: Ranged,
    /// Utilisation minus 2 A k/(3 N), with the area A, the yield stress in shear k and the normal force N; above 0, the surface ratchets.
    pub index: Ranged,
    /// Largest traction minus the yield stress in shear, in MPa; above 0, the surface ratchets there. Absent for methods without tractions.
    pub traction_excess_mpa: Option<f64>,
}

/// Position on the shakedown map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct ShakedownPlace {
    /// Tangential force divided by normal force.
    pub utilisation: Ranged,
    /// Largest pressure divided by the yield stress in shear.
    pub load_factor: f64,
    /// Load factor at the limit of shakedown: the subsurface limit, or 1 divided by the utilisation if that is less.
    pub limit: f64,
    /// Load factor divided by the limit: above 1, plastic strain accumulates with every pass.
    pub over_limit: Ranged,
    /// Whether `over_limit` is above 1.
    pub ratchets: bool,
}

/// Wear per strip, in order of increasing y.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct WearAcross {
    /// Middle of the strip in mm.
    pub y_mm: Vec<f64>,
    /// Width of the strip in mm.
    pub dy_mm: Vec<f64>,
    /// Friction power over rolling speed per width, in N/mm; its sum over the strips, times their widths, is Tγ with spin.
    pub t_gamma_n_per_mm: Vec<f64>,
    /// Wear depth of one pass by the wear map, in nm.
    pub usfd_depth_nm: Option<Vec<f64>>,
    /// Wear depth of one pass by Archard's law, in nm.
    pub archard_depth_nm: Option<Vec<f64>>,
    /// Parts of `usfd_depth_nm` from cells with mild, with severe and with catastrophic wear.
    pub usfd_regimes_nm: Option<Vec<[f64; 3]>>,
    /// Parts of `archard_depth_nm` from cells with mild wear, with severe wear and with seizure.
    pub archard_regimes_nm: Option<Vec<[f64; 3]>>,
}

/// The parameters that damage was computed with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct DamageFiguresUsed {
    /// Name of the set; the parameters under one name never change.
    pub set: DamageSetName,
    /// Density of the worn material in kg/m³.
    pub density_kg_per_m3: f64,
    /// Yield stress in shear in MPa.
    pub shear_yield_mpa: f64,
    /// Hardness in MPa.
    pub hardness_mpa: f64,
    /// The wear map.
    pub usfd: UsfdFigures,
    /// The map of Archard's coefficients.
    pub archard: ArchardFigures,
    /// The damage function.
    pub wlrm: WlrmFigures,
    /// Evaluated models whose parameters are neither confirmed against their sources nor given by the client.
    pub unconfirmed: Vec<DamageModel>,
    /// Sources of the parameters.
    pub sources: Vec<String>,
}

/// Quality of the points of both profiles under a patch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct PatchQuality {
    /// Quality of the rail's profile.
    pub rail: ProfileQuality,
    /// Quality of the wheel's profile.
    pub wheel: ProfileQuality,
}

/// Quality of the points of a profile under a patch. Waviness and ambiguity are pressures, comparable with that of the patch: the pressure
/// that would flatten the difference between two interpolations of the same points.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct ProfileQuality {
    /// The part of the profile under the patch: smallest and largest y in mm (y to the field side, as in `position`).
    pub y_mm: [f64; 2],
    /// Largest distance between neighbouring points under the patch in mm.
    pub spacing_mm: f64,
    /// `spacing_mm` divided by the width of the patch. If the points leave the curve ambiguous or are more than 10 mm apart, a value of at
    /// least 1 adds a remark and a value of at least 1.5 fails the job.
    pub spacing_over_width: f64,
    /// Standard deviation of the noise of the points along the normal in µm; absent if the points are too far apart.
    pub noise_um: Option<f64>,
    /// Root mean square of the pressure that flattens waves shorter than twice the smoothing or 3 mm, in MPa.
    pub waviness_mpa: f64,
    /// Root mean square of the pressure that flattens the difference between a spline and Akima's curve through the points, in MPa; 0 with
    /// smoothing. The job fails if this reaches half of the largest pressure.
    pub ambiguity_mpa: f64,
    /// Length in mm of a stretch without points near the contact in which the bodies may also touch; absent if there is none.
    pub hole_mm: Option<f64>,
    /// Smoothing in use, in mm; 0 for none.
    pub smoothing_mm: f64,
    /// Smoothing that suits the noise, the spacing and the pressure, in mm; 0 if none is needed.
    pub smoothing_suggested_mm: f64,
}

/// Quality of a profile before its contact is known.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct SectionQuality {
    /// Number of points in use.
    pub points: u32,
    /// Median distance between neighbouring points in mm.
    pub spacing_mm: f64,
    /// Largest distance between neighbouring points in mm.
    pub hole_mm: f64,
    /// Interval of y of this distance, in mm.
    pub y_mm: [f64; 2],
    /// Standard deviation of the noise of the points along the normal in µm; absent if the points are too far apart.
    pub noise_um: Option<f64>,
    /// Step in mm of which all heights are multiples, if it is 0.001 mm or more.
    pub rounding_mm: Option<f64>,
    /// Smoothing in use, in mm; 0 for none. That of `auto` is chosen when the pressure is known.
    pub smoothing_mm: f64,
    /// Smoothing that suits the noise and the spacing at a pressure of 1200 MPa, in mm; 0 if none is needed.
    pub smoothing_suggested_mm: f64,
}

/// Quality of both profiles before their contact is known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct PairQuality {
    /// Quality of the rail's profile.
    pub rail: SectionQuality,
    /// Quality of the wheel's profile.
    pub wheel: SectionQuality,
}

/// Absolute uncertainty due to the measurement of the profiles: how much the result changes between plausible interpolations of the points.
/// Separate from `error_estimate`, which is numerical.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct ProfileUncertainty {
    /// Uncertainty of `force_x_n` in N.
    pub force_x_n: f64,
    /// Uncertainty of `force_y_n` in N.
    pub force_y_n: f64,
    /// Uncertainty of the largest pressure of the patch, or of all patches in a total, in MPa.
    pub pressure_max_mpa: f64,
}
