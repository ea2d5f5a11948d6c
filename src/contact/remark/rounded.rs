//! Numbers in sentences: rounded to significant digits, without an exponent where that reads well.

use std::borrow::Borrow;
use std::fmt::{Display, Formatter, Result};

/// A number that is written with this many significant digits.
#[derive(Debug, Clone, Copy)]
pub struct Rounded(f64, i32);

/// A number with three significant digits.
pub fn short(value: impl Borrow<f64>) -> Rounded {
    Rounded(*value.borrow(), 3)
}

/// Decimal exponents of the numbers that are written without an exponent.
const PLAIN: std::ops::Range<i32> = -4..7;

impl Display for Rounded {
    fn fmt(&self, out: &mut Formatter<'_>) -> Result {
        let Rounded(value, digits) = *self;
        let exponent = value.abs().log10().floor() as i32;
        if value == 0.0 || !value.is_finite() {
            write!(out, "{value}")
        } else if PLAIN.contains(&exponent) {
            let scale = 10_f64.powi(digits - 1 - exponent);
            let decimals = usize::try_from(digits - 1 - exponent).unwrap_or(0);
            let text = format!("{:.decimals$}", (value * scale).round() / scale);
            out.write_str(match text.contains('.') {
                true => text.trim_end_matches('0').trim_end_matches('.'),
                false => &text,
            })
        } else {
            let decimals = usize::try_from(digits - 1).unwrap_or(0);
            write!(out, "{value:.decimals$e}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_usual_size_have_no_exponent() {
        let text = |value| Rounded(value, 3).to_string();
        assert_eq!(text(0.19764), "0.198");
        assert_eq!(text(6973.3), "6970");
        assert_eq!(text(-0.5), "-0.5");
        assert_eq!(text(460.0), "460");
        assert_eq!(text(9.999), "10");
        assert_eq!(text(0.00012345), "0.000123");
        assert_eq!(text(0.0), "0");
        assert_eq!(text(1.5e-9), "1.50e-9");
        assert_eq!(text(-2.5e12), "-2.50e12");
        assert_eq!(text(f64::INFINITY), "inf");
    }
}
