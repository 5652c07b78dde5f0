//! Results kept in memory.

use super::{ResultColumn, ResultRow, ResultSink, RowValue, slots};
use crate::error::CosimError;

/// Keeps the results as series of numbers, for plots and measures. Integers and Booleans become floats; a text or a
/// column that is not due is `NaN`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SeriesMemory {
    columns: Vec<ResultColumn>,
    slots: Vec<usize>,
    time: Vec<f64>,
    series: Vec<Vec<f64>>,
}

impl SeriesMemory {
    /// The columns.
    pub fn columns(&self) -> &[ResultColumn] {
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

impl ResultSink for SeriesMemory {
    fn begin(&mut self, columns: &[ResultColumn]) -> Result<(), CosimError> {
        *self = Self {
            columns: columns.to_vec(),
            slots: slots(columns),
            time: Vec::new(),
            series: vec![Vec::new(); columns.len()],
        };
        Ok(())
    }

    fn row(&mut self, row: ResultRow<'_>) -> Result<(), CosimError> {
        self.time.push(row.time);
        for ((column, slot), series) in self.columns.iter().zip(&self.slots).zip(&mut self.series) {
            let value = match row.values.get(column.kind, *slot) {
                _ if !column.is_due(row.point) => f64::NAN,
                RowValue::Real(x) => x,
                RowValue::Single(x) => f64::from(x),
                RowValue::Integer(x) => x as f64,
                RowValue::Unsigned(x) => x as f64,
                RowValue::Boolean(x) => f64::from(u8::from(x)),
                RowValue::Text(_) => f64::NAN,
            };
            series.push(value);
        }
        Ok(())
    }
}
