//! Requests for parts of a result: job, patch and motion, and the stored values.
use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderMap, Uri};
use axum::response::Response;
use uuid::Uuid;

use crate::extract::caller::WorkPath;
use crate::extract::query::{index, no_such_index, query, require_index};
use crate::layers::etag::{tag_of, tagged};
use crate::limits::Rendering;
use crate::problem::{ApiError, ProblemKind, Result, problems};
use crate::render::format::Format;
use crate::state::AppState;
use railhead_contact::case::words::solver::Output;
use railhead_contact::solution::words::answer::{
    PatchCells, PatchSolution, PointFields, PointSolution, Solution,
};
use railhead_jobs::Jobs;
use railhead_jobs::error::JobsError;

/// A request for a part of the result of a job.
pub(crate) struct PartRequest {
    /// The jobs of the client.
    pub jobs: Jobs,
    /// The job in the path.
    pub id: Uuid,
    /// The state of the service.
    pub shared: AppState,
    /// The requested URI.
    pub uri: Uri,
    /// The headers of the request.
    pub headers: HeaderMap,
}

impl FromRequestParts<AppState> for PartRequest {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, shared: &AppState) -> Result<Self> {
        let WorkPath { jobs, id } = WorkPath::from_request_parts(parts, shared).await?;
        Ok(PartRequest {
            jobs,
            id,
            shared: shared.clone(),
            uri: parts.uri.clone(),
            headers: parts.headers.clone(),
        })
    }
}

impl PartRequest {
    /// Returns the response with its entity tag. If the client has stored it already, `answer` is not polled.
    ///
    /// # Errors
    /// The job does not exist, or `answer` fails.
    pub(crate) async fn unless_known(
        &self,
        format: Format,
        answer: impl Future<Output = Result<Response>> + Send,
    ) -> Result<Response> {
        let job = self.jobs.get(self.id).await?;
        let (tag, unchanged) = tag_of(&job, &self.uri, &self.headers, format).await;
        match unchanged {
            Some(unchanged) => Ok(unchanged),
            None => Ok(tagged(&tag, answer.await?)),
        }
    }

    /// Waits for a turn and memory for a response of this many bytes.
    ///
    /// # Errors
    /// See [`Memory::rendering`](crate::limits::Memory::rendering).
    pub(crate) async fn rendering(&self, bytes: usize) -> Result<Rendering> {
        self.shared
            .memory
            .rendering(self.jobs.tenant(), bytes)
            .await
    }
}

problems! {
    /// Problems of a field.
    FieldProblems: BadQuery, JobNotFound, OutputNotAsked, ResultNotReady, JobFailed, JobCancelled
}

query! {
    /// The parameters that select one motion of one patch.
    PlaceQuery {
        /// Index of the motion, from 0; default 0
        point: usize as u32 = index();
        /// Index of the patch, from 0; default 0
        patch: usize as u32 = index();
    }
}

impl PlaceQuery {
    /// Indices of the patch and the motion.
    pub(crate) fn place(&self) -> [usize; 2] {
        [self.patch.unwrap_or(0), self.point.unwrap_or(0)]
    }
}

/// The outputs that have a value per cell.
pub(crate) const PARTS: [Output; 5] = [
    Output::Pressure,
    Output::Tractions,
    Output::Slip,
    Output::Temperature,
    Output::Zones,
];

/// Returns the cells of a patch and the values of one motion, which have these outputs.
///
/// # Errors
/// `output-not-asked`, or the patch, the motion or the result does not exist.
pub(crate) async fn stored(
    jobs: &Jobs,
    id: Uuid,
    [patch, point]: [usize; 2],
    wanted: &[Output],
) -> Result<(PatchCells, PointFields)> {
    let mut fields = match jobs.patch_fields(id, patch, Some(point)).await {
        // Without any requested field nothing is stored per cell.
        Err(JobsError::NoSuchPatch(0)) => {
            let Some(output) = wanted.first() else {
                let names = PARTS.map(|part| format!("`{}`", part.name())).join(", ");
                let detail = format!(
                    "the case asked for nothing per cell; submit it again with some of {names} among its `outputs`"
                );
                return Err(ApiError::new(ProblemKind::OutputNotAsked, detail));
            };
            return not_asked(jobs, id, *output).await;
        }
        Err(JobsError::NoSuchPatch(patches)) => {
            return Err(no_such_index("patch", patch, patches));
        }
        Err(JobsError::NoSuchPoint(points)) => return Err(no_such_index("point", point, points)),
        fields => fields?,
    };
    // There is one entry and one mesh, because one motion was requested.
    let values = fields.points.pop().unwrap_or_default();
    let cells = fields.meshes.pop().unwrap_or_default();
    match wanted.iter().find(|output| !has(&cells, &values, **output)) {
        Some(missing) => not_asked(jobs, id, *missing).await,
        None => Ok((cells, values)),
    }
}

/// Returns a patch of a solution and one of its motions.
///
/// # Errors
/// `bad-query`: the patch or the motion does not exist.
pub(crate) fn motion_of(
    solution: &Solution,
    [patch, point]: [usize; 2],
) -> Result<(&PatchSolution, &PointSolution)> {
    require_index("patch", Some(patch), solution.patches.len())?;
    let patch = &solution.patches[patch];
    require_index("point", Some(point), patch.points.len())?;
    Ok((patch, &patch.points[point]))
}

/// Whether the output is stored.
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

/// Fails because the case did not request an output.
///
/// # Errors
/// Always: `output-not-asked`, or the error of reading the requested outputs.
pub(crate) async fn not_asked<T>(jobs: &Jobs, id: Uuid, output: Output) -> Result<T> {
    let asked: Vec<String> = jobs
        .open_answer(id)
        .await?
        .outputs
        .into_iter()
        .map(|output| format!("`{}`", output.name()))
        .collect();
    let name = output.name();
    Err(ApiError::new(
        ProblemKind::OutputNotAsked,
        format!(
            "the case asked for {} only; submit it again with `{name}` among its `outputs`",
            asked.join(", ")
        ),
    ))
}
