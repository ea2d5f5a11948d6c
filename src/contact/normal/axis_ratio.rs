//! The ratio of the semi-axes of Hertz's ellipse from that of the curvatures, and the elliptic integrals that it needs.

use std::f64::consts::PI;

/// Of the ratio A/B of the curvatures, both from 0 to 1: the ratio k of the semi-axes as [`axis_ratio`], to about 1e-11, and the integral D
/// there, with a single evaluation of the integrals.
///
/// A rational function that is right to 1e-6 gives the k at which they are evaluated; the rest is a step of Newton, whose derivatives
/// the integrals themselves give: `dK/dk = −(K − D)/k` and `dD/dk = −k (r⁻¹ − 1) D/m` with the `r = k² D/(K − D)` of that k and
/// `m = 1 − k²`.
pub(crate) fn axis_ratio_and_integral(curvature_ratio: f64) -> (f64, f64) {
    let ln_curvatures = curvature_ratio.ln();
    if ln_curvatures < -LN_CURVATURES_FITTED {
        let k = axis_ratio(curvature_ratio);
        return (k, complete_integrals(k).1);
    }
    let square = ln_curvatures * ln_curvatures;
    let sum = |c: [f64; 4]| c[0] + square * (c[1] + square * (c[2] + square * c[3]));
    let k = (ln_curvatures * sum(POWER_ABOVE) / sum(POWER_BELOW))
        .exp()
        .min(1.0);
    let (k_integral, d) = complete_integrals(k);
    let rest = k_integral - d;
    let m = (1.0 - k) * (1.0 + k);
    let r = k * k * d / rest;
    // (1 − r)/m, which is 3/4 at the circle.
    let share = if m > 1e-8 { (1.0 - r) / m } else { 0.75 };
    let off = curvature_ratio / r - 1.0;
    let ln_off = 2.0 * off / (2.0 + off);
    let step = ln_off / (3.0 - share * (1.0 + rest / d));
    (
        (k * (1.0 + step + 0.5 * step * step)).min(1.0),
        d - rest * share * step,
    )
}

/// The smallest ratio of curvatures that the quotient below was fitted to is exp of minus this.
const LN_CURVATURES_FITTED: f64 = 10.0;
/// For A/B from exp(−10) to 1, `ln k/ln(A/B)` is 2/3 at the circle and falls slowly: a quotient of two polynomials of `ln²(A/B)`, fitted
/// to our own inverse of A/B so that the largest error of ln k (1.0e-6) is least. How good the guess is decides the error after the one step that follows, which
/// `one_evaluation_gives_the_axis_ratio_and_the_integral` holds below 2e-12. The numerator.
const POWER_ABOVE: [f64; 4] = [
    2.0 / 3.0,
    0.052_821_991_585_557_69,
    9.364_049_705_523_599e-4,
    2.630_387_036_952_323e-6,
];
/// The denominator that belongs to [`POWER_ABOVE`].
const POWER_BELOW: [f64; 4] = [
    1.0,
    0.083_860_695_138_854_51,
    1.600_879_939_140_760_7e-3,
    4.910_379_437_887_814_5e-6,
];

/// Ratio of the semi-axes (smaller to larger) for the ratio A/B of the curvatures, both from 0 to 1.
///
/// Solves `k² D(k)/(K(k) − D(k)) = A/B` by iterating `k = √(A/B (K − D)/D)`. The bracket varies slowly with k: each
/// step reduces the error at least fourfold, from the circle (where `A/B ≈ k^{3/2}`) to any slender ellipse.
pub(crate) fn axis_ratio(curvature_ratio: f64) -> f64 {
    const STEPS_MAX: usize = 40;
    let mut k = curvature_ratio.powf(2.0 / 3.0);
    for _ in 0..STEPS_MAX {
        let (k_integral, d_integral) = complete_integrals(k);
        let next = (curvature_ratio * (k_integral - d_integral) / d_integral)
            .sqrt()
            .min(1.0);
        let change = (next - k).abs();
        k = next;
        if change <= f64::EPSILON * k {
            break;
        }
    }
    // A quarter to the power of the steps is 1e-24: the loop has converged for every ratio that a case may have.
    k
}

/// Complete elliptic integrals K and `D = (K − E)/m` of parameter m = 1 − k², for 0 < k ≤ 1.
///
/// Arithmetic–geometric mean: `K = π/(2 agm(1, k))` and `D = K Σ 2^{n−1} c_n²/m`. The quotients `c_n²/m` are carried
/// along as such, so nothing is 0/0 at the circle. Relative accuracy a few units in the last place. Source: Gauss;
/// Abramowitz and Stegun 1964, 17.6.
pub(crate) fn complete_integrals(k: f64) -> (f64, f64) {
    let (mut a, mut g) = (0.5 * (1.0 + k), k.sqrt());
    let mut c = 0.5 * (1.0 - k);
    let mut quotient = 0.25 * (1.0 - k) / (1.0 + k);
    let mut weight = 1.0;
    let mut sum = 0.5 + quotient;
    while c > f64::EPSILON * a {
        let a_next = 0.5 * (a + g);
        quotient *= (c / (4.0 * a_next)).powi(2);
        c = c * c / (4.0 * a_next);
        g = (a * g).sqrt();
        a = a_next;
        weight *= 2.0;
        sum += weight * quotient;
    }
    let k_integral = PI / (a + g);
    (k_integral, k_integral * sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

    /// b/a, A/B, A a²E*/(p0 b), B a²E*/(p0 b), K, E; own computation with 20 digits after Johnson 1985, chapter 4.
    const TABLE: [[f64; 6]; 12] = [
        [1.0, 1.0, FRAC_PI_4, FRAC_PI_4, FRAC_PI_2, FRAC_PI_2],
        [0.9, 0.853799, 0.849087, 0.994481, 1.654617, 1.493290],
        [0.8, 0.715418, 0.924084, 1.291671, 1.750754, 1.418083],
        [0.7, 0.585250, 1.013821, 1.732286, 1.862641, 1.345592],
        [0.6, 0.463807, 1.123364, 2.422053, 1.995303, 1.276350],
        [0.5, 0.351772, 1.260613, 3.583611, 2.156516, 1.211056],
        [0.4, 0.250109, 1.438819, 5.752779, 2.359264, 1.150656],
        [0.3, 0.160256, 1.682743, 10.500341, 2.627773, 1.096478],
        [0.2, 0.084555, 2.047511, 24.215045, 3.016112, 1.050502],
        [0.1, 0.027370, 2.706711, 98.892644, 3.695637, 1.015994],
        [0.05, 0.008500, 3.387756, 398.554806, 4.384143, 1.004856],
        [0.01, 0.000499, 4.991814, 9997.754010, 5.991589, 1.000275],
    ];

    #[test]
    fn integrals_agree_with_the_table() {
        for [k, curvature_ratio, a, b, k_expected, e_expected] in TABLE {
            let (k_integral, d) = complete_integrals(k);
            let e = k_integral - (1.0 - k * k) * d;
            assert!(
                (k_integral - k_expected).abs() < 6e-7,
                "K({k}) = {k_integral}"
            );
            assert!((e - e_expected).abs() < 6e-7, "E({k}) = {e}");
            assert!((d - a).abs() < 6e-7, "D({k}) = {d}");
            assert!(((k_integral - d) / (k * k) - b).abs() < 6e-7 * b.max(1.0));
            assert!((d * k * k / (k_integral - d) - curvature_ratio).abs() < 6e-7);
        }
    }

    #[test]
    fn integrals_satisfy_legendres_relation() {
        // K E' + E K' − K K' = π/2 ties k to its complement (Abramowitz and Stegun 1964, 17.3.13).
        for k in [1e-6_f64, 1e-3, 0.1, 0.5, 0.7, 0.999, 1.0 - 1e-9] {
            let complement = ((1.0 - k) * (1.0 + k)).sqrt();
            let ((k1, d1), (k2, d2)) = (complete_integrals(k), complete_integrals(complement));
            let (e1, e2) = (k1 - complement.powi(2) * d1, k2 - k * k * d2);
            assert!(
                (k1 * e2 + e1 * k2 - k1 * k2 - PI / 2.0).abs() < 1e-13 * k1 * k2,
                "{k}"
            );
        }
    }

    #[test]
    fn the_axis_ratio_inverts_the_curvature_ratio() {
        for exponent in -160..=0 {
            let ratio = 10.0_f64.powf(f64::from(exponent) / 10.0);
            let k = axis_ratio(ratio);
            let (k_integral, d) = complete_integrals(k);
            let back = k * k * d / (k_integral - d);
            assert!(
                (back / ratio - 1.0).abs() < 1e-13,
                "A/B = {ratio}: k = {k}, back {back}"
            );
        }
        for distance in [0.0_f64, 1e-15, 1e-12, 1e-8, 1e-4] {
            // Near the circle A/B = k^{3/2} to first order.
            let k = axis_ratio(1.0 - distance);
            assert!(
                (1.0 - k - distance * 2.0 / 3.0).abs() < 1e-15 + distance * distance,
                "{distance}: {k}"
            );
        }
    }

    #[test]
    fn one_evaluation_gives_the_axis_ratio_and_the_integral() {
        for step in 0..=300 {
            // Up to and beyond where the first guess is fitted.
            let ratio = (-0.04 * f64::from(step)).exp();
            let (k, d) = axis_ratio_and_integral(ratio);
            let known = axis_ratio(ratio);
            let errors = [k / known - 1.0, d / complete_integrals(known).1 - 1.0];
            assert!(
                errors.iter().all(|e| e.abs() < 2e-12),
                "{ratio}: {errors:?}"
            );
        }
    }
}
