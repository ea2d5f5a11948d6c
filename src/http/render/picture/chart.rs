//! Charts as SVG: the plotting area with axes and ticks at round numbers, the colour scale, paths and texts.
//!
//! Every text of a client passes through [`escape`].

use std::fmt::Write;

use crate::render::picture::draw::Heat;

/// Width of a picture in its own units.
pub(super) const WIDTH: f64 = 800.0;
/// Left, top and width of the plotting area of a patch.
const PATCH_AREA: [f64; 3] = [78.0, 96.0, 560.0];
/// Least and largest height of the plotting area of a patch.
const PATCH_HEIGHT: [f64; 2] = [220.0, 520.0];
/// Space below the plotting area of a patch.
const BELOW: f64 = 88.0;
/// Margin around the patch, as a share of its size.
const MARGIN: f64 = 0.06;
/// Margin around the patch in a picture without axes.
const ALONE_MARGIN: f64 = 2.0;
/// Largest number of characters of a title.
const TITLE_MAX: usize = 74;
/// Approximate distance of the ticks of each axis.
const TICK_SPACING: [f64; 2] = [90.0, 55.0];

/// Maps coordinates to the plotting area. An axis may be reversed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chart {
    /// Left, top, width and height.
    pub area: [f64; 4],
    /// Coordinates of the left and the right end.
    pub x: [f64; 2],
    /// Coordinates of the lower and the upper end.
    pub y: [f64; 2],
}

impl Chart {
    /// Creates a chart of a box `[x_min, x_max, y_min, y_max]` with a margin and equal scales.
    #[must_use]
    pub(super) fn around(shown: [f64; 4]) -> Chart {
        Chart::fitted(shown, MARGIN, PATCH_AREA, PATCH_HEIGHT)
    }

    /// Creates a chart of a box, `width` units wide, without space for axes.
    #[must_use]
    pub(super) fn alone(shown: [f64; 4], width: f64) -> Chart {
        let inner = width - 2.0 * ALONE_MARGIN;
        let place = [ALONE_MARGIN, ALONE_MARGIN, inner];
        Chart::fitted(shown, 0.0, place, [0.25 * inner, 1.5 * inner])
    }

    /// Creates a chart of a box with a margin, as a share of its size, in an area whose height follows within limits.
    fn fitted(
        [x0, x1, y0, y1]: [f64; 4],
        margin: f64,
        [left, top, width]: [f64; 3],
        [lowest, highest]: [f64; 2],
    ) -> Chart {
        let wide = ((x1 - x0) * (1.0 + 2.0 * margin)).max(f64::MIN_POSITIVE);
        let high = ((y1 - y0) * (1.0 + 2.0 * margin)).max(f64::MIN_POSITIVE);
        let height = (width * high / wide).clamp(lowest, highest);
        let scale = (width / wide).min(height / high);
        let (half_x, half_y) = (0.5 * width / scale, 0.5 * height / scale);
        let (x, y) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
        Chart {
            area: [left, top, width, height],
            x: [x - half_x, x + half_x],
            y: [y - half_y, y + half_y],
        }
    }

    /// Returns the height of a picture without axes.
    #[must_use]
    pub(super) fn height_alone(&self) -> f64 {
        self.area[3] + 2.0 * ALONE_MARGIN
    }

    /// Returns the height of the picture of a patch.
    #[must_use]
    pub(super) fn height(&self) -> f64 {
        self.area[1] + self.area[3] + BELOW
    }

    /// Returns the units of the picture per unit of the first axis.
    #[must_use]
    pub(super) fn scale(&self) -> f64 {
        self.area[2] / (self.x[1] - self.x[0])
    }

    /// Returns the position of a point in the picture.
    pub(super) fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let share = |value: f64, [from, to]: [f64; 2]| (value - from) / (to - from);
        let [left, top, width, height] = self.area;
        (
            left + share(x, self.x) * width,
            top + (1.0 - share(y, self.y)) * height,
        )
    }

    /// Draws thin lines at the ticks.
    pub(super) fn grid(&self, svg: &mut Svg) {
        let [left, top, width, height] = self.area;
        let upright = self.ticks(0).0.into_iter().map(|tick| {
            let x = self.at(tick, self.y[0]).0;
            format!("M{} {}v{}", px(x), px(top), px(height))
        });
        let level = self.ticks(1).0.into_iter().map(|tick| {
            let y = self.at(self.x[0], tick).1;
            format!("M{} {}h{}", px(left), px(y), px(width))
        });
        let data: String = upright.chain(level).collect();
        svg.path(&data, "fill=\"none\" stroke=\"#e6e6e6\"");
    }

    /// Draws border, numbers and names of the axes.
    pub(super) fn axes(&self, svg: &mut Svg, [x_name, y_name]: [&str; 2]) {
        let [left, top, width, height] = self.area;
        svg.rect(self.area, "fill=\"none\" stroke=\"#333\"");
        let (values, digits) = self.ticks(0);
        for tick in values {
            let at = (self.at(tick, self.y[0]).0, top + height + 18.0);
            svg.text(at, 12.0, Anchor::Middle, "", &label(tick, digits));
        }
        let (values, digits) = self.ticks(1);
        for tick in values {
            let at = (left - 7.0, self.at(self.x[0], tick).1 + 4.0);
            svg.text(at, 12.0, Anchor::End, "", &label(tick, digits));
        }
        let middle = (left + 0.5 * width, top + height + 38.0);
        svg.text(middle, 13.0, Anchor::Middle, "", x_name);
        svg.text((left, top - 8.0), 13.0, Anchor::Start, "", y_name);
    }

    fn ticks(&self, axis: usize) -> (Vec<f64>, usize) {
        let [from, to] = [self.x, self.y][axis];
        let length = self.area[2 + axis];
        ticks(from.min(to), from.max(to), length / TICK_SPACING[axis])
    }
}

/// Creates a picture of this height with a title, `width` pixels wide.
pub(super) fn open(title: &str, remarks: &[String], width: u32, height: f64) -> Svg {
    let shown_height = px(f64::from(width) * height / WIDTH);
    let height = px(height);
    let mut svg = Svg::default();
    svg.raw(&format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{shown_height}\" viewBox=\"0 0 {WIDTH} {height}\" font-family=\"{FONTS}\" role=\"img\">\n",
    ));
    svg.raw(&format!("<title>{}</title>\n", escape(title)));
    svg.raw(&format!("<desc>{}</desc>\n", escape(&remarks.join("; "))));
    svg.element("rect", "width=\"100%\" height=\"100%\" fill=\"#fff\"");
    let title = shorten(title, TITLE_MAX);
    svg.text((78.0, 28.0), 17.0, Anchor::Start, "fill=\"#111\"", &title);
    for (line, remark) in remarks.iter().enumerate() {
        let y = if line == 0 { 48.0 } else { 65.0 };
        svg.text((78.0, y), 12.0, Anchor::Start, "fill=\"#444\"", remark);
    }
    svg
}

/// Draws an entry of a legend, a line of this style with a text.
pub(super) fn legend_line(svg: &mut Svg, (x, y): (f64, f64), style: &str, text: &str) {
    let line = format!("M{} {}h30", px(x), px(y - 4.0));
    svg.path(&line, &format!("fill=\"none\" {style}"));
    svg.text((x + 37.0, y), 12.0, Anchor::Start, "", text);
}

/// Returns the range of values with a margin.
pub(super) fn roomy(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let ends = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = values
        .into_iter()
        .fold(ends, |[low, high], value| [low.min(value), high.max(value)]);
    if !(low.is_finite() && high.is_finite()) {
        return [0.0, 1.0];
    }
    let room = match high - low {
        0.0 => 0.5 * high.abs().max(1.0),
        length => 0.06 * length,
    };
    [low - room, high + room]
}

/// Formats the number at a tick, without the sign of zero.
pub(super) fn label(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    match text.trim_start_matches(['-', '0', '.']).is_empty() {
        true => text.trim_start_matches('-').to_owned(),
        false => text.replace('-', "−"),
    }
}

/// Returns about `wanted` round numbers within `from..=to`, and their number of decimals.
#[must_use]
pub(super) fn ticks(from: f64, to: f64, wanted: f64) -> (Vec<f64>, usize) {
    let rough = (to - from) / wanted.max(1.0);
    if !(rough.is_finite() && rough > 0.0) {
        return (Vec::new(), 0);
    }
    let decade = rough.log10().floor();
    let unit = 10f64.powf(decade);
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * unit)
        .find(|step| *step >= rough * 0.999)
        .unwrap_or(10.0 * unit);
    let mut values = Vec::new();
    let mut number = (from / step - 1e-9).ceil();
    // The choice of the step limits the count.
    while number * step <= to + 1e-9 * step && values.len() < 100 {
        values.push(number * step);
        number += 1.0;
    }
    let digits = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
    (values, digits)
}

/// Returns the power of ten, a multiple of 3, by which numbers up to `largest` are divided; 0 for 0.1 to 100 000.
#[must_use]
pub(super) fn exponent(largest: f64) -> i32 {
    if !(largest.is_finite() && largest > 0.0) || (0.1..100_000.0).contains(&largest) {
        return 0;
    }
    let decade = largest.log10().floor() as i32;
    decade.div_euclid(3) * 3
}

/// Number of nodes of the scale.
pub(super) const VIRIDIS_PLACES: usize = 17;

/// The map viridis (S. van der Walt, N. Smith and E. Firing 2015, CC0) colour_at 17 equidistant nodes; linear in between.
const VIRIDIS: [[u8; 3]; VIRIDIS_PLACES] = [
    [68, 1, 84],
    [72, 24, 106],
    [71, 45, 123],
    [66, 64, 134],
    [59, 82, 139],
    [51, 99, 141],
    [44, 114, 142],
    [38, 130, 142],
    [33, 145, 140],
    [31, 160, 136],
    [40, 174, 128],
    [63, 188, 115],
    [94, 201, 98],
    [132, 212, 75],
    [173, 220, 48],
    [216, 226, 25],
    [253, 231, 37],
];

/// Colour of cells that stick.
pub(super) const STICK: &str = "#31688e";
/// Colour of cells that slip, much lighter, so that both are distinct without colour.
pub(super) const SLIP: &str = "#fde725";

/// Returns the colour colour_at a position on the scale from 0 to 1, as `#rrggbb`.
#[must_use]
pub(super) fn colour_at(share: f64) -> String {
    let [r, g, b] = rgb(share);
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn rgb(share: f64) -> [u8; 3] {
    let last = VIRIDIS_PLACES - 1;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let span = (place as usize).min(last - 1);
    let share = place - span as f64;
    std::array::from_fn(|part| {
        let [from, to] = [VIRIDIS[span][part], VIRIDIS[span + 1][part]].map(f64::from);
        (from + share * (to - from)).round() as u8
    })
}

/// Fonts in order of preference; raster pictures use the first.
pub(super) const FONTS: &str = "DejaVu Sans, Verdana, sans-serif";

/// An SVG drawing.
#[derive(Debug, Default)]
pub(crate) struct Svg {
    /// Markup and lines of text, in order.
    parts: Vec<Part>,
}

#[derive(Debug)]
enum Part {
    Markup(String),
    Line(Line),
}

/// A line of text.
#[derive(Debug)]
pub(super) struct Line {
    /// Position of the anchor.
    pub at: (f64, f64),
    /// Font size.
    pub size: f64,
    /// The part of the text at the position.
    pub anchor: Anchor,
    /// Further attributes.
    pub attributes: String,
    /// The text.
    pub text: String,
}

/// The part of a text that is at its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    /// The beginning.
    Start,
    /// The middle.
    Middle,
    /// The end.
    End,
}

impl Svg {
    /// Adds an element without content; `attributes` is not escaped.
    pub(super) fn element(&mut self, name: &str, attributes: &str) {
        self.raw(&format!("<{name} {attributes}/>\n"));
    }

    /// Adds a rectangle `[x, y, width, height]`.
    pub(super) fn rect(&mut self, area: [f64; 4], attributes: &str) {
        let [x, y, width, height] = area.map(px);
        let place = format!("x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"");
        self.element("rect", &format!("{place} {attributes}"));
    }

    /// Adds a path.
    pub(super) fn path(&mut self, data: &str, attributes: &str) {
        self.raw(&format!("<path d=\"{data}\" {attributes}/>\n"));
    }

    /// Adds a line of text; `text` is escaped, `attributes` is not.
    pub(super) fn text(
        &mut self,
        at: (f64, f64),
        size: f64,
        anchor: Anchor,
        attributes: &str,
        text: &str,
    ) {
        self.parts.push(Part::Line(Line {
            at,
            size,
            anchor,
            attributes: attributes.to_owned(),
            text: text.to_owned(),
        }));
    }

    /// Adds SVG markup.
    pub(super) fn raw(&mut self, text: &str) {
        self.parts.push(Part::Markup(text.to_owned()));
    }

    /// Returns the SVG, with lines of text as elements.
    #[must_use]
    pub(crate) fn finish(&self) -> String {
        self.with_lines(Line::element)
    }

    /// Returns the SVG, with lines of text written by `element`.
    pub(super) fn with_lines(&self, element: impl Fn(&Line) -> String) -> String {
        let text = |part: &Part| match part {
            Part::Markup(text) => text.clone(),
            Part::Line(line) => element(line),
        };
        self.parts.iter().map(text).collect()
    }
}

impl Line {
    fn element(&self) -> String {
        let anchor = match self.anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let ((x, y), size, attributes) = (self.at, self.size, &self.attributes);
        let (x, y, text) = (px(x), px(y), escape(&self.text));
        format!(
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" text-anchor=\"{anchor}\" {attributes}>{text}</text>\n"
        )
    }
}

/// Formats a length in units of the drawing, to a hundredth.
#[must_use]
pub(super) fn px(value: f64) -> String {
    let mut text = format!("{value:.2}");
    let kept = text.trim_end_matches('0').trim_end_matches('.').len();
    text.truncate(kept);
    if text == "-0" { "0".to_owned() } else { text }
}

/// Returns the path through points.
#[must_use]
pub(super) fn polyline(points: impl IntoIterator<Item = (f64, f64)>, closed: bool) -> String {
    let mut data = String::new();
    for (index, (x, y)) in points.into_iter().enumerate() {
        let command = if index == 0 { 'M' } else { 'L' };
        // Writing to a string cannot fail.
        let _ = write!(data, "{command}{} {}", px(x), px(y));
    }
    if closed {
        data.push('Z');
    }
    data
}

/// Returns the path of closed curves, to a tenth, without points within `tolerance` of the simplified curve.
#[must_use]
pub(super) fn curves(loops: impl IntoIterator<Item = Vec<(f64, f64)>>, tolerance: f64) -> String {
    let tenths = |(x, y): (f64, f64)| [(10.0 * x).round() as i64, (10.0 * y).round() as i64];
    let mut data = String::new();
    for points in loops {
        let Some(&first) = points.first() else {
            continue;
        };
        let mut kept = vec![first];
        // The point farthest from the first divides a closed curve into two open ones.
        let far = |at: &(f64, f64)| (at.0 - first.0).hypot(at.1 - first.1);
        let middle = (0..points.len())
            .max_by(|a, b| far(&points[*a]).total_cmp(&far(&points[*b])))
            .unwrap_or(0);
        simplify(&points[..=middle], tolerance, &mut kept);
        let back: Vec<(f64, f64)> = points[middle..].iter().copied().chain([first]).collect();
        simplify(&back, tolerance, &mut kept);
        let [mut x, mut y] = tenths(first);
        let mut steps = String::new();
        for point in &kept[1..kept.len() - 1] {
            let [to_x, to_y] = tenths(*point);
            if (to_x, to_y) != (x, y) {
                let _ = write!(steps, "{}{}", step(to_x - x), step(to_y - y));
                (x, y) = (to_x, to_y);
            }
        }
        if !steps.is_empty() {
            let [x, y] = tenths(first);
            let _ = write!(
                data,
                "M{}{}l{}z",
                step(x).trim_start(),
                step(y),
                steps.trim_start()
            );
        }
    }
    data
}

/// Formats a number in tenths, with a separator from the number before.
fn step(tenths: i64) -> String {
    let sign = if tenths < 0 { "-" } else { " " };
    let (whole, rest) = (tenths.abs() / 10, tenths.abs() % 10);
    match (whole, rest) {
        (whole, 0) => format!("{sign}{whole}"),
        (0, rest) => format!("{sign}.{rest}"),
        (whole, rest) => format!("{sign}{whole}.{rest}"),
    }
}

/// Adds the points after the first, simplified within the tolerance (D. H. Douglas and T. K. Peucker, 1973).
fn simplify(points: &[(f64, f64)], tolerance: f64, kept: &mut Vec<(f64, f64)>) {
    let (Some(&from), Some(&to)) = (points.first(), points.last()) else {
        return;
    };
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = dx.hypot(dy).max(f64::MIN_POSITIVE);
    let away = |at: &(f64, f64)| ((at.0 - from.0) * dy - (at.1 - from.1) * dx).abs() / length;
    let farthest = (1..points.len().saturating_sub(1))
        .max_by(|a, b| away(&points[*a]).total_cmp(&away(&points[*b])));
    match farthest {
        Some(middle) if away(&points[middle]) > tolerance => {
            simplify(&points[..=middle], tolerance, kept);
            simplify(&points[middle..], tolerance, kept);
        }
        _ => kept.push(to),
    }
}

/// Escapes text as XML character data. Characters that XML does not allow, control characters, and marks that change the direction of
/// text are replaced by U+FFFD.
#[must_use]
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\t' | '\n' | '\r' => out.push(' '),
            '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{fffe}' | '\u{ffff}' => {
                out.push('\u{fffd}');
            }
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// Truncates a text to `most` characters, with an ellipsis.
#[must_use]
pub(super) fn shorten(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    let kept: String = text.chars().take(most.saturating_sub(1)).collect();
    kept.trim_end().to_owned() + "…"
}

/// Draws the scale of the heat map between two values.
pub(super) fn colour_bar(svg: &mut Svg, chart: &Chart, heat: &Heat, [low, high]: [f64; 2]) {
    let [left, y, width, height] = chart.area;
    let x = left + width + 26.0;
    svg.raw("<linearGradient id=\"scale\" x1=\"0\" y1=\"1\" x2=\"0\" y2=\"0\">");
    for place in 0..VIRIDIS_PLACES {
        let share = place as f64 / (VIRIDIS_PLACES - 1) as f64;
        let (offset, colour) = (px(share), colour_at(share));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_may_run_either_way_and_every_value_is_inside() {
        let chart = Chart {
            area: [10.0, 20.0, 100.0, 50.0],
            x: [5.0, -5.0],
            y: [0.0, 2.0],
        };
        assert_eq!(chart.at(5.0, 2.0), (10.0, 20.0));
        assert_eq!(chart.at(-5.0, 0.0), (110.0, 70.0));
        for values in [vec![0.0], vec![1.0, 2.0], vec![-3e-9, 1e-9], vec![]] {
            let [low, high] = roomy(values.iter().copied());
            assert!(low < high);
            assert!(values.iter().all(|value| (low..high).contains(value)));
        }
    }

    #[test]
    fn both_axes_have_one_scale_and_the_box_is_inside() {
        for shape in [
            [-8.0, 8.0, -4.0, 4.0],
            [0.0, 1.0, 0.0, 50.0],
            [-20.0, 20.0, 1.0, 1.5],
        ] {
            let chart = Chart::around(shape);
            let (left, bottom) = chart.at(shape[0], shape[2]);
            let (right, top) = chart.at(shape[1], shape[3]);
            let ratio = (right - left) / (bottom - top);
            let expected = (shape[1] - shape[0]) / (shape[3] - shape[2]);
            assert!((ratio - expected).abs() < 1e-9 * expected, "{shape:?}");
            let [x, y, width, height] = chart.area;
            assert!(left >= x && right <= x + width, "{shape:?}");
            assert!(top >= y && bottom <= y + height, "{shape:?}");
        }
    }

    #[test]
    fn ticks_are_round_and_within_the_limits() {
        assert_eq!(ticks(-8.5, 8.5, 8.0), (vec![-5.0, 0.0, 5.0], 0));
        assert_eq!(ticks(0.0, 1.0, 5.0).1, 1);
        for (from, to) in [(0.0, 368.0), (-0.003, 0.0017), (12.0, 12.5), (0.0, 1e-9)] {
            let (values, _) = ticks(from, to, 6.0);
            let slack = 1e-6 * (to - from);
            assert!((3..=13).contains(&values.len()), "{values:?}");
            assert!(
                values
                    .iter()
                    .all(|value| (from - slack..=to + slack).contains(value))
            );
        }
        assert_eq!(ticks(1.0, 1.0, 5.0).0, Vec::<f64>::new());
        assert_eq!(ticks(0.0, f64::NAN, 5.0).0, Vec::<f64>::new());
    }

    #[test]
    fn powers_of_ten_are_multiples_of_three() {
        for (value, power) in [
            (368.0, 0),
            (0.002, -3),
            (3e-5, -6),
            (2e6, 6),
            (0.0, 0),
            (0.5, 0),
        ] {
            assert_eq!(exponent(value), power, "{value}");
        }
    }
}

#[cfg(test)]
mod svg_tests {
    use super::*;

    #[test]
    fn text_cannot_become_markup() {
        let evil = "</text><script>alert('1')</script>&\"\u{0}\u{8}\u{202e}\n";
        let safe = escape(evil);
        assert!(!safe.contains(['<', '>', '"', '\'', '\u{0}', '\u{8}', '\u{202e}', '\n']));
        assert_eq!(escape("R₁ < 300 & µ = 0.3"), "R₁ &lt; 300 &amp; µ = 0.3");
    }

    #[test]
    fn lengths_have_two_digits_at_most() {
        for (value, text) in [(1.0, "1"), (-0.001, "0"), (12.345, "12.35"), (100.0, "100")] {
            assert_eq!(px(value), text);
        }
    }

    #[test]
    fn curves_keep_their_corners_and_lose_what_lies_between() {
        let square = [
            (0.0, 0.0),
            (5.0, 0.01),
            (10.0, 0.0),
            (10.0, 10.0),
            (4.0, 10.0),
            (0.0, 10.0),
        ];
        assert_eq!(curves([square.to_vec()], 0.1), "M0 0l10 0 0 10-10 0z");
        let dot = vec![(1.0, 1.0), (1.01, 1.0), (1.0, 1.01)];
        assert_eq!(curves([dot, Vec::new()], 0.1), "");
        assert_eq!(
            curves([vec![(0.5, 1.0), (0.0, 2.5), (-0.4, 1.0)]], 0.1),
            "M.5 1l-.5 1.5-.4-1.5z"
        );
    }

    #[test]
    fn long_texts_are_cut_between_characters() {
        assert_eq!(shorten("äöüß", 4), "äöüß");
        assert_eq!(shorten("äöüßx", 4), "äöü…");
    }
}

#[cfg(test)]
mod colour_tests {
    use super::*;

    /// CIE 1976 lightness of an sRGB colour, 0 to 100.
    fn lightness(rgb: [u8; 3]) -> f64 {
        let linear = rgb.map(|part| {
            let part = f64::from(part) / 255.0;
            if part <= 0.04045 {
                part / 12.92
            } else {
                ((part + 0.055) / 1.055).powf(2.4)
            }
        });
        let y = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
        if y > 0.008_856 {
            116.0 * y.cbrt() - 16.0
        } else {
            903.3 * y
        }
    }

    #[test]
    fn lightness_rises_evenly_along_the_ramp() {
        let shares = (0..=128).map(|step| f64::from(step) / 128.0);
        let lights: Vec<f64> = shares.map(|share| lightness(rgb(share))).collect();
        let (first, last) = (lights[0], lights[128]);
        assert!(first < 20.0 && last > 88.0, "from {first} to {last}");
        for (level, light) in lights.iter().enumerate() {
            let even = first + (last - first) * level as f64 / 128.0;
            assert!(
                (light - even).abs() < 2.0,
                "step {level}: {light}, not {even}"
            );
        }
        assert!(lights.is_sorted_by(|a, b| a <= b));
    }

    #[test]
    fn values_are_brought_onto_the_ramp() {
        for (share, colour) in [
            (0.0, "#440154"),
            (1.0, "#fde725"),
            (-3.0, "#440154"),
            (7.0, "#fde725"),
        ] {
            assert_eq!(colour_at(share), colour, "{share}");
        }
    }
}
