//! Where results go: a [`ResultSink`] takes them row by row; [`Results`] is one that writes a file, [`SeriesMemory`] one that keeps
//! them.
//!
//! The master passes the columns to the sink once ([`ResultSink::begin`]) and then hands over one [`ResultRow`] per communication
//! point or event: a time and a flat [`RowValues`] that it fills again each time. Nothing is allocated per row, texts that
//! grow excepted.
//!
//! ```
//! use trueup_cosim::{ResultColumn, ColumnKind, SeriesMemory, ResultRow, ResultSink, RowValues};
//!
//! let columns = [ResultColumn::new("plant.angle", ColumnKind::Real, "rad"), ResultColumn::new("plant.stuck", ColumnKind::Boolean, "")];
//! let mut values = RowValues::of(&columns);
//! let mut memory = SeriesMemory::default();
//! memory.begin(&columns)?;
//! for point in 0..3 {
//!     values.reals[0] = 0.5 * point as f64; // the first column that is a float
//!     values.integers[0] = i64::from(point > 0); // the first one that is an integer or a Boolean
//!     memory.row(ResultRow { time: point as f64, point: Some(point), values: &values })?;
//! }
//! assert_eq!(memory.column("plant.angle"), Some(&[0.0, 0.5, 1.0][..]));
//! # Ok::<(), trueup_cosim::CosimError>(())
//! ```

mod csv;
mod memory;
mod parquet;
mod place;

use std::io::{BufWriter, Error as IoError, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;
use trueup_fmi_description::description::VariableType;

use crate::error::CosimError;
pub use memory::SeriesMemory;
use place::ResultPlace;

/// What the values of a column are, which also defines where they are in [`RowValues`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ColumnKind {
    /// `Float64`, `Real`: in [`RowValues::reals`].
    Real,
    /// `Float32`: in [`RowValues::reals`].
    Single,
    /// Signed integers and enumerations: in [`RowValues::integers`].
    Integer,
    /// Unsigned integers: in [`RowValues::integers`], a `u64` by its bits (`u as i64`).
    Unsigned,
    /// In [`RowValues::integers`] as 0 or 1.
    Boolean,
    /// In [`RowValues::texts`].
    Text,
}

impl ColumnKind {
    /// Of a variable of this type; `None` for binaries and clocks, which no table holds.
    pub fn of(kind: VariableType) -> Option<Self> {
        Some(match kind {
            VariableType::Float64 => Self::Real,
            VariableType::Float32 => Self::Single,
            VariableType::Int8
            | VariableType::Int16
            | VariableType::Int32
            | VariableType::Int64
            | VariableType::Enumeration => Self::Integer,
            VariableType::UInt8 | VariableType::UInt16 | VariableType::UInt32 | VariableType::UInt64 => {
                Self::Unsigned
            }
            VariableType::Boolean => Self::Boolean,
            VariableType::String => Self::Text,
            VariableType::Binary | VariableType::Clock => return None,
        })
    }
}

/// A column of the results; the column `time` (s) is before all and not among them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ResultColumn {
    /// Its name, `component.variable[1]`.
    pub name: String,
    /// What its values are.
    pub kind: ColumnKind,
    /// Unit as the FMU names it; empty: none.
    pub unit: String,
    /// Written at every this many communication points (0 counts as 1), else left empty.
    pub every: u32,
}

impl ResultColumn {
    /// A column that is written at every communication point.
    pub fn new(name: impl Into<String>, kind: ColumnKind, unit: impl Into<String>) -> Self {
        Self { name: name.into(), kind, unit: unit.into(), every: 1 }
    }

    /// It has a value at this point. Events between points (`None`) are written in all columns.
    pub fn is_due(&self, point: Option<u64>) -> bool {
        point.is_none_or(|point| point % u64::from(self.every.max(1)) == 0)
    }
}

/// The values of one row: those of the `k`-th column that is a float in `reals[k]`, of the `k`-th integer or Boolean in
/// `integers[k]`, of the `k`-th text in `texts[k]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RowValues {
    /// Of [`ColumnKind::Real`] and [`ColumnKind::Single`].
    pub reals: Vec<f64>,
    /// Of [`ColumnKind::Integer`], [`ColumnKind::Unsigned`] and [`ColumnKind::Boolean`].
    pub integers: Vec<i64>,
    /// Of [`ColumnKind::Text`].
    pub texts: Vec<String>,
}

/// One value of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
enum RowValue<'a> {
    Real(f64),
    Single(f32),
    Integer(i64),
    Unsigned(u64),
    Boolean(bool),
    Text(&'a str),
}

impl RowValues {
    /// Zeros and empty texts, as many as these columns need.
    pub fn of(columns: &[ResultColumn]) -> Self {
        let mut values = Self::default();
        for (slot, column) in slots(columns).into_iter().zip(columns) {
            match column.kind {
                ColumnKind::Real | ColumnKind::Single => values.reals.resize(slot + 1, 0.0),
                ColumnKind::Integer | ColumnKind::Unsigned | ColumnKind::Boolean => {
                    values.integers.resize(slot + 1, 0)
                }
                ColumnKind::Text => values.texts.resize(slot + 1, String::new()),
            }
        }
        values
    }

    /// Forgets all values and keeps the memory, to be filled again.
    pub fn clear(&mut self) {
        self.reals.clear();
        self.integers.clear();
        self.texts.clear();
    }

    /// The value of a column at its [slot](slots).
    fn get(&self, kind: ColumnKind, slot: usize) -> RowValue<'_> {
        match kind {
            ColumnKind::Real => RowValue::Real(self.reals[slot]),
            ColumnKind::Single => RowValue::Single(self.reals[slot] as f32),
            ColumnKind::Integer => RowValue::Integer(self.integers[slot]),
            ColumnKind::Unsigned => RowValue::Unsigned(self.integers[slot] as u64),
            ColumnKind::Boolean => RowValue::Boolean(self.integers[slot] != 0),
            ColumnKind::Text => RowValue::Text(&self.texts[slot]),
        }
    }
}

/// Per column where its value is in `reals`, `integers` or `texts` of [`RowValues`].
pub fn slots(columns: &[ResultColumn]) -> Vec<usize> {
    let mut next = [0; 3];
    let class = |kind| match kind {
        ColumnKind::Real | ColumnKind::Single => 0,
        ColumnKind::Integer | ColumnKind::Unsigned | ColumnKind::Boolean => 1,
        ColumnKind::Text => 2,
    };
    let slot = |c: &ResultColumn| {
        let n = &mut next[class(c.kind)];
        *n += 1;
        *n - 1
    };
    columns.iter().map(slot).collect()
}

/// What is known at one time. Two rows of the same time are what was before and after an event.
#[derive(Clone, Copy, Debug)]
pub struct ResultRow<'a> {
    /// Time in s.
    pub time: f64,
    /// Number of the communication point; `None`: an event.
    pub point: Option<u64>,
    /// The values.
    pub values: &'a RowValues,
}

/// Takes the results of a run.
pub trait ResultSink {
    /// Called once, before the first row.
    ///
    /// # Errors
    /// The columns cannot be written.
    fn begin(&mut self, columns: &[ResultColumn]) -> Result<(), CosimError>;

    /// Takes a row. Its values must be [as many](RowValues::of) as the columns of [`begin`](Self::begin) need.
    ///
    /// # Errors
    /// The row cannot be written.
    fn row(&mut self, row: ResultRow<'_>) -> Result<(), CosimError>;
}

impl<S: ResultSink + ?Sized> ResultSink for &mut S {
    fn begin(&mut self, columns: &[ResultColumn]) -> Result<(), CosimError> {
        (**self).begin(columns)
    }
    fn row(&mut self, row: ResultRow<'_>) -> Result<(), CosimError> {
        (**self).row(row)
    }
}

/// `None` takes everything and keeps nothing.
impl<S: ResultSink> ResultSink for Option<S> {
    fn begin(&mut self, columns: &[ResultColumn]) -> Result<(), CosimError> {
        self.as_mut().map_or(Ok(()), |sink| sink.begin(columns))
    }
    fn row(&mut self, row: ResultRow<'_>) -> Result<(), CosimError> {
        self.as_mut().map_or(Ok(()), |sink| sink.row(row))
    }
}

/// Both take it.
impl<A: ResultSink, B: ResultSink> ResultSink for (A, B) {
    fn begin(&mut self, columns: &[ResultColumn]) -> Result<(), CosimError> {
        self.0.begin(columns)?;
        self.1.begin(columns)
    }
    fn row(&mut self, row: ResultRow<'_>) -> Result<(), CosimError> {
        self.0.row(row)?;
        self.1.row(row)
    }
}

/// A file of results, CSV or Parquet by the end of its name, that bears this name only once it is complete.
///
/// CSV: one header line, then `time` and one column per element; of a number the shortest digits that read back as the
/// same bits, Booleans as 0 or 1, an empty cell where a column is not due. Parquet: the same columns in their own types,
/// nulls where a column is not due, units in the file's metadata under `unit.<column>`.
///
/// Until then, a file that had the name is kept as `<name>.previous.csv` or `.previous.parquet`, so that it is not mistaken for the new
/// one, whatever becomes of the run.
pub struct Results {
    place: ResultPlace,
    table: ParquetOrCsv,
    rows: u64,
}

enum ParquetOrCsv {
    Csv(Box<csv::CsvWriter>),
    Parquet(Box<parquet::ParquetWriter>),
}

impl Results {
    /// Opens a temporary file next to `file`, and keeps what has its name as previous.
    ///
    /// # Errors
    /// [`CosimError::Results`]: the name ends with neither `.csv` nor `.parquet`; the folder cannot be written.
    pub fn create(file: &Path) -> Result<Self, CosimError> {
        let extension = file.extension().unwrap_or_default().to_ascii_lowercase();
        let fail = |source: IoError| CosimError::Results { file: file.into(), source };
        if extension != "csv" && extension != "parquet" {
            return Err(fail(IoError::other(
                "results are CSV or Parquet; let the name end with .csv or .parquet",
            )));
        }
        let mut place = ResultPlace::of(file).map_err(fail)?;
        let part = place.part().map_err(fail)?;
        place.retire().map_err(fail)?;
        let part = BufWriter::with_capacity(1 << 16, part);
        let table = match extension.to_str() {
            Some("csv") => ParquetOrCsv::Csv(Box::new(csv::CsvWriter::new(part))),
            _ => ParquetOrCsv::Parquet(Box::new(parquet::ParquetWriter::new(part))),
        };
        Ok(Self { place, table, rows: 0 })
    }

    /// Rows so far.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// [`CosimError::Results`]
    pub fn finish(self) -> Result<(), CosimError> {
        let (mut place, file) = (self.place.clone(), self.place.target().to_owned());
        self.persist(&file)?;
        place.forget();
        Ok(())
    }

    /// Nothing was run: what had the name before has it again.
    ///
    /// # Errors
    /// [`CosimError::Results`]
    pub fn give_back(mut self) -> Result<(), CosimError> {
        self.place.give_back().map_err(self.fail())
    }

    /// What had the name before, and has another one now.
    pub fn previous(&self) -> Option<&Path> {
        self.place.previous()
    }

    /// Keeps what was computed as `<name>.partial.csv` or `.partial.parquet`, as readable as a whole one; returns
    /// that name, `None` if there was not one row.
    ///
    /// # Errors
    /// [`CosimError::Results`]
    pub fn keep_partial(self) -> Result<Option<PathBuf>, CosimError> {
        if self.rows == 0 {
            return Ok(None);
        }
        let (said, file) = self.place.beside("partial");
        self.persist(&file)?;
        Ok(Some(said))
    }

    fn persist(self, name: &Path) -> Result<(), CosimError> {
        let fail = |source: IoError| CosimError::Results { file: name.into(), source };
        let buffer = match self.table {
            ParquetOrCsv::Csv(writer) => writer.finish(),
            ParquetOrCsv::Parquet(writer) => writer.finish(),
        };
        let mut part = buffer.and_then(|b| b.into_inner().map_err(|e| e.into_error())).map_err(fail)?;
        part.flush().map_err(fail)?;
        part.persist(name).map_err(|e| fail(e.error))?;
        Ok(())
    }

    fn fail(&self) -> impl FnOnce(IoError) -> CosimError {
        let file = self.place.name().to_owned();
        |source| CosimError::Results { file, source }
    }
}

impl ResultSink for Results {
    fn begin(&mut self, columns: &[ResultColumn]) -> Result<(), CosimError> {
        match &mut self.table {
            ParquetOrCsv::Csv(writer) => writer.begin(columns),
            ParquetOrCsv::Parquet(writer) => writer.begin(columns),
        }
        .map_err(self.fail())
    }

    fn row(&mut self, row: ResultRow<'_>) -> Result<(), CosimError> {
        self.rows += 1;
        let done = match &mut self.table {
            ParquetOrCsv::Csv(writer) => writer.row(row),
            ParquetOrCsv::Parquet(writer) => writer.row(row),
        };
        match done {
            Ok(()) => Ok(()),
            Err(source) => Err(self.fail()(source)),
        }
    }
}

/// The file under its temporary name.
type PartialFile = BufWriter<NamedTempFile>;
