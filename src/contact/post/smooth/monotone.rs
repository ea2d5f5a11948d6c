//! Cubic interpolation that has no extreme between its knots.

/// Values of the monotone cubic through the knots (F. N. Fritsch and J. Butland, SIAM J. Sci. Stat. Comput. 5, 1984), at places in
/// ascending order; beyond the first and last knot their values. Knots ascend; none of two at the same place counts twice.
pub(crate) fn monotone(knots: &[f64], values: &[f64], at: &[f64]) -> Vec<f64> {
    let last = knots.len() - 1;
    if last == 0 {
        return vec![values[0]; at.len()];
    }
    let slopes = slopes(knots, values);
    let mut span = 0;
    let value_at = |&place: &f64| {
        let place = place.clamp(knots[0], knots[last]);
        while span + 1 < last && place > knots[span + 1] {
            span += 1;
        }
        let width = knots[span + 1] - knots[span];
        if width <= 0.0 {
            return values[span];
        }
        let s = (place - knots[span]) / width;
        let (s2, s3) = (s * s, s * s * s);
        (2.0 * s3 - 3.0 * s2 + 1.0) * values[span]
            + (s3 - 2.0 * s2 + s) * width * slopes[span]
            + (3.0 * s2 - 2.0 * s3) * values[span + 1]
            + (s3 - s2) * width * slopes[span + 1]
    };
    at.iter().map(value_at).collect()
}

/// Slopes at the knots: harmonic means inside, parabolas at both ends, kept from overshooting.
fn slopes(knots: &[f64], values: &[f64]) -> Vec<f64> {
    let last = knots.len() - 1;
    let widths: Vec<f64> = knots.windows(2).map(|k| k[1] - k[0]).collect();
    let secants: Vec<f64> = (0..last)
        .map(|k| {
            let rise = values[k + 1] - values[k];
            if widths[k] > 0.0 {
                rise / widths[k]
            } else {
                0.0
            }
        })
        .collect();
    let end = |near: usize, next: usize| {
        let (h, g) = (widths[near], widths[next]);
        if h + g <= 0.0 {
            return 0.0;
        }
        let slope = ((2.0 * h + g) * secants[near] - h * secants[next]) / (h + g);
        if slope * secants[near] <= 0.0 {
            0.0
        } else if slope.abs() > 3.0 * secants[near].abs() {
            3.0 * secants[near]
        } else {
            slope
        }
    };
    let mut slopes = vec![secants[0]; last + 1];
    if last > 1 {
        slopes[0] = end(0, 1);
        slopes[last] = end(last - 1, last - 2);
    }
    for k in 1..last {
        let (before, after) = (secants[k - 1], secants[k]);
        slopes[k] = if before * after > 0.0 {
            let (w1, w2) = (
                2.0 * widths[k] + widths[k - 1],
                widths[k] + 2.0 * widths[k - 1],
            );
            (w1 + w2) / (w1 / before + w2 / after)
        } else {
            0.0
        };
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_passed_without_overshoot_and_lines_are_kept() {
        let at: Vec<f64> = (0..=50).map(|k| f64::from(k) * 0.1).collect();
        let knots = [0.0, 1.0, 1.5, 3.0, 5.0];
        let step = monotone(&knots, &[0.0, 0.0, 1.0, 1.0, 1.0], &at);
        assert!(step.iter().all(|v| (0.0..=1.0).contains(v)), "{step:?}");
        assert!(step.is_sorted_by(|a, b| a <= b));
        let line = monotone(&knots, &knots.map(|k| 2.0 * k - 3.0), &at);
        for (place, value) in at.iter().zip(line) {
            assert!((value - (2.0 * place - 3.0)).abs() < 1e-12);
        }
    }
}
