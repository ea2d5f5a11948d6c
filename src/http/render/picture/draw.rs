//! Draws a scene as SVG: heat map or zones, the border of the stick zone, arrows, axes in mm and a scale; or small, the patch alone.

use crate::render::picture::bar::colour_bar;
use crate::render::picture::chart::{Chart, WIDTH, open};
use crate::render::picture::layers;
use crate::render::picture::map::Ground;
use crate::render::picture::scene::{Scene, heat};
use crate::render::picture::svg::{Svg, escape, px};
use railhead_contact::case::words::solver::Output;

/// Pictures narrower than this show the patch alone: nothing written on them could be read.
const ALONE_BELOW: u32 = 200;
/// Colours of a scale: from this many on the eye sees no steps.
const BANDS: u32 = 48;
/// Colours in a picture of the patch alone.
const BANDS_ALONE: u32 = 14;
/// By how much a curve may be missed, in pixels.
const TOLERANCE: f64 = 0.2;

/// Draws a scene as SVG, `width` pixels wide.
#[must_use]
pub(crate) fn draw(scene: &Scene, width: u32) -> Svg {
    if width < ALONE_BELOW {
        return draw_alone(scene, width);
    }
    let ground = Ground::of(
        scene,
        BANDS,
        TOLERANCE * (WIDTH / f64::from(width)).max(1.0),
    );
    let chart = Chart::around(ground.extent());
    let mut svg = open(&scene.title, &scene.remarks, width, chart.height());
    chart.grid(&mut svg);
    match heat(scene) {
        Some(heat) => {
            let range = heat.range(scene.range);
            ground.heat(&mut svg, &chart, &heat, range);
            colour_bar(&mut svg, &chart, &heat, range);
        }
        None => ground.zones(&mut svg, &chart),
    }
    ground.borders(&mut svg, &chart);
    let arrows = match scene.shown {
        Output::Slip => (&scene.values.slip_x, &scene.values.slip_y),
        Output::Pressure | Output::Temperature => (&None, &None),
        _ => (&scene.values.traction_x_mpa, &scene.values.traction_y_mpa),
    };
    let drawn = match arrows {
        (Some(x), Some(y)) => layers::arrows(&mut svg, &chart, &scene.fields, x, y),
        _ => false,
    };
    chart.axes(&mut svg, ["x in mm", "y in mm"]);
    layers::rolling(&mut svg, &chart);
    layers::legend(&mut svg, &chart, scene, drawn);
    svg.raw("</svg>\n");
    svg
}

/// Draws the patch of a scene alone, for lists.
fn draw_alone(scene: &Scene, width: u32) -> Svg {
    let ground = Ground::of(scene, BANDS_ALONE, 1.5 * TOLERANCE);
    let chart = Chart::alone(ground.extent(), f64::from(width));
    let height = px(chart.height_alone());
    let mut svg = Svg::default();
    svg.raw(&format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" role=\"img\">\n",
    ));
    svg.raw(&format!("<title>{}</title>\n", escape(&scene.title)));
    match heat(scene) {
        Some(heat) => ground.heat(&mut svg, &chart, &heat, heat.range(scene.range)),
        None => ground.zones(&mut svg, &chart),
    }
    ground.border_thin(&mut svg, &chart);
    svg.raw("</svg>\n");
    svg
}
