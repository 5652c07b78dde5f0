//! Results of others for the runs of a sweep: a table whose rows are found again by the factors' values.

use std::path::Path;

use crate::design::SweepDesign;
use crate::error::SweepError;
use crate::file::SweepFile;
use crate::value::FactorValue;

/// Values this near, as a part of the larger one, are the same.
const SAME: f64 = 1e-9;

/// Texts to the runs of a sweep.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunNotes {
    /// Names of the columns that are no factors, in the order of the file.
    pub columns: Vec<String>,
    /// Of each run, in their order, a text per column; empty: none.
    pub texts: Vec<Vec<String>>,
}

impl RunNotes {
    /// Reads a table as CSV: a column per factor with its values, and any columns of texts. A row goes to each run with its
    /// values; runs without a row have no text.
    ///
    /// # Errors
    /// [`SweepError::File`] with the line: a factor has no column, a row fits no run, the file cannot be read.
    pub fn read(file: &Path, sweep: &SweepFile, design: &SweepDesign) -> Result<Self, SweepError> {
        let fail = |e: csv::Error| SweepError::at(file, e);
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(file).map_err(fail)?;
        let head = reader.headers().map_err(fail)?.clone();
        let place = |name: &str| head.iter().position(|h| h == name);
        let mut at = Vec::new();
        for factor in &sweep.factors {
            let missing = || {
                let all: Vec<&str> = sweep.factors.iter().map(|f| f.name.as_str()).collect();
                let mend = format!("the first line names the factors ({}) and the texts", all.join(", "));
                SweepError::at(file, format!("line 1: the factor `{}` has no column; {mend}", factor.name))
            };
            at.push(place(&factor.name).ok_or_else(missing)?);
        }
        let others: Vec<usize> = (0..head.len()).filter(|k| !at.contains(k)).collect();
        let columns = others.iter().map(|k| head[*k].to_owned()).collect();
        let runs = design.runs();
        let mut texts = vec![vec![String::new(); others.len()]; runs as usize];
        for row in reader.records() {
            let row = row.map_err(fail)?;
            let fits = |run: &u64| at.iter().enumerate().all(|(f, k)| same(&design.value(f, *run), &row[*k]));
            let mut found = false;
            for run in (1..=runs).filter(fits) {
                found = true;
                texts[run as usize - 1] = others.iter().map(|k| row[*k].to_owned()).collect();
            }
            if !found {
                let line = row.position().map_or(0, csv::Position::line);
                let said: Vec<String> = sweep
                    .factors
                    .iter()
                    .zip(&at)
                    .map(|(f, k)| format!("{} = {}", f.name, &row[*k]))
                    .collect();
                let why = format!("line {line}: no run has {}", said.join(", "));
                return Err(SweepError::at(file, format!("{why}; write values that the sweep takes")));
            }
        }
        Ok(Self { columns, texts })
    }
}

fn same(value: &FactorValue, text: &str) -> bool {
    let number = match value {
        FactorValue::Number(x) => Some(*x),
        FactorValue::Integer(n) => Some(*n as f64),
        FactorValue::Boolean(_) | FactorValue::Text(_) => None,
    };
    match (number, text.parse::<f64>()) {
        (Some(a), Ok(b)) => (a - b).abs() <= SAME * a.abs().max(b.abs()),
        _ => value.text() == text,
    }
}
