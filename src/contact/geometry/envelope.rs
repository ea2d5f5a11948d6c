//! The upper envelope of a plane curve, sampled at equally spaced y.

use crate::numerics::roots::bounds;

/// The upper envelope of a curve at `y = k·step`: height and parameter of the curve.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Envelope {
    /// Spacing in mm.
    pub(crate) step: f64,
    /// The first k.
    pub(crate) first: i64,
    /// `None` where the curve has no point.
    pub(crate) points: Vec<Option<[f64; 2]>>,
}

/// Finds the upper envelope of a curve, given as `[y, height, parameter]` with `None` where it is interrupted. Between two points the curve is
/// taken as a parabola with the mean second derivative of the points around.
pub(crate) fn envelope(curve: &[Option<[f64; 3]>], step: f64) -> Envelope {
    let [least, largest] = bounds(curve.iter().flatten().map(|point| point[0] / step));
    let (first, last) = (least.ceil() as i64, largest.floor() as i64);
    let mut points: Vec<Option<[f64; 2]>> =
        vec![None; usize::try_from(last - first + 1).unwrap_or(0)];
    let mut bend_before: Option<[f64; 2]> = None;
    for (n, pair) in curve.windows(2).enumerate() {
        let [Some(from), Some(to)] = pair else {
            bend_before = None;
            continue;
        };
        let after = curve.get(n + 2).copied().flatten();
        let bend_after = after.and_then(|after| bend([*from, *to, after]));
        let bends = [std::mem::replace(&mut bend_before, bend_after), bend_after];
        let (low, high) = (from[0].min(to[0]) / step, from[0].max(to[0]) / step);
        // A cast truncates toward zero, which is faster than a rounding function.
        let (lowest, highest) = (low as i64, high as i64);
        let lowest = lowest + i64::from((lowest as f64) < low);
        let highest = highest - i64::from(highest as f64 > high);
        if lowest > highest {
            continue;
        }
        let span = to[0] - from[0];
        // If the two second derivatives differ in sign, the curve has a corner or hardly bends, and is taken as straight.
        let bends = [0, 1].map(|part| match bends {
            [Some(a), Some(b)] if a[part] * b[part] > 0.0 => 0.5 * (a[part] + b[part]),
            _ => 0.0,
        });
        for k in lowest..=highest {
            let t = if span == 0.0 {
                0.0
            } else {
                (k as f64 * step - from[0]) / span
            };
            let sag = 0.5 * t * (1.0 - t) * span * span;
            let at =
                [1, 2].map(|part| from[part] + t * (to[part] - from[part]) - sag * bends[part - 1]);
            let place = &mut points[(k - first) as usize];
            if place.is_none_or(|highest| at[0] > highest[0]) {
                *place = Some(at);
            }
        }
    }
    Envelope {
        step,
        first,
        points,
    }
}

/// Second derivatives of height and parameter with respect to y through three points, if y is monotone.
fn bend([a, b, c]: [[f64; 3]; 3]) -> Option<[f64; 2]> {
    let (before, after) = (b[0] - a[0], c[0] - b[0]);
    (before * after > 0.0).then(|| {
        [1, 2].map(|part| {
            2.0 * ((c[part] - b[part]) / after - (b[part] - a[part]) / before) / (before + after)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arc_is_met_between_its_points() {
        let arc = |s: f64| Some([13.0 * (s / 13.0).sin(), 13.0 * (s / 13.0).cos(), s]);
        let curve: Vec<_> = (-100..=100).map(|k| arc(0.08 * f64::from(k))).collect();
        let found = envelope(&curve, 0.04);
        for (k, point) in found.points.iter().enumerate().skip(10).take(300) {
            let y = (found.first + k as i64) as f64 * found.step;
            let [height, s] = point.unwrap();
            assert!((height - (169.0 - y * y).sqrt()).abs() < 1e-6, "{y}");
            assert!((s - 13.0 * (y / 13.0).asin()).abs() < 1e-5, "{y}");
        }
    }

    #[test]
    fn of_two_branches_the_upper_one_counts() {
        let curve: Vec<_> = (0..=40)
            .map(|k| 0.1 * f64::from(k))
            .map(|s| {
                if s < 2.0 {
                    Some([s, s, s])
                } else {
                    Some([4.0 - s, 2.0 + s, s])
                }
            })
            .collect();
        let found = envelope(&curve, 0.25);
        let [height, s] = found.points[4].unwrap();
        assert!((height - 5.0).abs() < 1e-9 && (s - 3.0).abs() < 1e-9);
    }
}
