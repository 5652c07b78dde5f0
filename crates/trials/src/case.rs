//! A case in memory: recordings, the nominal model, and the key.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// The plants.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrialPlant {
    /// `TwoMassJoint`.
    Joint,
    /// `PlanarManipulator`.
    Manipulator,
    /// `SpatialFreeFlyer` on a base that is held: an arm of six joints.
    #[serde(rename = "held-arm")]
    HeldArm,
}

/// What a case is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrialSplit {
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
    /// One of several effects that these data cannot distinguish.
    Unidentifiable,
    /// What a rig has that public recordings cannot show: a current's scale and offset, a load hardly known, a hand that applies forces,
    /// repeats that drift.
    Rig,
}

impl TrialPlant {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Joint, Self::Manipulator, Self::HeldArm];
    /// By its name on the command line.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Manipulator => "manipulator",
            Self::HeldArm => "held-arm",
        }
    }
}

impl TrialSplit {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::None,
        Self::Parameters,
        Self::Single,
        Self::Pairs,
        Self::Outside,
        Self::Unidentifiable,
        Self::Rig,
    ];
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
            Self::Rig => "rig",
        }
    }
    /// The right verdict; of a rig that of one where nothing is off.
    pub(crate) fn verdict(self) -> &'static str {
        match self {
            Self::None | Self::Rig => "no-gap",
            Self::Parameters => "parameters",
            Self::Single | Self::Pairs => "effects",
            Self::Outside => "unknown",
            Self::Unidentifiable => "ambiguous",
        }
    }
}

/// A nominal value that is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moved {
    /// The nominal value.
    pub from: f64,
    /// The true value.
    pub to: f64,
}

/// The truth about a case; only the scorer reads it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TruthKey {
    /// Name of the case's folder.
    pub case: String,
    /// Its plant.
    pub plant: TrialPlant,
    /// The subject.
    pub split: TrialSplit,
    /// `no-gap`, `parameters`, `effects`, `ambiguous` or `unknown`.
    pub verdict: String,
    /// What is there.
    pub effects: Vec<String>,
    /// Where each effect acts.
    pub components: Vec<String>,
    /// Joint (from 1) of each effect; 0: none in particular.
    #[serde(default)]
    pub joints: Vec<usize>,
    /// What cannot be distinguished by design, the truth among it.
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
    /// Which law was used, for the analysis of a failure.
    #[serde(default)]
    pub law: Vec<String>,
    /// True amplitudes by the effect's id, where the library has the same quantity.
    #[serde(default)]
    pub amplitudes: BTreeMap<String, BTreeMap<String, f64>>,
    /// True values of the parameters.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
    /// Of a rig: what a diagnosis has to find moved, under the name in its result.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub moved: BTreeMap<String, Moved>,
}

impl TruthKey {
    /// What is there: effects, then values that are off, with `+` between them; nothing: none.
    pub(crate) fn told(&self) -> String {
        self.effects.iter().chain(self.moved.keys()).cloned().collect::<Vec<_>>().join("+")
    }
}

/// A column of a recording.
#[derive(Clone, Debug)]
pub(crate) struct TrialColumn {
    pub(crate) name: String,
    pub(crate) values: Vec<f64>,
    /// Digits after the point that say all.
    pub(crate) unit_step: f64,
}

/// A run.
#[derive(Clone, Debug)]
pub(crate) struct TrialRecording {
    pub(crate) name: String,
    pub(crate) time: Vec<f64>,
    pub(crate) columns: Vec<TrialColumn>,
}

/// What is declared of a gain or an offset that is to be estimated.
#[derive(Clone, Copy, Debug)]
pub(crate) enum DeclaredGuess {
    /// Nothing.
    Free,
    /// The prior value, with its standard deviation.
    About(f64, f64),
}

/// What is declared of a channel.
#[derive(Clone, Debug, Default)]
pub(crate) struct DeclaredSensor {
    pub(crate) name: String,
    pub(crate) resolution: Option<f64>,
    pub(crate) noise: Option<f64>,
    pub(crate) hold: bool,
    pub(crate) gain: Option<DeclaredGuess>,
    pub(crate) offset: Option<DeclaredGuess>,
}

/// A whole case.
#[derive(Clone, Debug)]
pub(crate) struct TrialCase {
    pub(crate) model: &'static str,
    /// Text of its robot's file, where the model has one.
    pub(crate) robot: Option<String>,
    pub(crate) train: Vec<TrialRecording>,
    pub(crate) holdout: Vec<TrialRecording>,
    pub(crate) rest: Vec<TrialRecording>,
    /// Names of runs with the same command.
    pub(crate) repeats: Vec<Vec<String>>,
    pub(crate) parameters: toml::Table,
    pub(crate) uncertain: toml::Table,
    /// Effects that are known to be there.
    pub(crate) effects: toml::Table,
    pub(crate) payload: toml::Table,
    pub(crate) sensors: Vec<DeclaredSensor>,
    /// Its runs free of noise, of plants that give them.
    pub(crate) truth: Vec<TrialRecording>,
    pub(crate) key: TruthKey,
}
