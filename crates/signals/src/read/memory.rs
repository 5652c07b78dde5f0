//! Columns from memory.

use std::path::Path;

use super::assemble;
use super::sidecar::Sidecar;
use super::table::{ReadTable, TableColumn};
use crate::error::{SignalsError, verdict};
use crate::finding::{Finding, FindingKind};
use crate::recording::{DeclaredFigures, Recording};
use crate::variable::SignalVariable;

impl Recording {
    /// A recording whose columns are in memory, `time` in s among them: of one length, `NaN` where nothing was measured. It is
    /// looked at as a file of this name without a sidecar is.
    ///
    /// # Errors
    /// [`SignalsError::Wrong`] with all findings.
    pub fn of_columns(
        name: &str,
        columns: &[(String, Vec<f64>)],
        known: &[SignalVariable],
        declared: &DeclaredFigures,
    ) -> Result<(Self, Vec<Finding>), SignalsError> {
        let file = Path::new(name);
        let mut findings = shape(file, columns);
        if !findings.is_empty() {
            return Err(SignalsError::Wrong(findings));
        }
        let columns =
            columns.iter().map(|(name, values)| TableColumn::numbers(name.as_str(), values.clone()));
        let table = ReadTable { columns: columns.collect(), ..ReadTable::default() };
        let sidecar = Sidecar { columns: declared.columns.clone(), ..Sidecar::default() };
        let recording = assemble::assemble(file, table, &sidecar, known, declared, &mut findings);
        verdict(recording, findings)
    }
}

/// What is no table.
fn shape(file: &Path, columns: &[(String, Vec<f64>)]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let Some((first, values)) = columns.first() else {
        return vec![Finding::error(
            FindingKind::EmptyFile,
            file,
            "there is no column",
            "give it `time` and a channel",
        )];
    };
    let rows = values.len();
    if rows == 0 {
        findings.push(Finding::error(FindingKind::EmptyFile, file, "there is no row", "record it again"));
    }
    for (i, (name, values)) in columns.iter().enumerate() {
        if values.len() != rows {
            let n = values.len();
            let what = format!("there are {n} values, of `{first}` {rows}");
            let mend = "make all columns of one length, nan where nothing was measured";
            findings.push(Finding::error(FindingKind::RaggedRow, file, what, mend).channel(name));
        }
        if columns[..i].iter().any(|(before, _)| before == name) {
            let what = format!("two columns are named `{name}`");
            let mend = "rename or remove one";
            findings.push(Finding::error(FindingKind::DuplicateName, file, what, mend).channel(name));
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::variable::VariableRole;

    fn known() -> Vec<SignalVariable> {
        vec![
            SignalVariable::new("u", "N", VariableRole::Input),
            SignalVariable::new("y", "m", VariableRole::Output),
        ]
    }

    fn of(columns: &[(&str, &[f64])]) -> Result<(Recording, Vec<Finding>), SignalsError> {
        let columns: Vec<_> = columns.iter().map(|(n, v)| ((*n).to_owned(), v.to_vec())).collect();
        Recording::of_columns("run.csv", &columns, &known(), &DeclaredFigures::default())
    }

    #[test]
    fn memory_and_text_make_the_same_recording() {
        let text = "time,u,y\n0,0.5,1\n0.1,,1.5\n0.25,0.7,\n0.3,0.1,0.2\n";
        let from_text = Recording::parse_csv("run.csv", text.as_bytes(), &known()).unwrap();
        let nan = f64::NAN;
        let time: &[f64] = &[0.0, 0.1, 0.25, 0.3];
        let columns: [(&str, &[f64]); 3] =
            [("time", time), ("u", &[0.5, nan, 0.7, 0.1]), ("y", &[1.0, 1.5, nan, 0.2])];
        assert_eq!(of(&columns).unwrap(), from_text);
    }

    #[test]
    fn what_is_no_table_is_said() {
        let says = |columns: &[(&str, &[f64])], text: &str| {
            let error = of(columns).unwrap_err().to_string();
            assert!(error.contains(text), "{error}");
        };
        says(&[], "no column");
        says(&[("time", &[]), ("u", &[])], "no row");
        says(&[("time", &[0.0, 1.0]), ("u", &[1.0])], "u: there are 1 values, of `time` 2");
        says(&[("time", &[0.0, 1.0]), ("u", &[1.0, 2.0]), ("u", &[1.0, 2.0])], "two columns are named `u`");
        says(&[("time", &[0.0, 0.0]), ("u", &[1.0, 2.0])], "run.csv");
    }
}
