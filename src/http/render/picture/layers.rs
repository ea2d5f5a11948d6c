//! Arrows and legend of a picture.

use crate::render::picture::chart::Chart;
use crate::render::picture::colour::{SLIP, STICK};
use crate::render::picture::scene::{Scene, extent, zones_present};
use crate::render::picture::svg::{Anchor, Svg, polyline, px};
use crate::render::shape::resample::resample;
use railhead_contact::case::words::solver::Output;
use railhead_contact::solution::words::answer::PatchCells;

/// Distance between arrows.
const ARROW_SPACING: f64 = 30.0;
/// Length of the longest arrow.
const ARROW_LENGTH: f64 = 27.0;
/// Length below which an arrow is omitted.
const ARROW_SHORTEST: f64 = 2.0;

/// Draws arrows on a regular grid, each centred on its sample. Returns whether any was drawn.
pub(super) fn arrows(
    svg: &mut Svg,
    chart: &Chart,
    fields: &PatchCells,
    along: &[f64],
    across: &[f64],
) -> bool {
    let shape = extent(fields);
    let count = |length: f64| {
        let arrows = length * chart.scale() / ARROW_SPACING;
        arrows.round().clamp(2.0, 100.0) as usize
    };
    let (nx, ny) = (count(shape[1] - shape[0]), count(shape[3] - shape[2]));
    let x = resample(fields, along, nx, ny);
    let y = resample(fields, across, nx, ny);
    let cells = along.iter().zip(across);
    let longest = cells.map(|(x, y)| x.hypot(*y)).fold(0.0, f64::max);
    if longest <= 0.0 {
        return false;
    }
    let mut data = String::new();
    for (iy, row) in x.values.iter().enumerate() {
        for (ix, along) in row.iter().enumerate() {
            let (Some(along), Some(across)) = (along, y.values[iy][ix]) else {
                continue;
            };
            // The second axis of the picture points downward.
            let arrow = [along, &-across].map(|part| part / longest * ARROW_LENGTH);
            if arrow[0].hypot(arrow[1]) >= ARROW_SHORTEST {
                data.push_str(&arrow_path(chart.at(x.x_mm[ix], x.y_mm[iy]), arrow));
            }
        }
    }
    svg.raw("<g fill=\"none\" stroke-linecap=\"round\" stroke-linejoin=\"round\">\n");
    svg.path(&data, "stroke=\"#fff\" stroke-width=\"2.8\"");
    svg.path(&data, "stroke=\"#000\" stroke-width=\"1.2\"");
    svg.raw("</g>\n");
    true
}

/// Returns the path of an arrow centred on a position.
fn arrow_path((x, y): (f64, f64), [dx, dy]: [f64; 2]) -> String {
    let length = dx.hypot(dy);
    let head = (0.35 * length).clamp(1.5, 6.0) / length;
    let (tip_x, tip_y) = (x + 0.5 * dx, y + 0.5 * dy);
    let stroke = |side: f64| {
        let (back_x, back_y) = (-dx * head, -dy * head);
        (
            tip_x + back_x - side * 0.5 * back_y,
            tip_y + back_y + side * 0.5 * back_x,
        )
    };
    let shaft = polyline([(x - 0.5 * dx, y - 0.5 * dy), (tip_x, tip_y)], false);
    shaft + &polyline([stroke(1.0), (tip_x, tip_y), stroke(-1.0)], false)
}

/// Draws the arrow of the rolling direction.
pub(super) fn rolling(svg: &mut Svg, chart: &Chart) {
    let [x, y, width, height] = chart.area;
    let (end, bottom) = (x + width, y + height);
    let place = (end - 52.0, bottom + 39.0);
    svg.text(place, 12.0, Anchor::End, "", "rolling");
    let arrow = arrow_path((end - 24.0, bottom + 35.0), [44.0, 0.0]);
    svg.path(&arrow, "fill=\"none\" stroke=\"#111\" stroke-width=\"1.8\"");
}

/// Draws the legend of lines and arrows below the axes.
pub(super) fn legend(svg: &mut Svg, chart: &Chart, scene: &Scene, arrows: bool) {
    let y = chart.area[1] + chart.area[3] + 66.0;
    let mut x = chart.area[0];
    let (stick, slip) = zones_present(scene);
    if scene.shown == Output::Zones {
        for (colour, word, present) in [(STICK, "stick", stick), (SLIP, "slip", slip)] {
            let word = match present {
                true => word.to_owned(),
                false => format!("{word} (nowhere)"),
            };
            let style = format!("fill=\"{colour}\" stroke=\"#111\"");
            svg.rect([x, y - 10.0, 22.0, 12.0], &style);
            svg.text((x + 28.0, y), 12.0, Anchor::Start, "", &word);
            x += if present { 84.0 } else { 150.0 };
        }
    } else if scene.values.zone.is_some() {
        if stick {
            let data = format!("M{} {}h26", px(x), px(y - 4.0));
            svg.path(&data, "stroke=\"#000\" stroke-width=\"3.4\"");
            svg.path(&data, "stroke=\"#fff\" stroke-width=\"1.6\"");
            let text = match slip {
                true => "border of the stick zone",
                false => "stick everywhere",
            };
            svg.text((x + 33.0, y), 12.0, Anchor::Start, "", text);
            x += 210.0;
        } else {
            svg.text((x, y), 12.0, Anchor::Start, "", "slip everywhere");
            x += 120.0;
        }
    }
    if arrows {
        let text = match scene.shown {
            Output::Slip => "slip of the upper body against the lower",
            _ => "traction on the lower body",
        };
        let arrow = arrow_path((x + 14.0, y - 4.0), [ARROW_LENGTH, 0.0]);
        svg.path(&arrow, "fill=\"none\" stroke=\"#000\" stroke-width=\"1.2\"");
        svg.text((x + 35.0, y), 12.0, Anchor::Start, "", text);
    }
}
