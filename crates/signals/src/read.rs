//! Reading: a file becomes a [`ReadTable`], a table and its sidecar a recording.

mod assemble;
mod clock;
pub(crate) mod columns;
mod csv;
mod guard;
mod input;
mod mat;
mod mcap;
mod memory;
mod parameters;
mod parquet;
mod sidecar;
mod table;
pub(crate) mod toml;

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use crate::columns::inherit;
use crate::error::{SignalsError, verdict};
use crate::finding::{Finding, FindingKind};
use crate::recording::{DeclaredFigures, Recording};
use crate::variable::SignalVariable;
pub(crate) use clock::row_rate;
pub use input::{InputColumn, InputTable};
pub(crate) use parameters::{doubts, parameters};
use sidecar::Sidecar;
use table::WantedColumns;
pub(crate) use table::{ReadTable, TableColumn};

impl Recording {
    /// Reads a CSV, MCAP, MAT, HDF5 (each also as `.zst`) or Parquet file with its sidecar, if there is one.
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

/// The columns of a file as they are, units of names split off.
pub(crate) fn plain_table(file: &Path, findings: &mut Vec<Finding>) -> Option<ReadTable> {
    let mut table = table_of(file, WantedColumns::Texts, findings)?;
    assemble::prepare(file, &mut table, &Sidecar::default(), |_| false, &mut Vec::new());
    Some(table)
}

/// The columns of a file, by the end of its name.
fn table_of(file: &Path, wanted: WantedColumns, findings: &mut Vec<Finding>) -> Option<ReadTable> {
    if let Some((whole, episode)) = episode(file) {
        let table = table_of(&whole, wanted, findings)?;
        return table
            .episode(episode)
            .map_err(|(what, mend)| findings.push(Finding::error(FindingKind::NoValue, file, what, mend)))
            .ok();
    }
    let open = File::open(file).map_err(|e| {
        let (what, mend) = match e.kind() {
            std::io::ErrorKind::NotFound => {
                ("there is no such file".to_owned(), "write its name as it is in the folder")
            }
            _ => (e.to_string(), "make it a readable file"),
        };
        findings.push(Finding::error(FindingKind::MissingFile, file, what, mend));
    });
    let open = open.ok()?;
    let lower = file.to_string_lossy().to_lowercase();
    let (plain, packed) = lower.strip_suffix(".zst").map_or((lower.as_str(), false), |plain| (plain, true));
    let extension = Path::new(plain).extension().and_then(|e| e.to_str()).unwrap_or("");
    let bytes = |open: File| {
        let mut bytes = Vec::new();
        let mut source: Box<dyn Read> = match packed {
            true => Box::new(zstd::Decoder::new(open)?.take(LARGEST_FILE)),
            false => Box::new(open),
        };
        source.read_to_end(&mut bytes).map(|_| bytes)
    };
    let wrong = |what: String, mend: &str| Finding::error(FindingKind::Unreadable, file, what, mend);
    match (extension, packed) {
        ("csv" | "txt" | "tsv", false) => {
            csv::read(file, BufReader::with_capacity(1 << 20, open), wanted, findings)
        }
        ("parquet", false) => parquet::read(file, open, wanted, findings),
        ("csv" | "txt" | "tsv" | "mat" | "h5" | "hdf5" | "mcap", _) => match bytes(open) {
            Ok(bytes) if extension == "mat" => mat::read(file, bytes, findings),
            Ok(bytes) if extension.starts_with('h') => mat::read_hdf5(file, bytes, findings),
            Ok(bytes) if extension == "mcap" => mcap::read(file, &bytes, findings),
            Ok(bytes) => csv::read(file, bytes.as_slice(), wanted, findings),
            Err(e) => {
                let what =
                    if packed { format!("no zstd file that can be unpacked: {e}") } else { e.to_string() };
                findings.push(wrong(what, "make it a readable file"));
                None
            }
        },
        (other, _) => {
            let mend = match other {
                "parquet" => "unpack it (Parquet is compressed inside)",
                "db3" | "bag" => "convert it to MCAP (ros2 bag convert)",
                _ => "make it a .csv, .parquet, .mat, .h5 or .mcap; unpack a .gz",
            };
            findings.push(wrong(format!("a file `.{other}` is no recording"), mend));
            None
        }
    }
}

/// `file.parquet` and 3 of `file.parquet#3`, unless a file has that name.
fn episode(recording: &Path) -> Option<(PathBuf, u32)> {
    let (whole, number) = recording.to_str()?.rsplit_once('#')?;
    Some((whole.into(), number.parse().ok()?)).filter(|_| !recording.exists())
}

/// The file that a recording is read from: of an episode `file.parquet#3` the whole file.
pub fn recording_file(recording: &Path) -> PathBuf {
    episode(recording).map_or_else(|| recording.to_owned(), |(whole, _)| whole)
}

/// What is unpacked of a file at most: more is no recording.
const LARGEST_FILE: u64 = 1 << 32;
