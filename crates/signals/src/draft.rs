//! A `case.toml` drafted from logs: which column is which variable, in which unit, which recordings are for fitting.
//!
//! What was not read off the logs is marked with `GUESS` in the text.

mod assign;
mod lerobot;
mod look;
mod model;
mod split;
mod text;
mod words;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::case::Case;
use crate::error::SignalsError;
use crate::finding::{Finding, FindingKind, Severity};
use crate::variable::{SignalVariable, VariableRole};
use assign::{Assigned, assign};
use look::{LookedLog, look};
pub use model::{DraftModel, DraftParameter};
use split::Split;
use text::DraftText;
use words::Quantity;

/// Logs that were looked at.
#[derive(Clone, Debug)]
pub struct DraftLogs {
    logs: Vec<LookedLog>,
    folder: PathBuf,
    rate: Option<f64>,
}

/// A draft.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CaseDraft {
    /// Where it is to be written.
    pub file: PathBuf,
    /// Its content.
    pub text: String,
    /// What was recognised and what was not, in lines.
    pub summary: Vec<String>,
    /// How many guesses are marked in it.
    pub guesses: usize,
}

impl DraftLogs {
    /// Looks at logs; `time` names their clock, `rate` (Hz) replaces it.
    ///
    /// # Errors
    /// [`SignalsError::Wrong`]: a log that cannot be read, two clocks that do not agree, no clock.
    pub fn look(files: &[PathBuf], time: Option<&str>, rate: Option<f64>) -> Result<Self, SignalsError> {
        let mut findings = Vec::new();
        let logs: Vec<LookedLog> = files.iter().flat_map(|file| look(file, time, &mut findings)).collect();
        for log in logs.iter().filter(|l| l.clock.is_none() && rate.is_none()) {
            let names: Vec<_> = log.columns.iter().take(12).map(|c| format!("`{}`", c.name)).collect();
            let what = format!("no column is a clock (there is {})", names.join(", "));
            let mend = "name it: --time COLUMN; rows that are evenly spaced need none: --rate HZ";
            findings.push(Finding::error(FindingKind::NoTime, &log.file, what, mend));
        }
        let folder = common(files);
        if findings.iter().any(Finding::is_error) || logs.is_empty() {
            return Err(SignalsError::Wrong(findings));
        }
        Ok(Self { logs, folder, rate })
    }

    /// Where their case belongs: the folder that has all of them.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// How many recordings they are: of a file of several episodes each episode.
    pub fn recordings(&self) -> usize {
        self.logs.len()
    }

    /// How many joints there are, by the numbers in the names: of torques, currents and commands, of readings of joints by that
    /// word, of angles from three numbers on (two may be motor and load of one joint).
    pub fn joints(&self) -> usize {
        let count = |log: &LookedLog, is: &dyn Fn(&look::LogColumn) -> bool| {
            let mut all: Vec<usize> =
                log.columns.iter().filter(|c| is(c)).filter_map(|c| c.meaning.index).collect();
            all.sort_unstable();
            all.dedup();
            all.len()
        };
        let angle = |c: &look::LogColumn| matches!(c.meaning.quantity, Some(Quantity::Angle));
        let of_joint = |c: &look::LogColumn| angle(c) && c.name.to_lowercase().contains("joint");
        let drive = |c: &look::LogColumn| {
            matches!(c.meaning.quantity, Some(Quantity::Torque | Quantity::Current)) || c.meaning.command
        };
        let angles = |log: &LookedLog| Some(count(log, &angle)).filter(|n| *n > 2).unwrap_or(0);
        let joints = |log: &LookedLog| count(log, &drive).max(count(log, &of_joint)).max(angles(log));
        self.logs.iter().map(joints).max().unwrap_or(0)
    }

    /// Names of all columns but the clocks.
    pub fn columns(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for c in self.logs.iter().flat_map(|l| &l.columns) {
            if !names.contains(&c.name.as_str()) {
                names.push(&c.name);
            }
        }
        names
    }

    /// Variables that drive the model and that no column measures.
    pub fn missing<'a>(&self, model: &'a DraftModel, named: &BTreeMap<String, String>) -> Vec<&'a str> {
        let all: Vec<Assigned> = self.logs.iter().flat_map(|log| mapped(log, model, named)).collect();
        let drives = model.known.iter().filter(|v| v.role == VariableRole::Input && v.drives);
        drives.map(|v| v.name.as_str()).filter(|name| !all.iter().any(|a| a.variable == *name)).collect()
    }

    /// Drafts a case; `named` gives columns that the user names himself, with their variables.
    ///
    /// # Errors
    /// [`SignalsError::Wrong`]: the case would not be read.
    pub fn draft(
        &self,
        model: &DraftModel,
        named: &BTreeMap<String, String>,
    ) -> Result<CaseDraft, SignalsError> {
        let file = self.folder.join("case.toml");
        let names = self.names();
        let columns = self.logs.iter().map(|log| mapped(log, model, named)).collect::<Vec<_>>();
        let (logs, rate) = (&self.logs, self.rate);
        let mut draft =
            DraftText { logs, names: &names, rate, model, columns: &columns, split: Split::all(&names) };
        // With what is recognised the recordings are read as they will be: what is at rest, and how noisy, is seen then.
        let load = |text: &str| Case::load_text(&file, text, |_| Ok(model.known.clone()));
        let (loaded, _) = load(&draft.write().text)?;
        draft.split = Split::of(&loaded, &model.known);
        let done = draft.write();
        let (_, findings) = load(&done.text)?;
        let mut summary = done.summary;
        let reported = findings
            .iter()
            .filter(|f| f.severity >= Severity::Warning && f.kind != FindingKind::UnknownColumn);
        summary.extend(reported.map(|f| format!("{}: {f}", f.severity.id())));
        let guesses = done.text.matches("GUESS:").count();
        Ok(CaseDraft { file, text: done.text, summary, guesses })
    }

    /// The recordings as the case names them.
    fn names(&self) -> Vec<String> {
        let name = |log: &LookedLog| {
            let inside = log.file.strip_prefix(&self.folder).unwrap_or(&log.file);
            inside.to_string_lossy().into_owned()
        };
        self.logs.iter().map(name).collect()
    }
}

/// What the columns of a log are, those that the user names among them.
fn mapped(log: &LookedLog, model: &DraftModel, named: &BTreeMap<String, String>) -> Vec<Assigned> {
    let free: Vec<SignalVariable> =
        model.known.iter().filter(|v| !named.values().any(|n| *n == v.name)).cloned().collect();
    let mut left = log.clone();
    left.columns.retain(|c| !named.contains_key(&c.name));
    let mut all = assign(&left, &free);
    for column in log.columns.iter().filter(|c| named.contains_key(&c.name)) {
        all.push(Assigned {
            column: column.name.clone(),
            variable: named[&column.name].clone(),
            unit: None,
            scale: None,
            guesses: Vec::new(),
        });
    }
    all
}

/// The deepest folder that has all files.
fn common(files: &[PathBuf]) -> PathBuf {
    let parent = |f: &PathBuf| f.parent().unwrap_or(Path::new("")).to_owned();
    let mut folder = files.first().map(parent).unwrap_or_default();
    while !files.iter().all(|f| f.starts_with(&folder)) {
        if !folder.pop() {
            break;
        }
    }
    folder
}
