//! Writing recordings and other tables, as CSV or Parquet: under a temporary name, renamed when whole.

use std::collections::BTreeMap;
use std::io::{BufWriter, Error as IoError, Write};
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{Repetition, Type as Physical};
use parquet::data_type::DoubleType;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use crate::error::SignalsError;
use crate::recording::Recording;

impl Recording {
    /// Writes the recording as CSV, or as Parquet if the name ends so: one row for each time at which a channel has a
    /// sample, missing ones empty. Every double reads back bit-equal.
    ///
    /// # Errors
    /// [`SignalsError::Write`]; then nothing is left under that name.
    pub fn write(&self, file: &Path) -> Result<(), SignalsError> {
        self.table().write(file)
    }

    /// As CSV.
    ///
    /// # Errors
    /// Of the writer.
    pub fn to_csv(&self, to: &mut impl Write) -> Result<(), IoError> {
        self.table().to_csv(to)
    }

    fn table(&self) -> WrittenTable {
        let (time, columns) = self.rows();
        let names = self.channels.iter().map(|c| c.name.clone());
        WrittenTable {
            columns: std::iter::once(("time".to_owned(), time)).chain(names.zip(columns)).collect(),
        }
    }

    /// All times, and the values of each channel there, `NaN` where it has none.
    fn rows(&self) -> (Vec<f64>, Vec<Vec<f64>>) {
        // Times are finite: their order is that of these keys.
        let key = |t: f64| {
            let bits = (t + 0.0).to_bits() as i64;
            bits ^ (((bits >> 63) as u64) >> 1) as i64
        };
        let mut all = BTreeMap::new();
        for t in self.channels.iter().flat_map(|c| &c.time) {
            all.insert(key(*t), *t);
        }
        let time: Vec<f64> = all.into_values().collect();
        let columns = self.channels.iter().map(|c| {
            let mut next = 0;
            let value = |t: &f64| {
                let here = c.time.get(next).is_some_and(|s| s == t);
                if here {
                    next += 1;
                    c.values[next - 1]
                } else {
                    f64::NAN
                }
            };
            time.iter().map(value).collect()
        });
        let columns = columns.collect();
        (time, columns)
    }
}

/// Columns of one length with their names; `NaN` is a cell without a value.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WrittenTable {
    /// Names and values.
    pub columns: Vec<(String, Vec<f64>)>,
}

impl WrittenTable {
    /// Writes the table as CSV, or as Parquet if the name ends so. Every double reads back bit-equal.
    ///
    /// # Errors
    /// [`SignalsError::Write`]; then nothing is left under that name.
    pub fn write(&self, file: &Path) -> Result<(), SignalsError> {
        let parquet = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet"));
        let write = || -> Result<(), IoError> {
            let folder = file.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let mut part = tempfile::NamedTempFile::new_in(folder)?;
            let mut to = BufWriter::new(part.as_file_mut());
            if parquet {
                self.to_parquet(&mut to)?
            } else {
                self.to_csv(&mut to)?
            }
            to.flush()?;
            drop(to);
            readable_by_others(part.as_file())?;
            part.persist(file).map(|_| ()).map_err(|e| e.error)
        };
        write().map_err(|source| SignalsError::Write { file: file.into(), source })
    }

    fn to_csv(&self, to: &mut impl Write) -> Result<(), IoError> {
        let mut csv = csv::Writer::from_writer(to);
        csv.write_record(self.columns.iter().map(|c| c.0.as_str()))?;
        let mut cell = Vec::new();
        for row in 0..self.columns.first().map_or(0, |c| c.1.len()) {
            for x in self.columns.iter().map(|c| c.1[row]) {
                cell.clear();
                if !x.is_nan() {
                    // The shortest text that reads back as the same double.
                    write!(cell, "{x:?}")?;
                }
                csv.write_field(&cell)?;
            }
            csv.write_record(None::<&[u8]>)?;
        }
        csv.flush()
    }

    fn to_parquet(&self, to: &mut (impl Write + Send)) -> Result<(), IoError> {
        let whole = |column: &[f64]| !column.iter().any(|x| x.is_nan());
        let mut fields = Vec::new();
        for (name, column) in &self.columns {
            let repetition = if whole(column) { Repetition::REQUIRED } else { Repetition::OPTIONAL };
            let field = Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(repetition);
            fields.push(field.build().map(Arc::new)?);
        }
        let schema = Type::group_type_builder("table").with_fields(fields).build()?;
        let properties = WriterProperties::builder().build();
        let mut file = SerializedFileWriter::new(to, Arc::new(schema), Arc::new(properties))?;
        let mut group = file.next_row_group()?;
        for (_, column) in &self.columns {
            let Some(mut writer) = group.next_column()? else { break };
            if whole(column) {
                writer.typed::<DoubleType>().write_batch(column, None, None)?;
            } else {
                let values: Vec<f64> = column.iter().copied().filter(|x| !x.is_nan()).collect();
                let levels: Vec<i16> = column.iter().map(|x| i16::from(!x.is_nan())).collect();
                writer.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
            }
            writer.close()?;
        }
        group.close()?;
        file.close()?;
        Ok(())
    }
}

/// Temporary files are for their user alone; a result is not.
#[cfg(unix)]
fn readable_by_others(file: &std::fs::File) -> Result<(), IoError> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn readable_by_others(_: &std::fs::File) -> Result<(), IoError> {
    Ok(())
}
