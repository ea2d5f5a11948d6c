//! Draws a wheel on a rail, seen along the rolling direction, with the pressure of every patch on the rail.

use crate::render::picture::chart::{Chart, WIDTH, open};
use crate::render::picture::svg::{Anchor, Svg, polyline, px};
use crate::render::shape::sheet::bounds;
use railhead_contact::solution::words::answer::{PatchCells, PlacedProfiles, Position};

/// Range of z relative to the top of the rail, in mm.
const SHOWN_Z: [f64; 2] = [-38.0, 34.0];
/// Space next to the rail in mm, for the pressure and the number of a patch at the gauge face.
const BESIDE: f64 = 30.0;
/// Height of the largest pressure in mm.
const COMB: f64 = 16.0;
/// Distance of the numbers of patches from the rail in mm.
const TAG: f64 = 22.0;
const LEFT: f64 = 62.0;
const TOP: f64 = 96.0;
const BELOW: f64 = 62.0;

/// Wheel and rail with their patches.
#[derive(Debug, Clone)]
pub(crate) struct ProfileView {
    /// The title, a text of the client.
    pub title: String,
    /// At most two lines below the title.
    pub remarks: Vec<String>,
    /// Positions of both profiles, the wheel at first contact.
    pub placed: PlacedProfiles,
    /// Vertical displacement of the wheel below first contact in mm.
    pub lowering: f64,
    /// The patches.
    pub patches: Vec<ProfileViewPatch>,
}

/// A patch on the rail.
#[derive(Debug, Clone)]
pub(crate) struct ProfileViewPatch {
    /// Its position.
    pub position: Position,
    /// Its cells, with the pressure if the case requests it.
    pub cells: PatchCells,
}

/// Draws wheel and rail as SVG, `width` pixels wide.
#[must_use]
pub(crate) fn draw(view: &ProfileView, width: u32) -> Svg {
    let rail = &view.placed.rail_mm;
    let [right, left, _, top] = bounds(rail.iter().copied());
    let [right, left] = [right - BESIDE, left + BESIDE];
    let area_width = WIDTH - LEFT - 24.0;
    let scale = area_width / (left - right);
    let height = scale * (SHOWN_Z[1] - SHOWN_Z[0]);
    let chart = Chart {
        area: [LEFT, TOP, area_width, height],
        // y points to the left, seen along the track.
        x: [left, right],
        y: SHOWN_Z.map(|z| top + z),
    };
    let whole = TOP + height + BELOW;
    let mut svg = open(&view.title, &view.remarks, width, whole);
    let [x, y, w, h] = chart.area.map(px);
    svg.raw(&format!(
        "<clipPath id=\"area\"><rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\"/></clipPath>\n<g clip-path=\"url(#area)\">\n"
    ));
    chart.grid(&mut svg);
    body(
        &mut svg,
        &chart,
        rail,
        0.0,
        chart.y[0],
        ["#cdd5db", "#5b6a76"],
    );
    let wheel = &view.placed.wheel_mm;
    body(
        &mut svg,
        &chart,
        wheel,
        -view.lowering,
        chart.y[1],
        ["#e6ddcd", "#85704b"],
    );
    combs(&mut svg, &chart, &view.patches);
    svg.raw("</g>\n");
    chart.axes(&mut svg, ["y to the left in mm", "z up in mm"]);
    for (y, fill, word) in [
        (TOP + 20.0, "fill=\"#6b5632\"", "wheel"),
        (TOP + height - 12.0, "fill=\"#46535e\"", "rail"),
    ] {
        svg.text((LEFT + 12.0, y), 13.0, Anchor::Start, fill, word);
    }
    svg
}

/// Draws a cross-section, raised by a distance, filled up to a height.
fn body(
    svg: &mut Svg,
    chart: &Chart,
    line: &[[f64; 2]],
    raised: f64,
    edge: f64,
    [fill, stroke]: [&str; 2],
) {
    let places: Vec<(f64, f64)> = line.iter().map(|[y, z]| chart.at(*y, z + raised)).collect();
    let (Some(first), Some(last)) = (line.first(), line.last()) else {
        return;
    };
    // The area extends beyond the picture, so that the sides of the body are not visible.
    let beyond = edge + (edge - 0.5 * (chart.y[0] + chart.y[1]));
    let corners = [chart.at(last[0], beyond), chart.at(first[0], beyond)];
    let closed = polyline(places.iter().copied().chain(corners), true);
    svg.path(&closed, &format!("fill=\"{fill}\" fill-opacity=\"0.9\""));
    svg.path(
        &polyline(places, false),
        &format!("fill=\"none\" stroke=\"{stroke}\" stroke-width=\"1.3\""),
    );
}

/// Draws the largest pressure of every strip on the rail, and the number of each patch.
fn combs(svg: &mut Svg, chart: &Chart, patches: &[ProfileViewPatch]) {
    let pressures = |patch: &ProfileViewPatch| patch.cells.pressure_mpa.clone().unwrap_or_default();
    let largest = patches.iter().flat_map(pressures).fold(0.0, f64::max);
    for (number, patch) in patches.iter().enumerate() {
        let (sin, cos) = patch.position.contact_angle_rad.sin_cos();
        let [_, y0, z0] = patch.position.origin_track_mm;
        let on = |across: f64, up: f64| {
            chart.at(y0 + across * cos - up * sin, z0 + across * sin + up * cos)
        };
        let comb = comb(&patch.cells);
        if largest > 0.0 && !comb.is_empty() {
            let foot = comb.iter().map(|[across, _]| on(*across, 0.0));
            let back = comb.iter().rev();
            let shape = foot.chain(back.map(|[across, p]| on(*across, p / largest * COMB)));
            let style = "fill=\"#2a78b8\" fill-opacity=\"0.75\" stroke=\"#0b5a9e\"";
            svg.path(&polyline(shape, true), style);
        }
        let [_, y, z] = patch.position.track_mm;
        let (x, foot) = chart.at(y, z);
        let (tag_x, tag_y) = chart.at(y - TAG * sin, z + TAG * cos);
        svg.path(
            &polyline([(x, foot), (tag_x, tag_y)], false),
            "stroke=\"#111\" stroke-dasharray=\"2 3\"",
        );
        let place = format!("cx=\"{}\" cy=\"{}\"", px(tag_x), px(tag_y));
        svg.element("circle", &format!("{place} r=\"11\" fill=\"#0b5a9e\""));
        let at = (tag_x, tag_y + 4.5);
        svg.text(
            at,
            12.0,
            Anchor::Middle,
            "fill=\"#fff\"",
            &number.to_string(),
        );
    }
}

/// Returns `[y, pressure]` of the strips of a patch, with the largest pressure of each strip, and zero at both ends.
fn comb(cells: &PatchCells) -> Vec<[f64; 2]> {
    let Some(pressure) = &cells.pressure_mpa else {
        return Vec::new();
    };
    let mut strips: Vec<(u32, [f64; 3])> = Vec::new();
    for (cell, strip) in cells.strip.iter().enumerate() {
        let [y, half, p] = [cells.y_mm[cell], 0.5 * cells.dy_mm[cell], pressure[cell]];
        match strips.iter_mut().find(|(known, _)| known == strip) {
            Some((_, values)) => values[2] = values[2].max(p),
            None => strips.push((*strip, [y, half, p])),
        }
    }
    strips.sort_by(|a, b| a.1[0].total_cmp(&b.1[0]));
    let (Some((_, first)), Some((_, last))) = (strips.first(), strips.last()) else {
        return Vec::new();
    };
    let ends = [[first[0] - first[1], 0.0], [last[0] + last[1], 0.0]];
    let middles = strips.iter().map(|(_, [y, _, p])| [*y, *p]);
    [ends[0]]
        .into_iter()
        .chain(middles)
        .chain([ends[1]])
        .collect()
}
