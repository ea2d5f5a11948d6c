//! Points that fill a range evenly, and the normal distribution at them.

use crate::contact::numerics::bracketed_root::bisect;

/// Bases of Halton's sequence for its first dimensions.
pub(crate) const PRIMES: [u32; 12] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37];

/// Element of Halton's sequence (Halton 1960), between 0 and 1; `k` counts from 1.
pub(crate) fn halton(mut k: u32, base: u32) -> f64 {
    let (mut sum, mut part) = (0.0, 1.0);
    while k > 0 {
        part /= f64::from(base);
        sum += part * f64::from(k % base);
        k /= base;
    }
    sum
}

/// Samples of a distribution between two values at the points of one dimension of Halton's sequence: of a uniform one, or of a truncated normal
/// one with a mean and a standard deviation.
pub(crate) fn samples(
    [low, high]: [f64; 2],
    normal: Option<(f64, f64)>,
    count: u32,
    base: u32,
) -> Vec<f64> {
    // The value below which a share of the samples lies.
    let value = |share: f64| match normal {
        Some((mean, deviation)) => {
            let below = |value: f64| normal_probability((value - mean) / deviation);
            let probability = below(low) + share * (below(high) - below(low));
            (mean + deviation * normal_quantile(probability)).clamp(low, high)
        }
        None => low + share * (high - low),
    };
    (1..=count).map(|k| value(halton(k, base))).collect()
}

/// Probability that a standard normal variable is at most `x`, with a relative error of 1e-15.
fn normal_probability(x: f64) -> f64 {
    0.5 * libm::erfc(-x / 2.0_f64.sqrt())
}

/// The value that a standard normal variable exceeds with the probability 1 - `probability`, within ±38, by bisection.
fn normal_quantile(probability: f64) -> f64 {
    let [low, high] = bisect([-38.0, 38.0], 64, |x| normal_probability(x) < probability);
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quantile_inverts_the_probability() {
        for x in [-8.0, -3.0, -0.5, 0.0, 0.1, 2.0, 5.0] {
            let again = normal_quantile(normal_probability(x));
            assert!((again - x).abs() < 1e-8, "{x} {again}");
        }
        // Abramowitz and Stegun, table 26.1.
        assert!((normal_probability(1.0) - 0.841_344_746_068_543).abs() < 1e-14);
    }

    #[test]
    fn means_of_smooth_functions_converge_faster_than_with_random_points() {
        let mean = |count: u32| -> f64 {
            let points = (1..=count).map(|k| (halton(k, 2) * halton(k, 3)).sin());
            points.sum::<f64>() / f64::from(count)
        };
        // ∫∫ sin(x y) over the unit square, by its series.
        let exact: f64 = 0.25 - 1.0 / 96.0 + 1.0 / 4320.0 - 1.0 / 322_560.0 + 1.0 / 36_288_000.0;
        assert!((mean(1000) - exact).abs() < 2e-3);
        assert!((mean(10_000) - exact).abs() < 3e-4);
    }
}
