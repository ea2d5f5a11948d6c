//! Pictures of a contact patch: a heat map of the cells, the border of the stick zone, arrows, axes in mm and a scale.

mod colour;
mod frame;
mod layers;
pub mod raster;
mod svg;

use crate::contact::case::Output;
use crate::contact::solution::{PatchCells, PointFields};
use crate::contact::zones::Zone;
use crate::http::render::picture::frame::{Frame, WIDTH};
use crate::http::render::picture::svg::{Anchor, FONTS, Svg, escape, px, shorten};

/// Characters of a title that fit.
const TITLE_MAX: usize = 74;

/// What a picture shows.
#[derive(Debug, Clone)]
pub struct Scene {
    /// First line, a text of the client.
    pub title: String,
    /// Smaller lines below, two at most.
    pub remarks: Vec<String>,
    /// The field that is coloured.
    pub shown: Output,
    /// The cells.
    pub fields: PatchCells,
    /// The values of one motion.
    pub values: PointFields,
}

/// The coloured values: magnitudes per cell, their name and unit.
struct Heat {
    values: Vec<f64>,
    label: &'static str,
    unit: &'static str,
}

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

/// The magnitudes that a heat map shows; `None` for zones.
fn heat(scene: &Scene) -> Option<Heat> {
    let magnitude = |x: &Option<Vec<f64>>, y: &Option<Vec<f64>>| {
        let (x, y) = (x.as_deref().unwrap_or(&[]), y.as_deref().unwrap_or(&[]));
        x.iter().zip(y).map(|(x, y)| x.hypot(*y)).collect()
    };
    let values = &scene.values;
    match scene.shown {
        Output::Tractions => Some(Heat {
            values: magnitude(&values.traction_x_mpa, &values.traction_y_mpa),
            label: "traction",
            unit: "MPa",
        }),
        Output::Pressure => Some(Heat {
            values: scene.fields.pressure_mpa.clone().unwrap_or_default(),
            label: "pressure",
            unit: "MPa",
        }),
        Output::Slip => Some(Heat {
            values: magnitude(&values.slip_x, &values.slip_y),
            label: "slip / rolling speed",
            unit: "",
        }),
        Output::Zones | Output::Resultants => None,
    }
}

/// Box around the cells in mm.
fn extent(fields: &PatchCells) -> [f64; 4] {
    let mut shape = [
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ];
    for cell in 0..fields.x_mm.len() {
        let (x, y) = (fields.x_mm[cell], fields.y_mm[cell]);
        let (dx, dy) = (0.5 * fields.dx_mm[cell], 0.5 * fields.dy_mm[cell]);
        shape = [
            shape[0].min(x - dx),
            shape[1].max(x + dx),
            shape[2].min(y - dy),
            shape[3].max(y + dy),
        ];
    }
    if shape.iter().all(|value| value.is_finite()) {
        shape
    } else {
        [-1.0, 1.0, -1.0, 1.0]
    }
}

/// Does any cell stick, or slip?
fn zones_present(scene: &Scene) -> (bool, bool) {
    let zones = scene.values.zone.as_deref().unwrap_or(&[]);
    (zones.contains(&Zone::Stick), zones.contains(&Zone::Slip))
}
