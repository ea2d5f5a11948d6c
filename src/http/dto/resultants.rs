//! Forces and moments as the client sees them.

use serde::Serialize;
use utoipa::ToSchema;

use crate::contact::case::words::motion::MotionWords;
use crate::contact::solution::words::answer::{
    ErrorEstimate, HistoryPoint, Origin, Solution, Total,
};
use crate::contact::solution::words::damage::ProfileUncertainty;

/// Forces and moments.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Resultants {
    /// One entry per contact patch, or the one that was asked for.
    pub patches: Vec<PatchResultants>,
    /// One entry per motion, or the one that was asked for: plain sums over all patches.
    pub total: Vec<Total>,
    /// The point that moments refer to.
    pub origin: Origin,
}

/// Forces and moments of one patch.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct PatchResultants {
    /// Number of the patch, counted from 0.
    pub patch: usize,
    /// Normal force in N.
    pub normal_force_n: f64,
    /// One entry per motion, or the one that was asked for.
    pub points: Vec<PointResultants>,
}

/// Forces and moment of one patch for one motion; on the lower body.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct PointResultants {
    /// Number of the motion, counted from 0.
    pub point: usize,
    /// The motion.
    pub motion: MotionWords,
    /// Longitudinal force in N.
    pub force_x_n: f64,
    /// Lateral force in N.
    pub force_y_n: f64,
    /// Moment about the origin in N·mm.
    pub moment_z_n_mm: f64,
    /// Estimated absolute errors; null where there is nothing to estimate them from.
    pub error_estimate: Option<ErrorEstimate>,
    /// What the measurement of the profiles leaves open; only for `profiles`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<ProfileUncertainty>)]
    pub profile_uncertainty: Option<Box<ProfileUncertainty>>,
    /// Dissipated power divided by rolling speed, in N.
    pub friction_power_n: f64,
    /// The same without the part of spin, as |ν_x F_x| + |ν_y F_y|, in N.
    pub friction_power_without_spin_n: f64,
    /// A prescribed force could not be reached.
    pub saturated: bool,
    /// What a history adds; only of `motion.history`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<HistoryPoint>, nullable = false)]
    pub history: Option<Box<HistoryPoint>>,
}

impl Resultants {
    /// Forces and moments of a solution: of one patch or all of them, for one motion or all of them.
    #[must_use]
    pub(crate) fn select(
        solution: Solution,
        point: Option<usize>,
        patch: Option<usize>,
    ) -> Resultants {
        let chosen =
            |choice: Option<usize>, index: usize| choice.is_none_or(|choice| choice == index);
        let patches = solution.patches.into_iter().enumerate();
        let patches = patches
            .filter(|(index, _)| chosen(patch, *index))
            .map(|(number, patch)| {
                let points = patch
                    .points
                    .into_iter()
                    .enumerate()
                    .filter(|(index, _)| chosen(point, *index));
                PatchResultants {
                    patch: number,
                    normal_force_n: patch.normal_force_n,
                    points: points
                        .map(|(number, point)| PointResultants {
                            point: number,
                            motion: point.motion,
                            force_x_n: point.force_x_n,
                            force_y_n: point.force_y_n,
                            moment_z_n_mm: point.moment_z_n_mm,
                            error_estimate: point.error_estimate,
                            profile_uncertainty: point.profile_uncertainty.map(Box::new),
                            friction_power_n: point.friction_power_n,
                            friction_power_without_spin_n: point.friction_power_without_spin_n,
                            saturated: point.saturated,
                            history: point.history.map(Box::new),
                        })
                        .collect(),
                }
            });
        let patches = patches.collect();
        let total = solution.total.into_iter().enumerate();
        Resultants {
            patches,
            total: total
                .filter(|(index, _)| chosen(point, *index))
                .map(|(_, total)| total)
                .collect(),
            origin: solution.origin,
        }
    }
}

/// What a line of CSV holds besides forces and their errors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sum {
    /// The motion.
    pub motion: MotionWords,
    /// Normal force in N.
    pub normal_force_n: f64,
    /// Dissipated power divided by rolling speed, in N.
    pub friction_power_n: f64,
    /// The same without the part of spin, in N.
    pub friction_power_without_spin_n: f64,
    /// A prescribed force could not be reached.
    pub saturated: bool,
    /// What a history adds, with what all patches have dissipated.
    pub history: Option<HistoryPoint>,
}

/// Sums over all patches for each motion, of what `total` does not have.
#[must_use]
pub(crate) fn sums(solution: &Solution) -> Vec<Sum> {
    let load = solution.patches.iter().map(|patch| patch.normal_force_n);
    let normal_force_n = load.sum();
    let motions = solution
        .patches
        .first()
        .map_or(&[][..], |patch| &patch.points);
    let points = motions.iter().enumerate().map(|(number, first)| {
        let parts = || {
            let patches = solution.patches.iter();
            patches.filter_map(move |patch| patch.points.get(number))
        };
        Sum {
            motion: first.motion,
            normal_force_n,
            friction_power_n: parts().map(|part| part.friction_power_n).sum(),
            friction_power_without_spin_n: parts()
                .map(|part| part.friction_power_without_spin_n)
                .sum(),
            saturated: parts().any(|part| part.saturated),
            history: first.history.map(|history| HistoryPoint {
                dissipated_n_mm: parts()
                    .filter_map(|part| Some(part.history?.dissipated_n_mm))
                    .sum(),
                ..history
            }),
        }
    });
    points.collect()
}
