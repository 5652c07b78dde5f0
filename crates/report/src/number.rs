//! Numbers as people read them.

/// Four significant digits, powers of ten where they are shorter: `0.25`, `1750`, `3.07e-5`.
pub fn number(x: f64) -> String {
    let magnitude = x.abs();
    if x == 0.0 || !x.is_finite() {
        return if x == 0.0 { "0".to_owned() } else { format!("{x}") };
    }
    let trimmed = |text: String| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    };
    if !(1e-3..1e5).contains(&magnitude) {
        let text = format!("{x:.3e}");
        let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}e{power}", trimmed(digits.to_owned()));
    }
    let digits = (3 - magnitude.log10().floor() as i32).max(0) as usize;
    trimmed(format!("{x:.digits$}"))
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn short_and_true_to_four_digits() {
        let cases = [
            (0.0, "0"),
            (-0.25, "-0.25"),
            (1.0, "1"),
            (1754.167, "1754"),
            (3.07e-5, "3.07e-5"),
            (99_999.0, "99999"),
            (1e5, "1e5"),
            (-2.99e-4, "-2.99e-4"),
            (0.004_567_89, "0.004568"),
            (f64::NAN, "NaN"),
        ];
        for (x, text) in cases {
            assert_eq!(number(x), text);
        }
    }
}
