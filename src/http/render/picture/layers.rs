//! The layers of a picture, from the ground upward.

use std::fmt::Write;

use crate::render::picture::chart::{border, grid_lines, label};
use crate::render::picture::colour::{SLIP, STICK};
use crate::render::picture::frame::{Frame, ticks};
use crate::render::picture::scene::{Scene, extent, zones_present};
use crate::render::picture::svg::{Anchor, Svg, polyline, px};
use crate::render::shape::resample::resample;
use railhead_contact::case::words::solver::Output;
use railhead_contact::solution::words::answer::PatchCells;

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
    let [x0, _, y0, _] = frame.shown;
    let [xs, ys] = frame_ticks(frame).map(|(values, _)| values.into_iter());
    grid_lines(
        svg,
        frame.area,
        xs.map(|tick| frame.at(tick, y0).0),
        ys.map(|tick| frame.at(x0, tick).1),
    );
}

/// The ticks of both axes with their digits.
fn frame_ticks(frame: &Frame) -> [(Vec<f64>, usize); 2] {
    let [_, _, width, height] = frame.area;
    let [x0, x1, y0, y1] = frame.shown;
    let wanted = (height / TICK_SPACING).max(TICKS_FEWEST);
    [ticks(x0, x1, width / TICK_SPACING), ticks(y0, y1, wanted)]
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
    let [x0, _, y0, _] = frame.shown;
    let [(x_ticks, x_digits), (y_ticks, y_digits)] = frame_ticks(frame);
    border(svg, frame.area);
    let bottom = y + height;
    let mut marks = String::new();
    for tick in x_ticks {
        let at = frame.at(tick, y0).0;
        let _ = write!(marks, "M{} {}v5", px(at), px(bottom));
        svg.text(
            (at, bottom + 19.0),
            12.0,
            Anchor::Middle,
            "",
            &label(tick, x_digits),
        );
    }
    for tick in y_ticks {
        let at = frame.at(x0, tick).1;
        let _ = write!(marks, "M{} {}h-5", px(x), px(at));
        svg.text(
            (x - 9.0, at + 4.0),
            12.0,
            Anchor::End,
            "",
            &label(tick, y_digits),
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
