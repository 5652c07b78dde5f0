//! `trueup gearbox` and `trueup inverse`

use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Gearbox {
    /// A TOML file with [planetary] and [harmonic-drive] (inertia, stiffness, damping, ratio each) and, if they are known,
    /// motorInertia and loadInertia
    #[arg(value_name = "FILE.toml")]
    pub(crate) file: PathBuf,
    /// Machine-readable
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Inverse {
    /// A recording of the motion: columns `time` and `jointAngle[1]`, `jointAngle[2]` .. (rad), of flexible joints `motorAngle[1]` ..
    #[arg(value_name = "MOTION")]
    pub(crate) motion: PathBuf,
    /// Torques and the motion of the base: .csv or .parquet
    #[arg(short, long, value_name = "FILE", default_value = "torques.csv")]
    pub(crate) output: PathBuf,
    /// Parameter of PlanarManipulator: one element (`linkMass[1]=4`) or all of them (`linkMass=4,3,1`)
    #[arg(long, value_name = "NAME=VALUE", allow_hyphen_values = true)]
    pub(crate) set: Vec<String>,
    /// Which joints are flexible, one entry per joint; all are rigid when not given
    #[arg(long, value_name = "true|false,..", value_delimiter = ',', action = clap::ArgAction::Append)]
    pub(crate) flexible: Vec<bool>,
    /// The base stays where it begins
    #[arg(long)]
    pub(crate) fixed_base: bool,
    /// Standard deviation of the angles, rad: they are smoothed within it; that of the sidecar when not given, else 0
    #[arg(long, value_name = "RAD", allow_negative_numbers = true, value_parser = noise)]
    pub(crate) noise: Option<f64>,
}

fn noise(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number.filter(|s| *s >= 0.0 && s.is_finite()).ok_or_else(|| "write rad, 0 or more, as in 1e-4".to_owned())
}
