//! `/v1/jobs/{id}/zones`: where the patch sticks and where it slips.

use axum::response::Response;
use serde::Serialize;
use serde_json::json;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::contact::case::words::solver::Output;
use crate::http::dto::cells::{Cells, GriddedField, Outlines};
use crate::http::extract::query::require_index;
use crate::http::problem::error::ApiError;
use crate::http::render::table::File;
use crate::http::routes::fields::{FieldQuery, FieldValues, Selection};
use crate::http::routes::part_request::PartRequest;
use crate::http::routes::stored_fields::{FieldProblems, not_asked, stored};
use crate::jobs::Jobs;

/// Stick and slip zones of one patch for one motion.
#[derive(Serialize, ToSchema)]
#[serde(untagged)]
#[expect(dead_code, reason = "describes an answer in the contract")]
pub(crate) enum Zones {
    /// Without `grid`: areas, outlines and the zone of every cell.
    PerCell(ZoneCells),
    /// With `grid`: the zone of the nearest cell, resampled.
    Gridded(GriddedField),
}

/// Areas, outlines and the zone of every cell.
#[derive(Serialize, ToSchema)]
pub(crate) struct ZoneCells {
    /// Number of the patch, counted from 0.
    patch: usize,
    /// Number of the motion, counted from 0.
    point: usize,
    /// Area that sticks in mm²: the share of the sticking cells in the area of the patch.
    stick_area_mm2: f64,
    /// Area that slips in mm², likewise; both add up to the area of the patch.
    slip_area_mm2: f64,
    /// Number of cells that stick.
    stick_cells: u32,
    /// Number of cells that slip.
    slip_cells: u32,
    /// Closed polygons around the patch and its zones.
    outlines: Outlines,
    /// Geometry and zone of the cells.
    cells: Cells,
}

/// Stick and slip zones of a succeeded job.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/zones",
    tag = "results",
    operation_id = "get_zones",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        FieldQuery
    ),
    responses((status = 200, description = "Areas, outlines and the zone of every cell, or zones on a regular grid; only cells or grid in forms other than JSON", content(
        (Zones = "application/json"),
        (String = "text/csv"),
        (File = "application/x-npz"),
        (File = "application/x-vtk"),
        (String = "image/svg+xml"),
        (File = "image/png")
    )), FieldProblems)
)]
pub(crate) async fn zones(request: PartRequest) -> Result<Response, ApiError> {
    let selection = Selection::read(&request)?;
    let shown = Output::Zones;
    let answer = async {
        match selection.picture(&request, shown).await? {
            Some(picture) => Ok(picture),
            None => cells(&request, selection).await,
        }
    };
    request.unless_known(selection.format, answer).await
}

async fn cells(request: &PartRequest, selection: Selection) -> Result<Response, ApiError> {
    let shown = Output::Zones;
    let (jobs, id) = (&request.jobs, request.id);
    let rendering = request.rendering(selection.bytes()).await?;
    let Some(sizes) = sizes_of_zones(jobs, id, selection).await? else {
        return not_asked(jobs, id, shown).await;
    };
    let (cells, values) = stored(jobs, id, selection.patch, selection.point, shown).await?;
    let field = FieldValues {
        outputs: vec![shown],
        cells,
        values,
        members: match selection.grid {
            None => sizes,
            Some(_) => String::new(),
        },
    };
    field.write(rendering, selection, "zones").await
}

/// The areas and numbers of cells of the zones as members of JSON; `None` if the case did not ask for zones.
async fn sizes_of_zones(
    jobs: &Jobs,
    id: Uuid,
    selection: Selection,
) -> Result<Option<String>, ApiError> {
    let solution = jobs.solution(id).await?;
    require_index("patch", Some(selection.patch), solution.patches.len())?;
    let points = &solution.patches[selection.patch].points;
    require_index("point", Some(selection.point), points.len())?;
    let point = &points[selection.point];
    let sizes = || {
        Some([
            ("stick_area_mm2", json!(point.stick_area_mm2?)),
            ("slip_area_mm2", json!(point.slip_area_mm2?)),
            ("stick_cells", json!(point.stick_cells?)),
            ("slip_cells", json!(point.slip_cells?)),
        ])
    };
    let member = |(name, value)| format!(",\"{name}\":{value}");
    Ok(sizes().map(|sizes| sizes.map(member).concat()))
}
