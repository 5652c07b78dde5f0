//! `trueup arm`

use std::path::PathBuf;

#[derive(Debug, clap::Subcommand)]
pub(crate) enum ArmCommand {
    /// Show what bends of an arm under its weight: first mode, tip deflection, each joint's and link's share and what it does to
    /// the first mode, at a pose or over the angles of two joints
    Map(ArmMap),
}

#[derive(Debug, clap::Args)]
pub(crate) struct ArmMap {
    /// A file of TOML (see docs/robots.md) or URDF, or `delian`; its base is held
    #[arg(value_name = "ROBOT", default_value = "delian")]
    pub(crate) robot: PathBuf,
    /// Folder for arm-map.csv and arm-map.html; made if it is not there [default: this one]
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Angles of all motors, joint side, in rad (ways of prismatic joints in m), all 0 when not given; alone: print this pose
    /// instead of a map
    #[arg(long, value_name = "Q1,Q2,..", value_delimiter = ',', allow_hyphen_values = true)]
    pub(crate) pose: Vec<f64>,
    /// The joints over whose angles the map is; the first two that change what the weight does when not given
    #[arg(long, value_name = "I,J", value_delimiter = ',')]
    pub(crate) joints: Option<Vec<usize>>,
    /// Where the angles of both begin, rad [default: -pi/2 and -5 pi/6]
    #[arg(long, value_name = "A,B", value_delimiter = ',', allow_hyphen_values = true)]
    pub(crate) from: Option<Vec<f64>>,
    /// Where they end, rad [default: pi/2 and 5 pi/6]
    #[arg(long, value_name = "A,B", value_delimiter = ',', allow_hyphen_values = true)]
    pub(crate) to: Option<Vec<f64>>,
    /// Steps of both between [default: 18,20]
    #[arg(long, value_name = "N,M", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) steps: Option<Vec<u32>>,
    /// A point mass at the first tip
    #[arg(long, value_name = "KG", default_value_t = 0.0, allow_negative_numbers = true, value_parser = mass)]
    pub(crate) payload: f64,
    /// Acceleration of free fall, m/s2, axes of the upright base [default: 0,0,-9.81]
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_hyphen_values = true)]
    pub(crate) gravity: Option<Vec<f64>>,
    /// Write arm-schedule.toml too: start values with which velocity waves follow the arm, omega_n that share of what lets it run away
    /// with that position gain, and at most so many rad/s [share and most when not given: 0.15, 200]
    #[arg(long, value_name = "KP,SHARE,MOST", value_delimiter = ',', allow_hyphen_values = true, value_parser = of_schedule)]
    pub(crate) schedule: Option<Vec<f64>>,
    /// Machine-readable
    #[arg(long)]
    pub(crate) json: bool,
}

fn of_schedule(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| {
        "give numbers: K_p in 1/s, a share, the largest wave frequency in rad/s, as in 2,0.15,200".to_owned()
    })
}

fn mass(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number.filter(|m| *m >= 0.0 && m.is_finite()).ok_or_else(|| "write kg, 0 or more, as in 2.5".to_owned())
}
