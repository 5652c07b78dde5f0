//! Scores of an entry, when the keys are out.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::BenchTier;
use super::submission::{BenchEntry, CaseEntry, PublicBench, answer_name, ticks};
use crate::case::{TrialSplit, TruthKey};
use crate::error::TrialError;
use crate::files;
use crate::judge::said::DiagnosisAnswer;
use crate::judge::scored::Scored;

/// Answers that share what an entry leaves over, and 1 % of what it gives: it keeps the logarithm finite.
const ANSWERS: f64 = 50.0;
/// Parts of a hold-out recording over which predictions are compared by themselves.
pub(crate) const WINDOWS: usize = 5;

/// Scores of one case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CaseScore {
    /// Name of its folder.
    pub case: String,
    /// The tier.
    pub tier: BenchTier,
    /// The subject.
    pub split: TrialSplit,
    /// The true answer: `no-gap`, `parameters`, `unknown`, an effect, or two with `+` between them.
    pub truth: String,
    /// The entry's verdict.
    pub verdict: String,
    /// That is right, as the scorecard of trials counts it.
    pub right: bool,
    /// Probability that the entry gives what it claims; of an ambiguous set its sum.
    pub confidence: f64,
    /// ln(0.99 p + 0.01 / 50) of the probability p of the true answer, nats.
    pub log_score: f64,
    /// Sum of (p - 1 for the true answer, else 0)^2 over the answers.
    pub brier: f64,
    /// True values within their 95 % intervals,
    pub covered: usize,
    /// of those that have one.
    pub intervals: usize,
    /// RMS of the error of predictions over the readings' standard deviation; of several readings the root mean square.
    pub gap: Option<f64>,
    /// The same of the readings' declared noise and resolution.
    pub floor: Option<f64>,
    /// Gap over each fifth of the recordings' hidden part, `+` between them.
    pub windows: String,
    /// As reported by the entrant, s.
    pub processor_seconds: Option<f64>,
}

/// The true answer of a key.
pub(crate) fn true_answer(key: &TruthKey) -> String {
    match key.split {
        TrialSplit::Outside => "unknown".into(),
        _ if key.effects.is_empty() => key.verdict.clone(),
        _ => answer_name(&key.effects.iter().map(String::as_str).collect::<Vec<_>>()),
    }
}

/// Scores every case of an entry; `directory` has `public` and `sealed`.
///
/// # Errors
/// A key that is not the one that was published by its hash; whatever [`BenchEntry::read`] refuses.
pub fn score_entry(directory: &Path, file: &Path) -> Result<Vec<CaseScore>, TrialError> {
    let (public, sealed) = (directory.join("public"), directory.join("sealed"));
    let bench = PublicBench::read(&public)?;
    if !sealed.join("keys").is_dir() {
        let why = "there are no keys in it: they are published when the entries are in; `sealed` belongs next to `public`";
        return Err(TrialError::at(&sealed, why));
    }
    let seals = sealed.join("seals.csv");
    if files::hash(files::text(&seals)?.as_bytes()) != bench.notice.seals {
        return Err(TrialError::at(&seals, "the keys are not those that public/bench.toml commits to"));
    }
    let entry = BenchEntry::of(&bench, file)?;
    let mut scores = Vec::new();
    for (name, tier) in &bench.tiers {
        let (key, _) = files::open(&sealed, name)?;
        let Some(said) = entry.cases.get(name) else { continue };
        let measured = Measured::read(&sealed.join("cases").join(name), *tier)?;
        scores.push(case_score(key, *tier, said, &measured));
    }
    Ok(scores)
}

fn case_score(key: TruthKey, tier: BenchTier, said: &CaseEntry, measured: &Measured) -> CaseScore {
    let truth = true_answer(&key);
    let p = |name: &str| said.answers.get(name).copied().unwrap_or(0.0);
    let given: f64 = said.answers.values().sum();
    // What is left over belongs to no answer in particular.
    let left = (1.0 - given).max(0.0) / ANSWERS;
    let at_truth = p(&truth) + left;
    let others: f64 = said.answers.iter().filter(|(n, _)| **n != truth).map(|(_, p)| p * p).sum();
    let (covered, intervals) = coverage(&key, said);
    let ids: Vec<&str> = said.effects.iter().map(|e| e.id.as_str()).collect();
    let confidence = match said.verdict.as_str() {
        "effects" => p(&answer_name(&ids)),
        "ambiguous" => ids.iter().map(|id| p(id)).sum(),
        verdict => p(verdict),
    };
    let (gap, floor, windows) = measured.compare(said);
    let answer = DiagnosisAnswer {
        verdict: said.verdict.clone(),
        effects: said.effects.clone(),
        ..DiagnosisAnswer::default()
    };
    let scored = Scored { key, said: answer };
    CaseScore {
        case: scored.key.case.clone(),
        tier,
        split: scored.key.split,
        right: scored.right(),
        truth,
        verdict: said.verdict.clone(),
        confidence,
        log_score: (0.99 * at_truth + 0.01 / ANSWERS).ln(),
        brier: others + (1.0 - at_truth).powi(2),
        covered,
        intervals,
        gap,
        floor,
        windows: windows.iter().map(|w| format!("{w:.6}")).collect::<Vec<_>>().join("+"),
        processor_seconds: said.processor_seconds,
    }
}

/// True values within their intervals, of those that have one.
fn coverage(key: &TruthKey, said: &CaseEntry) -> (usize, usize) {
    let effects = key
        .amplitudes
        .iter()
        .flat_map(|(id, values)| values.iter().map(move |(name, value)| (format!("{id}.{name}"), *value)));
    let own = key.parameters.iter().map(|(name, value)| (name.clone(), *value));
    let inside = |(name, value): (String, f64)| {
        let [low, high] = said.parameters.get(&name)?.interval?;
        Some((low..=high).contains(&value))
    };
    let all: Vec<bool> = effects.chain(own).filter_map(inside).collect();
    (all.iter().filter(|x| **x).count(), all.len())
}

/// Readings of the hold-out recordings, whole.
struct Measured {
    /// By recording and reading: (time in 1e-5 s, value).
    readings: BTreeMap<(String, String), Vec<(i64, f64)>>,
    /// Standard deviation of noise and rounding, by reading.
    noise: BTreeMap<String, f64>,
}

impl Measured {
    fn read(case: &Path, tier: BenchTier) -> Result<Self, TrialError> {
        let mut readings: BTreeMap<_, Vec<(i64, f64)>> = BTreeMap::new();
        for file in files::list(case)?.into_iter().filter(|f| f.starts_with("holdout")) {
            let path = case.join(&file);
            let mut reader = csv::Reader::from_path(&path).map_err(|e| TrialError::at(&path, e))?;
            let header = reader.headers().map_err(|e| TrialError::at(&path, e))?.clone();
            for record in reader.records() {
                let record = record.map_err(|e| TrialError::at(&path, e))?;
                let mut cells = header.iter().zip(&record);
                let Some(time) = cells.next().and_then(|(_, t)| t.parse().ok()) else { continue };
                for (name, cell) in cells.filter(|(name, _)| !tier.is_input(name)) {
                    if let Ok(value) = cell.parse() {
                        readings
                            .entry((file.clone(), name.to_owned()))
                            .or_default()
                            .push((ticks(time), value));
                    }
                }
            }
        }
        let path = case.join("case.toml");
        let table: toml::Table = files::text(&path)?.parse().map_err(|e| TrialError::at(&path, e))?;
        let channels = table.get("channels").and_then(toml::Value::as_table);
        let number = |t: &toml::Value, key: &str| t.get(key).and_then(toml::Value::as_float).unwrap_or(0.0);
        let noise = channels.into_iter().flatten().map(|(name, c)| {
            (name.clone(), number(c, "noise").hypot(number(c, "resolution") / 12f64.sqrt()))
        });
        Ok(Self { readings, noise: noise.collect() })
    }

    /// Gap, floor, and the gap of each window of the predictions that an entry has.
    fn compare(&self, said: &CaseEntry) -> (Option<f64>, Option<f64>, Vec<f64>) {
        let (mut gaps, mut floors, mut windows) = (Vec::new(), Vec::new(), vec![Vec::new(); WINDOWS]);
        for (place, predicted) in &said.outputs {
            let Some(measured) = self.readings.get(place) else { continue };
            let mean = measured.iter().map(|m| m.1).sum::<f64>() / measured.len() as f64;
            let variance = measured.iter().map(|m| (m.1 - mean).powi(2)).sum::<f64>() / measured.len() as f64;
            let pairs: Vec<f64> = measured
                .iter()
                .filter_map(|(t, y)| predicted.get(t).map(|p| (p - y).powi(2) / variance))
                .collect();
            if pairs.is_empty() || variance <= 0.0 {
                continue;
            }
            gaps.push(pairs.iter().sum::<f64>() / pairs.len() as f64);
            floors.push(self.noise.get(&place.1).map_or(0.0, |s| s * s / variance));
            for (k, w) in windows.iter_mut().enumerate() {
                let part = &pairs[k * pairs.len() / WINDOWS..(k + 1) * pairs.len() / WINDOWS];
                if !part.is_empty() {
                    w.push(part.iter().sum::<f64>() / part.len() as f64);
                }
            }
        }
        let root = |x: &[f64]| (!x.is_empty()).then(|| (x.iter().sum::<f64>() / x.len() as f64).sqrt());
        (root(&gaps), root(&floors), windows.iter().filter_map(|w| root(w)).collect())
    }
}
