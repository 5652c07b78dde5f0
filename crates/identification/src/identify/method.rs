//! Methods by their names.

use std::fmt;
use std::str::FromStr;

/// How to estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum IdentifyMethod {
    /// S3 eq. (8) as printed; a warning.
    LsLiteral,
    /// Least squares: aligned, sign column, moving samples.
    Ls,
    /// The same through one zero-phase filter.
    Filtered,
    /// The same with a simulated model as instruments.
    Iv,
    /// Free-running simulation against all readings.
    #[default]
    OutputError,
    /// The same cost by the downhill simplex, without derivatives.
    NelderMead,
    /// Innovations of a filter about the smoothed trajectory, as in a diagnosis.
    Innovations,
    /// Static friction alone, from slow ramps of the current.
    BreakAway,
}

/// Names as on the command line.
pub const METHODS: [(&str, IdentifyMethod); 8] = [
    ("ls-literal", IdentifyMethod::LsLiteral),
    ("ls", IdentifyMethod::Ls),
    ("filtered", IdentifyMethod::Filtered),
    ("iv", IdentifyMethod::Iv),
    ("output-error", IdentifyMethod::OutputError),
    ("nelder-mead", IdentifyMethod::NelderMead),
    ("innovations", IdentifyMethod::Innovations),
    ("break-away", IdentifyMethod::BreakAway),
];

impl FromStr for IdentifyMethod {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        let names: Vec<&str> = METHODS.iter().map(|m| m.0).collect();
        let found = METHODS.iter().find(|m| m.0 == s).map(|m| m.1);
        found.ok_or_else(|| format!("there is no method `{s}`; choose from {}", names.join(", ")))
    }
}

impl fmt::Display for IdentifyMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(METHODS.iter().find(|m| m.1 == *self).map_or("", |m| m.0))
    }
}
