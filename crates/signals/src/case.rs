//! A folder of recordings with a `case.toml`.

mod effects;
mod load;
mod parse;
mod payload;
mod weight;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

pub use load::Loaded;
pub use weight::FitWeight;

use crate::columns::ColumnRule;
use crate::names::base_name;
use crate::recording::{ChannelSettings, DeclaredFigures};
pub use crate::value::ParameterValue;

/// An effect that is there for certain, and belongs to the nominal model. Values of its parameters and their standard deviations are
/// among those of the case.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KnownEffect {
    /// As in the list of effects, a place behind a colon.
    pub id: String,
    /// Which joint of an arm, from 1; `None`: of a joint, at no joint, or as given by arrays of its parameters.
    pub joint: Option<usize>,
    /// Its parameters that the case gives, an array's element under its indexed name.
    pub given: Vec<String>,
}

/// The content of `case.toml`. Arrays of parameters are kept element by element (`linkMass[1]`).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Case {
    /// The folder of the recordings.
    pub folder: PathBuf,
    /// The `case.toml` itself.
    pub file: PathBuf,
    /// The model's name, or the file name of an FMU.
    pub model: String,
    /// What the variables of an FMU mean: the file name of a `ports.toml`.
    pub ports: Option<String>,
    /// What a robot is made of: the file name of a robot, or the name of a preset.
    pub robot: Option<String>,
    /// Recordings that may be used for fitting.
    pub train: Vec<String>,
    /// Recordings only for the figures reported.
    pub holdout: Vec<String>,
    /// Runs of one command, each a group: their differences are noise.
    pub repeats: Vec<Vec<String>>,
    /// Recordings at rest: their variation is noise.
    pub rest: Vec<String>,
    /// The nominal simulation: assumed values, structural choices too.
    pub parameters: BTreeMap<String, ParameterValue>,
    /// Relative prior standard deviation of these values; none, or 0: assumed known.
    pub uncertain: BTreeMap<String, f64>,
    /// Effects that are there for certain, each once a joint.
    pub effects: Vec<KnownEffect>,
    /// Which link carries a body, from 1; its figures are parameters that begin with `payload.`, their standard deviations in SI.
    pub payload: Option<usize>,
    /// What is to be estimated (arrays or elements); `None`: the model's default.
    pub fit: Option<Vec<String>>,
    /// Effects that are estimated together with the model's parameters, without prior values.
    pub with: Vec<String>,
    /// Stretches of the recordings for fitting whose readings count for less.
    pub weights: Vec<FitWeight>,
    /// What holds for a channel in all recordings; an array's name for its elements.
    pub channels: BTreeMap<String, ChannelSettings>,
    /// Rows a second of all recordings, in Hz, whatever their clocks show; `None`: by the clocks.
    pub rate: Option<f64>,
    /// What columns of its recordings are.
    pub columns: Vec<ColumnRule>,
}

impl Case {
    /// What holds for this recording of it.
    pub(crate) fn declared(&self, recording: &str) -> DeclaredFigures {
        let columns = ColumnRule::of(&self.columns, recording);
        DeclaredFigures { channels: self.channels.clone(), rate: self.rate, columns }
    }

    /// The FMU that it names as its model, in its folder; `None`: it names a model.
    pub fn fmu(&self) -> Option<PathBuf> {
        self.model.to_lowercase().ends_with(".fmu").then(|| self.folder.join(&self.model))
    }

    /// The file of its robot, in its folder where there is one of that name; else as it is named.
    pub fn robot_file(&self) -> Option<PathBuf> {
        let name = self.robot.as_ref()?;
        let file = self.folder.join(name);
        Some(if file.exists() || name.contains('.') { file } else { PathBuf::from(name) })
    }

    /// Its name: that of its folder; empty of a case from memory.
    pub fn name(&self) -> String {
        if self.folder.as_os_str().is_empty() && self.file.as_os_str().is_empty() {
            return String::new();
        }
        let folder = self.folder.canonicalize().unwrap_or_else(|_| self.folder.clone());
        folder.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// The nominal value of this parameter or element.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.parameters.get(name)?.number()
    }

    /// The elements of an array in order, or the scalar alone; empty if the case does not name it.
    pub fn elements(&self, base: &str) -> Vec<&ParameterValue> {
        let mut all: Vec<_> = self
            .parameters
            .iter()
            .filter(|(name, _)| base_name(name) == base)
            .map(|(name, value)| (indices(name), value))
            .collect();
        all.sort_by(|a, b| a.0.cmp(&b.0));
        all.into_iter().map(|(_, value)| value).collect()
    }

    /// Relative prior standard deviation of a parameter or element, above 0; one given for an array holds for its elements. 0
    /// marks one element of an array as known: `None`, as for a value without an entry.
    pub fn doubt(&self, name: &str) -> Option<f64> {
        let doubt = self.uncertain.get(name).or_else(|| self.uncertain.get(base_name(name)));
        doubt.copied().filter(|d| *d > 0.0)
    }

    /// Whether `[fit] parameters` names this parameter or element, or its array; `None` if the case has no such list.
    pub fn fits(&self, name: &str) -> Option<bool> {
        Some(self.fit.as_ref()?.iter().any(|f| f == name || f == base_name(name)))
    }

    /// Ids of the effects that are there for certain, each once.
    pub fn known_effects(&self) -> Vec<&str> {
        let mut all: Vec<&str> = Vec::new();
        self.effects.iter().for_each(|e| {
            if !all.contains(&e.id.as_str()) {
                all.push(&e.id);
            }
        });
        all
    }

    /// Every recording that is named, once.
    pub fn recordings(&self) -> Vec<&str> {
        let mut seen = BTreeSet::new();
        let lists = [&self.train, &self.holdout, &self.rest];
        let all = lists.into_iter().chain(&self.repeats).flatten();
        all.map(String::as_str).filter(|name| seen.insert(*name)).collect()
    }
}

/// Of `a[2,1]`: 2, 1.
fn indices(name: &str) -> Vec<usize> {
    let inside = name[base_name(name).len()..].trim_matches(['[', ']']);
    inside.split(',').filter_map(|i| i.parse().ok()).collect()
}
