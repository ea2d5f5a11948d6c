//! `/v1/jobs/{id}/resultants`: forces and moments, per patch and in sum, as JSON or as a table.

use axum::extract::State;
use axum::http::{HeaderMap, Uri, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

use crate::contact::case::words::motion::MotionWords;
use crate::contact::solution::profile_quality::ProfileUncertainty;
use crate::contact::solution::words::{ErrorEstimate, Origin, Solution, Total};
use crate::http::extract::accept::{Format, choose, one_of};
use crate::http::extract::caller::Caller;
use crate::http::extract::ids::JobId;
use crate::http::extract::query::{Parameters, index, query, require_index};
use crate::http::layers::etag::{Known, tagged};
use crate::http::limits::holding_body::hold_while_sent;
use crate::http::limits::memory::Memory;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::render::csv::number;

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
    motion: MotionWords,
    /// Longitudinal force in N.
    force_x_n: f64,
    /// Lateral force in N.
    force_y_n: f64,
    /// Moment about the origin in N·mm.
    moment_z_n_mm: f64,
    /// Estimated absolute errors; null where there is nothing to estimate them from.
    error_estimate: Option<ErrorEstimate>,
    /// What the measurement of the profiles leaves open; only for `profiles`.
    #[serde(skip_serializing_if = "Option::is_none")]
    profile_uncertainty: Option<ProfileUncertainty>,
    /// Dissipated power divided by rolling speed, in N.
    friction_power_n: f64,
    /// The same without the part of spin, as |ν_x F_x| + |ν_y F_y|, in N.
    friction_power_without_spin_n: f64,
    /// A prescribed force could not be reached.
    saturated: bool,
}

problems! {
    /// What parts of a result can fail with.
    PartProblems: BadQuery, JobNotFound, ResultNotReady, JobFailed, JobCancelled
}

/// The forms that resultants come in.
const FORMATS: &[Format] = &[Format::Json, Format::Csv];

query! {
    /// Parameters of resultants.
    ResultantsQuery(() => ()) {
        /// Only this motion, counted from 0
        point: usize as u32 = index();
        /// Only this patch, counted from 0; `total` stays the sum over all
        patch: usize as u32 = index();
        /// `json` or `csv`; overrides `Accept`
        #[param(pattern = "^(json|csv)$", example = "csv")]
        format: Format as String = one_of(FORMATS);
    }
}

/// Forces and moments of a succeeded job. They are always computed, whatever the case asked for.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/resultants",
    tag = "results",
    operation_id = "get_resultants",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        ResultantsQuery
    ),
    responses((status = 200, description = "Forces and moments on the lower body. CSV: one line per patch and motion, then one per motion with `total` as its patch", content((Resultants = "application/json"), (String = "text/csv"))), PartProblems)
)]
pub async fn resultants(
    Caller(jobs): Caller,
    JobId(id): JobId,
    State(memory): State<Memory>,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let query = ResultantsQuery::read(&uri, &())?;
    let ResultantsQuery {
        point,
        patch,
        format,
    } = query;
    let format = choose(&headers, format, FORMATS)?;
    let tag = match Known::of(&jobs, id, &uri, &headers, format).await? {
        Known::Unchanged(answer) => return Ok(answer),
        Known::Tag(tag) => tag,
    };
    // The text is read, cut to what was asked for and written again: as much work as a table.
    let turn = memory.rendering(jobs.tenant(), 2 * jobs.answer_bytes(id).await?);
    let turn = turn.await?;
    let text = jobs.answer(id).await?.solution;
    let write = move || {
        let solution: Solution =
            serde_json::from_slice(&text).map_err(|error| ApiError::internal(&error))?;
        require_index("point", point, solution.total.len())?;
        require_index("patch", patch, solution.patches.len())?;
        let sums = sums(&solution);
        let resultants = select(solution, point, patch);
        match format {
            Format::Csv => {
                write_csv(&resultants, &sums).map_err(|error| ApiError::internal(&error))
            }
            _ => serde_json::to_vec(&resultants).map_err(|error| ApiError::internal(&error)),
        }
    };
    let (body, share) = turn.run(write, Vec::len).await?;
    let headers = [
        (header::CONTENT_TYPE, format.media_type()),
        (header::VARY, "Accept"),
    ];
    Ok(tagged(
        &tag,
        hold_while_sent((headers, body).into_response(), share),
    ))
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
                        profile_uncertainty: point.profile_uncertainty,
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

/// What a line of CSV holds besides forces and their errors.
#[derive(Debug, Clone, Copy)]
struct Sum {
    motion: MotionWords,
    normal_force_n: f64,
    friction_power_n: f64,
    friction_power_without_spin_n: f64,
    saturated: bool,
}

/// Sums over all patches for each motion, of what `total` does not have.
fn sums(solution: &Solution) -> Vec<Sum> {
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
        }
    });
    points.collect()
}

const CSV_COLUMNS: [&str; 15] = [
    "patch",
    "point",
    "creepage_x",
    "creepage_y",
    "spin_per_mm",
    "normal_force_n",
    "force_x_n",
    "force_y_n",
    "moment_z_n_mm",
    "error_force_x_n",
    "error_force_y_n",
    "error_moment_z_n_mm",
    "friction_power_n",
    "friction_power_without_spin_n",
    "saturated",
];

fn write_csv(resultants: &Resultants, sums: &[Sum]) -> Result<Vec<u8>, csv::Error> {
    let mut out = csv::Writer::from_writer(Vec::new());
    out.write_record(CSV_COLUMNS)?;
    let mut points = None;
    for patch in &resultants.patches {
        points = points.or(Some(&patch.points));
        for point in &patch.points {
            let sum = Sum {
                motion: point.motion,
                normal_force_n: patch.normal_force_n,
                friction_power_n: point.friction_power_n,
                friction_power_without_spin_n: point.friction_power_without_spin_n,
                saturated: point.saturated,
            };
            let total = Total {
                force_x_n: point.force_x_n,
                force_y_n: point.force_y_n,
                force_z_n: None,
                moment_z_n_mm: point.moment_z_n_mm,
                error_estimate: point.error_estimate,
                profile_uncertainty: point.profile_uncertainty,
            };
            out.write_record(csv_line(
                &patch.patch.to_string(),
                point.point,
                &sum,
                &total,
            ))?;
        }
    }
    for (point, total) in points.into_iter().flatten().zip(&resultants.total) {
        if let Some(sum) = sums.get(point.point) {
            out.write_record(csv_line("total", point.point, sum, total))?;
        }
    }
    out.into_inner()
        .map_err(|error| csv::Error::from(error.into_error()))
}

fn csv_line(patch: &str, point: usize, sum: &Sum, total: &Total) -> [String; 15] {
    let estimate = |value: fn(&ErrorEstimate) -> f64| {
        total
            .error_estimate
            .as_ref()
            .map_or_else(String::new, |errors| number(value(errors)))
    };
    [
        patch.to_owned(),
        point.to_string(),
        number(sum.motion.creepage_x),
        number(sum.motion.creepage_y),
        number(sum.motion.spin_per_mm),
        number(sum.normal_force_n),
        number(total.force_x_n),
        number(total.force_y_n),
        number(total.moment_z_n_mm),
        estimate(|errors| errors.force_x_n),
        estimate(|errors| errors.force_y_n),
        estimate(|errors| errors.moment_z_n_mm),
        number(sum.friction_power_n),
        number(sum.friction_power_without_spin_n),
        sum.saturated.to_string(),
    ]
}
