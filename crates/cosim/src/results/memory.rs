//! Results kept in memory.

use super::{Column, Row, Sink, Value, slots};
use crate::error::Error;

/// Keeps the results as series of numbers, for plots and measures. Integers and Booleans become floats; a text or a
/// column that is not due is `NaN`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Memory {
    columns: Vec<Column>,
    slots: Vec<usize>,
    time: Vec<f64>,
    series: Vec<Vec<f64>>,
}

impl Memory {
    /// The columns.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Times in s.
    pub fn time(&self) -> &[f64] {
        &self.time
    }

    /// The values of each column, as long as [`time`](Self::time).
    pub fn series(&self) -> &[Vec<f64>] {
        &self.series
    }

    /// The values of the column of that name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        let at = self.columns.iter().position(|c| c.name == name)?;
        Some(&self.series[at])
    }
}

impl Sink for Memory {
    fn begin(&mut self, columns: &[Column]) -> Result<(), Error> {
        *self = Self {
            columns: columns.to_vec(),
            slots: slots(columns),
            time: Vec::new(),
            series: vec![Vec::new(); columns.len()],
        };
        Ok(())
    }

    fn row(&mut self, row: Row<'_>) -> Result<(), Error> {
        self.time.push(row.time);
        for ((column, slot), series) in self.columns.iter().zip(&self.slots).zip(&mut self.series) {
            let value = match row.values.get(column.kind, *slot) {
                _ if !column.is_due(row.point) => f64::NAN,
                Value::Real(x) => x,
                Value::Single(x) => f64::from(x),
                Value::Integer(x) => x as f64,
                Value::Unsigned(x) => x as f64,
                Value::Boolean(x) => f64::from(u8::from(x)),
                Value::Text(_) => f64::NAN,
            };
            series.push(value);
        }
        Ok(())
    }
}
