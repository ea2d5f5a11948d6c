//! Figures of the damage models: the named sets, and what a client puts in their place.

use crate::contact::case::words::damage::{
    ArchardFigures, DamageModel, DamageParameterWords, DamageSetName, DamageWords, UsfdFigures,
    WlrmFigures,
};
use crate::contact::solution::words::damage::DamageFiguresUsed;

/// Subsurface limit of elastic shakedown, largest pressure over yield in shear (Johnson 1985, chapter 9, for a line contact, less than for
/// any ellipse).
pub const SHAKEDOWN_LIMIT: f64 = 4.0;

/// Where the figures of the named sets are from.
const SOURCES: [&str; 6] = [
    "usfd: Lewis and Olofsson 2004, Braghin et al. 2006 (wheel R8T on rail UIC 900A), slopes and limits as programs in use have them; without the step that published offsets leave at the second limit",
    "archard: Jendel 2002; not confirmed against the source",
    "wlrm: Burstow 2004; not confirmed against the source; other rail grades have other functions",
    "shear_yield_mpa: Ekberg, Kabo and Andersson 2002, cyclic; not confirmed against the source",
    "hardness_mpa: 260 HB, the least of the grade",
    "limits of shakedown: Johnson 1985, chapter 9: 4.0 for a line contact, less than for any ellipse, and 1 over the utilisation at the surface",
];

/// What is asked of the damage.
#[derive(Debug, Clone, PartialEq)]
pub struct DamageTask {
    /// The models.
    pub models: Vec<DamageModel>,
    /// Strip by strip too?
    pub across: bool,
    /// The figures.
    pub figures: DamageFigures,
}

impl DamageTask {
    /// The task that a case asks for.
    #[must_use]
    pub fn new(words: &DamageWords) -> DamageTask {
        DamageTask {
            models: words.models.clone(),
            across: words.across,
            figures: DamageFigures::new(words.parameters.as_ref()),
        }
    }

    /// Is this model asked for?
    #[must_use]
    pub fn wants(&self, model: DamageModel) -> bool {
        self.models.contains(&model)
    }

    /// The figures as they are answered.
    #[must_use]
    pub fn used(&self) -> DamageFiguresUsed {
        let figures = &self.figures;
        DamageFiguresUsed {
            set: figures.set,
            density_kg_per_m3: figures.density,
            shear_yield_mpa: figures.shear_yield,
            hardness_mpa: figures.hardness,
            usfd: figures.usfd,
            archard: figures.archard,
            wlrm: figures.wlrm,
            unconfirmed: self.unconfirmed(),
            sources: SOURCES.map(str::to_owned).into(),
        }
    }

    /// The models asked for whose figures are neither confirmed nor the client's.
    #[must_use]
    pub fn unconfirmed(&self) -> Vec<DamageModel> {
        let own = &self.figures.own;
        let doubtful = |model: &DamageModel| match model {
            DamageModel::TGamma | DamageModel::UsfdWear => false,
            DamageModel::ArchardWear => !own.archard,
            DamageModel::Wlrm => !own.wlrm,
            DamageModel::SurfaceFatigueIndex | DamageModel::Shakedown => !own.shear_yield,
        };
        self.models.iter().copied().filter(doubtful).collect()
    }
}

/// All figures, with where they are from.
#[derive(Debug, Clone, PartialEq)]
pub struct DamageFigures {
    /// The set that figures come from that are not the client's.
    pub set: DamageSetName,
    /// Density in kg/m³.
    pub density: f64,
    /// Yield in shear in MPa.
    pub shear_yield: f64,
    /// Hardness in MPa.
    pub hardness: f64,
    /// Wear map.
    pub usfd: UsfdFigures,
    /// Archard's coefficients.
    pub archard: ArchardFigures,
    /// Damage function.
    pub wlrm: WlrmFigures,
    /// Which are the client's.
    pub own: OwnFigures,
}

/// Which figures are the client's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct OwnFigures {
    /// Yield in shear.
    pub shear_yield: bool,
    /// Archard's coefficients.
    pub archard: bool,
    /// Damage function.
    pub wlrm: bool,
}

impl DamageFigures {
    fn new(words: Option<&DamageParameterWords>) -> DamageFigures {
        let named = DamageFigures::named(DamageSetName::default());
        match words {
            None => named,
            Some(DamageParameterWords::Named(name)) => DamageFigures::named(*name),
            Some(DamageParameterWords::Own(own)) => DamageFigures {
                set: named.set,
                density: own.density_kg_per_m3.unwrap_or(named.density),
                shear_yield: own.shear_yield_mpa.unwrap_or(named.shear_yield),
                hardness: own.hardness_mpa.unwrap_or(named.hardness),
                usfd: own.usfd.unwrap_or(named.usfd),
                archard: own.archard.unwrap_or(named.archard),
                wlrm: own.wlrm.unwrap_or(named.wlrm),
                own: OwnFigures {
                    shear_yield: own.shear_yield_mpa.is_some(),
                    archard: own.archard.is_some(),
                    wlrm: own.wlrm.is_some(),
                },
            },
        }
    }

    fn named(set: DamageSetName) -> DamageFigures {
        match set {
            DamageSetName::Rail900aWheelR8t => DamageFigures {
                set,
                density: 7850.0,
                shear_yield: 300.0,
                hardness: 2550.0,
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
                own: OwnFigures::default(),
            },
        }
    }
}
