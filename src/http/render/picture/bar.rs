//! The scale of a heat map.

use crate::render::picture::chart::{Chart, exponent, label, ticks};
use crate::render::picture::colour::{VIRIDIS_PLACES, at};
use crate::render::picture::scene::Heat;
use crate::render::picture::svg::{Anchor, Svg, px};

/// Draws the scale of the heat map between two values.
pub(super) fn colour_bar(svg: &mut Svg, chart: &Chart, heat: &Heat, [low, high]: [f64; 2]) {
    let [left, y, width, height] = chart.area;
    let x = left + width + 26.0;
    svg.raw("<linearGradient id=\"scale\" x1=\"0\" y1=\"1\" x2=\"0\" y2=\"0\">");
    for place in 0..VIRIDIS_PLACES {
        let share = place as f64 / (VIRIDIS_PLACES - 1) as f64;
        let (offset, colour) = (px(share), at(share));
        svg.raw(&format!(
            "<stop offset=\"{offset}\" stop-color=\"{colour}\"/>"
        ));
    }
    svg.raw("</linearGradient>\n");
    let bar = "fill=\"url(#scale)\" stroke=\"#333\"";
    svg.rect([x, y, 18.0, height], bar);
    let power = exponent(low.abs().max(high.abs()));
    let factor = 10f64.powi(power);
    let (values, digits) = ticks(low / factor, high / factor, height / 45.0);
    for tick in values {
        let at = y + height * (1.0 - (tick * factor - low) / (high - low));
        svg.path(
            &format!("M{} {}h5", px(x + 18.0), px(at)),
            "stroke=\"#333\"",
        );
        let place = (x + 27.0, at + 4.0);
        svg.text(place, 12.0, Anchor::Start, "", &label(tick, digits));
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

/// Formats a power of ten, such as `10⁻³`.
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
