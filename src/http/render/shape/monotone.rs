//! Monotone cubic interpolation.

/// Interpolates between samples without extremes between the nodes (F. N. Fritsch and J. Butland, SIAM J. Sci. Stat. Comput. 5, 1984).
/// Beyond the first and the last node, the values are constant. Nodes must ascend; of two equal nodes one is used.
pub(super) fn monotone(axis: &[f64], values: &[f64], at: &[f64]) -> Vec<f64> {
    let last = axis.len() - 1;
    if last == 0 {
        return vec![values[0]; at.len()];
    }
    let slopes = monotone_slopes(axis, values);
    let value_at = |place: &f64| {
        let place = place.clamp(axis[0], axis[last]);
        let i = axis.partition_point(|node| *node <= place).clamp(1, last) - 1;
        let length = axis[i + 1] - axis[i];
        if length <= 0.0 {
            return values[i];
        }
        // The cubic with the values and slopes at both ends (Hermite).
        let share = (place - axis[i]) / length;
        let rest = 1.0 - share;
        let end = share * share * (3.0 - 2.0 * share);
        let bow = share * rest * length * (rest * slopes[i] - share * slopes[i + 1]);
        (1.0 - end) * values[i] + end * values[i + 1] + bow
    };
    at.iter().map(value_at).collect()
}

/// Returns slopes after Fritsch and Butland: weighted harmonic means inside, limited parabolas at both ends.
fn monotone_slopes(axis: &[f64], values: &[f64]) -> Vec<f64> {
    let last = axis.len() - 1;
    let widths: Vec<f64> = axis.windows(2).map(|k| k[1] - k[0]).collect();
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
