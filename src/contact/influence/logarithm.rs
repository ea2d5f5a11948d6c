//! A natural logarithm that the compiler can turn into SIMD code.

/// `ln x` for normal, positive `x`.
///
/// `x = 2^e m` with `m` in `√½ … √2`, then `ln m = 2 artanh s`, `s = (m − 1)/(m + 1)`, by its series in `s²` up to
/// `s²¹`. Error at most 4 units in the last place of `max(|ln x|, |ln m|)`. Zero, subnormal, negative and non-finite
/// arguments give meaningless finite or non-finite values, never a panic: callers keep them out.
#[inline(always)]
#[must_use]
pub fn ln(x: f64) -> f64 {
    const SQRT_HALF_BITS: u64 = 0x3fe6_a09e_667f_3bcd;
    const BIAS: u64 = 1024;
    // Shifted so that the exponent field is never negative: SSE2 and AVX2 have no arithmetic 64-bit shift.
    let shifted = x
        .to_bits()
        .wrapping_sub(SQRT_HALF_BITS)
        .wrapping_add(BIAS << 52);
    let exponent_bits = shifted >> 52;
    let mantissa = f64::from_bits(
        x.to_bits()
            .wrapping_sub(exponent_bits.wrapping_sub(BIAS) << 52),
    );
    // 2^52 + k has k in its lowest bits: an integer to float conversion without a conversion instruction.
    let exponent =
        f64::from_bits(exponent_bits | 0x4330_0000_0000_0000) - (4_503_599_627_370_496.0 + 1024.0);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let z = s * s;
    let mut series = 2.0 / 21.0;
    for coefficient in [
        2.0 / 19.0,
        2.0 / 17.0,
        2.0 / 15.0,
        2.0 / 13.0,
        2.0 / 11.0,
        2.0 / 9.0,
        2.0 / 7.0,
        0.4,
        2.0 / 3.0,
    ] {
        series = series * z + coefficient;
    }
    exponent * std::f64::consts::LN_2 + (s * z * series + 2.0 * s)
}

#[cfg(test)]
mod tests {
    use super::ln;

    #[test]
    fn it_agrees_with_the_standard_library_over_the_whole_range() {
        let mut x: f64 = 1e-300;
        while x < 1e300 {
            let expected = x.ln();
            assert!(
                (ln(x) - expected).abs() <= 5e-16 * expected.abs().max(0.5),
                "{x}: {} {expected}",
                ln(x)
            );
            x *= 1.0173;
        }
    }

    #[test]
    fn it_is_exact_at_one_and_smooth_around_it() {
        assert_eq!(ln(1.0), 0.0);
        for k in 1..40 {
            let h = 0.5_f64.powi(k);
            assert!(
                (ln(1.0 + h) - h.ln_1p()).abs() <= 4e-16 * h.max(f64::EPSILON),
                "{h}"
            );
        }
    }
}
