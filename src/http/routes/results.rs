//! `/v1/jobs/{id}/result` and its small parts: forces, stresses below the surface, and damage.
use axum::Json;
use axum::body::{Body, Bytes};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use futures_util::{StreamExt, TryStreamExt, stream};
use railhead_macros::none_is_absent;
use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::dto::{JobResult, PointResultants, Resultants};
use crate::extract::accept::{choose, one_of};
use crate::extract::query::{Parameters, index, query, require_index};
use crate::limits::{Memory, Permit, SMALL_BYTES, hold_while_sent};
use crate::problem::{ApiError, Result, problems};
use crate::render::format::Format;
use crate::render::{resultants, stresses};
use crate::routes::parts::{FieldProblems, PartRequest, PlaceQuery, motion_of, not_asked, stored};
use crate::routes::wait::{Wait, WaitQuery};
use crate::routes::work::await_end;
use railhead_contact::case::words::solver::Output;
use railhead_contact::case::words::subsurface::BodyName;
use railhead_contact::post::subsurface::states::{STORED, points};
use railhead_contact::solution::words::answer::Solution;
use railhead_contact::solution::words::damage::{Damage, DamageFiguresUsed};
use railhead_contact::solution::words::evolution::{PassageSummary, StressPoint};
use railhead_jobs::Jobs;
use railhead_tables::read::TableForm;
use railhead_tables::table::RowTable;
use railhead_tables::write::RowWriter;

problems! {
    /// Problems of every part of a result.
    ResultProblems: BadQuery, JobNotFound, ResultNotReady, JobFailed, JobCancelled
}

/// Returns the result of a succeeded job.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/result",
    tag = "results",
    operation_id = "get_result",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        WaitQuery,
        ("Prefer" = Option<String>, Header, description = "`wait=N`, as `?wait=N` (RFC 7240)", example = "wait=10")
    ),
    responses((status = 200, description = "The result", body = JobResult, headers(
        ("Preference-Applied" = String, description = "The wait that was applied, if one was requested")
    )), ResultProblems)
)]
pub(crate) async fn result(request: PartRequest, wait: Wait) -> Result<Response> {
    await_end(&request.jobs, request.id, &wait).await?;
    let answer = async {
        let (jobs, memory) = (&request.jobs, &request.shared.memory);
        let (body, share) = result_text(jobs, memory, request.id, ["", ""]).await?;
        let head = [(header::CONTENT_TYPE, Format::Json.media_type())];
        let response = wait.tell_applied((head, body).into_response());
        Ok(hold_while_sent(response, share))
    };
    request.unless_known(Format::Json, answer).await
}

/// Returns the result of a succeeded job as JSON between two other texts, and the permit for its memory. A large result is read from its
/// store while the client receives it.
///
/// # Errors
/// The job is unknown, has not ended or has no result; or there is no memory.
pub(crate) async fn result_text(
    jobs: &Jobs,
    memory: &Memory,
    id: Uuid,
    around: [&str; 2],
) -> Result<(Body, Option<Permit>)> {
    let answer = jobs.open_answer(id).await?;
    let share = memory.ready_answer(jobs.tenant(), answer.held_bytes)?;
    let tail = JobResult::tail(id, answer.cached, &answer.outputs)?;
    let [before, behind] = around;
    let before = Bytes::from(before.to_owned());
    let behind = Bytes::from(tail + behind);
    let pieces = stream::iter([Ok(before)])
        .chain(answer.open_solution)
        .chain(stream::iter([Ok(behind)]));
    let body = if answer.bytes <= SMALL_BYTES {
        let pieces: Vec<Bytes> = pieces.try_collect().await?;
        Body::from(pieces.concat())
    } else {
        Body::from_stream(pieces)
    };
    Ok((body, share))
}

/// The formats of resultants and of stresses below the surface.
const FORMS: &[Format] = &[Format::Json, Format::Csv];

query! {
    /// Parameters of resultants.
    ResultantsQuery {
        /// Only this motion, by its index from 0
        point: usize as u32 = index();
        /// Only this patch, by its index from 0; `total` remains the sum over all patches
        patch: usize as u32 = index();
        /// `json` or `csv`; overrides `Accept`
        #[param(pattern = "^(json|csv)$", example = "csv")]
        format: Format as String = one_of(FORMS);
    }
}

/// Returns the forces and moments of a succeeded job. They are always computed, even if the case does not request them.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/resultants",
    tag = "results",
    operation_id = "get_resultants",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        ResultantsQuery
    ),
    responses((status = 200, description = "Forces and moments on the lower body. CSV: one line per patch and motion, then one per motion with `total` in place of the patch", content((Resultants = "application/json"), (String = "text/csv"))), ResultProblems)
)]
pub(crate) async fn resultants(request: PartRequest) -> Result<Response> {
    let query = ResultantsQuery::read(&request.uri)?;
    let format = choose(&request.headers, query.format, FORMS)?;
    let (point, patch) = (query.point, query.patch);
    let answer = async {
        let (jobs, id) = (&request.jobs, request.id);
        // The whole stored text is read, then the requested part is selected.
        let stored = jobs.open_answer(id).await?;
        let turn = request.rendering(2 * stored.bytes).await?;
        let text = stored.text().await?;
        let read = move || {
            let solution: Solution = serde_json::from_slice(&text).map_err(ApiError::internal)?;
            drop(text);
            require_index("point", point, solution.total.len())?;
            require_index("patch", patch, solution.patches.len())?;
            let motions = point.map_or(0..solution.total.len(), |point| point..point + 1);
            let totals = motions.filter_map(|motion| PointResultants::total(&solution, motion));
            let totals: Vec<PointResultants> = totals.collect();
            let resultants = Resultants::select(solution, point, patch);
            match format {
                Format::Csv => csv(resultants::table(&resultants, &totals)),
                _ => serde_json::to_vec(&resultants).map_err(ApiError::internal),
            }
        };
        let (body, share) = turn.run(read, Vec::len).await?;
        let response = format.answer("resultants", body);
        Ok(hold_while_sent(response, share))
    };
    request.unless_known(format, answer).await
}

fn csv(table: RowTable) -> Result<Vec<u8>> {
    RowWriter::whole(TableForm::Csv, table).map_err(ApiError::internal)
}

/// Bytes of a point as text.
const POINT_BYTES: usize = 900;

query! {
    /// The format of stresses below the surface.
    SubsurfaceQuery {
        /// `json` or `csv`; overrides `Accept`
        #[param(pattern = "^(json|csv)$", example = "csv")]
        format: Format as String = one_of(FORMS);
    }
}

/// Stresses below one patch for one motion.
#[none_is_absent]
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Stresses)]
pub(crate) struct SubsurfaceAnswer {
    /// Index of the patch, from 0.
    patch: usize,
    /// Index of the motion, from 0.
    point: usize,
    /// The body.
    body: BodyName,
    /// Smallest depth in mm; shallower points are evaluated at this depth.
    least_depth_mm: f64,
    /// The requested points, in the order of the case.
    points: Vec<StressPoint>,
    /// The point with the largest von Mises stress; absent unless requested.
    worst: Option<StressPoint>,
    /// Criteria for a point of the body while the contact rolls over it; absent unless requested.
    passage: Option<PassageSummary>,
}

/// Returns the stresses below the surface of a succeeded job.
///
/// Axes of the patch: x along rolling, y to the left, z up; depth is positive into the body, tension is positive.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/subsurface",
    tag = "results",
    operation_id = "get_subsurface",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        PlaceQuery,
        SubsurfaceQuery
    ),
    responses((status = 200, description = "Stresses at the requested points in the order of the case, and the worst point. CSV: one line per requested point", content((SubsurfaceAnswer = "application/json"), (String = "text/csv"))), FieldProblems)
)]
pub(crate) async fn subsurface(request: PartRequest) -> Result<Response> {
    let (place, query) = <(PlaceQuery, SubsurfaceQuery)>::read(&request.uri)?;
    let [patch, point] = place.place();
    let format = choose(&request.headers, query.format, FORMS)?;
    let answer = async {
        let (jobs, id) = (&request.jobs, request.id);
        let output = Output::Subsurface;
        let (_, values) = stored(jobs, id, [patch, point], &[output]).await?;
        let solution = jobs.solution(id).await?;
        let (_, motion) = motion_of(&solution, [patch, point])?;
        let Some(summary) = motion.subsurface else {
            return not_asked(jobs, id, output).await;
        };
        let kept = values.subsurface.unwrap_or_default();
        let turn = request.rendering(POINT_BYTES * (kept.len() / STORED + 1));
        let write = move || {
            let points = points(&kept);
            if format == Format::Csv {
                return csv(stresses::table(&points));
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
            serde_json::to_vec(&answer).map_err(ApiError::internal)
        };
        let (text, share) = turn.await?.run(write, Vec::len).await?;
        let response = format.answer("subsurface", text);
        Ok(hold_while_sent(response, share))
    };
    request.unless_known(format, answer).await
}

/// Damage of one pass over one patch for one motion.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct PatchDamage {
    /// Index of the patch, from 0.
    patch: usize,
    /// Index of the motion, from 0.
    point: usize,
    /// The models that the case requests.
    #[serde(flatten)]
    damage: Damage,
    /// The parameters that the models were evaluated with.
    parameters: DamageFiguresUsed,
}

/// Returns the damage of a succeeded job.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/damage",
    tag = "results",
    operation_id = "get_damage",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        PlaceQuery
    ),
    responses((status = 200, description = "The models that the case requested", body = PatchDamage), FieldProblems)
)]
pub(crate) async fn damage(request: PartRequest) -> Result<Response> {
    let [patch, point] = PlaceQuery::read(&request.uri)?.place();
    let answer = async {
        let (jobs, id) = (&request.jobs, request.id);
        let solution = jobs.solution(id).await?;
        let (_, motion) = motion_of(&solution, [patch, point])?;
        let damage = motion.damage.as_deref();
        let (Some(damage), Some(parameters)) = (damage, &solution.damage_parameters) else {
            return not_asked(jobs, id, Output::Damage).await;
        };
        let answer = PatchDamage {
            patch,
            point,
            damage: damage.clone(),
            parameters: parameters.as_ref().clone(),
        };
        Ok(Json(answer).into_response())
    };
    request.unless_known(Format::Json, answer).await
}
