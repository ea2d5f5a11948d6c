//! `/v1/jobs/{id}/result` and `/resultants`: everything small about the answer of a job.

use std::collections::BTreeMap;

use axum::Json;
use axum::http::Uri;
use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::contact::case::{Motion, Output};
use crate::contact::solution::{ErrorEstimate, Origin, Solution, Total};
use crate::http::access::Caller;
use crate::http::error::{ApiError, Kind};
use crate::http::job::JobId;
use crate::http::problems::problems;
use crate::http::query::{Query, whole};
use crate::jobs::Jobs;

/// The result of a job: the solution without its fields, and where to get those.
#[derive(Debug, Serialize, ToSchema)]
pub struct JobResult {
    #[serde(flatten)]
    solution: Solution,
    /// The result was computed for an identical case before; `seconds` are those of that solve.
    cached: bool,
    /// The job, and every part of the result that the case asked for.
    links: BTreeMap<String, String>,
}

/// Forces and moments.
#[derive(Debug, Serialize, ToSchema)]
pub struct Resultants {
    /// One entry per contact patch, or the one that was asked for.
    patches: Vec<PatchResultants>,
    /// One entry per motion, or the one that was asked for: plain sums over all patches.
    total: Vec<Total>,
    /// The point that moments refer to.
    origin: Origin,
}

/// Forces and moments of one patch.
#[derive(Debug, Serialize, ToSchema)]
pub struct PatchResultants {
    /// Number of the patch, counted from 0.
    patch: usize,
    /// Normal force in N.
    normal_force_n: f64,
    /// One entry per motion, or the one that was asked for.
    points: Vec<PointResultants>,
}

/// Forces and moment of one patch for one motion; on the lower body.
#[derive(Debug, Serialize, ToSchema)]
pub struct PointResultants {
    /// Number of the motion, counted from 0.
    point: usize,
    /// The motion.
    motion: Motion,
    /// Longitudinal force in N.
    force_x_n: f64,
    /// Lateral force in N.
    force_y_n: f64,
    /// Moment about the origin in N·mm.
    moment_z_n_mm: f64,
    /// Estimated absolute errors; null where there is nothing to estimate them from.
    error_estimate: Option<ErrorEstimate>,
    /// Dissipated power divided by rolling speed, in N.
    friction_power_n: f64,
    /// The same without the part of spin, as |ν_x F_x| + |ν_y F_y|, in N.
    friction_power_without_spin_n: f64,
    /// A prescribed force could not be reached.
    saturated: bool,
}

problems! {
    /// What every part of a result can fail with.
    ResultProblems: JobNotFound, ResultNotReady, JobFailed, JobCancelled
}

/// The result of a succeeded job.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/result",
    tag = "results",
    operation_id = "get_result",
    params(("id" = String, Path, description = "Id of the job", format = "uuid")),
    responses((status = 200, description = "The result", body = JobResult), ResultProblems)
)]
pub async fn result(Caller(jobs): Caller, JobId(id): JobId) -> Result<Json<JobResult>, ApiError> {
    result_of(&jobs, id).await.map(Json)
}

/// The result of a succeeded job with its links.
///
/// # Errors
/// The job is unknown, has not ended or has no result.
pub async fn result_of(jobs: &Jobs, id: Uuid) -> Result<JobResult, ApiError> {
    let solution = jobs.solution(id).await?;
    let outputs = outputs_asked(jobs, id).await?;
    let outputs: Vec<&str> = outputs.into_iter().map(name_of).collect();
    let links = JobResult::links(id, &outputs);
    let cached = jobs.get(id).await?.cached;
    Ok(JobResult {
        solution,
        cached,
        links,
    })
}

impl JobResult {
    /// The links of the result of a job whose case asked for these outputs.
    #[must_use]
    pub fn links(id: Uuid, outputs: &[impl AsRef<str>]) -> BTreeMap<String, String> {
        let own = format!("/v1/jobs/{id}");
        let mut links = BTreeMap::from([("resultants".to_owned(), format!("{own}/resultants"))]);
        for name in outputs.iter().map(AsRef::as_ref) {
            links.insert(name.to_owned(), format!("{own}/{name}"));
        }
        links.insert("job".to_owned(), own);
        links
    }
}

problems! {
    /// What parts of a result can fail with.
    PartProblems: BadQuery, JobNotFound, ResultNotReady, JobFailed, JobCancelled
}

/// Forces and moments of a succeeded job. They are always computed, whatever the case asked for.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/resultants",
    tag = "results",
    operation_id = "get_resultants",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        ("point" = Option<u32>, Query, description = "Only this motion, counted from 0"),
        ("patch" = Option<u32>, Query, description = "Only this patch, counted from 0; `total` stays the sum over all")
    ),
    responses((status = 200, description = "Forces and moments on the lower body", body = Resultants), PartProblems)
)]
pub async fn resultants(
    Caller(jobs): Caller,
    JobId(id): JobId,
    uri: Uri,
) -> Result<Json<Resultants>, ApiError> {
    let mut query = Query::read(&uri, &["point", "patch"]);
    let point = query.take("point", INDEX, index);
    let patch = query.take("patch", INDEX, index);
    query.finish()?;
    let solution = jobs.solution(id).await?;
    require_index("point", point, solution.total.len())?;
    require_index("patch", patch, solution.patches.len())?;
    Ok(Json(select(solution, point, patch)))
}

fn select(solution: Solution, point: Option<usize>, patch: Option<usize>) -> Resultants {
    let chosen = |choice: Option<usize>, index: usize| choice.is_none_or(|choice| choice == index);
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
                        friction_power_n: point.friction_power_n,
                        friction_power_without_spin_n: point.friction_power_without_spin_n,
                        saturated: point.saturated,
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

/// What a number of a motion or a patch may be.
pub const INDEX: &str = "a whole number, counted from 0";

/// Reads the number of a motion or a patch.
#[must_use]
pub fn index(text: &str) -> Option<usize> {
    whole(text, 0, u32::MAX).and_then(|number| usize::try_from(number).ok())
}

/// Is the number of a motion or patch, if one is given, one of `count`?
///
/// # Errors
/// `bad-query` naming the parameter, its value and the largest number allowed.
pub fn require_index(name: &str, index: Option<usize>, count: usize) -> Result<(), ApiError> {
    match index {
        Some(index) if index >= count => Err(ApiError::bad_parameter(
            name,
            format!(
                "`{name}` is `{index}`; allowed: 0 to {}",
                count.saturating_sub(1)
            ),
        )),
        _ => Ok(()),
    }
}

/// The outputs that the case of a job asked for.
///
/// # Errors
/// The job is unknown.
pub async fn outputs_asked(jobs: &Jobs, id: Uuid) -> Result<Vec<Output>, ApiError> {
    let text = jobs.case(id).await?;
    let case: serde_json::Value =
        serde_json::from_slice(&text).map_err(|error| ApiError::internal(&error))?;
    let jobs = jobs.clone();
    let problem = tokio::task::spawn_blocking(move || jobs.check(&case)).await;
    let problem = problem.map_err(|error| ApiError::internal(&error))?;
    Ok(problem.map_err(|error| ApiError::internal(&error))?.outputs)
}

/// The failure of a client that fetches what its case did not ask for.
///
/// # Errors
/// Always: `output-not-asked`, or what went wrong while finding out.
pub async fn not_asked<T>(jobs: &Jobs, id: Uuid, output: Output) -> Result<T, ApiError> {
    let asked: Vec<String> = outputs_asked(jobs, id)
        .await?
        .into_iter()
        .map(|output| format!("`{}`", name_of(output)))
        .collect();
    let name = name_of(output);
    Err(ApiError::new(
        Kind::OutputNotAsked,
        format!(
            "the case asked for {} only; submit it again with `{name}` among its `outputs`",
            asked.join(", ")
        ),
    ))
}

/// The word of an output, in `outputs` and as the last part of its path.
#[must_use]
pub fn name_of(output: Output) -> &'static str {
    match output {
        Output::Resultants => "resultants",
        Output::Zones => "zones",
        Output::Tractions => "tractions",
        Output::Pressure => "pressure",
        Output::Slip => "slip",
    }
}
