//! Results as CSV.

use std::io::{Error as IoError, Result, Write};

use super::{Column, Part, Row, Value, slots};

pub(super) struct Writer {
    csv: csv::Writer<Part>,
    /// With the slot of each.
    columns: Vec<(Column, usize)>,
    cell: Vec<u8>,
}

impl Writer {
    pub(super) fn new(part: Part) -> Self {
        Self { csv: csv::Writer::from_writer(part), columns: Vec::new(), cell: Vec::new() }
    }

    pub(super) fn begin(&mut self, columns: &[Column]) -> Result<()> {
        self.columns = columns.iter().cloned().zip(slots(columns)).collect();
        let names = columns.iter().map(|c| c.name.as_str());
        Ok(self.csv.write_record(std::iter::once("time").chain(names))?)
    }

    pub(super) fn row(&mut self, row: Row<'_>) -> Result<()> {
        let Self { csv, columns, cell } = self;
        let mut digits = ryu::Buffer::new(); // the shortest that read back as the same bits
        csv.write_field(digits.format(row.time))?;
        for (column, slot) in &*columns {
            cell.clear();
            if column.is_due(row.point) {
                match row.values.get(column.kind, *slot) {
                    Value::Real(x) => cell.extend_from_slice(digits.format(x).as_bytes()),
                    Value::Single(x) => cell.extend_from_slice(digits.format(x).as_bytes()),
                    Value::Integer(x) => write!(cell, "{x}")?,
                    Value::Unsigned(x) => write!(cell, "{x}")?,
                    Value::Boolean(x) => cell.push(b'0' + u8::from(x)),
                    Value::Text(x) => cell.extend_from_slice(x.as_bytes()),
                }
            }
            csv.write_field(&*cell)?;
        }
        Ok(csv.write_record(None::<&[u8]>)?)
    }

    pub(super) fn finish(self) -> Result<Part> {
        self.csv.into_inner().map_err(|e| IoError::other(e.to_string()))
    }
}
