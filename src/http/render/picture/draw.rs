//! Draws a scene as SVG: heat map or zones, the border of the stick zone, arrows, axes in mm and a scale.

use crate::contact::case::words::solver::Output;
use crate::http::render::picture::frame::{Frame, WIDTH};
use crate::http::render::picture::layers;
use crate::http::render::picture::scene::{Scene, extent, heat};
use crate::http::render::picture::svg::{Anchor, FONTS, Svg, escape, px, shorten};

/// Characters of a title that fit.
const TITLE_MAX: usize = 74;

/// Draws a scene as SVG, `width` pixels wide.
#[must_use]
pub fn draw(scene: &Scene, width: u32) -> String {
    let frame = Frame::around(extent(&scene.fields));
    let height = frame.height();
    let shown_height = f64::from(width) * height / WIDTH;
    let mut svg = Svg::default();
    svg.raw(&format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{}\" viewBox=\"0 0 {WIDTH} {}\" font-family=\"{FONTS}\" role=\"img\">\n",
        px(shown_height),
        px(height),
    ));
    svg.raw(&format!("<title>{}</title>\n", escape(&scene.title)));
    svg.raw(&format!(
        "<desc>{}</desc>\n",
        escape(&scene.remarks.join("; "))
    ));
    svg.element("rect", "width=\"100%\" height=\"100%\" fill=\"#fff\"");
    let title = shorten(&scene.title, TITLE_MAX);
    svg.text(
        (frame.area[0], 28.0),
        17.0,
        Anchor::Start,
        "fill=\"#111\"",
        &title,
    );
    for (line, remark) in scene.remarks.iter().enumerate() {
        let y = if line == 0 { 48.0 } else { 65.0 };
        svg.text(
            (frame.area[0], y),
            12.0,
            Anchor::Start,
            "fill=\"#444\"",
            remark,
        );
    }
    layers::grid(&mut svg, &frame);
    match heat(scene) {
        Some(heat) => {
            let largest = heat.values.iter().copied().fold(0.0, f64::max);
            layers::heat_map(&mut svg, &frame, &scene.fields, &heat.values, largest);
            layers::colour_bar(&mut svg, &frame, &heat, largest);
        }
        None => layers::zone_map(
            &mut svg,
            &frame,
            &scene.fields,
            scene.values.zone.as_deref(),
        ),
    }
    layers::outlines_of(&mut svg, &frame, scene);
    let arrows = match scene.shown {
        Output::Slip => (&scene.values.slip_x, &scene.values.slip_y),
        Output::Pressure => (&None, &None),
        _ => (&scene.values.traction_x_mpa, &scene.values.traction_y_mpa),
    };
    let drawn = match arrows {
        (Some(x), Some(y)) => layers::arrows(&mut svg, &frame, &scene.fields, x, y),
        _ => false,
    };
    layers::axes(&mut svg, &frame);
    layers::legend(&mut svg, &frame, scene, drawn);
    svg.raw("</svg>\n");
    svg.finish()
}
