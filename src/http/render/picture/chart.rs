//! Axes that have a scale each, for curves and sections; a patch alone has the same along both.

use crate::render::picture::frame::{WIDTH, ticks};
use crate::render::picture::svg::{Anchor, FONTS, Svg, escape, px, shorten};

/// Characters of a title that fit.
const TITLE_MAX: usize = 74;
/// Distance of the ticks of an axis, about.
const TICK_SPACING: [f64; 2] = [90.0, 55.0];

/// Thin lines across the area at these places.
pub(super) fn grid_lines(
    svg: &mut Svg,
    [left, top, width, height]: [f64; 4],
    xs: impl Iterator<Item = f64>,
    ys: impl Iterator<Item = f64>,
) {
    let upright = xs.map(|x| format!("M{} {}v{}", px(x), px(top), px(height)));
    let level = ys.map(|y| format!("M{} {}h{}", px(left), px(y), px(width)));
    let data: String = upright.chain(level).collect();
    svg.path(&data, "fill=\"none\" stroke=\"#e6e6e6\"");
}

/// The border of the area.
pub(super) fn border(svg: &mut Svg, area: [f64; 4]) {
    let [x, y, width, height] = area.map(px);
    svg.element(
        "rect",
        &format!("x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"#333\""),
    );
}

/// Maps numbers to the plotting area; the second of a pair may be the smaller one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chart {
    /// Left, top, width and height.
    pub area: [f64; 4],
    /// What stands at the left and the right end.
    pub x: [f64; 2],
    /// What stands at the lower and the upper end.
    pub y: [f64; 2],
}

impl Chart {
    /// A place in the picture.
    pub(super) fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let share = |value: f64, [from, to]: [f64; 2]| (value - from) / (to - from);
        let [left, top, width, height] = self.area;
        (
            left + share(x, self.x) * width,
            top + (1.0 - share(y, self.y)) * height,
        )
    }

    /// Lines at the ticks, below what is drawn.
    pub(super) fn grid(&self, svg: &mut Svg) {
        let xs = self.ticks(0).0.into_iter();
        let ys = self.ticks(1).0.into_iter();
        grid_lines(
            svg,
            self.area,
            xs.map(|tick| self.at(tick, self.y[0]).0),
            ys.map(|tick| self.at(self.x[0], tick).1),
        );
    }

    /// Frame, numbers and names, above what is drawn.
    pub(super) fn axes(&self, svg: &mut Svg, [x_name, y_name]: [&str; 2]) {
        let [left, top, width, height] = self.area;
        border(svg, self.area);
        let (values, digits) = self.ticks(0);
        for tick in values {
            let at = self.at(tick, self.y[0]).0;
            let number = label(tick, digits);
            svg.text((at, top + height + 18.0), 12.0, Anchor::Middle, "", &number);
        }
        let (values, digits) = self.ticks(1);
        for tick in values {
            let at = self.at(self.x[0], tick).1;
            svg.text(
                (left - 7.0, at + 4.0),
                12.0,
                Anchor::End,
                "",
                &label(tick, digits),
            );
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

/// Begins a picture of this height with a title, `width` pixels wide.
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

/// A range with some room at both ends; one of a single value has room too.
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

/// A number at a tick; never a minus before zero.
pub(super) fn label(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let text = if text.trim_start_matches(['-', '0', '.']).is_empty() {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    };
    text.replace('-', "−")
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
}
