//! SIMD level of the kernels, numbers in single and double precision with a vectorisable logarithm, and the length of a plane vector.

use std::cell::Cell;
use std::fmt::{self, Display, Formatter};
use std::ops::{Add, Mul, Neg, Sub};

use pulp::{Arch, WithSimd};

/// Number of lanes of packed values. Lists of values per cell are padded to a multiple of it, so that products need no remainder loop.
pub const LANES: usize = 16;

thread_local! {
    /// The level set by [`SimdLevel::during`] on this thread.
    static CHOSEN: Cell<Option<Arch>> = const { Cell::new(None) };
}

/// An instruction set of the processor.
///
/// Levels differ in the width of their sums, and therefore in the last digits of results.
#[derive(Debug, Clone, Copy)]
pub struct SimdLevel(Arch);

impl SimdLevel {
    /// All levels of the processor, lowest first.
    pub fn available() -> Vec<SimdLevel> {
        let mut levels = vec![Arch::Scalar];
        #[cfg(target_arch = "x86_64")]
        {
            levels.extend(pulp::x86::V3::try_new().map(Arch::V3));
            levels.extend(pulp::x86::V4::try_new().map(Arch::V4));
        }
        #[cfg(not(target_arch = "x86_64"))]
        if !matches!(Arch::new(), Arch::Scalar) {
            levels.push(Arch::new());
        }
        levels.into_iter().map(SimdLevel).collect()
    }

    /// The level of the kernels on this thread.
    pub fn current() -> SimdLevel {
        SimdLevel(CHOSEN.get().unwrap_or_default())
    }

    /// Runs `work` with the kernels of this level on this thread.
    ///
    /// Factorisations and Fourier transforms of libraries choose their own instructions.
    pub fn during<R>(self, work: impl FnOnce() -> R) -> R {
        /// Restores the level, also after a panic.
        struct Restore(Option<Arch>);
        impl Drop for Restore {
            fn drop(&mut self) {
                CHOSEN.set(self.0);
            }
        }
        let _restore = Restore(CHOSEN.replace(Some(self.0)));
        work()
    }
}

impl Display for SimdLevel {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let name = format!("{:?}", self.0);
        f.write_str(name.split(['(', ' ']).next().unwrap_or_default())
    }
}

/// Runs a kernel at the level of this thread.
pub(crate) fn dispatch<Kernel: WithSimd>(kernel: Kernel) -> Kernel::Output {
    SimdLevel::current().0.dispatch(kernel)
}

/// A floating-point number of the kernels.
pub trait Float:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + std::ops::Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// A number far below every length and far above the smallest normal number.
    const TINY: Self;
    /// The nearest number of this precision.
    fn of(value: f64) -> Self;
    /// Square root.
    #[must_use]
    fn sqrt(self) -> Self;
    /// Magnitude.
    #[must_use]
    fn abs(self) -> Self;
    /// Natural logarithm of a normal, positive number; see the implementations for their errors.
    #[must_use]
    fn ln(self) -> Self;
}

/// `ln x` with `x = 2^e m`, `m` in `√½ … √2` and `ln m = 2 artanh s`, `s = (m − 1)/(m + 1)`, by its series in `s²`. The result for zero, subnormal, negative and
/// non-finite arguments is meaningless, but never a panic. Products and sums are fused, so they round once and alike on every machine.
macro_rules! number {
    (
        $float:ty, $bits:ty, tiny $tiny:expr, sqrt_half $sqrt_half:expr, mantissa $mantissa:expr, bias $bias:expr,
        magic $magic:expr, $magic_value:expr, series $series:expr, $error:literal
    ) => {
        impl Float for $float {
            const ZERO: Self = 0.0;
            const TINY: Self = $tiny;

            #[inline(always)]
            fn of(value: f64) -> Self {
                value as $float
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                <$float>::sqrt(self)
            }

            #[inline(always)]
            fn abs(self) -> Self {
                <$float>::abs(self)
            }

            #[doc = $error]
            #[inline(always)]
            fn ln(self) -> Self {
                // Shifted so that the exponent field is never negative: SSE2 and AVX2 have no arithmetic 64-bit shift.
                let shifted = self
                    .to_bits()
                    .wrapping_sub($sqrt_half)
                    .wrapping_add($bias << $mantissa);
                let exponent_bits = shifted >> $mantissa;
                let mantissa = <$float>::from_bits(
                    self.to_bits()
                        .wrapping_sub(exponent_bits.wrapping_sub($bias) << $mantissa),
                );
                // 2^mantissa + k holds k in its lowest bits: this converts an integer to a float without a conversion instruction.
                let exponent =
                    <$float>::from_bits(exponent_bits | $magic) - ($magic_value + $bias as $float);
                let s = (mantissa - 1.0) / (mantissa + 1.0);
                let z = s * s;
                let mut series: $float = 0.0;
                for coefficient in $series {
                    series = series.mul_add(z, coefficient);
                }
                exponent.mul_add(
                    std::f64::consts::LN_2 as $float,
                    (s * z).mul_add(series, 2.0 * s),
                )
            }
        }
    };
}

number!(
    f64, u64, tiny 1e-290, sqrt_half 0x3fe6_a09e_667f_3bcd, mantissa 52, bias 1024_u64,
    magic 0x4330_0000_0000_0000, 4_503_599_627_370_496.0,
    series [
        2.0 / 21.0, 2.0 / 19.0, 2.0 / 17.0, 2.0 / 15.0, 2.0 / 13.0, 2.0 / 11.0, 2.0 / 9.0, 2.0 / 7.0, 0.4, 2.0 / 3.0,
    ],
    "Error at most 4 units in the last place of `max(|ln x|, |ln m|)`."
);
number!(
    f32, u32, tiny 1e-30, sqrt_half 0x3f35_04f3, mantissa 23, bias 128_u32,
    magic 0x4b00_0000, 8_388_608.0,
    series [2.0 / 9.0, 2.0 / 7.0, 0.4, 2.0 / 3.0],
    "Error at most 2 units in the last place of `max(|ln x|, |ln m|)`."
);

/// `√(x² + y²)` for numbers whose squares do not overflow, such as dimensionless ones. With `f64::hypot` a creep map of 1000 motions takes 6 % longer.
pub fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::SimdLevel;

    #[test]
    fn a_level_holds_during_the_work_and_no_longer() {
        let best = SimdLevel::current().to_string();
        for level in SimdLevel::available() {
            let seen = level.during(|| SimdLevel::current().to_string());
            assert_eq!(seen, level.to_string());
            assert_eq!(SimdLevel::current().to_string(), best);
        }
        let levels = SimdLevel::available();
        assert_eq!(levels.last().map(ToString::to_string), Some(best));
    }
}

#[cfg(test)]
mod simd_ln_tests {
    use super::Float;

    #[test]
    fn it_agrees_with_the_standard_library_over_the_whole_range() {
        let mut x: f64 = 1e-300;
        while x < 1e300 {
            let expected = x.ln();
            let found = Float::ln(x);
            assert!(
                (found - expected).abs() <= 5e-16 * expected.abs().max(0.5),
                "{x}: {found} {expected}"
            );
            x *= 1.0173;
        }
        let mut x: f32 = 1e-35;
        while x < 1e35 {
            let expected = f64::from(x).ln();
            let found = f64::from(Float::ln(x));
            assert!(
                (found - expected).abs() <= 2e-7 * expected.abs().max(0.5),
                "{x}: {found} {expected}"
            );
            x *= 1.0173;
        }
    }

    #[test]
    fn it_is_exact_at_one_and_smooth_around_it() {
        assert_eq!(Float::ln(1.0_f64), 0.0);
        assert_eq!(Float::ln(1.0_f32), 0.0);
        for k in 1..40 {
            let h = 0.5_f64.powi(k);
            let found = Float::ln(1.0 + h);
            assert!(
                (found - h.ln_1p()).abs() <= 4e-16 * h.max(f64::EPSILON),
                "{h}"
            );
        }
    }
}
