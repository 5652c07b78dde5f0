//! Parquet: one flat table, numbers and Booleans.

mod pages;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use parquet::basic::Type as Physical;
use parquet::column::reader::ColumnReader;
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{ChunkReader, FileReader, Length, SerializedFileReader};

use super::Table;
use super::guard::guarded;
use crate::finding::{Finding, Kind};

pub(super) fn read(file: &Path, open: File, findings: &mut Vec<Finding>) -> Option<Table> {
    let mend =
        "write a flat table of numbers, uncompressed or with Snappy (pandas: to_parquet(...) as it is)";
    let table = guarded(|| all(open).map_err(|e| e.to_string())).and_then(|done| done);
    let wrong = match table {
        Ok(table) => return Some(table),
        Err(e) => {
            Finding::error(Kind::Unreadable, file, format!("no Parquet file that can be read: {e}"), mend)
        }
    };
    findings.push(wrong);
    None
}

/// A row takes a byte at least for so many of them, whatever its encoding.
const ROWS_PER_BYTE: u64 = 256;

fn all(open: File) -> Result<Table, ParquetError> {
    let general = |what: String| ParquetError::General(what);
    let size = open.len();
    let copy = open.try_clone().map_err(|e| general(e.to_string()))?;
    let reader = SerializedFileReader::new(open)?;
    // What is damaged may announce anything: no memory is taken for it before it is seen to be there.
    let groups = reader.metadata().row_groups();
    let rows = groups.iter().map(|g| u64::try_from(g.num_rows()).unwrap_or(u64::MAX));
    if rows.fold(0, u64::saturating_add) > size.saturating_mul(ROWS_PER_BYTE) {
        return Err(general(format!("more rows than {size} bytes can hold")));
    }
    for chunk in groups.iter().flat_map(|g| g.columns()) {
        let begin = chunk
            .dictionary_page_offset()
            .map_or(chunk.data_page_offset(), |d| d.min(chunk.data_page_offset()));
        let place = u64::try_from(begin).ok().zip(u64::try_from(chunk.compressed_size()).ok());
        let place = place.filter(|(begin, length)| begin.checked_add(*length).is_some_and(|end| end <= size));
        let Some((begin, length)) = place else {
            return Err(general("a column lies beyond the end of the file".into()));
        };
        let mut bytes = Vec::new();
        copy.get_read(begin)?.take(length).read_to_end(&mut bytes).map_err(|e| general(e.to_string()))?;
        pages::check(&bytes).map_err(general)?;
    }
    columns(&reader)
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
