//! Figures of a result in addition to gaps: RMS of channels, parts of the error, correlations, both sides of a gear.

use serde::{Deserialize, Serialize};

/// RMS(simulated - measured) of a channel over the compared recordings, in its unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelRms {
    /// Unit of all of them.
    pub unit: String,
    /// Nominal parameters.
    pub before: f64,
    /// Own parameters refitted, nothing added.
    pub tuned: f64,
    /// With the effects.
    pub after: f64,
    /// What noise alone leaves.
    pub floor: f64,
}

/// The part of the user's values of parameters in an error budget.
pub const PARAMETERS: &str = "parameters";
/// What no free run separates: parameters and effects as one part.
pub const TOGETHER: &str = "parameters and effects";
/// The part of the sensors' noise.
pub const NOISE: &str = "noise";
/// The part that is left unexplained.
pub const UNEXPLAINED: &str = "unexplained";

/// A part of the square of the overall gap before. The shares of all parts add up to 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorPart {
    /// Effect id, or one of [`PARAMETERS`], [`TOGETHER`], [`NOISE`], [`UNEXPLAINED`].
    pub part: String,
    /// Where an effect acts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub component: Option<String>,
    /// At which joint of an arm, from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<usize>,
    /// Overall gap of the reported model without this part: an effect removed, or the user's values of the parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap_without: Option<f64>,
    /// Share of the square of the gap before.
    pub share: f64,
}

/// Correlation of the estimates' errors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EstimateCorrelation {
    /// Names of the estimates, in the order of rows and columns.
    pub names: Vec<String>,
    /// The matrix.
    pub matrix: Vec<Vec<f64>>,
}

/// A value on either side of a gear; the two act alike.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GearSides {
    /// Seen from the motor.
    pub motor: f64,
    /// Seen from the load.
    pub load: f64,
}
