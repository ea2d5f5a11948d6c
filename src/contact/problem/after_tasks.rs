//! What is computed from solved motions beyond tractions and forces: stresses below the surface, damage, temperatures.

use crate::contact::case::words::solver::Output;
use crate::contact::post::damage::figures::DamageTask;
use crate::contact::post::heat::ThermalTask;
use crate::contact::post::subsurface::task::SubsurfaceTask;

/// What is computed from solved motions; nothing where a case does not ask for it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AfterTasks {
    /// Stresses below the surface.
    pub subsurface: Option<SubsurfaceTask>,
    /// Damage.
    pub damage: Option<DamageTask>,
    /// Temperatures.
    pub thermal: Option<ThermalTask>,
}

impl AfterTasks {
    /// Is the power of every cell needed?
    #[must_use]
    pub fn needs_power(&self, outputs: &[Output]) -> bool {
        let across = self.damage.as_ref().is_some_and(|task| task.across);
        across || self.thermal.is_some() || outputs.contains(&Output::Slip)
    }
}
