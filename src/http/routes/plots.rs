//! `/v1/jobs/{id}/plot.svg` and `/plot.png`: a picture of one patch for one motion.

use axum::http::{HeaderValue, Uri, header};
use axum::response::{IntoResponse, Response};

use crate::contact::case::words::solver::Output;
use crate::contact::solution::words::PointSolution;
use crate::http::extract::accept::Format;
use crate::http::extract::query::{Parameters, count, index, query, reader, require_index};
use crate::http::limits::holding_body::hold_while_sent;
use crate::http::problem::error::ApiError;
use crate::http::render::picture::draw::draw;
use crate::http::render::picture::raster;
use crate::http::render::picture::scene::Scene;
use crate::http::render::table::File;
use crate::http::routes::part_request::PartRequest;
use crate::http::routes::stored_fields::{FieldProblems, stored};

/// Width of a picture in pixels when nothing is said.
pub const WIDTH_DEFAULT: u32 = 800;
/// Limits of the width in pixels.
const WIDTH: [u32; 2] = [48, 2400];

query! {
    /// The parameters of a picture.
    PlotQuery(() => ()) {
        /// `traction` (when left out), `pressure`, `slip` or `zones`; the case has to ask for that output. The border of the stick
        /// zone is drawn if it asks for `zones` too
        #[param(example = "traction")]
        field: Output as String = reader("`traction`, `pressure`, `slip` or `zones`", |text| match text {
            "traction" => Some(Output::Tractions),
            "pressure" => Some(Output::Pressure),
            "slip" => Some(Output::Slip),
            "temperature" => Some(Output::Temperature),
            "zones" => Some(Output::Zones),
            _ => None,
        });
        /// The motion, counted from 0; 0 when left out
        point: usize as u32 = index();
        /// The patch, counted from 0; 0 when left out
        patch: usize as u32 = index();
        /// Width in pixels; 800 when left out. The height follows from the patch. Below 200 the patch is drawn alone, for lists
        #[param(minimum = 48, maximum = 2400)]
        width: u32 as u32 = count(WIDTH[0], WIDTH[1]);
        /// `low,high`: the values at both ends of the scale, in the unit of the field, so that several pictures share one; from 0 to the
        /// largest value of the picture when left out. Zones have none
        #[param(example = "0,400")]
        range: [f64; 2] as String = reader("`low,high`: two numbers, the second above the first", range);
    }
}

/// What a picture shows, and how wide it is.
#[derive(Debug, Clone, Copy)]
pub struct PlotOptions {
    /// The field.
    pub shown: Output,
    /// Number of the patch.
    pub patch: usize,
    /// Number of the motion.
    pub point: usize,
    /// Width in pixels.
    pub width: u32,
    /// Both ends of the scale, if they are given.
    pub range: Option<[f64; 2]>,
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
        Ok(PlotOptions {
            shown,
            range: query.range,
            patch: query.patch.unwrap_or(0),
            point: query.point.unwrap_or(0),
            width: query.width.unwrap_or(WIDTH_DEFAULT),
        })
    }
}

/// A picture of a patch as SVG.
///
/// A smooth heat map inside the border of the patch with a scale, the border of the stick zone, arrows along the traction or the slip, axes in mm with the same
/// scale, and the rolling direction. Readable without colour.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/plot.svg",
    tag = "results",
    operation_id = "get_plot_svg",
    params(("id" = String, Path, description = "Id of the job", format = "uuid"), PlotQuery),
    responses((status = 200, description = "The picture", content((String = "image/svg+xml"))), FieldProblems)
)]
pub async fn svg(request: PartRequest) -> Result<Response, ApiError> {
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
pub async fn png(request: PartRequest) -> Result<Response, ApiError> {
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
pub async fn picture(
    request: &PartRequest,
    wish: PlotOptions,
    format: Format,
) -> Result<Response, ApiError> {
    // Its pixels are there during its turn only; what is sent is small.
    let rendering = request.rendering(0).await?;
    let (jobs, id) = (&request.jobs, request.id);
    let job = jobs.get(id).await?;
    let solution = jobs.solution(id).await?;
    let patches = solution.patches.len();
    require_index("patch", Some(wish.patch), patches)?;
    let points = &solution.patches[wish.patch].points;
    require_index("point", Some(wish.point), points.len())?;
    let (fields, values) = stored(jobs, id, wish.patch, wish.point, wish.shown).await?;
    let normal = solution.patches[wish.patch].normal_force_n;
    let counted = counted(wish, patches, points.len());
    let remarks = remarks(&points[wish.point], normal, &counted);
    let scene = Scene {
        title: job.name.unwrap_or_else(|| format!("job {id}")),
        remarks,
        shown: wish.shown,
        range: wish.range,
        fields,
        values,
    };
    let draw = move || {
        let svg = draw(&scene, wish.width);
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
    Ok(hold_while_sent(response, share))
}

/// Which patch and motion this is, where there are several.
fn counted(wish: PlotOptions, patches: usize, points: usize) -> String {
    let mut text = String::new();
    if patches > 1 {
        text += &format!(", patch {} of 0 to {}", wish.patch, patches - 1);
    }
    if points > 1 {
        text += &format!(", point {} of 0 to {}", wish.point, points - 1);
    }
    text
}

/// Motion and forces in two lines.
fn remarks(point: &PointSolution, normal: f64, counted: &str) -> Vec<String> {
    let motion = point.motion;
    // What rounding leaves of a force that is nothing.
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

/// A number with four digits that count.
fn short(value: f64) -> String {
    let size = value.abs();
    let text = if size == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e4).contains(&size) {
        let digits = (3.0 - size.log10().floor()).clamp(0.0, 6.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "from 0 to 6"
        )]
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
