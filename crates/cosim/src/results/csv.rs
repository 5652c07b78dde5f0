//! Results as CSV.

use std::io::{Error as IoError, Result, Write};

use super::{PartialFile, ResultColumn, ResultRow, RowValue, slots};

pub(super) struct CsvWriter {
    csv: csv::Writer<PartialFile>,
    /// With the slot of each.
    columns: Vec<(ResultColumn, usize)>,
    cell: Vec<u8>,
}

impl CsvWriter {
    pub(super) fn new(part: PartialFile) -> Self {
        Self { csv: csv::Writer::from_writer(part), columns: Vec::new(), cell: Vec::new() }
    }

    pub(super) fn begin(&mut self, columns: &[ResultColumn]) -> Result<()> {
        self.columns = columns.iter().cloned().zip(slots(columns)).collect();
        let names = columns.iter().map(|c| c.name.as_str());
        Ok(self.csv.write_record(std::iter::once("time").chain(names))?)
    }

    pub(super) fn row(&mut self, row: ResultRow<'_>) -> Result<()> {
        let Self { csv, columns, cell } = self;
        let mut digits = ryu::Buffer::new(); // the shortest that read back as the same bits
        csv.write_field(digits.format(row.time))?;
        for (column, slot) in &*columns {
            cell.clear();
            if column.is_due(row.point) {
                match row.values.get(column.kind, *slot) {
                    RowValue::Real(x) => cell.extend_from_slice(digits.format(x).as_bytes()),
                    RowValue::Single(x) => cell.extend_from_slice(digits.format(x).as_bytes()),
                    RowValue::Integer(x) => write!(cell, "{x}")?,
                    RowValue::Unsigned(x) => write!(cell, "{x}")?,
                    RowValue::Boolean(x) => cell.push(b'0' + u8::from(x)),
                    RowValue::Text(x) => cell.extend_from_slice(x.as_bytes()),
                }
            }
            csv.write_field(&*cell)?;
        }
        Ok(csv.write_record(None::<&[u8]>)?)
    }

    pub(super) fn finish(self) -> Result<PartialFile> {
        self.csv.into_inner().map_err(|e| IoError::other(e.to_string()))
    }
}
