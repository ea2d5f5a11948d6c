//! Patches of wheels on rails. Each patch has its own frame, its own estimate, and a moment about its own load centre.

use railhead_contact::geometry::reference_curve::ReferenceCurve;
use railhead_contact::normal::footprint::NormalTask;
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::rolling::answer::Resultants;
use railhead_contact::solution::words::answer::{Fields, PatchSolution, Solution};

use crate::truth::{Judged, TrueResultants, Truth};

/// The tangential answer of a patch, or the sums over several patches.
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
    /// Returns the patches of an answer, with `open` times μN subtracted from each estimate. That part of the estimate does not depend on the mesh.
    /// Returns `None` without an estimate.
    pub fn of_solution(solution: &Solution, open: f64) -> Option<Vec<PatchAnswer>> {
        let patches = solution.patches.iter();
        patches.map(|patch| PatchAnswer::new(patch, open)).collect()
    }

    fn new(patch: &PatchSolution, open: f64) -> Option<PatchAnswer> {
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
            estimate: point.error_estimate?.force_x_n - open * limit,
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

/// Returns the error of the forces on the curve of the rail due to the factors for its curvature, relative to μN: a fifth of the standard deviation
/// of the angle over the load in rad, and at most 3.5 % (`docs/wheel-rail.md`).
pub fn left_open(case: &CheckedCase, solution: &Solution, fields: &Fields) -> f64 {
    let NormalTask::Wheel(contact) = &case.problem.task else {
        unreachable!("a wheel on a rail")
    };
    let curve = ReferenceCurve::new(&contact.geometry);
    let mut sums = [0.0; 3];
    for (patch, fields) in solution.patches.iter().zip(&fields.patches) {
        let position = patch.position.as_ref().expect("a place on the rail");
        // Arc lengths grow to the left.
        let [mut low, mut high] = curve.range();
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            match curve.at(middle).at[0] < position.origin_track_mm[1] {
                true => low = middle,
                false => high = middle,
            }
        }
        let cells = fields.cells(0);
        let pressure = cells.pressure_mpa.as_ref().expect("pressures");
        for (k, pressure) in pressure.iter().enumerate() {
            let angle = curve.at(low + cells.y_mm[k]).angle;
            let load = pressure * cells.dx_mm[k] * cells.dy_mm[k];
            let of_cell = [load, load * angle, load * angle * angle];
            sums = [0, 1, 2].map(|k| sums[k] + of_cell[k]);
        }
    }
    let [load, first, second] = sums;
    let mean = first / load;
    let deviation = (second / load - mean * mean).max(0.0).sqrt();
    (0.2 * deviation).min(0.035)
}

/// Returns the sums over patches.
pub fn sum(patches: &[PatchAnswer]) -> PatchAnswer {
    patches
        .iter()
        .fold(PatchAnswer::default(), PatchAnswer::plus)
}

/// Compares patch by patch, or the sums if the reference result has another number of patches.
pub fn judged(truth: &Truth, found: &[PatchAnswer]) -> Vec<Judged> {
    if found.len() > 1 && found.len() == truth.patches.len() {
        let pairs = found.iter().zip(&truth.patches);
        return pairs.map(|(patch, known)| patch.against(known)).collect();
    }
    vec![sum(found).against(&truth.whole)]
}
