//! What a case asks for beyond its contact: stresses below the surface, damage, temperatures.

use crate::contact::case::motions::ExpandedMotions;
use crate::contact::case::solver::Limits;
use crate::contact::case::subsurface;
use crate::contact::case::words::contact::{ThermalBodyWords, ThermalWords};
use crate::contact::case::words::motion::Motions;
use crate::contact::case::words::solver::{Case, Output};
use crate::contact::case::words::subsurface::{DamageModel, DamageWords, SubsurfaceWords};
use crate::contact::error::Fault;
use crate::contact::post::damage::DamageTask;
use crate::contact::post::heat::{ThermalBody, ThermalTask};
use crate::contact::problem::physics::AfterTasks;

impl Case {
    /// The words of what it asks for.
    pub(crate) fn after_words(&self) -> AfterWords<'_> {
        AfterWords {
            subsurface: self.subsurface.as_ref(),
            damage: self.damage.as_ref(),
            thermal: self.thermal.as_ref(),
        }
    }
}

impl AfterTasks {
    /// What a case asks for.
    pub(crate) fn new(case: &Case) -> AfterTasks {
        let subsurface = case.subsurface.as_ref();
        AfterTasks {
            subsurface: subsurface.map(|words| subsurface::task(words, &case.material)),
            damage: case.damage.as_ref().map(DamageTask::new),
            thermal: case
                .thermal
                .filter(|_| case.outputs.contains(&Output::Temperature))
                .map(ThermalTask::from),
        }
    }
}

/// The words of what a case asks for, as far as they could be read.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct AfterWords<'a> {
    pub(crate) subsurface: Option<&'a SubsurfaceWords>,
    pub(crate) damage: Option<&'a DamageWords>,
    pub(crate) thermal: Option<&'a ThermalWords>,
}

impl AfterWords<'_> {
    /// Points of every motion at which stresses are answered.
    pub(crate) fn stress_points(&self) -> usize {
        self.subsurface.map_or(0, subsurface::count)
    }

    /// Faults beside the motions, which were written as `given`.
    pub(crate) fn faults(
        &self,
        given: &Motions,
        motions: &ExpandedMotions,
        limits: &Limits,
    ) -> Vec<Fault> {
        let mut faults = Vec::new();
        if let Some(words) = self.subsurface {
            faults.extend(subsurface::fault(words, motions.motions.len(), limits));
            faults.extend(subsurface::passage_fault(words, given));
        }
        let archard = self
            .damage
            .is_some_and(|damage| damage.models.contains(&DamageModel::ArchardWear));
        let needed = match (self.thermal, archard) {
            (Some(_), _) => Some("temperature"),
            (None, true) => Some("archard_wear"),
            (None, false) => None,
        };
        faults.extend(needed.and_then(|what| motions.speed_fault(given, what)));
        faults
    }
}

impl From<ThermalWords> for ThermalTask {
    fn from(words: ThermalWords) -> ThermalTask {
        let (lower, upper) = match words {
            ThermalWords::Same(both) => (both, both),
            ThermalWords::Pair { lower, upper } => (lower, upper),
        };
        ThermalTask {
            lower: lower.into(),
            upper: upper.into(),
        }
    }
}

impl From<ThermalBodyWords> for ThermalBody {
    fn from(words: ThermalBodyWords) -> ThermalBody {
        ThermalBody {
            conductivity: words.conductivity_w_per_mk,
            density: words.density_kg_per_m3,
            specific_heat: words.specific_heat_j_per_kgk,
            bulk: words.bulk_c,
        }
    }
}
