//! Units of files, and what turns them into SI.

/// A unit: `SI value = factor * value + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignalUnit {
    /// Exponents of kg, m, s, A, K, rad, cycles (Hz), and Mathematics' own 1 not among them.
    pub exponents: [i8; 7],
    /// To SI.
    pub factor: f64,
    /// To SI; only `degC` has one.
    pub offset: f64,
}

/// Symbol, exponents, factor, whether it takes prefixes.
const SYMBOLS: &[(&str, [i8; 7], f64, bool)] = &[
    ("1", [0; 7], 1.0, false),
    ("%", [0; 7], 0.01, false),
    ("kg", [1, 0, 0, 0, 0, 0, 0], 1.0, false),
    ("g", [1, 0, 0, 0, 0, 0, 0], 1e-3, true),
    ("m", [0, 1, 0, 0, 0, 0, 0], 1.0, true),
    ("inch", [0, 1, 0, 0, 0, 0, 0], 0.0254, false),
    ("s", [0, 0, 1, 0, 0, 0, 0], 1.0, true),
    ("min", [0, 0, 1, 0, 0, 0, 0], 60.0, false),
    ("h", [0, 0, 1, 0, 0, 0, 0], 3600.0, false),
    ("A", [0, 0, 0, 1, 0, 0, 0], 1.0, true),
    ("K", [0, 0, 0, 0, 1, 0, 0], 1.0, true),
    ("rad", [0, 0, 0, 0, 0, 1, 0], 1.0, true),
    ("deg", [0, 0, 0, 0, 0, 1, 0], std::f64::consts::PI / 180.0, true),
    ("°", [0, 0, 0, 0, 0, 1, 0], std::f64::consts::PI / 180.0, false),
    ("arcmin", [0, 0, 0, 0, 0, 1, 0], std::f64::consts::PI / 10_800.0, false),
    ("arcsec", [0, 0, 0, 0, 0, 1, 0], std::f64::consts::PI / 648_000.0, false),
    ("rev", [0, 0, 0, 0, 0, 1, 0], std::f64::consts::TAU, false),
    ("rpm", [0, 0, -1, 0, 0, 1, 0], std::f64::consts::TAU / 60.0, false),
    ("Hz", [0, 0, -1, 0, 0, 0, 1], 1.0, true),
    ("N", [1, 1, -2, 0, 0, 0, 0], 1.0, true),
    ("J", [1, 2, -2, 0, 0, 0, 0], 1.0, true),
    ("W", [1, 2, -3, 0, 0, 0, 0], 1.0, true),
    ("V", [1, 2, -3, -1, 0, 0, 0], 1.0, true),
    ("Ohm", [1, 2, -3, -2, 0, 0, 0], 1.0, true),
    ("Nm", [1, 2, -2, 0, 0, 0, 0], 1.0, true),
    ("Nmm", [1, 2, -2, 0, 0, 0, 0], 1e-3, false),
    ("Ncm", [1, 2, -2, 0, 0, 0, 0], 1e-2, false),
    ("Nms", [1, 2, -1, 0, 0, 0, 0], 1.0, false),
    ("gn", [0, 1, -2, 0, 0, 0, 0], 9.806_65, false),
];

const PREFIXES: &[(&str, f64)] =
    &[("n", 1e-9), ("u", 1e-6), ("µ", 1e-6), ("μ", 1e-6), ("m", 1e-3), ("c", 1e-2), ("k", 1e3), ("M", 1e6)];

impl SignalUnit {
    /// No unit.
    pub const ONE: Self = Self { exponents: [0; 7], factor: 1.0, offset: 0.0 };

    /// That of time.
    pub const SECOND: Self = Self { exponents: [0, 0, 1, 0, 0, 0, 0], factor: 1.0, offset: 0.0 };

    /// Reads `N.m/rad`, `kg.m2`, `1/s`, `mA`, `deg/s`, `rpm`, `m/s^2`; empty is 1. One divisor follows each `/`.
    /// `None`: not a unit that is known here.
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        match text {
            "" => return Some(Self::ONE),
            "degC" | "°C" => {
                return Some(Self { exponents: [0, 0, 0, 0, 1, 0, 0], factor: 1.0, offset: 273.15 });
            }
            _ => {}
        }
        let mut unit = Self::ONE;
        let mut sign = 1;
        let mut rest = text;
        loop {
            let end = rest.find(['.', '*', '·', '/', ' ']).unwrap_or(rest.len());
            let (symbol, exponent) = power(&rest[..end])?;
            let (exponents, factor) = symbol_of(symbol)?;
            let exponent = sign * exponent;
            for (to, e) in unit.exponents.iter_mut().zip(exponents) {
                *to = to.checked_add(e.checked_mul(exponent)?)?;
            }
            unit.factor *= factor.powi(i32::from(exponent));
            let Some(separator) = rest[end..].chars().next() else { break };
            sign = if separator == '/' { -1 } else { 1 };
            rest = &rest[end + separator.len_utf8()..];
        }
        (unit.factor.is_finite() && unit.factor > 0.0).then_some(unit)
    }

    /// Whether values of the one can be turned into values of the other. An angle is a number: radians may be left
    /// out (`N.m` for `N.m/rad`), but not the degrees.
    pub fn fits(&self, other: &Self) -> bool {
        let same = self.exponents[..5] == other.exponents[..5] && self.exponents[6] == other.exponents[6];
        let angles = self.exponents[5] == other.exponents[5];
        same && (angles || self.factor == other.factor)
    }

    /// The value in SI.
    pub fn to_si(&self, value: f64) -> f64 {
        if self.factor == 1.0 && self.offset == 0.0 { value } else { self.factor * value + self.offset }
    }

    /// The unit in SI symbols: `kg.m2/s2`.
    pub fn si(&self) -> String {
        let name = |e: i8, s: &str| match e.abs() {
            1 => s.to_owned(),
            e => format!("{s}{e}"),
        };
        let symbols = ["kg", "m", "s", "A", "K", "rad", "Hz"];
        let part = |sign: i8| {
            let factors = self.exponents.iter().zip(symbols).filter(move |(e, _)| **e * sign > 0);
            factors.map(|(e, s)| name(*e, s)).collect::<Vec<_>>()
        };
        let (above, below) = (part(1), part(-1));
        match (above.is_empty(), below.is_empty()) {
            (true, true) => String::new(),
            (false, true) => above.join("."),
            (true, false) => format!("1/{}", below.join("/")),
            (false, false) => format!("{}/{}", above.join("."), below.join("/")),
        }
    }
}

/// `m2`, `s^-1`, `rad`: symbol and exponent.
fn power(text: &str) -> Option<(&str, i8)> {
    if text == "1" {
        return Some((text, 1));
    }
    let text = text.strip_suffix('²').map_or((text, None), |t| (t, Some(2)));
    if let (symbol, Some(e)) = text {
        return Some((symbol, e));
    }
    let digits = text.0.trim_end_matches(|c: char| c.is_ascii_digit());
    let symbol = digits.trim_end_matches(['^', '-', '+']);
    match &text.0[symbol.len()..] {
        "" => Some((symbol, 1)),
        exponent => exponent.trim_start_matches('^').parse().ok().map(|e| (symbol, e)),
    }
}

fn symbol_of(symbol: &str) -> Option<([i8; 7], f64)> {
    let find = |name: &str, prefixed: bool| {
        SYMBOLS.iter().find(|s| s.0 == name && (s.3 || !prefixed)).map(|s| (s.1, s.2))
    };
    find(symbol, false).or_else(|| {
        PREFIXES.iter().find_map(|(prefix, factor)| {
            let (exponents, base) = find(symbol.strip_prefix(prefix)?, true)?;
            Some((exponents, base * factor))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn what_engineers_write_turns_into_si() {
        for (text, si, factor) in [
            ("", "", 1.0),
            ("1", "", 1.0),
            ("deg", "rad", PI / 180.0),
            ("°", "rad", PI / 180.0),
            ("mrad", "rad", 1e-3),
            ("rpm", "rad/s", TAU / 60.0),
            ("rev/min", "rad/s", TAU / 60.0),
            ("deg/s^2", "rad/s2", PI / 180.0),
            ("mA", "A", 1e-3),
            ("Nmm", "kg.m2/s2", 1e-3),
            ("N.mm/deg", "kg.m2/s2/rad", 1e-3 * 180.0 / PI),
            ("kg.m2", "kg.m2", 1.0),
            ("g·cm²", "kg.m2", 1e-7),
            ("1/min", "1/s", 1.0 / 60.0),
            ("ms", "s", 1e-3),
            ("µs", "s", 1e-6),
            ("mm", "m", 1e-3),
            ("s^-1", "1/s", 1.0),
            ("N.m.s/rad", "kg.m2/s/rad", 1.0),
        ] {
            let unit = SignalUnit::parse(text).unwrap_or_else(|| panic!("{text}"));
            assert_eq!(unit.si(), si, "{text}");
            assert!((unit.factor / factor - 1.0).abs() < 1e-14, "{text}: {}", unit.factor);
        }
        assert_eq!(SignalUnit::parse("degC").unwrap().to_si(20.0), 293.15);
    }

    #[test]
    fn what_is_no_unit_and_what_does_not_fit() {
        for text in ["foo", "/s", "N..m", "m^", "kkg", "m999", "rad/", "-", "m-"] {
            assert!(SignalUnit::parse(text).is_none(), "{text}");
        }
        let fits = |a: &str, b: &str| SignalUnit::parse(a).unwrap().fits(&SignalUnit::parse(b).unwrap());
        assert!(fits("deg", "rad") && fits("N.m", "N.m/rad") && fits("rpm", "rad/s") && fits("1/s", "rad/s"));
        assert!(!fits("deg", "A") && !fits("Hz", "rad/s") && !fits("%", "rad") && !fits("V", "A"));
    }
}
