//! `/v1/jobs/{id}/tractions`, `/pressure` and `/slip`: values per cell, or on a regular grid.

use axum::http::{Uri, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::contact::case::Output;
use crate::contact::outputs::resample::resample;
use crate::contact::solution::{PatchFields, PointFields};
use crate::contact::zones::Zone;
use crate::http::access::Caller;
use crate::http::error::ApiError;
use crate::http::job::JobId;
use crate::http::problems::problems;
use crate::http::query::{Query, whole};
use crate::http::results::{INDEX, index, not_asked};
use crate::jobs::Jobs;
use crate::jobs::error::JobsError;

/// Most samples along one axis of a regular grid.
const GRID_AXIS_MAX: u32 = 1000;

/// A field of one patch for one motion.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
pub enum Field {
    /// Without `grid`: the values where they were computed.
    PerCell {
        /// Number of the patch, counted from 0.
        patch: usize,
        /// Number of the motion, counted from 0.
        point: usize,
        /// Geometry and values of the cells.
        cells: Cells,
    },
    /// With `grid`: resampled.
    Gridded(GriddedField),
}

/// Values per cell, strip by strip from smaller to larger y, in each strip from smaller to larger x. All arrays have
/// the same length; those of other fields are absent.
#[derive(Debug, Default, Serialize, ToSchema)]
pub struct Cells {
    /// Centre of the cell along x in mm.
    pub x_mm: Vec<f64>,
    /// Centre of the cell across in mm.
    pub y_mm: Vec<f64>,
    /// Width of the cell along x in mm.
    pub dx_mm: Vec<f64>,
    /// Width of the cell across in mm.
    pub dy_mm: Vec<f64>,
    /// Number of the strip, counted from 0.
    pub strip: Vec<u32>,
    /// Stick or slip.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zone: Option<Vec<Zone>>,
    /// Pressure in MPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure_mpa: Option<Vec<f64>>,
    /// Traction on the lower body along x in MPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub traction_x_mpa: Option<Vec<f64>>,
    /// Traction on the lower body across in MPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub traction_y_mpa: Option<Vec<f64>>,
    /// Slip along x, divided by rolling speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slip_x: Option<Vec<f64>>,
    /// Slip across, divided by rolling speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slip_y: Option<Vec<f64>>,
}

/// Values on a regular grid over the bounding box of the patch: `values[iy][ix]` at `(x_mm[ix], y_mm[iy])`, null
/// outside the patch; those of other fields are absent.
#[derive(Debug, Default, Serialize, ToSchema)]
pub struct GriddedField {
    /// Number of the patch, counted from 0.
    pub patch: usize,
    /// Number of the motion, counted from 0.
    pub point: usize,
    /// Samples along x in mm, ascending.
    pub x_mm: Vec<f64>,
    /// Samples across in mm, ascending.
    pub y_mm: Vec<f64>,
    /// Stick or slip.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zone: Option<Vec<Vec<Option<Zone>>>>,
    /// Pressure in MPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure_mpa: Option<Vec<Vec<Option<f64>>>>,
    /// Traction on the lower body along x in MPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub traction_x_mpa: Option<Vec<Vec<Option<f64>>>>,
    /// Traction on the lower body across in MPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub traction_y_mpa: Option<Vec<Vec<Option<f64>>>>,
    /// Slip along x, divided by rolling speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slip_x: Option<Vec<Vec<Option<f64>>>>,
    /// Slip across, divided by rolling speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slip_y: Option<Vec<Vec<Option<f64>>>>,
}

/// Which patch and motion are wanted, and on which grid.
#[derive(Debug, Clone, Copy)]
pub struct Selection {
    /// Number of the patch.
    pub patch: usize,
    /// Number of the motion.
    pub point: usize,
    /// Samples along x and y, if the field is to be resampled.
    pub grid: Option<(usize, usize)>,
}

impl Selection {
    /// Reads `point`, `patch` (0 when left out) and `grid`.
    ///
    /// # Errors
    /// `bad-query` with every fault.
    pub fn read(uri: &Uri) -> Result<Self, ApiError> {
        let mut query = Query::read(uri, &["point", "patch", "grid"]);
        let point = query.take("point", INDEX, index);
        let patch = query.take("patch", INDEX, index);
        let grid = query.take(
            "grid",
            "`NXxNY` such as `60x40`, each from 2 to 1000",
            grid_size,
        );
        query.finish()?;
        Ok(Selection {
            patch: patch.unwrap_or(0),
            point: point.unwrap_or(0),
            grid,
        })
    }
}

fn grid_size(text: &str) -> Option<(usize, usize)> {
    let (nx, ny) = text.split_once(['x', 'X'])?;
    let axis = |text| whole(text, 2, GRID_AXIS_MAX).and_then(|number| usize::try_from(number).ok());
    Some((axis(nx)?, axis(ny)?))
}

problems! {
    /// What a field can fail with.
    FieldProblems: BadQuery, JobNotFound, OutputNotAsked, ResultNotReady, JobFailed, JobCancelled
}

/// Tangential tractions of a succeeded job.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/tractions",
    tag = "results",
    operation_id = "get_tractions",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        ("point" = Option<u32>, Query, description = "The motion, counted from 0; 0 when left out"),
        ("patch" = Option<u32>, Query, description = "The patch, counted from 0; 0 when left out"),
        ("grid" = Option<String>, Query, description = "`NXxNY`: resample on a regular grid over the bounding box of the patch, 2 to 1000 samples along each axis", example = "60x40")
    ),
    responses((status = 200, description = "Tractions on the lower body, in MPa", body = Field), FieldProblems)
)]
pub async fn tractions(
    Caller(jobs): Caller,
    JobId(id): JobId,
    uri: Uri,
) -> Result<Response, ApiError> {
    answer(&jobs, id, &uri, Output::Tractions).await
}

/// Pressure of a succeeded job; the same for every motion.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/pressure",
    tag = "results",
    operation_id = "get_pressure",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        ("point" = Option<u32>, Query, description = "The motion, counted from 0; 0 when left out"),
        ("patch" = Option<u32>, Query, description = "The patch, counted from 0; 0 when left out"),
        ("grid" = Option<String>, Query, description = "`NXxNY`: resample on a regular grid over the bounding box of the patch, 2 to 1000 samples along each axis", example = "60x40")
    ),
    responses((status = 200, description = "Pressure in MPa", body = Field), FieldProblems)
)]
pub async fn pressure(
    Caller(jobs): Caller,
    JobId(id): JobId,
    uri: Uri,
) -> Result<Response, ApiError> {
    answer(&jobs, id, &uri, Output::Pressure).await
}

/// Slip of a succeeded job: the upper body relative to the lower one, divided by rolling speed.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/slip",
    tag = "results",
    operation_id = "get_slip",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        ("point" = Option<u32>, Query, description = "The motion, counted from 0; 0 when left out"),
        ("patch" = Option<u32>, Query, description = "The patch, counted from 0; 0 when left out"),
        ("grid" = Option<String>, Query, description = "`NXxNY`: resample on a regular grid over the bounding box of the patch, 2 to 1000 samples along each axis", example = "60x40")
    ),
    responses((status = 200, description = "Relative slip, dimensionless", body = Field), FieldProblems)
)]
pub async fn slip(Caller(jobs): Caller, JobId(id): JobId, uri: Uri) -> Result<Response, ApiError> {
    answer(&jobs, id, &uri, Output::Slip).await
}

async fn answer(jobs: &Jobs, id: Uuid, uri: &Uri, output: Output) -> Result<Response, ApiError> {
    let selection = Selection::read(uri)?;
    let mut fields = match jobs
        .point_fields(id, selection.patch, selection.point)
        .await
    {
        // Nothing is stored per cell when the case asked for no field at all.
        Err(JobsError::NoSuchPatch { patches: 0 }) => return not_asked(jobs, id, output).await,
        fields => fields?,
    };
    // One motion was asked for, so there is one entry.
    let point = fields.points.pop().unwrap_or_default();
    if !has(&fields, &point, output) {
        return not_asked(jobs, id, output).await;
    }
    write_json(move || match selection.grid {
        None => Field::PerCell {
            patch: selection.patch,
            point: selection.point,
            cells: per_cell(fields, point, output),
        },
        Some((nx, ny)) => Field::Gridded(GriddedField {
            patch: selection.patch,
            point: selection.point,
            ..gridded(&fields, &point, output, nx, ny)
        }),
    })
    .await
}

fn has(fields: &PatchFields, point: &PointFields, output: Output) -> bool {
    match output {
        Output::Tractions => point.traction_x_mpa.is_some() && point.traction_y_mpa.is_some(),
        Output::Pressure => fields.pressure_mpa.is_some(),
        Output::Slip => point.slip_x.is_some() && point.slip_y.is_some(),
        Output::Zones => point.zone.is_some(),
        Output::Resultants => true,
    }
}

/// The cells with the values of one output.
pub fn per_cell(fields: PatchFields, point: PointFields, output: Output) -> Cells {
    let mut cells = Cells {
        x_mm: fields.x_mm,
        y_mm: fields.y_mm,
        dx_mm: fields.dx_mm,
        dy_mm: fields.dy_mm,
        strip: fields.strip,
        ..Cells::default()
    };
    match output {
        Output::Tractions => {
            (cells.traction_x_mpa, cells.traction_y_mpa) =
                (point.traction_x_mpa, point.traction_y_mpa)
        }
        Output::Pressure => cells.pressure_mpa = fields.pressure_mpa,
        Output::Slip => (cells.slip_x, cells.slip_y) = (point.slip_x, point.slip_y),
        Output::Zones => cells.zone = point.zone,
        Output::Resultants => {}
    }
    cells
}

fn gridded(
    fields: &PatchFields,
    point: &PointFields,
    output: Output,
    nx: usize,
    ny: usize,
) -> GriddedField {
    let mut answer = GriddedField::default();
    let mut sample = |values: &Option<Vec<f64>>| {
        let grid = resample(fields, values.as_deref()?, nx, ny);
        (answer.x_mm, answer.y_mm) = (grid.x_mm, grid.y_mm);
        Some(grid.values)
    };
    match output {
        Output::Tractions => {
            let (x, y) = (sample(&point.traction_x_mpa), sample(&point.traction_y_mpa));
            (answer.traction_x_mpa, answer.traction_y_mpa) = (x, y);
        }
        Output::Pressure => answer.pressure_mpa = sample(&fields.pressure_mpa),
        Output::Slip => {
            let (x, y) = (sample(&point.slip_x), sample(&point.slip_y));
            (answer.slip_x, answer.slip_y) = (x, y);
        }
        Output::Zones | Output::Resultants => {}
    }
    answer
}

/// Builds a large answer and writes it as JSON off the async threads.
///
/// # Errors
/// `internal` if that fails.
pub async fn write_json<T: Serialize>(
    make: impl FnOnce() -> T + Send + 'static,
) -> Result<Response, ApiError> {
    let written = tokio::task::spawn_blocking(move || serde_json::to_vec(&make())).await;
    let text = written.map_err(|error| ApiError::internal(&error))?;
    let text = text.map_err(|error| ApiError::internal(&error))?;
    Ok(([(header::CONTENT_TYPE, "application/json")], text).into_response())
}
