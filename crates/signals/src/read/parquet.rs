//! Parquet: one flat table, numbers and Booleans.

use std::fs::File;
use std::path::Path;

use parquet::basic::Type as Physical;
use parquet::column::reader::ColumnReader;
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};

use super::Table;
use crate::finding::{Finding, Kind};

pub(super) fn read(file: &Path, open: File, findings: &mut Vec<Finding>) -> Option<Table> {
    let mend =
        "write a flat table of numbers, uncompressed or with Snappy (pandas: to_parquet(...) as it is)";
    let table = SerializedFileReader::new(open).and_then(|reader| columns(&reader));
    let wrong = match table {
        Ok(table) => return Some(table),
        Err(e) => {
            Finding::error(Kind::Unreadable, file, format!("no Parquet file that can be read: {e}"), mend)
        }
    };
    findings.push(wrong);
    None
}

fn columns(reader: &SerializedFileReader<File>) -> Result<Table, ParquetError> {
    let mut table = Table::default();
    let schema = reader.metadata().file_metadata().schema_descr();
    for i in 0..schema.num_columns() {
        let column = schema.column(i);
        let name = column.path().string();
        let number = !matches!(
            column.physical_type(),
            Physical::BYTE_ARRAY | Physical::FIXED_LEN_BYTE_ARRAY | Physical::INT96
        );
        if !number || column.max_rep_level() > 0 {
            table.skipped.push(format!("the column `{name}` is no column of numbers and is left out"));
            continue;
        }
        let mut values = Vec::new();
        for group in 0..reader.num_row_groups() {
            let group = reader.get_row_group(group)?;
            let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
            let defined = column.max_def_level();
            match group.get_column_reader(i)? {
                ColumnReader::BoolColumnReader(mut r) => {
                    fill(&mut r, rows, defined, &mut values, |x| f64::from(u8::from(*x)))?;
                }
                ColumnReader::Int32ColumnReader(mut r) => {
                    fill(&mut r, rows, defined, &mut values, |x| f64::from(*x))?
                }
                ColumnReader::Int64ColumnReader(mut r) => {
                    fill(&mut r, rows, defined, &mut values, |x| *x as f64)?
                }
                ColumnReader::FloatColumnReader(mut r) => {
                    fill(&mut r, rows, defined, &mut values, |x| f64::from(*x))?
                }
                ColumnReader::DoubleColumnReader(mut r) => fill(&mut r, rows, defined, &mut values, |x| *x)?,
                _ => {}
            }
        }
        table.names.push(name);
        table.columns.push(values);
    }
    let rows = table.columns.first().map_or(0, Vec::len);
    if table.columns.iter().any(|c| c.len() != rows) {
        return Err(ParquetError::General("columns of different lengths".into()));
    }
    Ok(table)
}

fn fill<T: DataType>(
    reader: &mut parquet::column::reader::ColumnReaderImpl<T>,
    rows: usize,
    defined: i16,
    values: &mut Vec<f64>,
    number: impl Fn(&T::T) -> f64,
) -> Result<(), ParquetError> {
    let (mut batch, mut levels) = (Vec::new(), Vec::new());
    let mut left = rows;
    while left > 0 {
        batch.clear();
        levels.clear();
        let (records, ..) = reader.read_records(left.min(1 << 16), Some(&mut levels), None, &mut batch)?;
        if records == 0 {
            return Err(ParquetError::General("fewer rows than announced".into()));
        }
        left = left.saturating_sub(records);
        let mut found = batch.iter();
        if defined == 0 {
            values.extend(found.map(&number));
        } else {
            let cell = |level: &i16| if *level == defined { found.next().map(&number) } else { None };
            values.extend(levels.iter().map(cell).map(|x| x.unwrap_or(f64::NAN)));
        }
    }
    Ok(())
}
