//! `/v1/jobs/{id}/zones`: where the patch sticks and where it slips.

use axum::response::Response;
use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::contact::case::words::solver::Output;
use crate::http::dto::cells::{Cells, GriddedField, Outlines, per_cell};
use crate::http::extract::query::require_index;
use crate::http::problem::error::ApiError;
use crate::http::render::format::Format;
use crate::http::render::table::File;
use crate::http::routes::fields::{Field, FieldQuery, Selection, Written, write, write_file};
use crate::http::routes::part_request::PartRequest;
use crate::http::routes::stored_fields::{FieldProblems, not_asked, stored};
use crate::jobs::Jobs;

/// Stick and slip zones of one patch for one motion.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
pub(crate) enum Zones {
    /// Without `grid`: areas, outlines and the zone of every cell.
    PerCell(ZoneCells),
    /// With `grid`: the zone of the nearest cell, resampled.
    #[expect(
        dead_code,
        reason = "for the contract; its text is written piece by piece"
    )]
    Gridded(GriddedField),
}

/// Areas, outlines and the zone of every cell.
#[derive(Debug, Serialize, ToSchema)]
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
    let Some(sizes) = zone_sizes(jobs, id, selection).await? else {
        return not_asked(jobs, id, shown).await;
    };
    let (patch, point) = (selection.patch, selection.point);
    let (fields, values) = stored(jobs, id, patch, point, shown).await?;
    let written = write(rendering, selection, "zones", move |format| {
        if selection.grid.is_some() || format != Format::Json {
            let (mut table, outlines) = Field::of(selection, &[shown], fields, values).into();
            table.precision = selection.precision;
            return match format {
                Format::Json | Format::Csv => Ok(Written::Table(table, outlines)),
                _ => write_file(&table, &outlines, selection, "zones"),
            };
        }
        let zones = Zones::PerCell(ZoneCells {
            patch,
            point,
            stick_area_mm2: sizes.stick_area_mm2,
            slip_area_mm2: sizes.slip_area_mm2,
            stick_cells: sizes.stick_cells,
            slip_cells: sizes.slip_cells,
            outlines: Outlines::of(&fields, &values, true),
            cells: per_cell(fields, values, &[shown]),
        });
        let text = serde_json::to_vec(&zones);
        Ok(Written::Whole(
            text.map_err(|error| ApiError::internal(&error))?,
        ))
    });
    written.await
}

/// The areas and cells of the zones of one patch for one motion.
struct ZoneSizes {
    stick_area_mm2: f64,
    slip_area_mm2: f64,
    stick_cells: u32,
    slip_cells: u32,
}

/// Nothing if the case did not ask for zones.
async fn zone_sizes(
    jobs: &Jobs,
    id: Uuid,
    selection: Selection,
) -> Result<Option<ZoneSizes>, ApiError> {
    let solution = jobs.solution(id).await?;
    require_index("patch", Some(selection.patch), solution.patches.len())?;
    let points = &solution.patches[selection.patch].points;
    require_index("point", Some(selection.point), points.len())?;
    let point = &points[selection.point];
    let sizes = || {
        Some(ZoneSizes {
            stick_area_mm2: point.stick_area_mm2?,
            slip_area_mm2: point.slip_area_mm2?,
            stick_cells: point.stick_cells?,
            slip_cells: point.slip_cells?,
        })
    };
    Ok(sizes())
}
