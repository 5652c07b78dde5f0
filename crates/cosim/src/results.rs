//! Where results go: a [`Sink`] takes them row by row; [`Results`] is one that writes a file, [`Memory`] one that keeps
//! them.
//!
//! The master tells the sink the columns once ([`Sink::begin`]) and then hands over one [`Row`] per communication
//! point or event: a time and a flat [`Values`] that it fills anew each time. Nothing is allocated per row, texts that
//! grow excepted.
//!
//! ```
//! use trueup_cosim::{Column, Kind, Memory, Row, Sink, Values};
//!
//! let columns = [Column::new("plant.angle", Kind::Real, "rad"), Column::new("plant.stuck", Kind::Boolean, "")];
//! let mut values = Values::of(&columns);
//! let mut memory = Memory::default();
//! memory.begin(&columns)?;
//! for point in 0..3 {
//!     values.reals[0] = 0.5 * point as f64; // the first column that is a float
//!     values.integers[0] = i64::from(point > 0); // the first one that is an integer or a Boolean
//!     memory.row(Row { time: point as f64, point: Some(point), values: &values })?;
//! }
//! assert_eq!(memory.column("plant.angle"), Some(&[0.0, 0.5, 1.0][..]));
//! # Ok::<(), trueup_cosim::Error>(())
//! ```

mod csv;
mod memory;
mod parquet;
mod place;

use std::io::{BufWriter, Error as IoError, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;
use trueup_fmi_description::description::Type;

use crate::error::Error;
pub use memory::Memory;
use place::Place;

/// What the values of a column are, which also says where they lie in [`Values`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// `Float64`, `Real`: in [`Values::reals`].
    Real,
    /// `Float32`: in [`Values::reals`].
    Single,
    /// Signed integers and enumerations: in [`Values::integers`].
    Integer,
    /// Unsigned integers: in [`Values::integers`], a `u64` by its bits (`u as i64`).
    Unsigned,
    /// In [`Values::integers`] as 0 or 1.
    Boolean,
    /// In [`Values::texts`].
    Text,
}

impl Kind {
    /// Of a variable of this type; `None` for binaries and clocks, which no table holds.
    pub fn of(kind: Type) -> Option<Self> {
        Some(match kind {
            Type::Float64 => Self::Real,
            Type::Float32 => Self::Single,
            Type::Int8 | Type::Int16 | Type::Int32 | Type::Int64 | Type::Enumeration => Self::Integer,
            Type::UInt8 | Type::UInt16 | Type::UInt32 | Type::UInt64 => Self::Unsigned,
            Type::Boolean => Self::Boolean,
            Type::String => Self::Text,
            Type::Binary | Type::Clock => return None,
        })
    }
}

/// A column of the results; the column `time` (s) stands before all and is not among them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its name, `component.variable[1]`.
    pub name: String,
    /// What its values are.
    pub kind: Kind,
    /// Unit as the FMU names it; empty: none.
    pub unit: String,
    /// Written at every this many communication points (0 counts as 1), else left empty.
    pub every: u32,
}

impl Column {
    /// A column that is written at every communication point.
    pub fn new(name: impl Into<String>, kind: Kind, unit: impl Into<String>) -> Self {
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
pub struct Values {
    /// Of [`Kind::Real`] and [`Kind::Single`].
    pub reals: Vec<f64>,
    /// Of [`Kind::Integer`], [`Kind::Unsigned`] and [`Kind::Boolean`].
    pub integers: Vec<i64>,
    /// Of [`Kind::Text`].
    pub texts: Vec<String>,
}

/// One value of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Value<'a> {
    Real(f64),
    Single(f32),
    Integer(i64),
    Unsigned(u64),
    Boolean(bool),
    Text(&'a str),
}

impl Values {
    /// Zeros and empty texts, as many as these columns need.
    pub fn of(columns: &[Column]) -> Self {
        let mut values = Self::default();
        for (slot, column) in slots(columns).into_iter().zip(columns) {
            match column.kind {
                Kind::Real | Kind::Single => values.reals.resize(slot + 1, 0.0),
                Kind::Integer | Kind::Unsigned | Kind::Boolean => values.integers.resize(slot + 1, 0),
                Kind::Text => values.texts.resize(slot + 1, String::new()),
            }
        }
        values
    }

    /// Forgets all values and keeps the memory, to be filled anew.
    pub fn clear(&mut self) {
        self.reals.clear();
        self.integers.clear();
        self.texts.clear();
    }

    /// The value of a column at its [slot](slots).
    fn get(&self, kind: Kind, slot: usize) -> Value<'_> {
        match kind {
            Kind::Real => Value::Real(self.reals[slot]),
            Kind::Single => Value::Single(self.reals[slot] as f32),
            Kind::Integer => Value::Integer(self.integers[slot]),
            Kind::Unsigned => Value::Unsigned(self.integers[slot] as u64),
            Kind::Boolean => Value::Boolean(self.integers[slot] != 0),
            Kind::Text => Value::Text(&self.texts[slot]),
        }
    }
}

/// Per column where its value lies in `reals`, `integers` or `texts` of [`Values`].
pub fn slots(columns: &[Column]) -> Vec<usize> {
    let mut next = [0; 3];
    let class = |kind| match kind {
        Kind::Real | Kind::Single => 0,
        Kind::Integer | Kind::Unsigned | Kind::Boolean => 1,
        Kind::Text => 2,
    };
    let slot = |c: &Column| {
        let n = &mut next[class(c.kind)];
        *n += 1;
        *n - 1
    };
    columns.iter().map(slot).collect()
}

/// What is known at one time. Two rows of the same time are what was before and after an event.
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    /// Time in s.
    pub time: f64,
    /// Number of the communication point; `None`: an event.
    pub point: Option<u64>,
    /// The values.
    pub values: &'a Values,
}

/// Takes the results of a run.
pub trait Sink {
    /// Called once, before the first row.
    ///
    /// # Errors
    /// The columns cannot be written.
    fn begin(&mut self, columns: &[Column]) -> Result<(), Error>;

    /// Takes a row. Its values must be [as many](Values::of) as the columns of [`begin`](Self::begin) need.
    ///
    /// # Errors
    /// The row cannot be written.
    fn row(&mut self, row: Row<'_>) -> Result<(), Error>;
}

impl<S: Sink + ?Sized> Sink for &mut S {
    fn begin(&mut self, columns: &[Column]) -> Result<(), Error> {
        (**self).begin(columns)
    }
    fn row(&mut self, row: Row<'_>) -> Result<(), Error> {
        (**self).row(row)
    }
}

/// `None` takes everything and keeps nothing.
impl<S: Sink> Sink for Option<S> {
    fn begin(&mut self, columns: &[Column]) -> Result<(), Error> {
        self.as_mut().map_or(Ok(()), |sink| sink.begin(columns))
    }
    fn row(&mut self, row: Row<'_>) -> Result<(), Error> {
        self.as_mut().map_or(Ok(()), |sink| sink.row(row))
    }
}

/// Both take it.
impl<A: Sink, B: Sink> Sink for (A, B) {
    fn begin(&mut self, columns: &[Column]) -> Result<(), Error> {
        self.0.begin(columns)?;
        self.1.begin(columns)
    }
    fn row(&mut self, row: Row<'_>) -> Result<(), Error> {
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
/// Until then, a file that had the name is kept as `<name>.previous.csv` or `.previous.parquet`, so that nobody takes it for the new
/// one, whatever becomes of the run.
pub struct Results {
    place: Place,
    table: Table,
    rows: u64,
}

enum Table {
    Csv(Box<csv::Writer>),
    Parquet(Box<parquet::Writer>),
}

impl Results {
    /// Opens a temporary file beside `file`, and keeps what has its name as previous.
    ///
    /// # Errors
    /// [`Error::Results`]: the name ends with neither `.csv` nor `.parquet`; the folder cannot be written.
    pub fn create(file: &Path) -> Result<Self, Error> {
        let extension = file.extension().unwrap_or_default().to_ascii_lowercase();
        let fail = |source: IoError| Error::Results { file: file.into(), source };
        if extension != "csv" && extension != "parquet" {
            return Err(fail(IoError::other(
                "results are CSV or Parquet; let the name end with .csv or .parquet",
            )));
        }
        let mut place = Place::of(file).map_err(fail)?;
        let part = place.part().map_err(fail)?;
        place.retire().map_err(fail)?;
        let part = BufWriter::with_capacity(1 << 16, part);
        let table = match extension.to_str() {
            Some("csv") => Table::Csv(Box::new(csv::Writer::new(part))),
            _ => Table::Parquet(Box::new(parquet::Writer::new(part))),
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
    /// [`Error::Results`]
    pub fn finish(self) -> Result<(), Error> {
        let (mut place, file) = (self.place.clone(), self.place.target().to_owned());
        self.persist(&file)?;
        place.forget();
        Ok(())
    }

    /// Nothing was run: what had the name before has it again.
    ///
    /// # Errors
    /// [`Error::Results`]
    pub fn give_back(mut self) -> Result<(), Error> {
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
    /// [`Error::Results`]
    pub fn keep_partial(self) -> Result<Option<PathBuf>, Error> {
        if self.rows == 0 {
            return Ok(None);
        }
        let (said, file) = self.place.beside("partial");
        self.persist(&file)?;
        Ok(Some(said))
    }

    fn persist(self, name: &Path) -> Result<(), Error> {
        let fail = |source: IoError| Error::Results { file: name.into(), source };
        let buffer = match self.table {
            Table::Csv(writer) => writer.finish(),
            Table::Parquet(writer) => writer.finish(),
        };
        let mut part = buffer.and_then(|b| b.into_inner().map_err(|e| e.into_error())).map_err(fail)?;
        part.flush().map_err(fail)?;
        part.persist(name).map_err(|e| fail(e.error))?;
        Ok(())
    }

    fn fail(&self) -> impl FnOnce(IoError) -> Error {
        let file = self.place.name().to_owned();
        |source| Error::Results { file, source }
    }
}

impl Sink for Results {
    fn begin(&mut self, columns: &[Column]) -> Result<(), Error> {
        match &mut self.table {
            Table::Csv(writer) => writer.begin(columns),
            Table::Parquet(writer) => writer.begin(columns),
        }
        .map_err(self.fail())
    }

    fn row(&mut self, row: Row<'_>) -> Result<(), Error> {
        self.rows += 1;
        let done = match &mut self.table {
            Table::Csv(writer) => writer.row(row),
            Table::Parquet(writer) => writer.row(row),
        };
        match done {
            Ok(()) => Ok(()),
            Err(source) => Err(self.fail()(source)),
        }
    }
}

/// The file under its temporary name.
type Part = BufWriter<NamedTempFile>;
