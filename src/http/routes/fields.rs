//! `/v1/jobs/{id}/tractions`, `/pressure`, `/slip`, `/temperature` and `/zones`: values per cell, or on a regular grid.

use axum::body::Body;
use axum::http::{HeaderValue, header};
use axum::response::Response;
use serde::Serialize;
use serde_json::json;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::dto::{Cells, GriddedField, Outlines};
use crate::extract::accept::{choose, one_of};
use crate::extract::query::{Parameters, Reader, query, reader, whole, word};
use crate::limits::{Rendering, hold_while_sent};
use crate::problem::{ApiError, Result};
use crate::render::format::Format;
use crate::render::pieces::{csv_body, json_body};
use crate::render::table::{File, cell_table};
use crate::routes::parts::{
    FieldProblems, PARTS, PartRequest, PlaceQuery, has, motion_of, not_asked, stored,
};
use crate::routes::plots::{PlotOptions, View, WIDTH_DEFAULT, picture};
use railhead_contact::case::words::solver::Output;
use railhead_contact::solution::words::answer::{PatchCells, PointFields};
use railhead_jobs::Jobs;
use railhead_tables::csv::Precision;
use railhead_tables::{npz, vtk};

/// Largest number of samples along one axis of a regular grid.
const GRID_AXIS_MAX: u32 = 1000;

/// Memory of a sample until the client has received it, in bytes: two components.
const SAMPLE_BYTES: usize = 2 * size_of::<f64>();

/// The formats of a field.
const FORMATS: &[Format] = &[
    Format::Json,
    Format::Csv,
    Format::Npz,
    Format::Vtk,
    Format::Svg,
    Format::Png,
];

/// A field of one patch for one motion.
#[derive(Serialize, ToSchema)]
#[serde(untagged)]
#[expect(dead_code, reason = "describes an answer in the contract")]
pub(crate) enum Field {
    /// Without `grid`: values at the cells for which they were computed.
    PerCell {
        /// Index of the patch, from 0.
        patch: usize,
        /// Index of the motion, from 0.
        point: usize,
        /// The border of the patch, and of its zones if included.
        outlines: Outlines,
        /// Geometry and values of the cells.
        cells: Cells,
    },
    /// With `grid`: resampled.
    Gridded(GriddedField),
}

query! {
    /// The parameters of values per cell.
    ValuesQuery {
        /// `NXxNY`: resample on a regular grid over the bounding box of the patch; 2 to 1000 samples along each axis, by default at most
        /// 250 000 in all
        #[param(example = "60x40")]
        grid: (usize, usize) as String = grid();
        /// `double` (default) or `single`: 32-bit numbers, which are enough for a picture. VTK is always `double`
        #[param(pattern = "^(single|double)$", example = "single")]
        precision: Precision as String = word(&[("single", Precision::Single), ("double", Precision::Double)]);
    }
}

query! {
    /// The format of a field.
    FieldQuery {
        /// `json`, `csv`, `npz`, `vtk`, or `svg` and `png` for a picture; overrides `Accept`
        #[param(example = "csv")]
        format: Format as String = one_of(FORMATS);
    }
}

/// The requested patch and motion, grid and format.
#[derive(Debug, Clone, Copy)]
struct Selection {
    /// Indices of the patch and of the motion.
    place: [usize; 2],
    /// Samples along x and y, if the field is resampled.
    grid: Option<(usize, usize)>,
    /// The format of the response.
    format: Format,
    /// Precision of its numbers.
    precision: Precision,
}

impl Selection {
    /// # Errors
    /// `bad-query`: the grid has more samples than allowed.
    fn new(
        request: &PartRequest,
        (place, values): (PlaceQuery, ValuesQuery),
        format: Format,
    ) -> Result<Selection> {
        let samples_max = request.shared.options.grid_max_samples;
        if let Some((nx, ny)) = values.grid
            && nx * ny > samples_max
        {
            let detail =
                format!("`grid` is `{nx}x{ny}`; allowed: at most {samples_max} samples in all");
            return Err(ApiError::bad_parameter("grid", detail));
        }
        Ok(Selection {
            place: place.place(),
            grid: values.grid,
            format,
            precision: values.precision.unwrap_or_default(),
        })
    }

    /// Returns the picture of an output; `None` if the format is not that of a picture.
    ///
    /// # Errors
    /// `bad-query` if there is a `grid`, else as [`picture`].
    async fn picture(&self, request: &PartRequest, shown: Output) -> Result<Option<Response>> {
        if !matches!(self.format, Format::Svg | Format::Png) {
            return Ok(None);
        }
        if self.grid.is_some() {
            let detail = "a picture shows the cells themselves; leave `grid` out";
            return Err(ApiError::bad_parameter("grid", detail));
        }
        let options = PlotOptions {
            view: View::Patch,
            shown,
            place: self.place,
            width: WIDTH_DEFAULT,
            range: None,
        };
        let mut response = picture(request, options, self.format).await?;
        let vary = HeaderValue::from_static("Accept");
        response.headers_mut().insert(header::VARY, vary);
        Ok(Some(response))
    }

    /// Memory of the response until the client has received it, in bytes.
    fn bytes(&self) -> usize {
        let (nx, ny) = self.grid.unwrap_or_default();
        nx * ny * SAMPLE_BYTES
    }
}

/// Returns the reader of the numbers of samples of a regular grid.
fn grid() -> Reader<(usize, usize)> {
    let allowed = format!("`NXxNY` such as `60x40`, each from 2 to {GRID_AXIS_MAX}");
    reader(allowed, |text| {
        let (nx, ny) = text.split_once(['x', 'X'])?;
        let axis = |text| whole(text, 2, GRID_AXIS_MAX).map(|number| number as usize);
        Some((axis(nx)?, axis(ny)?))
    })
}

/// Defines the route of each field from its summary, path, operation id, output and description of the answer.
macro_rules! field_routes {
    ($($(#[doc = $summary:tt])* $name:ident($path:tt, $operation:tt, $output:ident, $schema:tt, $described:tt);)*) => {$(
        $(#[doc = $summary])*
        /// CSV, NPZ and VTK use the names of the JSON; see `docs/formats.md`.
        #[utoipa::path(
            get,
            path = $path,
            tag = "results",
            operation_id = $operation,
            params(("id" = String, Path, description = "Id of the job", format = "uuid"), PlaceQuery, ValuesQuery, FieldQuery),
            responses((status = 200, description = $described, content(
                ($schema = "application/json"),
                (String = "text/csv"),
                (File = "application/x-npz"),
                (File = "application/x-vtk"),
                (String = "image/svg+xml"),
                (File = "image/png")
            )), FieldProblems)
        )]
        pub(crate) async fn $name(request: PartRequest) -> Result<Response> {
            answer(&request, Output::$output).await
        }
    )*};
}

field_routes! {
    /// Returns the tangential tractions of a succeeded job.
    tractions("/v1/jobs/{id}/tractions", "get_tractions", Tractions, Field, "Tractions on the lower body, in MPa");
    /// Returns the pressure of a succeeded job; the same for every motion.
    pressure("/v1/jobs/{id}/pressure", "get_pressure", Pressure, Field, "Pressure in MPa");
    /// Returns the slip of a succeeded job: that of the upper body relative to the lower one, divided by rolling speed.
    slip("/v1/jobs/{id}/slip", "get_slip", Slip, Field, "Relative slip, dimensionless");
    /// Returns the temperature in the contact of a succeeded job, which is the same on both surfaces.
    temperature("/v1/jobs/{id}/temperature", "get_temperature", Temperature, Field, "Temperature at the middle of every cell, in °C");
    /// Returns the stick and slip zones of a succeeded job.
    zones("/v1/jobs/{id}/zones", "get_zones", Zones, Zones, "Areas, outlines and the zone of every cell, or zones on a regular grid; formats other than JSON contain only the cells or the grid");
}

async fn answer(request: &PartRequest, output: Output) -> Result<Response> {
    let (values, FieldQuery { format }) =
        <((PlaceQuery, ValuesQuery), FieldQuery)>::read(&request.uri)?;
    let format = choose(&request.headers, format, FORMATS)?;
    let selection = Selection::new(request, values, format)?;
    let answer = async {
        if let Some(picture) = selection.picture(request, output).await? {
            return Ok(picture);
        }
        let rendering = request.rendering(selection.bytes()).await?;
        let members = match output {
            Output::Zones => sizes_of_zones(&request.jobs, request.id, selection).await?,
            _ => String::new(),
        };
        let name = output.name();
        write_parts(request, rendering, selection, vec![output], (members, name)).await
    };
    request.unless_known(selection.format, answer).await
}

/// Answers with the values of these outputs; with all that are stored if none is named.
async fn write_parts(
    request: &PartRequest,
    rendering: Rendering,
    selection: Selection,
    wanted: Vec<Output>,
    (members, name): (String, &'static str),
) -> Result<Response> {
    let [patch, point] = selection.place;
    let (cells, values) = stored(&request.jobs, request.id, selection.place, &wanted).await?;
    let outputs = match wanted.is_empty() {
        true => PARTS
            .into_iter()
            .filter(|part| has(&cells, &values, *part))
            .collect(),
        false => wanted,
    };
    let write = move || write(selection, &outputs, (cells, values), (&members, name));
    let ((body, _), share) = rendering.run(write, |(_, bytes)| *bytes).await?;
    let name = format!("{name}-{patch}-{point}");
    Ok(hold_while_sent(selection.format.answer(&name, body), share))
}

/// Returns a field in the requested format, and its size in memory in bytes. JSON and CSV are written from the table while the client receives
/// them. `members` are further members of the JSON, each preceded by a comma.
fn write(
    selection: Selection,
    outputs: &[Output],
    (cells, values): (PatchCells, PointFields),
    (members, name): (&str, &str),
) -> Result<(Body, usize)> {
    let [patch, point] = selection.place;
    let outlines = Outlines::of(&cells, &values, outputs.contains(&Output::Zones));
    let mut table = cell_table(outputs, selection.grid, cells, values);
    table.precision = selection.precision;
    let file = match selection.format {
        Format::Npz => {
            let mut named = vec![("patch", &outlines.patch)];
            named.extend(outlines.stick.iter().map(|zone| ("stick", zone)));
            named.extend(outlines.slip.iter().map(|zone| ("slip", zone)));
            npz::write(&table, &named).map_err(ApiError::internal)?
        }
        Format::Vtk => {
            let title = format!("{name}, patch {patch}, motion {point}; mm, N, MPa");
            vtk::write(&table, &title)
        }
        format => {
            let bytes = table.bytes();
            if format == Format::Csv {
                return Ok((csv_body(table), bytes));
            }
            let outlines = serde_json::to_string(&outlines).map_err(ApiError::internal)?;
            let members =
                format!("\"patch\":{patch},\"point\":{point}{members},\"outlines\":{outlines}");
            return Ok((json_body(table, &members), bytes));
        }
    };
    let bytes = file.len();
    Ok((Body::from(file), bytes))
}

/// The formats of all fields together.
const PART_FORMATS: &[Format] = &[Format::Json, Format::Csv, Format::Npz, Format::Vtk];

query! {
    /// The parameters of all fields of a motion.
    FieldsQuery {
        /// Comma-separated parts, each among the `outputs` of the case; default: all of them
        #[param(pattern = "^(pressure|tractions|slip|temperature|zones)(,(pressure|tractions|slip|temperature|zones))*$", example = "pressure,tractions")]
        parts: Vec<Output> as String = parts();
        /// `json`, `csv`, `npz` or `vtk`; overrides `Accept`
        #[param(pattern = "^(json|csv|npz|vtk)$", example = "npz")]
        format: Format as String = one_of(PART_FORMATS);
    }
}

/// Returns the reader of a comma-separated list of parts.
fn parts() -> Reader<Vec<Output>> {
    let names = PARTS.map(|part| format!("`{}`", part.name()));
    let allowed = format!("a comma-separated list of {}, each once", names.join(", "));
    reader(allowed, |text| {
        let part = |name: &str| PARTS.into_iter().find(|part| part.name() == name);
        let parts: Vec<Output> = text.split(',').map(part).collect::<Option<_>>()?;
        let mut places = parts.iter().enumerate();
        let once = places.all(|(place, part)| !parts[..place].contains(part));
        once.then_some(parts)
    })
}

/// Returns all values stored per cell for one patch and motion of a succeeded job, with the border of the patch: everything that a picture
/// needs.
///
/// CSV, NPZ and VTK use the names of the JSON; see `docs/formats.md`.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/fields",
    tag = "results",
    operation_id = "get_fields",
    params(("id" = String, Path, description = "Id of the job", format = "uuid"), PlaceQuery, ValuesQuery, FieldsQuery),
    responses((status = 200, description = "The values per cell, or on a regular grid", content(
        (Field = "application/json"),
        (String = "text/csv"),
        (File = "application/x-npz"),
        (File = "application/x-vtk")
    )), FieldProblems)
)]
pub(crate) async fn fields(request: PartRequest) -> Result<Response> {
    let (values, query) = <((PlaceQuery, ValuesQuery), FieldsQuery)>::read(&request.uri)?;
    let format = choose(&request.headers, query.format, PART_FORMATS)?;
    let selection = Selection::new(&request, values, format)?;
    let answer = async {
        let most = query.parts.as_ref().map_or(PARTS.len(), Vec::len);
        let rendering = request.rendering(most * selection.bytes()).await?;
        let wanted = query.parts.unwrap_or_default();
        let (members, name) = (String::new(), "fields");
        write_parts(&request, rendering, selection, wanted, (members, name)).await
    };
    request.unless_known(selection.format, answer).await
}

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
    /// Index of the patch, from 0.
    patch: usize,
    /// Index of the motion, from 0.
    point: usize,
    /// Area that sticks in mm²: the share of the sticking cells in the area of the patch.
    stick_area_mm2: f64,
    /// Area that slips in mm², computed in the same way; both add up to the area of the patch.
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

/// Returns areas and numbers of cells of the zones as members of JSON, without a grid.
///
/// # Errors
/// `output-not-asked` if the case does not request zones.
async fn sizes_of_zones(jobs: &Jobs, id: Uuid, selection: Selection) -> Result<String> {
    let solution = jobs.solution(id).await?;
    let (_, point) = motion_of(&solution, selection.place)?;
    let sizes = || {
        Some([
            ("stick_area_mm2", json!(point.stick_area_mm2?)),
            ("slip_area_mm2", json!(point.slip_area_mm2?)),
            ("stick_cells", json!(point.stick_cells?)),
            ("slip_cells", json!(point.slip_cells?)),
        ])
    };
    let member = |(name, value)| format!(",\"{name}\":{value}");
    match sizes() {
        None => not_asked(jobs, id, Output::Zones).await,
        Some(_) if selection.grid.is_some() => Ok(String::new()),
        Some(sizes) => Ok(sizes.map(member).concat()),
    }
}
