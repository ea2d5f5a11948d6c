//! Draws a patch: heat map or zones, the border of the stick zone, arrows, axes in mm and a scale; or the patch alone.

use crate::render::picture::bar::colour_bar;
use crate::render::picture::chart::{Chart, WIDTH, open};
use crate::render::picture::layers;
use crate::render::picture::map::PatchMap;
use crate::render::picture::scene::{Scene, heat};
use crate::render::picture::svg::{Svg, escape, px};
use railhead_contact::case::words::solver::Output;

/// Width in pixels below which the patch is drawn alone, because text would be unreadable.
const ALONE_BELOW: u32 = 200;
/// Number of colours of the scale; the eye sees no steps between this many.
const BANDS: u32 = 48;
/// Number of colours in a picture of the patch alone.
const BANDS_ALONE: u32 = 14;
/// Tolerance of simplified curves in pixels.
const TOLERANCE: f64 = 0.2;

/// Draws a scene as SVG, `width` pixels wide.
#[must_use]
pub(crate) fn draw(scene: &Scene, width: u32) -> Svg {
    if width < ALONE_BELOW {
        return draw_alone(scene, width);
    }
    let map = PatchMap::of(
        scene,
        BANDS,
        TOLERANCE * (WIDTH / f64::from(width)).max(1.0),
    );
    let chart = Chart::around(map.extent());
    let mut svg = open(&scene.title, &scene.remarks, width, chart.height());
    chart.grid(&mut svg);
    match heat(scene) {
        Some(heat) => {
            let range = heat.range(scene.range);
            map.heat(&mut svg, &chart, &heat, range);
            colour_bar(&mut svg, &chart, &heat, range);
        }
        None => map.zones(&mut svg, &chart),
    }
    map.borders(&mut svg, &chart);
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
    svg
}

/// Draws a patch alone, for lists.
fn draw_alone(scene: &Scene, width: u32) -> Svg {
    let map = PatchMap::of(scene, BANDS_ALONE, 1.5 * TOLERANCE);
    let chart = Chart::alone(map.extent(), f64::from(width));
    let height = px(chart.height_alone());
    let mut svg = Svg::default();
    svg.raw(&format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" role=\"img\">\n",
    ));
    svg.raw(&format!("<title>{}</title>\n", escape(&scene.title)));
    match heat(scene) {
        Some(heat) => map.heat(&mut svg, &chart, &heat, heat.range(scene.range)),
        None => map.zones(&mut svg, &chart),
    }
    map.border_thin(&mut svg, &chart);
    svg
}
