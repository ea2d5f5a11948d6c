//! How long what follows from solved motions will take.

use crate::contact::post::subsurface::task::StressPlaces;
use crate::contact::problem::checked_case::CheckedCase;

/// Time in s before the first stress below the surface, and for each; for the worst point of a patch; for the power of all cells of a usual
/// mesh; for the rest. Of `cargo bench --bench stress -- --only after`, medians over 18 ellipses, the first two with one to twenty times as many
/// points along x; a fine mesh takes several times as long.
const LOADS_SECONDS: f64 = 3e-4;
const STRESS_SECONDS: f64 = 4e-7;
const WORST_SECONDS: f64 = 0.0025;
const POWER_SECONDS: f64 = 8e-5;
const DAMAGE_SECONDS: f64 = 3e-6;
/// For the passages below a patch, for each thing that is judged of them: the same bench.
const PASSAGE_SECONDS: f64 = 0.03;

impl CheckedCase {
    /// Estimated time in s for what follows from one solved motion, for so many patches.
    pub(crate) fn after_seconds(&self, patches: usize) -> f64 {
        let after = &self.run.after;
        let patches = patches as f64;
        let mut seconds = 0.0;
        if let Some(task) = &after.subsurface {
            let (count, below_worst) = match &task.places {
                StressPlaces::Points(points) => (points.len() as f64, false),
                StressPlaces::BelowWorst(depths) => (patches * depths.len() as f64, true),
            };
            let searched = if task.worst || below_worst {
                patches
            } else {
                0.0
            };
            seconds += LOADS_SECONDS + STRESS_SECONDS * count + WORST_SECONDS * searched;
            if let Some(passage) = task.passage {
                let judged = 1 + u8::from(passage.dang_van_slope.is_some());
                seconds += PASSAGE_SECONDS * f64::from(judged) * patches;
                if searched == 0.0 {
                    seconds += WORST_SECONDS * patches;
                }
            }
        }
        if after.needs_power(&self.run.outputs) {
            seconds += POWER_SECONDS * patches;
        }
        if after.damage.is_some() {
            seconds += DAMAGE_SECONDS * patches;
        }
        seconds
    }
}
