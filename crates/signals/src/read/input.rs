//! Columns that drive a simulation: read as recordings are, but what they are to be is for the caller to say.

use std::path::{Path, PathBuf};

use super::assemble::prepare;
use super::clock::{self, ClockUse};
use super::sidecar::Sidecar;
use super::table::{WantedColumns, unit_of};
use super::table_of;
use crate::error::{SignalsError, verdict};
use crate::finding::{Finding, FindingKind};
use crate::recording::Interpolation;
use crate::unit::SignalUnit;

/// A file's columns over one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InputTable {
    /// Where they come from.
    pub file: PathBuf,
    /// In s, one for each row, growing; the same one in two rows is a jump: the value before, then the one after.
    pub time: Vec<f64>,
    /// What time 0 is, in s since the beginning of 1970, where the file counts from there.
    pub epoch: Option<f64>,
    /// Line of each row; empty where the format has none.
    pub lines: Vec<u64>,
    /// The columns, in their order.
    pub columns: Vec<InputColumn>,
}

/// A column; its sidecar's name, scale and offset are applied, its unit is not.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InputColumn {
    /// As the sidecar calls it, else the file.
    pub name: String,
    /// A value a row; `NaN` where the cell is empty or no number.
    pub values: Vec<f64>,
    /// The cells as they are written, empty ones empty; none at all where the values say all.
    pub texts: Vec<String>,
    /// The unit of the values, if the file or its sidecar names one.
    pub unit: Option<(String, SignalUnit)>,
    /// Interpolation between samples, if the sidecar gives it.
    pub interpolation: Option<Interpolation>,
}

impl InputTable {
    /// Reads a file with its sidecar, if there is one; `not_beside` is a file that is no sidecar, whatever its name.
    ///
    /// # Errors
    /// [`SignalsError::Wrong`] with all findings.
    pub fn read(file: &Path, not_beside: &Path) -> Result<(Self, Vec<Finding>), SignalsError> {
        let mut findings = Vec::new();
        let sidecar = Sidecar::beside(file, Some(not_beside), &[], &mut findings);
        let table = table_of(file, WantedColumns::Texts, &mut findings);
        let (Some(mut table), Some(sidecar)) = (table, sidecar) else {
            return Err(SignalsError::Wrong(findings));
        };
        prepare(file, &mut table, &sidecar, |_| false, &mut findings);
        let taken = clock::take(file, &mut table, &sidecar, sidecar.rate, ClockUse::Drive, &mut findings);
        let clock = taken.unwrap_or_default();
        for name in sidecar.parameters.keys() {
            let what = format!("the start value of `{name}` is not used for inputs");
            let mend = format!("set it for the run: --set {name}=...");
            findings.push(Finding::warning(FindingKind::UnknownParameter, &sidecar.file, what, mend));
        }
        let mut all = Self {
            file: file.into(),
            time: clock.time,
            epoch: clock.epoch,
            lines: table.lines,
            ..Self::default()
        };
        for mut own in table.columns {
            let Some(name) = sidecar.variable(&own.name) else { continue };
            let said = sidecar.column(&own.name);
            let mut unit = said.and_then(|c| c.unit.clone()).or_else(|| unit_of(&own));
            if let Some(said) = said.filter(|c| c.scale.is_some() || c.offset != 0.0) {
                own.values.iter_mut().for_each(|x| *x = said.value(*x));
                own.texts.clear();
                // The scale leads to the variable's own unit.
                unit = unit.filter(|_| said.scale.is_none() || said.unit.is_some());
            }
            if own.ticks.is_some() {
                unit = unit.or(Some(("s".to_owned(), SignalUnit::SECOND)));
            }
            let settings = sidecar.channels.get(&name).map(|(settings, _)| settings);
            let interpolation = settings.and_then(|s| s.interpolation);
            all.columns.push(InputColumn { name, values: own.values, texts: own.texts, unit, interpolation });
        }
        for (name, (_, line)) in &sidecar.channels {
            if !all.columns.iter().any(|c| c.name == *name) {
                let what = format!("{} has no channel `{name}`", file.display());
                let mend = "name a column of this file";
                findings
                    .push(Finding::error(FindingKind::UnknownChannel, &sidecar.file, what, mend).line(*line));
            }
        }
        verdict(all, findings)
    }

    /// Where row `i` is: a line, or nothing.
    pub fn line(&self, row: usize) -> Option<u64> {
        self.lines.get(row).copied()
    }
}
