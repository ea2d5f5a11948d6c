//! `/v1/jobs/{id}/fields`: all that was stored per cell for one patch and motion, in one answer.

use axum::response::Response;
use uuid::Uuid;

use crate::contact::case::words::solver::Output;
use crate::http::dto::result::name_of;
use crate::http::extract::accept::{choose, one_of};
use crate::http::extract::query::{Parameters, Reader, index, query, reader};
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::http::render::format::Format;
use crate::http::render::table::{File, Precision};
use crate::http::routes::fields::{Field, FieldValues, Selection, grid, precision};
use crate::http::routes::part_request::PartRequest;
use crate::http::routes::stored_fields::{FieldProblems, has, not_asked};
use crate::jobs::Jobs;
use crate::jobs::error::JobsError;

/// The parts that have a value per cell.
const PARTS: [Output; 5] = [
    Output::Pressure,
    Output::Tractions,
    Output::Slip,
    Output::Temperature,
    Output::Zones,
];

/// The forms that the fields come in.
const FORMATS: &[Format] = &[Format::Json, Format::Csv, Format::Npz, Format::Vtk];

query! {
    /// The parameters of all fields of a motion.
    FieldsQuery(samples_max => usize) {
        /// The motion, counted from 0; 0 when left out
        point: usize as u32 = index();
        /// The patch, counted from 0; 0 when left out
        patch: usize as u32 = index();
        /// Parts that the case has among its `outputs`, with commas between; all of them when left out
        #[param(pattern = "^(pressure|tractions|slip|temperature|zones)(,(pressure|tractions|slip|temperature|zones))*$", example = "pressure,tractions")]
        parts: Vec<Output> as String = parts();
        /// `NXxNY`: resample on a regular grid over the bounding box of the patch, 2 to 1000 samples along each axis, and
        /// 250 000 in all where the operator says nothing else
        #[param(example = "60x40")]
        grid: (usize, usize) as String = grid(*samples_max);
        /// `single`: numbers of 32 bits, which is enough for a picture; `double` when left out. VTK is always `double`
        #[param(pattern = "^(single|double)$", example = "single")]
        precision: Precision as String = precision();
        /// `json`, `csv`, `npz` or `vtk`; overrides `Accept`
        #[param(pattern = "^(json|csv|npz|vtk)$", example = "npz")]
        format: Format as String = one_of(FORMATS);
    }
}

/// Names of parts with commas between.
fn parts() -> Reader<Vec<Output>> {
    let names = PARTS.map(|part| format!("`{}`", name_of(part)));
    let allowed = format!("{} with commas between, each once", names.join(", "));
    reader(allowed, |text| {
        let part = |name: &str| PARTS.into_iter().find(|part| name_of(*part) == name);
        let mut parts = Vec::new();
        for name in text.split(',') {
            let part = part(name)?;
            if parts.contains(&part) {
                return None;
            }
            parts.push(part);
        }
        Some(parts)
    })
}

/// Everything that was stored per cell for one patch and motion of a succeeded job, with the border of the patch: what a
/// picture needs, in one request.
///
/// CSV, NPZ and VTK have the same names as the JSON; see `docs/formats.md`.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/fields",
    tag = "results",
    operation_id = "get_fields",
    params(("id" = String, Path, description = "Id of the job", format = "uuid"), FieldsQuery),
    responses((status = 200, description = "The values per cell, or on a regular grid", content(
        (Field = "application/json"),
        (String = "text/csv"),
        (File = "application/x-npz"),
        (File = "application/x-vtk")
    )), FieldProblems)
)]
pub(crate) async fn fields(request: PartRequest) -> Result<Response, ApiError> {
    let query = FieldsQuery::read(&request.uri, &request.shared.options.grid_max_samples)?;
    let selection = Selection {
        patch: query.patch.unwrap_or(0),
        point: query.point.unwrap_or(0),
        grid: query.grid,
        format: choose(&request.headers, query.format, FORMATS)?,
        precision: query.precision.unwrap_or_default(),
    };
    let answer = async {
        let most = query.parts.as_ref().map_or(PARTS.len(), Vec::len);
        let rendering = request.rendering(most * selection.bytes()).await?;
        let (jobs, id) = (&request.jobs, request.id);
        let field = stored_parts(jobs, id, selection, query.parts).await?;
        field.write(rendering, selection, "fields").await
    };
    request.unless_known(selection.format, answer).await
}

/// The parts that are wanted, else all that are stored, with the cells of the patch and the values of the motion.
async fn stored_parts(
    jobs: &Jobs,
    id: Uuid,
    selection: Selection,
    wanted: Option<Vec<Output>>,
) -> Result<FieldValues, ApiError> {
    let (patch, point) = (selection.patch, selection.point);
    let mut fields = match jobs.point_fields(id, patch, point).await {
        // Nothing is stored per cell when the case asked for no field at all.
        Err(JobsError::NoSuchPatch { patches: 0 }) => {
            return match wanted.and_then(|parts| parts.first().copied()) {
                Some(part) => not_asked(jobs, id, part).await,
                None => Err(nothing_per_cell()),
            };
        }
        fields => fields?,
    };
    // One motion was asked for, so there is one entry, and one mesh.
    let values = fields.points.pop().unwrap_or_default();
    let cells = fields.meshes.pop().unwrap_or_default();
    let stored = |part: &Output| has(&cells, &values, *part);
    let parts = match wanted {
        Some(parts) => {
            if let Some(missing) = parts.iter().find(|part| !stored(part)) {
                return not_asked(jobs, id, *missing).await;
            }
            parts
        }
        None => PARTS.into_iter().filter(stored).collect(),
    };
    Ok(FieldValues {
        outputs: parts,
        cells,
        values,
        members: String::new(),
    })
}

fn nothing_per_cell() -> ApiError {
    let names = PARTS.map(|part| format!("`{}`", name_of(part)));
    ApiError::new(
        ProblemKind::OutputNotAsked,
        format!(
            "the case asked for nothing per cell; submit it again with some of {} among its `outputs`",
            names.join(", ")
        ),
    )
}
