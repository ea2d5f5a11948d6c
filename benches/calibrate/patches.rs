//! Wheels on rails: each patch has its own frame, its own estimate, and a moment about its own load centre.

use railhead::contact::rolling::resultants::Resultants;
use railhead::contact::solution::words::answer::{PatchSolution, Solution};

use crate::truth::{Judged, TrueResultants, Truth};

/// The tangential answer of a patch, or the sums over several.
#[derive(Debug, Clone, Copy, Default)]
pub struct PatchAnswer {
    /// Forces in N in the axes of the patch, and the moment in N·mm about its load centre.
    pub resultants: Resultants,
    /// Estimated error of a force in N.
    pub estimate: f64,
    /// μN in N.
    pub limit: f64,
    /// μN times √(A/π) in N·mm.
    pub moment_limit: f64,
}

impl PatchAnswer {
    /// The patches of an answer; none without an estimate.
    pub fn of_solution(solution: &Solution) -> Option<Vec<PatchAnswer>> {
        solution.patches.iter().map(PatchAnswer::new).collect()
    }

    fn new(patch: &PatchSolution) -> Option<PatchAnswer> {
        let point = &patch.points[0];
        let position = patch.position?;
        let [x, y, z] = [0, 1, 2].map(|k| position.track_mm[k] - position.origin_track_mm[k]);
        let (sin, cos) = position.contact_angle_rad.sin_cos();
        let about_origin = Resultants {
            force_x: point.force_x_n,
            force_y: point.force_y_n,
            moment_z: point.moment_z_n_mm,
        };
        let limit = patch.friction_limit_n?;
        Some(PatchAnswer {
            resultants: about_origin.about([x, y * cos + z * sin]),
            estimate: point.error_estimate?.force_x_n,
            limit,
            moment_limit: limit * (patch.area_mm2 / std::f64::consts::PI).sqrt(),
        })
    }

    fn plus(self, other: &PatchAnswer) -> PatchAnswer {
        PatchAnswer {
            resultants: self.resultants.plus(other.resultants),
            estimate: self.estimate + other.estimate,
            limit: self.limit + other.limit,
            moment_limit: self.moment_limit + other.moment_limit,
        }
    }

    fn against(&self, known: &TrueResultants) -> Judged {
        known.judged(self.resultants, self.estimate)
    }
}

/// The sums over patches.
pub fn sum(patches: &[PatchAnswer]) -> PatchAnswer {
    patches
        .iter()
        .fold(PatchAnswer::default(), PatchAnswer::plus)
}

/// Patch by patch; the sums if the finer answer has another number of patches.
pub fn judged(truth: &Truth, found: &[PatchAnswer]) -> Vec<Judged> {
    if found.len() > 1 && found.len() == truth.patches.len() {
        let pairs = found.iter().zip(&truth.patches);
        return pairs.map(|(patch, known)| patch.against(known)).collect();
    }
    vec![sum(found).against(&truth.whole)]
}
