//! Where things stand in a picture: the same scale along both axes, round numbers at the ticks.

/// Width of a picture in its own units.
pub(super) const WIDTH: f64 = 800.0;
/// Left border of the plotting area.
const LEFT: f64 = 78.0;
/// Top border of the plotting area.
const TOP: f64 = 84.0;
/// Width of the plotting area.
const AREA_WIDTH: f64 = 560.0;
/// Limits of the height of the plotting area.
const AREA_HEIGHT: [f64; 2] = [220.0, 520.0];
/// Room below the plotting area.
const BELOW: f64 = 88.0;
/// Share of the patch left free around it.
const MARGIN: f64 = 0.06;
/// Room around the patch in a picture without axes.
const ALONE_MARGIN: f64 = 2.0;

/// Maps mm to units of the picture; y points upward in mm and downward in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    /// Left, top, width and height of the plotting area.
    pub area: [f64; 4],
    /// What the area shows in mm: x from, x to, y from, y to.
    pub shown: [f64; 4],
    /// Units of the picture per mm.
    pub scale: f64,
}

impl Frame {
    /// Shows a box `[x_min, x_max, y_min, y_max]` in mm with a margin around it.
    #[must_use]
    pub(super) fn around(shown: [f64; 4]) -> Frame {
        Frame::fitted(shown, MARGIN, [LEFT, TOP, AREA_WIDTH], AREA_HEIGHT)
    }

    /// Shows a box alone, `width` units wide, without room for axes.
    #[must_use]
    pub(super) fn alone(shown: [f64; 4], width: f64) -> Frame {
        let inner = width - 2.0 * ALONE_MARGIN;
        let place = [ALONE_MARGIN, ALONE_MARGIN, inner];
        Frame::fitted(shown, 0.0, place, [0.25 * inner, 1.5 * inner])
    }

    /// Shows a box with a share of it as margin, in an area whose height follows within limits.
    fn fitted(
        [x0, x1, y0, y1]: [f64; 4],
        margin: f64,
        [left, top, width]: [f64; 3],
        [lowest, highest]: [f64; 2],
    ) -> Frame {
        let wide = ((x1 - x0) * (1.0 + 2.0 * margin)).max(f64::MIN_POSITIVE);
        let high = ((y1 - y0) * (1.0 + 2.0 * margin)).max(f64::MIN_POSITIVE);
        let height = (width * high / wide).clamp(lowest, highest);
        let scale = (width / wide).min(height / high);
        let (half_x, half_y) = (0.5 * width / scale, 0.5 * height / scale);
        let (x, y) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
        Frame {
            area: [left, top, width, height],
            shown: [x - half_x, x + half_x, y - half_y, y + half_y],
            scale,
        }
    }

    /// Height of a picture without axes.
    #[must_use]
    pub(super) fn height_alone(&self) -> f64 {
        self.area[3] + 2.0 * ALONE_MARGIN
    }

    /// Height of the whole picture.
    #[must_use]
    pub(super) fn height(&self) -> f64 {
        self.area[1] + self.area[3] + BELOW
    }

    /// A point in mm, in the picture.
    #[must_use]
    pub(super) fn at(&self, x_mm: f64, y_mm: f64) -> (f64, f64) {
        (
            self.area[0] + (x_mm - self.shown[0]) * self.scale,
            self.area[1] + (self.shown[3] - y_mm) * self.scale,
        )
    }
}

/// Round numbers within `from..=to`, about `wanted` of them, with the digits after the point that they need.
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
    // The count is bounded by the choice of the step.
    while number * step <= to + 1e-9 * step && values.len() < 100 {
        values.push(number * step);
        number += 1.0;
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a handful of digits"
    )]
    let digits = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
    (values, digits)
}

/// The power of ten, a multiple of 3, that brings `largest` to a number easy to read; 0 for ordinary numbers.
#[must_use]
pub(super) fn exponent(largest: f64) -> i32 {
    if !(largest.is_finite() && largest > 0.0) || (0.1..100_000.0).contains(&largest) {
        return 0;
    }
    #[expect(clippy::cast_possible_truncation, reason = "an exponent of an f64")]
    let decade = largest.log10().floor() as i32;
    decade.div_euclid(3) * 3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_axes_have_one_scale_and_the_box_is_inside() {
        for shape in [
            [-8.0, 8.0, -4.0, 4.0],
            [0.0, 1.0, 0.0, 50.0],
            [-20.0, 20.0, 1.0, 1.5],
        ] {
            let frame = Frame::around(shape);
            let (left, bottom) = frame.at(shape[0], shape[2]);
            let (right, top) = frame.at(shape[1], shape[3]);
            let ratio = (right - left) / (bottom - top);
            let expected = (shape[1] - shape[0]) / (shape[3] - shape[2]);
            assert!((ratio - expected).abs() < 1e-9 * expected, "{shape:?}");
            let [x, y, width, height] = frame.area;
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
