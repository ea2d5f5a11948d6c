//! `/v1/jobs/{id}/zones`: where the patch sticks and where it slips.

use axum::http::{HeaderMap, Uri};
use axum::response::Response;
use serde::Serialize;
use utoipa::ToSchema;

use crate::contact::case::Output;
use crate::contact::outputs::outline::{outlines, patch_outline};
use crate::contact::zones::Zone;
use crate::http::access::Caller;
use crate::http::cells::{Cells, GriddedField, gridded, per_cell};
use crate::http::error::ApiError;
use crate::http::fields::{FieldProblems, FieldQuery, Selection, stored, write_as};
use crate::http::formats::{File, Table};
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

impl From<Zones> for Table {
    fn from(zones: Zones) -> Self {
        match zones {
            Zones::PerCell(zones) => zones.cells.into(),
            Zones::Gridded(field) => field.into(),
        }
    }
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
pub async fn zones(
    Caller(jobs): Caller,
    JobId(id): JobId,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let selection = Selection::read(&uri, &headers)?;
    if let Some(picture) = selection.picture(&jobs, id, Output::Zones).await? {
        return Ok(picture);
    }
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
    let (patch, point) = (selection.patch, selection.point);
    let (fields, values) = stored(&jobs, id, patch, point, Output::Zones).await?;
    write_as(selection, "zones", move || match selection.grid {
        Some((nx, ny)) => Zones::Gridded(GriddedField {
            patch,
            point,
            ..gridded(&fields, &values, Output::Zones, nx, ny)
        }),
        None => Zones::PerCell(ZoneCells {
            patch,
            point,
            stick_area_mm2,
            slip_area_mm2,
            stick_cells,
            slip_cells,
            outlines: Outlines {
                patch: patch_outline(&fields),
                stick: outlines(&fields, values.zone.as_deref(), Some(Zone::Stick)),
                slip: outlines(&fields, values.zone.as_deref(), Some(Zone::Slip)),
            },
            cells: per_cell(fields, values, Output::Zones),
        }),
    })
    .await
}
