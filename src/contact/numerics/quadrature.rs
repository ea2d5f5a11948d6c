//! Gauss–Legendre quadrature (Abramowitz and Stegun 1964, table 25.4), exact for polynomials of degree `2 n − 1` with n points; and evenly distributed samples.

use crate::numerics::roots::{HALVINGS, bisect};

/// The four points on −1 … 1 with their weights.
pub(crate) const FOUR_POINTS: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// The rules on −1 … 1 with two, four and eight points: points with their weights.
pub(crate) const RULES: [&[(f64, f64)]; 3] = [
    &[
        (-0.577_350_269_189_625_8, 1.0),
        (0.577_350_269_189_625_8, 1.0),
    ],
    &FOUR_POINTS,
    &[
        (-0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
        (-0.796_666_477_413_626_7, 0.222_381_034_453_374_47),
        (-0.525_532_409_916_329, 0.313_706_645_877_887_3),
        (-0.183_434_642_495_649_8, 0.362_683_783_378_362),
        (0.183_434_642_495_649_8, 0.362_683_783_378_362),
        (0.525_532_409_916_329, 0.313_706_645_877_887_3),
        (0.796_666_477_413_626_7, 0.222_381_034_453_374_47),
        (0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
    ],
];

/// Number of points for an integral over one interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GaussPoints {
    /// Exact for polynomials of degree 5.
    Three,
    /// Exact for polynomials of degree 9.
    Five,
}

impl GaussPoints {
    /// The middle point, then the points of the right half, with their weights.
    fn right_half(self) -> &'static [(f64, f64)] {
        match self {
            GaussPoints::Three => &[
                (0.0, 0.888_888_888_888_889),
                (0.774_596_669_241_483_4, 0.555_555_555_555_555_6),
            ],
            GaussPoints::Five => &[
                (0.0, 0.568_888_888_888_888_9),
                (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
                (0.906_179_845_938_664, 0.236_926_885_056_189_08),
            ],
        }
    }
}

/// Integral of f between two bounds; exchanged bounds reverse its sign.
pub(crate) fn integral([from, to]: [f64; 2], points: GaussPoints, f: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let points = points.right_half();
    let pair = |(at, weight): &(f64, f64)| weight * (f(middle - half * at) + f(middle + half * at));
    let outer: f64 = points[1..].iter().map(pair).sum();
    half * (points[0].1 * f(middle) + outer)
}

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

/// Samples of a distribution between two values at the points of one dimension of Halton's sequence: of a uniform one, or of a truncated normal one with a mean and a
/// standard deviation.
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
    let [low, high] = bisect([-38.0, 38.0], HALVINGS, |x| {
        normal_probability(x) < probability
    });
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_integrated_exactly_up_to_their_degree() {
        for (points, degree) in [(GaussPoints::Three, 5), (GaussPoints::Five, 9)] {
            for power in 0..=degree + 1 {
                let found = integral([0.5, 2.0], points, |x| x.powi(power));
                let n = power + 1;
                let exact = (2.0_f64.powi(n) - 0.5_f64.powi(n)) / f64::from(n);
                let error = (found / exact - 1.0).abs();
                assert_eq!(
                    error < 1e-14,
                    power <= degree,
                    "{points:?} {power}: {error}"
                );
            }
        }
        for rule in RULES {
            for power in 0..2 * rule.len() as i32 {
                let found: f64 = rule.iter().map(|(x, w)| w * x.powi(power)).sum();
                let exact = if power % 2 == 0 {
                    2.0 / f64::from(power + 1)
                } else {
                    0.0
                };
                assert!((found - exact).abs() < 1e-15, "{power}: {found}");
            }
        }
    }
}

#[cfg(test)]
mod sampling_tests {
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
