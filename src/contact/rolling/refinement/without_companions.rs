//! Errors where there are no companions to compare with: of the dense method, and on a mesh of the client's.

use crate::contact::normal::patch::Patch;
use crate::contact::rolling::motion_answer::RelativeErrors;
use crate::contact::rolling::refinement::caution::caution;
use crate::contact::rolling::refinement::constants::{
    CAUTION, DENSE_LEVELS, DENSE_LEVELS_NEAR, RULES_ON_MESH, RULES_ON_MESH_SAMPLED, SHARE_LARGE,
};
use crate::contact::rolling::refinement::distances::distances;
use crate::contact::rolling::refinement::estimate_context::{CoarserLevel, EstimateContext};
use crate::contact::rolling::refinement::few_strips::few_strips;
use crate::contact::rolling::resultants::Resultants;
use crate::contact::rolling::strip_mesh::StripMesh;
use crate::contact::rolling::task::RollingTask;

/// The dense method has one rule, so that only the change between its levels is known.
pub(super) fn dense_errors(
    task: &RollingTask,
    patches: &[Patch],
    found: &[Resultants],
    context: EstimateContext,
) -> RelativeErrors {
    let Some(CoarserLevel { summed, share, .. }) = context.before else {
        return vec![None; patches.len() + 1];
    };
    let factor = if share > SHARE_LARGE {
        DENSE_LEVELS_NEAR
    } else {
        DENSE_LEVELS
    };
    let factor = factor * share * context.slenderness.powf(CAUTION);
    distances(task, patches, found, summed)
        .iter()
        .map(|d| Some((factor * d).max(context.tolerance)))
        .collect()
}

/// Errors on a mesh of the client's, which has no companions: from the difference of the two rules, the sums, and the vortex.
pub(super) fn mesh_errors(
    task: &RollingTask,
    level: &StripMesh,
    rules: Option<&[f64]>,
    sums: &[f64],
    pole: f64,
    context: EstimateContext,
) -> RelativeErrors {
    let factor = if task.footprint.is_closed_form() {
        RULES_ON_MESH
    } else {
        RULES_ON_MESH_SAMPLED
    };
    let factor = factor * context.slenderness.powf(CAUTION) * few_strips(level);
    let factor = factor * caution(task);
    let Some(rules) = rules else {
        return vec![None; sums.len()];
    };
    let least = pole.max(context.tolerance);
    let errors = rules.iter().zip(sums);
    errors
        .map(|(rule, sum)| Some((factor * rule).max(*sum).max(least)))
        .collect()
}
