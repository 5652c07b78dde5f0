//! Failures as `trueup.CosimError`: the message, and what of it a program can use.

use std::path::Path;

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use trueup_cosim::InputMistake;
use trueup_signals::Finding;

/// A message with its variable, file and remedy, as far as they are known.
#[derive(Debug, Default)]
pub(crate) struct PyFailure {
    message: String,
    variable: Option<String>,
    file: Option<String>,
    mend: Option<String>,
}

impl PyFailure {
    /// Of a message in the form that all of ours have: the first name in backticks is its subject, what follows the last
    /// semicolon is the remedy.
    pub(crate) fn of(message: impl Into<String>) -> Self {
        let message = message.into();
        let first = message.lines().next().unwrap_or_default();
        let (what, mend) =
            first.rsplit_once("; ").map_or((first, None), |(what, mend)| (what, Some(mend.to_owned())));
        let variable = what.split('`').nth(1).map(str::to_owned);
        Self { variable, mend, file: None, message }
    }

    pub(crate) fn file(mut self, file: &Path) -> Self {
        self.file = Some(file.display().to_string()).filter(|f| !f.is_empty());
        self
    }

    /// About this file, if no other one is named.
    pub(crate) fn or_file(self, file: &Path) -> Self {
        if self.file.is_some() { self } else { self.file(file) }
    }

    /// Of an error that has its own place and remedy.
    fn of_findings(message: String, findings: &[Finding]) -> Self {
        let Some(first) = findings.iter().find(|f| f.is_error()) else { return Self::of(message) };
        let said = Self::of(first.what.clone()).variable;
        let mend = Some(first.mend.clone()).filter(|m| !m.is_empty());
        Self { variable: first.channel.clone().or(said), mend, ..Self::of(message) }.file(&first.file)
    }
}

impl From<trueup_cosim::CosimError> for PyFailure {
    fn from(e: trueup_cosim::CosimError) -> Self {
        use trueup_cosim::CosimError;
        let whole = Self::of(e.to_string());
        match &e {
            CosimError::System(list) => {
                let Some(InputMistake { place, message }) = list.first() else { return whole };
                Self { message: whole.message, ..Self::of(message.clone()) }.file(&place.file)
            }
            CosimError::NotFinite { variable, .. } => Self { variable: Some(variable.clone()), ..whole },
            CosimError::Inputs { file, .. } | CosimError::Results { file, .. } => whole.file(file),
            _ => whole,
        }
    }
}

impl From<trueup_signals::SignalsError> for PyFailure {
    fn from(e: trueup_signals::SignalsError) -> Self {
        Self::of_findings(e.to_string(), e.findings())
    }
}

impl From<trueup_identification::intake::CaseIntakeError> for PyFailure {
    fn from(e: trueup_identification::intake::CaseIntakeError) -> Self {
        use trueup_identification::intake::CaseIntakeError;
        match e {
            CaseIntakeError::Files(e) => e.into(),
            CaseIntakeError::Model { file, source } => Self::of(source.to_string()).file(&file),
        }
    }
}

impl From<trueup_sweep::SweepError> for PyFailure {
    fn from(e: trueup_sweep::SweepError) -> Self {
        use trueup_sweep::SweepError;
        match e {
            SweepError::Mistakes(list) => trueup_cosim::CosimError::System(list).into(),
            SweepError::System(e) => e.into(),
            SweepError::File { file, why } => Self::of(format!("{}: {why}", file.display())).file(&file),
            SweepError::NoRun { .. } => Self::of(e.to_string()),
        }
    }
}

impl From<PyFailure> for PyErr {
    fn from(f: PyFailure) -> Self {
        static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        Python::attach(|py| {
            let class = match CLASS.import(py, "trueup._errors", "Error") {
                Ok(class) => class,
                Err(e) => return e,
            };
            match class.call1((f.message, f.variable, f.file, f.mend)) {
                Ok(error) => Self::from_value(error),
                Err(e) => e,
            }
        })
    }
}
