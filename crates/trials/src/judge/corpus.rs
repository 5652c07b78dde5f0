//! A corpus: cases that are watched, right ones and wrong ones.
//!
//! It is chosen by how cases came out, so it finds classes of failure and regressions, and is no evidence on which of two
//! programs is better. Wrong ones enter and never leave; right ones are filled up to a number, stratum by stratum.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::table::{CaseRow, csv};
use crate::case::{TrialPlant, TrialSplit};
use crate::error::TrialError;
use crate::files;

/// Copy of the corpus in a folder of its cases.
pub(crate) const FILE: &str = "corpus.csv";

/// A case of a corpus.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CorpusEntry {
    /// Name of its folder.
    pub case: String,
    /// Its plant,
    pub plant: TrialPlant,
    /// its subject,
    pub split: TrialSplit,
    /// its seed,
    pub seed: u64,
    /// and its number among those.
    pub index: usize,
    /// SHA-256 of its key: a generator that makes another case of these numbers is found out.
    pub seal: String,
    /// What is driven.
    pub drive: String,
    /// Gap that a refit of the model's own parameters leaves, over the floor.
    pub ratio: f64,
    /// What is there.
    pub truth: String,
    /// It was right when it entered.
    pub right: bool,
    /// The result then.
    pub said: String,
    /// Of which commit.
    pub commit: String,
}

/// Effect, drive and strength (below 3, below 8, above): what a corpus is spread over.
type Stratum = (String, String, u8);

impl CorpusEntry {
    fn of(row: &CaseRow, commit: &str) -> Self {
        let said = if row.claims.is_empty() {
            row.verdict.clone()
        } else {
            format!("{} {}", row.verdict, row.claims)
        };
        Self {
            case: row.case.clone(),
            plant: row.plant,
            split: row.split,
            seed: row.seed,
            index: row.index,
            seal: row.seal.clone(),
            drive: row.drive.clone(),
            ratio: row.ratio,
            truth: row.truth.clone(),
            right: row.right,
            said,
            commit: commit.to_owned(),
        }
    }
    fn stratum(&self) -> Stratum {
        let strength = if self.ratio < 3.0 { 0 } else { 1 + u8::from(self.ratio >= 8.0) };
        (format!("{} {}", self.split.name(), self.truth), self.drive.clone(), strength)
    }
}

/// The cases of a corpus; none where there is no such file yet.
///
/// # Errors
/// It cannot be read, or a line is none of a corpus.
pub fn read(path: &Path) -> Result<Vec<CorpusEntry>, TrialError> {
    if !path.exists() {
        return Ok(Vec::new());
    }
    let unread =
        |e: csv::Error| TrialError::at(path, format!("{e}; name a corpus that `trueup trial corpus` wrote"));
    let mut reader = csv::Reader::from_path(path).map_err(unread)?;
    reader.deserialize().map(|entry| entry.map_err(unread)).collect()
}

/// Writes a corpus, sorted by name.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, corpus: &[CorpusEntry]) -> Result<(), TrialError> {
    files::whole(path, &csv(corpus, path)?)
}

/// Lets in every wrong case, and right ones up to `right` of each plant, from the strata that have fewest of them; of equal
/// ones by name, which has no meaning. What is in stays as it entered.
pub fn fill(corpus: &mut Vec<CorpusEntry>, rows: &[CaseRow], right: usize, commit: &str) {
    let known = |corpus: &[CorpusEntry], row: &CaseRow| corpus.iter().any(|e| e.case == row.case);
    let new: Vec<&CaseRow> = rows.iter().filter(|r| !known(corpus, r)).collect();
    corpus.extend(new.iter().filter(|r| !r.right).map(|r| CorpusEntry::of(r, commit)));
    for plant in TrialPlant::ALL {
        let mut waiting: Vec<CorpusEntry> =
            new.iter().filter(|r| r.right && r.plant == plant).map(|r| CorpusEntry::of(r, commit)).collect();
        waiting.sort_by(|a, b| a.case.cmp(&b.case));
        let mut taken: [BTreeMap<String, usize>; 3] = Default::default();
        let keys = |e: &CorpusEntry| {
            let (effect, drive, strength) = e.stratum();
            [format!("{effect}/{drive}/{strength}"), effect, format!("{drive}/{strength}")]
        };
        let mut count = 0;
        for e in corpus.iter().filter(|e| e.plant == plant && e.right) {
            count += 1;
            keys(e).into_iter().zip(&mut taken).for_each(|(key, taken)| *taken.entry(key).or_default() += 1);
        }
        while count < right && !waiting.is_empty() {
            let of = |e: &CorpusEntry| -> Vec<usize> {
                keys(e).iter().zip(&taken).map(|(key, taken)| taken.get(key).copied().unwrap_or(0)).collect()
            };
            // Whatever effect has fewest first, then drive and strength.
            let rank = |e: &CorpusEntry| {
                let n = of(e);
                (n[1], n[0], n[2])
            };
            let Some(at) = (0..waiting.len()).min_by_key(|at| rank(&waiting[*at])) else { break };
            let entry = waiting.remove(at);
            keys(&entry)
                .into_iter()
                .zip(&mut taken)
                .for_each(|(key, taken)| *taken.entry(key).or_default() += 1);
            corpus.push(entry);
            count += 1;
        }
    }
    corpus.sort_by(|a, b| a.case.cmp(&b.case));
}

/// Marks a folder of trials as one whose cases were chosen by how they came out.
pub(crate) fn mark(directory: &Path, corpus: &Path) -> Result<(), TrialError> {
    let text = fs::read_to_string(corpus).map_err(|e| TrialError::at(corpus, e))?;
    files::whole(&directory.join(FILE), &text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &str, truth: &str, drive: &str, right: bool) -> CaseRow {
        CaseRow {
            case: name.into(),
            plant: TrialPlant::Joint,
            split: TrialSplit::Single,
            seed: 1,
            index: 0,
            seal: "abc".into(),
            drive: drive.into(),
            ratio: 5.0,
            truth: truth.into(),
            wanted: "effects".into(),
            verdict: "effects".into(),
            claims: truth.into(),
            right,
            before: None,
            tuned: None,
            after: None,
            floor: None,
            closed: None,
            processor_seconds: None,
            seconds: None,
        }
    }

    #[test]
    fn failures_enter_and_stay_and_right_ones_are_spread() {
        let mut rows: Vec<CaseRow> =
            (0..6).map(|i| row(&format!("a{i}"), "backlash", "harmonic drive", true)).collect();
        rows.push(row("b", "backlash", "geared motor", true));
        rows.push(row("c", "sensor-delay", "harmonic drive", true));
        rows.push(row("d", "backlash", "harmonic drive", false));
        let mut corpus = Vec::new();
        fill(&mut corpus, &rows, 3, "one");
        let names: Vec<&str> = corpus.iter().map(|e| e.case.as_str()).collect();
        // The first by name, then the other effect, then the other drive; the failure next to them.
        assert_eq!(names, ["a0", "b", "c", "d"]);
        // What was wrong is right now: it stays as it entered; a new failure enters although right ones are enough.
        let again = [
            row("d", "backlash", "harmonic drive", true),
            row("e", "backlash", "harmonic drive", false),
            row("f", "x", "y", true),
        ];
        fill(&mut corpus, &again, 3, "two");
        let told: Vec<(&str, bool, &str)> =
            corpus.iter().map(|e| (e.case.as_str(), e.right, e.commit.as_str())).collect();
        assert_eq!(
            told,
            [
                ("a0", true, "one"),
                ("b", true, "one"),
                ("c", true, "one"),
                ("d", false, "one"),
                ("e", false, "two")
            ]
        );
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("joint.csv");
        write(&path, &corpus).unwrap();
        assert_eq!(read(&path).unwrap(), corpus);
        assert_eq!(read(&folder.path().join("none.csv")).unwrap(), []);
    }
}
