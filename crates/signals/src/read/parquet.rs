//! Parquet: one table of numbers, Booleans, times and lists of numbers.

mod arrow;
mod pages;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use parquet::basic::{ConvertedType, LogicalType, TimeUnit, Type as Physical};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{ChunkReader, FileReader, Length, SerializedFileReader};
use parquet::schema::types::ColumnDescriptor;

use super::guard::guarded;
use super::table::{ClockTicks, LONG, ReadTable, TableColumn, WantedColumns};
use crate::finding::{Finding, FindingKind};

pub(super) fn read(
    file: &Path,
    open: File,
    wanted: WantedColumns,
    findings: &mut Vec<Finding>,
) -> Option<ReadTable> {
    let again = "export the recording again";
    if open.len() == 0 {
        findings.push(Finding::error(FindingKind::EmptyFile, file, "the file is empty", again));
        return None;
    }
    let mend = "write a flat table of numbers, uncompressed or with Snappy, zstd or gzip (pandas: to_parquet(...) as it is)";
    let table = guarded(|| all(open, wanted).map_err(|e| e.to_string())).and_then(|done| done);
    let wrong = match table {
        Ok(table) if table.columns.iter().all(|c| c.values.is_empty()) && !table.columns.is_empty() => {
            Finding::error(FindingKind::EmptyFile, file, "the table has columns and no row", again)
        }
        Ok(table) if table.columns.is_empty() => {
            let left = table.skipped.join("; ");
            let what = if left.is_empty() { "the table has no column".to_owned() } else { left };
            Finding::error(FindingKind::EmptyFile, file, what, "save the signals as columns of numbers")
        }
        Ok(table) => return Some(table),
        Err(e) => Finding::error(
            FindingKind::Unreadable,
            file,
            format!("no Parquet file that can be read: {e}"),
            mend,
        ),
    };
    findings.push(wrong);
    None
}

/// A row takes a byte at least for so many of them, whatever its encoding.
const ROWS_PER_BYTE: u64 = 256;

fn all(open: File, wanted: WantedColumns) -> Result<ReadTable, ParquetError> {
    let general = |what: String| ParquetError::General(what);
    let size = open.len();
    let copy = open.try_clone().map_err(|e| general(e.to_string()))?;
    let reader = SerializedFileReader::new(open)?;
    // What is damaged may announce anything: memory is allocated only for what is there.
    let groups = reader.metadata().row_groups();
    let rows = groups.iter().map(|g| u64::try_from(g.num_rows()).unwrap_or(u64::MAX));
    let rows = rows.fold(0, u64::saturating_add);
    if rows > size.saturating_mul(ROWS_PER_BYTE) {
        return Err(general(format!("more rows than {size} bytes can hold")));
    }
    if rows == 0 {
        // Its columns have no pages to look at.
        let schema = reader.metadata().file_metadata().schema_descr();
        let names = schema.columns().iter().map(|c| TableColumn::numbers(c.path().string(), Vec::new()));
        return Ok(ReadTable { columns: names.collect(), ..ReadTable::default() });
    }
    for chunk in groups.iter().flat_map(|g| g.columns()) {
        let begin = chunk
            .dictionary_page_offset()
            .map_or(chunk.data_page_offset(), |d| d.min(chunk.data_page_offset()));
        let place = u64::try_from(begin).ok().zip(u64::try_from(chunk.compressed_size()).ok());
        let place = place.filter(|(begin, length)| begin.checked_add(*length).is_some_and(|end| end <= size));
        let Some((begin, length)) = place else {
            return Err(general("a column is beyond the end of the file".into()));
        };
        let mut bytes = Vec::new();
        copy.get_read(begin)?.take(length).read_to_end(&mut bytes).map_err(|e| general(e.to_string()))?;
        pages::check(&bytes).map_err(general)?;
    }
    columns(&reader, wanted)
}

/// What the numbers of a column are.
#[derive(Clone, Copy, PartialEq)]
enum Meaning {
    Plain,
    /// Of 64 bits without a sign.
    Unsigned,
    /// Times ten to the power of minus this.
    Decimal(i32),
    /// Of 16 bits.
    Half,
    /// Times: counts a second, and whether they count from the beginning of 1970.
    Time(f64, bool),
    Text,
    /// What no number can be made of.
    Other,
}

fn meaning(column: &ColumnDescriptor, durations: &[(String, f64)]) -> Meaning {
    let per_second = |unit: &TimeUnit| match unit {
        TimeUnit::MILLIS => 1e3,
        TimeUnit::MICROS => 1e6,
        TimeUnit::NANOS => 1e9,
    };
    let duration = durations.iter().find(|(name, _)| column.path().parts() == std::slice::from_ref(name));
    let bytes = matches!(column.physical_type(), Physical::BYTE_ARRAY | Physical::FIXED_LEN_BYTE_ARRAY);
    match (column.logical_type_ref(), column.converted_type()) {
        (Some(LogicalType::Timestamp(t)), _) => Meaning::Time(per_second(&t.unit), true),
        (Some(LogicalType::Time(t)), _) => Meaning::Time(per_second(&t.unit), false),
        (Some(LogicalType::Decimal(d)), _) => Meaning::Decimal(d.scale),
        (Some(LogicalType::Float16), _) => Meaning::Half,
        (Some(LogicalType::Integer(i)), _) if !i.is_signed && i.bit_width == 64 => Meaning::Unsigned,
        (Some(LogicalType::Date), _) | (None, ConvertedType::DATE) => Meaning::Time(1.0 / 86_400.0, true),
        (Some(LogicalType::String), _) | (None, ConvertedType::UTF8) => Meaning::Text,
        (None, ConvertedType::TIMESTAMP_MILLIS) => Meaning::Time(1e3, true),
        (None, ConvertedType::TIMESTAMP_MICROS) => Meaning::Time(1e6, true),
        (None, ConvertedType::TIME_MILLIS) => Meaning::Time(1e3, false),
        (None, ConvertedType::TIME_MICROS) => Meaning::Time(1e6, false),
        (None, ConvertedType::UINT_64) => Meaning::Unsigned,
        (None, ConvertedType::DECIMAL) => Meaning::Decimal(column.type_scale()),
        _ if column.physical_type() == Physical::INT96 => Meaning::Time(1e9, true),
        _ if bytes => Meaning::Other,
        _ => duration.map_or(Meaning::Plain, |(_, per_second)| Meaning::Time(*per_second, false)),
    }
}

/// A cell as it is in the file.
#[derive(Clone, Copy)]
enum RawColumn {
    Real(f64),
    Whole(i64),
}

fn columns(reader: &SerializedFileReader<File>, wanted: WantedColumns) -> Result<ReadTable, ParquetError> {
    let mut table = ReadTable::default();
    let metadata = reader.metadata().file_metadata();
    let keys = metadata.key_value_metadata().map_or(&[][..], Vec::as_slice);
    let value = |key: &str| keys.iter().find(|k| k.key == key).and_then(|k| k.value.clone());
    let durations = value("ARROW:schema").map(|text| arrow::durations(&text)).unwrap_or_default();
    let schema = metadata.schema_descr();
    for i in 0..schema.num_columns() {
        let column = schema.column(i);
        let meaning = meaning(&column, &durations);
        let list = column.max_rep_level() > 0;
        // Of a list `u.list.element`: the column is `u`.
        let name = match column.path().parts() {
            [name, ..] if list => name.clone(),
            _ => column.path().string(),
        };
        let readable = match meaning {
            Meaning::Other => false,
            Meaning::Text => wanted == WantedColumns::Texts && !list,
            Meaning::Time(..) => !list,
            _ => column.max_rep_level() <= 1,
        };
        if !readable {
            table.skipped.push(format!("the column `{name}` is no column of numbers and is left out"));
            continue;
        }
        let unit = value(&format!("unit.{name}"));
        if meaning == Meaning::Text {
            let texts = texts(reader, i, column.max_def_level())?;
            let words = texts.iter().filter(|t| !t.is_empty()).count();
            let values = vec![f64::NAN; texts.len()];
            table.columns.push(TableColumn { texts, words, unit, ..TableColumn::numbers(name, values) });
            continue;
        }
        let mut cells = CellsOf { defined: column.max_def_level(), ..CellsOf::default() };
        for group in 0..reader.num_row_groups() {
            let group = reader.get_row_group(group)?;
            let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
            match group.get_column_reader(i)? {
                ColumnReader::BoolColumnReader(mut r) => {
                    cells.fill(&mut r, rows, |x| RawColumn::Whole((*x).into()))?
                }
                ColumnReader::Int32ColumnReader(mut r) => {
                    cells.fill(&mut r, rows, |x| RawColumn::Whole((*x).into()))?
                }
                ColumnReader::Int64ColumnReader(mut r) => {
                    cells.fill(&mut r, rows, |x| RawColumn::Whole(*x))?
                }
                ColumnReader::Int96ColumnReader(mut r) => {
                    cells.fill(&mut r, rows, |x| RawColumn::Whole(x.to_nanos()))?
                }
                ColumnReader::FloatColumnReader(mut r) => {
                    cells.fill(&mut r, rows, |x| RawColumn::Real((*x).into()))?
                }
                ColumnReader::DoubleColumnReader(mut r) => {
                    cells.fill(&mut r, rows, |x| RawColumn::Real(*x))?
                }
                ColumnReader::FixedLenByteArrayColumnReader(mut r) => {
                    cells.fill(&mut r, rows, |x| RawColumn::Real(of_bytes(x.data(), meaning)))?
                }
                ColumnReader::ByteArrayColumnReader(mut r) => {
                    cells.fill(&mut r, rows, |x| RawColumn::Real(of_bytes(x.data(), meaning)))?
                }
            }
        }
        let Some(width) = cells.width(list) else {
            table
                .skipped
                .push(format!("the lists of the column `{name}` are not all of one length; it is left out"));
            continue;
        };
        for mut made in cells.columns(&name, width, list, meaning, wanted) {
            made.unit = unit.clone();
            table.columns.push(made);
        }
    }
    let rows = table.columns.first().map_or(0, |c| c.values.len());
    if table.columns.iter().any(|c| c.values.len() != rows) {
        return Err(ParquetError::General("columns of different lengths".into()));
    }
    Ok(table)
}

/// A number that is written as bytes: a decimal, the highest byte first, or a `Float16`, the lowest byte first.
fn of_bytes(bytes: &[u8], meaning: Meaning) -> f64 {
    match (meaning, bytes) {
        (Meaning::Decimal(scale), [first, rest @ ..]) => {
            let whole =
                rest.iter().fold(f64::from(first.cast_signed()), |sum, b| 256.0 * sum + f64::from(*b));
            whole / 10_f64.powi(scale)
        }
        (Meaning::Half, [low, high]) => half::f16::from_le_bytes([*low, *high]).to_f64(),
        _ => f64::NAN,
    }
}

/// The cells of a column, and of lists how many there are in each row.
#[derive(Default)]
struct CellsOf {
    cells: Vec<Option<RawColumn>>,
    lengths: Vec<usize>,
    defined: i16,
}

impl CellsOf {
    fn fill<T: DataType>(
        &mut self,
        reader: &mut ColumnReaderImpl<T>,
        rows: usize,
        raw: impl Fn(&T::T) -> RawColumn,
    ) -> Result<(), ParquetError> {
        let (mut batch, mut levels, mut repeats) = (Vec::new(), Vec::new(), Vec::new());
        let mut left = rows;
        while left > 0 {
            batch.clear();
            levels.clear();
            repeats.clear();
            let most = left.min(1 << 16);
            let (records, ..) =
                reader.read_records(most, Some(&mut levels), Some(&mut repeats), &mut batch)?;
            if records == 0 {
                return Err(ParquetError::General("fewer rows than announced".into()));
            }
            left = left.saturating_sub(records);
            let mut found = batch.iter();
            if self.defined == 0 {
                self.cells.extend(found.map(|x| Some(raw(x))));
                continue;
            }
            for (k, level) in levels.iter().enumerate() {
                if repeats.get(k).is_none_or(|r| *r == 0) {
                    self.lengths.push(0);
                }
                // Of a list: below this level there is no element at all.
                let element = repeats.is_empty() || *level + 1 >= self.defined;
                if let (true, Some(length)) = (element, self.lengths.last_mut()) {
                    *length += 1;
                    let value = if *level == self.defined { found.next().map(&raw) } else { None };
                    self.cells.push(value);
                }
            }
        }
        Ok(())
    }

    /// Elements a row; none: it differs. A missing list gives no number.
    fn width(&self, list: bool) -> Option<usize> {
        let mut lengths = self.lengths.iter().copied().filter(|n| *n > 0);
        let width = if list { lengths.next().unwrap_or(1) } else { 1 };
        lengths.all(|n| n == width).then_some(width)
    }

    fn columns(
        self,
        name: &str,
        width: usize,
        list: bool,
        meaning: Meaning,
        wanted: WantedColumns,
    ) -> Vec<TableColumn> {
        let mut cells = self.cells;
        if list {
            let mut given = cells.into_iter();
            let row = |n: &usize| if *n == 0 { vec![None; width] } else { given.by_ref().take(*n).collect() };
            cells = self.lengths.iter().flat_map(row).collect();
        }
        if let Meaning::Time(per_second, of_epoch) = meaning {
            let count = |cell: &Option<RawColumn>| match cell {
                Some(RawColumn::Whole(n)) => Some(*n),
                _ => None,
            };
            let counts: Vec<_> = cells.iter().map(count).collect();
            let values = counts.iter().map(|n| n.map_or(f64::NAN, |n| n as f64 / per_second)).collect();
            let ticks = Some(ClockTicks { counts, per_second, of_epoch });
            return vec![TableColumn { ticks, ..TableColumn::numbers(name, values) }];
        }
        let number = |cell: &Option<RawColumn>| match (cell, meaning) {
            (None, _) => f64::NAN,
            (Some(RawColumn::Real(x)), _) => *x,
            (Some(RawColumn::Whole(n)), Meaning::Unsigned) => n.cast_unsigned() as f64,
            (Some(RawColumn::Whole(n)), Meaning::Decimal(scale)) => *n as f64 / 10_f64.powi(scale),
            (Some(RawColumn::Whole(n)), _) => *n as f64,
        };
        let values: Vec<f64> = cells.iter().map(number).collect();
        let whole = cells.iter().any(|c| matches!(c, Some(RawColumn::Whole(_))))
            && !matches!(meaning, Meaning::Decimal(_));
        let keep =
            whole && (wanted == WantedColumns::Texts || values.first().is_some_and(|x| x.abs() >= LONG));
        let text = |cell: &Option<RawColumn>| match (cell, meaning) {
            (Some(RawColumn::Whole(n)), Meaning::Unsigned) => n.cast_unsigned().to_string(),
            (Some(RawColumn::Whole(n)), _) => n.to_string(),
            _ => String::new(),
        };
        let texts: Vec<String> = if keep { cells.iter().map(text).collect() } else { Vec::new() };
        if !list {
            return vec![TableColumn { texts, ..TableColumn::numbers(name, values) }];
        }
        let texts: Vec<String> = texts.chunks(width).map(|row| row.join(" ")).collect();
        TableColumn::elements(name, width, &values, &texts)
    }
}

fn texts(
    reader: &SerializedFileReader<File>,
    column: usize,
    defined: i16,
) -> Result<Vec<String>, ParquetError> {
    let mut texts = Vec::new();
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group)?;
        let mut left = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
        let ColumnReader::ByteArrayColumnReader(mut r) = group.get_column_reader(column)? else { continue };
        while left > 0 {
            let (mut batch, mut levels) = (Vec::new(), Vec::new());
            let (records, ..) = r.read_records(left.min(1 << 16), Some(&mut levels), None, &mut batch)?;
            if records == 0 {
                return Err(ParquetError::General("fewer rows than announced".into()));
            }
            left = left.saturating_sub(records);
            let mut found = batch.iter().map(|b| String::from_utf8_lossy(b.data()).into_owned());
            if defined == 0 {
                texts.extend(found);
            } else {
                texts.extend(
                    levels
                        .iter()
                        .map(|l| if *l == defined { found.next() } else { None }.unwrap_or_default()),
                );
            }
        }
    }
    Ok(texts)
}
