//! The result of a diagnosis, read by its schema alone.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::Deserialize;

use super::run::{TimeTaken, stopped};
use crate::error::TrialError;

/// diagnosis.json, as far as a scorer needs it.
#[derive(Clone, Debug, Default, Deserialize)]
pub(crate) struct DiagnosisAnswer {
    pub(crate) verdict: String,
    #[serde(default)]
    pub(crate) gap: AnsweredGap,
    #[serde(default, rename = "where")]
    pub(crate) places: AnsweredPlaces,
    #[serde(default)]
    pub(crate) effects: Vec<AnsweredClaim>,
    #[serde(default)]
    pub(crate) candidates: Vec<AnsweredClaim>,
    #[serde(default)]
    pub(crate) parameters: BTreeMap<String, AnsweredAmplitude>,
    #[serde(default)]
    pub(crate) unknown: Option<AnsweredUnknown>,
    #[serde(default)]
    pub(crate) indistinguishable: Vec<Vec<String>>,
    /// What it took, where it is known.
    #[serde(skip)]
    pub(crate) took: TimeTaken,
    /// It failed: no verdict at all.
    #[serde(skip)]
    pub(crate) failed: bool,
}

#[derive(Clone, Debug, Default, Deserialize)]
pub(crate) struct AnsweredUnknown {
    #[serde(default)]
    pub(crate) probability: Option<f64>,
}

#[derive(Clone, Debug, Default, Deserialize)]
pub(crate) struct AnsweredGap {
    #[serde(default)]
    pub(crate) overall: Option<OverallGap>,
}

#[derive(Clone, Debug, Default, Deserialize)]
pub(crate) struct OverallGap {
    pub(crate) before: Option<f64>,
    pub(crate) tuned: Option<f64>,
    pub(crate) after: Option<f64>,
    pub(crate) floor: Option<f64>,
    pub(crate) closed: Option<f64>,
}

#[derive(Clone, Debug, Default, Deserialize)]
pub(crate) struct AnsweredPlaces {
    #[serde(default)]
    pub(crate) components: Vec<AnsweredComponent>,
}

#[derive(Clone, Debug, Default, Deserialize)]
pub(crate) struct AnsweredComponent {
    pub(crate) id: String,
}

#[derive(Clone, Debug, Default, Deserialize)]
pub(crate) struct AnsweredClaim {
    pub(crate) id: String,
    #[serde(default)]
    pub(crate) component: Option<String>,
    #[serde(default)]
    pub(crate) joint: Option<usize>,
    #[serde(default)]
    pub(crate) probability: Option<f64>,
    #[serde(default)]
    pub(crate) parameters: BTreeMap<String, AnsweredAmplitude>,
}

#[derive(Clone, Debug, Default, Deserialize)]
pub(crate) struct AnsweredAmplitude {
    #[serde(default)]
    pub(crate) value: Option<f64>,
    #[serde(default)]
    pub(crate) ci95: Option<[Option<f64>; 2]>,
}

/// The result of case `name`; nothing where it was not run.
pub(crate) fn read(results: &Path, name: &str) -> Result<Option<DiagnosisAnswer>, TrialError> {
    let path = results.join(name).join("diagnosis.json");
    if !path.is_file() {
        let failed = results.join(format!("{name}.error")).is_file();
        let missed = |verdict: &str, processor_seconds| {
            let took = TimeTaken { seconds: 0.0, processor_seconds };
            Some(DiagnosisAnswer {
                verdict: verdict.into(),
                failed: true,
                took,
                ..DiagnosisAnswer::default()
            })
        };
        return Ok(match stopped(results, name) {
            Some(at) => missed("stopped", Some(at)),
            None if failed => missed("failed", None),
            None => None,
        });
    }
    let text = fs::read_to_string(&path).map_err(|e| TrialError::at(&path, e))?;
    let mut said: DiagnosisAnswer = serde_json::from_str(&text).map_err(|e| TrialError::at(&path, e))?;
    let took = fs::read_to_string(results.join(name).join("trial.toml")).ok();
    said.took = took.and_then(|t| toml::from_str(&t).ok()).unwrap_or_default();
    Ok(Some(said))
}

impl DiagnosisAnswer {
    /// What `id` could not be distinguished from, itself included; itself alone where that is more than three.
    pub(crate) fn class<'a>(&'a self, id: &'a str) -> Vec<&'a str> {
        let mut class = vec![id];
        for set in self.indistinguishable.iter().filter(|s| s.iter().any(|m| m == id)) {
            for member in set {
                if !class.contains(&member.as_str()) {
                    class.push(member);
                }
            }
        }
        if class.len() > 3 { vec![id] } else { class }
    }
    /// Distinct ids in order of rank.
    pub(crate) fn ranked(&self) -> Vec<&str> {
        let mut ids: Vec<&str> = Vec::new();
        let list = if self.candidates.is_empty() { &self.effects } else { &self.candidates };
        for c in list {
            if !ids.contains(&c.id.as_str()) {
                ids.push(&c.id);
            }
        }
        ids
    }
}
