//! The stored values of one patch and motion, and the failure if the case did not ask for them.

use uuid::Uuid;

use crate::contact::case::words::solver::Output;
use crate::contact::solution::words::answer::{PatchCells, PointFields};
use crate::http::dto::result::name_of;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::jobs::Jobs;
use crate::jobs::error::JobsError;

problems! {
    /// What a field can fail with.
    FieldProblems: BadQuery, JobNotFound, OutputNotAsked, ResultNotReady, JobFailed, JobCancelled
}

/// The cells of a patch and the values of one motion, in which the output is present.
///
/// # Errors
/// `output-not-asked`, or there is no such patch or motion, or no result.
pub(crate) async fn stored(
    jobs: &Jobs,
    id: Uuid,
    patch: usize,
    point: usize,
    output: Output,
) -> Result<(PatchCells, PointFields), ApiError> {
    let mut fields = match jobs.point_fields(id, patch, point).await {
        // Nothing is stored per cell when the case asked for no field at all.
        Err(JobsError::NoSuchPatch { patches: 0 }) => return not_asked(jobs, id, output).await,
        fields => fields?,
    };
    // One motion was asked for, so there is one entry, and one mesh.
    let values = fields.points.pop().unwrap_or_default();
    let cells = fields.meshes.pop().unwrap_or_default();
    if !has(&cells, &values, output) {
        return not_asked(jobs, id, output).await;
    }
    Ok((cells, values))
}

/// Is the output among what was stored?
#[must_use]
pub(crate) fn has(cells: &PatchCells, values: &PointFields, output: Output) -> bool {
    match output {
        Output::Tractions => values.traction_x_mpa.is_some() && values.traction_y_mpa.is_some(),
        Output::Pressure => cells.pressure_mpa.is_some(),
        Output::Slip => values.slip_x.is_some() && values.slip_y.is_some(),
        Output::Zones => values.zone.is_some(),
        Output::Temperature => values.temperature_c.is_some(),
        Output::Subsurface => values.subsurface.is_some(),
        Output::Resultants | Output::Damage | Output::Gradients => true,
    }
}

/// The failure of a client that fetches what its case did not ask for.
///
/// # Errors
/// Always: `output-not-asked`, or what went wrong while finding out.
pub(crate) async fn not_asked<T>(jobs: &Jobs, id: Uuid, output: Output) -> Result<T, ApiError> {
    let asked: Vec<String> = jobs
        .outputs(id)
        .await?
        .into_iter()
        .map(|output| format!("`{}`", name_of(output)))
        .collect();
    let name = name_of(output);
    Err(ApiError::new(
        ProblemKind::OutputNotAsked,
        format!(
            "the case asked for {} only; submit it again with `{name}` among its `outputs`",
            asked.join(", ")
        ),
    ))
}
