//! `trueup scale`

use std::path::PathBuf;

use trueup_scaling::GivenExponent;

#[derive(Debug, clap::Args)]
pub(crate) struct ScaleCommand {
    /// A system (.toml, .ssp), an FMU (its own values become a system), a case with its recordings, a table of quantities (.toml), or a
    /// recording (.csv)
    pub(crate) file: PathBuf,
    /// Size of the scaled system by that of the full one
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = lambda)]
    pub(crate) lambda: f64,
    /// From the scaled size to the full one
    #[arg(long)]
    pub(crate) back: bool,
    /// Exponent of lambda for what has no law: of a base unit (`A=0`, `K=0`), or of a variable or array
    /// (`plant.torqueConstant=3`), which goes before its unit's; may be repeated
    #[arg(long, value_name = "NAME=W", allow_hyphen_values = true, value_parser = given)]
    pub(crate) exponent: Vec<GivenExponent>,
    /// Where the units of a recording's columns are from: the system or the FMU that they are variables of
    #[arg(long, value_name = "FILE")]
    pub(crate) units: Option<PathBuf>,
    /// The result [default: NAME.scaled, with --back NAME.full, next to FILE; of an FMU a .toml, of a case a folder]
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
}

fn lambda(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number.filter(|x| *x > 0.0 && x.is_finite()).ok_or_else(|| "write a number above 0, as in 0.3".to_owned())
}

fn given(text: &str) -> Result<GivenExponent, String> {
    let parsed = text.rsplit_once('=').and_then(|(name, w)| Some((name.trim(), w.trim().parse().ok()?)));
    parsed
        .filter(|(name, w): &(&str, f64)| !name.is_empty() && w.is_finite())
        .map(|(name, exponent)| GivenExponent { name: name.to_owned(), exponent })
        .ok_or_else(|| "write NAME=W, as in A=0 or plant.torqueConstant=3".to_owned())
}
