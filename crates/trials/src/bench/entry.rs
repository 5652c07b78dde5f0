//! The entry of a program that writes diagnosis.json: what it wrote, as rows of the benchmark.

use std::collections::BTreeMap;
use std::path::Path;

use super::submission::{BenchEntry, PublicBench, SubmissionRow, answer_name};
use crate::error::TrialError;
use crate::files;
use crate::judge::said::{self, AnsweredClaim, DiagnosisAnswer};
use crate::judge::table::csv;

/// Writes the entry of the results that `trial run` kept of a benchmark's public cases. A diagnosis that failed or was stopped is
/// `unknown`. Gives the entry as it is read again.
///
/// # Errors
/// A case that was not run; a file that cannot be read or written.
pub fn write_entry(public: &Path, results: &Path, file: &Path) -> Result<BenchEntry, TrialError> {
    let bench = PublicBench::read(public)?;
    let mut rows = Vec::new();
    for case in bench.tiers.keys() {
        let Some(said) = said::read(results, case)? else {
            let why = format!("case {case} has no result yet; run it again");
            return Err(TrialError::at(results, why));
        };
        rows.extend(rows_of(case, &said));
    }
    files::whole(file, &csv(&rows, file)?)?;
    BenchEntry::of(&bench, file)
}

fn rows_of(case: &str, said: &DiagnosisAnswer) -> Vec<SubmissionRow> {
    let row = |item: &str, name: &str, value: Option<f64>| SubmissionRow {
        case: case.to_owned(),
        item: item.to_owned(),
        name: name.to_owned(),
        value,
        ..SubmissionRow::default()
    };
    let verdict = if said.failed { "unknown" } else { &said.verdict };
    let mut rows = vec![row("verdict", verdict, None)];
    rows.extend(answers(said).iter().map(|(name, p)| row("answer", name, Some(*p))));
    for e in said.effects.iter().filter(|_| verdict == "effects" || verdict == "ambiguous") {
        let component = e.component.clone().unwrap_or_default();
        let place = e.joint.map_or_else(|| component.clone(), |joint| format!("{component}/{joint}"));
        rows.push(SubmissionRow { place, ..row("effect", &e.id, e.probability) });
    }
    let own = said.parameters.iter().map(|(name, a)| (name.clone(), a));
    let mut values: BTreeMap<_, _> = own.collect();
    for e in &said.effects {
        for (name, a) in &e.parameters {
            // An arm's is that of a joint, which is the effect's place.
            let name = name.split('[').next().unwrap_or(name);
            values.entry(format!("{}.{name}", e.id)).or_insert(a);
        }
    }
    for (name, a) in values {
        let Some(value) = a.value else { continue };
        let [low, high] = a.ci95.unwrap_or_default();
        let (low, high) = low.zip(high).unzip();
        rows.push(SubmissionRow { low, high, ..row("parameter", &name, Some(value)) });
    }
    rows.extend(said.took.processor_seconds.map(|s| row("cost", "", Some(s))));
    rows
}

/// Probabilities of a diagnosis's answers, at most 1 in all.
fn answers(said: &DiagnosisAnswer) -> BTreeMap<String, f64> {
    let mut all: BTreeMap<String, f64> = BTreeMap::new();
    if said.failed {
        return BTreeMap::from([("unknown".into(), 1.0)]);
    }
    let unknown = said.unknown.as_ref().and_then(|u| u.probability).unwrap_or(0.0).clamp(0.0, 1.0);
    let mut add = |name: String, p: f64| *all.entry(name).or_default() += p;
    add("unknown".into(), unknown);
    let claimed: Vec<&str> = said.effects.iter().map(|e| e.id.as_str()).collect();
    let singles = |list: &[AnsweredClaim]| -> Vec<(String, f64)> {
        list.iter().map(|c| (c.id.clone(), c.probability.unwrap_or(0.0).clamp(0.0, 1.0))).collect()
    };
    match said.verdict.as_str() {
        "no-gap" | "parameters" => add(said.verdict.clone(), 1.0 - unknown),
        "effects" if claimed.len() > 1 => {
            let p = singles(&said.effects).iter().map(|s| s.1).fold(1.0, f64::min);
            add(answer_name(&claimed), p);
        }
        _ => {
            let list = if said.candidates.is_empty() { &said.effects } else { &said.candidates };
            singles(list).into_iter().for_each(|(id, p)| add(id, p));
        }
    }
    all.retain(|_, p| *p > 0.0);
    let sum: f64 = all.values().sum();
    if sum > 1.0 {
        all.values_mut().for_each(|p| *p /= sum);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_of_every_verdict_are_probabilities() {
        let of = |text: &str| -> Vec<(String, f64)> {
            let said: DiagnosisAnswer = serde_json::from_str(text).unwrap();
            answers(&said).into_iter().map(|(n, p)| (n, (100.0 * p).round() / 100.0)).collect()
        };
        let owned = |list: &[(&str, f64)]| -> Vec<(String, f64)> {
            list.iter().map(|(n, p)| ((*n).to_owned(), *p)).collect()
        };
        assert_eq!(
            of(r#"{"verdict": "no-gap", "unknown": {"probability": 0.1}}"#),
            owned(&[("no-gap", 0.9), ("unknown", 0.1)])
        );
        let pair = r#"{"verdict": "effects", "effects": [{"id": "b", "probability": 0.8}, {"id": "a", "probability": 0.7}],
                       "candidates": [{"id": "b", "probability": 0.8}], "unknown": {"probability": 0.3}}"#;
        assert_eq!(of(pair), owned(&[("a+b", 0.7), ("unknown", 0.3)]));
        // Two places of one effect are one answer; more than 1 in all is scaled.
        let single = r#"{"verdict": "effects", "effects": [{"id": "a", "probability": 0.9}],
            "candidates": [{"id": "a", "probability": 0.9}, {"id": "a", "probability": 0.1}, {"id": "c", "probability": 0.5}],
            "unknown": {"probability": 0.5}}"#;
        assert_eq!(of(single), owned(&[("a", 0.5), ("c", 0.25), ("unknown", 0.25)]));
    }
}
