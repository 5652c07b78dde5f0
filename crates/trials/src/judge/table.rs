//! One table a run: the truth, the result, whether that is right, and what it took.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::said;
use super::scored::Scored;
use crate::case::{TrialPlant, TrialSplit, TruthKey};
use crate::error::TrialError;
use crate::files;

/// Name of the table in a folder of results.
pub(crate) const FILE: &str = "table.csv";

/// A case with its answer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CaseRow {
    /// Name of its folder.
    pub case: String,
    /// Its plant.
    pub plant: TrialPlant,
    /// The subject.
    pub split: TrialSplit,
    /// Its seed,
    pub seed: u64,
    /// and its number among those of plant and split.
    pub index: usize,
    /// SHA-256 of its key.
    pub seal: String,
    /// What is driven.
    pub drive: String,
    /// Gap that a refit of the model's own parameters leaves, over the floor.
    pub ratio: f64,
    /// What is there: effects, or values that are off, with `+` between them; nothing: none.
    pub truth: String,
    /// The right verdict.
    pub wanted: String,
    /// The result; `failed`, `stopped`.
    pub verdict: String,
    /// What was claimed with its component, `+` between them.
    pub claims: String,
    /// That is right: for single effects by class of at most three, pairs exactly, `ambiguous` with the truth in the set.
    pub right: bool,
    /// Gap on held-out recordings: nominal,
    pub before: Option<f64>,
    /// refitted,
    pub tuned: Option<f64>,
    /// with what is claimed,
    pub after: Option<f64>,
    /// and what noise leaves.
    pub floor: Option<f64>,
    /// Share of it that is closed.
    pub closed: Option<f64>,
    /// Processor time, s.
    pub processor_seconds: Option<f64>,
    /// Wall time, s.
    pub seconds: Option<f64>,
}

impl CaseRow {
    fn of(key: TruthKey, seal: String, said: said::DiagnosisAnswer) -> Self {
        let claims = |c: &said::AnsweredClaim| match &c.component {
            Some(component) => format!("{}@{component}", c.id),
            None => c.id.clone(),
        };
        let scored = Scored { key, said };
        let right = scored.right();
        let Scored { key, said } = scored;
        let gap = &said.gap.overall;
        let gap = gap.as_ref();
        Self {
            truth: key.told(),
            claims: said.effects.iter().map(claims).collect::<Vec<_>>().join("+"),
            before: gap.and_then(|g| g.before),
            tuned: gap.and_then(|g| g.tuned),
            after: gap.and_then(|g| g.after),
            floor: gap.and_then(|g| g.floor),
            closed: gap.and_then(|g| g.closed),
            processor_seconds: said.took.processor_seconds,
            seconds: (said.took.seconds > 0.0).then_some(said.took.seconds),
            case: key.case,
            plant: key.plant,
            split: key.split,
            seed: key.seed,
            index: key.index,
            seal,
            drive: key.drive,
            ratio: key.ratio,
            wanted: key.verdict,
            verdict: said.verdict,
            right,
        }
    }
}

/// The folders of keys and results.
#[derive(Clone, Debug)]
pub struct Answers {
    /// Folder with `cases`, `keys` and `seals.csv`.
    pub trials: PathBuf,
    /// Folder with a result a case.
    pub results: PathBuf,
}

impl Answers {
    /// Of a folder of trials with `results`, or of a folder of results next to its `keys`.
    ///
    /// # Errors
    /// It is neither.
    pub fn find(folder: &Path) -> Result<Self, TrialError> {
        let above = folder.canonicalize().ok().and_then(|f| f.parent().map(Path::to_owned));
        let no_results = folder.ends_with("cases") || folder.ends_with("keys");
        let inside = above.filter(|_| !no_results).map(|above| (above, folder.to_owned()));
        let candidates = [Some((folder.to_owned(), folder.join("results"))), inside];
        let mut candidates = candidates.into_iter().flatten();
        let found = candidates.find(|(trials, results)| trials.join("keys").is_dir() && results.is_dir());
        let why =
            "neither a folder of trials that `trueup trial run` has run nor one of its folders of results";
        found.map(|(trials, results)| Self { trials, results }).ok_or_else(|| TrialError::at(folder, why))
    }

    /// The cases that have an answer, by name.
    ///
    /// # Errors
    /// A key that is not the sealed one; a file that cannot be read.
    pub fn rows(&self) -> Result<Vec<CaseRow>, TrialError> {
        let mut rows = Vec::new();
        for name in files::cases(&self.trials)? {
            if let Some(said) = said::read(&self.results, &name)? {
                let (key, seal) = files::open(&self.trials, &name)?;
                rows.push(CaseRow::of(key, seal, said));
            }
        }
        Ok(rows)
    }

    /// Writes the table of all that have an answer, and gives it back.
    ///
    /// # Errors
    /// As [`Self::rows`]; the file cannot be written.
    pub fn tabulate(&self) -> Result<Vec<CaseRow>, TrialError> {
        let (rows, path) = (self.rows()?, self.results.join(FILE));
        files::whole(&path, &csv(&rows, &path)?)?;
        Ok(rows)
    }
}

/// Rows as CSV.
pub(crate) fn csv<T: Serialize>(rows: &[T], path: &Path) -> Result<String, TrialError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(|e| TrialError::at(path, e))?;
    }
    let bytes = writer.into_inner().map_err(|e| TrialError::at(path, e))?;
    String::from_utf8(bytes).map_err(|e| TrialError::at(path, e))
}
