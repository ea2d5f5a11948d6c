//! The plotting area of a picture: axes with equal or different scales, and ticks at round numbers.

use crate::render::picture::svg::{Anchor, FONTS, Svg, escape, px, shorten};

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
