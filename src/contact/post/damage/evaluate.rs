//! The damage of one pass over a patch, from its resultants alone.

use crate::contact::case::words::damage::DamageModel;
use crate::contact::normal::patch::Patch;
use crate::contact::post::damage::figures::{DamageFigures, DamageTask, SHAKEDOWN_LIMIT};
use crate::contact::post::damage::models::{
    about, archard_coefficient, over, times, usfd_rate, usfd_regime, wlrm_damage,
};
use crate::contact::post::heat::{METRES, NANOMETRES};
use crate::contact::rolling::strip_mesh::StripMesh;
use crate::contact::solution::words::answer::PointSolution;
use crate::contact::solution::words::damage::{
    ArchardWear, Damage, RailFatigue, Ranged, ShakedownPlace, SurfaceFatigue, TGamma, UsfdWear,
    WearAcross, WearRegime,
};

/// A patch and its answer for one motion.
#[derive(Debug, Clone, Copy)]
pub struct DamagedPatch<'a> {
    /// The patch.
    pub patch: &'a Patch,
    /// Its answer.
    pub point: &'a PointSolution,
    /// Friction limit in N.
    pub limit: f64,
    /// Rolling speed in mm/s, where it is known.
    pub speed: Option<f64>,
}

/// The damage that the task asks for, but for wear strip by strip.
#[must_use]
pub fn damage(task: &DamageTask, of: DamagedPatch) -> Damage {
    let (figures, wanted) = (&task.figures, |model| task.wants(model));
    let t_gamma = t_gamma(of);
    Damage {
        t_gamma: wanted(DamageModel::TGamma).then_some(t_gamma),
        usfd_wear: wanted(DamageModel::UsfdWear).then(|| usfd(figures, of, t_gamma)),
        archard_wear: wanted(DamageModel::ArchardWear)
            .then(|| archard(figures, of, t_gamma))
            .flatten(),
        wlrm: wanted(DamageModel::Wlrm).then(|| {
            let function = &figures.wlrm;
            let turns = [function.threshold_n, function.peak_at_n];
            let damage = |t_gamma| wlrm_damage(function, t_gamma);
            RailFatigue {
                t_gamma_n: t_gamma.without_spin_n,
                damage_per_pass: over(t_gamma.without_spin_n, &turns, damage),
            }
        }),
        surface_fatigue_index: wanted(DamageModel::SurfaceFatigueIndex)
            .then(|| surface_fatigue(figures, of)),
        shakedown: wanted(DamageModel::Shakedown).then(|| shakedown(figures, of)),
        across: None,
    }
}

/// The errors of the forces times the creepages.
fn t_gamma(of: DamagedPatch) -> TGamma {
    let (point, motion) = (of.point, &of.point.motion);
    let errors = point.error_estimate;
    let forces = errors.map(|error| {
        motion.creepage_x.abs() * error.force_x_n + motion.creepage_y.abs() * error.force_y_n
    });
    let moment = errors.map(|error| motion.spin_per_mm.abs() * error.moment_z_n_mm);
    let all = forces.zip(moment).map(|(forces, moment)| forces + moment);
    let with_spin_n = about(point.friction_power_n.max(0.0), all);
    TGamma {
        with_spin_n,
        without_spin_n: about(point.friction_power_without_spin_n, forces),
        over_area_n_per_mm2: scaled(with_spin_n, 1.0 / of.patch.area),
    }
}

fn scaled(x: Ranged, factor: f64) -> Ranged {
    over(x, &[], |x| x * factor)
}

/// Area over width in mm: the mean length that a point of the surface is in contact.
fn mean_length(patch: &Patch) -> f64 {
    patch.area / (patch.extent[3] - patch.extent[2])
}

fn usfd(figures: &DamageFigures, of: DamagedPatch, t_gamma: TGamma) -> UsfdWear {
    let x = t_gamma.over_area_n_per_mm2;
    let rate = over(x, &[], |x| usfd_rate(&figures.usfd, x));
    // kg/m³ are µg/mm³.
    let depth = mean_length(of.patch) * METRES / figures.density * NANOMETRES;
    UsfdWear {
        regime: usfd_regime(&figures.usfd, x.value),
        rate_ug_per_m_mm2: rate,
        mass_ug_per_m: scaled(rate, of.patch.area),
        depth_nm: scaled(rate, depth),
    }
}

/// Volume per length rolled: K ∬ p |s| dA/H, where p |s| is the power over μ.
fn archard(figures: &DamageFigures, of: DamagedPatch, t_gamma: TGamma) -> Option<ArchardWear> {
    let (patch, force) = (of.patch, of.patch.normal_force);
    if of.limit <= 0.0 {
        return None;
    }
    let slip = t_gamma.with_spin_n.value / of.limit;
    let sliding_speed_mm_per_s = slip * of.speed?;
    let pressure = force / patch.area / figures.hardness;
    let (regime, coefficient) =
        archard_coefficient(&figures.archard, sliding_speed_mm_per_s, pressure);
    let sliding = scaled(t_gamma.with_spin_n, force / of.limit / figures.hardness);
    // mm³ per mm rolled.
    let volume = times(coefficient, sliding);
    let width = patch.extent[3] - patch.extent[2];
    Some(ArchardWear {
        regime,
        sliding_speed_mm_per_s,
        coefficient,
        volume_mm3_per_m: scaled(volume, 1.0 / METRES),
        depth_nm: scaled(volume, NANOMETRES / width),
    })
}

/// Tangential over normal force, with the errors of the forces.
fn utilisation(of: DamagedPatch) -> Ranged {
    let (point, force) = (of.point, of.patch.normal_force);
    let error = point
        .error_estimate
        .map(|error| error.force_x_n.hypot(error.force_y_n) / force);
    about(point.force_x_n.hypot(point.force_y_n) / force, error)
}

fn surface_fatigue(figures: &DamageFigures, of: DamagedPatch) -> SurfaceFatigue {
    let utilisation = utilisation(of);
    // 2π a b k/(3 N), with the area in the place of π a b.
    let limit = 2.0 * of.patch.area * figures.shear_yield / (3.0 * of.patch.normal_force);
    let traction = of.point.traction_max_mpa;
    SurfaceFatigue {
        utilisation,
        index: over(utilisation, &[], |utilisation| utilisation - limit),
        traction_excess_mpa: traction.map(|traction| traction - figures.shear_yield),
    }
}

fn shakedown(figures: &DamageFigures, of: DamagedPatch) -> ShakedownPlace {
    let utilisation = utilisation(of);
    let load_factor = of.patch.pressure_max / figures.shear_yield;
    let limit = |utilisation: f64| SHAKEDOWN_LIMIT.min(1.0 / utilisation.max(f64::MIN_POSITIVE));
    let over_limit = over(utilisation, &[], |utilisation| {
        load_factor / limit(utilisation)
    });
    ShakedownPlace {
        utilisation,
        load_factor,
        limit: limit(utilisation.value),
        over_limit,
        ratchets: over_limit.value > 1.0,
    }
}

/// The power of every cell over the rolling speed in N, and the size of its slip.
#[derive(Debug, Clone, Copy)]
pub struct CellWear<'a> {
    /// The level.
    pub level: &'a StripMesh,
    /// Tractions times slips and areas, in N.
    pub power: &'a [f64],
    /// Slips over the rolling speed.
    pub slip: &'a [f64],
    /// Rolling speed in mm/s, where it is known.
    pub speed: Option<f64>,
}

/// Wear of the strips of a patch. Segments of one strip are added up.
#[must_use]
pub fn across(task: &DamageTask, of: CellWear, patch: usize) -> WearAcross {
    let figures = &task.figures;
    let mut found = WearAcross::default();
    let (mut usfd, mut archard): (Vec<[f64; 3]>, Vec<[f64; 3]>) = (Vec::new(), Vec::new());
    let mut last = None;
    let mesh = &of.level.mesh;
    for segment in mesh.segments.iter().filter(|s| s.chord.patch == patch) {
        let chord = &segment.chord;
        if last != Some(chord.strip) {
            found.y_mm.push(chord.y);
            found.dy_mm.push(chord.dy);
            found.t_gamma_n_per_mm.push(0.0);
            usfd.push([0.0; 3]);
            archard.push([0.0; 3]);
            last = Some(chord.strip);
        }
        let place = found.y_mm.len() - 1;
        for i in segment.cells.clone() {
            let length = mesh.right[i] - mesh.left[i];
            found.t_gamma_n_per_mm[place] += of.power[i] / chord.dy;
            let over_area = of.power[i] / of.level.area[i];
            let rate = usfd_rate(&figures.usfd, over_area);
            usfd[place][regime(usfd_regime(&figures.usfd, over_area))] +=
                rate * length * METRES / figures.density * NANOMETRES;
            let pressure = of.level.pressure[i] / figures.hardness;
            let speed = of.slip[i] * of.speed.unwrap_or(0.0);
            let (of_archard, coefficient) = archard_coefficient(&figures.archard, speed, pressure);
            archard[place][regime(of_archard)] +=
                coefficient.value * pressure * of.slip[i] * length * NANOMETRES;
        }
    }
    let sums = |parts: &[[f64; 3]]| parts.iter().map(|parts| parts.iter().sum()).collect();
    if task.wants(DamageModel::UsfdWear) {
        found.usfd_depth_nm = Some(sums(&usfd));
        found.usfd_regimes_nm = Some(usfd);
    }
    if task.wants(DamageModel::ArchardWear) {
        found.archard_depth_nm = Some(sums(&archard));
        found.archard_regimes_nm = Some(archard);
    }
    found
}

/// Place of a regime among mild, severe, and catastrophic or seizure.
fn regime(regime: WearRegime) -> usize {
    match regime {
        WearRegime::Mild => 0,
        WearRegime::Severe => 1,
        WearRegime::Catastrophic | WearRegime::Seizure => 2,
    }
}
