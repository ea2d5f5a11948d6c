//! The layers of a picture, from the ground upward.

use std::fmt::Write;

use crate::contact::case::words::solver::Output;
use crate::contact::post::outlines::outline::{outlines, patch_outline};
use crate::contact::post::resample::resample;
use crate::contact::solution::words::PatchCells;
use crate::contact::solution::zone::Zone;
use crate::http::render::picture::colour::{LEVELS, SLIP, STICK, level, ramp};
use crate::http::render::picture::frame::{Frame, exponent, ticks};
use crate::http::render::picture::scene::{Heat, Scene, extent, zones_present};
use crate::http::render::picture::svg::{Anchor, Svg, polyline, px};

/// Distance between arrows.
const ARROW_SPACING: f64 = 30.0;
/// Length of the longest arrow.
const ARROW_LENGTH: f64 = 27.0;
/// Arrows shorter than this say nothing and are left out.
const ARROW_SHORTEST: f64 = 2.0;
/// Distance of the ticks of an axis, about.
const TICK_SPACING: f64 = 70.0;
/// Fewest ticks of an axis, about.
const TICKS_FEWEST: f64 = 4.0;

/// Thin lines at the ticks.
pub(super) fn grid(svg: &mut Svg, frame: &Frame) {
    let [x, y, width, height] = frame.area;
    let [x0, x1, y0, y1] = frame.shown;
    let mut data = String::new();
    for tick in ticks(x0, x1, width / TICK_SPACING).0 {
        let _ = write!(
            data,
            "M{} {}v{}",
            px(frame.at(tick, y0).0),
            px(y),
            px(height)
        );
    }
    for tick in ticks(y0, y1, (height / TICK_SPACING).max(TICKS_FEWEST)).0 {
        let _ = write!(
            data,
            "M{} {}h{}",
            px(x),
            px(frame.at(x0, tick).1),
            px(width)
        );
    }
    svg.path(&data, "fill=\"none\" stroke=\"#e6e6e6\"");
}

/// Rectangles of the given cells as one path.
fn rectangles(frame: &Frame, fields: &PatchCells, cells: impl Iterator<Item = usize>) -> String {
    let mut data = String::new();
    for cell in cells {
        let (dx, dy) = (fields.dx_mm[cell], fields.dy_mm[cell]);
        let left = fields.x_mm[cell] - 0.5 * dx;
        let (x, y) = frame.at(left, fields.y_mm[cell] + 0.5 * dy);
        let (w, h) = (dx * frame.scale, dy * frame.scale);
        let _ = write!(data, "M{} {}h{}v{}h-{}z", px(x), px(y), px(w), px(h), px(w));
    }
    data
}

/// One rectangle per cell, coloured from 0 to the largest value; cells of one colour are one path.
pub(super) fn heat_map(
    svg: &mut Svg,
    frame: &Frame,
    fields: &PatchCells,
    values: &[f64],
    largest: f64,
) {
    let mut cells_at: Vec<Vec<usize>> = vec![Vec::new(); LEVELS];
    for (cell, value) in values.iter().enumerate() {
        cells_at[level(value / largest)].push(cell);
    }
    // Crisp edges leave no light seams between cells.
    svg.raw("<g shape-rendering=\"crispEdges\">\n");
    for (level, cells) in cells_at.into_iter().enumerate() {
        if !cells.is_empty() {
            let data = rectangles(frame, fields, cells.into_iter());
            svg.path(&data, &format!("fill=\"{}\"", ramp(level)));
        }
    }
    svg.raw("</g>\n");
}

/// One rectangle per cell in the colour of its zone.
pub(super) fn zone_map(svg: &mut Svg, frame: &Frame, fields: &PatchCells, zones: Option<&[Zone]>) {
    svg.raw("<g shape-rendering=\"crispEdges\">\n");
    for (zone, colour) in [(Zone::Stick, STICK), (Zone::Slip, SLIP)] {
        let of = zones.unwrap_or(&[]).iter().enumerate();
        let cells = of
            .filter(|(_, found)| **found == zone)
            .map(|(cell, _)| cell);
        let data = rectangles(frame, fields, cells);
        svg.path(&data, &format!("fill=\"{colour}\""));
    }
    svg.raw("</g>\n");
}

/// The border of the patch, and of the stick zone where zones are known.
pub(super) fn outlines_of(svg: &mut Svg, frame: &Frame, scene: &Scene) {
    let path = |loops: Vec<Vec<[f64; 2]>>| {
        let data = loops
            .into_iter()
            .map(|points| polyline(points.into_iter().map(|[x, y]| frame.at(x, y)), true));
        data.collect::<String>()
    };
    let patch = path(patch_outline(&scene.fields));
    svg.path(&patch, "fill=\"none\" stroke=\"#111\" stroke-width=\"1.2\"");
    if zones_present(scene).0 {
        let zones = scene.values.zone.as_deref();
        let stick = path(outlines(&scene.fields, zones, Some(Zone::Stick)));
        // White within black shows on every colour of the ramp.
        svg.path(&stick, "fill=\"none\" stroke=\"#000\" stroke-width=\"3.4\"");
        svg.path(&stick, "fill=\"none\" stroke=\"#fff\" stroke-width=\"1.6\"");
    }
}

/// Arrows on a regular grid, each beginning at its sample; says whether there was anything to draw.
pub(super) fn arrows(
    svg: &mut Svg,
    frame: &Frame,
    fields: &PatchCells,
    along: &[f64],
    across: &[f64],
) -> bool {
    let shape = extent(fields);
    let count = |length: f64| {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most the area divided by the spacing"
        )]
        ((length * frame.scale / ARROW_SPACING)
            .round()
            .clamp(2.0, 100.0) as usize)
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
            // The picture's second axis points downward.
            let arrow = [along, &-across].map(|part| part / longest * ARROW_LENGTH);
            if arrow[0].hypot(arrow[1]) >= ARROW_SHORTEST {
                data.push_str(&arrow_path(frame.at(x.x_mm[ix], x.y_mm[iy]), arrow));
            }
        }
    }
    svg.raw("<g fill=\"none\" stroke-linecap=\"round\" stroke-linejoin=\"round\">\n");
    svg.path(&data, "stroke=\"#fff\" stroke-width=\"2.8\"");
    svg.path(&data, "stroke=\"#000\" stroke-width=\"1.2\"");
    svg.raw("</g>\n");
    true
}

/// A shaft and two strokes at its tip, centred on a place.
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

/// Frame, ticks and names of the axes, and the arrow of the rolling direction.
pub(super) fn axes(svg: &mut Svg, frame: &Frame) {
    let [x, y, width, height] = frame.area;
    let [x0, x1, y0, y1] = frame.shown;
    let place = [x, y, width, height].map(px);
    svg.element(
        "rect",
        &format!(
            "x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#333\"",
            place[0], place[1], place[2], place[3]
        ),
    );
    let bottom = y + height;
    let mut marks = String::new();
    let (values, digits) = ticks(x0, x1, width / TICK_SPACING);
    for tick in values {
        let at = frame.at(tick, y0).0;
        let _ = write!(marks, "M{} {}v5", px(at), px(bottom));
        svg.text(
            (at, bottom + 19.0),
            12.0,
            Anchor::Middle,
            "",
            &label(tick, digits),
        );
    }
    let (values, digits) = ticks(y0, y1, (height / TICK_SPACING).max(TICKS_FEWEST));
    for tick in values {
        let at = frame.at(x0, tick).1;
        let _ = write!(marks, "M{} {}h-5", px(x), px(at));
        svg.text(
            (x - 9.0, at + 4.0),
            12.0,
            Anchor::End,
            "",
            &label(tick, digits),
        );
    }
    svg.path(&marks, "fill=\"none\" stroke=\"#333\"");
    let middle = x + 0.5 * width;
    svg.text((middle, bottom + 39.0), 13.0, Anchor::Middle, "", "x in mm");
    let centre = y + 0.5 * height;
    let turned = format!("transform=\"rotate(-90 22 {})\"", px(centre));
    svg.text((22.0, centre), 13.0, Anchor::Middle, &turned, "y in mm");
    let end = x + width;
    svg.text(
        (end - 52.0, bottom + 39.0),
        12.0,
        Anchor::End,
        "",
        "rolling",
    );
    svg.path(
        &arrow_path((end - 24.0, bottom + 35.0), [44.0, 0.0]),
        "fill=\"none\" stroke=\"#111\" stroke-width=\"1.8\"",
    );
}

/// A number at a tick; never a minus before zero.
fn label(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let text = if text.trim_start_matches(['-', '0', '.']).is_empty() {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    };
    text.replace('-', "−")
}

/// The scale of the heat map, from 0 to the largest value.
pub(super) fn colour_bar(svg: &mut Svg, frame: &Frame, heat: &Heat, largest: f64) {
    let [left, y, width, height] = frame.area;
    let x = left + width + 26.0;
    svg.raw("<g shape-rendering=\"crispEdges\">\n");
    #[expect(clippy::cast_precision_loss, reason = "a few steps")]
    for step in 0..LEVELS {
        let share = (step + 1) as f64 / LEVELS as f64;
        let attributes = format!(
            "x=\"{}\" y=\"{}\" width=\"18\" height=\"{}\" fill=\"{}\"",
            px(x),
            px(y + height * (1.0 - share)),
            px(height / LEVELS as f64 + 0.6),
            ramp(step)
        );
        svg.element("rect", &attributes);
    }
    svg.raw("</g>\n");
    let (px_x, px_y, px_height) = (px(x), px(y), px(height));
    svg.element(
        "rect",
        &format!("x=\"{px_x}\" y=\"{px_y}\" width=\"18\" height=\"{px_height}\" fill=\"none\" stroke=\"#333\""),
    );
    let power = exponent(largest);
    let factor = 10f64.powi(power);
    let (values, digits) = ticks(0.0, largest / factor, height / 45.0);
    for tick in values {
        let at = y + height * (1.0 - tick * factor / largest);
        svg.path(
            &format!("M{} {}h5", px(x + 18.0), px(at)),
            "stroke=\"#333\"",
        );
        svg.text(
            (x + 27.0, at + 4.0),
            12.0,
            Anchor::Start,
            "",
            &label(tick, digits),
        );
    }
    let unit = match (power, heat.unit) {
        (0, "") => String::new(),
        (0, unit) => format!(" in {unit}"),
        (power, unit) => format!(" in {} {unit}", power_of_ten(power))
            .trim_end()
            .to_owned(),
    };
    let (place_x, place_y) = (x + 92.0, y + 0.5 * height);
    let turned = format!("transform=\"rotate(-90 {} {})\"", px(place_x), px(place_y));
    let text = format!("{}{unit}", heat.label);
    svg.text((place_x, place_y), 13.0, Anchor::Middle, &turned, &text);
}

/// `10⁻³` and the like.
fn power_of_ten(power: i32) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' => '⁰',
        c => c
            .to_digit(10)
            .and_then(|digit| char::from_u32(0x2070 + digit))
            .unwrap_or(c),
    };
    format!(
        "10{}",
        power.to_string().chars().map(raised).collect::<String>()
    )
}

/// What lines and arrows mean, below the axes.
pub(super) fn legend(svg: &mut Svg, frame: &Frame, scene: &Scene, arrows: bool) {
    let y = frame.area[1] + frame.area[3] + 66.0;
    let mut x = frame.area[0];
    let (stick, slip) = zones_present(scene);
    if scene.shown == Output::Zones {
        for (colour, word, present) in [(STICK, "stick", stick), (SLIP, "slip", slip)] {
            let word = if present {
                word.to_owned()
            } else {
                format!("{word} (nowhere)")
            };
            let place = format!("x=\"{}\" y=\"{}\"", px(x), px(y - 10.0));
            svg.element(
                "rect",
                &format!("{place} width=\"22\" height=\"12\" fill=\"{colour}\" stroke=\"#111\""),
            );
            svg.text((x + 28.0, y), 12.0, Anchor::Start, "", &word);
            x += if present { 84.0 } else { 150.0 };
        }
    } else if scene.values.zone.is_some() {
        if stick {
            let data = format!("M{} {}h26", px(x), px(y - 4.0));
            svg.path(&data, "stroke=\"#000\" stroke-width=\"3.4\"");
            svg.path(&data, "stroke=\"#fff\" stroke-width=\"1.6\"");
            let text = if slip {
                "border of the stick zone"
            } else {
                "stick everywhere"
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
