//! Results as Parquet: rows are gathered column by column and written in groups.

use std::io::{Error as IoError, Result};
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;

use super::{ColumnKind, PartialFile, ResultColumn, ResultRow, RowValue, slots};

/// Values gathered before a group is written: about 16 MB.
const GATHERED: usize = 1 << 21;

pub(super) enum ParquetWriter {
    /// No column is known yet.
    New(PartialFile),
    Open(Box<Open>),
    /// A group could not be written.
    Broken,
}

pub(super) struct Open {
    file: SerializedFileWriter<PartialFile>,
    time: Vec<f64>,
    columns: Vec<GatheredColumn>,
    /// Rows of a whole group.
    group: usize,
}

/// A column's part of the group.
struct GatheredColumn {
    column: ResultColumn,
    slot: usize,
    values: ColumnCells,
    /// Per row 1 for a value, 0 for none; of a column that is always due nothing.
    defined: Vec<i16>,
}

enum ColumnCells {
    Doubles(Vec<f64>),
    Floats(Vec<f32>),
    Integers(Vec<i64>),
    Booleans(Vec<bool>),
    Texts(Vec<ByteArray>),
}

impl ParquetWriter {
    pub(super) fn new(part: PartialFile) -> Self {
        Self::New(part)
    }

    pub(super) fn begin(&mut self, columns: &[ResultColumn]) -> Result<()> {
        let Self::New(part) = std::mem::replace(self, Self::Broken) else {
            return Err(IoError::other("the results have begun already"));
        };
        *self = Self::Open(Box::new(Open::new(part, columns).map_err(IoError::other)?));
        Ok(())
    }

    pub(super) fn row(&mut self, row: ResultRow<'_>) -> Result<()> {
        let Self::Open(open) = self else { return Err(broken()) };
        open.gather(row);
        if open.time.len() < open.group {
            return Ok(());
        }
        let done = open.write_group().map_err(IoError::other);
        if done.is_err() {
            *self = Self::Broken;
        }
        done
    }

    pub(super) fn finish(self) -> Result<PartialFile> {
        match self {
            Self::New(part) => Open::new(part, &[]).and_then(Open::finish).map_err(IoError::other),
            Self::Open(open) => open.finish().map_err(IoError::other),
            Self::Broken => Err(broken()),
        }
    }
}

fn broken() -> IoError {
    IoError::other("the results were given up after an error of writing, or have not begun")
}

impl Open {
    fn new(part: PartialFile, columns: &[ResultColumn]) -> std::result::Result<Self, ParquetError> {
        let time = ResultColumn::new("time", ColumnKind::Real, "s");
        let fields =
            std::iter::once(&time).chain(columns).map(field).collect::<std::result::Result<_, _>>()?;
        let schema = Type::group_type_builder("schema").with_fields(fields).build()?;
        let units = std::iter::once(&time).chain(columns).filter(|c| !c.unit.is_empty());
        let units = units.map(|c| KeyValue::new(format!("unit.{}", c.name), c.unit.clone())).collect();
        // Plain and without statistics: a group costs little more than a copy.
        let properties = WriterProperties::builder()
            .set_created_by("trueup".to_owned())
            .set_dictionary_enabled(false)
            .set_statistics_enabled(EnabledStatistics::None)
            .set_key_value_metadata(Some(units))
            .build();
        let group = (GATHERED / (columns.len() + 1)).clamp(1 << 10, 1 << 17);
        let columns =
            columns.iter().zip(slots(columns)).map(|(c, slot)| GatheredColumn::new(c, slot)).collect();
        let file = SerializedFileWriter::new(part, Arc::new(schema), Arc::new(properties))?;
        Ok(Self { file, time: Vec::new(), columns, group })
    }

    fn gather(&mut self, row: ResultRow<'_>) {
        self.time.push(row.time);
        for c in &mut self.columns {
            let due = c.column.is_due(row.point);
            if c.column.every > 1 {
                c.defined.push(i16::from(due));
            }
            if due {
                c.values.push(row.values.get(c.column.kind, c.slot));
            }
        }
    }

    fn write_group(&mut self) -> std::result::Result<(), ParquetError> {
        if self.time.is_empty() {
            return Ok(());
        }
        let mut group = self.file.next_row_group()?;
        write::<DoubleType>(&mut group, &mut self.time, &[])?;
        for c in &mut self.columns {
            match &mut c.values {
                ColumnCells::Doubles(v) => write::<DoubleType>(&mut group, v, &c.defined)?,
                ColumnCells::Floats(v) => write::<FloatType>(&mut group, v, &c.defined)?,
                ColumnCells::Integers(v) => write::<Int64Type>(&mut group, v, &c.defined)?,
                ColumnCells::Booleans(v) => write::<BoolType>(&mut group, v, &c.defined)?,
                ColumnCells::Texts(v) => write::<ByteArrayType>(&mut group, v, &c.defined)?,
            }
            c.defined.clear();
        }
        group.close()?;
        Ok(())
    }

    fn finish(mut self) -> std::result::Result<PartialFile, ParquetError> {
        self.write_group()?;
        self.file.into_inner()
    }
}

/// Writes what was gathered of the next column.
fn write<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, PartialFile>,
    values: &mut Vec<T::T>,
    defined: &[i16],
) -> std::result::Result<(), ParquetError> {
    let Some(mut column) = group.next_column()? else { return Ok(()) };
    column.typed::<T>().write_batch(values, (!defined.is_empty()).then_some(defined), None)?;
    values.clear();
    column.close()
}

/// A column of the schema.
fn field(column: &ResultColumn) -> std::result::Result<Arc<Type>, ParquetError> {
    let (physical, logical) = match column.kind {
        ColumnKind::Real => (Physical::DOUBLE, None),
        ColumnKind::Single => (Physical::FLOAT, None),
        ColumnKind::Integer => (Physical::INT64, None),
        ColumnKind::Unsigned => (Physical::INT64, Some(LogicalType::integer(64, false))),
        ColumnKind::Boolean => (Physical::BOOLEAN, None),
        ColumnKind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let repetition = if column.every > 1 { Repetition::OPTIONAL } else { Repetition::REQUIRED };
    let field = Type::primitive_type_builder(&column.name, physical);
    Ok(Arc::new(field.with_repetition(repetition).with_logical_type(logical).build()?))
}

impl GatheredColumn {
    fn new(column: &ResultColumn, slot: usize) -> Self {
        let values = match column.kind {
            ColumnKind::Real => ColumnCells::Doubles(Vec::new()),
            ColumnKind::Single => ColumnCells::Floats(Vec::new()),
            ColumnKind::Integer | ColumnKind::Unsigned => ColumnCells::Integers(Vec::new()),
            ColumnKind::Boolean => ColumnCells::Booleans(Vec::new()),
            ColumnKind::Text => ColumnCells::Texts(Vec::new()),
        };
        Self { column: column.clone(), slot, values, defined: Vec::new() }
    }
}

impl ColumnCells {
    fn push(&mut self, value: RowValue<'_>) {
        match (self, value) {
            (Self::Doubles(v), RowValue::Real(x)) => v.push(x),
            (Self::Floats(v), RowValue::Single(x)) => v.push(x),
            (Self::Integers(v), RowValue::Integer(x)) => v.push(x),
            (Self::Integers(v), RowValue::Unsigned(x)) => v.push(x as i64),
            (Self::Booleans(v), RowValue::Boolean(x)) => v.push(x),
            (Self::Texts(v), RowValue::Text(x)) => v.push(x.as_bytes().to_vec().into()),
            _ => {} // cells and values are of the same kind
        }
    }
}
