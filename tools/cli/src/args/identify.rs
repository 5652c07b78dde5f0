//! `trueup identify`, `trueup statics`

use std::path::PathBuf;
use std::str::FromStr;

use trueup_identification::identify::{ExperimentDesign, IdentifyMethod};

use super::deadline;

/// Values of a span that are looked at.
const VALUES: usize = 15;

#[derive(Debug, Default, clap::Args)]
pub(crate) struct Identify {
    /// A folder of recordings with a case.toml, or that file
    pub(crate) case: PathBuf,
    /// How: ls-literal, ls, filtered, iv, output-error, nelder-mead, innovations, break-away
    #[arg(long, value_name = "NAME", default_value = "output-error")]
    pub(crate) method: IdentifyMethod,
    /// Fit these effects together with the model's parameters, as `effects` in [fit] of case.toml does; `trueup fmu list` has their ids
    #[arg(long, value_name = "ID,..", value_delimiter = ',', conflicts_with = "fmu")]
    pub(crate) with: Vec<String>,
    /// Fit this FMU (Model Exchange, FMI 2.0 or 3.0) instead of the built-in model; one that this program has not packed gets
    /// processes of its own where there are any (Linux); it is native code all the same: trust it first
    #[arg(long, value_name = "FILE.fmu")]
    pub(crate) fmu: Option<PathBuf>,
    /// Give the FMU processes of its own also if this program has packed it
    #[arg(long, requires = "fmu")]
    pub(crate) isolate: bool,
    /// Load the FMU into this process, whatever its vendor: faster, but a crash of the FMU ends the program
    #[arg(long, requires = "fmu", conflicts_with_all = ["isolate", "deadline"])]
    pub(crate) in_process: bool,
    /// How long the work may take, s; with --fmu how long a single call of the FMU may; else as long as it likes
    #[arg(long, value_name = "S", value_parser = deadline)]
    pub(crate) deadline: Option<f64>,
    /// Also print the standard errors that runs begun otherwise are to be expected to have, over a value in SI units, as in
    /// initialSpringOffset=-0.05..0.05 (of an arm initialSpringOffset[1])
    #[arg(long, value_name = "PARAMETER=FROM..TO", allow_hyphen_values = true)]
    pub(crate) design: Option<Span>,
    /// Machine-readable
    #[arg(long)]
    pub(crate) json: bool,
    /// Also draw fit and residuals: one HTML file that opens offline
    #[arg(long, value_name = "FILE.html")]
    pub(crate) plot: Option<PathBuf>,
    /// Intervals from standard errors alone, without profiles: faster
    #[arg(long)]
    pub(crate) fast: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Statics {
    /// A case.toml of an arm, or a TOML file with [[deflection]] tables
    pub(crate) file: PathBuf,
    /// By how much each spring alone is stiffened, as a share of it
    #[arg(long, value_name = "SHARE", default_value_t = 0.2, allow_negative_numbers = true)]
    pub(crate) stiffen: f64,
    /// Machine-readable
    #[arg(long)]
    pub(crate) json: bool,
}

/// Evenly spaced values of a parameter, both ends among them.
#[derive(Clone, Debug)]
pub(crate) struct Span(pub(crate) ExperimentDesign);

impl FromStr for Span {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        let parsed = || {
            let (name, range) = s.split_once('=')?;
            let (from, to) = range.split_once("..")?;
            let number = |text: &str| text.trim().parse::<f64>().ok().filter(|v| v.is_finite());
            Some((name.trim(), number(from)?, number(to)?))
        };
        let (name, from, to) = parsed().filter(|(name, from, to)| !name.is_empty() && from < to).ok_or(
            "write a parameter and its least and largest value in SI units, as in initialSpringOffset=-0.05..0.05",
        )?;
        let last = (VALUES - 1) as f64;
        let value = |k: usize| (from * (last - k as f64) + to * k as f64) / last;
        Ok(Self(ExperimentDesign { name: name.into(), values: (0..VALUES).map(value).collect() }))
    }
}
