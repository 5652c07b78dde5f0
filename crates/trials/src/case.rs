//! A case in memory: recordings, what their owner believes, and the key.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// The plants.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Plant {
    /// `TwoMassJoint`.
    Joint,
    /// `PlanarManipulator`.
    Manipulator,
}

/// What a case is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// Nothing but the sensors.
    None,
    /// Wrong values of what the model has.
    Parameters,
    /// One effect.
    Single,
    /// Two effects.
    Pairs,
    /// Something that the list of effects does not have.
    Outside,
    /// One of several effects that these data cannot tell apart.
    Unidentifiable,
}

impl Plant {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Joint, Self::Manipulator];
    /// By its name on the command line.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Manipulator => "manipulator",
        }
    }
}

impl Split {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::None, Self::Parameters, Self::Single, Self::Pairs, Self::Outside, Self::Unidentifiable];
    /// By its name on the command line.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.name() == name)
    }
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Parameters => "parameters",
            Self::Single => "single",
            Self::Pairs => "pairs",
            Self::Outside => "outside",
            Self::Unidentifiable => "unidentifiable",
        }
    }
}

/// The truth about a case; only the scorer reads it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Key {
    /// Name of the case's folder.
    pub case: String,
    /// Its plant.
    pub plant: Plant,
    /// What it is about.
    pub split: Split,
    /// `no-gap`, `parameters`, `effects`, `ambiguous` or `unknown`.
    pub verdict: String,
    /// What is there.
    pub effects: Vec<String>,
    /// Where each effect acts.
    pub components: Vec<String>,
    /// Joint (from 1) of each effect; 0: none in particular.
    #[serde(default)]
    pub joints: Vec<usize>,
    /// What cannot be told apart by design, the truth among it.
    #[serde(default)]
    pub class: Vec<String>,
    /// What is driven and how it is measured, in words: what cases are stratified by.
    #[serde(default)]
    pub drive: String,
    /// Gap that a refit of the model's own parameters leaves, over the floor.
    pub ratio: f64,
    /// The seed that it was drawn from.
    pub seed: u64,
    /// Number among those of its split.
    pub index: usize,
    /// Which law was used, for whoever looks into a failure.
    #[serde(default)]
    pub law: Vec<String>,
    /// True amplitudes by the effect's id, where the library has the same quantity.
    #[serde(default)]
    pub amplitudes: BTreeMap<String, BTreeMap<String, f64>>,
    /// True values of the parameters.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
}

/// A column of a recording.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    pub(crate) name: String,
    pub(crate) values: Vec<f64>,
    /// Digits after the point that say all.
    pub(crate) unit_step: f64,
}

/// A run.
#[derive(Clone, Debug)]
pub(crate) struct Recording {
    pub(crate) name: String,
    pub(crate) time: Vec<f64>,
    pub(crate) columns: Vec<Column>,
}

/// What is declared of a channel.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sensor {
    pub(crate) name: String,
    pub(crate) resolution: Option<f64>,
    pub(crate) noise: Option<f64>,
    pub(crate) hold: bool,
    pub(crate) offset: bool,
}

/// A whole case.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    pub(crate) model: &'static str,
    pub(crate) train: Vec<Recording>,
    pub(crate) holdout: Vec<Recording>,
    pub(crate) rest: Vec<Recording>,
    /// Names of runs with the same command.
    pub(crate) repeats: Vec<Vec<String>>,
    pub(crate) parameters: toml::Table,
    pub(crate) uncertain: toml::Table,
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) key: Key,
}
