//! `/v1/jobs/{id}/subsurface`: stresses below the surface at the points that the case asked for, and the worst point of the patch.

use axum::response::Response;
use railhead_macros::none_is_absent;
use serde::Serialize;
use utoipa::ToSchema;

use crate::contact::case::words::solver::Output;
use crate::contact::case::words::subsurface::BodyName;
use crate::contact::post::subsurface::states::{STORED, points};
use crate::contact::solution::words::evolution::{PassageSummary, StressPoint};
use crate::http::extract::accept::{choose, one_of};
use crate::http::extract::query::{Parameters, index, query, require_index};
use crate::http::limits::holding_body::hold_while_sent;
use crate::http::problem::error::ApiError;
use crate::http::render::format::Format;
use crate::http::render::stresses::csv;
use crate::http::routes::part_request::PartRequest;
use crate::http::routes::stored_fields::{FieldProblems, not_asked, stored};

/// The forms that stresses come in.
const FORMATS: &[Format] = &[Format::Json, Format::Csv];
/// What a point takes as text, in bytes.
const POINT_BYTES: usize = 900;

query! {
    /// Parameters of stresses below the surface.
    SubsurfaceQuery(() => ()) {
        /// The motion, counted from 0; 0 when left out
        point: usize as u32 = index();
        /// The patch, counted from 0; 0 when left out
        patch: usize as u32 = index();
        /// `json` or `csv`; overrides `Accept`
        #[param(pattern = "^(json|csv)$", example = "csv")]
        format: Format as String = one_of(FORMATS);
    }
}

/// Stresses below one patch for one motion.
#[none_is_absent]
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Stresses)]
pub(crate) struct SubsurfaceAnswer {
    /// Number of the patch, counted from 0.
    patch: usize,
    /// Number of the motion, counted from 0.
    point: usize,
    /// The body.
    body: BodyName,
    /// Points asked for above this depth in mm are answered at it.
    least_depth_mm: f64,
    /// The requested points, in the order of the case.
    points: Vec<StressPoint>,
    /// Where von Mises' stress is largest; absent if the case did not want it.
    worst: Option<StressPoint>,
    /// What a point of the body lives through while the contact rolls over it; absent if the case did not want it.
    passage: Option<PassageSummary>,
}

/// Stresses below the surface of a succeeded job.
///
/// Axes of the patch: x along rolling, y to the left, z up; depth is positive into the body, tension is positive.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/subsurface",
    tag = "results",
    operation_id = "get_subsurface",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        SubsurfaceQuery
    ),
    responses((status = 200, description = "Stresses at the requested points in the order of the case, and the worst point. CSV: one line per requested point", content((SubsurfaceAnswer = "application/json"), (String = "text/csv"))), FieldProblems)
)]
pub(crate) async fn subsurface(request: PartRequest) -> Result<Response, ApiError> {
    let query = SubsurfaceQuery::read(&request.uri, &())?;
    let (patch, point) = (query.patch.unwrap_or(0), query.point.unwrap_or(0));
    let format = choose(&request.headers, query.format, FORMATS)?;
    let answer = write(&request, patch, point, format);
    request.unless_known(format, answer).await
}

async fn write(
    request: &PartRequest,
    patch: usize,
    point: usize,
    format: Format,
) -> Result<Response, ApiError> {
    let (jobs, id) = (&request.jobs, request.id);
    let output = Output::Subsurface;
    let (_, values) = stored(jobs, id, patch, point, output).await?;
    let solution = jobs.solution(id).await?;
    require_index("patch", Some(patch), solution.patches.len())?;
    let motions = &solution.patches[patch].points;
    require_index("point", Some(point), motions.len())?;
    let Some(summary) = motions[point].subsurface else {
        return not_asked(jobs, id, output).await;
    };
    let kept = values.subsurface.unwrap_or_default();
    let turn = request.rendering(POINT_BYTES * (kept.len() / STORED + 1));
    let write = move || {
        let points = points(&kept);
        if format == Format::Csv {
            return csv(&points).map_err(|error| ApiError::internal(&error));
        }
        let answer = SubsurfaceAnswer {
            patch,
            point,
            body: summary.body,
            least_depth_mm: summary.least_depth_mm,
            points,
            worst: summary.worst,
            passage: summary.passage,
        };
        serde_json::to_vec(&answer).map_err(|error| ApiError::internal(&error))
    };
    let (text, share) = turn.await?.run(write, Vec::len).await?;
    let response = format.answer("subsurface", text);
    Ok(hold_while_sent(response, share))
}
