//! Gauss–Legendre quadrature (Abramowitz and Stegun 1964, table 25.4): exact for polynomials of degree `2 n − 1` with n points.

/// The four points on −1 … 1 with their weights.
pub(crate) const FOUR_POINTS: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// Points on −1 … 1 with their weights, by their number.
const TWO_POINTS: [(f64, f64); 2] = [
    (-0.577_350_269_189_625_8, 1.0),
    (0.577_350_269_189_625_8, 1.0),
];
const EIGHT_POINTS: [(f64, f64); 8] = [
    (-0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
    (-0.796_666_477_413_626_7, 0.222_381_034_453_374_47),
    (-0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (-0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_47),
    (0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
];

/// The rules on −1 … 1 with two, four and eight points.
pub(crate) const RULES: [&[(f64, f64)]; 3] = [&TWO_POINTS, &FOUR_POINTS, &EIGHT_POINTS];

/// How many points are used for an integral over one interval.
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

/// Integral of f from the first to the second bound; exchanged bounds change its sign.
pub(crate) fn integral([from, to]: [f64; 2], points: GaussPoints, f: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let points = points.right_half();
    let pair = |(at, weight): &(f64, f64)| weight * (f(middle - half * at) + f(middle + half * at));
    let outer: f64 = points[1..].iter().map(pair).sum();
    half * (points[0].1 * f(middle) + outer)
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
