//! `/v1/jobs/{id}/plot.svg` and `/plot.png`: a picture of one patch for one motion.

use axum::http::{HeaderValue, Uri, header};
use axum::response::{IntoResponse, Response};

use crate::contact::case::words::solver::Output;
use crate::http::extract::query::{Parameters, count, index, query, reader, require_index, word};
use crate::http::limits::holding_body::hold_while_sent;
use crate::http::problem::error::ApiError;
use crate::http::render::format::Format;
use crate::http::render::picture::draw::draw;
use crate::http::render::picture::raster;
use crate::http::render::picture::scene::Scene;
use crate::http::render::table::File;
use crate::http::routes::part_request::PartRequest;
use crate::http::routes::plot_views::{Drawing, drawing};
use crate::http::routes::plot_words::{PlotOptions, View, counted, remarks};
use crate::http::routes::stored_fields::{FieldProblems, stored};

/// Width of a picture in pixels when nothing is said.
pub(crate) const WIDTH_DEFAULT: u32 = 800;
/// Least width of the views other than `patch`: what is written on narrower ones cannot be read.
const VIEW_WIDTH_MIN: u32 = 200;
/// Limits of the width in pixels.
const WIDTH: [u32; 2] = [48, 2400];

/// The fields of the view `patch`.
const FIELDS: [(&str, Output); 5] = [
    ("traction", Output::Tractions),
    ("pressure", Output::Pressure),
    ("slip", Output::Slip),
    ("temperature", Output::Temperature),
    ("zones", Output::Zones),
];

query! {
    /// The parameters of a picture.
    PlotQuery(() => ()) {
        /// `patch` (when left out): one patch from above; `section`: traction and friction's bound along and across, through the largest traction
        /// of a patch; `curve`: the forces over the motions, with their errors; `profiles`: every patch on wheel and rail, with its pressure if
        /// the case asks for it
        #[param(inline, example = "curve")]
        view: View as View = reader(View::ALL.map(View::name).join(", "), View::from_name);
        /// Field of the view `patch`: `traction` (default), `pressure`, `slip`, `temperature` or `zones`; the case must request that output. The
        /// border of the stick zone is drawn if the case requests `zones` too
        #[param(example = "traction")]
        field: Output as String = word(&FIELDS);
        /// The motion, counted from 0; 0 when left out
        point: usize as u32 = index();
        /// The patch, counted from 0; 0 when left out
        patch: usize as u32 = index();
        /// Width in pixels; 800 when left out. The height follows from the patch. Below 200 the patch is drawn alone, for lists
        #[param(minimum = 48, maximum = 2400)]
        width: u32 as u32 = count(WIDTH[0], WIDTH[1]);
        /// Of the view `patch`, `low,high`: the values at both ends of the scale, in the unit of the field, so that several pictures share one; from 0 to the
        /// largest value of the picture when left out. Zones have none
        #[param(example = "0,400")]
        range: [f64; 2] as String = reader("`low,high`: two numbers, the second above the first", range);
    }
}

/// Two finite numbers with a finite way from the first up to the second.
fn range(text: &str) -> Option<[f64; 2]> {
    let (low, high) = text.split_once(',')?;
    let (low, high): (f64, f64) = (low.trim().parse().ok()?, high.trim().parse().ok()?);
    let wide = high - low;
    // Ticks of a narrower range could not be told apart.
    let apart = wide > 1e-9 * low.abs().max(high.abs());
    (low.is_finite() && high.is_finite() && wide.is_finite() && apart).then_some([low, high])
}

impl PlotOptions {
    fn read(uri: &Uri) -> Result<PlotOptions, ApiError> {
        let query = PlotQuery::read(uri, &())?;
        let shown = query.field.unwrap_or(Output::Tractions);
        if shown == Output::Zones && query.range.is_some() {
            return Err(ApiError::bad_parameter(
                "range",
                "zones have no scale; leave `range` out",
            ));
        }
        let view = query.view.unwrap_or(View::Patch);
        if view != View::Patch {
            let others = [
                ("field", query.field.is_some()),
                ("range", query.range.is_some()),
            ];
            if let Some((name, _)) = others.into_iter().find(|(_, given)| *given) {
                let detail = format!("only the view `patch` has a `{name}`; leave it out");
                return Err(ApiError::bad_parameter(name, detail));
            }
            if query.width.is_some_and(|width| width < VIEW_WIDTH_MIN) {
                let detail = format!("{VIEW_WIDTH_MIN} or more is needed for a view with numbers");
                return Err(ApiError::bad_parameter("width", detail));
            }
        }
        Ok(PlotOptions {
            view,
            shown,
            range: query.range,
            patch: query.patch.unwrap_or(0),
            point: query.point.unwrap_or(0),
            width: query.width.unwrap_or(WIDTH_DEFAULT),
        })
    }
}

/// A picture of a patch, or of another view of the result, as SVG.
///
/// A patch: a smooth heat map inside the border of the patch with a scale, the border of the stick zone, arrows along the traction or the slip, axes in mm with the same
/// scale, and the rolling direction. Readable without colour.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/plot.svg",
    tag = "results",
    operation_id = "get_plot_svg",
    params(("id" = String, Path, description = "Id of the job", format = "uuid"), PlotQuery),
    responses((status = 200, description = "The picture", content((String = "image/svg+xml"))), FieldProblems)
)]
pub(crate) async fn svg(request: PartRequest) -> Result<Response, ApiError> {
    plot(&request, Format::Svg).await
}

/// The same picture as PNG.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/plot.png",
    tag = "results",
    operation_id = "get_plot_png",
    params(("id" = String, Path, description = "Id of the job", format = "uuid"), PlotQuery),
    responses((status = 200, description = "The picture", content((File = "image/png"))), FieldProblems)
)]
pub(crate) async fn png(request: PartRequest) -> Result<Response, ApiError> {
    plot(&request, Format::Png).await
}

async fn plot(request: &PartRequest, format: Format) -> Result<Response, ApiError> {
    let wish = PlotOptions::read(&request.uri)?;
    let drawn = picture(request, wish, format);
    request.unless_known(format, drawn).await
}

/// Draws the picture.
///
/// # Errors
/// The output was not asked for, there is no such patch or motion, or there is no result.
pub(crate) async fn picture(
    request: &PartRequest,
    wish: PlotOptions,
    format: Format,
) -> Result<Response, ApiError> {
    // Its pixels are there during its turn only; what is sent is small.
    let rendering = request.rendering(0).await?;
    let (jobs, id) = (&request.jobs, request.id);
    let job = jobs.get(id).await?;
    let title = job.name.unwrap_or_else(|| format!("job {id}"));
    let drawing = match wish.view {
        View::Patch => of_patch(request, title, wish).await?,
        _ => drawing(request, title, wish).await?,
    };
    let draw = move || {
        let svg = drawing(wish.width)?;
        match format {
            Format::Png => {
                raster::png(&svg, wish.width).map_err(|error| ApiError::internal(&error))
            }
            _ => Ok(svg.into_bytes()),
        }
    };
    let (body, share) = rendering.run(draw, Vec::len).await?;
    let mut response = ([(header::CONTENT_TYPE, format.media_type())], body).into_response();
    // A picture is opened in browsers: whatever a client managed to write into a name, nothing in it may run.
    response.headers_mut().insert(
        header::CONTENT_SECURITY_POLICY,
        HeaderValue::from_static("default-src 'none'; style-src 'unsafe-inline'; sandbox"),
    );
    response
        .headers_mut()
        .extend(format.disposition(&format!("plot-{id}")));
    Ok(hold_while_sent(response, share))
}

/// What draws one patch from above.
async fn of_patch(
    request: &PartRequest,
    title: String,
    wish: PlotOptions,
) -> Result<Drawing, ApiError> {
    let (jobs, id) = (&request.jobs, request.id);
    let solution = jobs.solution(id).await?;
    let patches = solution.patches.len();
    require_index("patch", Some(wish.patch), patches)?;
    let points = &solution.patches[wish.patch].points;
    require_index("point", Some(wish.point), points.len())?;
    let (fields, values) = stored(jobs, id, wish.patch, wish.point, wish.shown).await?;
    let normal = solution.patches[wish.patch].normal_force_n;
    let counted = counted(wish, patches, points.len());
    let scene = Scene {
        title,
        remarks: remarks(&points[wish.point], normal, &counted),
        shown: wish.shown,
        range: wish.range,
        fields,
        values,
    };
    Ok(Box::new(move |width| Ok(draw(&scene, width))))
}
