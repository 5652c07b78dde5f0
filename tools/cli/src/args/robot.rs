//! `trueup robot`

use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct RobotArgument {
    /// A file of TOML (see docs/robots.md), URDF or MJCF, or a preset of SpatialFreeFlyer (see `trueup fmu list`)
    pub(crate) file: PathBuf,
    /// Write the robot as TOML to standard output instead: a file to edit
    #[arg(long, conflicts_with_all = ["json", "sweep", "surface", "pose"])]
    pub(crate) toml: bool,
    /// Change inertias that no body has into the nearest ones that some body has; what is changed is reported
    #[arg(long)]
    pub(crate) repair_inertia: bool,
    /// Angles of all joints in rad (ways of prismatic ones in m); all 0 when not given
    #[arg(long, value_name = "Q1,Q2,..", value_delimiter = ',', allow_negative_numbers = true)]
    pub(crate) pose: Vec<f64>,
    /// The hand to look at; the first one when not given
    #[arg(long, value_name = "NAME")]
    pub(crate) tip: Option<String>,
    /// Also look for singular poses along a joint, as in 3=-3..3
    #[arg(long, value_name = "JOINT=A..B", allow_hyphen_values = true)]
    pub(crate) sweep: Option<JointWay>,
    /// Write measures and norms over two joints instead, as in 2,3
    #[arg(long, value_name = "I,J", value_delimiter = ',', conflicts_with_all = ["json", "sweep"])]
    pub(crate) surface: Option<Vec<usize>>,
    /// Joints whose torques count for the measure; all when not given
    #[arg(long, value_name = "I,J,..", value_delimiter = ',')]
    pub(crate) torque_joints: Vec<usize>,
    /// Intervals of the surface along each joint
    #[arg(long, default_value_t = 120, value_parser = clap::value_parser!(u32).range(1..=2000))]
    pub(crate) points: u32,
    /// File of the surface: .csv or .parquet
    #[arg(short, long, value_name = "FILE", default_value = "surface.csv")]
    pub(crate) output: PathBuf,
    /// Page with pictures of the surface
    #[arg(long, value_name = "FILE.html", requires = "surface")]
    pub(crate) plot: Option<PathBuf>,
    /// Machine-readable
    #[arg(long)]
    pub(crate) json: bool,
}

/// A way along one joint, from 1.
#[derive(Clone, Debug)]
pub(crate) struct JointWay {
    pub(crate) joint: usize,
    pub(crate) from: f64,
    pub(crate) to: f64,
}

impl std::str::FromStr for JointWay {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        let parsed = || {
            let (joint, range) = s.split_once('=')?;
            let (from, to) = range.split_once("..")?;
            Some(Self {
                joint: joint.trim().parse().ok()?,
                from: from.trim().parse().ok()?,
                to: to.trim().parse().ok()?,
            })
        };
        parsed()
            .filter(|p| p.from.is_finite() && p.to.is_finite() && p.from < p.to)
            .ok_or_else(|| "write the joint's number and where to look, as in 3=-3..3".into())
    }
}
