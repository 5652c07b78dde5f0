//! Numbers as messages show them.

use core::fmt::{Display, Formatter, Result};

/// A number as an engineer reads it: the shortest form that is right to nine significant digits, without the rounding that
/// sums and products leave behind them. For messages only; what is written to be read again has all its digits.
///
/// ```
/// use trueup_numerics::ShortNumber;
///
/// assert_eq!(format!("t = {} s", ShortNumber(0.1 + 0.2)), "t = 0.3 s");
/// assert_eq!(ShortNumber(4.300000000000001e-10).to_string(), "4.3e-10");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortNumber(pub f64);

impl Display for ShortNumber {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let x: f64 = format!("{:.8e}", self.0).parse().unwrap_or(self.0);
        match x.abs() {
            0.0 => f.write_str("0"),
            1e-4..1e9 => write!(f, "{x}"),
            _ => write!(f, "{x:e}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nine_digits_and_no_zeros_behind_them() {
        for (x, shown) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (10.0, "10"),
            (-0.3, "-0.3"),
            (0.1 + 0.2, "0.3"),
            (0.1 * 3.0, "0.3"),
            (1.0 / 3.0, "0.333333333"),
            (0.000_999_999_999_999, "0.001"),
            (2.9 / 29_000.0, "0.0001"),
            (0.000_02, "2e-5"),
            (1e-3 / 7.0 / 1024.0, "1.39508929e-7"),
            (123_456_789.4, "123456789"),
            (123_456.001, "123456.001"),
            (999_999_999.9, "1e9"),
            (3.156e11, "3.156e11"),
            (f64::MIN_POSITIVE, "2.22507386e-308"),
            (f64::MAX, "1.79769313e308"),
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
        ] {
            assert_eq!(ShortNumber(x).to_string(), shown);
        }
    }

    #[test]
    fn what_is_shown_is_right_to_nine_digits() {
        let mut x = 1.234_567_890_123e-12_f64;
        while x < 1e12 {
            let shown: f64 = ShortNumber(x).to_string().parse().unwrap();
            assert!((shown / x - 1.0).abs() <= 5e-9, "{x}: {shown}");
            x *= 1.7;
        }
    }
}
