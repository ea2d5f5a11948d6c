//! `/v1/jobs/{id}/tractions`, `/pressure` and `/slip`: values per cell, or on a regular grid.

use axum::http::{HeaderMap, HeaderValue, Uri, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use crate::contact::case::Output;
use crate::contact::solution::{PatchCells, PointFields};
use crate::http::accept::{Format, choose, named_format};
use crate::http::access::Caller;
use crate::http::cells::{Cells, GriddedField, gridded, per_cell};
use crate::http::error::ApiError;
use crate::http::formats::{File, Table, csv, npz, vtk};
use crate::http::job::JobId;
use crate::http::plot::{WIDTH_DEFAULT, Wish, picture};
use crate::http::problems::problems;
use crate::http::query::{Query, whole};
use crate::http::results::{INDEX, index, name_of, not_asked};
use crate::jobs::Jobs;
use crate::jobs::error::JobsError;

/// Most samples along one axis of a regular grid.
const GRID_AXIS_MAX: u32 = 1000;

/// The forms that a field comes in.
const FORMATS: [Format; 6] = [
    Format::Json,
    Format::Csv,
    Format::Npz,
    Format::Vtk,
    Format::Svg,
    Format::Png,
];

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

impl From<Field> for Table {
    fn from(field: Field) -> Self {
        match field {
            Field::PerCell { cells, .. } => cells.into(),
            Field::Gridded(field) => field.into(),
        }
    }
}

/// The parameters of a field, for the contract; [`Selection::read`] reads them.
#[derive(Debug, IntoParams)]
#[into_params(parameter_in = Query)]
#[expect(
    dead_code,
    reason = "describes the query, which is read with all its faults elsewhere"
)]
pub struct FieldQuery {
    /// The motion, counted from 0; 0 when left out
    point: Option<u32>,
    /// The patch, counted from 0; 0 when left out
    patch: Option<u32>,
    /// `NXxNY`: resample on a regular grid over the bounding box of the patch, 2 to 1000 samples along each axis
    #[param(example = "60x40")]
    grid: Option<String>,
    /// `json`, `csv`, `npz`, `vtk`, or `svg` and `png` for a picture; overrides `Accept`
    #[param(example = "csv")]
    format: Option<String>,
}

/// Which patch and motion are wanted, on which grid and in which form.
#[derive(Debug, Clone, Copy)]
pub struct Selection {
    /// Number of the patch.
    pub patch: usize,
    /// Number of the motion.
    pub point: usize,
    /// Samples along x and y, if the field is to be resampled.
    pub grid: Option<(usize, usize)>,
    /// The form of the answer.
    pub format: Format,
}

impl Selection {
    /// Reads `point`, `patch` (0 when left out), `grid`, and `format` or `Accept`.
    ///
    /// # Errors
    /// `bad-query` with every fault, or `not-acceptable`.
    pub fn read(uri: &Uri, headers: &HeaderMap) -> Result<Self, ApiError> {
        let mut query = Query::read(uri, &["point", "patch", "grid", "format"]);
        let point = query.take("point", INDEX, index);
        let patch = query.take("patch", INDEX, index);
        let grid = query.take(
            "grid",
            "`NXxNY` such as `60x40`, each from 2 to 1000",
            grid_size,
        );
        let named = named_format(&mut query, &FORMATS);
        query.finish()?;
        Ok(Selection {
            patch: patch.unwrap_or(0),
            point: point.unwrap_or(0),
            grid,
            format: choose(headers, named, &FORMATS)?,
        })
    }

    /// The picture of an output, if a picture is what was asked for.
    ///
    /// # Errors
    /// `bad-query` if there is a `grid`, else as [`picture`].
    pub async fn picture(
        &self,
        jobs: &Jobs,
        id: Uuid,
        shown: Output,
    ) -> Result<Option<Response>, ApiError> {
        if !matches!(self.format, Format::Svg | Format::Png) {
            return Ok(None);
        }
        if self.grid.is_some() {
            return Err(ApiError::bad_parameter(
                "grid",
                "a picture shows the cells themselves; leave `grid` out",
            ));
        }
        let wish = Wish {
            shown,
            patch: self.patch,
            point: self.point,
            width: WIDTH_DEFAULT,
        };
        let mut response = picture(jobs, id, wish, self.format).await?;
        let vary = HeaderValue::from_static("Accept");
        response.headers_mut().insert(header::VARY, vary);
        Ok(Some(response))
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
///
/// CSV, NPZ and VTK have the same names as the JSON; see `docs/formats.md`.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/tractions",
    tag = "results",
    operation_id = "get_tractions",
    params(("id" = String, Path, description = "Id of the job", format = "uuid"), FieldQuery),
    responses((status = 200, description = "Tractions on the lower body, in MPa", content(
        (Field = "application/json"),
        (String = "text/csv"),
        (File = "application/x-npz"),
        (File = "application/x-vtk"),
        (String = "image/svg+xml"),
        (File = "image/png")
    )), FieldProblems)
)]
pub async fn tractions(
    Caller(jobs): Caller,
    JobId(id): JobId,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    answer(&jobs, id, &uri, &headers, Output::Tractions).await
}

/// Pressure of a succeeded job; the same for every motion.
///
/// CSV, NPZ and VTK have the same names as the JSON; see `docs/formats.md`.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/pressure",
    tag = "results",
    operation_id = "get_pressure",
    params(("id" = String, Path, description = "Id of the job", format = "uuid"), FieldQuery),
    responses((status = 200, description = "Pressure in MPa", content(
        (Field = "application/json"),
        (String = "text/csv"),
        (File = "application/x-npz"),
        (File = "application/x-vtk"),
        (String = "image/svg+xml"),
        (File = "image/png")
    )), FieldProblems)
)]
pub async fn pressure(
    Caller(jobs): Caller,
    JobId(id): JobId,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    answer(&jobs, id, &uri, &headers, Output::Pressure).await
}

/// Slip of a succeeded job: the upper body relative to the lower one, divided by rolling speed.
///
/// CSV, NPZ and VTK have the same names as the JSON; see `docs/formats.md`.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/slip",
    tag = "results",
    operation_id = "get_slip",
    params(("id" = String, Path, description = "Id of the job", format = "uuid"), FieldQuery),
    responses((status = 200, description = "Relative slip, dimensionless", content(
        (Field = "application/json"),
        (String = "text/csv"),
        (File = "application/x-npz"),
        (File = "application/x-vtk"),
        (String = "image/svg+xml"),
        (File = "image/png")
    )), FieldProblems)
)]
pub async fn slip(
    Caller(jobs): Caller,
    JobId(id): JobId,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    answer(&jobs, id, &uri, &headers, Output::Slip).await
}

async fn answer(
    jobs: &Jobs,
    id: Uuid,
    uri: &Uri,
    headers: &HeaderMap,
    output: Output,
) -> Result<Response, ApiError> {
    let selection = Selection::read(uri, headers)?;
    if let Some(picture) = selection.picture(jobs, id, output).await? {
        return Ok(picture);
    }
    let (patch, point) = (selection.patch, selection.point);
    let (fields, values) = stored(jobs, id, patch, point, output).await?;
    write_as(selection, name_of(output), move || match selection.grid {
        None => Field::PerCell {
            patch,
            point,
            cells: per_cell(fields, values, output),
        },
        Some((nx, ny)) => Field::Gridded(GriddedField {
            patch,
            point,
            ..gridded(&fields, &values, output, nx, ny)
        }),
    })
    .await
}

/// The cells of a patch and the values of one motion, in which the output is present.
///
/// # Errors
/// `output-not-asked`, or there is no such patch or motion, or no result.
pub async fn stored(
    jobs: &Jobs,
    id: Uuid,
    patch: usize,
    point: usize,
    output: Output,
) -> Result<(PatchCells, PointFields), ApiError> {
    let mut fields = match jobs.point_fields(id, patch, point).await {
        // Nothing is stored per cell when the case asked for no field at all.
        Err(JobsError::NoSuchPatch { patches: 0 }) => return not_asked(jobs, id, output).await,
        fields => fields?,
    };
    // One motion was asked for, so there is one entry, and one mesh.
    let values = fields.points.pop().unwrap_or_default();
    let cells = fields.meshes.pop().unwrap_or_default();
    let has = match output {
        Output::Tractions => values.traction_x_mpa.is_some() && values.traction_y_mpa.is_some(),
        Output::Pressure => cells.pressure_mpa.is_some(),
        Output::Slip => values.slip_x.is_some() && values.slip_y.is_some(),
        Output::Zones => values.zone.is_some(),
        Output::Resultants => true,
    };
    if !has {
        return not_asked(jobs, id, output).await;
    }
    Ok((cells, values))
}

/// Builds a large answer and writes it in the form that was asked for, off the async threads.
///
/// # Errors
/// `internal` if that fails.
pub async fn write_as<T: Serialize + Into<Table>>(
    selection: Selection,
    name: &'static str,
    make: impl FnOnce() -> T + Send + 'static,
) -> Result<Response, ApiError> {
    let Selection {
        patch,
        point,
        format,
        ..
    } = selection;
    let failed = |error: &dyn std::fmt::Display| ApiError::internal(error);
    let written = tokio::task::spawn_blocking(move || match format {
        Format::Csv => csv::write(&make().into()).map_err(|error| failed(&error)),
        Format::Npz => npz::write(&make().into()).map_err(|error| failed(&error)),
        Format::Vtk => Ok(vtk::write(
            &make().into(),
            &format!("{name}, patch {patch}, motion {point}; mm, N, MPa"),
        )),
        _ => serde_json::to_vec(&make()).map_err(|error| failed(&error)),
    });
    let body = written.await.map_err(|error| failed(&error))??;
    let mut response = ([(header::CONTENT_TYPE, format.media_type())], body).into_response();
    let headers = response.headers_mut();
    headers.insert(header::VARY, HeaderValue::from_static("Accept"));
    if matches!(format, Format::Npz | Format::Vtk) {
        // Programs that open these files go by the ending of the name.
        let file = format!(
            "attachment; filename=\"{name}-{patch}-{point}.{}\"",
            format.name()
        );
        if let Ok(file) = HeaderValue::from_str(&file) {
            headers.insert(header::CONTENT_DISPOSITION, file);
        }
    }
    Ok(response)
}
