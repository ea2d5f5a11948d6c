//! `/v1/jobs/{id}/plot.svg` and `plot.png`: pictures of a result.

use axum::http::{HeaderValue, Uri, header};
use axum::response::{IntoResponse, Response};
use railhead_macros::{Names, keyword};
use serde_json::Value;
use uuid::Uuid;

use crate::extract::query::{Parameters, count, query, reader, word};
use crate::limits::hold_while_sent;
use crate::problem::{ApiError, Result};
use crate::render::format::Format;
use crate::render::picture::curve::{self, Curve, CurveLine};
use crate::render::picture::draw::draw;
use crate::render::picture::profile_view::{self, ProfileView, ProfileViewPatch};
use crate::render::picture::raster;
use crate::render::picture::scene::Scene;
use crate::render::picture::section::{self, Sections};
use crate::render::picture::svg::Svg;
use crate::render::table::File;
use crate::routes::parts::{FieldProblems, PartRequest, PlaceQuery, motion_of, stored};
use railhead_contact::case::words::solver::Output;
use railhead_contact::solution::words::answer::{
    ErrorEstimate, PatchCells, PointSolution, Solution, Total,
};
use railhead_jobs::Jobs;
use railhead_jobs::error::JobsError;

/// View shown by a picture.
#[keyword(Names)]
pub(crate) enum View {
    /// One patch from above.
    Patch,
    /// Forces over the motions.
    Curve,
    /// Traction and friction's bound along and across, through the largest traction of a patch.
    Section,
    /// The patches on wheel and rail; of `profiles`.
    Profiles,
}

/// The options of a picture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlotOptions {
    /// The view.
    pub view: View,
    /// The field.
    pub shown: Output,
    /// Indices of the patch and of the motion.
    pub place: [usize; 2],
    /// Width in pixels.
    pub width: u32,
    /// Requested ends of the scale.
    pub range: Option<[f64; 2]>,
}

/// Returns the indices of patch and motion, if there are several.
fn counted(place: [usize; 2], counts: [usize; 2]) -> String {
    let several = (0..2).filter(|k| counts[*k] > 1);
    let words = ["patch", "point"];
    let text = several.map(|k| format!(", {} {} of 0 to {}", words[k], place[k], counts[k] - 1));
    text.collect()
}

/// Returns motion and forces in two lines.
fn remarks(point: &PointSolution, normal: f64, counted: &str) -> Vec<String> {
    let motion = point.motion;
    // A force that is zero up to rounding is shown as zero.
    let force = |value: f64| {
        let lost = value.abs() < 1e-9 * normal;
        short(if lost { 0.0 } else { value })
    };
    vec![
        format!(
            "creepage x {}, y {}, spin {} 1/mm{counted}",
            short(motion.creepage_x),
            short(motion.creepage_y),
            short(motion.spin_per_mm),
        ),
        format!(
            "normal force {} N; on the lower body: force x {} N, y {} N, moment {} N·mm",
            short(normal),
            force(point.force_x_n),
            force(point.force_y_n),
            force(point.moment_z_n_mm)
        ),
    ]
}

/// Formats a number with four significant digits.
fn short(value: f64) -> String {
    let size = value.abs();
    let text = if size == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e4).contains(&size) {
        let digits = (3.0 - size.log10().floor()).clamp(0.0, 6.0);
        let text = format!("{value:.*}", digits as usize);
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    } else if (1e4..1e9).contains(&size) {
        format!("{value:.0}")
    } else {
        let text = format!("{value:.3e}");
        let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let digits = digits.trim_end_matches('0').trim_end_matches('.');
        format!("{digits}e{exponent}")
    };
    text.replace('-', "−")
}

/// Draws a picture of a width in pixels, on a blocking thread.
type Drawing = Box<dyn FnOnce(u32) -> Result<Svg> + Send>;

/// Loads the data of a view, and returns the function that draws it.
///
/// # Errors
/// The case does not have this view, or there is no result.
async fn drawing(request: &PartRequest, title: String, options: PlotOptions) -> Result<Drawing> {
    let (jobs, id) = (&request.jobs, request.id);
    let solution = jobs.solution(id).await?;
    match options.view {
        View::Curve => return curve_drawing(title, &solution),
        View::Profiles => return profiles_drawing(jobs, id, title, solution).await,
        View::Section | View::Patch => {}
    }
    let (patch, point) = motion_of(&solution, options.place)?;
    let (cells, values) = stored(jobs, id, options.place, &[options.shown]).await?;
    let counts = [solution.patches.len(), patch.points.len()];
    let counted = counted(options.place, counts);
    let remarks = remarks(point, patch.normal_force_n, &counted);
    if options.view == View::Patch {
        let scene = Scene {
            title,
            remarks,
            shown: options.shown,
            range: options.range,
            fields: cells,
            values,
        };
        return Ok(Box::new(move |width| Ok(draw(&scene, width))));
    }
    let asked = solution.asked.as_ref();
    let sections = Sections {
        title,
        remarks,
        cells,
        values,
        friction: asked
            .filter(|asked| !asked.friction_varies)
            .map(|asked| asked.friction_coefficient),
    };
    Ok(Box::new(move |width| Ok(section::draw(&sections, width))))
}

fn curve_drawing(title: String, solution: &Solution) -> Result<Drawing> {
    let points = solution
        .patches
        .first()
        .map_or(&[][..], |patch| &patch.points);
    if points.len() < 2 {
        let detail = "the case has one motion; a curve needs several, as of a sweep";
        return Err(ApiError::bad_parameter("view", detail));
    }
    let (x_name, x) = varying(points);
    let line = |name, force: fn(&Total) -> f64, error: fn(ErrorEstimate) -> f64| CurveLine {
        name,
        y: solution.total.iter().map(force).collect(),
        error: solution
            .total
            .iter()
            .map(|total| total.error_estimate.map(error))
            .collect(),
    };
    let patches = solution.patches.iter();
    let bounds = patches.clone().map(|patch| patch.friction_limit_n);
    let normal: f64 = patches.map(|patch| patch.normal_force_n).sum();
    let curve = Curve {
        title,
        remarks: vec![format!(
            "{} motions, normal force {} N",
            points.len(),
            short(normal)
        )],
        x_name: x_name.to_owned(),
        x,
        lines: vec![
            line("force x (along rolling)", |t| t.force_x_n, |e| e.force_x_n),
            line("force y (across)", |t| t.force_y_n, |e| e.force_y_n),
        ],
        bound: bounds.sum(),
    };
    Ok(Box::new(move |width| Ok(curve::draw(&curve, width))))
}

/// Returns the component of the motion with the largest spread, and its values; for a history the distance. Spin is weighted by the length of
/// the patch.
fn varying(points: &[PointSolution]) -> (&'static str, Vec<f64>) {
    type Component = fn(&PointSolution) -> f64;
    let distance = |point: &PointSolution| Some(point.history?.distance_mm);
    if let Some(distances) = points.iter().map(distance).collect() {
        return ("distance rolled in mm", distances);
    }
    let first = points.first();
    let length = first.map_or(1.0, |point| point.normalised.length_mm);
    let components: [(&str, f64, Component); 3] = [
        ("creepage x", 1.0, |point| point.motion.creepage_x),
        ("creepage y", 1.0, |point| point.motion.creepage_y),
        ("spin in 1/mm", length, |point| point.motion.spin_per_mm),
    ];
    let spread = |weight: f64, of: Component| {
        let values = points.iter().map(of);
        let most = values.clone().fold(f64::NEG_INFINITY, f64::max);
        weight * (most - values.fold(f64::INFINITY, f64::min))
    };
    let most = components
        .into_iter()
        .max_by(|a, b| spread(a.1, a.2).total_cmp(&spread(b.1, b.2)));
    let (name, _, of) = most.unwrap_or(components[0]);
    (name, points.iter().map(of).collect())
}

async fn profiles_drawing(
    jobs: &Jobs,
    id: Uuid,
    title: String,
    solution: Solution,
) -> Result<Drawing> {
    let mut patches = Vec::new();
    for (number, patch) in solution.patches.iter().enumerate() {
        // A wheelset has two wheels in every position.
        let Some(position) = patch.position.filter(|_| solution.wheelset.is_none()) else {
            let detail = "only contacts of the type `profiles` have one wheel and one rail";
            return Err(ApiError::bad_parameter("view", detail));
        };
        let cells = match jobs.patch_fields(id, number, Some(0)).await {
            Err(JobsError::NoSuchPatch(_)) => PatchCells::default(),
            fields => fields?.meshes.pop().unwrap_or_default(),
        };
        patches.push(ProfileViewPatch { position, cells });
    }
    let case = jobs.case(id).await?;
    let jobs = jobs.clone();
    Ok(Box::new(move |width| {
        let case: Value = serde_json::from_slice(&case).map_err(ApiError::internal)?;
        // The case was checked when it was submitted.
        let checked = jobs.check(&case).map_err(ApiError::from)?;
        let understood = checked.understood().map_err(ApiError::internal)?;
        let placed = understood
            .placement
            .ok_or_else(|| ApiError::internal("a case of profiles without a placement"))?;
        let mut cells = patches.iter().map(|patch| &patch.cells);
        let pressed = match cells.any(|cells| cells.pressure_mpa.is_some()) {
            true => "pressure stands on the rail",
            false => "without `pressure` among its outputs",
        };
        let count = match patches.len() {
            1 => "1 patch".to_owned(),
            count => format!("{count} patches"),
        };
        let loads = solution.patches.iter().enumerate().map(|(number, patch)| {
            let (force, pressure) = (patch.normal_force_n, patch.pressure_max_mpa);
            format!("{number}: {} N, {} MPa", short(force), short(pressure))
        });
        let loads: Vec<String> = loads.collect();
        let view = ProfileView {
            title,
            remarks: vec![format!("{count}; {pressed}"), loads.join("; ")],
            placed,
            lowering: solution.wheel_lowering_mm.unwrap_or(0.0),
            patches,
        };
        Ok(profile_view::draw(&view, width))
    }))
}

/// Default width of a picture in pixels.
pub(crate) const WIDTH_DEFAULT: u32 = 800;
/// Least width in pixels of the views other than `patch`, whose text would be unreadable on narrower ones.
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
    PlotQuery {
        /// `patch` (default): one patch from above; `section`: traction and friction bound along x and y, through the largest traction of a
        /// patch; `curve`: forces over the motions, with their errors; `profiles`: every patch on wheel and rail, with its pressure if
        /// requested
        #[param(inline, example = "curve")]
        view: View as View = reader(View::ALL.map(View::name).join(", "), View::from_name);
        /// Field of the view `patch`: `traction` (default), `pressure`, `slip`, `temperature` or `zones`; must be an output of the case. If
        /// `zones` is an output too, the border of the stick zone is drawn
        #[param(example = "traction")]
        field: Output as String = word(&FIELDS);
        /// Width in pixels; default 800. The height follows from the patch. Below 200, only the patch is drawn, for lists
        #[param(minimum = 48, maximum = 2400)]
        width: u32 as u32 = count(WIDTH[0], WIDTH[1]);
        /// For the view `patch`: `low,high`, both ends of the scale in the unit of the field, so that pictures can share a scale; default:
        /// 0 to the largest value. Not for zones
        #[param(example = "0,400")]
        range: [f64; 2] as String = reader("`low,high`: two numbers, the second above the first; their difference is finite and at least 1e-9 of the larger one", range);
    }
}

/// Parses two finite numbers, the second above the first.
fn range(text: &str) -> Option<[f64; 2]> {
    let (low, high) = text.split_once(',')?;
    let (low, high): (f64, f64) = (low.trim().parse().ok()?, high.trim().parse().ok()?);
    let wide = high - low;
    // The ticks of a narrower range would have equal labels.
    let apart = wide > 1e-9 * low.abs().max(high.abs());
    (low.is_finite() && high.is_finite() && wide.is_finite() && apart).then_some([low, high])
}

impl PlotOptions {
    fn read(uri: &Uri) -> Result<PlotOptions> {
        let (place, query) = <(PlaceQuery, PlotQuery)>::read(uri)?;
        let shown = query.field.unwrap_or(Output::Tractions);
        if shown == Output::Zones && query.range.is_some() {
            let detail = "zones have no scale; leave `range` out";
            return Err(ApiError::bad_parameter("range", detail));
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
            place: place.place(),
            width: query.width.unwrap_or(WIDTH_DEFAULT),
        })
    }
}

/// Draws a patch, or another view of the result, as SVG.
///
/// The view `patch` is a heat map inside the border of the patch, with a scale, the border of the stick zone, arrows along the traction or
/// slip, axes in mm with equal scales, and the rolling direction. It is readable without colour.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/plot.svg",
    tag = "results",
    operation_id = "get_plot_svg",
    params(("id" = String, Path, description = "Id of the job", format = "uuid"), PlaceQuery, PlotQuery),
    responses((status = 200, description = "The picture", content((String = "image/svg+xml"))), FieldProblems)
)]
pub(crate) async fn svg(request: PartRequest) -> Result<Response> {
    plot(&request, Format::Svg).await
}

/// Draws the same picture as PNG.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/plot.png",
    tag = "results",
    operation_id = "get_plot_png",
    params(("id" = String, Path, description = "Id of the job", format = "uuid"), PlaceQuery, PlotQuery),
    responses((status = 200, description = "The picture", content((File = "image/png"))), FieldProblems)
)]
pub(crate) async fn png(request: PartRequest) -> Result<Response> {
    plot(&request, Format::Png).await
}

async fn plot(request: &PartRequest, format: Format) -> Result<Response> {
    let options = PlotOptions::read(&request.uri)?;
    let drawn = picture(request, options, format);
    request.unless_known(format, drawn).await
}

/// Draws the picture.
///
/// # Errors
/// The output was not asked for, there is no such patch or motion, or there is no result.
pub(crate) async fn picture(
    request: &PartRequest,
    options: PlotOptions,
    format: Format,
) -> Result<Response> {
    // The pixels exist only while the picture is drawn; the response is small.
    let rendering = request.rendering(0).await?;
    let (jobs, id) = (&request.jobs, request.id);
    let job = jobs.get(id).await?;
    let title = job.name.unwrap_or_else(|| format!("job {id}"));
    let drawing = drawing(request, title, options).await?;
    let draw = move || {
        let svg = drawing(options.width)?;
        match format {
            Format::Png => raster::png(&svg, options.width).map_err(ApiError::internal),
            _ => Ok(svg.finish().into_bytes()),
        }
    };
    let (body, share) = rendering.run(draw, Vec::len).await?;
    let mut response = ([(header::CONTENT_TYPE, format.media_type())], body).into_response();
    // Browsers open pictures: scripts must not run even if a name contains one.
    response.headers_mut().insert(
        header::CONTENT_SECURITY_POLICY,
        HeaderValue::from_static("default-src 'none'; style-src 'unsafe-inline'; sandbox"),
    );
    response
        .headers_mut()
        .extend(format.disposition(&format!("plot-{id}")));
    Ok(hold_while_sent(response, share))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (0.001, "0.001"),
            (-0.0004, "−4e−4"),
            (1.25e-12, "1.25e−12"),
            (100_000.0, "100000"),
            (1234.56, "1235"),
            (12.3456, "12.35"),
            (-3.0, "−3"),
        ] {
            assert_eq!(short(value), text);
        }
    }
}
