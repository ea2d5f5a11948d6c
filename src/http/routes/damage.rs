//! `/v1/jobs/{id}/damage`: what one pass of the contact does to the surfaces.

use axum::Json;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

use crate::contact::case::words::solver::Output;
use crate::contact::solution::words::damage::{Damage, DamageFiguresUsed};
use crate::http::extract::query::{Parameters, index, query, require_index};
use crate::http::problem::error::ApiError;
use crate::http::render::format::Format;
use crate::http::routes::part_request::PartRequest;
use crate::http::routes::stored_fields::{FieldProblems, not_asked};

query! {
    /// Parameters of damage.
    DamageQuery(() => ()) {
        /// The motion, counted from 0; 0 when left out
        point: usize as u32 = index();
        /// The patch, counted from 0; 0 when left out
        patch: usize as u32 = index();
    }
}

/// Damage of one pass over one patch for one motion.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct PatchDamage {
    /// Number of the patch, counted from 0.
    patch: usize,
    /// Number of the motion, counted from 0.
    point: usize,
    /// The models that the case asked for.
    #[serde(flatten)]
    damage: Damage,
    /// The figures they were evaluated with.
    parameters: DamageFiguresUsed,
}

/// Damage of a succeeded job.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/damage",
    tag = "results",
    operation_id = "get_damage",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        DamageQuery
    ),
    responses((status = 200, description = "The models that the case asked for", body = PatchDamage), FieldProblems)
)]
pub(crate) async fn damage(request: PartRequest) -> Result<Response, ApiError> {
    let query = DamageQuery::read(&request.uri, &())?;
    let (patch, point) = (query.patch.unwrap_or(0), query.point.unwrap_or(0));
    let answer = write(&request, patch, point);
    request.unless_known(Format::Json, answer).await
}

async fn write(request: &PartRequest, patch: usize, point: usize) -> Result<Response, ApiError> {
    let (jobs, id) = (&request.jobs, request.id);
    let solution = jobs.solution(id).await?;
    require_index("patch", Some(patch), solution.patches.len())?;
    let motions = &solution.patches[patch].points;
    require_index("point", Some(point), motions.len())?;
    let damage = motions[point].damage.as_deref();
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
}
