//! Damage models: their functions, also of intervals, their parameters, and the damage of one pass over a patch.

use crate::case::words::subsurface::{
    ArchardFigures, DamageModel, DamageParameterWords, DamageSetName, DamageWords, UsfdFigures,
    WlrmFigures,
};
use crate::normal::hertz::Patch;
use crate::post::local_power::{CellPower, METRES, NANOMETRES, SolvedMotion};
use crate::solution::words::answer::PointSolution;
use crate::solution::words::damage::{
    ArchardWear, Damage, DamageFiguresUsed, RailFatigue, Ranged, ShakedownPlace, SurfaceFatigue,
    TGamma, UsfdWear, WearAcross, WearRegime,
};

/// Wear rate in µg per m rolled and mm² of contact, for a power per area `x` in N/mm².
pub fn usfd_rate(map: &UsfdFigures, x: f64) -> f64 {
    let severe = map.mild_slope * map.mild_until;
    let beyond = map.catastrophic_slope * (x - map.severe_until).max(0.0);
    (map.mild_slope * x).min(severe) + beyond
}

/// The regime of the wear map at a power per area.
pub fn usfd_regime(map: &UsfdFigures, x: f64) -> WearRegime {
    match x {
        x if x < map.mild_until => WearRegime::Mild,
        x if x < map.severe_until => WearRegime::Severe,
        _ => WearRegime::Catastrophic,
    }
}

/// Archard's regime and coefficient at a sliding speed in mm/s and a pressure over hardness. The value is the geometric mean of the range.
pub fn archard_coefficient(
    map: &ArchardFigures,
    speed: f64,
    pressure: f64,
) -> (WearRegime, Ranged) {
    let [slow, fast] = map.speeds_mm_per_s;
    let (regime, [low, high]) = if pressure > map.seizure_pressure {
        (WearRegime::Seizure, map.seizure)
    } else if speed >= slow && speed <= fast {
        (WearRegime::Severe, map.severe)
    } else {
        (WearRegime::Mild, map.mild)
    };
    let range = Ranged {
        value: (low * high).sqrt(),
        low: Some(low),
        high: Some(high),
    };
    (regime, range)
}

/// Damage of one pass by the Whole Life Rail Model at Tγ in N.
pub fn wlrm_damage(function: &WlrmFigures, t_gamma: f64) -> f64 {
    let WlrmFigures {
        threshold_n,
        peak_at_n,
        zero_at_n,
        peak,
    } = *function;
    if t_gamma <= threshold_n {
        0.0
    } else if t_gamma <= peak_at_n {
        peak * (t_gamma - threshold_n) / (peak_at_n - threshold_n)
    } else {
        peak * (zero_at_n - t_gamma) / (zero_at_n - peak_at_n)
    }
}

/// Applies a function to a number with an interval: its value, and its least and largest value over the interval. `turns` are the arguments at which
/// the function may have extrema.
pub fn over(x: Ranged, turns: &[f64], function: impl Fn(f64) -> f64) -> Ranged {
    let value = function(x.value);
    let (Some(low), Some(high)) = (x.low, x.high) else {
        return Ranged {
            value,
            low: None,
            high: None,
        };
    };
    let inside = turns
        .iter()
        .copied()
        .filter(|turn| *turn > low && *turn < high);
    let values = inside.chain([low, high]).map(function);
    let (least, largest) = values.fold((value, value), |(least, largest), value| {
        (least.min(value), largest.max(value))
    });
    Ranged {
        value,
        low: Some(least),
        high: Some(largest),
    }
}

/// A number with a symmetric error, cut at 0.
pub fn about(value: f64, error: Option<f64>) -> Ranged {
    Ranged {
        value,
        low: error.map(|error| (value - error).max(0.0)),
        high: error.map(|error| value + error),
    }
}

/// The product of two numbers that are not negative.
pub fn times(a: Ranged, b: Ranged) -> Ranged {
    let both = |a: Option<f64>, b: Option<f64>| Some(a? * b?);
    Ranged {
        value: a.value * b.value,
        low: both(a.low, b.low),
        high: both(a.high, b.high),
    }
}

/// Subsurface limit of elastic shakedown: largest pressure over yield stress in shear (Johnson 1985, chapter 9, for a line contact; less than for any
/// ellipse).
pub const SHAKEDOWN_LIMIT: f64 = 4.0;

/// Sources of the parameters of the named sets.
const SOURCES: [&str; 6] = [
    "usfd: Lewis and Olofsson 2004, Braghin et al. 2006 (wheel R8T on rail UIC 900A), slopes and limits as programs in use have them; without the step that published offsets leave at the second limit",
    "archard: Jendel 2002; not confirmed against the source",
    "wlrm: Burstow 2004; not confirmed against the source; other rail grades have other functions",
    "shear_yield_mpa: Ekberg, Kabo and Andersson 2002, cyclic; not confirmed against the source",
    "hardness_mpa: 260 HB, the least of the grade",
    "limits of shakedown: Johnson 1985, chapter 9: 4.0 for a line contact, less than for any ellipse, and 1 over the utilisation at the surface",
];

/// The requested damage.
#[derive(Debug, Clone, PartialEq)]
pub struct DamageTask {
    /// The models.
    pub models: Vec<DamageModel>,
    /// Whether wear is also computed strip by strip.
    pub across: bool,
    /// The parameters, as reported in the answer.
    pub figures: DamageFiguresUsed,
}

impl DamageTask {
    /// Makes the task from the members of a case.
    pub fn new(words: &DamageWords) -> DamageTask {
        let (named, own) = match &words.parameters {
            None => (DamageSetName::default(), None),
            Some(DamageParameterWords::Named(name)) => (*name, None),
            Some(DamageParameterWords::Own(own)) => (DamageSetName::default(), Some(&**own)),
        };
        let named = named_figures(named);
        let own = own.copied().unwrap_or_default();
        // The parameter was not confirmed, and the client did not replace it.
        let doubtful = |model: &DamageModel| match model {
            DamageModel::TGamma | DamageModel::UsfdWear => false,
            DamageModel::ArchardWear => own.archard.is_none(),
            DamageModel::Wlrm => own.wlrm.is_none(),
            DamageModel::SurfaceFatigueIndex | DamageModel::Shakedown => {
                own.shear_yield_mpa.is_none()
            }
        };
        DamageTask {
            models: words.models.clone(),
            across: words.across,
            figures: DamageFiguresUsed {
                density_kg_per_m3: own.density_kg_per_m3.unwrap_or(named.density_kg_per_m3),
                shear_yield_mpa: own.shear_yield_mpa.unwrap_or(named.shear_yield_mpa),
                hardness_mpa: own.hardness_mpa.unwrap_or(named.hardness_mpa),
                usfd: own.usfd.unwrap_or(named.usfd),
                archard: own.archard.unwrap_or(named.archard),
                wlrm: own.wlrm.unwrap_or(named.wlrm),
                unconfirmed: words.models.iter().copied().filter(doubtful).collect(),
                ..named
            },
        }
    }

    /// Returns whether a model is requested.
    pub fn wants(&self, model: DamageModel) -> bool {
        self.models.contains(&model)
    }
}

/// The parameters of a named set.
fn named_figures(set: DamageSetName) -> DamageFiguresUsed {
    match set {
        DamageSetName::Rail900aWheelR8t => DamageFiguresUsed {
            set,
            density_kg_per_m3: 7850.0,
            shear_yield_mpa: 300.0,
            hardness_mpa: 2550.0,
            usfd: UsfdFigures {
                mild_slope: 5.3,
                mild_until: 10.4,
                severe_until: 77.2,
                catastrophic_slope: 61.9,
            },
            archard: ArchardFigures {
                mild: [1e-4, 1e-3],
                severe: [3e-3, 4e-3],
                seizure: [3e-2, 4e-2],
                speeds_mm_per_s: [200.0, 700.0],
                seizure_pressure: 0.8,
            },
            wlrm: WlrmFigures {
                threshold_n: 15.0,
                peak_at_n: 65.0,
                zero_at_n: 175.0,
                peak: 1e-5,
            },
            unconfirmed: Vec::new(),
            sources: SOURCES.map(str::to_owned).into(),
        },
    }
}

/// A patch and its answer for one motion.
#[derive(Debug, Clone, Copy)]
pub struct DamagedPatch<'a> {
    /// The patch.
    pub patch: &'a Patch,
    /// Its answer.
    pub point: &'a PointSolution,
    /// Friction limit in N.
    pub limit: f64,
    /// Rolling speed in mm/s, if it is known.
    pub speed: Option<f64>,
}

/// The requested damage, without wear strip by strip.
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

/// Tγ with its errors: those of the forces times the creepages.
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

/// Area over width in mm: the mean length over which a point of the surface is in contact.
fn mean_length(patch: &Patch) -> f64 {
    patch.area / (patch.extent[3] - patch.extent[2])
}

fn usfd(figures: &DamageFiguresUsed, of: DamagedPatch, t_gamma: TGamma) -> UsfdWear {
    let x = t_gamma.over_area_n_per_mm2;
    let rate = over(x, &[], |x| usfd_rate(&figures.usfd, x));
    // kg/m³ are µg/mm³.
    let depth = mean_length(of.patch) * METRES / figures.density_kg_per_m3 * NANOMETRES;
    UsfdWear {
        regime: usfd_regime(&figures.usfd, x.value),
        rate_ug_per_m_mm2: rate,
        mass_ug_per_m: scaled(rate, of.patch.area),
        depth_nm: scaled(rate, depth),
    }
}

/// Archard's wear. The volume per length rolled is K ∬ p |s| dA/H, where p |s| is the power over μ.
fn archard(figures: &DamageFiguresUsed, of: DamagedPatch, t_gamma: TGamma) -> Option<ArchardWear> {
    let (patch, force) = (of.patch, of.patch.normal_force);
    if of.limit <= 0.0 {
        return None;
    }
    let slip = t_gamma.with_spin_n.value / of.limit;
    let sliding_speed_mm_per_s = slip * of.speed?;
    let pressure = force / patch.area / figures.hardness_mpa;
    let (regime, coefficient) =
        archard_coefficient(&figures.archard, sliding_speed_mm_per_s, pressure);
    let sliding = scaled(t_gamma.with_spin_n, force / of.limit / figures.hardness_mpa);
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

fn surface_fatigue(figures: &DamageFiguresUsed, of: DamagedPatch) -> SurfaceFatigue {
    let utilisation = utilisation(of);
    // The limit is 2π a b k/(3 N), with π a b replaced by the area.
    let limit = 2.0 * of.patch.area * figures.shear_yield_mpa / (3.0 * of.patch.normal_force);
    let traction = of.point.traction_max_mpa;
    SurfaceFatigue {
        utilisation,
        index: over(utilisation, &[], |utilisation| utilisation - limit),
        traction_excess_mpa: traction.map(|traction| traction - figures.shear_yield_mpa),
    }
}

fn shakedown(figures: &DamageFiguresUsed, of: DamagedPatch) -> ShakedownPlace {
    let utilisation = utilisation(of);
    let load_factor = of.patch.pressure_max / figures.shear_yield_mpa;
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

/// Wear of the strips of a patch. The segments of a strip are added up.
pub fn across(task: &DamageTask, of: SolvedMotion, cells: &CellPower, patch: usize) -> WearAcross {
    let figures = &task.figures;
    let mut found = WearAcross::default();
    let (mut usfd, mut archard): (Vec<[f64; 3]>, Vec<[f64; 3]>) = (Vec::new(), Vec::new());
    let mesh = &of.level.mesh;
    for strip in mesh.strips(patch) {
        let chord = &strip[0].chord;
        let mut t_gamma = 0.0;
        let mut depths = [[0.0; 3]; 2];
        for i in strip.iter().flat_map(|segment| segment.cells.clone()) {
            let length = mesh.right[i] - mesh.left[i];
            t_gamma += cells.power[i] / chord.dy;
            let over_area = cells.power[i] / of.level.area[i];
            let rate = usfd_rate(&figures.usfd, over_area);
            depths[0][regime(usfd_regime(&figures.usfd, over_area))] +=
                rate * length * METRES / figures.density_kg_per_m3 * NANOMETRES;
            let pressure = of.level.pressure[i] / figures.hardness_mpa;
            let slip = cells.slip[0][i].hypot(cells.slip[1][i]);
            let speed = slip * of.speed.unwrap_or(0.0);
            let (of_archard, coefficient) = archard_coefficient(&figures.archard, speed, pressure);
            depths[1][regime(of_archard)] +=
                coefficient.value * pressure * slip * length * NANOMETRES;
        }
        found.y_mm.push(chord.y);
        found.dy_mm.push(chord.dy);
        found.t_gamma_n_per_mm.push(t_gamma);
        usfd.push(depths[0]);
        archard.push(depths[1]);
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

/// Index of a regime: mild, severe, and catastrophic or seizure.
fn regime(regime: WearRegime) -> usize {
    match regime {
        WearRegime::Mild => 0,
        WearRegime::Severe => 1,
        WearRegime::Catastrophic | WearRegime::Seizure => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set() -> DamageFiguresUsed {
        named_figures(DamageSetName::default())
    }

    #[test]
    fn the_wear_map_has_its_three_regimes_and_no_steps() {
        for (x, rate) in [
            (0.0, 0.0),
            (2.0, 10.6),
            (10.4, 55.12),
            (50.0, 55.12),
            (77.2, 55.12),
        ] {
            assert!((usfd_rate(&set().usfd, x) - rate).abs() < 1e-12, "{x}");
        }
        // 61.9 x − 4723.56 beyond the second limit.
        assert!((usfd_rate(&set().usfd, 100.0) - (6190.0 - 4723.56)).abs() < 1e-9);
        let steps = (0..2000).map(|k| 0.05 * f64::from(k));
        for x in steps {
            assert!(
                usfd_rate(&set().usfd, x + 1e-9) - usfd_rate(&set().usfd, x) < 1e-6,
                "{x}"
            );
        }
    }

    #[test]
    fn the_damage_function_rises_peaks_and_goes_below_zero() {
        for (t_gamma, damage) in [(15.0, 0.0), (40.0, 5e-6), (65.0, 1e-5), (175.0, 0.0)] {
            assert!(
                (wlrm_damage(&set().wlrm, t_gamma) - damage).abs() < 1e-18,
                "{t_gamma}"
            );
        }
        // Slopes +2e-7 and −9.1e-8 per N.
        assert!((wlrm_damage(&set().wlrm, 16.0) - 2e-7).abs() < 1e-12);
        assert!((wlrm_damage(&set().wlrm, 176.0) + 9.0909e-8).abs() < 1e-11);
    }

    #[test]
    fn an_interval_over_the_peak_has_the_peak_as_its_largest() {
        let t_gamma = about(60.0, Some(20.0));
        let found = over(t_gamma, &[15.0, 65.0], |x| wlrm_damage(&set().wlrm, x));
        assert!((found.high.unwrap() - 1e-5).abs() < 1e-18);
        assert!((found.low.unwrap() - 5e-6).abs() < 1e-18);
        assert!((found.value - 9e-6).abs() < 1e-18);
    }
}
