//! All runs as one table: the same bytes however they were shared out or interrupted.

use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use trueup_fmi_description::whole;

use crate::design::SweepDesign;
use crate::done::{FinishedSweep, done};
use crate::error::SweepError;
use crate::file::OWN;
use crate::log::{LogDamage, RunRecord};
use crate::runner::Runner;
use crate::value::FactorValue;

/// Rows of a group.
const GROUP: usize = 1 << 16;

/// What was merged.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Merged {
    /// Rows: all runs.
    pub runs: u64,
    /// Failures among them.
    pub failed: u64,
    /// Lines of logs that were left out because they are damaged.
    pub damage: Vec<LogDamage>,
}

/// Writes all runs of a sweep, in their order, as Parquet: `run`, the factors, the outputs (null where there is no number), and
/// `reason` (null where the run is done). Units are in the file's metadata under `unit.<column>`, the sweep's fingerprint
/// under `sweep`.
///
/// # Errors
/// [`SweepError::File`]: a run is in no log, two logs differ about one, something cannot be read or written. Then nothing is left
/// under that name.
pub fn merge(runner: &Runner, file: &Path) -> Result<Merged, SweepError> {
    let FinishedSweep { records, damage } = done(runner)?;
    let failed = records.iter().filter(|r| r.result.is_err()).count() as u64;
    write(runner, &records, file).map_err(|e| SweepError::at(file, e))?;
    Ok(Merged { runs: runner.design().runs(), failed, damage })
}

/// What a factor's values are.
#[derive(Clone, Copy)]
enum FactorCells {
    Numbers,
    Booleans,
    Texts,
}

impl FactorCells {
    /// Whatever fits all of them.
    fn of(design: &SweepDesign, factor: usize, runs: u64) -> Self {
        let mut all = (1..=runs).map(|run| design.value(factor, run));
        let (mut numbers, mut booleans) = (true, true);
        while let Some(value) = all.next().filter(|_| numbers || booleans) {
            numbers &= matches!(value, FactorValue::Number(_) | FactorValue::Integer(_));
            booleans &= matches!(value, FactorValue::Boolean(_));
        }
        match (numbers, booleans) {
            (true, _) => Self::Numbers,
            (_, true) => Self::Booleans,
            _ => Self::Texts,
        }
    }

    fn field(self, name: &str) -> Result<Arc<Type>, ParquetError> {
        match self {
            Self::Numbers => field(name, Physical::DOUBLE, None, Repetition::REQUIRED),
            Self::Booleans => field(name, Physical::BOOLEAN, None, Repetition::REQUIRED),
            Self::Texts => field(name, Physical::BYTE_ARRAY, Some(LogicalType::String), Repetition::REQUIRED),
        }
    }
}

fn field(
    name: &str,
    physical: Physical,
    logical: Option<LogicalType>,
    repetition: Repetition,
) -> Result<Arc<Type>, ParquetError> {
    let field = Type::primitive_type_builder(name, physical);
    Ok(Arc::new(field.with_repetition(repetition).with_logical_type(logical).build()?))
}

fn write(runner: &Runner, records: &[RunRecord], file: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let (sweep, design) = (runner.sweep(), runner.design());
    let factors: Vec<FactorCells> =
        (0..sweep.factors.len()).map(|f| FactorCells::of(design, f, design.runs())).collect();
    let [run, reason] = OWN;
    let mut fields = vec![field(run, Physical::INT64, None, Repetition::REQUIRED)?];
    for (factor, cells) in sweep.factors.iter().zip(&factors) {
        fields.push(cells.field(&factor.name)?);
    }
    for output in &sweep.outputs {
        fields.push(field(&output.name, Physical::DOUBLE, None, Repetition::OPTIONAL)?);
    }
    fields.push(field(reason, Physical::BYTE_ARRAY, Some(LogicalType::String), Repetition::OPTIONAL)?);
    let schema = Type::group_type_builder("schema").with_fields(fields).build()?;
    let units = runner.units().into_iter().filter(|(_, unit)| !unit.is_empty());
    let mut told = vec![KeyValue::new("sweep".into(), runner.print().to_owned())];
    told.extend(units.map(|(name, unit)| KeyValue::new(format!("unit.{name}"), unit)));
    let properties = WriterProperties::builder()
        .set_created_by("trueup".to_owned())
        .set_dictionary_enabled(false)
        .set_statistics_enabled(EnabledStatistics::None)
        .set_key_value_metadata(Some(told))
        .build();
    let part = BufWriter::new(whole::part(file)?);
    let mut writer = SerializedFileWriter::new(part, Arc::new(schema), Arc::new(properties))?;
    for rows in records.chunks(GROUP) {
        let mut group = writer.next_row_group()?;
        let numbers: Vec<i64> = rows.iter().map(|r| r.run as i64).collect();
        column::<Int64Type>(&mut group, &numbers, None)?;
        for (at, cells) in factors.iter().enumerate() {
            let values = rows.iter().map(|r| design.value(at, r.run));
            match cells {
                FactorCells::Numbers => {
                    column::<DoubleType>(&mut group, &values.map(number).collect::<Vec<_>>(), None)?
                }
                FactorCells::Booleans => {
                    let values: Vec<bool> = values.map(|v| v == FactorValue::Boolean(true)).collect();
                    column::<BoolType>(&mut group, &values, None)?;
                }
                FactorCells::Texts => {
                    let values: Vec<ByteArray> = values.map(|v| v.text().into_bytes().into()).collect();
                    column::<ByteArrayType>(&mut group, &values, None)?;
                }
            }
        }
        for at in 0..sweep.outputs.len() {
            let of =
                |r: &RunRecord| r.result.as_ref().ok().and_then(|values| values.get(at).copied().flatten());
            let values: Vec<f64> = rows.iter().filter_map(of).collect();
            let defined: Vec<i16> = rows.iter().map(|r| i16::from(of(r).is_some())).collect();
            column::<DoubleType>(&mut group, &values, Some(&defined))?;
        }
        let reasons = rows.iter().filter_map(|r| r.result.as_ref().err());
        let reasons: Vec<ByteArray> = reasons.map(|why| why.as_bytes().to_vec().into()).collect();
        let defined: Vec<i16> = rows.iter().map(|r| i16::from(r.result.is_err())).collect();
        column::<ByteArrayType>(&mut group, &reasons, Some(&defined))?;
        group.close()?;
    }
    let mut part = writer.into_inner()?.into_inner().map_err(|e| e.into_error())?;
    part.flush()?;
    part.persist(file).map_err(|e| e.error)?;
    Ok(())
}

fn number(value: FactorValue) -> f64 {
    match value {
        FactorValue::Number(x) => x,
        FactorValue::Integer(n) => n as f64,
        FactorValue::Boolean(_) | FactorValue::Text(_) => f64::NAN, // another kind of cells
    }
}

/// Writes the next column.
fn column<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, impl Write + Send>,
    values: &[T::T],
    defined: Option<&[i16]>,
) -> Result<(), ParquetError> {
    let Some(mut column) = group.next_column()? else { return Ok(()) };
    column.typed::<T>().write_batch(values, defined, None)?;
    column.close()
}
