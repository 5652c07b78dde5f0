//! A diagnosis with what was noticed before it began.

use std::cmp::Reverse;
use std::path::Path;

use trueup_signals::Finding;

use super::Diagnosed;
use crate::finite::{self, NotFinite};
use crate::outcome::{Diagnosis, DiagnosisInputs, NoticedMistake};

impl Diagnosis {
    /// Adds what the intake noticed in a case of this folder, and what was read (`None`: it came from memory).
    ///
    /// # Errors
    /// A figure that is not finite: the diagnosis must not be handed on.
    pub fn complete(
        &mut self,
        intake: &[Finding],
        folder: &Path,
        inputs: Option<DiagnosisInputs>,
    ) -> Result<(), NotFinite> {
        self.inputs = inputs;
        self.findings.splice(0..0, NoticedMistake::of(intake, folder));
        self.findings.sort_by_key(|f| Reverse(f.severity));
        finite::check(self)
    }
}

impl Diagnosed {
    /// See [`Diagnosis::complete`].
    ///
    /// # Errors
    /// See [`Diagnosis::complete`].
    pub fn complete(
        &mut self,
        intake: &[Finding],
        folder: &Path,
        inputs: Option<DiagnosisInputs>,
    ) -> Result<(), NotFinite> {
        self.diagnosis.complete(intake, folder, inputs)
    }
}
