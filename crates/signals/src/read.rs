//! Reading: a file becomes a [`ReadTable`], a table and its sidecar a recording.

mod assemble;
mod clock;
pub(crate) mod columns;
mod csv;
mod guard;
mod input;
mod mat;
mod memory;
mod parameters;
mod parquet;
mod sidecar;
mod table;
pub(crate) mod toml;

use std::path::{Path, PathBuf};

use crate::columns::inherit;
use crate::error::{SignalsError, verdict};
use crate::finding::{Finding, FindingKind};
use crate::recording::{DeclaredFigures, Recording};
use crate::variable::SignalVariable;
pub use input::{InputColumn, InputTable};
pub(crate) use parameters::{doubts, parameters};
use sidecar::Sidecar;
use table::{ReadTable, WantedColumns};

impl Recording {
    /// Reads a CSV (also `.csv.gz` unpacked by the caller), Parquet or MAT file with its sidecar, if there is one.
    ///
    /// `known` are the model's variables: other columns are left out with a warning, units are checked against theirs.
    /// With none, every column is taken as it is. `declared` is what a case declares of channels; a sidecar goes before it.
    ///
    /// # Errors
    /// [`SignalsError::Wrong`] with all findings.
    pub fn read(
        file: &Path,
        known: &[SignalVariable],
        declared: &DeclaredFigures,
    ) -> Result<(Self, Vec<Finding>), SignalsError> {
        let mut findings = Vec::new();
        let sidecar = Sidecar::beside(file, None, known, &mut findings);
        let table = table_of(file, WantedColumns::Numbers, &mut findings);
        let (Some(table), Some(mut sidecar)) = (table, sidecar) else {
            return Err(SignalsError::Wrong(findings));
        };
        inherit(&mut sidecar.columns, &declared.columns);
        let recording = assemble::assemble(file, table, &sidecar, known, declared, &mut findings);
        verdict(recording, findings)
    }

    /// Reads a CSV from memory, as if it were in a file of that name without a sidecar.
    ///
    /// # Errors
    /// [`SignalsError::Wrong`] with all findings.
    pub fn parse_csv(
        name: &str,
        bytes: &[u8],
        known: &[SignalVariable],
    ) -> Result<(Self, Vec<Finding>), SignalsError> {
        let mut findings = Vec::new();
        let file = PathBuf::from(name);
        let table = csv::read(&file, bytes, WantedColumns::Numbers, &mut findings);
        let Some(table) = table else { return Err(SignalsError::Wrong(findings)) };
        let none = DeclaredFigures::default();
        let recording = assemble::assemble(&file, table, &Sidecar::default(), known, &none, &mut findings);
        verdict(recording, findings)
    }
}

/// The columns of a file, by the end of its name.
fn table_of(file: &Path, wanted: WantedColumns, findings: &mut Vec<Finding>) -> Option<ReadTable> {
    let open = std::fs::File::open(file).map_err(|e| {
        let (what, mend) = match e.kind() {
            std::io::ErrorKind::NotFound => {
                ("there is no such file".to_owned(), "write its name as it is in the folder")
            }
            _ => (e.to_string(), "make it a readable file"),
        };
        findings.push(Finding::error(FindingKind::MissingFile, file, what, mend));
    });
    let open = open.ok()?;
    let extension = file.extension().and_then(|e| e.to_str()).unwrap_or("").to_lowercase();
    match extension.as_str() {
        "csv" | "txt" | "tsv" => {
            csv::read(file, std::io::BufReader::with_capacity(1 << 20, open), wanted, findings)
        }
        "parquet" => parquet::read(file, open, wanted, findings),
        "mat" => match std::fs::read(file) {
            Ok(bytes) => mat::read(file, bytes, findings),
            Err(e) => {
                let mend = "make it a readable file";
                findings.push(Finding::error(FindingKind::Unreadable, file, e.to_string(), mend));
                None
            }
        },
        _ => {
            findings.push(Finding::error(
                FindingKind::Unreadable,
                file,
                format!("a file `.{extension}` is no recording"),
                "make it a .csv, .parquet or .mat; unpack a .gz",
            ));
            None
        }
    }
}
