//! `/v1/jobs/{id}/tractions`, `/pressure`, `/slip` and `/temperature`: values per cell, or on a regular grid.

use axum::body::Body;
use axum::http::{HeaderValue, header};
use axum::response::Response;
use serde::Serialize;
use utoipa::ToSchema;

use crate::contact::case::words::solver::Output;
use crate::contact::solution::words::fields::{PatchCells, PointFields};
use crate::http::dto::cells::{Cells, GriddedField, Outlines, gridded, per_cell};
use crate::http::dto::result::name_of;
use crate::http::extract::accept::{choose, one_of};
use crate::http::extract::query::{Parameters, Reader, index, query, reader, whole, word};
use crate::http::limits::holding_body::hold_while_sent;
use crate::http::limits::memory::Rendering;
use crate::http::problem::error::ApiError;
use crate::http::render::format::Format;
use crate::http::render::pieces::{csv_body, json_body};
use crate::http::render::table::{File, Precision, Table};
use crate::http::render::{npz, vtk};
use crate::http::routes::part_request::PartRequest;
use crate::http::routes::plot_words::{PlotOptions, View};
use crate::http::routes::plots::{WIDTH_DEFAULT, picture};
use crate::http::routes::stored_fields::{FieldProblems, stored};

/// Most samples along one axis of a regular grid.
const GRID_AXIS_MAX: u32 = 1000;

/// What a sample takes until the client has taken it: two components.
const SAMPLE_BYTES: usize = 2 * size_of::<f64>();

/// The forms that a field comes in.
const FORMATS: &[Format] = &[
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
        /// The border of the patch, and of its zones where they are part of the answer.
        outlines: Outlines,
        /// Geometry and values of the cells.
        cells: Cells,
    },
    /// With `grid`: resampled.
    Gridded(GriddedField),
}

impl Field {
    /// The values of these outputs, as the selection asks for them.
    #[must_use]
    pub fn of(
        selection: Selection,
        outputs: &[Output],
        cells: PatchCells,
        values: PointFields,
    ) -> Field {
        let (patch, point) = (selection.patch, selection.point);
        let outlines = Outlines::of(&cells, &values, outputs.contains(&Output::Zones));
        match selection.grid {
            None => Field::PerCell {
                patch,
                point,
                outlines,
                cells: per_cell(cells, values, outputs),
            },
            Some((nx, ny)) => Field::Gridded(GriddedField {
                patch,
                point,
                outlines,
                ..gridded(&cells, &values, outputs, nx, ny)
            }),
        }
    }
}

impl From<Field> for (Table, Outlines) {
    fn from(field: Field) -> Self {
        match field {
            Field::PerCell {
                cells, outlines, ..
            } => (cells.into(), outlines),
            Field::Gridded(mut field) => {
                let outlines = std::mem::take(&mut field.outlines);
                (field.into(), outlines)
            }
        }
    }
}

query! {
    /// The parameters of a field.
    FieldQuery(samples_max => usize) {
        /// The motion, counted from 0; 0 when left out
        point: usize as u32 = index();
        /// The patch, counted from 0; 0 when left out
        patch: usize as u32 = index();
        /// `NXxNY`: resample on a regular grid over the bounding box of the patch, 2 to 1000 samples along each axis, and
        /// 250 000 in all where the operator says nothing else
        #[param(example = "60x40")]
        grid: (usize, usize) as String = grid(*samples_max);
        /// `single`: numbers of 32 bits, which is enough for a picture; `double` when left out. VTK is always `double`
        #[param(pattern = "^(single|double)$", example = "single")]
        precision: Precision as String = precision();
        /// `json`, `csv`, `npz`, `vtk`, or `svg` and `png` for a picture; overrides `Accept`
        #[param(example = "csv")]
        format: Format as String = one_of(FORMATS);
    }
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
    /// How exactly its numbers are written.
    pub precision: Precision,
}

impl Selection {
    /// Reads `point`, `patch` (0 when left out), `grid`, and `format` or `Accept`.
    ///
    /// # Errors
    /// `bad-query` with every fault, or `not-acceptable`.
    pub fn read(request: &PartRequest) -> Result<Self, ApiError> {
        let samples_max = request.shared.options.grid_max_samples;
        let query = FieldQuery::read(&request.uri, &samples_max)?;
        Ok(Selection {
            patch: query.patch.unwrap_or(0),
            point: query.point.unwrap_or(0),
            grid: query.grid,
            format: choose(&request.headers, query.format, FORMATS)?,
            precision: query.precision.unwrap_or_default(),
        })
    }

    /// The picture of an output, if the format is that of a picture.
    ///
    /// # Errors
    /// `bad-query` if there is a `grid`, else as [`picture`].
    pub async fn picture(
        &self,
        request: &PartRequest,
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
        let wish = PlotOptions {
            view: View::Patch,
            shown,
            patch: self.patch,
            point: self.point,
            width: WIDTH_DEFAULT,
            range: None,
        };
        let mut response = picture(request, wish, self.format).await?;
        let vary = HeaderValue::from_static("Accept");
        response.headers_mut().insert(header::VARY, vary);
        Ok(Some(response))
    }

    /// What the answer takes in memory before it is taken by the client, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let (nx, ny) = self.grid.unwrap_or_default();
        nx * ny * SAMPLE_BYTES
    }
}

/// How exactly numbers are written.
pub(crate) fn precision() -> Reader<Precision> {
    word(&[("single", Precision::Single), ("double", Precision::Double)])
}

/// A regular grid of at most so many samples.
pub(crate) fn grid(samples_max: usize) -> Reader<(usize, usize)> {
    let allowed = format!(
        "`NXxNY` such as `60x40`, each from 2 to 1000, and at most {samples_max} samples in all"
    );
    reader(allowed, move |text| {
        let (nx, ny) = text.split_once(['x', 'X'])?;
        let axis =
            |text| whole(text, 2, GRID_AXIS_MAX).and_then(|number| usize::try_from(number).ok());
        let (nx, ny) = (axis(nx)?, axis(ny)?);
        (nx * ny <= samples_max).then_some((nx, ny))
    })
}

/// Defines the route of each field from its summary, path, operation id, output and description of the answer.
macro_rules! field_routes {
    ($($(#[doc = $summary:tt])* $name:ident($path:tt, $operation:tt, $output:ident, $described:tt);)*) => {$(
        $(#[doc = $summary])*
        ///
        /// CSV, NPZ and VTK have the same names as the JSON; see `docs/formats.md`.
        #[utoipa::path(
            get,
            path = $path,
            tag = "results",
            operation_id = $operation,
            params(("id" = String, Path, description = "Id of the job", format = "uuid"), FieldQuery),
            responses((status = 200, description = $described, content(
                (Field = "application/json"),
                (String = "text/csv"),
                (File = "application/x-npz"),
                (File = "application/x-vtk"),
                (String = "image/svg+xml"),
                (File = "image/png")
            )), FieldProblems)
        )]
        pub(crate) async fn $name(request: PartRequest) -> Result<Response, ApiError> {
            answer(&request, Output::$output).await
        }
    )*};
}

field_routes! {
    /// Tangential tractions of a succeeded job.
    tractions("/v1/jobs/{id}/tractions", "get_tractions", Tractions, "Tractions on the lower body, in MPa");
    /// Pressure of a succeeded job; the same for every motion.
    pressure("/v1/jobs/{id}/pressure", "get_pressure", Pressure, "Pressure in MPa");
    /// Slip of a succeeded job: the upper body relative to the lower one, divided by rolling speed.
    slip("/v1/jobs/{id}/slip", "get_slip", Slip, "Relative slip, dimensionless");
    /// Temperature of both surfaces in the contact of a succeeded job; both bodies have the same there.
    temperature("/v1/jobs/{id}/temperature", "get_temperature", Temperature, "Temperature at the middle of every cell, in °C");
}

async fn answer(request: &PartRequest, output: Output) -> Result<Response, ApiError> {
    let selection = Selection::read(request)?;
    let answer = async {
        if let Some(picture) = selection.picture(request, output).await? {
            return Ok(picture);
        }
        let rendering = request.rendering(selection.bytes()).await?;
        let (jobs, id) = (&request.jobs, request.id);
        let (cells, values) = stored(jobs, id, selection.patch, selection.point, output).await?;
        let make = move || Field::of(selection, &[output], cells, values);
        write_as(rendering, selection, name_of(output), make).await
    };
    request.unless_known(selection.format, answer).await
}

/// What an answer is written from.
pub(crate) enum Written {
    /// A table and its outlines, whose text is made when the client takes it.
    Table(Table, Outlines),
    /// The whole answer.
    Whole(Vec<u8>),
}

/// Builds a field when its turn has come, and writes it in the format of the selection.
///
/// # Errors
/// `internal` if that fails.
pub(crate) async fn write_as(
    rendering: Rendering,
    selection: Selection,
    name: &'static str,
    make: impl FnOnce() -> Field + Send + 'static,
) -> Result<Response, ApiError> {
    write(rendering, selection, name, move |format| {
        let (mut table, outlines): (Table, Outlines) = make().into();
        table.precision = selection.precision;
        match format {
            Format::Json | Format::Csv => Ok(Written::Table(table, outlines)),
            _ => write_file(&table, &outlines, selection, name),
        }
    })
    .await
}

/// The table as one of the binary files.
///
/// # Errors
/// `internal` if that fails.
pub(crate) fn write_file(
    table: &Table,
    outlines: &Outlines,
    selection: Selection,
    name: &'static str,
) -> Result<Written, ApiError> {
    let Selection { patch, point, .. } = selection;
    let bytes = match selection.format {
        Format::Npz => npz::write(table, outlines).map_err(|error| ApiError::internal(&error))?,
        _ => vtk::write(
            table,
            &format!("{name}, patch {patch}, motion {point}; mm, N, MPa"),
        ),
    };
    Ok(Written::Whole(bytes))
}

/// Computes an answer when its turn has come. Its memory is held until it has been sent.
///
/// # Errors
/// What making it fails with.
pub(crate) async fn write(
    rendering: Rendering,
    selection: Selection,
    name: &'static str,
    make: impl FnOnce(Format) -> Result<Written, ApiError> + Send + 'static,
) -> Result<Response, ApiError> {
    let Selection {
        patch,
        point,
        format,
        ..
    } = selection;
    let size = |written: &Written| match written {
        Written::Table(table, _) => table.bytes(),
        Written::Whole(bytes) => bytes.len(),
    };
    let (written, share) = rendering.run(move || make(format), size).await?;
    let body = match written {
        Written::Table(table, _) if format == Format::Csv => csv_body(table),
        Written::Table(table, outlines) => {
            let outlines = serde_json::to_string(&outlines);
            let outlines = outlines.map_err(|error| ApiError::internal(&error))?;
            let members = format!("\"patch\":{patch},\"point\":{point},\"outlines\":{outlines}");
            json_body(table, &members)
        }
        Written::Whole(bytes) => Body::from(bytes),
    };
    let response = format.answer(&format!("{name}-{patch}-{point}"), body);
    Ok(hold_while_sent(response, share))
}
