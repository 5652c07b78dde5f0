//! A case with its recordings.

use std::collections::BTreeMap;
use std::path::Path;

use super::Case;
use crate::error::{SignalsError, verdict};
use crate::finding::{Finding, FindingKind, Severity};
use crate::outlier;
use crate::recording::Recording;
use crate::variable::SignalVariable;

/// A case and all its recordings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loaded {
    /// The content of `case.toml`.
    pub case: Case,
    /// Every recording that it names, by that name.
    pub recordings: BTreeMap<String, Recording>,
}

impl Loaded {
    /// The recordings for fitting, in the order of the case.
    pub fn train(&self) -> Vec<&Recording> {
        self.of(&self.case.train)
    }

    /// The recordings for the figures reported.
    pub fn holdout(&self) -> Vec<&Recording> {
        self.of(&self.case.holdout)
    }

    /// The recordings at rest.
    pub fn rest(&self) -> Vec<&Recording> {
        self.of(&self.case.rest)
    }

    /// Groups of runs of the same command.
    pub fn repeats(&self) -> Vec<Vec<&Recording>> {
        self.case.repeats.iter().map(|group| self.of(group)).collect()
    }

    fn of(&self, names: &[String]) -> Vec<&Recording> {
        names.iter().filter_map(|name| self.recordings.get(name)).collect()
    }
}

impl Case {
    /// Reads a case and all its recordings; single wild readings are left out, with a finding. `variables` gives what is known of the model that the case names
    /// (none: everything is taken as it is), and may refuse it.
    ///
    /// # Errors
    /// [`SignalsError::Wrong`] with everything that is wrong in any of the files.
    pub fn load(
        path: &Path,
        variables: impl FnOnce(&Case) -> Result<Vec<SignalVariable>, SignalsError>,
    ) -> Result<(Loaded, Vec<Finding>), SignalsError> {
        let read = |case: &Case, name: &str, known: &[SignalVariable]| {
            Recording::read(&case.folder.join(name), known, &case.declared(name))
        };
        gather(|known| Self::read(path, known), variables, read)
    }

    /// The same of a `case.toml` that is not written yet: `text` would be in `file`.
    ///
    /// # Errors
    /// As [`Case::load`].
    pub fn load_text(
        file: &Path,
        text: &str,
        variables: impl FnOnce(&Case) -> Result<Vec<SignalVariable>, SignalsError>,
    ) -> Result<(Loaded, Vec<Finding>), SignalsError> {
        let read = |case: &Case, name: &str, known: &[SignalVariable]| {
            Recording::read(&case.folder.join(name), known, &case.declared(name))
        };
        gather(|known| Self::parse(file, text, known), variables, read)
    }

    /// The same from memory: `text` is its `case.toml`, `tables` are the recordings that it names, each as columns
    /// (see [`Recording::of_columns`]).
    ///
    /// # Errors
    /// As [`Case::load`].
    pub fn of_tables(
        text: &str,
        tables: &BTreeMap<String, Vec<(String, Vec<f64>)>>,
        variables: impl FnOnce(&Case) -> Result<Vec<SignalVariable>, SignalsError>,
    ) -> Result<(Loaded, Vec<Finding>), SignalsError> {
        let read = |case: &Case, name: &str, known: &[SignalVariable]| match tables.get(name) {
            Some(columns) => Recording::of_columns(name, columns, known, &case.declared(name)),
            None => {
                let what = "there is no recording of this name";
                let mend = "give it, or take its name out of the case";
                Err(SignalsError::Wrong(vec![Finding::error(
                    FindingKind::MissingFile,
                    Path::new(name),
                    what,
                    mend,
                )]))
            }
        };
        gather(|known| Self::parse(Path::new("case.toml"), text, known), variables, read)
    }
}

fn gather(
    case: impl Fn(&[SignalVariable]) -> Result<(Case, Vec<Finding>), SignalsError>,
    variables: impl FnOnce(&Case) -> Result<Vec<SignalVariable>, SignalsError>,
    recording: impl Fn(&Case, &str, &[SignalVariable]) -> Result<(Recording, Vec<Finding>), SignalsError>,
) -> Result<(Loaded, Vec<Finding>), SignalsError> {
    // The model's variables depend on its structure, which the case itself declares.
    let (first, _) = case(&[])?;
    let known = variables(&first)?;
    let (case, mut findings) = case(&known)?;
    let mut recordings = BTreeMap::new();
    for name in case.recordings() {
        match recording(&case, name, &known) {
            Ok((mut recording, more)) => {
                recording.name = name.into();
                findings.extend(more);
                outlier::leave_out(&mut recording, &known, &mut findings);
                recordings.insert(name.to_owned(), recording);
            }
            Err(SignalsError::Wrong(more)) => findings.extend(more),
            Err(other) => return Err(other),
        }
    }
    lacking(&case, &mut findings);
    verdict(Loaded { case, recordings }, findings)
}

/// A column that the case defines and some recordings do not have is nothing; one that none of them has is a mistake.
fn lacking(case: &Case, findings: &mut Vec<Finding>) {
    let own = |f: &Finding| f.kind == FindingKind::UnknownColumn && f.file == case.file;
    let mut lacks: BTreeMap<u64, usize> = BTreeMap::new();
    findings.iter().filter(|f| own(f)).for_each(|f| *lacks.entry(f.line.unwrap_or(0)).or_default() += 1);
    let all: Vec<_> = case.recordings().into_iter().map(|name| case.declared(name).columns).collect();
    lacks.retain(|line, n| all.iter().filter(|c| c.values().any(|m| m.line == *line)).count() == *n);
    let mut kept = Vec::new();
    for mut finding in std::mem::take(findings) {
        if own(&finding) {
            // Once, of the first recording.
            if lacks.remove(&finding.line.unwrap_or(0)).is_none() {
                continue;
            }
            finding.severity = Severity::Error;
        }
        kept.push(finding);
    }
    *findings = kept;
}
