//! `/v1/jobs/{id}/zones`: where the patch sticks and where it slips.

use axum::http::Uri;
use axum::response::Response;
use serde::Serialize;
use utoipa::ToSchema;

use crate::contact::case::Output;
use crate::contact::outputs::outline::{outlines, patch_outline};
use crate::contact::outputs::resample::resample_zone;
use crate::contact::solution::PatchFields;
use crate::contact::zones::Zone;
use crate::http::access::Caller;
use crate::http::error::ApiError;
use crate::http::fields::{Cells, FieldProblems, GriddedField, Selection, per_cell, write_json};
use crate::http::job::JobId;
use crate::http::results::{not_asked, require_index};

/// Stick and slip zones of one patch for one motion.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
pub enum Zones {
    /// Without `grid`: areas, outlines and the zone of every cell.
    PerCell(ZoneCells),
    /// With `grid`: the zone of the nearest cell, resampled.
    Gridded(GriddedField),
}

/// Areas, outlines and the zone of every cell.
#[derive(Debug, Serialize, ToSchema)]
pub struct ZoneCells {
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

/// Closed polygons as lists of `[x, y]` in mm; the last point is joined to the first. Outer borders run
/// counter-clockwise, holes clockwise.
#[derive(Debug, Serialize, ToSchema)]
pub struct Outlines {
    /// The whole patch.
    patch: Vec<Vec<[f64; 2]>>,
    /// The cells that stick.
    stick: Vec<Vec<[f64; 2]>>,
    /// The cells that slip.
    slip: Vec<Vec<[f64; 2]>>,
}

/// Stick and slip zones of a succeeded job.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/zones",
    tag = "results",
    operation_id = "get_zones",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        ("point" = Option<u32>, Query, description = "The motion, counted from 0; 0 when left out"),
        ("patch" = Option<u32>, Query, description = "The patch, counted from 0; 0 when left out"),
        ("grid" = Option<String>, Query, description = "`NXxNY`: resample on a regular grid over the bounding box of the patch, 2 to 1000 samples along each axis", example = "60x40")
    ),
    responses((status = 200, description = "Areas, outlines and the zone of every cell, or zones on a regular grid", body = Zones), FieldProblems)
)]
pub async fn zones(Caller(jobs): Caller, JobId(id): JobId, uri: Uri) -> Result<Response, ApiError> {
    let selection = Selection::read(&uri)?;
    let solution = jobs.solution(id).await?;
    require_index("patch", Some(selection.patch), solution.patches.len())?;
    let points = &solution.patches[selection.patch].points;
    require_index("point", Some(selection.point), points.len())?;
    let point = &points[selection.point];
    let summary = (
        point.stick_area_mm2,
        point.slip_area_mm2,
        point.stick_cells,
        point.slip_cells,
    );
    let (Some(stick_area_mm2), Some(slip_area_mm2), Some(stick_cells), Some(slip_cells)) = summary
    else {
        return not_asked(&jobs, id, Output::Zones).await;
    };
    let mut fields = jobs
        .point_fields(id, selection.patch, selection.point)
        .await?;
    let point = fields.points.pop().unwrap_or_default();
    let Some(zone) = point.zone.clone() else {
        return not_asked(&jobs, id, Output::Zones).await;
    };
    write_json(move || match selection.grid {
        Some(grid) => Zones::Gridded(gridded(&fields, &zone, selection, grid)),
        None => Zones::PerCell(ZoneCells {
            patch: selection.patch,
            point: selection.point,
            stick_area_mm2,
            slip_area_mm2,
            stick_cells,
            slip_cells,
            outlines: Outlines {
                patch: patch_outline(&fields),
                stick: outlines(&fields, Some(&zone), Some(Zone::Stick)),
                slip: outlines(&fields, Some(&zone), Some(Zone::Slip)),
            },
            cells: per_cell(fields, point, Output::Zones),
        }),
    })
    .await
}

fn gridded(
    fields: &PatchFields,
    zone: &[Zone],
    selection: Selection,
    (nx, ny): (usize, usize),
) -> GriddedField {
    let grid = resample_zone(fields, zone, nx, ny);
    GriddedField {
        patch: selection.patch,
        point: selection.point,
        x_mm: grid.x_mm,
        y_mm: grid.y_mm,
        zone: Some(grid.values),
        ..GriddedField::default()
    }
}
